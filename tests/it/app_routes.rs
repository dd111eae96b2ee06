//! Every route of `mocban app` refuses other hosts, other pages and people who were invited. The routes are read from the source,
//! so a new one is tested, too.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::app::{act, app, text, token, with_project};
use crate::app_invitations::{invite, open, start_entered};
use crate::app_uploads::encode;
use crate::cli::mocban;
use crate::page::{Page, Site, read_project, send};
use crate::source_text::source_files;

/// The routes of the app.
pub(crate) const ROUTES: &str = include_str!("../../crates/pages/src/app/routes.rs");
/// The routes of a review, which a guest has.
pub(crate) const REVIEW_ROUTES: &str = include_str!("../../crates/pages/src/review/routes.rs");
/// Values for the parts of an address that have a name; others are `x`.
const VALUES: [(&str, &str); 6] = [
    ("project", "p"),
    ("pair", "upright-0000"),
    ("block", "b1"),
    ("reviewer", "lan"),
    ("choice", "metric=relief"),
    ("upload", "1"),
];
/// Other values of headers, each with the status of the reply to any request, or to writes only.
const CHANGES: [(&str, &str, u16, bool); 10] = [
    ("host", "evil.example", 421, false),
    ("host", "127.0.0.1.evil.example", 421, false),
    ("cookie", "", 401, false),
    ("cookie", "guest=1", 401, false),
    ("origin", "http://evil.example", 403, true),
    ("origin", "null", 403, true),
    ("origin", "", 403, true),
    ("x-csrf-token", "0", 403, true),
    ("x-csrf-token", "", 403, true),
    ("content-type", "text/plain", 415, true),
];

/// A request that a route of the app answers.
struct RouteRequest {
    method: &'static str,
    /// The path below that of the session.
    path: String,
}

/// Returns the methods for which a function of axum makes a route.
fn methods(function: &str) -> &'static [&'static str] {
    match function {
        "get" => &["GET"],
        "post" => &["POST"],
        "any" => &["GET", "POST"],
        other => unreachable!("no test sends {other}"),
    }
}

/// Returns the names of the functions in a chain of calls, like `get(a).post(b)`.
fn functions(chain: &str) -> Vec<&str> {
    let (mut names, mut begin, mut depth) = (Vec::new(), 0, 0);
    for (at, c) in chain.char_indices() {
        match c {
            '(' => {
                if depth == 0 {
                    let name = &chain[begin..at];
                    names.push(name.trim_matches(|c: char| !c.is_ascii_alphabetic()));
                }
                depth += 1;
            }
            ')' if depth == 0 => break,
            ')' => {
                depth -= 1;
                begin = at + 1;
            }
            _ => {}
        }
    }
    names
}

/// Returns the requests that the routes of a source file answer.
fn requests(source: &str) -> Vec<RouteRequest> {
    let mut found = Vec::new();
    for route in source.split(".route(").skip(1) {
        let mut parts = route.split('"').skip(1);
        let path = filled(parts.next().expect("an address"));
        let rest = parts.next().expect("a method");
        let rest = rest.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
        let methods = functions(rest).into_iter().flat_map(methods);
        found.extend(methods.map(|&method| RouteRequest {
            method,
            path: path.clone(),
        }));
    }
    found
}

/// Returns the paths to which the routes of a source file let a page write.
#[cfg(target_os = "linux")]
pub(crate) fn writes(source: &str) -> Vec<String> {
    let writes = requests(source).into_iter();
    let writes = writes.filter(|request| request.method == "POST");
    writes.map(|request| request.path).collect()
}

/// Returns an address of the source with a value for each of its parts.
fn filled(address: &str) -> String {
    let mut path = address.replace("{{", "{").replace("}}", "}");
    if let Some(rest) = path.strip_prefix('{') {
        let (name, rest) = rest.split_once('}').expect("a name");
        let declared = format!("let {name} = \"");
        let (_, begin) = ROUTES.split_once(&declared).expect("its beginning");
        let begin = begin.split('"').next().expect("a text");
        path = format!("{begin}{rest}");
    }
    while let Some((before, rest)) = path.split_once('{') {
        let (name, after) = rest.split_once('}').expect("a name");
        let value = VALUES.iter().find(|(known, _)| *known == name);
        let value = value.map_or("x", |(_, value)| *value);
        path = format!("{before}{value}{after}");
    }
    path
}

/// Returns the headers of a request of the page itself.
fn own_headers(site: &Site, path: &str, token: &str) -> Vec<(&'static str, String)> {
    let mut headers = site.headers();
    headers.retain(|(name, _)| !["x-csrf-token", "content-type"].contains(name));
    headers.push(("x-csrf-token", token.to_owned()));
    let kind = if path.starts_with("/uploads/") {
        "application/octet-stream"
    } else {
        "application/json"
    };
    headers.push(("content-type", kind.to_owned()));
    headers
}

/// Sends a request with these headers to a path of a site, and returns the status of the reply.
fn status(
    site: &Site,
    method: &str,
    path: &str,
    headers: &[(&'static str, String)],
) -> Option<u16> {
    let body: &[u8] = if method == "POST" { b"{}" } else { b"" };
    let reply = send(site.address(), method, path, headers, body);
    reply.ok().map(|reply| reply.status)
}

/// Returns what a request could change in the folder of the app.
fn changeable(dir: &Path) -> (Vec<Value>, Vec<String>) {
    let status = mocban(&dir.join("p"), &["status", "--json"]).expect(0);
    let status = status.json();
    let counts = ["pairs", "retired", "jobs", "verdicts", "running"];
    let counts = counts.map(|name| status[name].clone()).to_vec();
    let mut names = Vec::new();
    for folder in [dir.to_owned(), dir.join("p")] {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    // The log of the catalog comes and goes with its readers.
    names.retain(|name| !name.starts_with("catalog.sqlite-"));
    names.sort();
    (counts, names)
}

#[test]
fn all_routes_of_the_app_are_in_one_file() {
    let files = source_files().into_iter();
    let of_app = files.filter(|file| file.name.starts_with("crates/pages/src/app/"));
    let with_routes = of_app.filter(|file| file.production_code().contains(".route("));
    let names: Vec<String> = with_routes.map(|file| file.name).collect();
    assert_eq!(names, ["crates/pages/src/app/routes.rs"]);
    // What other pages and services are passed on to cannot be seen in the file.
    for other in [".nest", ".merge(", "_service("] {
        assert!(!ROUTES.contains(other), "{other}: test its routes, too");
    }
    assert_eq!(functions("get(a(b)).post(c))"), ["get", "post"]);
    let count = requests(ROUTES).len();
    assert!(count > 50, "only {count} requests");
}

#[test]
fn every_route_refuses_other_hosts_other_pages_and_a_missing_token() {
    let (dir, page) = with_project();
    let (site, token) = (&*page, token(&page));
    let before = changeable(dir.path());
    let unknown = RouteRequest {
        method: "GET",
        path: "/no-such-page".to_owned(),
    };
    for RouteRequest { method, path } in requests(ROUTES).into_iter().chain([unknown]) {
        let address = format!("{}{path}", site.session);
        let own = own_headers(site, &path, &token);
        // The path is that of a route: only the method is refused.
        if !path.contains("/view/") && !path.contains("/lan/") {
            let found = status(site, "PUT", &address, &own);
            let refused = if path == "/no-such-page" { 404 } else { 405 };
            assert_eq!(found, Some(refused), "{path}");
        }
        for (name, value, expected, is_of_writes) in CHANGES {
            if is_of_writes && method == "GET" {
                continue;
            }
            let mut headers = own.clone();
            headers.retain(|(known, _)| *known != name);
            if !value.is_empty() {
                headers.push((name, value.to_owned()));
            }
            let found = status(site, method, &address, &headers);
            assert_eq!(found, Some(expected), "{method} {path}, {name}: {value}");
        }
        // Without the path of the session, or with that of another one.
        let other = format!("/s/{}{path}", "0".repeat(64));
        for address in [&path, &other] {
            let found = status(site, method, address, &own);
            assert_eq!(found, Some(401), "{method} {address}");
        }
    }
    assert_eq!(changeable(dir.path()), before, "nothing was changed");
}

#[test]
fn a_guest_reaches_no_route_of_the_app() {
    let (dir, page) = start_entered();
    let guest = open(&invite(&page, "lan")[0]);
    let own_routes: Vec<String> = requests(REVIEW_ROUTES)
        .into_iter()
        .map(|request| request.path)
        .collect();
    let (site, token) = (&*page, token(&page));
    let before = changeable(dir.path());
    for RouteRequest { method, path } in requests(ROUTES) {
        // The session of the guest, with its cookie and its token.
        if !own_routes.contains(&path) {
            let mut own = own_headers(&guest, &path, &guest.csrf_token);
            own.retain(|(name, _)| *name != "content-type");
            own.push(("content-type", "application/json".to_owned()));
            let address = format!("{}{path}", guest.session);
            let found = status(&guest, method, &address, &own);
            assert_eq!(found, Some(404), "{method} {path} of the guest");
        }
        // The session of the app: with the cookie of the guest, and on the server for guests.
        let address = format!("{}{path}", site.session);
        let mut with_cookie = own_headers(site, &path, &token);
        with_cookie.retain(|(name, _)| *name != "cookie");
        with_cookie.push(("cookie", guest.cookie.clone()));
        let found = status(site, method, &address, &with_cookie);
        assert_eq!(found, Some(401), "{method} {path} with a guest's cookie");
        let elsewhere = Site {
            host: guest.host.clone(),
            ..site.clone()
        };
        let headers = own_headers(&elsewhere, &path, &token);
        let found = status(&elsewhere, method, &address, &headers);
        assert_eq!(found, Some(401), "{method} {path} on the guests' server");
        if method == "POST" {
            let with_token = own_headers(site, &path, &guest.csrf_token);
            let found = status(site, method, &address, &with_token);
            assert_eq!(found, Some(403), "{method} {path} with a guest's token");
        }
    }
    assert_eq!(changeable(dir.path()), before, "nothing was changed");
}

/// What no reply may have.
const SECRET: &str = "bí-mật-0117";

/// A folder with a project, and another one outside of the folders of the user.
struct OutsidePlaces {
    dir: tempfile::TempDir,
    outside: tempfile::TempDir,
}

impl OutsidePlaces {
    fn new() -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        read_project(&dir);
        let backup = ["backup", "backups/backup.sqlite"];
        mocban(&dir.path().join("p"), &backup).expect(0);
        let outside = tempfile::tempdir().expect("a temporary directory");
        let list = format!("id,mesh,print\n{SECRET},{SECRET}.stl,{SECRET}.png\n");
        let named = |ending: &str| format!("{SECRET}.{ending}");
        for (name, content) in [
            ("list.csv".to_owned(), list.as_str()),
            (named("stl"), "solid x"),
            (named("png"), "x"),
        ] {
            std::fs::write(outside.path().join(name), content).expect("written");
        }
        std::fs::create_dir(outside.path().join(SECRET)).expect("a folder");
        let inside = dir.path().join("p/backups/backup.sqlite");
        std::fs::copy(inside, outside.path().join("backup.sqlite")).expect("copied");
        Self { dir, outside }
    }

    fn root(&self) -> PathBuf {
        self.dir.path().canonicalize().expect("a path")
    }

    /// Opens the app. The folder of its user is not one around the temporary folders.
    fn open(&self) -> Page {
        let root = self.root();
        Page::of(app(&root).args(["--lang", "en"]).env("HOME", &root)).entered()
    }

    /// Returns two paths of the folder outside, each with those of its list and its backup.
    fn outside(&self) -> [[String; 3]; 2] {
        let outside = self.outside.path().canonicalize().expect("a path");
        let name = outside.file_name().expect("a name");
        let up = self.root().join("..").join(name);
        [outside, up].map(|folder| {
            let folder = folder.to_str().expect("UTF-8");
            ["", "/list.csv", "/backup.sqlite"].map(|file| format!("{folder}{file}"))
        })
    }
}

#[test]
fn no_page_shows_files_outside_the_folders_of_the_user() {
    let places = OutsidePlaces::new();
    let page = places.open();
    let inside = places.root().join("p/backups/backup.sqlite");
    let inside = encode(inside.to_str().expect("UTF-8"));
    // The number of pairs in the backup.
    let number = "<b>15</b>";
    let allowed = text(&page.get(&format!("/restore/content?backup={inside}")));
    assert!(allowed.contains(number), "{allowed}");
    let allowed = places.root().join("allowed");
    std::fs::create_dir_all(allowed.join(SECRET)).expect("a folder");
    let allowed = encode(allowed.to_str().expect("UTF-8"));
    for address in ["/import?path=", "/restore?path="].map(|page| format!("{page}{allowed}")) {
        let said = text(&page.get(&address));
        assert!(said.contains(SECRET), "{address}: {said}");
    }
    for paths in places.outside() {
        let [folder, list, backup] = paths.map(|path| encode(&path));
        let both = format!("project=new&meshes={folder}&prints={folder}");
        for address in [
            format!("/import?path={folder}"),
            format!("/import?project=new&list={list}"),
            format!("/import?{both}"),
            format!("/import?{both}&whole_block=yes"),
            format!("/import/files?project=new&list={list}"),
            format!("/import/files?{both}"),
            format!("/import/problems?project=new&list={list}"),
            format!("/import/problems?{both}"),
            format!("/import/picture/page?{both}&whole_block=yes"),
            format!("/import/picture/scan?{both}&whole_block=yes"),
            format!("/restore?path={folder}"),
            format!("/restore?backup={backup}"),
            format!("/restore/content?backup={backup}"),
            format!("/restore/content?backup={inside}&inputs={folder}"),
        ] {
            let said = text(&page.get(&address));
            assert!(!said.contains(SECRET), "{address}: {said}");
            assert!(!said.contains(number), "{address}: {said}");
        }
    }
}

#[test]
fn no_action_reads_files_outside_the_folders_of_the_user() {
    let places = OutsidePlaces::new();
    let (page, root) = (places.open(), places.root());
    for [folder, list, backup] in places.outside() {
        let both = json!({"project": "new", "meshes": folder, "prints": folder});
        let with = |name: &str| {
            let mut body = both.clone();
            body[name] = json!("yes");
            body
        };
        let inside = root.join("p/backups/backup.sqlite");
        for (path, body) in [
            ("/actions/import", json!({"project": "new", "list": list})),
            ("/actions/import", with("missing")),
            ("/actions/import", with("whole_block")),
            ("/actions/restore", json!({"backup": backup, "name": "new"})),
            (
                "/actions/restore",
                json!({"backup": inside, "inputs": folder, "name": "new"}),
            ),
        ] {
            let reply = act(&page, path, &body, |_| {});
            let said = text(&reply);
            assert_eq!(reply.status, 422, "{path} {body}: {said}");
            let why = "outside your folders and disks";
            assert!(said.contains(why), "{path} {body}: {said}");
        }
        assert!(!root.join("new").exists(), "nothing was made");
    }
}

#[test]
fn a_saved_view_leads_to_no_other_page() {
    let (_dir, page) = with_project();
    let mut saved = 0;
    for (number, list) in [
        "//evil.example/?state=failed",
        "../../../other/pairs?state=failed",
        "http://evil.example/?&state=failed#x",
        "state=failed&next=//evil.example",
    ]
    .into_iter()
    .enumerate()
    {
        let name = format!("v{number}");
        let body = json!({"action": "save", "name": name, "list": list});
        let reply = act(&page, "/p/p/actions/view", &body, |_| {});
        // An address without a value of a list is refused.
        if reply.status != 200 {
            assert_eq!(reply.status, 422, "{list}: {}", text(&reply));
            continue;
        }
        saved += 1;
        let shown = page.get(&format!("/p/p/pairs/view/{name}"));
        let to = shown.header("location").expect("an address");
        assert_eq!(to, "../../pairs?state=failed", "{list}");
    }
    assert_ne!(saved, 0, "a list with a value is saved");
    for name in ["..%2F..%2Fcatalog.sqlite", "%2Fetc%2Fpasswd", "..", "."] {
        let reply = page.get(&format!("/p/p/pairs/view/{name}"));
        assert_eq!(reply.status, 404, "{name}: {}", text(&reply));
    }
}
