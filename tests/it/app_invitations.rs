//! Reviewers who are invited by the app: what their link opens, and what it does not.

use serde_json::{Value, json};

use crate::accessible::{axe, no_violation};
use crate::app::{act, app, text};
use crate::app_browser::enter;
use crate::browser::Browser;
#[cfg(target_os = "linux")]
use crate::cli::call;
use crate::cli::mocban;
#[cfg(target_os = "linux")]
use crate::memory::enlarge;
use crate::page::{Page, Site, answer, read_project, send};
#[cfg(target_os = "linux")]
use crate::resume::{pairs, project, run};
use crate::review_browser::{judge, saved};
#[cfg(target_os = "linux")]
use crate::review_load::peak_mib;

/// Starts the app on a folder with the shared project `p`. Guests reach it at 127.0.0.1, as the tests have no network.
fn start() -> (tempfile::TempDir, Page) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = Page::of(app(dir.path()).args(["--lang", "en", "--listen", "127.0.0.1"]));
    (dir, page)
}

/// Starts the app and opens its session.
pub(crate) fn start_entered() -> (tempfile::TempDir, Page) {
    let (dir, page) = start();
    (dir, page.entered())
}

/// The fields of the form with which a reviewer is invited.
fn invitation(reviewer: &str) -> Value {
    json!({"reviewer": reviewer, "metric": "relief", "sample": "3", "order": "random", "invite": "yes"})
}

/// Invites a reviewer and returns the links of all invitations that were not opened.
pub(crate) fn invite(page: &Page, reviewer: &str) -> Vec<String> {
    let reply = act(page, "/p/p/actions/review", &invitation(reviewer), |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    links(page)
}

fn links(page: &Page) -> Vec<String> {
    let html = text(&page.get("/p/p/review"));
    let parts = html.split("data-copy=\"").skip(1);
    parts
        .map(|part| part.split('"').next().expect("a link").to_owned())
        .collect()
}

/// Opens a link as a browser does.
pub(crate) fn open(url: &str) -> Site {
    let mut site = Site::closed(url);
    site.enter_as_guest();
    site
}

#[test]
fn a_guest_judges_under_the_name_of_the_invitation_and_does_nothing_else() {
    let (dir, page) = start_entered();
    let sent = invite(&page, "Lan Anh");
    let [link] = sent.as_slice() else {
        panic!("one link: {sent:?}");
    };
    let guest = open(link);
    assert_ne!(guest.host, page.host, "guests have a server of their own");
    let items = guest.queue();
    let reply = guest.post("/api/answer", &answer("e-1", &items[0], "pass"));
    assert_eq!(reply.expect("a reply").status, 200);
    let log = mocban(&dir.path().join("p"), &["verdict", "log", "--json"]).expect(0);
    assert!(log.out.contains("Lan Anh"), "{}", log.out);

    for path in [
        "/p/p/",
        "/p/p/review",
        "/import",
        "/restore",
        "/restore/content",
        "/p/p/backup.sqlite",
    ] {
        assert_eq!(guest.get(path).status, 404, "{path}");
        let own_path = Site {
            cookie: guest.cookie.clone(),
            ..(*page).clone()
        };
        assert_eq!(
            own_path.get(path).status,
            401,
            "{path} with a guest's cookie"
        );
    }
    for path in ["/p/p/actions/retire", "/actions/demo", "/actions/restore"] {
        let reply = guest.post(path, &json!({"pair": "upright-0000"}));
        assert_eq!(reply.expect("a reply").status, 404, "{path}");
    }
    // A guest can send no files.
    let begin = guest.post(
        "/actions/upload",
        &json!({"name": "x", "files": 1, "bytes": 1}),
    );
    assert_eq!(begin.expect("a reply").status, 404);
    let mut headers = guest.headers();
    headers.retain(|(name, _)| *name != "content-type");
    headers.push(("content-type", "application/octet-stream".to_owned()));
    let path = format!("{}/uploads/1/1.stl", guest.session);
    let sent = send(guest.address(), "POST", &path, &headers, b"solid");
    assert_eq!(sent.expect("a reply").status, 415);
    assert!(!dir.path().join("uploads").exists());
    // The session of the app does not exist on the server for guests.
    let elsewhere = Site {
        host: guest.host.clone(),
        ..(*page).clone()
    };
    assert_eq!(elsewhere.get("/").status, 401);
    assert_eq!(links(&page), [""; 0], "a link that was opened is not shown");
}

#[test]
fn a_link_works_once_for_one_guest_on_one_server() {
    let (_dir, page) = start_entered();
    invite(&page, "lan");
    let sent = invite(&page, "minh");
    let [lan, minh] = [0, 1].map(|index| open(&sent[index]));
    let reply = |site: &Site| site.get("/").status;
    assert_eq!([reply(&lan), reply(&minh)], [200, 200]);
    let mixed = Site {
        cookie: minh.cookie.clone(),
        ..lan.clone()
    };
    assert_eq!(reply(&mixed), 401, "the cookie of another guest");
    let again = lan.get_path(lan.start_path());
    assert_eq!(again.status, 403);
    let twice = act(&page, "/p/p/actions/review", &invitation("lan"), |_| {});
    assert_eq!(
        twice.status,
        422,
        "an invitation that is in use stays: {}",
        text(&twice)
    );
    assert_eq!(reply(&lan), 200);
    assert!(
        text(&again).contains("ask the person who invited you"),
        "{}",
        text(&again)
    );
    for (name, value, status) in [
        ("host", "evil.example", 421),
        ("origin", "http://evil.example", 403),
        ("x-csrf-token", "0", 403),
        ("x-csrf-token", minh.csrf_token.as_str(), 403),
    ] {
        let mut headers = lan.headers();
        headers.retain(|(known, _)| *known != name);
        headers.push((name, value.to_owned()));
        let path = format!("{}/api/answer", lan.session);
        let reply = send(lan.address(), "POST", &path, &headers, b"{}").expect("a reply");
        assert_eq!(reply.status, status, "{name}");
    }
    // A preview of a chat program fetches a link, and another page cannot press its button.
    let fresh = Site::closed(&invite(&page, "chi")[0]);
    for _ in 0..2 {
        assert_eq!(fresh.get_path(fresh.start_path()).status, 200);
    }
    let headers = [
        ("host", fresh.host.clone()),
        ("origin", "http://evil.example".to_owned()),
    ];
    let pressed = send(fresh.address(), "POST", fresh.start_path(), &headers, b"");
    assert_eq!(pressed.expect("a reply").status, 403);
    let wrong = Site::closed(&format!("http://{}/start?token=0", lan.host));
    assert_eq!(wrong.get_path(wrong.start_path()).status, 403);
}

#[test]
fn a_new_link_ends_the_session_before_and_a_withdrawn_one_ends() {
    let (_dir, page) = start_entered();
    let link = invite(&page, "lan").remove(0);
    let first = open(&link);
    let change = |change: &str| {
        let choice = "metric=relief&sample=3&order=random";
        let body = json!({"reviewer": "lan", "choice": choice, "change": change});
        let reply = act(&page, "/p/p/actions/invitation", &body, |_| {});
        assert_eq!(reply.status, 200, "{}", text(&reply));
    };
    let items = first.queue();
    let stored = first.post("/api/answer", &answer("e-1", &items[0], "fail"));
    assert_eq!(stored.expect("a reply").status, 200);
    change("renew");
    assert_eq!(first.get("/").status, 401);
    let second = open(&links(&page)[0]);
    assert_eq!(
        second.queue()[0]["answer"]["verdict"],
        "fail",
        "it continues"
    );
    change("withdraw");
    assert_eq!(second.get("/").status, 401);
    assert!(!text(&page.get("/p/p/review")).contains("Invitations"));
    change("renew");
    assert_eq!(links(&page), [""; 0], "it stays withdrawn");
}

#[test]
fn the_page_shows_how_far_each_guest_is() {
    let (_dir, page) = start_entered();
    let guest = open(&invite(&page, "lan")[0]);
    let shown = || text(&page.get("/p/p/review"));
    let items = guest.queue();
    let count = items.len();
    let answered = |number: usize| format!("Answered: <b>{number}</b> / {count}");
    assert!(shown().contains(&answered(0)), "{}", shown());
    assert!(shown().contains("Last seen: <time"), "{}", shown());
    for (number, item) in items.iter().enumerate() {
        let event = format!("e-{number}");
        let reply = guest.post("/api/answer", &answer(&event, item, "pass"));
        assert_eq!(reply.expect("a reply").status, 200);
        let html = shown();
        assert!(html.contains(&answered(number + 1)), "{html}");
        assert_eq!(html.contains("finished"), number + 1 == count, "{html}");
    }
    let undo = json!({"event": format!("e-{}", count - 1)});
    let reply = guest.post("/api/undo", &undo).expect("a reply");
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert!(shown().contains(&answered(count - 1)), "{}", shown());
    assert!(!shown().contains("finished"));
    // One who was invited and did not come yet.
    invite(&page, "minh");
    assert_eq!(shown().matches("Last seen").count(), 1);
}

#[test]
fn answers_of_a_guest_wait_while_another_project_is_in_its_place() {
    let (dir, page) = start_entered();
    let guest = open(&invite(&page, "lan")[0]);
    let item = guest.queue()[0].clone();
    std::fs::rename(dir.path().join("p"), dir.path().join("old")).expect("moved");
    read_project(&dir);
    let reply = guest.get("/api/queue");
    assert_eq!(reply.status, 503, "{}", text(&reply));
    assert!(reply.json()["error"].is_string());
    // The page keeps an answer that gets such a reply, and sends it again.
    let sent = guest.post("/api/answer", &answer("e-1", &item, "pass"));
    assert_eq!(sent.expect("a reply").status, 503);
    std::fs::remove_dir_all(dir.path().join("p")).expect("removed");
    std::fs::rename(dir.path().join("old"), dir.path().join("p")).expect("moved back");
    let sent = guest.post("/api/answer", &answer("e-1", &item, "pass"));
    assert_eq!(sent.expect("a reply").status, 200);
}

/// Each decoded print has 69 MiB, so one for each of sixteen guests would need more than a gigabyte.
#[cfg(target_os = "linux")]
#[test]
fn the_memory_of_the_app_does_not_grow_with_its_guests() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "3");
    for pair in pairs(&project) {
        let print = project.input_path(&pair.results.attributes.print_path);
        enlarge(&print, 12_000_000);
    }
    call(&mut run(&project, &["-j", "1"])).expect(0);
    let page = Page::of(app(dir.path()).args(["--lang", "en", "--listen", "127.0.0.1"])).entered();
    let guests = (0..16).map(|number| open(&invite(&page, &format!("guest {number}"))[0]));
    let guests: Vec<Site> = guests.collect();
    std::thread::scope(|scope| {
        for guest in &guests {
            scope.spawn(move || {
                for item in guest.queue().into_iter().take(4) {
                    let id = item["id"].as_str().expect("an id");
                    let print = guest.get(&format!("/image/{id}/print"));
                    assert_eq!(print.status, 200, "{}", text(&print));
                }
            });
        }
    });
    let peak = peak_mib(page.pid());
    assert!(peak < 800, "{peak} MiB");
}

#[test]
fn a_curator_invites_and_a_colleague_judges_in_a_browser() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let (_dir, page) = start();
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    tab.open(&format!("{home}p/p/review"));
    tab.wait("document.body?.dataset.ready && document.querySelector('[name=invite]')");
    tab.eval("document.querySelector('#reviewer').value = 'Bảo', document.querySelector('[name=sample]').value = 2, document.querySelector('[name=invite]').click(), null");
    tab.wait("document.querySelector('.invitation .qr path')");
    if let Some(axe) = axe() {
        no_violation(&tab, &axe, "app_invitation");
    }
    let link = tab.eval("document.querySelector('.invitation .link').value");
    let guest = browser.tab(400, 800);
    // A page of another computer without encryption has no such function.
    guest.before_scripts("delete Crypto.prototype.randomUUID");
    guest.open(link.as_str().expect("a link"));
    guest.wait("document.querySelector('form button')");
    guest.screenshot("app_welcome");
    guest.eval("document.querySelector('form button').click(), null");
    guest.wait("document.body?.dataset.ready && document.body.dataset.shown");
    assert_eq!(
        guest.eval("document.querySelector('header a[href*=\"..\"]')"),
        Value::Null
    );
    guest.screenshot("app_guest");
    guest.key("Escape");
    guest.wait("!document.querySelector('dialog[open]')");
    // An image must be shown for some time before an answer is accepted.
    guest.eval("window.since = Date.now(), null");
    guest.wait("Date.now() - window.since > 400");
    judge(&guest, "KeyP");
    saved(&guest);
    // The page in the background does not follow by itself.
    tab.reload();
    tab.wait("document.querySelector('.invitation .good')");
}

#[test]
fn guests_who_share_a_browser_keep_their_sessions_apart() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let (_dir, page) = start_entered();
    invite(&page, "lan");
    let sent = invite(&page, "minh");
    let enter = |link: &str| {
        let tab = browser.tab(1024, 768);
        tab.open(link);
        tab.wait("document.querySelector('form button')");
        tab.eval("document.querySelector('form button').click(), null");
        tab.wait("document.body?.dataset.ready && document.body.dataset.shown");
        tab.key("Escape");
        tab.wait("!document.querySelector('dialog[open]')");
        tab
    };
    let lan = enter(&sent[0]);
    // The session that was opened last is Minh's.
    let _minh = enter(&sent[1]);
    let renew = json!({"reviewer": "lan", "choice": "metric=relief&sample=3&order=random", "change": "renew"});
    let reply = act(&page, "/p/p/actions/invitation", &renew, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    lan.eval("document.querySelector('.verdict[data-action=pass]').click(), null");
    lan.wait("document.body.innerText.includes('Your link has ended')");
    // Her page moves to her new link only, and sends what it kept.
    let _again = enter(&links(&page)[0]);
    lan.wait("document.getElementById('saved')?.textContent.includes('✓')");
    let name = lan.eval("document.querySelector('header b').textContent");
    assert_eq!(name, "lan");
}
