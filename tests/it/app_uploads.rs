//! Files that a browser sends to `mocban app`, by raw requests: what arrives, what is refused, and what a cut leaves.

use std::io::Write as _;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[cfg(target_os = "linux")]
use mocban::workbook::test_helpers::archive;
use serde_json::{Value, json};

use crate::app::{act, app, open_app, text, token, with_project};
use crate::cli::status;
#[cfg(target_os = "linux")]
use crate::fault::{ENOSPC, Fault};
use crate::page::{Page, Reply, send};
use crate::waiting::{LONGEST, pause, wait_until};

/// An empty folder with the app on it.
pub(crate) fn empty_app() -> (tempfile::TempDir, Page) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let page = open_app(dir.path());
    (dir, page)
}

/// Returns the headers of a file.
pub(crate) fn headers(page: &Page) -> Vec<(&'static str, String)> {
    let mut headers = page.headers();
    headers.retain(|(name, _)| !["x-csrf-token", "content-type"].contains(name));
    headers.push(("x-csrf-token", token(page)));
    headers.push(("content-type", "application/octet-stream".to_owned()));
    headers
}

/// Returns a text for an address, with all of its bytes escaped.
pub(crate) fn encode(text: &str) -> String {
    let bytes = text.bytes().map(|byte| format!("%{byte:02X}"));
    bytes.collect()
}

pub(crate) fn file_path(page: &Page, upload: &Value, path: &str) -> String {
    format!("{}/uploads/{upload}/{}", page.session, encode(path))
}

/// Sends a file.
pub(crate) fn put(page: &Page, upload: &Value, path: &str, bytes: &[u8]) -> Reply {
    let path = file_path(page, upload, path);
    send(page.address(), "POST", &path, &headers(page), bytes).expect("a reply")
}

pub(crate) fn begin(page: &Page, name: &str, files: u64, bytes: u64) -> Reply {
    let body = json!({"name": name, "files": files, "bytes": bytes});
    act(page, "/actions/upload", &body, |_| {})
}

/// Begins an upload that is not refused.
pub(crate) fn begun(page: &Page, name: &str, files: u64) -> Value {
    let reply = begin(page, name, files, 10);
    assert_eq!(reply.status, 200, "{}", text(&reply));
    reply.json()["upload"].clone()
}

pub(crate) fn end(page: &Page, upload: &Value, end: &str) -> Reply {
    let body = json!({"upload": upload, "end": end, "project": "new"});
    act(page, "/actions/upload-end", &body, |_| {})
}

/// Returns the sentence of a refusal.
pub(crate) fn refusal(reply: &Reply) -> String {
    assert_eq!(reply.status, 422, "{}", text(reply));
    let error = reply.json()["error"].clone();
    error.as_str().expect("a sentence").to_owned()
}

/// Returns all files below the folder of uploads, without locks.
pub(crate) fn stored(dir: &Path) -> Vec<String> {
    let root = dir.join("uploads");
    let (mut found, mut open) = (Vec::new(), vec![root.clone()]);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else {
                let below = path.strip_prefix(&root).expect("below");
                found.push(below.to_str().expect("UTF-8").to_owned());
            }
        }
    }
    found.sort();
    found
}

/// Waits until the files are these.
fn wait_for(dir: &Path, expected: &[&str]) {
    let deadline = Instant::now() + LONGEST;
    while stored(dir) != expected {
        assert!(Instant::now() < deadline, "{:?}", stored(dir));
        pause();
    }
}

/// Returns the files of a shared project, by their path in it.
fn pair_files(dir: &Path) -> Vec<(String, PathBuf)> {
    let data = dir.join("p/data");
    let mut found = Vec::new();
    for (folder, ending) in [("meshes", "ply"), ("prints", "jpg")] {
        for pair in ["upright-0000", "upright-0001"] {
            let mut files = std::fs::read_dir(data.join(folder)).expect("a folder");
            let file = files.find_map(|file| {
                let path = file.expect("a file").path();
                let is_it = path.file_stem().is_some_and(|stem| stem == pair);
                is_it.then_some(path)
            });
            let file = file.unwrap_or_else(|| unreachable!("{folder}/{pair}.{ending}"));
            let ending = file.extension().and_then(|end| end.to_str());
            let name = format!("{folder}/chữ {pair}.{}", ending.expect("an extension"));
            found.push((name, file));
        }
    }
    found
}

#[test]
fn files_of_a_browser_get_a_new_folder_and_are_imported() {
    let (dir, page) = with_project();
    let files = pair_files(dir.path());
    let upload = begun(&page, "quét 1", files.len() as u64);
    for (path, file) in &files {
        let bytes = std::fs::read(file).expect("a file");
        // macOS names files in decomposed letters.
        let sent = put(
            &page,
            &upload,
            &path.replace('ữ', "u\u{31b}\u{303}"),
            &bytes,
        );
        assert_eq!(sent.status, 200, "{}", text(&sent));
    }
    let arrived = page.get(&format!("/uploads/{upload}")).json();
    assert_eq!(arrived["files"], 4);
    let reply = end(&page, &upload, "finish");
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let go = reply.json()["go"].as_str().expect("an address").to_owned();
    let html = text(&page.get(&format!("/{go}")));
    assert!(html.contains("<b>2</b> pairs"), "{html}");
    let placed = dir
        .path()
        .canonicalize()
        .expect("a path")
        .join("uploads/quét 1");
    for (path, file) in &files {
        let copy = std::fs::read(placed.join(path)).expect("a composed name");
        assert!(copy == std::fs::read(file).expect("a file"), "{path}");
    }
    let folder = placed.to_str().expect("UTF-8");
    let chosen = json!({"project": "new", "meshes": folder, "prints": folder});
    let reply = act(&page, "/actions/import", &chosen, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert_eq!(status(&dir.path().join("new"))["pairs"], 2);
    assert_eq!(end(&page, &upload, "finish").status, 422, "it has ended");
}

#[test]
fn two_uploads_of_one_name_are_both_kept_and_a_project_is_in_neither() {
    let (dir, page) = empty_app();
    let both = [1, 2].map(|_| begun(&page, "quét", 2));
    for (number, upload) in both.iter().enumerate() {
        for name in ["1.stl", "1.png"] {
            let text = format!("{number} {name}");
            assert_eq!(put(&page, upload, name, text.as_bytes()).status, 200);
        }
    }
    for upload in &both {
        assert_eq!(end(&page, upload, "finish").status, 200);
    }
    let files = ["quét-2/1.png", "quét-2/1.stl", "quét/1.png", "quét/1.stl"];
    assert_eq!(stored(dir.path()), files);
    let first = std::fs::read_to_string(dir.path().join("uploads/quét/1.stl"));
    assert_eq!(first.expect("a file"), "0 1.stl");
    let own = begun(&page, "p", 1);
    let refused = refusal(&put(&page, &own, "catalog.sqlite", b"x"));
    assert!(refused.contains("is no scan, image or list"), "{refused}");
    let opened = (0..4).map(|_| begin(&page, "a", 1, 1).status);
    assert_eq!(opened.collect::<Vec<_>>(), [200; 4]);
    let fifth = refusal(&begin(&page, "a", 1, 1));
    assert!(fifth.contains("other uploads are in progress"), "{fifth}");
    let named = json!({"project": "Uploads", "meshes": dir.path(), "prints": dir.path()});
    assert_eq!(act(&page, "/actions/import", &named, |_| {}).status, 422);
}

#[test]
fn paths_that_are_not_safe_end_the_upload() {
    let (dir, page) = empty_app();
    for (path, reason) in [
        ("../1.stl", "leads to another folder"),
        ("a/../../1.stl", "leads to another folder"),
        ("/tmp/1.stl", "leads to another folder"),
        ("..\\1.stl", "its name has '\\\\'"),
        ("C:1.stl", "its name has ':'"),
        ("1\0.stl", "its name has '\\0'"),
        ("a/NUL.stl", "a device on Windows"),
        ("1.stl ", "a space or a dot"),
        ("Ván/A.stl", "this file is there twice"),
        ("Ván/a.STL", "only in upper and lower case"),
        ("VÁN/2.stl", "only in upper and lower case"),
        ("Ván/A.stl/2.stl", "both a file and a folder"),
        ("run.sh", "is no scan, image or list"),
    ] {
        let upload = begun(&page, "x", 2);
        assert_eq!(put(&page, &upload, "Ván/A.stl", b"solid").status, 200);
        let refused = refusal(&put(&page, &upload, path, b"x"));
        assert!(refused.contains(reason), "{path:?}: {refused}");
        assert_eq!(stored(dir.path()), [""; 0], "{path:?}");
        let next = refusal(&put(&page, &upload, "3.stl", b"x"));
        assert_eq!(next, refused, "an upload that failed stays so");
        assert_eq!(refusal(&end(&page, &upload, "finish")), refused);
        let html = text(&page.get("/import?language=vi"));
        assert!(html.contains("Lần gửi trước không thành công"), "{path:?}");
        page.get("/?language=en");
    }
    let outside = std::fs::read_dir(dir.path()).expect("a folder").count();
    assert_eq!(outside, 1, "only the folder of uploads");
}

#[test]
fn more_than_the_limits_is_refused_before_it_is_sent() {
    let (dir, page) = empty_app();
    for (files, bytes, reason) in [
        (0, 0, "none of the files is a scan"),
        (50_001, 1, "more than 50\u{202f}000 files were chosen"),
        (1, 1 << 60, "1.0 GB must stay free"),
        (1, u64::MAX, "1.0 GB must stay free"),
    ] {
        let refused = refusal(&begin(&page, "x", files, bytes));
        assert!(refused.contains(reason), "{refused}");
    }
    assert!(!dir.path().join("uploads").exists());
    let upload = begun(&page, "x", 2);
    assert_eq!(put(&page, &upload, "1.stl", b"solid").status, 200);
    let refused = refusal(&end(&page, &upload, "finish"));
    assert!(refused.contains("only 1 of 2 files"), "{refused}");
    let upload = begun(&page, "x", 1);
    assert_eq!(put(&page, &upload, "1.stl", b"solid").status, 200);
    assert_eq!(end(&page, &upload, "cancel").status, 200);
    assert_eq!(
        refusal(&put(&page, &upload, "2.stl", b"x")),
        refusal(&end(&page, &upload, "finish"))
    );
    assert_eq!(stored(dir.path()), [""; 0]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_the_upload_and_keeps_nothing() {
    for (call, pattern) in [
        ("write", "uploads/*/new/*"),
        ("write", "uploads/*/archive"),
        ("open", "uploads/*/new/*"),
        ("rename", "uploads/x"),
    ] {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let notes = tempfile::tempdir().expect("a temporary directory");
        let root = dir.path().canonicalize().expect("a path");
        let mut command = app(&root);
        command.args(["--lang", "en"]);
        let fault = Fault::once(call, pattern, ENOSPC).and_later();
        fault.inject(1, &root, notes.path(), &mut command);
        let page = Page::of(&mut command).entered();
        let upload = begun(&page, "x", 1);
        let (name, bytes) = if pattern.ends_with("archive") {
            ("a.zip", archive(&[("1.stl", "solid")], true))
        } else {
            ("1.stl", b"solid".to_vec())
        };
        let sent = put(&page, &upload, name, &bytes);
        let refused = if sent.status == 200 {
            end(&page, &upload, "finish")
        } else {
            sent
        };
        let refused = refusal(&refused);
        assert!(refused.contains("the disk is full"), "{pattern}: {refused}");
        assert_eq!(stored(&root), [""; 0], "{pattern}");
        assert!(Fault::injected(notes.path()) > 0, "{pattern}");
    }
}

#[test]
fn a_connection_that_is_cut_leaves_nothing_and_the_next_upload_starts_again() {
    let (dir, page) = empty_app();
    let upload = begun(&page, "x", 1);
    let mut lines = vec![format!(
        "POST {} HTTP/1.1",
        file_path(&page, &upload, "1.stl")
    )];
    lines.extend(
        headers(&page)
            .iter()
            .map(|(name, value)| format!("{name}: {value}")),
    );
    lines.push("content-length: 1000000".to_owned());
    let mut stream = TcpStream::connect(page.address()).expect("a connection");
    let head = format!("{}\r\n\r\nsolid", lines.join("\r\n"));
    stream.write_all(head.as_bytes()).expect("sent");
    wait_until("the file arrives", || {
        page.get(&format!("/uploads/{upload}")).json()["bytes"] == 5
    });
    let second = refusal(&put(&page, &upload, "2.stl", b"x"));
    assert!(second.contains("is still arriving"), "{second}");
    drop(stream);
    wait_for(dir.path(), &[]);
    // The files are removed before the upload is known to have failed.
    wait_until("the upload ends", || {
        page.get(&format!("/uploads/{upload}")).status == 422
    });
    let refused = refusal(&put(&page, &upload, "1.stl", b"solid"));
    assert!(refused.contains("the connection was cut"), "{refused}");
    assert!(text(&page.get("/import")).contains("the connection was cut"));
    let next = begun(&page, "x", 1);
    assert!(!text(&page.get("/import")).contains("the connection was cut"));
    assert_eq!(put(&page, &next, "1.stl", b"solid").status, 200);
    assert_eq!(end(&page, &next, "finish").status, 200);
    assert_eq!(stored(dir.path()), ["x/1.stl"]);
}

#[test]
fn what_a_killed_app_left_of_an_upload_is_removed_by_the_next() {
    for point in ["upload:written:2", "upload:synced"] {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let mut command = app(dir.path());
        command.args(["--lang", "en"]).env("MOCBAN_BREAK_AT", point);
        let mut page = Page::of(&mut command).entered();
        let upload = begun(&page, "x", 2);
        let csrf = headers(&page);
        for name in ["1.stl", "1.png"] {
            let path = file_path(&page, &upload, name);
            // The last reply does not come.
            let _ = send(page.address(), "POST", &path, &csrf, b"solid");
        }
        if point.ends_with("synced") {
            let body = json!({"upload": upload, "end": "finish", "project": ""}).to_string();
            let mut headers = csrf;
            headers.retain(|(name, _)| *name != "content-type");
            headers.push(("content-type", "application/json".to_owned()));
            let path = format!("{}/actions/upload-end", page.session);
            let _ = send(page.address(), "POST", &path, &headers, body.as_bytes());
        }
        page.exit_code();
        let left = stored(dir.path());
        assert!(left.iter().any(|path| path.ends_with("1.stl")), "{left:?}");
        let is_hidden = |path: &String| path.starts_with(".new.");
        assert!(left.iter().all(is_hidden), "nothing counts: {left:?}");
        let next = open_app(dir.path());
        assert_eq!(stored(dir.path()), [""; 0], "{point}");
        let html = text(&next.get("/import"));
        assert!(html.contains("The last upload did not end well"), "{html}");
        let upload = begun(&next, "x", 1);
        assert!(!text(&next.get("/import")).contains("did not end well"));
        assert_eq!(put(&next, &upload, "1.stl", b"solid").status, 200);
        assert_eq!(end(&next, &upload, "finish").status, 200);
        assert_eq!(stored(dir.path()), ["x/1.stl"]);
    }
}

#[test]
fn files_of_systems_are_left_out() {
    let (dir, page) = empty_app();
    let files = ["1.stl", ".git/2.stl", "@eaDir/3.stl", "__MACOSX/._Icon\r"];
    let upload = begun(&page, "x", files.len() as u64);
    for file in files {
        let sent = put(&page, &upload, file, b"solid");
        assert_eq!(sent.status, 200, "{file:?}: {}", text(&sent));
    }
    assert_eq!(end(&page, &upload, "finish").status, 200);
    assert_eq!(stored(dir.path()), ["x/1.stl"]);
}

#[test]
fn only_the_page_itself_may_send_files() {
    let (dir, page) = empty_app();
    let upload = begun(&page, "x", 1);
    let path = file_path(&page, &upload, "1.stl");
    for (name, value, status) in [
        ("host", "evil.example", 421),
        ("origin", "http://evil.example", 403),
        ("origin", "", 403),
        ("x-csrf-token", "0", 403),
        ("cookie", "guest=1", 401),
        ("content-type", "text/plain", 415),
        ("content-type", "application/json", 415),
        ("content-type", "multipart/form-data", 415),
    ] {
        let mut headers = headers(&page);
        headers.retain(|(known, _)| *known != name);
        if !value.is_empty() {
            headers.push((name, value.to_owned()));
        }
        let reply = send(page.address(), "POST", &path, &headers, b"solid").expect("a reply");
        assert_eq!(reply.status, status, "{name}: {value}");
    }
    // Only the route of files takes more than an action has.
    let large = json!({"name": "x".repeat(300_000), "files": 1, "bytes": 1});
    assert_eq!(act(&page, "/actions/upload", &large, |_| {}).status, 413);
    assert_eq!(
        put(&page, &upload, "1.stl", &vec![b'x'; 100_000]).status,
        200
    );
    assert_eq!(end(&page, &upload, "finish").status, 200);
    assert_eq!(stored(dir.path()), ["x/1.stl"]);
    assert_eq!(put(&page, &json!(99), "1.stl", b"x").status, 422);
}

#[test]
fn a_failed_upload_is_named_only_on_the_page_of_its_project() {
    let (_dir, page) = empty_app();
    let body = json!({"name": "x", "files": 1, "bytes": 10, "project": "a"});
    let upload = act(&page, "/actions/upload", &body, |_| {}).json()["upload"].clone();
    refusal(&put(&page, &upload, "../1.stl", b"solid"));
    for (project, is_said) in [("a", true), ("b", false), ("", false)] {
        for (language, part) in [
            ("en", "The last upload did not end well"),
            ("vi", "Lần gửi trước không thành công"),
        ] {
            let path = format!("/import?project={project}&language={language}");
            let html = text(&page.get(&path));
            assert_eq!(html.contains(part), is_said, "{project}: {html}");
        }
    }
}
