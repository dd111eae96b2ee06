//! A block is corrected by touch alone on a phone and a tablet, and with the keyboard alone.

use std::path::Path;

use crate::app::app;
use crate::app_browser::enter;
use crate::block_boxes::{SAVED, SHOWN, chosen, on_screen};
use crate::block_correction::{on_picture, true_points};
use crate::block_view::{BLOCK_SHOWN, finished_page, third_box};
use crate::browser::{Browser, Tab};
use crate::page::Page;
use crate::small_block::{CHARACTERS, stored_block};

/// Sizes of a phone and of a tablet.
const WINDOWS: [[u32; 2]; 2] = [[400, 800], [1024, 768]];
/// Both pictures of a correction are shown.
const BOTH_SHOWN: &str = "window.mocbanCorrection && ['face', 'page'].every((part) => mocbanCorrection[part].image.naturalWidth > 100)";

fn tap_at(tab: &Tab<'_>, at: [f64; 2]) {
    tab.touch(&[at], &[at]);
}

fn middle([left, top, right, bottom]: [f64; 4]) -> [f64; 2] {
    [left.midpoint(right), top.midpoint(bottom)]
}

fn size([left, top, right, bottom]: [f64; 4]) -> [f64; 2] {
    [right - left, bottom - top]
}

/// Waits until this many changes of boxes can be undone.
fn has_changes(tab: &Tab<'_>, count: usize) {
    tab.wait(&format!("mocbanBoxes.edits.past.length === {count}"));
}

/// Adds, deletes, moves and resizes boxes with a finger, while the whole page is shown. Leaves a box that was moved.
fn touch_boxes(tab: &Tab<'_>) {
    tab.tap("[aria-label=Add]");
    tab.wait("!mocbanBoxes.cover.hidden");
    tap_at(tab, on_screen(tab, [600.0, 600.0]));
    has_changes(tab, 1);
    tab.tap("[aria-label=Delete]");
    has_changes(tab, 2);
    let second = tab.point(
        "(() => {
            const [corner, , other] = mocbanBoxes.edits.list[1].outline;
            return [0, 1].map((axis) => (corner[axis] + other[axis]) / 2);
        })()",
    );
    tap_at(tab, on_screen(tab, second));
    tab.wait("mocbanBoxes.selected === 1");
    let before = chosen(tab);
    let zoom = tab.eval("mocbanBoxes.camera.zoom");
    let zoom = zoom.as_f64().expect("a number");
    let is_small = size(before).iter().all(|side| side * zoom < 30.0);
    assert!(is_small, "{before:?} at {zoom}");
    let [x, y] = on_screen(tab, middle(before));
    tab.touch(&[[x, y]], &[[x - 20.0, y + 10.0]]);
    has_changes(tab, 3);
    let moved = chosen(tab);
    assert_eq!(size(moved), size(before), "the box is only moved");
    let shift = [(moved[0] - before[0]) * zoom, (moved[1] - before[1]) * zoom];
    let is_near = (shift[0] + 20.0).abs() < 1.0 && (shift[1] - 10.0).abs() < 1.0;
    assert!(is_near, "{shift:?}");
    // The corner lies outside of the box.
    let [x, y] = on_screen(tab, [moved[2], moved[3]]);
    tab.touch(&[[x + 8.0, y + 8.0]], &[[x + 24.0, y + 20.0]]);
    has_changes(tab, 4);
    let resized = chosen(tab);
    assert_eq!(resized[..2], moved[..2], "the other corner stays");
    assert!(
        resized[2] > moved[2] && resized[3] > moved[3],
        "{resized:?}"
    );
    for (button, changes) in [("Undo", 3), ("Undo", 2), ("Redo", 3)] {
        tab.tap(&format!("[aria-label={button}]"));
        has_changes(tab, changes);
    }
    assert_eq!(chosen(tab), moved);
}

/// Chooses places on both pictures with a finger. Each gets a mark, which the tap that made it does not remove.
fn touch_points(dir: &Path, tab: &Tab<'_>) {
    let block = tab.eval("mocbanCorrection.block");
    let mut marks = 0;
    for point in true_points(dir, &block) {
        for part in ["face", "page"] {
            tap_at(tab, on_picture(tab, part, &point[part]));
            marks += 1;
            tab.wait(&format!(
                "document.querySelectorAll('.block-point').length === {marks}"
            ));
        }
    }
    assert_eq!(tab.eval("mocbanCorrection.complete().length"), 3);
}

/// Opens the 3D view of a character with a finger, and closes it.
fn touch_block(tab: &Tab<'_>) {
    tab.eval(
        "window.clicks = 0, addEventListener('click', () => (window.clicks += 1), true), null",
    );
    tap_at(tab, third_box(tab));
    tab.wait("mocbanBlock.dialog.open");
    tab.tap("dialog button");
    tab.wait("!mocbanBlock.dialog.open");
    // The click of the first tap would have fallen into the dialog.
    assert_eq!(tab.eval("window.clicks"), 1);
}

/// Adds, names and deletes boxes by keys, and saves them.
fn key_boxes(tab: &Tab<'_>) {
    let count = "mocbanBoxes.edits.list.length";
    tab.tab_to(".block-canvas");
    for selected in [0, 1] {
        tab.key("PageDown");
        assert_eq!(tab.eval("mocbanBoxes.selected"), selected);
    }
    tab.key("Delete");
    assert_eq!(tab.eval(count), CHARACTERS - 1);
    tab.key("KeyA");
    assert_eq!(tab.eval(count), CHARACTERS);
    let [left, top, right, bottom] = chosen(tab);
    tab.key("ArrowRight");
    assert_eq!(chosen(tab), [left + 1.0, top, right + 1.0, bottom]);
    tab.tab_to("label:first-of-type input");
    tab.text("by-key");
    assert_eq!(tab.eval("mocbanBoxes.box().name"), "by-key");
    tab.press_enter_on("[aria-label=Save]");
    tab.wait(SAVED);
}

/// Removes and chooses places by keys.
fn key_points(tab: &Tab<'_>) {
    let count = "mocbanCorrection.points.length";
    for left in [2, 1, 0] {
        tab.key("Backspace");
        assert_eq!(tab.eval(count), left);
    }
    for side in 1..=2 {
        tab.tab_to(&format!(".block-side:nth-of-type({side}) .block-canvas"));
        tab.key("Equal");
        tab.key("ArrowRight");
        tab.key("Enter");
    }
    assert_eq!(tab.eval("mocbanCorrection.complete().length"), 1);
    tab.press_enter_on(".block-point");
    assert_eq!(tab.eval(count), 0);
}

#[test]
fn a_block_is_corrected_by_touch_alone_and_by_keys_alone() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    finished_page(dir);
    let page = Page::of(app(dir).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, WINDOWS[0]);
    let open = |tab: &Tab<'_>, path: &str, shown: &str| {
        tab.open(&format!("{home}p/p/block/b1/view/{path}"));
        tab.wait(shown);
    };
    for (index, window) in WINDOWS.into_iter().enumerate() {
        tab.use_fingers(window);
        open(&tab, "", BLOCK_SHOWN);
        touch_block(&tab);
        open(&tab, "boxes", SHOWN);
        touch_boxes(&tab);
        tab.screenshot(&format!("boxes-touched-{}", window[0]));
        tab.tap("[aria-label=Save]");
        tab.wait(SAVED);
        let labels = format!("labels/b1-{}.json", index + 1);
        assert_eq!(stored_block(dir)["labels_path"], labels);
        open(&tab, "correct", BOTH_SHOWN);
        touch_points(dir, &tab);
        tab.screenshot(&format!("correct-touched-{}", window[0]));
        if index == 0 {
            tab.tap(".block-point");
            tab.wait("mocbanCorrection.points.length === 2");
        }
    }
    tab.eval(
        "mocbanCorrection.tryButton.id = 'try', mocbanCorrection.saveButton.id = 'save', null",
    );
    tab.tap("#try");
    tab.wait("mocbanCorrection.isTried && !mocbanCorrection.isBusy");
    tab.tap("#save");
    tab.wait("mocbanCorrection.status.textContent.includes('The next run aligns')");
    let stored = stored_block(dir);
    let points = stored["control_points"]["points"].as_array();
    assert_eq!(points.map(Vec::len), Some(3));
    let keyboard = browser.tab(1280, 800);
    open(&keyboard, "boxes", SHOWN);
    key_boxes(&keyboard);
    assert_eq!(stored_block(dir)["labels_path"], "labels/b1-3.json");
    open(&keyboard, "correct", BOTH_SHOWN);
    key_points(&keyboard);
}
