//! An interrupted upload to `mocban app`: the same files are chosen again, and what has arrived is not sent again.

use std::io::Write as _;
use std::net::TcpStream;
use std::path::Path;

use mocban::workbook::test_helpers::archive;
use serde_json::{Value, json};

use crate::app::{act, app, open_app, text};
use crate::app_uploads::{begin, empty_app, end, file_path, headers, put, refusal, stored};
use crate::page::{Page, Reply, send};
use crate::waiting::wait_until;

/// Sends a file that was last changed at a time.
fn put_modified(page: &Page, upload: &Value, path: &str, bytes: &[u8], modified: i64) {
    let path = format!("{}?modified={modified}", file_path(page, upload, path));
    let reply = send(page.address(), "POST", &path, &headers(page), bytes).expect("a reply");
    assert_eq!(reply.status, 200, "{}", text(&reply));
}

/// Sends the beginning of a file, and waits until it has arrived.
fn begin_file(page: &Page, upload: &Value, path: &str) -> TcpStream {
    let arrived = || page.get(&format!("/uploads/{upload}"));
    let before = arrived().json()["bytes"].as_u64().expect("a number");
    let path = file_path(page, upload, path);
    let mut lines = vec![format!("POST {path}?modified=7 HTTP/1.1")];
    let fields = headers(page);
    lines.extend(
        fields
            .iter()
            .map(|(name, value)| format!("{name}: {value}")),
    );
    lines.push("content-length: 1000000".to_owned());
    let mut stream = TcpStream::connect(page.address()).expect("a connection");
    let head = format!("{}\r\n\r\nsolid", lines.join("\r\n"));
    stream.write_all(head.as_bytes()).expect("sent");
    wait_until("the file arrives", || {
        arrived().json()["bytes"] == before + 5
    });
    stream
}

/// Sends the beginning of a file and cuts the connection. Waits until the program has noticed.
fn cut_off(page: &Page, upload: &Value, path: &str) {
    drop(begin_file(page, upload, path));
    wait_until("the upload is interrupted", || {
        page.get(&format!("/uploads/{upload}")).status == 422
    });
}

/// Begins an upload of files with this content, or takes it over from another page.
fn begin_same(page: &Page, content: &str, files: u64, takes_over: bool) -> Reply {
    let body = json!({
        "name": content, "content": content, "files": files, "bytes": 10, "take_over": takes_over,
    });
    act(page, "/actions/upload", &body, |_| {})
}

/// Begins an upload of files with this content. Returns its id and what has arrived.
fn begun_with(page: &Page, content: &str, files: u64) -> (Value, Value) {
    begun(&begin_same(page, content, files, false))
}

#[track_caller]
fn begun(reply: &Reply) -> (Value, Value) {
    assert_eq!(reply.status, 200, "{}", text(reply));
    let reply = reply.json();
    (reply["upload"].clone(), reply["arrived"].clone())
}

/// Returns the names of all files of uploads, without their folders and the locks of unfinished ones.
fn names(dir: &Path) -> Vec<String> {
    let files = stored(dir).into_iter();
    let names = files.map(|path| path.rsplit('/').next().unwrap_or_default().to_owned());
    names.filter(|name| name != "lock").collect()
}

#[test]
fn files_that_have_arrived_are_not_sent_again() {
    let (dir, page) = empty_app();
    let (mut upload, arrived) = begun_with(&page, "quét", 3);
    assert_eq!(arrived, json!([]));
    put_modified(&page, &upload, "a/1.stl", b"solid 1", 5);
    for _ in 0..2 {
        cut_off(&page, &upload, "a/2.stl");
        assert_eq!(names(dir.path()), ["1.stl"], "the part is removed");
        let why = refusal(&put(&page, &upload, "a/2.stl", b"x"));
        assert!(why.contains("1 of them has arrived"), "{why}");
        assert!(text(&page.get("/import")).contains(&why), "{why}");
        assert_eq!(refusal(&end(&page, &upload, "finish")), why);
        let (next, arrived) = begun_with(&page, "quét", 3);
        let expected = json!([{"path": "a/1.stl", "size": 7, "modified": 5}]);
        assert_eq!(arrived, expected);
        // The page of the first part can send nothing more.
        let late = refusal(&put(&page, &upload, "b/1.png", b"x"));
        assert!(late.contains("another page has taken over"), "{late}");
        upload = next;
    }
    assert!(!text(&page.get("/import")).contains("the connection was cut"));
    put_modified(&page, &upload, "a/2.stl", b"solid 2", 6);
    put_modified(&page, &upload, "b/1.png", b"png", 6);
    assert_eq!(end(&page, &upload, "finish").status, 200);
    let files = ["quét/a/1.stl", "quét/a/2.stl", "quét/b/1.png"];
    assert_eq!(stored(dir.path()), files);
    let second = dir.path().join("uploads/quét/a/2.stl");
    assert_eq!(std::fs::read(second).expect("a file"), b"solid 2");
}

#[test]
fn an_archive_that_was_unpacked_is_not_sent_again() {
    let (dir, page) = empty_app();
    let zip = archive(&[("1.stl", "solid 1"), ("notes.doc", "x")], true);
    let size = zip.len();
    let (upload, _) = begun_with(&page, "quét", 3);
    put_modified(&page, &upload, "ván.zip", &zip, 5);
    // One that is cut off comes again, also as the first file.
    cut_off(&page, &upload, "other.zip");
    assert_eq!(names(dir.path()), ["archive", "1.stl"]);
    let (upload, arrived) = begun_with(&page, "quét", 3);
    let expected = json!([{"path": "ván.zip", "size": size, "modified": 5}]);
    assert_eq!(arrived, expected);
    let other = archive(&[("2.stl", "solid 2")], true);
    put_modified(&page, &upload, "other.zip", &other, 6);
    put_modified(&page, &upload, "1.png", b"png", 6);
    assert_eq!(end(&page, &upload, "finish").status, 200);
    let files = ["quét/1.png", "quét/1.stl", "quét/2.stl"];
    assert_eq!(stored(dir.path()), files);
}

#[test]
fn another_page_takes_over_an_upload_of_which_nothing_arrives() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    // An upload is silent after 15 s instead of 5 s, in which a busy machine answers the next requests.
    let mut command = app(dir.path());
    command
        .args(["--lang", "en"])
        .env("MOCBAN_LIMIT_FACTOR", "3");
    let page = Page::of(&mut command).entered();
    let (first, _) = begun_with(&page, "quét", 2);
    put_modified(&page, &first, "1.stl", b"solid 1", 5);
    let stream = begin_file(&page, &first, "2.stl");
    let early = refusal(&begin_same(&page, "quét", 2, true));
    assert!(early.contains("another page is sending"), "{early}");
    let (other, arrived) = begun_with(&page, "other files", 2);
    assert_eq!(arrived, json!([]));
    assert_eq!(end(&page, &other, "cancel").status, 200);
    wait_until("nothing arrives", || {
        begin_same(&page, "quét", 2, false).status == 409
    });
    let asked = begin_same(&page, "quét", 2, false);
    assert!(text(&asked).contains("Take over"), "{}", text(&asked));
    let (second, arrived) = begun(&begin_same(&page, "quét", 2, true));
    let expected = json!([{"path": "1.stl", "size": 7, "modified": 5}]);
    assert_eq!(arrived, expected, "nothing is lost");
    assert_eq!(names(dir.path()), ["1.stl"], "the part is removed");
    for refused in [
        put(&page, &first, "2.stl", b"x"),
        end(&page, &first, "finish"),
        page.get(&format!("/uploads/{first}")),
    ] {
        let why = text(&refused);
        assert_eq!(refused.status, 422, "{why}");
        assert!(why.contains("another page has taken over"), "{why}");
    }
    // The first page is closed at last.
    drop(stream);
    assert_eq!(end(&page, &first, "cancel").status, 200);
    put_modified(&page, &second, "2.stl", b"solid 2", 6);
    assert_eq!(end(&page, &second, "finish").status, 200);
    assert_eq!(stored(dir.path()), ["quét/1.stl", "quét/2.stl"]);
}

#[test]
fn an_interrupted_upload_is_not_mixed_with_other_files() {
    let (dir, page) = empty_app();
    let (interrupted, _) = begun_with(&page, "x", 2);
    put_modified(&page, &interrupted, "1.stl", b"solid", 5);
    cut_off(&page, &interrupted, "2.stl");
    let (other, arrived) = begun_with(&page, "y", 1);
    assert!(other != interrupted && arrived == json!([]), "{arrived}");
    assert_eq!(end(&page, &other, "cancel").status, 200);
    let (again, arrived) = begun_with(&page, "x", 2);
    assert_eq!(arrived.as_array().map(Vec::len), Some(1));
    assert_eq!(end(&page, &again, "cancel").status, 200);
    assert_eq!(names(dir.path()), [""; 0]);
    // Files whose times are not known are sent again.
    let (plain, _) = begun_with(&page, "x", 2);
    assert_eq!(put(&page, &plain, "1.stl", b"solid").status, 200);
    cut_off(&page, &plain, "2.stl");
    assert_eq!(names(dir.path()), [""; 0]);
    let (fresh, arrived) = begun_with(&page, "x", 2);
    assert!(fresh != plain && arrived == json!([]), "{arrived}");
    // Interrupted uploads take no place that others need.
    put_modified(&page, &fresh, "1.stl", b"solid", 5);
    cut_off(&page, &fresh, "2.stl");
    for name in ["a", "b", "c", "d"] {
        begun_with(&page, name, 1);
    }
    assert_eq!(names(dir.path()), [""; 0]);
    let refused = refusal(&begin(&page, "e", 1, 1));
    assert!(
        refused.contains("other uploads are in progress"),
        "{refused}"
    );
}

#[test]
fn an_app_that_is_stopped_in_the_middle_of_a_file_leaves_nothing_that_counts() {
    let (dir, mut page) = empty_app();
    let (upload, _) = begun_with(&page, "quét", 2);
    put_modified(&page, &upload, "1.stl", b"solid 1", 5);
    let stream = begin_file(&page, &upload, "2.stl");
    let stop = rustix::process::Signal::TERM;
    rustix::process::kill_process(page.pid(), stop).expect("stopped");
    page.exit_code();
    drop(stream);
    let left = stored(dir.path());
    let is_hidden = |path: &String| path.starts_with(".new.");
    assert!(left.iter().all(is_hidden), "nothing counts: {left:?}");
    let next = open_app(dir.path());
    assert_eq!(stored(dir.path()), [""; 0]);
    let (upload, arrived) = begun_with(&next, "quét", 2);
    assert_eq!(arrived, json!([]));
    for (file, bytes) in [("1.stl", b"solid 1"), ("2.stl", b"solid 2")] {
        put_modified(&next, &upload, file, bytes, 5);
    }
    assert_eq!(end(&next, &upload, "finish").status, 200);
    assert_eq!(stored(dir.path()), ["quét/1.stl", "quét/2.stl"]);
}
