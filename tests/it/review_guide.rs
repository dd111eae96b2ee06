//! The guide of the review page in a browser: examples, practice round, warnings, and the page after the last image.

use serde_json::{Value, json};

use crate::browser::{Browser, Tab};
use crate::page::{Page, open_review, read_project};
use crate::review_browser::{
    PLAIN, accepts_an_answer, announced_for_some_time, enter, judge, on_a_page_of,
    record_announcements,
};

/// Position and size of the large image.
fn picture(tab: &Tab<'_>) -> Value {
    tab.eval(
        "(({ x, y, width, height }) => [x, y, width, height])(
            document.querySelector('.picture').getBoundingClientRect())",
    )
}

/// Returns the largest difference of two rectangles in any coordinate, in pixels.
fn distance(a: &Value, b: &Value) -> f64 {
    let numbers = |of: &Value| of.as_array().expect("four numbers").clone();
    let pairs = numbers(a).into_iter().zip(numbers(b));
    let differences =
        pairs.map(|(a, b)| a.as_f64().expect("a number") - b.as_f64().expect("a number"));
    differences.map(f64::abs).fold(0.0, f64::max)
}

/// Returns whether an element is within the window without scrolling sideways, and has a usable size.
fn is_reachable(tab: &Tab<'_>, selector: &str) -> bool {
    let script = format!(
        "(() => {{
            const element = document.querySelector({selector:?});
            element.scrollIntoView({{ block: 'nearest' }});
            const box = element.getBoundingClientRect();
            const at = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
            return box.x >= 0 && box.right <= innerWidth && box.height >= 20 && element.contains(at);
        }})()"
    );
    tab.eval(&script) == json!(true)
}

/// Returns the first of some elements that is not wholly in the window as it is scrolled, or that another element covers.
/// Hidden ones do not count, but one must be shown.
fn first_out_of_sight(tab: &Tab<'_>, selector: &str) -> Value {
    let script = format!(
        "(() => {{
            const all = [...document.querySelectorAll({selector:?})];
            const shown = all.filter((element) => element.checkVisibility());
            return shown.length === 0 ? 'nothing is shown' : shown.find((element) => {{
                const box = element.getBoundingClientRect();
                const at = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
                return box.top < 0 || box.bottom > innerHeight || box.left < 0 || box.right > innerWidth || !element.contains(at);
            }})?.outerHTML ?? null;
        }})()"
    );
    tab.eval(&script)
}

/// Answers an example of the practice round and returns the text that explains the answer.
fn practise(tab: &Tab<'_>, key: &str) -> String {
    tab.wait("document.body.dataset.shown?.startsWith('example-')");
    tab.wait("document.getElementById('practice-next').disabled");
    tab.key(key);
    tab.wait("!document.getElementById('practice-next').disabled");
    let text = tab.eval("document.getElementById('practice-text').textContent");
    text.as_str().expect("a text").to_owned()
}

#[test]
fn a_new_reviewer_sees_the_guide_and_practises() {
    let options = [&PLAIN[1..], &["--metric", "density", "--sample", "2"]].concat();
    on_a_page_of(read_project, &options, [1440, 900], |_, tab| {
        tab.wait("document.querySelector('#guide[open]')");
        tab.wait("document.querySelectorAll('#guide figure[data-drawn]').length === 9");
        tab.screenshot("guide");
        let drawn = tab.eval(
        "[...document.querySelectorAll('#guide canvas')].every((canvas) => {
            const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            let orange = 0;
            for (let i = 0; i < data.length; i += 4) {
                if (data[i] === 196 && data[i + 1] === 78 && data[i + 2] === 0) orange += 1;
            }
            return orange > 100;
        })",
    );
        assert_eq!(drawn, json!(true), "each example has an outline");
        // The focus is on the practice, so Enter starts it instead of closing the guide.
        assert_eq!(
            tab.eval("document.activeElement.dataset.action"),
            json!("practice")
        );
        tab.eval("document.activeElement.click()");
        tab.wait("!document.querySelector('#guide[open]')");
        record_announcements(tab);
        // The fourth answer is wrong.
        let keys = ["KeyP", "Numpad1", "KeyF", "KeyF", "Digit3", "KeyP"];
        for (i, key) in keys.into_iter().enumerate() {
            let text = practise(tab, key);
            let starts = if i == 3 {
                "Not correct. Answer: Pass"
            } else {
                "Correct."
            };
            assert!(text.starts_with(starts), "{i}: {text}");
            if i == 1 {
                assert!(text.contains("Wrong angle. Rotated by 9°"), "{text}");
                tab.screenshot("practice");
            }
            tab.key(["Enter", "NumpadEnter"][i % 2]);
        }
        tab.wait("document.getElementById('practice').hidden");
        announced_for_some_time(tab, "5 of 6");
        assert_eq!(
            tab.eval("document.getElementById('bar').value"),
            0,
            "nothing is stored"
        );
        // The question mark opens the guide again; Escape leaves the practice round at any time.
        tab.wait("!document.body.dataset.shown.startsWith('example-')");
        tab.key("Slash");
        tab.wait("document.querySelector('#guide[open]')");
        tab.eval("document.querySelector('[data-action=practice]').click()");
        tab.wait("!document.getElementById('practice').hidden");
        tab.key("Escape");
        tab.wait("document.getElementById('practice').hidden");
        tab.wait("!document.body.dataset.shown.startsWith('example-')");
        judge(tab, "KeyP");
        tab.wait("document.getElementById('saved').textContent.includes('✓')");
        tab.reload();
        tab.wait("document.body?.dataset.ready");
        let opened = tab.eval("Boolean(document.querySelector('#guide[open]'))");
        assert_eq!(opened, json!(false), "only before the first answer");
    });
}

/// The guide and the prefetched images are more than the page keeps of the results.
#[test]
fn the_image_behind_the_guide_can_be_drawn_again() {
    let options = [&PLAIN[1..], &["--metric", "density", "--sample", "2"]].concat();
    on_a_page_of(read_project, &options, [1440, 900], |_, tab| {
        tab.wait("document.querySelectorAll('#guide figure[data-drawn]').length === 9");
        tab.wait("document.body.dataset.prefetched === document.body.dataset.shown");
        tab.key("Escape");
        tab.wait("!document.querySelector('#guide[open]')");
        let canvas = || tab.eval("document.getElementById('canvas').toDataURL()");
        let before = canvas();
        tab.key("BracketLeft");
        assert_ne!(canvas(), before);
        tab.key("BracketRight");
        assert_eq!(canvas(), before);
    });
}

#[test]
fn the_end_page_sums_up_and_names_the_next_commands() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let options = [
        "--no-guide",
        "--metric",
        "density",
        "--sample",
        "3",
        "--min-view-ms",
        "0",
    ];
    for (reviewer, key) in [("bo", "KeyF"), ("lan", "KeyF"), ("minh", "KeyP")] {
        let page = Page::start(&project, reviewer, &options);
        let tab = enter(&browser, &page, [1366, 660]);
        let all = tab
            .eval("document.getElementById('bar').max")
            .as_f64()
            .expect("a count");
        assert!(all >= 8.0, "three results and five attention checks: {all}");
        for _ in 1..all as usize {
            judge(&tab, key);
        }
        accepts_an_answer(&tab);
        tab.key(key);
        tab.wait("document.getElementById('end').dataset.ready");
        tab.screenshot(&format!("end-{reviewer}"));
        let text = tab.eval("document.getElementById('end').innerText");
        let text = text.as_str().expect("a text");
        let (counts, noticed) = if key == "KeyF" {
            ("0 passed, 3 failed", 5)
        } else {
            ("3 passed, 0 failed", 0)
        };
        assert!(
            text.contains(&format!("3 results judged: {counts}, 0 unsure")),
            "{text}"
        );
        let noticed_text = format!("{noticed} of 5 attention checks noticed");
        assert!(text.contains(&noticed_text), "{text}");
        let missed = text.contains("Most attention checks were missed");
        assert_eq!(missed, noticed == 0, "{text}");
        assert!(text.contains("report -o report.html"), "{text}");
        let same_results = "review --reviewer NAME --metric density --sample 3";
        assert!(text.contains(same_results), "{text}");
        let agrees = text.contains("3 of 3 answers are the same as those of bo");
        assert_eq!(agrees, reviewer == "lan", "{text}");
        tab.key("Backspace");
        tab.wait("document.getElementById('end').hidden");
    }
}

/// Stops the clock of the page and the times of its events.
const STOPPED_CLOCK: &str = "performance.now = () => 1e9;
    Object.defineProperty(Event.prototype, 'timeStamp', { get: () => 1e9 }); 0";

#[test]
fn hints_do_not_move_the_picture_and_fast_answers_are_named() {
    on_a_page_of(read_project, &PLAIN, [1366, 660], |_, tab| {
        judge(tab, "KeyP");
        let before = picture(tab);
        for (key, shown) in [
            ("KeyN", "!document.getElementById('note-row').hidden"),
            (
                "KeyW",
                "document.querySelector('[data-action=overlay]').classList.contains('on')",
            ),
            (
                "KeyC",
                "document.getElementById('legend').textContent.includes('IoU')",
            ),
        ] {
            tab.key(key);
            tab.wait(shown);
            // Fonts of different heights may change the rows below by a part of a pixel.
            let moved = distance(&picture(tab), &before);
            assert!(moved < 1.0, "{key}: {moved} px");
            tab.key("Escape");
            tab.wait("document.getElementById('note-row').hidden");
        }
        tab.wait("!document.querySelector('[data-action=align]').classList.contains('on')");
        // On a loaded machine answers take longer than the limit, so the page's clock stands still.
        tab.eval(STOPPED_CLOCK);
        for _ in 0..11 {
            judge(tab, "KeyP");
        }
        tab.wait("document.getElementById('saved').textContent.includes('✓')");
        tab.wait("document.getElementById('alert').innerText.includes('last 10 answers')");
        assert_eq!(
            tab.eval("document.getElementById('alert').hidden"),
            json!(false)
        );
        tab.screenshot("too-fast");
        assert_eq!(picture(tab), before, "the warning");
    });
}

#[test]
fn a_worse_alignment_is_saved_only_after_a_question() {
    on_a_page_of(read_project, &PLAIN, [1440, 900], |_, tab| {
        let is_open = "document.querySelector('[data-action=align]').classList.contains('on')";
        tab.key("KeyC");
        tab.wait("document.getElementById('legend').textContent.includes('IoU')");
        for _ in 0..12 {
            tab.key("ArrowRight");
        }
        tab.key("Enter");
        tab.wait("document.querySelector('#confirm[open]')");
        tab.screenshot("confirm");
        tab.key("Escape");
        tab.wait("!document.querySelector('#confirm[open]')");
        assert_eq!(tab.eval(is_open), json!(true), "the editor stays open");
        tab.key("Enter");
        tab.wait("document.querySelector('#confirm[open]')");
        tab.eval("document.querySelector('#confirm button[value=yes]').click()");
        tab.wait("document.getElementById('live').textContent.includes('alignment saved')");
        tab.wait(&format!("!{is_open}"));
    });
}

#[test]
fn every_answer_is_reachable_on_a_narrow_screen() {
    for language in ["en", "vi"] {
        let options = [&PLAIN[..], &["--lang", language]].concat();
        on_a_page_of(read_project, &options, [400, 800], |_, tab| {
            tab.screenshot(&format!("narrow-{language}"));
            let actions = "pass fail unsure angle strokes_lost background_in shift_or_scale mirrored wrong_pair note undo";
            for action in actions.split_whitespace() {
                let selector = format!("footer [data-action={action}]");
                assert!(is_reachable(tab, &selector), "{language}: {action}");
            }
            tab.screenshot(&format!("narrow-{language}-reasons"));
        });
    }
}

/// Shows a long message, as after answers that were too fast.
const LONG_MESSAGE: &str = "(() => {
    const alert = document.getElementById('alert');
    alert.textContent = '10 câu trả lời gần nhất chỉ mất khoảng 0,6 giây mỗi hình. Hãy xem kỹ mọi nét trước khi trả lời.';
    alert.hidden = false;
})()";

#[test]
fn nothing_that_is_needed_is_covered_or_out_of_sight() {
    for (language, size) in ["en", "vi"]
        .into_iter()
        .flat_map(|language| [(language, [1366, 660]), (language, [400, 800])])
    {
        let options = [&PLAIN[..], &["--lang", language]].concat();
        on_a_page_of(read_project, &options, size, |_, tab| {
            let is_seen = |state: &str, selector: &str| {
                let out = first_out_of_sight(tab, selector);
                assert_eq!(out, Value::Null, "{language} {size:?} {state}: {selector}");
                tab.screenshot(&format!("sight-{language}-{}-{state}", size[0]));
            };
            let head = "header b, header a, header button, #progress, #saved";
            is_seen("start", ".verdicts button");
            tab.eval(LONG_MESSAGE);
            is_seen("message", "#alert");
            is_seen(
                "message",
                &format!("{head}, #alert, .verdicts button, .history > button"),
            );
            tab.eval("document.getElementById('alert').hidden = true");
            tab.key("KeyN");
            tab.wait("!document.getElementById('note-row').hidden");
            is_seen("note", "#note-row input, .history > button");
            tab.key("Escape");
            tab.key("KeyC");
            tab.wait("!document.getElementById('alignment').hidden");
            is_seen("alignment", "#alignment button");
            tab.key("Escape");
            let rows = tab.eval(
                "new Set([...document.querySelectorAll('.modes button')].map((button) => button.offsetTop)).size",
            );
            assert_eq!(rows, json!(1), "{language} {size:?}: rows of tools");
        });
    }
}

#[test]
fn the_summary_is_a_secret_until_every_item_is_answered() {
    let (_dir, _, page) = open_review(&["--metric", "density", "--sample", "2"]);
    let reply = page.get("/api/summary");
    assert_eq!(reply.status, 403, "{:?}", reply.json());
    assert_eq!(reply.json()["error"], "answer every image first");
}

#[test]
fn keys_work_as_soon_as_a_dialog_is_closed() {
    on_a_page_of(read_project, &PLAIN, [1440, 900], |_, tab| {
        tab.key("KeyJ");
        tab.wait("document.activeElement.id === 'jump-to'");
        // In the same task of the event loop that closes the dialog, the focus is still inside the dialog.
        tab.eval(
        "document.getElementById('jump').close();
        document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { code: 'KeyC', bubbles: true }));
        null",
    );
        tab.wait("document.getElementById('legend').textContent.includes('IoU')");
    });
}
