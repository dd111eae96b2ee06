//! An export of the app as one ZIP archive: its size before, its content, its name, and what ends it.

use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use crate::app::{act, html, open_app, text, with_project};
use crate::page::{Page, Reply, read_project};
use crate::skipped::say_skipped;
use crate::waiting::wait_until;

/// Lists the files of an archive with their lengths, after it checked their checksums.
const LIST: &str = "
import sys, zipfile
with zipfile.ZipFile(sys.argv[1]) as archive:
    assert archive.testzip() is None
    for info in archive.infolist():
        print(info.file_size, info.filename)
";

/// Lists the files of an archive with Python. `None`, with a line on stderr, if there is none.
fn listed(archive: &[u8], dir: &Path) -> Option<Vec<(u64, String)>> {
    let path = dir.join("read.zip");
    fs::write(&path, archive).expect("written");
    let mut python = Command::new("python3");
    python.env("PYTHONIOENCODING", "utf-8");
    let Ok(done) = python.args(["-c", LIST]).arg(&path).output() else {
        say_skipped("no python3 on the path");
        return None;
    };
    let [out, err] = [&done.stdout, &done.stderr].map(|bytes| String::from_utf8_lossy(bytes));
    assert!(done.status.success(), "{err}");
    let line = |line: &str| {
        let (size, name) = line.split_once(' ').expect("a size and a name");
        (size.parse().expect("a size"), name.to_owned())
    };
    let mut files: Vec<_> = out.lines().map(line).collect();
    files.sort();
    Some(files)
}

/// Starts an export, waits until it is done, and returns the reply to the action.
#[track_caller]
pub(crate) fn export(page: &Page, body: &Value) -> Value {
    let reply = act(page, "/p/p/actions/export", body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("the export is done", || {
        html(page, "/p/p/export").contains("data-task=\"done\"")
    });
    reply.json()
}

/// Exports a table of all pairs.
pub(crate) fn export_table(page: &Page) {
    export(
        page,
        &json!({"purpose": "excel", "only": "all", "metric": ""}),
    );
}

/// Exports a table, and returns the folder of the export.
fn table_folder(dir: &Path, page: &Page) -> PathBuf {
    export_table(page);
    dir.join("p/exports/excel")
}

fn download(page: &Page) -> Reply {
    let reply = page.get("/p/p/exports/excel.zip");
    assert_eq!(reply.status, 200, "{}", text(&reply));
    reply
}

/// Returns the files below a folder with their lengths, as the archive names them.
fn files(folder: &Path, name: &str) -> Vec<(u64, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let own = path.file_name().expect("a name").to_string_lossy();
        let name = format!("{name}/{own}");
        if path.is_dir() {
            found.extend(files(&path, &name));
        } else {
            found.push((path.metadata().expect("a file").len(), name));
        }
    }
    found.sort();
    found
}

/// Makes a file of zeros, which takes no room on the disk.
fn zeros(path: &Path, length: u64) {
    let file = File::create(path).expect("a file");
    file.set_len(length).expect("a length");
}

#[test]
fn an_export_is_downloaded_as_one_archive_of_the_forecast_size() {
    let (dir, page) = with_project();
    let folder = table_folder(dir.path(), &page);
    let long = folder.join("chữ".repeat(40)).join("ữ".repeat(70));
    fs::create_dir_all(&long).expect("folders");
    fs::write(long.join("tên dài.txt"), "abc").expect("written");
    zeros(&folder.join("zeros.bin"), 3 << 20);
    // The size was worked out for the export as it was written; a change by hand is not noticed.
    let path = "/p/p/export";
    wait_until("the size is known", || {
        !text(&page.get(path)).contains("being worked out")
    });
    assert!(text(&page.get(path)).contains("href=\"exports/excel.zip\" download"));
    let reply = download(&page);
    assert_eq!(reply.header("content-type"), Some("application/zip"));
    assert_eq!(
        reply.header("content-disposition"),
        Some("attachment; filename=\"p-excel.zip\"; filename*=UTF-8''p-excel.zip")
    );
    let expected = files(&folder, "p-excel");
    assert!(
        expected.iter().any(|(_, name)| name.len() > 255),
        "{expected:?}"
    );
    if let Some(found) = listed(&reply.body, dir.path()) {
        assert_eq!(found, expected);
    }
}

#[test]
fn the_size_before_is_that_of_the_download() {
    let (dir, page) = with_project();
    let folder = table_folder(dir.path(), &page);
    zeros(&folder.join("zeros.bin"), 20_000_000);
    // The app that is opened next works the size out anew.
    drop(page);
    let page = open_app(dir.path());
    let length = download(&page).body.len();
    assert!(length > 20_000_000, "{length}");
    let size = format!(
        "ZIP</a><span class=\"muted\">{:.1} MB</span>",
        length as f64 / 1e6
    );
    wait_until("the size is known", || {
        text(&page.get("/p/p/export")).contains(&size)
    });
}

#[test]
fn the_name_of_an_archive_keeps_the_letters_of_its_project() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let project = dir.path().join("bản khắc \"1\"");
    fs::rename(dir.path().join("p"), &project).expect("renamed");
    fs::create_dir_all(project.join("exports/excel")).expect("folders");
    fs::write(project.join("exports/excel/export.json"), "{}").expect("written");
    let page = open_app(dir.path());
    let name = "b%E1%BA%A3n%20kh%E1%BA%AFc%20%221%22";
    let reply = page.get(&format!("/p/{name}/exports/excel.zip"));
    let named = reply.header("content-disposition").expect("a name");
    let safe = "b%E1%BA%A3n%20kh%E1%BA%AFc%20-1--excel.zip";
    assert!(
        named.ends_with(&format!("filename*=UTF-8''{safe}")),
        "{named}"
    );
    assert!(
        named.contains("filename=\"b_n kh_c -1--excel.zip\""),
        "{named}"
    );
    if let Some(found) = listed(&reply.body, dir.path()) {
        assert_eq!(found, [(2, "bản khắc -1--excel/export.json".to_owned())]);
    }
}

#[test]
fn only_exports_are_downloaded() {
    let (dir, page) = with_project();
    export_table(&page);
    fs::create_dir(dir.path().join("p/exports/other")).expect("a folder");
    for path in [
        "/p/p/exports/excel",
        "/p/p/exports/web.zip",
        "/p/p/exports/other.zip",
        "/p/p/exports/..%2Fexports%2Fexcel.zip",
        "/p/p/exports/.zip",
    ] {
        assert_eq!(page.get(path).status, 404, "{path}");
    }
}

/// Requests the archive and reads the beginning of the response.
fn begin(page: &Page) -> (TcpStream, usize, usize) {
    let mut stream = TcpStream::connect(page.address()).expect("connected");
    let (path, cookie) = (
        format!("{}/p/p/exports/excel.zip", page.session),
        &page.cookie,
    );
    let request = format!(
        "GET {path} HTTP/1.1\r\nhost: {}\r\ncookie: {cookie}\r\nconnection: close\r\n\r\n",
        page.host
    );
    stream.write_all(request.as_bytes()).expect("sent");
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        stream.read_exact(&mut byte).expect("a response");
        head.extend(byte);
    }
    let head = String::from_utf8(head).expect("a head");
    let length = head
        .lines()
        .find_map(|line| line.strip_prefix("content-length: "));
    let length = length.expect("a length").parse().expect("a number");
    (stream, length, head.len())
}

/// Reads the rest of a response and returns its length.
fn rest(mut stream: TcpStream) -> usize {
    let (mut total, mut buffer) = (0, vec![0; 1 << 16]);
    loop {
        match stream.read(&mut buffer) {
            Ok(0) | Err(_) => return total,
            Ok(read) => total += read,
        }
    }
}

#[test]
fn a_download_is_cut_off_if_the_export_is_replaced_or_loses_a_file() {
    let (dir, page) = with_project();
    let folder = table_folder(dir.path(), &page);
    // The next export replaces only files that this one wrote, and without checksums also changed ones.
    zeros(&folder.join("pairs.csv"), 40 << 20);
    fs::remove_file(folder.join("checksums.txt")).expect("removed");
    let (stream, length, _) = begin(&page);
    assert_eq!(rest(stream), length, "an unchanged export is sent whole");
    let (stream, length, _) = begin(&page);
    // A response that is not read stops the download long before the end.
    fs::rename(folder.join("export.json"), folder.join("moved.json")).expect("moved");
    assert!(rest(stream) < length);
    fs::rename(folder.join("moved.json"), folder.join("export.json")).expect("moved back");
    let (stream, length, _) = begin(&page);
    export_table(&page);
    assert!(rest(stream) < length);
    assert_eq!(download(&page).status, 200, "the new export is whole");
}

#[test]
fn an_edited_export_is_kept_and_the_page_says_so_in_both_languages() {
    let (dir, page) = with_project();
    let table = table_folder(dir.path(), &page).join("pairs.csv");
    fs::write(&table, "my corrections\n").expect("written");
    let body = json!({"purpose": "excel", "only": "all", "metric": ""});
    let reply = act(&page, "/p/p/actions/export", &body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("the export is refused", || {
        html(&page, "/p/p/export").contains("data-task=\"failed\"")
    });
    for (path, said) in [
        ("/p/p/export", "was changed after it was written"),
        ("/p/p/export?language=vi", "đã bị sửa sau khi ghi"),
    ] {
        let shown = html(&page, path);
        assert!(shown.contains(said), "{path}: {shown}");
    }
    assert_eq!(
        fs::read_to_string(&table).expect("a table"),
        "my corrections\n"
    );
}

#[test]
fn a_folder_without_a_manifest_has_no_link_to_an_archive() {
    let (dir, page) = with_project();
    fs::create_dir_all(dir.path().join("p/exports/excel")).expect("folders");
    let html = text(&page.get("/p/p/export"));
    assert!(html.contains("cannot be downloaded as one ZIP"), "{html}");
    assert!(!html.contains("excel.zip") && !html.contains("being worked out"));
}

/// Reads the memory of the app in `/proc`.
#[cfg(target_os = "linux")]
#[test]
fn downloads_at_the_same_time_are_equal_and_take_little_memory() {
    const FILE: u64 = 100 << 20;
    let (dir, page) = with_project();
    let folder = table_folder(dir.path(), &page);
    zeros(&folder.join("zeros.bin"), FILE);
    let peak_kib = || {
        let status = fs::read_to_string(format!("/proc/{}/status", page.pid().as_raw_nonzero()));
        let status = status.expect("a process");
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let line = line.and_then(|line| line.trim().strip_suffix(" kB"));
        line.expect("a peak").parse::<u64>().expect("a number")
    };
    let before = peak_kib();
    let lengths = std::thread::scope(|scope| {
        let downloads = [0, 1].map(|_| {
            scope.spawn(|| {
                let (stream, length, _) = begin(&page);
                assert_eq!(rest(stream), length);
                length
            })
        });
        downloads.map(|download| download.join().expect("no panic"))
    });
    assert_eq!(lengths[0], lengths[1]);
    assert!(lengths[0] as u64 > FILE);
    let grown = peak_kib() - before;
    assert!(grown < 48 << 10, "{grown} KiB");
}
