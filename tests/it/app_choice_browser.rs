//! Pairs are chosen in a browser: with the mouse, with the keys and by touch.

use serde_json::json;

use crate::accessible::axe;
use crate::app::app;
use crate::app_browser::{enter, looks_right};
use crate::app_choice::import_many;
use crate::browser::{Browser, Tab};
use crate::cli::mocban;
use crate::page::{Page, read_project};
use crate::review_browser::ITEM;

/// Opens a list of pairs.
fn open_list(tab: &Tab<'_>, home: &str, query: &str) {
    tab.open(&format!("{home}p/p/pairs{query}"));
    listed(tab);
}

/// Waits until pairs can be chosen.
fn listed(tab: &Tab<'_>) {
    tab.wait("document.body?.dataset.ready && document.querySelector('#choice')?.dataset.ready");
}

/// Opens what the bar of a narrow window folds.
fn unfold(tab: &Tab<'_>) {
    tab.tap("#choice-more > summary");
    tab.wait("document.querySelector('#choice-more').open");
}

/// Returns the numbers of the chosen pairs of the page.
fn chosen(tab: &Tab<'_>) -> Vec<u64> {
    let numbers = tab.eval(
        "[...document.querySelectorAll('[data-pair]:checked')].map((box) => Number(box.dataset.pair.slice(-4)))",
    );
    serde_json::from_value(numbers).expect("numbers")
}

fn said(tab: &Tab<'_>) -> String {
    let text = tab.eval("document.querySelector('#chosen').textContent");
    text.as_str().expect("a text").to_owned()
}

fn choice_of(number: u32) -> String {
    format!("[data-pair$='-{number:04}']")
}

#[test]
fn a_range_is_chosen_with_shift_and_acted_on() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    open_list(&tab, &home, "");
    assert_eq!(said(&tab), "Choose pairs to do something with them.");
    tab.click(&choice_of(2), false);
    tab.click(&choice_of(6), true);
    assert_eq!(chosen(&tab), [2, 3, 4, 5, 6]);
    tab.click(&choice_of(4), false);
    assert_eq!(chosen(&tab), [2, 3, 5, 6]);
    assert_eq!(said(&tab), "Chosen: 4, 4 of them on this page");
    let resume = "document.querySelector('#resume').hidden";
    assert_eq!(tab.eval(resume), true, "none of them waits or has failed");
    let retire = "document.querySelector('#retire')";
    assert_eq!(
        tab.eval(&format!("{retire}.textContent")),
        "Take out of every count (4)"
    );
    // A click beside the box opens the pair and chooses nothing.
    tab.click(".pick-card:first-child .pair-card", false);
    tab.wait("document.querySelector('#stage')?.dataset.ready");
    open_list(&tab, &home, "?view=table&sort=iou");
    assert_eq!(chosen(&tab).len(), 4, "the choice stays in another order");
    tab.eval("window.confirm = (text) => { window.asked = text; return false; }, null");
    tab.eval(&format!("{retire}.click(), null"));
    let asked = tab.eval("window.asked");
    assert!(
        asked.as_str().is_some_and(|text| text.contains(": 4.")),
        "{asked}"
    );
    assert_eq!(chosen(&tab).len(), 4, "nothing was done");
    tab.eval("window.confirm = () => true, null");
    tab.eval(&format!("{retire}.click(), null"));
    tab.wait("document.querySelector('#undo')");
    listed(&tab);
    let text = tab.eval("document.querySelector('#done').innerText");
    assert!(
        text.as_str().is_some_and(|text| text.contains(": 4")),
        "{text}"
    );
    assert_eq!(
        tab.eval("document.querySelectorAll('[data-pair]').length"),
        11
    );
    assert!(chosen(&tab).is_empty(), "the choice is cleared");
    tab.screenshot("app_retired");
    tab.eval("document.querySelector('#undo').click(), null");
    tab.wait("document.querySelector('#done') && !document.querySelector('#undo')");
    listed(&tab);
    assert_eq!(
        tab.eval("document.querySelectorAll('[data-pair]').length"),
        15
    );
    let address = tab.eval("location.search");
    assert!(
        address
            .as_str()
            .is_some_and(|text| text.contains("sort=iou") && !text.contains("done=")),
        "{address}"
    );
}

#[test]
fn a_range_is_chosen_with_the_arrow_keys() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    open_list(&tab, &home, "?view=table");
    tab.eval(&format!(
        "document.querySelector(`{}`).focus(), null",
        choice_of(3)
    ));
    tab.press("Space", false);
    assert_eq!(chosen(&tab), [3]);
    for _ in 0..3 {
        tab.press("ArrowDown", true);
    }
    assert_eq!(chosen(&tab), [3, 4, 5, 6]);
    tab.press("ArrowUp", true);
    assert_eq!(chosen(&tab), [3, 4, 5]);
    tab.press("ArrowDown", false);
    tab.press("ArrowDown", false);
    assert_eq!(
        chosen(&tab),
        [3, 4, 5],
        "without Shift, only the focus moves"
    );
    tab.press("Space", false);
    assert_eq!(chosen(&tab), [3, 4, 5, 7]);
    // In the gallery, a row is as long as the window is wide.
    open_list(&tab, &home, "");
    tab.eval("document.querySelector('#choose-none').click(), null");
    let columns = tab.eval(
        "(() => { const tops = [...document.querySelectorAll('.pick-card')].map((card) => card.offsetTop); return tops.filter((top) => top === tops[0]).length; })()",
    );
    let columns = columns.as_u64().expect("a number");
    tab.eval(&format!(
        "document.querySelector(`{}`).focus(), null",
        choice_of(0)
    ));
    tab.press("ArrowRight", false);
    tab.press("ArrowDown", true);
    assert_eq!(chosen(&tab), (1..=columns + 1).collect::<Vec<_>>());
    tab.press("ArrowLeft", true);
    assert_eq!(chosen(&tab), (1..=columns).collect::<Vec<_>>());
    let focused = tab.eval("document.activeElement.dataset.pair");
    assert_eq!(focused, format!("upright-{columns:04}"));
}

#[test]
fn pairs_are_chosen_by_touch_and_on_several_pages() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    import_many(dir.path());
    let page = Page::of(app(dir.path()).args(["--lang", "vi"]));
    let (tab, home) = enter(&browser, &page, [400, 800]);
    open_list(&tab, &home, "");
    tab.tap(&choice_of(1));
    tab.wait("document.querySelectorAll('[data-pair]:checked').length === 1");
    let height = "document.querySelector('#choice').offsetHeight";
    let folded = tab.eval(height).as_f64().expect("a height");
    assert!(folded <= 90.0, "the bar covers {folded} of 800 px");
    tab.screenshot("app_folded_bar");
    unfold(&tab);
    tab.tap("#choose-page");
    tab.wait("document.querySelectorAll('[data-pair]:checked').length === 48");
    tab.tap(&choice_of(1));
    tab.wait("document.querySelectorAll('[data-pair]:checked').length === 47");
    tab.screenshot("app_touched");
    tab.eval("document.querySelector('.pager a[rel=next]').click(), null");
    tab.wait("location.search.includes('after')");
    listed(&tab);
    assert_eq!(said(&tab), "Đã chọn: 47, trong đó 0 ở trang này");
    tab.tap("[data-pair]");
    tab.wait("document.querySelector('#chosen').textContent.includes('48')");
    // All that match are more than can be chosen.
    unfold(&tab);
    tab.tap("#choose-all");
    tab.wait("!document.querySelector('#choice-problem').hidden");
    assert_eq!(tab.eval("document.activeElement.id"), "choice-problem");
    assert!(said(&tab).contains("48"), "{}", said(&tab));
    open_list(&tab, &home, "?state=waiting");
    unfold(&tab);
    tab.tap("#choose-none");
    tab.tap("#choose-all");
    tab.wait("document.querySelectorAll('[data-pair]:checked').length === 48");
    let thousand = "1\u{202f}000";
    let expected = format!("Đã chọn: {thousand}, trong đó 48 ở trang này");
    assert_eq!(said(&tab), expected);
    let judge = tab.eval("document.querySelector('#judge').textContent");
    assert_eq!(judge, format!("Đánh giá các cặp này ({thousand})"));
    open_list(&tab, &home, "?state=aligned");
    unfold(&tab);
    tab.tap("#choose-none");
    tab.tap("#choose-all");
    tab.wait("document.querySelectorAll('[data-pair]:checked').length === 15");
    assert_eq!(said(&tab), "Đã chọn: 15, trong đó 15 ở trang này");
    tab.eval("document.querySelector('[data-chosen] [name=purpose]').value = 'table', document.querySelector('#export-chosen').click(), null");
    tab.wait("location.pathname.endsWith('/export') && document.querySelector('[data-task=done]')");
    tab.wait("document.querySelector('.zip')");
    assert!(dir.path().join("p/exports/table-chosen").is_dir());
    let kept = tab.eval("sessionStorage.length");
    assert_eq!(kept, 0, "the choice is cleared");
}

#[test]
fn exactly_the_chosen_pairs_are_judged_in_a_browser() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    open_list(&tab, &home, "");
    tab.click(&choice_of(1), false);
    tab.click(&choice_of(3), false);
    tab.eval("document.querySelector('#judge').focus(), null");
    tab.press("Space", false);
    tab.wait("document.body?.dataset.ready && document.querySelector('#chosen-pairs b')?.textContent === '2'");
    tab.screenshot("app_judge_these");
    tab.eval("document.querySelector('#reviewer').value = 'lan', document.querySelector('form.action .primary').click(), null");
    tab.wait(ITEM);
    let pairs = tab.eval(
        "fetch('api/queue').then((reply) => reply.json()).then(({ items }) => items.map(({ pair }) => pair).sort())",
    );
    assert_eq!(pairs, json!(["upright-0001", "upright-0003"]));
}

#[test]
fn retired_pairs_leave_the_choice_and_come_back_from_their_list() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "vi"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    open_list(&tab, &home, "");
    for number in [1, 2, 3] {
        tab.click(&choice_of(number), false);
    }
    // Somebody else takes two of them out meanwhile.
    let retire = ["retire", "upright-0001", "upright-0003"];
    mocban(&dir.path().join("p"), &retire).expect(0);
    tab.eval("window.confirm = () => true, document.querySelector('#retire').click(), null");
    tab.wait("document.querySelector('#choice-actions .problem:not([hidden])')");
    let problem = tab.eval("document.querySelector('#choice-actions .problem').textContent");
    let expected = "cặp upright-0001 đã được đưa ra khỏi thống kê lúc ";
    assert!(
        problem.as_str().is_some_and(|text| text.contains(expected)),
        "{problem}"
    );
    assert_eq!(chosen(&tab), [2]);
    tab.eval("document.querySelector('.filter [name=state]').value = 'retired', document.querySelector('.filter').requestSubmit(), null");
    let rows = "document.querySelectorAll('#retired-pairs tbody tr').length";
    tab.wait(&format!(
        "document.body?.dataset.ready && location.search.includes('state=retired') && {rows} === 2"
    ));
    tab.eval("document.querySelector('#retired-pairs button').focus(), null");
    tab.press("Space", false);
    tab.wait(&format!(
        "document.body?.dataset.ready && document.querySelector('#done') && {rows} === 1"
    ));
    tab.screenshot("app_retired_list");
    open_list(&tab, &home, "");
    assert_eq!(
        tab.eval("document.querySelectorAll('[data-pair]').length"),
        14
    );
    assert_eq!(chosen(&tab), [2], "the choice stays");
}

#[test]
fn two_metrics_are_compared_side_by_side() {
    let (axe, Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    open_list(&tab, &home, "?view=table&compare=density");
    let link = "document.querySelector('tbody th a')";
    tab.eval(&format!("{link}.click(), null"));
    tab.wait(
        "document.querySelector('#other-stage') && document.querySelector('#stage').dataset.ready",
    );
    let sources = || {
        tab.eval("['stage', 'other-stage'].map((id) => document.getElementById(id).src.split('/').pop())")
    };
    assert_eq!(sources(), json!(["overlay-ensemble", "overlay-density"]));
    tab.eval("document.querySelector('[data-layer=depth_mask]').click(), null");
    assert_eq!(
        sources(),
        json!(["depth_mask-ensemble", "depth_mask-density"])
    );
    tab.key("KeyB");
    // Asked together, because the pictures take turns.
    tab.wait("document.getElementById('stage').src.endsWith('depth_mask-density') && document.querySelector('figcaption').textContent === 'Pixel density'");
    tab.wait("document.getElementById('stage').src.endsWith('depth_mask-ensemble')");
    tab.key("KeyB");
    assert_eq!(
        sources(),
        json!(["depth_mask-ensemble", "depth_mask-density"])
    );
    let heads = tab.eval(
        "[...document.querySelectorAll('#numbers th[scope=col]')].map((head) => head.textContent)",
    );
    let expected = [
        "Number",
        "Ensemble",
        "Pixel density",
        "Difference",
        "Meaning",
    ];
    assert_eq!(heads, json!(expected));
    tab.eval("document.querySelector('#compare a').click(), null");
    tab.wait("document.querySelector('#stage')?.dataset.ready && !document.querySelector('#other-stage')");
    for language in ["en", "vi"] {
        for (name, path) in [
            ("compare", "pair/upright-0000/?compare=density"),
            ("chosen", "pairs"),
            (
                "chosen_table",
                "pairs?view=table&compare=density&differs=0.01",
            ),
        ] {
            let join = if path.contains('?') { '&' } else { '?' };
            let kept = "sessionStorage.setItem('mocban-chosen:p', '[\"upright-0000\", \"upright-0002\"]'), null";
            tab.eval(kept);
            let url = format!("{home}p/p/{path}{join}language={language}");
            let name = format!("{name}_{language}");
            looks_right(&browser, &tab, &name, &url, axe.as_deref());
        }
    }
}
