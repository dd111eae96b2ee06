//! `mocban app` by raw requests: its guard, its addresses, its actions and its pages without a browser.

use std::path::Path;

use serde_json::{Value, json};

use crate::cli::{binary, mocban, status};
use crate::page::{Page, Reply, read_project, send};
use crate::waiting::wait_until;

/// Starts the app on a folder and opens a session.
pub(crate) fn open_app(folder: &Path) -> Page {
    Page::of(app(folder).args(["--lang", "en"])).entered()
}

/// Returns the command of the app on a folder.
pub(crate) fn app(folder: &Path) -> std::process::Command {
    let mut command = binary();
    command.args(["--json", "app", "--no-open"]).arg(folder);
    command
}

/// Opens the app on a folder with the shared project `p`.
pub(crate) fn with_project() -> (tempfile::TempDir, Page) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let page = open_app(dir.path());
    (dir, page)
}

pub(crate) fn text(reply: &Reply) -> String {
    String::from_utf8_lossy(&reply.body).into_owned()
}

/// Returns a page as its HTML.
#[track_caller]
pub(crate) fn html(page: &Page, path: &str) -> String {
    let reply = page.get(path);
    let shown = text(&reply);
    assert_eq!(reply.status, 200, "{path}: {shown}");
    shown
}

/// Returns the token that actions carry, from a page.
pub(crate) fn token(page: &Page) -> String {
    let html = text(&page.get("/"));
    let token = html.split("name=\"csrf-token\" content=\"").nth(1);
    let token = token.and_then(|rest| rest.split('"').next());
    token.expect("a token").to_owned()
}

/// Sends an action with the headers of the page; `change` may change them.
pub(crate) fn act(
    page: &Page,
    path: &str,
    body: &Value,
    change: impl FnOnce(&mut Vec<(&'static str, String)>),
) -> Reply {
    let mut headers = page.headers();
    headers.retain(|(name, _)| *name != "x-csrf-token");
    headers.push(("x-csrf-token", token(page)));
    change(&mut headers);
    let path = format!("{}{path}", page.session);
    let body = body.to_string();
    send(page.address(), "POST", &path, &headers, body.as_bytes()).expect("a reply")
}

#[test]
fn every_page_is_shown_and_links_only_to_this_server() {
    let (_dir, page) = with_project();
    for path in [
        "/",
        "/import",
        "/restore",
        "/p/p/",
        "/p/p/pairs",
        "/p/p/pairs?view=table&sort=confidence&state=aligned",
        "/p/p/pairs?id=nobody",
        "/p/p/pair/upright-0000/",
        "/p/p/pair/upright-0000/3d/",
        "/p/p/blocks",
        "/p/p/review",
        "/p/p/report",
        "/p/p/report/numbers",
        "/p/p/review/agreement",
        "/p/p/last-import",
        "/p/p/export",
        "/p/p/settings",
        "/p/p/settings?key=run.workers&value=3",
        "/p/p/correct?what=unit&class=bad_input",
        "/p/p/correct?what=side&pair=upright-0000",
        "/p/p/health",
    ] {
        for language in ["en", "vi"] {
            let join = if path.contains('?') { '&' } else { '?' };
            let reply = page.get(&format!("{path}{join}language={language}"));
            let html = text(&reply);
            assert_eq!(reply.status, 200, "{path}: {html}");
            let is_part = ["numbers", "agreement", "last-import"]
                .iter()
                .any(|end| path.ends_with(end));
            assert!(
                is_part || html.contains(&format!("<html lang=\"{language}\"")),
                "{path}"
            );
            for outside in ["http:", "https:", "src=\"//", "style=\""] {
                assert!(!html.contains(outside), "{path} has {outside}");
            }
        }
    }
    for picture in [
        "thumb",
        "print",
        "relief",
        "print_mask",
        "depth_mask",
        "overlay",
        "scan",
    ] {
        let reply = page.get(&format!(
            "/p/p/pair/upright-0000/picture/{picture}-ensemble"
        ));
        let kind = reply.header("content-type").expect("a type");
        assert!(
            ["image/jpeg", "image/png"].contains(&kind),
            "{picture}: {kind}"
        );
    }
    for asset in ["view.js", "reply.js", "scan-viewer.css", "three.min.js"] {
        let reply = page.get(&format!("/p/p/pair/upright-0000/3d/assets/{asset}"));
        assert_eq!(reply.status, 200, "{asset}");
    }
    let scan = page.get("/p/p/pair/upright-0000/3d/scan");
    assert_eq!((scan.status, scan.body.len() > 1000), (200, true));
}

#[test]
fn an_address_leads_to_nothing_outside_the_folder() {
    let (dir, page) = with_project();
    std::fs::create_dir(dir.path().join("other")).expect("a folder");
    for path in [
        "/p/other/",
        "/p/..%2Fp/",
        "/p/%2Fetc/",
        "/p/p%2F..%2Fp/",
        "/p/p/pair/..%2F..%2Fcatalog/",
        "/p/p/pair/upright-0000/picture/..%2Fcatalog.sqlite",
        "/p/p/exports/excel/..%2F..%2Fcatalog.sqlite",
        "/p/p/exports/..%2F..%2Fp/catalog.sqlite",
        "/p/p/report/file/..%2Fcatalog.sqlite",
        "/p/p/backup.sqlite",
        "/assets/..%2Fapp.js",
        "/nothing",
    ] {
        let reply = page.get(path);
        assert_eq!(reply.status, 404, "{path}");
    }
    for outside in ["/etc", "/", &format!("{}/../..", dir.path().display())] {
        let reply = page.get(&format!("/import?path={}", outside.replace('/', "%2F")));
        let html = text(&reply);
        let is_refused = html.contains("is outside your folders and disks");
        assert!(
            is_refused || outside.starts_with(dir.path().to_str().expect("UTF-8")),
            "{outside}: {html}"
        );
        assert!(!html.contains("passwd"), "{outside}");
    }
    let chosen = json!({"project": "x", "list": "/etc/passwd"});
    let reply = act(&page, "/actions/import", &chosen, |_| {});
    assert_eq!(reply.status, 422, "{}", text(&reply));
    for name in ["../x", "a/b", ".x", ""] {
        let folder = dir.path().join("p/data").display().to_string();
        let chosen = json!({"project": name, "meshes": folder, "prints": folder});
        let reply = act(&page, "/actions/import", &chosen, |_| {});
        assert_eq!(reply.status, 422, "{name}: {}", text(&reply));
    }
}

#[test]
fn the_newest_import_is_undone_unless_another_followed() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let counted = || status(&project)["pairs"].clone();
    let all = counted();
    let part = || text(&page.get("/p/p/last-import"));
    let at = part();
    let at = at
        .split("name=\"at\" value=\"")
        .nth(1)
        .and_then(|rest| rest.split('"').next());
    let at = at.expect("a time").to_owned();
    let path = "/p/p/actions/last-import";
    let change = |at: &str, change: &str| {
        act(&page, path, &json!({"at": at, "change": change}), |_| {}).status
    };
    assert_eq!(
        change("1", "retire"),
        422,
        "not the import that the page showed"
    );
    assert_eq!(counted(), all);
    assert_eq!((change(&at, "retire"), counted()), (200, json!(0)));
    assert!(part().contains("Bring them back"), "{}", part());
    assert_eq!((change(&at, "restore"), counted()), (200, all));
    // A pair that was retired by hand does not come back.
    mocban(&project, &["retire", "upright-0000"]).expect(0);
    assert_eq!(change(&at, "retire"), 200);
    assert!(part().contains("come back: <b>14</b>"), "{}", part());
    assert_eq!((change(&at, "restore"), counted()), (200, json!(14)));
    assert!(text(&page.get("/import?project=p")).contains("data-load=\"p/p/last-import\""));
}

#[cfg(unix)]
#[test]
fn a_project_that_is_renamed_away_and_back_stays_usable() {
    let (dir, page) = with_project();
    let [here, away] = ["p", "q"].map(|name| dir.path().join(name));
    let is_shown = |path: &str| page.get(path).status == 200;
    assert!(is_shown("/p/p/pairs"));
    // Between two requests, and with requests while it is away.
    for asks_meanwhile in [false, true] {
        std::fs::rename(&here, &away).expect("renamed");
        if asks_meanwhile {
            assert_eq!(page.get("/p/p/pairs").status, 404);
            assert!(is_shown("/p/q/pairs"));
        }
        std::fs::rename(&away, &here).expect("renamed back");
        assert!(is_shown("/p/p/pairs"));
        assert_eq!(page.get("/p/q/pairs").status, 404);
        let pair = json!({"pair": "upright-0001"});
        for action in ["retire", "restore"] {
            let reply = act(&page, &format!("/p/p/actions/{action}"), &pair, |_| {});
            assert_eq!(reply.status, 200, "{action}: {}", text(&reply));
        }
        assert_eq!(status(&here)["pairs"], 15);
    }
    mocban(&here, &["check"]).expect(0);
}

#[test]
fn only_the_page_itself_may_act() {
    let (dir, page) = with_project();
    let body = json!({"pair": "upright-0000"});
    let path = "/p/p/actions/retire";
    let set = |name: &'static str, value: &str| {
        let value = value.to_owned();
        move |headers: &mut Vec<(&'static str, String)>| {
            headers.retain(|(known, _)| *known != name);
            if !value.is_empty() {
                headers.push((name, value));
            }
        }
    };
    for (name, value, status) in [
        ("host", "evil.example", 421),
        ("origin", "http://evil.example", 403),
        ("origin", "", 403),
        ("x-csrf-token", "", 403),
        ("x-csrf-token", "0", 403),
        ("cookie", "", 401),
        ("content-type", "text/plain", 415),
    ] {
        let reply = act(&page, path, &body, set(name, value));
        assert_eq!(reply.status, status, "{name}: {value}");
    }
    let project = dir.path().join("p");
    assert_eq!(status(&project)["retired"], 0);
    let reply = act(&page, path, &body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert_eq!(status(&project)["retired"], 1);
    let wrong = act(&page, path, &json!({"pair": "nobody"}), |_| {});
    assert_eq!(wrong.status, 422);
    assert!(
        wrong.json()["error"]
            .as_str()
            .expect("a sentence")
            .contains("nobody")
    );
}

#[test]
fn folders_are_planned_before_and_stored_after_a_click() {
    let (dir, page) = with_project();
    let data = dir.path().join("p/data");
    let folder = |name: &str| data.join(name).display().to_string();
    let [meshes, prints] = [folder("meshes"), folder("prints")];
    let encode = |path: &str| path.replace('/', "%2F");
    let plan = page.get(&format!(
        "/import?project=new&meshes={}&prints={}",
        encode(&meshes),
        encode(&prints)
    ));
    let html = text(&plan);
    assert!(html.contains("upright-0000"), "{html}");
    assert!(!dir.path().join("new").exists(), "nothing is stored before");
    let chosen = json!({"project": "new", "meshes": meshes, "prints": prints, "unit": "mm"});
    let reply = act(&page, "/actions/import", &chosen, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert_eq!(reply.json()["go"], "p/new/");
    assert_eq!(status(&dir.path().join("new"))["pairs"], 15);
    assert_eq!(page.get("/p/new/").status, 200);
}

#[test]
fn a_kill_during_an_import_leaves_nothing_half_done() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let data = dir.path().join("p/data");
    let folder = |name: &str| data.join(name).display().to_string();
    let chosen = json!({"project": "new", "meshes": folder("meshes"), "prints": folder("prints")});
    let hold = dir.path().join("hold");
    let mut held = app(dir.path());
    held.args(["--lang", "en"]);
    held.env("MOCBAN_HOLD_AT", "import:computed:5");
    held.env("MOCBAN_HOLD_FILE", &hold);
    let mut page = Page::of(&mut held).entered();
    std::thread::scope(|scope| {
        let site = &page;
        let (body, csrf) = (chosen.to_string(), token(site));
        let request = scope.spawn(move || {
            let mut headers = site.headers();
            headers.retain(|(name, _)| *name != "x-csrf-token");
            headers.push(("x-csrf-token", csrf));
            let path = format!("{}/actions/import", site.session);
            send(site.address(), "POST", &path, &headers, body.as_bytes()).is_err()
        });
        wait_until("the import is held", || hold.exists());
        rustix::process::kill_process(site.pid(), rustix::process::Signal::KILL).expect("killed");
        assert!(request.join().expect("no panic"), "there is no reply");
    });
    page.kill();
    let catalog = dir.path().join("new/catalog.sqlite");
    assert!(!catalog.exists(), "nothing is imported");
    let next = open_app(dir.path());
    let reply = act(&next, "/actions/import", &chosen, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert_eq!(status(&dir.path().join("new"))["pairs"], 15);
}

#[test]
fn a_reviewer_with_a_similar_name_is_asked_for() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let set = [
        "verdict",
        "set",
        "upright-0000",
        "pass",
        "--reviewer",
        "Lan",
    ];
    mocban(&project, &set).expect(0);
    let mut form =
        json!({"reviewer": "lân", "metric": "ensemble", "sample": "3", "order": "random"});
    let path = "/p/p/actions/review";
    let refused = act(&page, path, &form, |_| {});
    assert_eq!(refused.status, 422);
    assert!(
        text(&refused).contains("nearly the same name"),
        "{}",
        text(&refused)
    );
    form["is_new"] = json!("yes");
    let reply = act(&page, path, &form, |_| {}).json();
    let go = reply["go"].as_str().expect("an address").to_owned();
    let queue = page.get(&format!("/p/p/{go}api/queue"));
    assert!(
        queue.json()["items"]
            .as_array()
            .is_some_and(|items| items.len() >= 3)
    );
    let reviewers = text(&page.get("/p/p/review/agreement"));
    assert!(
        reviewers.contains("<th scope=\"row\">Lan</th>"),
        "{reviewers}"
    );
    let judged = text(&page.get("/p/p/pairs?verdict=pass&metric=ensemble"));
    assert!(
        judged.contains("upright-0000") && !judged.contains("upright-0001"),
        "{judged}"
    );
}

#[test]
fn a_setting_is_saved_with_what_it_costs() {
    let (dir, page) = with_project();
    let asked = text(&page.get("/p/p/settings?key=register.min_confidence&value=0.4"));
    assert!(
        asked.contains("<b>15</b> pairs would be computed again"),
        "{asked}"
    );
    let comma = text(&page.get("/p/p/settings?key=register.min_confidence&value=0,4"));
    assert!(comma.contains("<code>0.4</code>"), "{comma}");
    let refused = text(&page.get("/p/p/settings?key=register.min_confidence&value=7"));
    assert!(refused.contains("is outside the range 0 to 1"), "{refused}");
    let grouped = text(&page.get("/p/p/settings?key=limits.image.max_pixels&value=20.000.000"));
    assert!(grouped.contains("<code>20000000</code>"), "{grouped}");
    let word = text(&page.get("/p/p/settings?key=run.workers&value=hai&language=vi"));
    assert!(
        word.contains("không phải là số nguyên từ 0 trở lên"),
        "{word}"
    );
    assert!(!word.contains("--set"), "{word}");
    page.get("/?language=en");
    let body = json!({"key": "register.min_confidence", "value": "0.4"});
    let reply = act(&page, "/p/p/actions/setting", &body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let go = reply.json()["go"].as_str().expect("a page").to_owned();
    let saved = text(&page.get(&format!("/p/p/{go}")));
    for part in [
        "Saved",
        "the default is",
        "aria-label=\"Put back register.min_confidence\"",
    ] {
        assert!(saved.contains(part), "{part}: {saved}");
    }
    let file = std::fs::read_to_string(dir.path().join("p/mocban.toml")).expect("settings");
    assert!(file.contains("[register]\nmin_confidence = 0.4"), "{file}");
    let hidden = json!({"key": "storage.catalog", "value": "postgres://x"});
    assert_eq!(
        act(&page, "/p/p/actions/setting", &hidden, |_| {}).status,
        404
    );
}

#[test]
fn a_folder_that_is_a_project_is_the_only_one_and_a_missing_folder_is_refused() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = open_app(project.dir());
    assert!(text(&page.get("/")).contains("href=\"./p/p/\""));
    let missing = dir.path().join("nowhere");
    let refused = crate::cli::call(&mut app(&missing)).expect(2);
    assert!(
        refused.err.contains("there is no folder"),
        "{}",
        refused.err
    );
}
