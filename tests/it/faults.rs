//! Disk faults while the binary runs. A command that fails reports the fault in one sentence and leaves nothing
//! incomplete. The next command succeeds as if there had been no fault. `MOCBAN_FAULT_MOMENTS` sets the number of
//! system calls at which each fault is injected. With 24 the tests take minutes.

use std::path::Path;
use std::process::Command;

use mocban::store::Project;

use crate::backup::files as names;
use crate::cli::{binary, call, mocban};
use crate::fault::{EAGAIN, EIO, ENOSPC, Fault};
use crate::fault_scenario::{End, FaultScenario, fault_points};
use crate::made_once::copy_folder;
use crate::resume::{copy, run};
use crate::uninterrupted::{Comparison, files};

const WAL: &str = "p/catalog.sqlite-wal";
const INDEX: &str = "p/catalog.sqlite-shm";
const CATALOG: &str = "p/catalog.sqlite";
const TEMPORARY: &str = "p/artifacts/tmp/*";
const PLACED: &str = "p/artifacts/??/*";

/// Faults of the catalog's files during a run.
const OF_THE_CATALOG: &[(Fault, End)] = &[
    (Fault::once("write", WAL, ENOSPC), End::Fails),
    (Fault::once("write", WAL, EIO).and_later(), End::Fails),
    (Fault::half(WAL), End::Succeeds),
    (
        Fault::once("write", WAL, ENOSPC).and_later().half_first(),
        End::Fails,
    ),
    (Fault::once("sync", WAL, EIO), End::Either),
    (Fault::once("sync", WAL, EIO).and_later(), End::Either),
    (Fault::once("open", WAL, EIO), End::Either),
    (Fault::once("unlink", WAL, EIO), End::Succeeds),
    (Fault::once("truncate", WAL, EIO), End::Succeeds),
    (Fault::once("write", CATALOG, EIO), End::Succeeds),
    (
        Fault::once("write", CATALOG, ENOSPC).and_later(),
        End::Succeeds,
    ),
    (Fault::once("sync", CATALOG, EIO), End::Succeeds),
    (Fault::once("read", CATALOG, EIO), End::Fails),
    (Fault::once("open", CATALOG, EIO), End::Either),
    (Fault::once("open", INDEX, EIO), End::Fails),
    (Fault::once("write", INDEX, ENOSPC), End::Fails),
];

/// Faults of the other files during a run.
const OF_THE_FILES: &[(Fault, End)] = &[
    (Fault::once("open", TEMPORARY, ENOSPC), End::Fails),
    (Fault::once("write", TEMPORARY, ENOSPC), End::Fails),
    (Fault::half(TEMPORARY), End::Succeeds),
    (
        Fault::once("write", TEMPORARY, ENOSPC)
            .and_later()
            .half_first(),
        End::Fails,
    ),
    (Fault::once("sync", TEMPORARY, EIO), End::Fails),
    (Fault::once("rename", PLACED, EIO), End::Fails),
    (
        Fault::once("rename", PLACED, ENOSPC).and_later(),
        End::Fails,
    ),
    (Fault::once("sync", "p/artifacts/??", EIO), End::Fails),
    (Fault::once("sync", "p/artifacts", EIO), End::Fails),
    (Fault::once("mkdir", "p/artifacts*", ENOSPC), End::Fails),
    (Fault::once("truncate", "p/run.*", EIO), End::Fails),
    (Fault::once("write", "p/run.*", ENOSPC), End::Fails),
    (Fault::once("open", "p/run.*", EIO), End::Fails),
    (Fault::once("open", "p/data/*", EIO), End::Either),
    (Fault::once("write", "*", ENOSPC).and_later(), End::Either),
    (Fault::once("sync", "*", EIO).and_later(), End::Either),
    (Fault::slow("sync", "*", 5), End::Succeeds),
];

/// Faults of an import into a new project.
const OF_AN_IMPORT: &[(Fault, End)] = &[
    (Fault::once("open", "p/*catalog.sqlite*", EIO), End::Either),
    (
        Fault::once("write", "p/*catalog.sqlite*", ENOSPC),
        End::Either,
    ),
    (Fault::once("write", "*", ENOSPC).and_later(), End::Either),
    (Fault::half("p/*catalog.sqlite*"), End::Succeeds),
    (Fault::once("sync", "*", EIO), End::Either),
    (Fault::once("sync", "*", EIO).and_later(), End::Either),
];

/// Faults of an export.
const OF_AN_EXPORT: &[(Fault, End)] = &[
    (Fault::once("open", ".out*", ENOSPC), End::Fails),
    (Fault::once("write", ".out.*/new/*", ENOSPC), End::Fails),
    // The process id in a lock file is only for messages.
    (Fault::once("write", ".out.*lock", ENOSPC), End::Succeeds),
    (Fault::once("write", "*", EIO).and_later(), End::Fails),
    (Fault::half(".out*"), End::Succeeds),
    (Fault::once("mkdir", ".out*", ENOSPC), End::Fails),
    (Fault::once("rename", "out", EIO), End::Fails),
];

/// Faults of a backup.
const OF_A_BACKUP: &[(Fault, End)] = &[
    (Fault::once("open", ".b.*", ENOSPC), End::Either),
    (
        Fault::once("write", ".b.*catalog.sqlite", ENOSPC),
        End::Fails,
    ),
    (Fault::once("write", "*", EIO).and_later(), End::Fails),
    (Fault::half(".b.*catalog.sqlite"), End::Succeeds),
    // SQLite ignores whether it can sync the folder of a journal.
    (Fault::once("sync", ".b.*catalog.sqlite*", EIO), End::Fails),
    (Fault::once("sync", "*", EIO).and_later(), End::Fails),
    (Fault::once("rename", "b.sqlite", EIO), End::Fails),
    // SQLite cannot finish the copy if it cannot remove the copy's journal.
    (Fault::once("unlink", ".b.*-journal", EIO), End::Fails),
    (Fault::once("unlink", ".b.*lock", EIO), End::Succeeds),
    (Fault::once("read", CATALOG, EIO), End::Fails),
    (Fault::once("read", "p/mocban.toml", EIO), End::Fails),
];

/// Faults during `check`. An unreadable database must not be reported as damaged.
const OF_A_CHECK: &[(Fault, End)] = &[
    (Fault::once("read", CATALOG, EIO), End::Either),
    (Fault::once("read", CATALOG, EIO).and_later(), End::Fails),
];

/// Faults of a repair.
const OF_A_REPAIR: &[(Fault, End)] = &[
    (Fault::once("write", WAL, ENOSPC), End::Fails),
    (Fault::once("write", WAL, EIO).and_later(), End::Fails),
    (Fault::half(WAL), End::Succeeds),
    (Fault::once("sync", WAL, EIO), End::Either),
    (Fault::once("open", CATALOG, EIO), End::Either),
    // The file may be sound, so its result stays. The next repair finds it sound.
    (Fault::once("read", PLACED, EIO), End::Fails),
    (Fault::once("open", PLACED, EIO), End::Fails),
    (Fault::once("unlink", PLACED, EIO), End::Succeeds),
    (Fault::once("open", "p/run.*", EIO), End::Fails),
    // The last writes copy the write-ahead log into the catalog. The next command does that again.
    (Fault::once("write", "*", ENOSPC).and_later(), End::Either),
];

/// Locks that are refused 300 times in a row. SQLite itself gives up after about a hundred attempts.
const LOCKED: &[(Fault, End)] = &[
    (Fault::once("lock", INDEX, EAGAIN).times(300), End::Succeeds),
    (
        Fault::once("lock", CATALOG, EAGAIN).times(300),
        End::Succeeds,
    ),
];

const RUN: FaultScenario = FaultScenario {
    before: |comparison, root| {
        copy(&comparison.fresh, &root.join("p"));
    },
    command: |root| run(&Project::at(&root.join("p")), &["-j", "1"]),
    after: |comparison, root, done| {
        mocban(root, &["-C", "p", "check"]).expect(0);
        let project = Project::at(&root.join("p"));
        if !done {
            call(&mut run(&project, &[])).expect(0);
            mocban(root, &["-C", "p", "check"]).expect(0);
        }
        comparison.expected.assert_met_by(&project);
    },
};

/// Returns the command that imports the data of a project into a new one.
fn import(root: &Path) -> Command {
    let mut command = binary();
    let (project, data) = (root.join("p"), root.join("p/data"));
    command.arg("-C").arg(project).arg("import");
    command.arg(data.join("manifest.csv"));
    command.arg("--truth").arg(data.join("truth.jsonl"));
    command
}

const IMPORT: FaultScenario = FaultScenario {
    before: |comparison, root| {
        copy_folder(&comparison.fresh.dir().join("data"), &root.join("p/data"));
    },
    command: import,
    after: |comparison, root, done| {
        let files = || -> Vec<_> {
            std::fs::read_dir(root.join("p"))
                .expect("a folder")
                .collect()
        };
        let project = Project::at(&root.join("p"));
        if !done {
            if project.catalog_path().exists() {
                // Only the sync of the folder failed, after the catalog was renamed.
                let summary = mocban(root, &["-C", "p", "check", "--json"]).expect(0);
                assert_eq!(summary.json()["pairs"], 1);
            } else {
                assert_eq!(files().len(), 1, "{:?}", files());
            }
            call(&mut import(root)).expect(0);
        }
        call(&mut run(&project, &[])).expect(0);
        comparison.expected.assert_met_by(&project);
    },
};

/// Returns the command that exports the completed project.
fn export(root: &Path) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p")).arg("export");
    command.arg("-o").arg(root.join("out"));
    command
}

const EXPORT: FaultScenario = FaultScenario {
    before: copy_completed,
    command: export,
    after: |comparison, root, done| {
        if !done {
            assert!(!root.join("out").exists());
        }
        call(&mut export(root)).expect(0);
        comparison.expected.assert_exported_to(&root.join("out"));
        let hidden = std::fs::read_dir(root).expect("a folder").count();
        assert_eq!(hidden, 2);
    },
};

/// Copies the completed project to a folder.
fn copy_completed(comparison: &Comparison, root: &Path) {
    copy(comparison.expected.project(), &root.join("p"));
}

/// Returns the command that writes a backup beside the project.
fn backup(root: &Path) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p")).arg("backup");
    command.arg(root.join("b.sqlite"));
    command
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).expect("a file")
}

const BACKUP: FaultScenario = FaultScenario {
    before: |comparison, root| {
        copy_completed(comparison, root);
        let settings = Project::at(&root.join("p")).settings_path();
        std::fs::write(&settings, "[run]\nworkers = 1\n").expect("written");
        call(&mut backup(root)).expect(0);
        std::fs::copy(root.join("b.sqlite"), root.join("earlier")).expect("copied");
        std::fs::write(&settings, "[run]\nworkers = 2\n").expect("written");
        let set = ["-C", "p", "verdict", "set", "upright-0000", "pass"];
        mocban(root, &[&set[..], &["--reviewer", "lan"]].concat()).expect(0);
    },
    command: backup,
    after: |_, root, done| {
        let is_earlier = || bytes(&root.join("b.sqlite")) == bytes(&root.join("earlier"));
        assert_ne!(is_earlier(), done);
        call(&mut backup(root)).expect(0);
        assert_eq!(names(root), ["b.sqlite", "earlier", "p"]);
        assert!(!is_earlier());
        mocban(root, &["restore", "b.sqlite", "q", "--inputs", "p"]).expect(0);
        let repair = ["-C", "q", "check", "--repair", "--accept-missing"];
        mocban(root, &repair).expect(0);
        let settings = ["p", "q"].map(|project| bytes(&root.join(project).join("mocban.toml")));
        assert!(settings[0] == settings[1]);
        let log = ["-C", "q", "verdict", "log", "--json"];
        let log = mocban(root, &log).expect(0).out;
        assert!(log.contains("lan"), "{log}");
    },
};

fn repair(root: &Path) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p"));
    command.args(["check", "--repair"]);
    command
}

fn check(root: &Path) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p")).arg("check");
    command
}

const CHECK: FaultScenario = FaultScenario {
    before: copy_completed,
    command: check,
    after: |_, root, _| {
        call(&mut check(root)).expect(0);
    },
};

const REPAIR: FaultScenario = FaultScenario {
    before: |comparison, root| {
        copy_completed(comparison, root);
        let folder = root.join("p/artifacts");
        let found = files(&folder);
        let mut pictures = found.keys().filter(|path| path.extension().is_some());
        let mut picture = || folder.join(pictures.next().expect("a picture"));
        std::fs::remove_file(picture()).expect("removed");
        std::fs::write(picture(), "another").expect("written");
        let orphan = format!("{}.png", "0".repeat(64));
        std::fs::create_dir_all(folder.join("00")).expect("a folder");
        std::fs::write(folder.join("00").join(orphan), "spare").expect("written");
    },
    command: repair,
    after: |comparison, root, done| {
        if !done {
            call(&mut repair(root)).expect(0);
        }
        let project = Project::at(&root.join("p"));
        mocban(root, &["-C", "p", "check"]).expect(0);
        call(&mut run(&project, &[])).expect(0);
        mocban(root, &["-C", "p", "check"]).expect(0);
        call(&mut export(root)).expect(0);
        comparison.expected.assert_exported_to(&root.join("out"));
    },
};

#[test]
fn a_disk_fault_of_the_catalog_is_reported_and_loses_nothing() {
    RUN.check_all(OF_THE_CATALOG, fault_points());
}

/// Without any room, the file that processes share beside the catalog cannot be made.
#[test]
fn a_disk_without_room_is_named_and_results_can_still_be_read() {
    let comparison = Comparison::new("1");
    let (root, notes) = (comparison.folder("full"), comparison.folder("notes"));
    copy_completed(&comparison, &root);
    let full = Fault::once("write", INDEX, ENOSPC).and_later();
    let on_full_disk = |args: &[&str]| {
        let mut command = binary();
        command.arg("-C").arg(root.join("p")).args(args);
        call(full.inject(1, &root, &notes, &mut command))
    };
    for args in [
        &["status"][..],
        &["report"],
        &["show", "upright-0000"],
        &["check"],
    ] {
        on_full_disk(args).expect(0);
    }
    assert!(Fault::injected(&notes) > 0);
    let set = ["verdict", "set", "upright-0000", "pass"];
    let refused = on_full_disk(&[&set[..], &["--reviewer", "lan"]].concat()).expect(1);
    assert!(
        refused
            .err
            .contains("because the disk is full; free some space"),
        "{}",
        refused.err
    );
}

#[test]
fn a_disk_fault_of_other_files_is_reported_and_loses_nothing() {
    RUN.check_all(OF_THE_FILES, fault_points());
}

#[test]
fn an_import_or_export_that_fails_on_the_disk_leaves_nothing_incomplete() {
    IMPORT.check_all(OF_AN_IMPORT, fault_points());
    EXPORT.check_all(OF_AN_EXPORT, fault_points());
}

#[test]
fn a_backup_that_fails_on_the_disk_leaves_the_earlier_one_in_place() {
    BACKUP.check_all(OF_A_BACKUP, fault_points());
}

#[test]
fn a_check_that_fails_on_the_disk_finds_no_damage() {
    CHECK.check_all(OF_A_CHECK, 4 * fault_points());
}

#[test]
fn a_repair_that_fails_on_the_disk_is_reported_and_done_by_the_next() {
    REPAIR.check_all(OF_A_REPAIR, fault_points());
}

/// Each lock of the database is refused for longer than SQLite itself waits.
#[test]
fn a_run_waits_for_a_locked_catalog() {
    RUN.check_all(LOCKED, 4 * fault_points());
}
