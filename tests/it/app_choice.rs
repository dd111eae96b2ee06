//! Pairs that are chosen in a list of the app, and what is done with them.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::app::{act, app, open_app, text, with_project};
use crate::app_export_zip::export;
use crate::cli::{mocban, status};
use crate::page::{Page, Site, answer, read_project};
use crate::waiting::wait_until;

const CHOSEN: &str = "/p/p/actions/chosen";

/// Returns the body of an action on pairs.
pub(crate) fn chosen(change: &str, pairs: &[&str]) -> Value {
    json!({"pairs": pairs, "change": change, "list": "view=table"})
}

/// Does something with pairs, and returns the page that the reply leads to.
#[track_caller]
fn done(page: &Page, path: &str, body: &Value) -> String {
    let reply = act(page, path, body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let go = reply.json()["go"].as_str().expect("a page").to_owned();
    text(&page.get(&format!("/p/p/{go}")))
}

/// Imports pairs with the files of the first one.
pub(crate) fn import_more(dir: &Path, ids: impl IntoIterator<Item = String>) {
    let project = dir.join("p");
    let list = std::fs::read_to_string(project.join("data/manifest.csv")).expect("a manifest");
    let mut rows = list.lines();
    let (head, first) = (rows.next().expect("a head"), rows.next().expect("a row"));
    let mut more = format!("{head}\n");
    for id in ids {
        writeln!(more, "{}", first.replacen("upright-0000", &id, 1)).expect("a string");
    }
    // Paths in a list are relative to it.
    std::fs::write(project.join("data/more.csv"), more).expect("written");
    mocban(&project, &["import", "data/more.csv"]).expect(0);
}

/// Imports a thousand pairs.
pub(crate) fn import_many(dir: &Path) {
    import_more(dir, (0..1000).map(|number| format!("many-{number:04}")));
}

#[test]
fn chosen_pairs_leave_every_count_and_come_back() {
    let (dir, page) = with_project();
    let body = chosen("retire", &["upright-0001", "upright-0004"]);
    let html = done(&page, CHOSEN, &body);
    assert!(
        html.contains("Pairs that were taken out of every count; their results and verdicts are kept: <b>2</b>"),
        "{html}"
    );
    assert!(html.contains("<table"), "the list stays as it was");
    assert_eq!(status(&dir.path().join("p"))["retired"], 2);
    let again = act(&page, CHOSEN, &body, |_| {});
    assert_eq!(again.status, 422, "they changed meanwhile");
    assert!(
        text(&again).contains("pair upright-0001 was retired"),
        "{}",
        text(&again)
    );
    // The page then no longer chooses them.
    assert_eq!(again.json()["retired"], body["pairs"]);
    page.get("/?language=vi");
    let vietnamese = text(&act(&page, CHOSEN, &body, |_| {}));
    let part = "cặp upright-0001 đã được đưa ra khỏi thống kê lúc ";
    assert!(vietnamese.contains(part), "{vietnamese}");
    page.get("/?language=en");
    // Another pair that was taken out before stays out.
    let other = act(
        &page,
        "/p/p/actions/retire",
        &json!({"pair": "upright-0007"}),
        |_| {},
    );
    assert_eq!(other.status, 200);
    let at = html.split("name=\"at\" value=\"").nth(1);
    let at = at.and_then(|rest| rest.split('"').next()).expect("a time");
    let undo = json!({"at": at, "list": ""});
    let html = done(&page, "/p/p/actions/restore", &undo);
    assert!(
        html.contains("Pairs that are in every count again: <b>2</b>"),
        "{html}"
    );
    assert_eq!(status(&dir.path().join("p"))["retired"], 1);
    let twice = act(&page, "/p/p/actions/restore", &undo, |_| {});
    assert_eq!(twice.status, 422, "{}", text(&twice));
    let html = text(&page.get(&format!("/p/p/pairs?done=retire&at={at}")));
    assert!(html.contains("<b>0</b>") && !html.contains("id=\"undo\""));
}

#[test]
fn a_retired_pair_is_listed_has_a_page_and_comes_back() {
    let (dir, page) = with_project();
    let pair = "upright-0001";
    let set = ["verdict", "set", pair, "pass", "--reviewer", "lan"];
    mocban(&dir.path().join("p"), &set).expect(0);
    let html = text(&page.get("/p/p/pairs"));
    assert!(html.contains("retired (0)"), "{html}");
    let retire = json!({ "pair": pair });
    let restore = "/p/p/actions/restore";
    for list in [None, Some("state=retired")] {
        let reply = act(&page, "/p/p/actions/retire", &retire, |_| {});
        assert_eq!(reply.status, 200, "{}", text(&reply));
        let html = text(&page.get("/p/p/pairs?state=retired"));
        for part in ["retired (1)", "a person took it out", "Bring it back", pair] {
            assert!(html.contains(part), "{part}: {html}");
        }
        assert!(!html.contains("upright-0002") && !html.contains("data-pair="));
        let other = text(&page.get("/p/p/pairs?state=retired&block=none"));
        assert!(other.contains("No pair matches"), "{other}");
        assert_eq!(page.get("/p/p/pairs/listed?state=retired").status, 422);
        assert_eq!(page.get(&format!("/p/p/pairs?id={pair}")).status, 303);
        let own = page.get(&format!("/p/p/pair/{pair}/"));
        assert_eq!(own.status, 200);
        let html = text(&own);
        for part in ["This pair is retired.", "Bring it back", " · lan · passed"] {
            assert!(html.contains(part), "{part}: {html}");
        }
        let mut body = retire.clone();
        if let Some(list) = list {
            body["list"] = list.into();
        }
        let reply = act(&page, restore, &body, |_| {});
        assert_eq!(reply.status, 200, "{}", text(&reply));
        if list.is_some() {
            assert_eq!(
                reply.json()["go"],
                "pairs?state=retired&done=restore&count=1"
            );
        } else {
            assert_eq!(reply.json()["reload"], true);
        }
        let html = text(&page.get(&format!("/p/p/pair/{pair}/")));
        assert!(!html.contains("This pair is retired."), "{html}");
        assert_eq!(status(&dir.path().join("p"))["retired"], 0);
    }
    assert_eq!(act(&page, restore, &retire, |_| {}).status, 422, "twice");
    assert_eq!(act(&page, restore, &json!({}), |_| {}).status, 404);
}

#[test]
fn only_the_page_itself_acts_on_known_pairs() {
    let (dir, page) = with_project();
    let body = chosen("retire", &["upright-0001"]);
    for (name, value, expected) in [
        ("origin", "http://evil.example", 403),
        ("x-csrf-token", "0", 403),
        ("cookie", "", 401),
        ("content-type", "text/plain", 415),
    ] {
        let reply = act(&page, CHOSEN, &body, |headers| {
            headers.retain(|(known, _)| *known != name);
            headers.push((name, value.to_owned()));
        });
        assert_eq!(reply.status, expected, "{name}");
    }
    let many: Vec<String> = (0..1001).map(|number| format!("p{number}")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    let large = format!("x{}", "y".repeat(300_000));
    for (pairs, expected, part) in [
        (&["upright-0001", "nobody"][..], 422, "nobody"),
        (&[], 422, "no pair is chosen"),
        (&many, 422, "at most 1\u{202f}000 pairs can be chosen"),
        (&[large.as_str()], 413, "at most 256 KiB"),
    ] {
        for change in ["retire", "compute", "resume"] {
            let reply = act(&page, CHOSEN, &chosen(change, pairs), |_| {});
            assert_eq!(reply.status, expected, "{change}: {}", text(&reply));
            assert!(text(&reply).contains(part), "{change}: {}", text(&reply));
        }
    }
    let unknown = act(&page, CHOSEN, &chosen("delete", &["upright-0001"]), |_| {});
    assert_eq!(unknown.status, 422);
    let body = json!({"purpose": "excel", "only": "all", "metric": "", "pairs": ["nobody"]});
    let reply = act(&page, "/p/p/actions/export", &body, |_| {});
    assert_eq!(reply.status, 422, "{}", text(&reply));
    assert_eq!(status(&dir.path().join("p"))["retired"], 0);
}

#[test]
fn a_difference_of_iou_needs_another_metric() {
    let (_dir, page) = with_project();
    let query = "metric=density&compare=density&differs=0.3";
    let html = text(&page.get(&format!("/p/p/pairs?{query}")));
    assert!(
        html.contains("a difference of IoU needs two metrics"),
        "{html}"
    );
    assert!(!html.contains("data-pair="), "nothing is listed");
    let all = page.get(&format!("/p/p/pairs/listed?{query}"));
    assert_eq!(all.status, 422, "{}", text(&all));
}

#[test]
fn a_guest_acts_on_no_pair() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en", "--listen", "127.0.0.1"])).entered();
    let invite = json!({
        "reviewer": "lan", "metric": "relief", "sample": "2", "order": "random", "invite": "yes",
    });
    act(&page, "/p/p/actions/review", &invite, |_| {});
    let html = text(&page.get("/p/p/review"));
    let link = html.split("data-copy=\"").nth(1);
    let mut guest = Site::closed(
        link.and_then(|rest| rest.split('"').next())
            .expect("a link"),
    );
    guest.enter_as_guest();
    for path in [CHOSEN, "/p/p/actions/restore", "/p/p/actions/export"] {
        let reply = guest.post(path, &chosen("retire", &["upright-0001"]));
        assert_eq!(reply.expect("a reply").status, 404, "{path}");
    }
    assert_eq!(guest.get("/p/p/pairs/listed").status, 404);
    // Answers are small, so a guest may send less than the user.
    let large = json!({"note": "x".repeat(20_000)});
    let reply = guest.post("/api/answer", &large).expect("a reply");
    assert_eq!(reply.status, 413);
    assert!(text(&reply).contains("at most 16 KiB"), "{}", text(&reply));
    assert_eq!(status(&dir.path().join("p"))["retired"], 0);
}

#[test]
fn all_that_match_are_found_up_to_a_limit() {
    let (dir, page) = with_project();
    let listed = |query: &str| page.get(&format!("/p/p/pairs/listed?{query}"));
    let all = listed("state=aligned&sort=iou").json();
    let all = all["pairs"].as_array().expect("ids").clone();
    assert_eq!(all.len(), 15);
    assert_eq!(all[3], "upright-0003");
    assert_eq!(listed("state=failed").json()["pairs"], json!([]));
    assert_eq!(listed("sort=iou").json()["open"], json!([]));
    import_many(dir.path());
    for (language, expected) in [
        ("en", "more than 1\u{202f}000 pairs match"),
        ("vi", "có hơn 1\u{202f}000 cặp"),
    ] {
        page.get(&format!("/?language={language}"));
        let reply = listed("");
        assert_eq!(reply.status, 422);
        assert!(text(&reply).contains(expected), "{}", text(&reply));
    }
    let waiting = listed("state=waiting").json();
    assert_eq!(waiting["pairs"].as_array().map(Vec::len), Some(1000));
    assert_eq!(waiting["open"], waiting["pairs"]);
}

#[test]
fn chosen_pairs_are_computed_again_unless_a_run_is_in_progress() {
    let (dir, page) = with_project();
    let attempts = |pair: &str| {
        let shown = mocban(&dir.path().join("p"), &["show", pair, "--json"]).expect(0);
        shown.json()["attempts"].as_array().map_or(0, Vec::len)
    };
    let before = ["upright-0002", "upright-0003"].map(attempts);
    let html = done(&page, CHOSEN, &chosen("compute", &["upright-0002"]));
    assert!(
        html.contains("Pairs that are computed again: <b>1</b>"),
        "{html}"
    );
    wait_until("the run has begun, and then ended", || {
        attempts("upright-0002") > before[0] && status(&dir.path().join("p"))["running"] == false
    });
    let now = ["upright-0002", "upright-0003"].map(attempts);
    assert_eq!(now[1], before[1], "the others stay as they are");
    assert_eq!(status(&dir.path().join("p"))["jobs"]["done"], 15);

    import_many(dir.path());
    let hold = dir.path().join("hold");
    let mut run = crate::cli::binary();
    run.current_dir(dir.path().join("p"))
        .args(["run", "-q", "many-0001"])
        .env("MOCBAN_HOLD_AT", "fit:computed:1")
        .env("MOCBAN_HOLD_FILE", &hold);
    let mut run = run.spawn().expect("a run");
    crate::waiting::until(&mut run, || hold.exists());
    let refused = act(&page, CHOSEN, &chosen("compute", &["upright-0002"]), |_| {});
    assert_eq!(refused.status, 422);
    let said = text(&refused);
    assert!(said.contains("a run is in progress"), "{said}");
    // A run in progress is no obstacle to the others, but this one works on another pair only.
    let html = done(&page, CHOSEN, &chosen("resume", &["upright-0002"]));
    assert!(
        html.contains("or, if it works on other pairs only, when you next press Align: <b>1</b>")
    );
    done(&page, CHOSEN, &chosen("retire", &["upright-0003"]));
    std::fs::remove_file(&hold).expect("the run waits");
    assert!(run.wait().expect("its end").success());
}

#[test]
fn waiting_and_failed_ones_of_the_chosen_pairs_run() {
    let (dir, page) = with_project();
    import_more(dir.path(), ["late", "later"].map(str::to_owned));
    done(&page, CHOSEN, &chosen("resume", &["late", "upright-0001"]));
    wait_until("the pair is aligned", || {
        status(&dir.path().join("p"))["jobs"]["done"] == 16
    });
    assert_eq!(
        status(&dir.path().join("p"))["jobs"]["ready"],
        1,
        "one was not chosen"
    );
}

#[test]
fn chosen_pairs_are_exported_beside_the_export_of_all() {
    let (dir, page) = with_project();
    let export_pairs = |pairs: Value| {
        let mut body = json!({"purpose": "excel", "only": "all", "metric": "ensemble"});
        if !pairs.is_null() {
            body["pairs"] = pairs;
        }
        export(&page, &body)
    };
    assert_eq!(export_pairs(Value::Null)["reload"], true);
    let chosen = json!(["upright-0003", "upright-0001"]);
    assert_eq!(export_pairs(chosen)["go"], "export");
    let ids = |folder: &str| {
        let table = dir.path().join("p/exports").join(folder).join("pairs.csv");
        let table = std::fs::read_to_string(table).expect("a table");
        let rows = table.lines().skip(1);
        rows.map(|row| row.split(',').next().expect("an id").to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(ids("excel").len(), 15);
    assert_eq!(ids("excel-chosen"), ["upright-0001", "upright-0003"]);
    let html = text(&page.get("/p/p/export"));
    assert!(html.contains("a table for Excel (chosen pairs)"), "{html}");
}

#[test]
fn an_export_of_chosen_pairs_has_only_their_verdicts() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    for pair in ["upright-0001", "upright-0002"] {
        let set = ["verdict", "set", pair, "pass", "--reviewer", "lan"];
        mocban(&project, &set).expect(0);
    }
    let body = json!({"purpose": "all", "only": "all", "metric": "", "pairs": ["upright-0001"]});
    export(&page, &body);
    let log = std::fs::read_to_string(project.join("exports/all-chosen/verdicts.jsonl"));
    let log = log.expect("a log");
    assert!(
        log.contains("upright-0001") && !log.contains("upright-0002"),
        "{log}"
    );
}

#[test]
fn exactly_the_chosen_pairs_are_judged() {
    let (_dir, page) = with_project();
    let pairs = ["upright-0001", "upright-0004"];
    let reply = act(&page, CHOSEN, &chosen("review", &pairs), |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let go = reply.json()["go"].as_str().expect("a page").to_owned();
    let key = go.strip_prefix("review?chosen=").expect("a key");
    let html = text(&page.get(&format!("/p/p/{go}")));
    for part in ["Only the chosen pairs are judged: <b>2</b>", key] {
        assert!(html.contains(part), "{part}: {html}");
    }
    let mut form = json!({
        "reviewer": "lan", "metric": "relief", "sample": "", "order": "random", "chosen": key,
    });
    let started = act(&page, "/p/p/actions/review", &form, |_| {});
    assert_eq!(started.status, 200, "{}", text(&started));
    let go = started.json()["go"].as_str().expect("a page").to_owned();
    let queue = page.get(&format!("/p/p/{go}api/queue")).json();
    let items = queue["items"].as_array().expect("items");
    let mut judged: Vec<&str> = items
        .iter()
        .filter_map(|item| item["pair"].as_str())
        .collect();
    judged.sort_unstable();
    assert_eq!(judged, pairs, "no other image: {queue}");
    form["chosen"] = "0123456789ab".into();
    let unknown = act(&page, "/p/p/actions/review", &form, |_| {});
    assert_eq!(unknown.status, 422);
    assert!(
        text(&unknown).contains("choose the same pairs again"),
        "{}",
        text(&unknown)
    );
    let html = text(&page.get("/p/p/review?chosen=0123456789ab"));
    assert!(html.contains("choose the same pairs again"), "{html}");
    let none = act(&page, CHOSEN, &chosen("review", &[]), |_| {});
    assert_eq!(none.status, 422);
}

#[test]
fn a_review_of_chosen_pairs_goes_on_after_a_restart() {
    let (dir, mut page) = with_project();
    let pairs = ["upright-0001", "upright-0004"];
    let choose = |page: &Page, pairs: &[&str]| {
        let reply = act(page, CHOSEN, &chosen("review", pairs), |_| {}).json();
        let go = reply["go"].as_str().expect("a page");
        go.strip_prefix("review?chosen=").expect("a key").to_owned()
    };
    let key = choose(&page, &pairs);
    let form = json!({
        "reviewer": "lan", "metric": "relief", "sample": "", "order": "random", "chosen": key,
    });
    let started = act(&page, "/p/p/actions/review", &form, |_| {}).json();
    let review = format!("/p/p/{}", started["go"].as_str().expect("a page"));
    let items = |page: &Page| page.get(&format!("{review}api/queue")).json()["items"].clone();
    let [first, second] = [0, 1].map(|index| items(&page)[index].clone());
    let send = |page: &Page, event: &str, item: &Value| {
        let body = answer(event, item, "pass");
        act(page, &format!("{review}api/answer"), &body, |_| {}).status
    };
    assert_eq!(send(&page, "e-1", &first), 200);
    page.kill();
    let mut page = open_app(dir.path());
    let shown = text(&page.get(&format!("/p/p/review?chosen={key}")));
    let part = "Only the chosen pairs are judged: <b>2</b>";
    assert!(shown.contains(part), "{shown}");
    assert_eq!(page.get(&review).status, 200);
    assert_eq!(items(&page).as_array().map(Vec::len), Some(pairs.len()));
    // Without the file of the choice, the page acts on no pair and says what to do.
    page.kill();
    std::fs::remove_dir_all(dir.path().join("p/chosen")).expect("the choice");
    let page = open_app(dir.path());
    let asked = page.get(&review);
    assert_eq!(asked.status, 422);
    let html = text(&asked);
    assert!(html.contains("choose the same pairs again"), "{html}");
    assert_eq!(send(&page, "e-2", &second), 503, "the page sends it again");
    assert_eq!(choose(&page, &[pairs[1], pairs[0]]), key);
    assert_eq!(send(&page, "e-2", &second), 200);
    for item in items(&page).as_array().expect("items") {
        assert_eq!(item["answer"]["verdict"], "pass", "{item}");
    }
}
