//! Commands that write outputs, while one system call after another fails with EIO and with ENOSPC. With a small
//! `MOCBAN_FAULT_MOMENTS` only some of the calls fail; with a large one, each of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::backup::files as names;
use crate::cli::{binary, call, mocban};
use crate::fault::{EIO, ENOSPC, Fault};
use crate::fault_scenario::{End, FaultScenario, fault_points};
use crate::resume::copy;
use crate::uninterrupted::{Comparison, files};

/// Any system call on any file below the directory.
const ANY: &[(Fault, End)] = &[
    (Fault::once("any", "*", EIO), End::Either),
    (Fault::once("any", "*", ENOSPC), End::Either),
];

/// The copy of the earlier output.
const EARLIER: &str = "earlier";

/// Returns a command for the project `p` in a directory.
fn command(root: &Path, args: &[&str]) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p")).args(args);
    command
}

/// Copies the completed project, judges a pair, writes the output once and keeps a copy.
fn prepare(comparison: &Comparison, root: &Path, write: fn(&Path) -> Command) {
    copy(comparison.expected.project(), &root.join("p"));
    call(&mut write(root)).expect(0);
    let output = root.join("out");
    let kept = root.join(EARLIER);
    if output.is_dir() {
        crate::made_once::copy_folder(&output, &kept);
    } else {
        std::fs::copy(output, kept).expect("copied");
    }
    judge(root, "fail");
}

fn judge(root: &Path, verdict: &str) {
    let set = ["-C", "p", "verdict", "set", "upright-0000", verdict];
    mocban(root, &[&set[..], &["--reviewer", "lan"]].concat()).expect(0);
}

/// Returns the bytes of a file or of all files below a folder.
fn content(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    if path.is_dir() {
        return files(path);
    }
    [(PathBuf::new(), std::fs::read(path).expect("a file"))].into()
}

/// Asserts that the output is the earlier one or the new one, and that the next command writes the new one and leaves
/// nothing else.
fn assert_whole(root: &Path, done: bool, write: fn(&Path) -> Command) {
    let found = content(&root.join("out"));
    let earlier = content(&root.join(EARLIER));
    call(&mut write(root)).expect(0);
    let new = content(&root.join("out"));
    assert!(new != earlier, "the output does not depend on the verdict");
    // A report says which images or true alignments cannot be read.
    let is_stated = |bytes: &Vec<u8>| String::from_utf8_lossy(bytes).contains("(os error ");
    let is_whole = found == new || !done && found == earlier;
    assert!(is_whole || found.values().any(is_stated), "half an output");
    assert_eq!(names(root), [EARLIER, "out", "p"]);
    mocban(root, &["-C", "p", "check"]).expect(0);
}

fn export(root: &Path) -> Command {
    let out = root.join("out");
    command(root, &["export", "-o", out.to_str().expect("UTF-8")])
}

fn report(root: &Path) -> Command {
    let mut command = command(root, &["report", "-f", "html", "-o"]);
    command.arg(root.join("out"));
    command
}

fn backup(root: &Path) -> Command {
    let mut command = command(root, &["backup"]);
    command.arg(root.join("out"));
    command
}

fn contact_sheet(root: &Path) -> Command {
    let mut command = command(root, &["contact-sheet", "-o"]);
    command.arg(root.join("sheet/out.png"));
    command
}

fn restore(root: &Path) -> Command {
    let mut command = binary();
    command
        .arg("restore")
        .arg(root.join("b"))
        .arg(root.join("q"));
    command
}

fn copy_catalog(root: &Path) -> Command {
    let mut command = binary();
    command.arg("copy").arg(root.join("p")).arg(root.join("q"));
    command
}

fn verdict_import(root: &Path) -> Command {
    let mut command = command(root, &["verdict", "import"]);
    command.arg(root.join("verdicts.csv"));
    command
}

const EXPORT: FaultScenario = FaultScenario {
    before: |comparison, root| prepare(comparison, root, export),
    command: export,
    after: |_, root, done| assert_whole(root, done, export),
};

const REPORT: FaultScenario = FaultScenario {
    before: |comparison, root| prepare(comparison, root, report),
    command: report,
    after: |_, root, done| assert_whole(root, done, report),
};

const BACKUP: FaultScenario = FaultScenario {
    before: |comparison, root| prepare(comparison, root, backup),
    command: backup,
    after: |_, root, done| assert_whole(root, done, backup),
};

const CONTACT_SHEET: FaultScenario = FaultScenario {
    before: |comparison, root| {
        copy(comparison.expected.project(), &root.join("p"));
        std::fs::create_dir(root.join("sheet")).expect("a folder");
        // An empty file may be replaced; any other that is no sheet is refused.
        std::fs::write(root.join("sheet/out.png"), "").expect("written");
    },
    command: contact_sheet,
    after: |_, root, done| {
        let found = content(&root.join("sheet"));
        call(&mut contact_sheet(root)).expect(0);
        let new = content(&root.join("sheet"));
        assert_eq!(new.len(), 1);
        // A sheet on which a pair is not drawn completely has exit code 3. A hidden file that could not be removed stays
        // until the next command.
        let sheet = Path::new("out.png");
        assert!(found[sheet] == new[sheet] || !done);
    },
};

const VERDICT_IMPORT: FaultScenario = FaultScenario {
    before: |comparison, root| {
        copy(comparison.expected.project(), &root.join("p"));
        let lines = "pair,verdict,reviewer,at\nupright-0000,pass,lan,2026-11-21\n\
            upright-0000,fail,minh,2026-11-22\n";
        std::fs::write(root.join("verdicts.csv"), lines).expect("written");
    },
    command: verdict_import,
    after: |_, root, done| {
        let recorded = || {
            let log = mocban(root, &["-C", "p", "verdict", "log", "--json"]).expect(0);
            log.out.lines().count()
        };
        // Four metrics and two verdicts: all or none.
        let found = recorded();
        assert!(found == 8 || !done && found == 0, "{found} verdicts");
        if found == 0 {
            call(&mut verdict_import(root)).expect(0);
        }
        assert_eq!(recorded(), 8);
        mocban(root, &["-C", "p", "check"]).expect(0);
        assert_eq!(names(root), ["p", "verdicts.csv"]);
    },
};

const COPY: FaultScenario = FaultScenario {
    before: |comparison, root| {
        copy(comparison.expected.project(), &root.join("p"));
        judge(root, "pass");
    },
    command: copy_catalog,
    after: |_, root, done| {
        let is_there = root.join("q/catalog.sqlite").exists();
        assert!(is_there || !done);
        // A catalog that is there is a whole one, so the same command has nothing to write.
        let mut again = copy_catalog(root);
        let again = call(again.arg("--json")).expect(0).json();
        assert_eq!(again["existed"], is_there);
        let log = |name| {
            mocban(root, &["-C", name, "verdict", "log", "--json"])
                .expect(0)
                .out
        };
        assert_eq!(log("p"), log("q"));
    },
};

const RESTORE: FaultScenario = FaultScenario {
    before: |comparison, root| {
        let project = copy(comparison.expected.project(), &root.join("p"));
        std::fs::write(project.settings_path(), "[run]\nworkers = 1\n").expect("written");
        mocban(root, &["-C", "p", "backup", "b"]).expect(0);
    },
    command: restore,
    after: |_, root, done| {
        if !root.join("q/catalog.sqlite").exists() {
            assert!(!done);
            call(&mut restore(root)).expect(0);
        }
        let expected = ["catalog.sqlite", "mocban.toml"];
        let left = names(&root.join("q"));
        if done {
            // Hidden temporary files may remain. Another restore would be refused, so it cannot remove them.
            assert!(
                left.iter()
                    .all(|name| name.starts_with('.') || expected.contains(&&**name))
            );
        } else {
            assert_eq!(left, expected);
        }
        let settings = ["p", "q"].map(|name| content(&root.join(name).join("mocban.toml")));
        assert!(settings[0] == settings[1]);
        mocban(root, &["-C", "q", "status"]).expect(0);
    },
};

#[test]
fn an_export_is_whole_whichever_call_fails() {
    EXPORT.check_all(ANY, fault_points());
}

#[test]
fn a_report_is_whole_whichever_call_fails() {
    REPORT.check_all(ANY, fault_points());
}

#[test]
fn a_backup_is_whole_whichever_call_fails() {
    BACKUP.check_all(ANY, fault_points());
}

#[test]
fn a_contact_sheet_is_whole_whichever_call_fails() {
    CONTACT_SHEET.check_all(ANY, fault_points());
}

#[test]
fn verdicts_are_imported_all_or_none_whichever_call_fails() {
    VERDICT_IMPORT.check_all(ANY, fault_points());
}

#[test]
fn a_copy_is_whole_whichever_call_fails() {
    COPY.check_all(ANY, fault_points());
}

#[test]
fn a_restore_is_whole_whichever_call_fails() {
    RESTORE.check_all(ANY, fault_points());
}
