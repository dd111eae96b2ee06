//! The editor of manual alignments on the review page, by keys, mouse, buttons and fingers.

use serde_json::Value;

use crate::browser::Tab;
use crate::cli::mocban;
use crate::review_browser::{current_verdicts, on_a_page, ready};
use crate::waiting::wait_until;

/// Returns the middle of an element on the screen.
fn middle(tab: &Tab<'_>, element: &str) -> [f64; 2] {
    tab.point(&format!(
        "(() => {{
            const one = document.querySelector(`{element}`);
            one.scrollIntoView({{ block: 'nearest' }});
            const {{ left, top, width, height }} = one.getBoundingClientRect();
            return [left + width / 2, top + height / 2];
        }})()"
    ))
}

fn click(tab: &Tab<'_>, element: &str) {
    let at = middle(tab, element);
    tab.drag(at, at);
}

fn is_turned_by(tab: &Tab<'_>, degrees: &str) {
    tab.wait(&format!(
        "document.getElementById('legend').textContent.includes('rotated by {degrees}°')"
    ));
}

fn tap(tab: &Tab<'_>, element: &str) {
    let at = middle(tab, element);
    tab.touch(&[at], &[at]);
}

/// Presses every button of the editor but the one that saves, and leaves it open with the computed alignment.
fn press_buttons(tab: &Tab<'_>, press: fn(&Tab<'_>, &str), iou: &dyn Fn() -> f64, computed: f64) {
    let is_computed = || (iou() - computed).abs() < 1e-9;
    for step in [
        "move_left",
        "move_right",
        "move_up",
        "move_down",
        "smaller",
        "larger",
        "mirror",
    ] {
        press(tab, "[data-align=reset]");
        wait_until("the alignment is the computed one", is_computed);
        press(tab, &format!("[data-align={step}]"));
        wait_until(step, || !is_computed());
    }
    press(tab, "[data-align=reset]");
    press(tab, "[data-align=rotate_right]");
    is_turned_by(tab, "1.00");
    press(tab, "#alignment-fine");
    tab.wait("document.getElementById('alignment-fine').checked");
    press(tab, "[data-align=rotate_right]");
    is_turned_by(tab, "1.10");
    for turned in ["1.00", "0.90"] {
        press(tab, "[data-align=rotate_left]");
        is_turned_by(tab, turned);
    }
    press(tab, "#alignment-fine");
    tab.wait("!document.getElementById('alignment-fine').checked");
    press(tab, "#alignment [data-action=cancel]");
    tab.wait("document.getElementById('alignment').hidden");
    press(tab, "[data-action=align]");
    tab.wait("!document.getElementById('alignment').hidden");
    is_turned_by(tab, "0.00");
}

/// Uses the editor by mouse and by finger, and leaves it open with the saved computed alignment.
fn align_by_buttons(tab: &Tab<'_>, iou: &dyn Fn() -> f64, computed: f64) {
    for press in [click, tap] {
        press_buttons(tab, press, iou, computed);
    }
    let [x, y] = middle(tab, "#canvas");
    let equals = |wanted: f64| (iou() - wanted).abs() < 1e-9;
    tab.touch(&[[x, y]], &[[x + 60.0, y]]);
    wait_until("a finger moves the relief", || !equals(computed));
    let moved = iou();
    tap(tab, "[data-align=reset]");
    wait_until("the alignment is the computed one", || equals(computed));
    let two = |x: f64| [[x, y], [x, y + 40.0]];
    tab.touch(&two(x), &two(x + 60.0));
    wait_until("the second finger moves nothing", || equals(moved));
    tap(tab, "[data-align=reset]");
    wait_until("the alignment is the computed one", || equals(computed));
    tap(tab, "#alignment [data-action=save]");
    tab.wait("document.getElementById('legend').textContent.includes('aligned manually by lan: rotated 0.0°')");
    tab.wait("document.getElementById('alignment').hidden");
    tab.key("KeyC");
    is_turned_by(tab, "0.00");
}

#[test]
fn a_relief_is_aligned_by_keys_and_mouse() {
    on_a_page(|project, tab| {
        let pair = tab.eval("document.getElementById('pair').textContent");
        tab.key("KeyC");
        tab.wait("document.getElementById('legend').textContent.includes('IoU')");
        let iou = || {
            let text = tab.eval("document.getElementById('legend').textContent.split(' ')[1]");
            text.as_str()
                .and_then(|text| text.parse::<f64>().ok())
                .expect("a number")
        };
        let before = iou();
        for _ in 0..5 {
            tab.key("BracketRight");
        }
        let rotated = iou();
        assert!(rotated < before, "{rotated} {before}");
        let at = tab.point(
            "(({ left, top, width, height }) => [left + width / 2, top + height / 2])
            (document.getElementById('canvas').getBoundingClientRect())",
        );
        tab.drag(at, [at[0] + 60.0, at[1]]);
        assert!(iou() < rotated);
        tab.screenshot("alignment");
        tab.key("Digit0");
        assert!((iou() - before).abs() < 1e-9);
        for _ in 0..5 {
            tab.key("BracketRight");
        }
        let legend = || {
            tab.eval("document.getElementById('legend').textContent")
                .to_string()
        };
        // Mirroring keeps the rotation.
        for _ in 0..2 {
            tab.key("KeyM");
            assert!(legend().contains("rotated by 5.00°"), "{}", legend());
        }
        align_by_buttons(tab, &iou, before);
        for _ in 0..5 {
            tab.key("BracketRight");
        }
        let saved_iou = iou();
        // A verdict would leave the item and lose the alignment.
        tab.key("KeyP");
        tab.wait("document.getElementById('live').textContent.startsWith('Save the alignment')");
        tab.key("Enter");
        // It is worse than the computed alignment.
        tab.wait("document.querySelector('#confirm[open]')");
        tab.eval("document.querySelector('#confirm button[value=yes]').click()");
        tab.wait(
            "document.getElementById('live').textContent.startsWith('Manual alignment saved')",
        );
        // The page shows the alignment, and the editor continues from it.
        tab.wait("document.getElementById('legend').textContent.includes('aligned manually by lan: rotated 5.0°')");
        assert!(
            legend().contains(&format!("IoU {saved_iou:.3}")),
            "{}",
            legend()
        );
        tab.reload();
        ready(tab);
        tab.wait(
            "document.getElementById('legend').textContent.includes('aligned manually by lan')",
        );
        tab.key("KeyC");
        tab.wait("document.getElementById('legend').textContent.includes('rotated by 5.00°')");
        assert!((iou() - saved_iou).abs() < 1e-9, "{}", legend());
        tab.key("Digit0");
        assert!((iou() - before).abs() < 1e-9);
        tab.key("Escape");
        mocban(project.dir(), &["export", "-o", "out"]).expect(0);
        let lines = std::fs::read_to_string(project.dir().join("out/pairs.jsonl")).expect("lines");
        let lines = lines
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        let mine: Vec<Value> = lines.filter(|line| line["id"] == pair).collect();
        let angle = |map: &Value| {
            let at = |row: usize| map[row][0].as_f64().expect("a number");
            at(1).atan2(at(0)).to_degrees()
        };
        let turns = mine.iter().map(|line| {
            let turn = angle(&line["manual_alignment"]["print_from_depth"])
                - angle(&line["print_from_depth"]);
            (turn + 540.0).rem_euclid(360.0) - 180.0
        });
        let turns: Vec<f64> = turns.collect();
        assert!(
            turns.iter().any(|turn| (turn - 5.0).abs() < 1e-6),
            "{turns:?}"
        );
        assert!(
            current_verdicts(project, "lan").is_empty(),
            "an alignment is not a verdict"
        );
    });
}
