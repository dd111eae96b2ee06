//! The page on which a person changes the boxes of a block.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::accessible::{axe, no_violation};
use crate::app::{act, app, html, open_app, text};
use crate::app_browser::enter;
use crate::block_view::finished_block;
use crate::browser::{Browser, Tab};
use crate::cli::mocban;
use crate::page::Page;
use crate::small_block::stored_block;

const BOXES: &str = "/p/p/block/b1/view/boxes";
/// The boxes are shown.
pub(crate) const SHOWN: &str = "window.mocbanBoxes && mocbanBoxes.image.naturalWidth > 100";
/// The boxes are saved.
pub(crate) const SAVED: &str =
    "mocbanBoxes.status.textContent.includes('The next run cuts the block again')";

/// Notes whether the title or the counts were blank when parts were added to the page.
const NOTE_BLANKS: &str = "new MutationObserver(() => {
    const parts = [...document.querySelectorAll('.box-view h1, .box-view .block-summary')];
    window.hadParts ||= parts.length === 2;
    window.hadBlanks ||= parts.some((part) => part.textContent === '');
}).observe(document, { childList: true, subtree: true })";

/// Returns what the page of the boxes shows.
fn shown(page: &Page) -> Value {
    page.get(&format!("{BOXES}/block.json")).json()
}

/// Returns the names of the characters that have a box, sorted.
fn labels(dir: &Path) -> Vec<String> {
    let stored = stored_block(dir);
    let characters = stored["character_list"].as_array().expect("characters");
    let with_box = characters.iter().filter(|one| one["state"] != "retired");
    let labels = with_box.map(|one| one["label"].as_str().expect("a label").to_owned());
    let mut labels: Vec<String> = labels.collect();
    labels.sort();
    labels
}

#[test]
fn boxes_are_checked_before_they_are_stored() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = open_app(dir.path());
    let block = html(&page, "/p/p/block/b1/");
    assert!(block.contains("href=\"view/boxes\""), "{block}");
    assert!(html(&page, BOXES).contains("block-boxes.js"));
    let block = shown(&page);
    assert_eq!(block["boxes"].as_array().map(Vec::len), Some(6));
    let bounds = |left: f64| [left, 9.5, left + 50.0, 59.5];
    let name = &block["boxes"][0]["name"];
    let send = |shown: &Value, removed: &Value, edited: &Value| {
        let edits = json!({"removed": removed, "edited": edited});
        let body = json!({"shown": shown, "edits": edits});
        act(&page, &format!("{BOXES}/save"), &body, |_| {})
    };
    let new = |name: &Value, left: f64| json!([{"name": name, "bounds": bounds(left)}]);
    let hash = &block["shown"];
    for (removed, edited, why) in [
        (json!([0, 1, 2, 3, 4, 5]), json!([]), "no box is left"),
        (json!([6]), json!([]), "box 7 was not shown"),
        (json!([]), new(name, 9.5), "are both named"),
        (json!([]), new(&json!("new"), 1e6), "outside the page"),
    ] {
        let refused = send(hash, &removed, &edited);
        let said = text(&refused);
        assert_eq!(refused.status, 422, "{said}");
        assert!(said.contains(why), "{why}: {said}");
    }
    let other = json!("0".repeat(64));
    let outdated = send(&other, &json!([0]), &json!([]));
    assert_eq!(outdated.status, 409, "{}", text(&outdated));
    let same = send(hash, &json!([]), &json!([]));
    assert_eq!(
        (same.status, &same.json()["is_saved"]),
        (200, &json!(false))
    );
    // These labels have replaced no others.
    let body = json!({"shown": hash});
    let earlier = act(&page, &format!("{BOXES}/earlier"), &body, |_| {});
    assert_eq!(earlier.status, 409, "{}", text(&earlier));
    assert!(!dir.path().join("p/labels").exists(), "nothing was written");
    assert_eq!(shown(&page)["shown"], *hash);
    assert_eq!(shown(&page)["is_unread"], false);
    assert!(!html(&page, "/p/p/block/b1/").contains(">missing<"));

    // Missing labels are not labels without boxes. The project was made in another folder, where its labels are.
    let mut import = vec!["-C", "p", "import", "--name", "b1", "--allow-changed-files"];
    import.extend(["--block", "d/data/block.ply", "--page", "d/data/page.jpg"]);
    import.extend(["--labels", "few.json"]);
    mocban(dir.path(), &import).expect(0);
    fs::rename(dir.path().join("few.json"), dir.path().join("away.json")).expect("moved");
    let unread = shown(&page);
    assert_eq!(unread["is_unread"], true, "{unread}");
    assert!(unread["warnings"].to_string().contains("few.json"));
    let block = html(&page, "/p/p/block/b1/");
    assert!(block.contains(">missing<"), "{block}");
    let stored = stored_block(dir.path());
    assert_eq!(stored["missing_files"], json!(["labels"]));
    let text = mocban(dir.path(), &["-C", "p", "show", "b1"]).expect(0).out;
    assert!(text.contains("few.json  missing"), "{text}");
}

#[test]
fn a_block_with_saved_boxes_waits_for_the_next_run() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = open_app(dir.path());
    let pages = [
        ("/p/p/block/b1/", "href=\"../../\">"),
        ("/p/p/blocks", "href=\"./\">"),
    ];
    for (path, _) in pages {
        let shown = html(&page, path);
        assert!(!shown.contains("id=\"changed-blocks\""), "{path}: {shown}");
    }
    let edits = json!({"removed": [0], "edited": []});
    let body = json!({"shown": shown(&page)["shown"], "edits": edits});
    let saved = act(&page, &format!("{BOXES}/save"), &body, |_| {});
    assert_eq!(saved.status, 200, "{}", text(&saved));
    for (language, said) in [
        ("en", "of 1 block were changed after its last run"),
        ("vi", "của 1 ván đã đổi sau lần chạy trước"),
    ] {
        for (path, link) in pages {
            let shown = html(&page, &format!("{path}?language={language}"));
            for part in ["id=\"changed-blocks\"", said, link] {
                assert!(shown.contains(part), "{path}: {part}: {shown}");
            }
        }
    }
}

/// Returns where a place of the page is on the screen, once the page has its final layout.
pub(crate) fn on_screen(tab: &Tab<'_>, [x, y]: [f64; 2]) -> [f64; 2] {
    tab.point_after_layout(&format!(
        "(() => {{
            const {{ camera, canvas }} = mocbanBoxes, {{ left, top }} = canvas.getBoundingClientRect();
            return [left + camera.x + ({x} + 0.5) * camera.zoom, top + camera.y + ({y} + 0.5) * camera.zoom];
        }})()"
    ))
}

/// Returns left, top, right and bottom of the chosen box.
pub(crate) fn chosen(tab: &Tab<'_>) -> [f64; 4] {
    let outline = tab.eval("mocbanBoxes.box().outline");
    let corner = |index: usize, axis: usize| outline[index][axis].as_f64().expect("a number");
    [corner(0, 0), corner(0, 1), corner(2, 0), corner(2, 1)]
}

/// Changes boxes as a person does. Returns the name of the box that is deleted.
fn use_page(tab: &Tab<'_>) -> String {
    let press = |button: &str| tab.eval(&format!("mocbanBoxes.{button}.click(), null"));
    assert_eq!(tab.eval("mocbanBoxes.edits.list.length"), 6);
    press("choices[1]");
    let before = chosen(tab);
    tab.eval("mocbanBoxes.canvas.focus(), null");
    for _ in 0..3 {
        tab.press("ArrowRight", false);
    }
    tab.press("ArrowDown", true);
    let [left, top, right, bottom] = before;
    assert_eq!(chosen(tab), [left + 3.0, top, right + 3.0, bottom + 1.0]);
    press("undoButton");
    assert_eq!(chosen(tab), [left + 3.0, top, right + 3.0, bottom]);
    press("undoButton");
    assert_eq!(chosen(tab), before, "presses of one key are one step");
    press("redoButton");
    tab.eval("mocbanBoxes.character.focus(), mocbanBoxes.character.select(), null");
    tab.text("明");
    assert_eq!(tab.eval("mocbanBoxes.box().text"), "明");
    press("choices[1]");
    let deleted = tab.eval("mocbanBoxes.box().name");
    let [left, top, right, bottom] = chosen(tab);
    press("removeButton");
    assert_eq!(tab.eval("mocbanBoxes.edits.list.length"), 5);
    tab.eval("mocbanBoxes.camera.reset(), null");
    tab.click("[aria-label=Add]", false);
    tab.wait("!mocbanBoxes.cover.hidden");
    let from = on_screen(tab, [left, top]);
    let to = on_screen(tab, [right, bottom]);
    tab.drag(from, to);
    tab.wait("mocbanBoxes.edits.list.length === 6");
    let drawn = chosen(tab);
    // A pixel of the screen is several pixels of the page.
    let is_near =
        (drawn.iter().zip([left, top, right, bottom])).all(|(a, b)| (a - b).abs() <= 12.0);
    assert!(is_near, "{drawn:?}");
    tab.eval("mocbanBoxes.name.focus(), null");
    let status = "mocbanBoxes.status.textContent";
    let unnamed = tab.eval(status);
    assert!(
        unnamed
            .as_str()
            .expect("a text")
            .starts_with("Box without a name:"),
        "{unnamed}"
    );
    tab.text("new");
    let named = tab.eval(status);
    assert!(
        named.as_str().expect("a text").starts_with("Box new:"),
        "{named}"
    );
    let counts = tab.eval("mocbanBoxes.counts.textContent");
    assert_eq!(counts, "boxes: 6 · changed: 3");
    tab.screenshot("boxes-changed");
    deleted.as_str().expect("a name").to_owned()
}

#[test]
fn boxes_are_changed_saved_and_replaced_by_the_earlier_ones() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    finished_block(dir);
    let first_labels = stored_block(dir)["labels_path"].clone();
    let page = Page::of(app(dir).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1400, 900]);
    let other = browser.tab(1400, 900);
    tab.before_scripts(NOTE_BLANKS);
    for one in [&tab, &other] {
        one.open(&format!("{home}p/p/block/b1/view/boxes"));
        one.wait(SHOWN);
    }
    assert_eq!(tab.eval("[hadParts, hadBlanks]"), json!([true, false]));
    if let Some(axe) = axe() {
        for dark in [false, true] {
            tab.dark(dark);
            no_violation(&tab, &axe, &format!("boxes, dark: {dark}"));
        }
    }
    let deleted = use_page(&tab);
    tab.eval("mocbanBoxes.saveButton.click(), null");
    tab.wait(SAVED);
    assert_eq!(tab.eval("mocbanBoxes.edits.count()"), 0);
    assert_eq!(stored_block(dir)["labels_path"], "labels/b1-1.json");
    let file = fs::read_to_string(dir.join("p/labels/b1-1.json")).expect("labels");
    let file: Value = serde_json::from_str(&file).expect("JSON");
    assert_eq!(file["mocban_replaces"], first_labels);
    // The other page has shown the labels before.
    other.eval("mocbanBoxes.choices[0].click(), mocbanBoxes.removeButton.click(), mocbanBoxes.saveButton.click(), null");
    other
        .wait("mocbanBoxes.status.textContent.includes('were changed since this page was opened')");
    assert!(
        !dir.join("p/labels/b1-2.json").exists(),
        "nothing was written"
    );
    let before = labels(dir);
    assert!(before.contains(&deleted), "{deleted}: {before:?}");
    let run = mocban(dir, &["-C", "p", "run"]);
    assert!([0, 3].contains(&run.code), "{}", run.err);
    let after = labels(dir);
    assert_eq!(after.len(), 6, "{after:?}");
    assert!(!after.contains(&deleted), "{deleted}: {after:?}");
    assert!(after.contains(&"new".to_owned()), "{after:?}");
    tab.eval("mocbanBoxes.earlierButton.click(), document.querySelector('.box-question button').click(), null");
    tab.wait(&format!("{SAVED} && mocbanBoxes.earlierButton.hidden"));
    assert_eq!(stored_block(dir)["labels_path"], first_labels);
    assert!(dir.join("p/labels/b1-1.json").exists(), "the file stays");
    let run = mocban(dir, &["-C", "p", "run"]);
    assert!([0, 3].contains(&run.code), "{}", run.err);
    assert_eq!(labels(dir), before);
    mocban(dir, &["-C", "p", "check"]).expect(0);
}
