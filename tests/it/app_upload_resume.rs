//! An interrupted upload to `mocban app`: the same files are chosen again, and what has arrived is not sent again.

use std::io::Write as _;
use std::net::TcpStream;
use std::path::Path;

use serde_json::{Value, json};

use crate::app::text;
use crate::app_uploads::{begin, empty_app, end, file_path, headers, put, refusal, stored};
use crate::page::{Page, send};
use crate::waiting::wait_until;

/// Sends a file that was last changed at a time.
fn put_modified(page: &Page, upload: &Value, path: &str, bytes: &[u8], modified: i64) {
    let path = format!("{}?modified={modified}", file_path(page, upload, path));
    let reply = send(page.address(), "POST", &path, &headers(page), bytes).expect("a reply");
    assert_eq!(reply.status, 200, "{}", text(&reply));
}

/// Sends the beginning of a file and cuts the connection. Waits until the program has noticed.
fn cut_off(page: &Page, upload: &Value, path: &str) {
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
    drop(stream);
    wait_until("the upload is interrupted", || arrived().status == 422);
}

/// Begins an upload of files with this name. Returns its id and what has arrived.
fn begun_with(page: &Page, name: &str, files: u64) -> (Value, Value) {
    let reply = begin(page, name, files, 10);
    assert_eq!(reply.status, 200, "{}", text(&reply));
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
    let (upload, arrived) = begun_with(&page, "quét", 3);
    assert_eq!(arrived, json!([]));
    put_modified(&page, &upload, "a/1.stl", b"solid 1", 5);
    for _ in 0..2 {
        cut_off(&page, &upload, "a/2.stl");
        assert_eq!(names(dir.path()), ["1.stl"], "the part is removed");
        let why = refusal(&put(&page, &upload, "a/2.stl", b"x"));
        assert!(why.contains("1 of them have arrived"), "{why}");
        assert!(text(&page.get("/import")).contains(&why), "{why}");
        assert_eq!(refusal(&end(&page, &upload, "finish")), why);
        let expected = json!([{"path": "a/1.stl", "size": 7, "modified": 5}]);
        assert_eq!(begun_with(&page, "quét", 3), (upload.clone(), expected));
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
fn an_interrupted_upload_is_not_mixed_with_other_files() {
    let (dir, page) = empty_app();
    let (interrupted, _) = begun_with(&page, "x", 2);
    put_modified(&page, &interrupted, "1.stl", b"solid", 5);
    cut_off(&page, &interrupted, "2.stl");
    let (other, arrived) = begun_with(&page, "y", 1);
    assert!(other != interrupted && arrived == json!([]), "{arrived}");
    assert_eq!(end(&page, &other, "cancel").status, 200);
    // The page cancels it if other files were chosen.
    let (again, arrived) = begun_with(&page, "x", 1);
    assert_eq!(again, interrupted);
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
