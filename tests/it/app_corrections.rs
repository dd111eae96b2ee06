//! The unit and the carved side of scans, corrected by requests to `mocban app`: what is refused, and what changes.

use std::path::Path;

use serde_json::{Value, json};

use crate::app::{act, app, html, open_app, text, with_project};
use crate::app_choice::import_more;
use crate::block_view::finished_block;
use crate::cli::mocban;
use crate::page::{Page, read_project};
use crate::waiting::{run_ends, wait_until};

const CORRECT: &str = "/p/p/actions/correct";

/// Returns the unit and the side of a pair.
fn said(project: &Path, pair: &str) -> [Value; 2] {
    let shown = mocban(project, &["show", pair, "--json"]).expect(0).json();
    ["unit", "scanned_face_down"].map(|name| shown[name].clone())
}

/// Sends a correction and asserts that it is refused for a reason.
#[track_caller]
fn refused(page: &Page, body: &Value, why: &str) {
    let reply = act(page, CORRECT, body, |_| {});
    assert_eq!(reply.status, 422, "{body}: {}", text(&reply));
    let error = reply.json()["error"].to_string();
    assert!(error.contains(why), "{body}: {error}");
}

#[test]
fn a_correction_is_refused_unless_the_page_showed_it() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let before = said(&project, "upright-0001");
    let unit = |unit: &str, shown: &str| json!({"what": "unit", "pair": "upright-0001", "unit": unit, "shown": shown});
    refused(&page, &unit("cm", "2"), "other pairs have failed meanwhile");
    for wrong in ["", "km"] {
        refused(&page, &unit(wrong, "1"), "choose the unit");
    }
    refused(&page, &unit("mm", "1"), "nothing was changed");
    let nobody = json!({"what": "side", "pair": "nobody", "shown": "1"});
    assert_eq!(act(&page, CORRECT, &nobody, |_| {}).status, 404);
    let nothing = json!({"what": "side", "shown": "1"});
    assert_eq!(act(&page, CORRECT, &nothing, |_| {}).status, 404);
    assert_eq!(said(&project, "upright-0001"), before);
    for path in [
        "correct",
        "correct?what=unit",
        "correct?what=x&pair=upright-0001",
    ] {
        assert_eq!(page.get(&format!("/p/p/{path}")).status, 404, "{path}");
    }
    let none = html(&page, "/p/p/correct?what=unit&class=bad_input");
    assert!(none.contains("No pair failed for this reason"), "{none}");
}

#[test]
fn a_correction_waits_for_the_end_of_a_run() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let root = dir.path().canonicalize().expect("a path");
    let project = root.join("p");
    import_more(&root, ["late".to_owned()]);
    let hold = root.join("hold");
    let mut command = app(&root);
    command.args(["--lang", "en"]);
    command.env("MOCBAN_HOLD_AT", "fit:computed");
    command.env("MOCBAN_HOLD_FILE", &hold);
    let page = Page::of(&mut command).entered();
    let run = act(&page, "/p/p/actions/run", &json!({"which": "all"}), |_| {});
    assert_eq!(run.status, 200, "{}", text(&run));
    wait_until("the run is held", || hold.exists());
    let before = said(&project, "upright-0001");
    let side = json!({"what": "side", "pair": "upright-0001", "shown": "1"});
    refused(&page, &side, "a run is in progress");
    let shown = html(&page, "/p/p/correct?what=side&pair=upright-0001");
    assert!(shown.contains("id=\"running\""), "{shown}");
    assert_eq!(said(&project, "upright-0001"), before);
    std::fs::remove_file(&hold).expect("the run waits");
    run_ends(&project);
    mocban(&project, &["check"]).expect(0);
}

#[test]
fn a_pair_of_a_block_keeps_the_unit_of_its_block() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = open_app(dir.path());
    let block = html(&page, "/p/p/block/b1/");
    let pair = block.split("href=\"../../pair/").nth(1);
    let pair = pair.and_then(|rest| rest.split('/').next());
    let pair = pair.expect("a pair of the block");
    let shown = html(&page, &format!("/p/p/pair/{pair}/"));
    assert!(!shown.contains("correct?what="), "{shown}");
    let unit = json!({"what": "unit", "pair": pair, "unit": "m", "shown": "1"});
    refused(&page, &unit, "cut from a whole block");
}
