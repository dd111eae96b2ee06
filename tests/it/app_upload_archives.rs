//! ZIP archives that a browser sends to `mocban app`, and the memory that files need.

use mocban::workbook::test_helpers::archive;

use crate::app::text;
use crate::app_uploads::{begun, empty_app, end, put, refusal, stored};
#[cfg(target_os = "linux")]
use crate::page::Page;

/// Returns an archive of one scan, with bytes changed at a distance from the first record of its directory.
fn changed(at: usize, new: &[u8]) -> Vec<u8> {
    let mut bytes = archive(&[("1.stl", "solid a solid a solid a")], true);
    let entry = bytes.windows(4).position(|four| four == b"PK\x01\x02");
    let at = entry.expect("a directory") + at;
    bytes[at..at + new.len()].copy_from_slice(new);
    bytes
}

#[test]
fn an_archive_is_unpacked_or_refused_as_a_whole() {
    let (dir, page) = empty_app();
    let named = |name: &str| archive(&[("0.stl", "x"), (name, "x")], true);
    let mut no_utf8 = named("1234.stl");
    while let Some(at) = no_utf8.windows(8).position(|name| name == b"1234.stl") {
        no_utf8[at] = 0xe1;
    }
    let link = {
        let bytes = changed(5, &[3]);
        let entry = bytes.windows(4).position(|four| four == b"PK\x01\x02");
        let mut bytes = bytes;
        let at = entry.expect("a directory") + 38;
        bytes[at..at + 4].copy_from_slice(&[0, 0, 0xff, 0xa1]);
        bytes
    };
    let whole = changed(0, b"PK");
    for (bytes, reason) in [
        (named("../1.stl"), "leads to another folder"),
        (named("a/../../1.stl"), "leads to another folder"),
        (named("/etc/1.stl"), "leads to another folder"),
        (named("a\\1.stl"), "its name has '\\\\'"),
        (named("C:/1.stl"), "its name has ':'"),
        (named("con.stl"), "a device on Windows"),
        (named("0.STL"), "only in upper and lower case"),
        (named("0.stl"), "this file is there twice"),
        (no_utf8, "is not UTF-8"),
        (link, "1.stl is a link"),
        (changed(8, &[1, 0]), "1.stl has a password"),
        (changed(10, &[12, 0]), "compressed in an unusual way"),
        (changed(20, &[0xff; 4]), "(ZIP64)"),
        (
            changed(24, &[0, 0, 0, 0x10]),
            "more than 200 times its size",
        ),
        (changed(24, &[3, 0, 0, 0]), "larger than its directory says"),
        (changed(16, &[0; 4]), "the bytes of 1.stl are wrong"),
        (
            named(&("a/".repeat(20) + "1.stl")),
            "in more than 19 folders",
        ),
        (named("0.stl/1.stl"), "0.stl is both a file and a folder"),
        (whole[..whole.len() - 9].to_vec(), "the archive is damaged"),
        (b"no archive".to_vec(), "the archive is damaged"),
    ] {
        let upload = begun(&page, "x", 1);
        let refused = refusal(&put(&page, &upload, "quét.zip", &bytes));
        assert!(refused.contains(reason), "{reason}: {refused}");
        assert_eq!(stored(dir.path()), [""; 0], "{reason}");
    }
    let nested = archive(&[("9.stl", "x")], true);
    let nested = String::from_utf8_lossy(&nested).into_owned();
    let files = [
        ("ván 4/", ""),
        ("ván 4/chữ 1.stl", "solid"),
        ("ván 4/chu\u{31b}\u{303} 1.png", "png"),
        ("ván 4/inner.zip", &nested),
        ("ván 4/notes.doc", "x"),
        ("notes?.doc", "x"),
        ("__MACOSX/ván 4/._chữ 1.stl", "x"),
        ("__MACOSX/._Icon\r", "x"),
    ];
    let upload = begun(&page, "quét", 1);
    let sent = put(&page, &upload, "quét.ZIP", &archive(&files, true));
    assert_eq!(sent.status, 200, "{}", text(&sent));
    let reply = end(&page, &upload, "finish");
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert_eq!(stored(dir.path()), ["quét/chữ 1.png", "quét/chữ 1.stl"]);
    let go = reply.json()["go"].as_str().expect("an address").to_owned();
    let html = text(&page.get(&format!("/{go}")));
    assert!(html.contains("<b>1</b> pair"), "{html}");
    assert!(html.contains("3 other files of the archive"), "{html}");
    let empty = begun(&page, "x", 1);
    let none = archive(&[("readme.md", "x")], false);
    assert_eq!(put(&page, &empty, "a.zip", &none).status, 200);
    let refused = refusal(&end(&page, &empty, "finish"));
    assert!(refused.contains("none of the files is a scan"), "{refused}");
}

#[cfg(target_os = "linux")]
/// Returns the largest memory of a process so far, in KiB.
fn peak_kib(page: &Page) -> u64 {
    let pid = page.pid().as_raw_nonzero();
    let status =
        std::fs::read_to_string(format!("/proc/{pid}/status")).expect("the status of a process");
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|peak| peak.trim().strip_suffix("kB")?.trim().parse().ok());
    peak.expect("its largest memory")
}

#[cfg(target_os = "linux")]
#[test]
fn the_memory_of_an_upload_does_not_grow_with_its_files() {
    const MIB: usize = 1 << 20;
    let (dir, page) = empty_app();
    let upload = begun(&page, "x", 2);
    assert_eq!(put(&page, &upload, "1.stl", &vec![b'x'; MIB]).status, 200);
    let before = peak_kib(&page);
    let sent = put(&page, &upload, "2.stl", &vec![b'x'; 64 * MIB]);
    assert_eq!(sent.status, 200, "{}", text(&sent));
    let grown = peak_kib(&page) - before;
    assert!(grown < 16 << 10, "{grown} KiB");
    assert_eq!(end(&page, &upload, "finish").status, 200);
    let file = std::fs::metadata(dir.path().join("uploads/x/2.stl"));
    assert_eq!(file.expect("a file").len(), 64 * MIB as u64);
}
