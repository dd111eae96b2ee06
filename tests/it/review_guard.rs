//! Attacks on the review server. It rejects requests that do not come from its own page.

use mocban::store::Project;
use serde_json::{Value, json};

use crate::cli::mocban;
use crate::page::{NO_CHECKS, Page, Reply, answer, open_review, read_project, send};

/// A review page under attack, and its first item.
struct Target {
    page: Page,
    item: Value,
    project: Project,
    _dir: tempfile::TempDir,
}

impl Target {
    fn open() -> Self {
        let (dir, project, page) = open_review(&NO_CHECKS);
        let item = page.queue().remove(0);
        Self {
            page,
            item,
            project,
            _dir: dir,
        }
    }

    /// Sends a verdict with one header changed or removed.
    fn with(&self, header: &str, value: Option<&str>) -> Reply {
        let mut headers = self.page.headers();
        headers.retain(|(name, _)| *name != header);
        if let Some(value) = value {
            let known = ["host", "cookie", "origin", "content-type", "x-csrf-token"];
            let name = known
                .into_iter()
                .find(|name| *name == header)
                .expect("a header");
            headers.push((name, value.to_owned()));
        }
        let body = answer("e1", &self.item, "pass").to_string();
        let to = self.page.address();
        let path = self.path("/api/answer");
        send(to, "POST", &path, &headers, body.as_bytes()).expect("a reply")
    }

    /// Returns the path of a page of the session.
    fn path(&self, page: &str) -> String {
        format!("{}{page}", self.page.session)
    }

    /// Checks that nothing was stored so far, and that a correct request is.
    fn nothing_is_stored(&self) {
        let log = || mocban(self.project.dir(), &["verdict", "log"]).expect(0);
        assert_eq!(log().out, "");
        let body = answer("e1", &self.item, "pass");
        let stored = self.page.post("/api/answer", &body).expect("a reply");
        assert_eq!(stored.status, 200);
    }
}

#[test]
fn a_foreign_host_is_rejected_first() {
    let target = Target::open();
    let port = target.page.address().port();
    for host in [
        Some("evil.example"),
        Some("127.0.0.1"),
        Some("127.0.0.1:1"),
        Some("localhost.evil.example"),
        Some(""),
        None,
    ] {
        let status = target.with("host", host).status;
        assert!([400, 421].contains(&status), "{host:?}: {status}");
    }
    let rebound = format!("evil.example:{port}");
    let same = [
        ("host", rebound.clone()),
        ("origin", format!("http://{rebound}")),
    ];
    for path in [
        "/",
        "/start?token=x",
        "/api/queue",
        "/assets/main.js",
        "/image/a/print",
        "/scan/a",
    ] {
        for path in [path, &target.path(path)] {
            let reply = send(target.page.address(), "GET", path, &same, b"").expect("a reply");
            assert_eq!(reply.status, 421, "{path}");
        }
    }
    target.nothing_is_stored();
}

#[test]
fn localhost_is_an_accepted_host() {
    let target = Target::open();
    let named = format!("localhost:{}", target.page.address().port());
    let headers = [("host", named), ("cookie", target.page.cookie.clone())];
    let path = target.path("/");
    let reply = send(target.page.address(), "GET", &path, &headers, b"").expect("a reply");
    assert_eq!(reply.status, 200);
}

#[test]
fn a_foreign_or_missing_origin_is_refused() {
    let target = Target::open();
    let port = target.page.address().port();
    let near = format!("http://127.0.0.1:{}", port.wrapping_add(1));
    let secure = format!("https://127.0.0.1:{port}");
    for origin in [
        None,
        Some("http://evil.example"),
        Some("null"),
        Some(&*near),
        Some(&*secure),
    ] {
        assert_eq!(target.with("origin", origin).status, 403, "{origin:?}");
    }
    target.nothing_is_stored();
}

#[test]
fn nothing_is_served_without_the_cookie_or_without_the_path_of_the_session() {
    let target = Target::open();
    for cookie in [None, Some("mocban_review=x"), Some("")] {
        assert_eq!(target.with("cookie", cookie).status, 401, "{cookie:?}");
    }
    let host = ("host", target.page.host.clone());
    let cookie = ("cookie", target.page.cookie.clone());
    let guessed = format!("/s/{}", "0".repeat(64));
    let image = format!(
        "/image/{}/print",
        target.item["id"].as_str().expect("an id")
    );
    for page in [
        "/",
        "/api/queue",
        "/api/config",
        "/api/summary",
        "/assets/main.js",
        &image,
        "/scan/a",
        "/nowhere",
    ] {
        let get = |path: &str, headers: &[_]| {
            send(target.page.address(), "GET", path, headers, b"").expect("a reply")
        };
        let without_cookie = get(&target.path(page), std::slice::from_ref(&host));
        assert_eq!(without_cookie.status, 401, "{page}");
        for session in ["", "/s", "/s/", &guessed, &target.page.session[..40]] {
            let path = format!("{session}{page}");
            let reply = get(&path, &[host.clone(), cookie.clone()]);
            assert_eq!(reply.status, 401, "{path}");
        }
    }
    // A page of another port knows the cookie and, from a log, even the CSRF token, but not the path.
    let body = answer("e1", &target.item, "pass").to_string();
    let (to, headers) = (target.page.address(), target.page.headers());
    let reply = send(to, "POST", "/api/answer", &headers, body.as_bytes()).expect("a reply");
    assert_eq!(reply.status, 401);
    target.nothing_is_stored();
}

#[test]
fn a_browser_without_a_session_is_told_what_to_do_and_nothing_else() {
    let target = Target::open();
    let headers = [
        ("host", target.page.host.clone()),
        ("cookie", target.page.cookie.clone()),
        ("accept", "text/html,*/*;q=0.8".to_owned()),
    ];
    for path in ["/", "/start", "/start?token=guess", "/api/queue"] {
        let reply = send(target.page.address(), "GET", path, &headers, b"").expect("a reply");
        let text = String::from_utf8(reply.body.clone()).expect("UTF-8");
        assert!([401, 403].contains(&reply.status), "{path}");
        assert!(text.contains("Open the address that the command printed."));
        assert!(text.contains("Hãy mở địa chỉ mà lệnh đã in ra."), "{text}");
        assert!(!text.contains(&target.page.session) && !text.contains("upright"));
        assert_eq!(reply.header("set-cookie"), None);
    }
    let script = target.page.get_path("/session.js");
    assert_eq!(script.status, 200);
    let text = String::from_utf8(script.body).expect("UTF-8");
    assert!(!text.contains(&target.page.session));
}

#[test]
fn the_token_opens_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let page = Page::start(&read_project(&dir), "lan", &[]);
    let start = page.start_path();
    assert_eq!(page.get_path("/start?token=guess").status, 403);
    let headers = [("host", page.host.clone())];
    let preview = send(page.address(), "HEAD", start, &headers, b"").expect("a reply");
    assert_eq!(preview.status, 405, "a preview does not use up the token");
    let first = page.get_path(start);
    assert_eq!(first.status, 200);
    let cookie = first.header("set-cookie").expect("a cookie");
    let path = cookie.split("Path=").nth(1).expect("a path");
    assert_eq!(
        path.len(),
        "/s/".len() + 64,
        "a browser sends it to no other port"
    );
    for wanted in ["HttpOnly", "SameSite=Strict"] {
        assert!(cookie.contains(wanted), "{cookie}");
    }
    let second = page.get_path(start);
    assert_eq!(second.status, 403);
    assert_eq!(second.header("set-cookie"), None);
}

#[test]
fn a_write_without_the_csrf_token_is_refused() {
    let target = Target::open();
    for token in [None, Some(""), Some("guess")] {
        assert_eq!(target.with("x-csrf-token", token).status, 403, "{token:?}");
    }
    target.nothing_is_stored();
}

#[test]
fn a_content_type_that_a_form_can_send_is_refused() {
    let target = Target::open();
    for kind in [
        None,
        Some("text/plain"),
        Some("application/x-www-form-urlencoded"),
        Some("text/plain; application/json"),
        Some("application/ld+json"),
    ] {
        assert_eq!(target.with("content-type", kind).status, 415, "{kind:?}");
    }
    target.nothing_is_stored();
}

#[test]
fn a_large_body_is_refused() {
    let target = Target::open();
    let mut body = answer("e1", &target.item, "pass");
    body["note"] = Value::String("x".repeat(1 << 20));
    let reply = target.page.post("/api/answer", &body).expect("a reply");
    assert_eq!(reply.status, 413);
    target.nothing_is_stored();
}

#[test]
fn paths_reach_only_named_resources() {
    let target = Target::open();
    let id = target.item["id"].as_str().expect("an id");
    let pair = target.item["pair"].as_str().expect("a name");
    assert_eq!(target.page.get(&format!("/image/{id}/print")).status, 200);
    for path in [
        "/assets/../Cargo.toml",
        "/assets/..%2f..%2fcatalog.sqlite",
        "/assets/%2e%2e/main.js",
        "/assets//etc/passwd",
        "/../catalog.sqlite",
        "/catalog.sqlite",
        &format!("/image/{pair}/print"),
        &format!("/image/{id}/..%2f..%2fcatalog.sqlite"),
        &format!("/image/{id}/print.png"),
        "/image/..%2f..%2fetc/passwd",
        "/image/%00/print",
    ] {
        let status = target.page.get(path).status;
        assert!([400, 404].contains(&status), "{path}: {status}");
    }
}

#[test]
fn other_methods_and_invalid_answers_are_refused() {
    let target = Target::open();
    let headers = target.page.headers();
    for method in ["PUT", "DELETE", "PATCH"] {
        let path = target.path("/api/answer");
        let reply = send(target.page.address(), method, &path, &headers, b"");
        assert_eq!(reply.expect("a reply").status, 405, "{method}");
    }
    let good = answer("e1", &target.item, "pass");
    for (field, value, status) in [
        ("item", json!("nothing"), 404),
        ("verdict", json!("maybe"), 422),
        ("reason", json!("angle"), 422),
        ("event", json!("a b"), 422),
        ("event", json!(""), 422),
        ("angle_read_deg", json!(900), 422),
        ("note", json!("x".repeat(2001)), 422),
        ("reviewer", json!("somebody else"), 422),
    ] {
        let mut body = good.clone();
        body[field] = value;
        let reply = target.page.post("/api/answer", &body).expect("a reply");
        assert_eq!(reply.status, status, "{field}");
    }
    let others = target.page.post("/api/undo", &json!({ "event": "never" }));
    assert_eq!(others.expect("a reply").status, 404);
    target.nothing_is_stored();
}

#[test]
fn every_response_has_the_security_headers() {
    let target = Target::open();
    let refused = target.with("host", Some("evil.example"));
    for reply in [target.page.get("/"), target.page.get("/api/queue"), refused] {
        let policy = reply.header("content-security-policy").expect("a policy");
        assert!(policy.starts_with("default-src 'none';"), "{policy}");
        assert!(!policy.contains("unsafe"), "{policy}");
        assert_eq!(reply.header("x-content-type-options"), Some("nosniff"));
        assert_eq!(reply.header("referrer-policy"), Some("no-referrer"));
        assert_eq!(reply.header("cache-control"), Some("no-store"));
        assert_eq!(reply.header("access-control-allow-origin"), None);
    }
}

#[test]
fn a_reviewers_name_is_escaped() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let name = "<script>alert('lan')</script>&\"";
    let page = Page::open(&read_project(&dir), name, &[]);
    let html = String::from_utf8(page.get("/").body).expect("UTF-8");
    assert!(!html.contains("<script>alert"), "{html}");
    assert!(html.contains("&lt;script&gt;alert('lan')&lt;/script&gt;&amp;&quot;"));
}
