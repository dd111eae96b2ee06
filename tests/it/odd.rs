//! Unusual states of the disk. Each gives one clear sentence that names the file and the remedy, and no data is lost.

use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::os::unix::process::CommandExt as _;
use std::path::Path;

use mocban::store::Project;

use crate::check::{at, below, done, exported, sql};
use crate::cli::{binary, binary_beside, call, empty, mocban};

/// Overwrites the catalog from `from` eighths to `to` eighths of its length with garbage. Returns the former content.
pub(crate) fn corrupt_catalog(project: &Project, from: usize, to: usize) -> Vec<u8> {
    let path = project.catalog_path();
    let intact = std::fs::read(&path).expect("read");
    let mut bytes = intact.clone();
    let (from, to) = (bytes.len() * from / 8, bytes.len() * to / 8);
    for (index, byte) in bytes[from..to].iter_mut().enumerate() {
        *byte = (index * 37 % 251) as u8;
    }
    std::fs::write(path, bytes).expect("written");
    intact
}

/// Overwrites a part of the catalog's file in which rows are stored, but not the schema. Returns the intact bytes.
fn corrupt_rows(project: &Project) -> Vec<u8> {
    const PARTS: usize = 64;
    let path = project.catalog_path();
    let intact = std::fs::read(&path).expect("read");
    let is_of_rows = |part: &usize| {
        let mut bytes = intact.clone();
        let from = bytes.len() * *part / PARTS;
        for (index, byte) in bytes[from..]
            .iter_mut()
            .take(intact.len() / PARTS)
            .enumerate()
        {
            *byte = (index * 37 % 251) as u8;
        }
        std::fs::write(&path, bytes).expect("written");
        let lists_faults = at(project, &["check"])
            .out
            .contains("faults of the database");
        lists_faults && at(project, &["report"]).code == 1
    };
    let found = (1..PARTS).rev().find(is_of_rows);
    assert!(found.is_some(), "every part of the file holds the schema");
    intact
}

/// Terms of SQLite and sqlx that no message may contain.
const RAW: [&str; 4] = ["code:", "returned from database", "SQLITE_", "malformed"];

#[track_caller]
fn plain(message: &str, expected: &str) {
    assert!(message.contains(expected), "{expected}: {message}");
    assert!(!RAW.iter().any(|raw| message.contains(raw)), "{message}");
}

#[test]
fn file_that_is_not_a_catalog_is_reported_in_a_sentence() {
    let dir = empty();
    let file = dir.path().join("catalog.sqlite");
    let import = ["import", "pairs.csv", "--allow-missing"];
    let manifest = "id,mesh,print\na,a.stl,a.png\n";
    std::fs::write(dir.path().join("pairs.csv"), manifest).expect("written");
    let cases: [(&[u8], &str); 3] = [
        (b"", "is empty (0 bytes)"),
        (
            b"id,mesh,print\na,a.stl,a.png\n",
            "is not a catalog but text",
        ),
        (b"\x89PNG\r\n\x1a\nrest", "is not a catalog but a PNG image"),
    ];
    for (bytes, wanted) in cases {
        std::fs::write(&file, bytes).expect("written");
        for (command, code) in [(&["status"][..], 1), (&["run"], 1), (&["check"], 12)] {
            let refused = mocban(dir.path(), command).expect(code);
            plain(&refused.err, wanted);
            assert!(refused.err.contains("catalog.sqlite"), "{}", refused.err);
        }
        assert_eq!(std::fs::read(&file).expect("read"), bytes);
        if !bytes.is_empty() {
            plain(&mocban(dir.path(), &import).expect(1).err, wanted);
            assert_eq!(std::fs::read(&file).expect("read"), bytes);
        }
    }
    // A kill at the start of an import leaves an empty file. The next import succeeds.
    std::fs::write(&file, "").expect("written");
    mocban(dir.path(), &import).expect(0);
    std::fs::remove_file(&file).expect("removed");
    std::fs::create_dir(&file).expect("a folder");
    for (command, code) in [(&["status"][..], 1), (&["run"], 1), (&import, 1)] {
        let refused = mocban(dir.path(), command).expect(code);
        plain(
            &refused.err,
            "is a directory where the catalog should be a file",
        );
    }
}

#[test]
fn a_database_of_another_version_or_program_is_refused_and_left_alone() {
    let dir = empty();
    let project = done(dir.path());
    sql(&project, "PRAGMA user_version = 9000");
    let before = std::fs::read(project.catalog_path()).expect("read");
    for command in ["status", "run", "check"] {
        let refused = at(&project, &[command]).expect(1);
        plain(&refused.err, "another version of this program");
    }
    assert!(std::fs::read(project.catalog_path()).expect("read") == before);
    sql(
        &project,
        "PRAGMA application_id = 1; PRAGMA user_version = 1",
    );
    plain(&at(&project, &["status"]).expect(1).err, "another program");
    plain(&at(&project, &["check"]).expect(12).err, "another program");
}

#[test]
fn catalog_with_garbage_inside_is_reported_and_not_repaired() {
    let dir = empty();
    let project = done(dir.path());
    let intact = corrupt_rows(&project);
    for command in [&["report"][..], &["export", "-o", "x"], &["run"]] {
        let refused = at(&project, command).expect(1);
        plain(&refused.err, "is damaged");
        assert!(refused.err.contains("catalog.sqlite"), "{}", refused.err);
    }
    let before = std::fs::read(project.catalog_path()).expect("read");
    for command in [&["check"][..], &["check", "--repair"]] {
        let found = at(&project, command).expect(12).out;
        assert!(found.contains("faults of the database"), "{found}");
        assert!(found.contains("replace it with a backup"), "{found}");
    }
    let after = std::fs::read(project.catalog_path()).expect("read");
    assert!(after == before, "the repair wrote to a damaged catalog");

    // If not even the schema can be read, there is nothing to list.
    std::fs::write(project.catalog_path(), intact).expect("restored");
    corrupt_catalog(&project, 1, 7);
    for command in [&["check"][..], &["check", "--repair"]] {
        let refused = at(&project, command).expect(12);
        plain(&refused.err, "too damaged to be read");
    }
}

#[test]
fn wrong_counters_end_a_run_with_a_sentence_that_names_the_repair() {
    let dir = empty();
    let project = done(dir.path());
    sql(&project, "UPDATE counter SET n = 0");
    let again = ["run", "--rerun", "all", "--stage", "register"];
    let refused = at(&project, &again).expect(1);
    plain(&refused.err, "`check --repair` repairs them");
    at(&project, &["check", "--repair"]).expect(0);
    at(&project, &again).expect(0);
    at(&project, &["check"]).expect(0);
}

/// Calls the binary as a user who may read but not write there.
fn as_nobody(project: &Project, args: &[&str]) -> crate::cli::Call {
    let mut command = binary_beside(project.dir());
    command
        .current_dir("/")
        .arg("-C")
        .arg(project.dir())
        .args(args);
    as_other_user(&mut command, project.dir());
    call(&mut command)
}

/// Lets a command run without the rights of root, who may write everywhere.
pub(crate) fn as_other_user(command: &mut std::process::Command, dir: &Path) {
    if std::fs::metadata(dir).expect("a folder").uid() == 0 {
        command.uid(65534).gid(65534);
    }
}

/// Removes the write permission below a directory, or restores it for the owner.
pub(crate) fn set_writable(dir: &Path, writable: bool) {
    for entry in std::fs::read_dir(dir).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            set_writable(&path, writable);
        } else {
            set_mode(&path, if writable { 0o644 } else { 0o444 });
        }
    }
    set_mode(dir, if writable { 0o755 } else { 0o555 });
}

/// Sets the permissions of a file or folder.
pub(crate) fn set_mode(path: &Path, mode: u32) {
    let mode = std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(path, mode).expect("set");
}

#[test]
fn read_only_project_can_be_read() {
    let dir = empty();
    set_mode(dir.path(), 0o755);
    let project = done(dir.path());
    let wanted = at(&project, &["report", "--json"]).expect(0).out;
    set_writable(project.dir(), false);
    assert_eq!(
        as_nobody(&project, &["report", "--json"]).expect(0).out,
        wanted
    );
    as_nobody(&project, &["status"]).expect(0);
    as_nobody(&project, &["show", "upright-0001"]).expect(0);
    as_nobody(&project, &["check"]).expect(0);
    for command in [&["run"][..], &["check", "--repair"], &["verdict", "undo"]] {
        let refused = as_nobody(&project, command).expect(1);
        plain(
            &refused.err,
            "cannot be written to; commands that only read",
        );
    }
    let refused = as_nobody(&project, &["check", "--collect"]).expect(1);
    plain(
        &refused.err,
        "cannot be written to; commands that only read",
    );
    let listed = as_nobody(&project, &["run", "--dry-run"]).expect(0);
    plain(
        &listed.err,
        "input files that changed since the last run are not",
    );
    let refused = as_nobody(&project, &["contact-sheet"]).expect(1);
    plain(&refused.err, "name a file elsewhere with -o");

    // If the write-ahead log was never checkpointed, it must not be ignored silently.
    set_writable(project.dir(), true);
    std::fs::write(project.dir().join("catalog.sqlite-wal"), [7; 64]).expect("written");
    set_writable(project.dir(), false);
    let refused = as_nobody(&project, &["status"]).expect(1);
    plain(&refused.err, "catalog.sqlite-wal holds changes");
    set_writable(project.dir(), true);
}

#[test]
fn export_that_would_lack_files_leaves_the_previous_one() {
    let dir = empty();
    let project = done(dir.path());
    let before = exported(&project, "out");
    let one = std::fs::read_dir(project.artifacts_dir()).expect("a folder");
    for folder in one.flatten().filter(|entry| entry.path().is_dir()) {
        std::fs::remove_dir_all(folder.path()).expect("removed");
    }
    let again = at(&project, &["export", "-o", "../out"]).expect(3);
    assert!(
        again.err.contains("the earlier export in ../out was kept"),
        "{}",
        again.err
    );
    assert!(below(&dir.path().join("out")) == before);
    // In a new directory it is written, with a list of what is missing.
    at(&project, &["export", "-o", "../new"]).expect(3);
    let lines = std::fs::read_to_string(dir.path().join("new/pairs.jsonl")).expect("read");
    assert!(lines.contains("is missing"), "{lines}");
    assert!(again.next()[0].ends_with(" check"), "{}", again.err);
    at(&project, &["check", "--repair", "--accept-missing"]).expect(0);
    at(&project, &["run"]).expect(0);
    assert!(exported(&project, "out") == before);
}

#[test]
fn pictures_that_would_lack_images_leave_the_previous_file() {
    let dir = empty();
    let project = done(dir.path());
    let commands = [
        &["contact-sheet", "-o", "../sheet.png"][..],
        &["report", "-f", "html", "-o", "../report.html"],
    ];
    let read = |args: &[&str]| std::fs::read(project.dir().join(args[args.len() - 1]));
    let before = commands.map(|args| {
        at(&project, args).expect(0);
        read(args).expect("a file")
    });
    let one = std::fs::read_dir(project.artifacts_dir()).expect("a folder");
    for folder in one.flatten().filter(|entry| entry.path().is_dir()) {
        std::fs::remove_dir_all(folder.path()).expect("removed");
    }
    for (args, before) in commands.iter().zip(before) {
        let again = at(&project, args).expect(3);
        let wanted = "was kept, because the new one lacks what the warnings say";
        assert!(again.err.contains(wanted), "{}", again.err);
        assert!(read(args).expect("a file") == before);
        let mut allowed = vec![args[0], "--allow-missing"];
        allowed.extend(&args[1..]);
        at(&project, &allowed).expect(3);
        assert!(read(args).expect("a file") != before);
    }
}

#[test]
fn report_and_export_warn_about_stale_results() {
    let dir = empty();
    let project = done(dir.path());
    let warning = "warning: 2 pairs are stale";
    for command in [&["report"][..], &["export", "-o", "../out"]] {
        let now = at(&project, command).expect(0);
        assert!(!now.err.contains("stale"), "{}", now.err);
        let changed = ["--set", "register.smoothing_px=1.5"];
        let later = at(&project, &[&changed[..], command].concat()).expect(0);
        let warned = later.err.lines().filter(|line| line.starts_with(warning));
        assert_eq!(warned.count(), 1, "{}", later.err);
    }
}

#[test]
fn verdict_files_of_spreadsheets_are_read() {
    let dir = empty();
    let project = done(dir.path());
    let file = project.dir().join("verdicts.csv");
    let text = "pair;verdict;reviewer;note\r\nupright-0001;fail;Trần;\"1,5 px; nghiêng\"\r\n";
    let utf16: Vec<u8> = "\u{feff}"
        .encode_utf16()
        .chain(text.encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    let bytes: [&[u8]; 2] = [text.as_bytes(), &utf16];
    for bytes in bytes {
        std::fs::write(&file, bytes).expect("written");
        at(&project, &["verdict", "import", "verdicts.csv"]).expect(0);
        let log = at(&project, &["verdict", "log", "upright-0001", "--json"])
            .expect(0)
            .out;
        let last: serde_json::Value =
            serde_json::from_str(log.lines().last().expect("a line")).expect("JSON");
        assert_eq!(
            (&last["reviewer"], &last["note"]),
            (&"Trần".into(), &"1,5 px; nghiêng".into())
        );
        at(&project, &["verdict", "undo", "--reviewer", "Trần"]).expect(0);
    }
}

#[test]
fn path_that_is_not_utf8_leaves_no_project() {
    use std::os::unix::ffi::OsStrExt as _;
    let dir = empty();
    let odd = dir.path().join(std::ffi::OsStr::from_bytes(b"scans-\xff"));
    std::fs::create_dir(&odd).expect("a folder");
    for name in ["1.stl", "1.png"] {
        std::fs::write(odd.join(name), "x").expect("written");
    }
    let mut import = binary();
    import
        .current_dir(dir.path())
        .args(["-C", "p", "import", "--meshes"]);
    import.arg(&odd).arg("--prints").arg(&odd);
    let refused = call(&mut import).expect(2);
    plain(&refused.err, "is not UTF-8");
    assert!(!dir.path().join("p").exists());
}
