//! The review page in a browser: keyboard use, reload, two reviewers, manual alignment.

use std::collections::{BTreeMap, BTreeSet};

use mocban::store::Project;
use serde_json::Value;

use crate::browser::{Browser, Tab};
use crate::cli::{call, mocban};
use crate::page::{NO_CHECKS, Page, read_project};
use crate::resume::{project, run};

/// Options for simple tests: the log holds only pressed verdicts, and no test waits for a minimum view time.
pub(crate) const PLAIN: [&str; 7] = [
    "--no-guide",
    "--attention-checks",
    "0",
    "--duplicates",
    "0",
    "--min-view-ms",
    "0",
];

/// Opens a reviewer's page in a tab and waits for its first item.
pub(crate) fn enter<'a>(browser: &'a Browser, page: &Page, size: [u32; 2]) -> Tab<'a> {
    let tab = browser.tab(size[0], size[1]);
    tab.open(&page.url);
    ready(&tab);
    tab
}

/// Opens a page on a new project; skips if there is no browser.
pub(crate) fn on_a_page(test: impl FnOnce(&Project, &Tab<'_>)) {
    on_a_page_of(read_project, &PLAIN, [1440, 900], test);
}

/// Opens a page of a size on a project that `make` makes in a directory; skips if there is no browser.
pub(crate) fn on_a_page_of(
    make: impl FnOnce(&tempfile::TempDir) -> Project,
    options: &[&str],
    size: [u32; 2],
    test: impl FnOnce(&Project, &Tab<'_>),
) {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = make(&dir);
    let page = Page::start(&project, "lan", options);
    let tab = enter(&browser, &page, size);
    test(&project, &tab);
}

pub(crate) fn ready(tab: &Tab<'_>) {
    tab.wait("document.body?.dataset.ready && document.body.dataset.shown");
}

pub(crate) fn shown(tab: &Tab<'_>) -> String {
    tab.eval("document.body.dataset.shown")
        .as_str()
        .expect("an item")
        .to_owned()
}

/// Waits until the next item is prefetched and no answer waits for the server, which accepts at most three at a time.
pub(crate) fn accepts_an_answer(tab: &Tab<'_>) {
    tab.wait("document.body.dataset.prefetched === document.body.dataset.shown");
    tab.wait("!document.getElementById('saved').classList.contains('waiting')");
}

/// The first item of a review is shown.
pub(crate) const ITEM: &str = "document.body?.dataset.shown && document.getElementById('canvas')";

/// Waits until an image was shown as long as it must be before an answer to it is accepted.
pub(crate) fn shown_long_enough(tab: &Tab<'_>) {
    tab.eval("window.since = Date.now(), null");
    tab.wait("Date.now() - window.since > 400");
}

/// Presses a verdict key as soon as the page is ready, and waits until the next item is shown.
pub(crate) fn judge(tab: &Tab<'_>, key: &str) {
    let before = shown(tab);
    accepts_an_answer(tab);
    tab.key(key);
    tab.wait(&format!("document.body.dataset.shown !== '{before}'"));
}

/// Records the addresses that the page fetches, and counts the messages to its worker: each asks for the images of one item.
const COUNT_REQUESTS: &str = "(() => {
    window.asked = { requests: [], items: 0 };
    const { fetch } = window;
    window.fetch = (address, ...rest) => {
        window.asked.requests.push(String(address));
        return fetch(address, ...rest);
    };
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (...message) {
        window.asked.items += 1;
        return postMessage.apply(this, message);
    };
})(), null";

/// Fails if keys have cost more than one request and the images of one item each. Forgets the requests.
fn one_request_a_key(tab: &Tab<'_>, keys: usize) {
    saved(tab);
    let asked = tab.eval("window.asked");
    let requests = asked["requests"].as_array().expect("addresses");
    let answers = requests.iter().filter(|address| *address == "api/answer");
    assert_eq!((answers.count(), requests.len()), (keys, keys), "{asked}");
    let items = asked["items"].as_u64().expect("a number");
    assert!(items <= keys as u64, "{asked}");
    tab.eval("window.asked = { requests: [], items: 0 }, null");
}

/// Records what the page announces, because it removes some announcements after seconds.
pub(crate) fn record_announcements(tab: &Tab<'_>) {
    tab.eval(
        "(() => {
            window.announced = [];
            const live = document.getElementById('live');
            const record = () => window.announced.push(live.textContent);
            new MutationObserver(record).observe(live, { childList: true, characterData: true, subtree: true });
        })()",
    );
}

/// Waits for an announcement with a text, and for its end.
pub(crate) fn announced_for_some_time(tab: &Tab<'_>, text: &str) {
    tab.wait(&format!(
        "window.announced.some((said) => said.includes('{text}'))"
    ));
    tab.wait("document.getElementById('live').textContent === ''");
}

pub(crate) fn saved(tab: &Tab<'_>) {
    tab.wait("document.getElementById('saved').textContent.includes('✓')");
}

/// Returns a reviewer's current verdicts and reasons, keyed by the number of the action that stored them.
pub(crate) fn current_verdicts(
    project: &Project,
    reviewer: &str,
) -> BTreeMap<i64, (String, Option<String>)> {
    let output = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    let events = output
        .out
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let events =
        events.filter(|event| event["reviewer"] == reviewer && event["undone_at"].is_null());
    let text = |value: &Value| value.as_str().map(str::to_owned);
    events
        .map(|event| {
            let verdict = text(&event["verdict"]).expect("a verdict");
            (
                event["act"].as_i64().expect("a number"),
                (verdict, text(&event["reason"])),
            )
        })
        .collect()
}

#[test]
fn fifty_items_are_judged_by_keys_with_a_reload_and_ten_undone() {
    // Metrics often choose the same threshold, so the pairs of `read_project` have fewer than 50 images.
    let made = |dir: &tempfile::TempDir| {
        let project = project(dir.path(), "p", "28");
        call(&mut run(&project, &[])).expect(0);
        project
    };
    on_a_page_of(made, &PLAIN, [1440, 900], |project, tab| {
        let keys = ["KeyP", "KeyP", "Digit1", "KeyU", "KeyF", "Digit6"];
        let mut paints = Vec::new();
        accepts_an_answer(tab);
        tab.eval(COUNT_REQUESTS);
        for i in 0..50 {
            if i == 25 {
                one_request_a_key(tab, 25);
                tab.reload();
                ready(tab);
                assert_eq!(tab.eval("document.getElementById('bar').value"), 25);
                accepts_an_answer(tab);
                tab.eval(COUNT_REQUESTS);
            }
            judge(tab, keys[i % keys.len()]);
            let ms = tab.eval("document.body.dataset.paintMs");
            paints.push(
                ms.as_str()
                    .and_then(|ms| ms.parse::<u32>().ok())
                    .expect("a time"),
            );
        }
        one_request_a_key(tab, 25);
        let said: Vec<_> = current_verdicts(project, "lan").into_values().collect();
        let wanted =
            |verdict: &str, reason: Option<&str>| (verdict.to_owned(), reason.map(str::to_owned));
        let of_key = [
            wanted("pass", None),
            wanted("pass", None),
            wanted("fail", Some("angle")),
            wanted("unsure", None),
            wanted("fail", None),
            wanted("fail", Some("wrong_pair")),
        ];
        let pressed: Vec<_> = (0..50).map(|i| of_key[i % keys.len()].clone()).collect();
        assert_eq!(said, pressed);
        for _ in 0..10 {
            let before = shown(tab);
            saved(tab);
            tab.key("Backspace");
            tab.wait(&format!("document.body.dataset.shown !== '{before}'"));
        }
        saved(tab);
        assert_eq!(tab.eval("document.getElementById('bar').value"), 40);
        let left: Vec<_> = current_verdicts(project, "lan").into_values().collect();
        assert_eq!(left, pressed[..40]);
        judge(tab, "KeyP");
        saved(tab);
        assert_eq!(current_verdicts(project, "lan").len(), 41);
        paints.sort_unstable();
        eprintln!(
            "key to image: median {} ms, nine in ten {} ms, worst {} ms",
            paints[25], paints[45], paints[49]
        );
    });
}

#[test]
fn every_display_mode_draws_a_different_image() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let page = Page::start(&read_project(&dir), "lan", &PLAIN);
    let tab = enter(&browser, &page, [1440, 900]);
    let canvas = |tab: &Tab<'_>| {
        tab.eval("document.getElementById('canvas').toDataURL()")
            .to_string()
    };
    let mut seen = BTreeSet::from([canvas(&tab)]);
    tab.screenshot("edges");
    for mode in [
        "two_up",
        "overlay",
        "onion",
        "checker",
        "difference",
        "reveal",
    ] {
        tab.key(mode_key(mode));
        assert!(seen.insert(canvas(&tab)), "{mode}");
        assert_eq!(
            tab.eval(&format!(
                "document.querySelector('[data-action={mode}]').ariaPressed"
            )),
            "true"
        );
        tab.screenshot(mode);
    }
    tab.key("KeyE");
    assert!(!seen.insert(canvas(&tab)), "edges again");
    for key in ["KeyD", "KeyS", "BracketRight", "KeyZ"] {
        tab.key(key);
        assert!(seen.insert(canvas(&tab)), "{key}");
        tab.screenshot(key);
    }
    tab.key("KeyZ");
    tab.key("KeyZ");
    let still = canvas(&tab);
    tab.key_down("Space");
    assert_ne!(canvas(&tab), still);
    tab.key_up("Space");
    assert_eq!(canvas(&tab), still);
    // Changing the display stores no verdict.
    assert_eq!(tab.eval("document.getElementById('bar').value"), 0);
}

fn mode_key(mode: &str) -> &'static str {
    match mode {
        "two_up" => "KeyQ",
        "overlay" => "KeyW",
        "onion" => "KeyR",
        "checker" => "KeyT",
        "difference" => "KeyY",
        _ => "KeyV",
    }
}

#[test]
fn two_reviewers_judge_at_the_same_time() {
    let (Some(first), Some(second)) = (Browser::start(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let pages = ["lan", "minh"].map(|reviewer| Page::start(&project, reviewer, &PLAIN));
    let tabs = [(&first, &pages[0]), (&second, &pages[1])];
    let tabs = tabs.map(|(browser, page)| enter(browser, page, [1024, 768]));
    for _ in 0..12 {
        judge(&tabs[0], "KeyP");
        judge(&tabs[1], "Digit2");
    }
    tabs.iter().for_each(saved);
    for (reviewer, verdict) in [("lan", "pass"), ("minh", "fail")] {
        let acts = current_verdicts(&project, reviewer);
        assert_eq!(acts.len(), 12, "{reviewer}");
        assert!(acts.values().all(|(said, _)| said == verdict), "{acts:?}");
    }
    // The second reviewer's page does not show the first one's answers.
    let history = tabs[1].eval("document.getElementById('history').textContent");
    assert!(!history.to_string().contains('✓'), "{history}");
}

#[test]
fn typing_a_note_with_verdict_keys_stores_no_verdict() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::start(&project, "lan", &[&PLAIN[..], &["--lang", "vi"]].concat());
    let tab = enter(&browser, &page, [1024, 768]);
    tab.screenshot("vietnamese");
    tab.key("KeyN");
    tab.wait("document.activeElement.id === 'note'");
    tab.key("KeyP");
    tab.text("nét mờ");
    tab.key("Enter");
    assert_eq!(tab.eval("document.getElementById('bar').value"), 0);
    judge(&tab, "KeyP");
    tab.wait("document.getElementById('saved').textContent === 'đã lưu ✓'");
    let log = mocban(project.dir(), &["verdict", "log"]).expect(0).out;
    assert!(log.lines().all(|line| line.contains("nét mờ")), "{log}");
    // A verdict before the minimum view time is not accepted.
    let slow = [&NO_CHECKS[..], &["--no-guide", "--min-view-ms", "60000"]].concat();
    let page = Page::start(&project, "minh", &slow);
    let tab = enter(&browser, &page, [1024, 768]);
    record_announcements(&tab);
    tab.key("KeyP");
    announced_for_some_time(&tab, "Please look at the image first");
    assert!(current_verdicts(&project, "minh").is_empty());
}
