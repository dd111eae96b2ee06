//! Lists of pairs in the app: the least confident results of a run, and views that are saved.

use serde_json::{Value, json};

use crate::app::{act, app, html, open_app, text, token, with_project};
use crate::app_browser::enter;
use crate::browser::Browser;
use crate::page::{Page, Reply, read_project, send};

/// Returns the ids and confidences of the cards of a part of a page.
fn cards(part: &str) -> Vec<(String, String)> {
    let cards = part.split("class=\"pair-card\" href=\"").skip(1);
    let cards = cards.map(|card| {
        let id = card.split("pair/").nth(1).expect("an address");
        let id = id.split('/').next().expect("an id").to_owned();
        let confidence = card.split("confidence ").nth(1).expect("a confidence");
        let confidence = confidence.split('<').next().expect("a number").to_owned();
        (id, confidence)
    });
    cards.collect()
}

#[test]
fn the_page_of_the_run_has_its_least_confident_results() {
    let (_dir, page) = with_project();
    let run = html(&page, "/p/p/");
    let worst = run.split("id=\"worst\"").nth(1).expect("a gallery");
    let worst = worst.split("</section>").next().expect("its end");
    assert!(
        worst.contains("Least confident of the last hour"),
        "{worst}"
    );
    let worst = cards(worst);
    assert_eq!(worst.len(), 6);
    let all = cards(&html(&page, "/p/p/pairs?sort=confidence"));
    assert_eq!(worst, all[..6]);
    html(&page, &format!("/p/p/pair/{}/", worst[0].0));
}

/// Sends a change of the saved views.
fn change_view(page: &Page, body: &Value) -> Reply {
    act(page, "/p/p/actions/view", body, |_| {})
}

fn save_view(page: &Page, name: &str, list: &str) -> Reply {
    change_view(page, &json!({"action": "save", "name": name, "list": list}))
}

#[test]
fn a_saved_view_has_an_address_and_outlives_the_app() {
    let (dir, page) = with_project();
    let unsaved = html(&page, "/p/p/pairs?confidence=low&sort=confidence");
    assert!(unsaved.contains("id=\"save-view\""), "{unsaved}");
    assert!(!unsaved.contains("id=\"saved-views\""), "{unsaved}");
    let list = "view=&sort=confidence&confidence=low&after=0.5,7";
    assert_eq!(save_view(&page, " Thấp 1/2 ", list).status, 200);
    let plain = html(&page, "/p/p/pairs");
    let link = "<a href=\"pairs/view/Th%E1%BA%A5p%201%2F2\">Thấp 1/2</a>";
    assert!(plain.contains(link), "{plain}");
    drop(page);
    let page = open_app(dir.path());
    let address = "/p/p/pairs/view/Th%E1%BA%A5p%201%2F2";
    let reply = page.get(address);
    assert_eq!(reply.status, 303);
    let target = "../../pairs?confidence=low&sort=confidence";
    assert_eq!(reply.header("location"), Some(target));
    let shown = html(&page, "/p/p/pairs?confidence=low&sort=confidence");
    for part in ["aria-current=\"true\">Thấp 1/2", "id=\"change-view\""] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    let known = json!({"view": "Thấp 1/2", "list": "confidence=low&sort=confidence"});
    let mut rename = known.clone();
    rename["action"] = json!("rename");
    rename["name"] = json!("低信心");
    assert_eq!(change_view(&page, &rename).status, 200);
    let gone = page.get(address);
    assert_eq!(gone.status, 404);
    assert!(
        text(&gone).contains("there is no saved view"),
        "{}",
        text(&gone)
    );
    let mut remove = known;
    remove["action"] = json!("remove");
    assert_eq!(
        change_view(&page, &remove).status,
        422,
        "it has another name"
    );
    remove["view"] = json!("低信心");
    assert_eq!(change_view(&page, &remove).status, 200);
    let none = html(&page, "/p/p/pairs");
    assert!(!none.contains("id=\"saved-views\""), "{none}");
}

#[test]
fn views_that_two_tabs_save_at_the_same_time_are_all_kept() {
    let (_dir, page) = with_project();
    let site = &*page;
    let token = token(&page);
    std::thread::scope(|scope| {
        for tab in 0..2 {
            let token = &token;
            scope.spawn(move || {
                for number in 0..5 {
                    let mut headers = site.headers();
                    headers.retain(|(name, _)| *name != "x-csrf-token");
                    headers.push(("x-csrf-token", token.clone()));
                    let name = format!("tab {tab} view {number}");
                    let body = json!({"action": "save", "name": name, "list": "state=failed"});
                    let (path, body) = (
                        format!("{}/p/p/actions/view", site.session),
                        body.to_string(),
                    );
                    let reply = send(site.address(), "POST", &path, &headers, body.as_bytes());
                    assert_eq!(reply.expect("a reply").status, 200, "{name}");
                }
            });
        }
    });
    let shown = html(&page, "/p/p/pairs");
    assert_eq!(
        shown.matches("href=\"pairs/view/tab%20").count(),
        10,
        "{shown}"
    );
}

#[test]
fn a_view_that_cannot_be_kept_is_refused_with_the_reason() {
    let (dir, page) = with_project();
    for (name, list, part) in [
        ("x", "", "this is the list of all pairs"),
        ("x", "differs=0.1", "needs two metrics"),
        ("", "state=failed", "a view needs a name"),
        ("..", "state=failed", "does not begin with a dot"),
    ] {
        let reply = save_view(&page, name, list);
        assert_eq!(reply.status, 422, "{name} {list}");
        let why = reply.json()["error"]
            .as_str()
            .expect("a sentence")
            .to_owned();
        assert!(why.contains(part), "{why}");
    }
    assert_eq!(save_view(&page, "Low", "confidence=low").status, 200);
    assert_eq!(save_view(&page, "low", "state=failed").status, 422);
    let file = dir.path().join("p/saved-views.json");
    assert!(file.is_file(), "the file of the views");
    std::fs::write(&file, "{").expect("written");
    let shown = html(&page, "/p/p/pairs?state=failed");
    assert!(shown.contains("correct or remove the file"), "{shown}");
    let all = html(&page, "/p/p/pairs");
    assert!(all.contains("pair/upright-0000/"), "{all}");
    assert_eq!(save_view(&page, "new", "state=failed").status, 422);
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), "{");
}

#[test]
fn a_view_is_saved_opened_and_deleted_in_the_browser() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    tab.open(&format!("{home}p/p/pairs?sort=iou&view=table"));
    let ready = "document.body?.dataset.ready";
    tab.wait(ready);
    tab.eval("document.querySelector('#save-view').open = true, null");
    tab.eval("document.querySelector('#save-view [name=name]').focus(), null");
    tab.text("Chữ khó");
    tab.eval("document.querySelector('#save-view button').click(), null");
    tab.wait("document.querySelector('#saved-views a[aria-current]')?.textContent === 'Chữ khó'");
    tab.screenshot("app_saved_view");
    tab.open(&format!("{home}p/p/pairs"));
    tab.wait(ready);
    tab.eval("document.querySelector('#saved-views a').click(), null");
    tab.wait("location.search === '?sort=iou&view=table' && document.body?.dataset.ready");
    tab.eval("window.confirm = () => true, document.querySelector('#change-view [value=remove]').click(), null");
    tab.wait("document.body?.dataset.ready && document.querySelector('#save-view')");
    let is_gone = tab.eval("document.querySelector('#saved-views') === null");
    assert_eq!(is_gone, true);
}
