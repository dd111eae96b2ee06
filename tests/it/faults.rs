//! Faults of the disk under the real binary: what fails says so in a sentence and leaves nothing half-made, and the
//! next call ends as if nothing had been. `MOCBAN_FAULT_MOMENTS` says at how many calls each strikes: 24 take minutes.

use std::path::Path;
use std::process::Command;

use mocban::store::Project;

use crate::cli::{Call, binary, call, mocban};
use crate::fault::{EAGAIN, EIO, ENOSPC, Fault, spread};
use crate::resume::{copy, copy_folder, run};
use crate::sizes::asked;
use crate::unbroken::World;

/// How a command under a fault must end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// With an error.
    Refused,
    /// As if nothing had been.
    Unmoved,
    /// Either, by the moment at which it strikes.
    Either,
}

const WAL: &str = "p/catalog.sqlite-wal";
const INDEX: &str = "p/catalog.sqlite-shm";
const CATALOG: &str = "p/catalog.sqlite";
const TEMPORARY: &str = "p/artifacts/tmp/*";
const PLACED: &str = "p/artifacts/??/*";

/// The catalog's faults in a run.
const OF_THE_CATALOG: &[(Fault, End)] = &[
    (Fault::once("write", WAL, ENOSPC), End::Refused),
    (Fault::once("write", WAL, EIO).on(), End::Refused),
    (Fault::half(WAL), End::Unmoved),
    (
        Fault::once("write", WAL, ENOSPC).on().half_first(),
        End::Refused,
    ),
    (Fault::once("sync", WAL, EIO), End::Either),
    (Fault::once("sync", WAL, EIO).on(), End::Either),
    (Fault::once("open", WAL, EIO), End::Either),
    (Fault::once("unlink", WAL, EIO), End::Unmoved),
    (Fault::once("truncate", WAL, EIO), End::Unmoved),
    (Fault::once("write", CATALOG, EIO), End::Unmoved),
    (Fault::once("write", CATALOG, ENOSPC).on(), End::Unmoved),
    (Fault::once("sync", CATALOG, EIO), End::Unmoved),
    (Fault::once("read", CATALOG, EIO), End::Refused),
    (Fault::once("open", CATALOG, EIO), End::Either),
    (Fault::once("open", INDEX, EIO), End::Refused),
    (Fault::once("write", INDEX, ENOSPC), End::Refused),
];

/// The faults of everything else that a run writes.
const OF_THE_FILES: &[(Fault, End)] = &[
    (Fault::once("open", TEMPORARY, ENOSPC), End::Refused),
    (Fault::once("write", TEMPORARY, ENOSPC), End::Refused),
    (Fault::half(TEMPORARY), End::Unmoved),
    (
        Fault::once("write", TEMPORARY, ENOSPC).on().half_first(),
        End::Refused,
    ),
    (Fault::once("sync", TEMPORARY, EIO), End::Refused),
    (Fault::once("rename", PLACED, EIO), End::Refused),
    (Fault::once("rename", PLACED, ENOSPC).on(), End::Refused),
    (Fault::once("sync", "p/artifacts/??", EIO), End::Refused),
    (Fault::once("sync", "p/artifacts", EIO), End::Refused),
    (Fault::once("mkdir", "p/artifacts*", ENOSPC), End::Refused),
    (Fault::once("truncate", "p/run.*", EIO), End::Refused),
    (Fault::once("write", "p/run.*", ENOSPC), End::Refused),
    (Fault::once("open", "p/run.*", EIO), End::Refused),
    (Fault::once("open", "p/data/*", EIO), End::Either),
    (Fault::once("write", "*", ENOSPC).on(), End::Either),
    (Fault::once("sync", "*", EIO).on(), End::Either),
    (Fault::slow("sync", "*", 5), End::Unmoved),
];

/// Faults of an import into a new project.
const OF_AN_IMPORT: &[(Fault, End)] = &[
    (Fault::once("open", "p/catalog.sqlite*", EIO), End::Either),
    (
        Fault::once("write", "p/catalog.sqlite*", ENOSPC),
        End::Either,
    ),
    (Fault::once("write", "*", ENOSPC).on(), End::Either),
    (Fault::half("p/catalog.sqlite*"), End::Unmoved),
    (Fault::once("sync", "*", EIO), End::Either),
    (Fault::once("sync", "*", EIO).on(), End::Either),
];

/// Faults of an export.
const OF_AN_EXPORT: &[(Fault, End)] = &[
    (Fault::once("open", ".out*", ENOSPC), End::Refused),
    (Fault::once("write", ".out*", ENOSPC), End::Refused),
    (Fault::once("write", "*", EIO).on(), End::Refused),
    (Fault::half(".out*"), End::Unmoved),
    (Fault::once("mkdir", ".out*", ENOSPC), End::Refused),
    (Fault::once("rename", "out", EIO), End::Refused),
];

/// Locks that are not to be had for so many tries: SQLite gives up after about a hundred.
const LOCKED: &[(Fault, End)] = &[
    (Fault::once("lock", INDEX, EAGAIN).times(300), End::Unmoved),
    (
        Fault::once("lock", CATALOG, EAGAIN).times(300),
        End::Unmoved,
    ),
];

/// Something that is done while the disk refuses.
struct Deed {
    /// Puts what it needs in a folder.
    before: fn(&World, &Path),
    /// The command, to be called in that folder.
    command: fn(&Path) -> Command,
    /// Looks whether all is as it must be after it, and goes on to the end; told whether it said that it was done.
    after: fn(&World, &Path, bool),
}

impl Deed {
    /// How many calls of the kind it makes when nothing fails.
    fn calls(&self, world: &World, fault: &Fault) -> usize {
        let (root, notes) = (world.folder("counted"), world.folder("notes"));
        (self.before)(world, &root);
        call(fault.strike(0, &root, &notes, &mut (self.command)(&root))).expect(0);
        let calls = Fault::calls(&notes);
        assert!(calls > 0, "{fault}: there is no such call");
        calls
    }

    /// Does it under a fault at the n-th call, and then again without. Gives the exit code; `None` when there were
    /// not so many calls this time.
    fn survives(&self, world: &World, fault: &Fault, nth: usize, end: End) -> Option<i32> {
        let (root, notes) = (world.folder("struck"), world.folder("notes"));
        (self.before)(world, &root);
        let told = call(fault.strike(nth, &root, &notes, &mut (self.command)(&root)));
        if Fault::struck(&notes) == 0 {
            return None;
        }
        let at = format!("{fault}, call {nth}: code {}, {}", told.code, told.err);
        is_said(&told, end, &root, &at);
        (self.after)(world, &root, told.code == 0);
        Some(told.code)
    }

    /// Strikes with each fault at so many of the calls it could strike.
    #[expect(clippy::print_stderr, reason = "the figures of the long test")]
    fn survives_all(&self, faults: &[(Fault, End)], moments: usize) {
        let world = World::new("1");
        for (fault, end) in faults {
            let calls = self.calls(&world, fault);
            let chosen = spread(calls, moments);
            let codes: Vec<_> = (chosen.iter())
                .map(|nth| self.survives(&world, fault, *nth, *end))
                .collect();
            let struck = codes.iter().flatten().count();
            assert!(struck > 0, "{fault}: nothing was struck");
            let refused = codes.iter().flatten().filter(|code| **code != 0).count();
            eprintln!("{fault}: {struck} of {calls} calls struck, {refused} refused");
        }
    }
}

/// It ended as it must, and an error is one sentence with its file and its reason.
fn is_said(told: &Call, end: End, root: &Path, at: &str) {
    match end {
        End::Refused => assert_ne!(told.code, 0, "{at}"),
        End::Unmoved => assert_eq!(told.code, 0, "{at}"),
        End::Either => {}
    }
    assert!(!told.err.contains("panicked"), "{at}");
    if told.code == 0 {
        return;
    }
    assert_eq!(told.code, 1, "{at}");
    // A warning, or a line of the log, is no error.
    let told = told.err.lines();
    let mut lines = told.filter(|line| !line.starts_with("warning: ") && !line.contains(" WARN "));
    let error = lines.next().unwrap_or_default();
    assert_eq!(lines.next(), None, "{at}");
    assert!(error.starts_with("error: "), "{at}");
    assert!(error.contains(&format!("{}/", root.display())), "{at}");
    let reasons = [
        "disk is full",
        "disk refused",
        "disk refuses",
        "disk cannot read",
        "cannot be written to",
        "No space left",
        "Input/output error",
    ];
    assert!(reasons.iter().any(|reason| error.contains(reason)), "{at}");
}

const RUN: Deed = Deed {
    before: |world, root| {
        copy(&world.fresh, &root.join("p"));
    },
    command: |root| run(&Project::at(&root.join("p")), &["-j", "1"]),
    after: |world, root, done| {
        mocban(root, &["-C", "p", "check"]).expect(0);
        let project = Project::at(&root.join("p"));
        if !done {
            call(&mut run(&project, &[])).expect(0);
            mocban(root, &["-C", "p", "check"]).expect(0);
        }
        world.wanted.is_met_by(&project);
    },
};

/// Imports the data of a project into a new one.
fn import(root: &Path) -> Command {
    let mut command = binary();
    let (project, data) = (root.join("p"), root.join("p/data"));
    command.arg("-C").arg(project).arg("import");
    command.arg(data.join("manifest.csv"));
    command.arg("--truth").arg(data.join("truth.jsonl"));
    command
}

const IMPORT: Deed = Deed {
    before: |world, root| {
        copy_folder(&world.fresh.dir().join("data"), &root.join("p/data"));
    },
    command: import,
    after: |world, root, done| {
        let files = || -> Vec<_> {
            std::fs::read_dir(root.join("p"))
                .expect("a folder")
                .collect()
        };
        if !done {
            assert_eq!(files().len(), 1, "{:?}", files());
            call(&mut import(root)).expect(0);
        }
        let project = Project::at(&root.join("p"));
        call(&mut run(&project, &[])).expect(0);
        world.wanted.is_met_by(&project);
    },
};

/// Exports the project that ran without a break.
fn export(root: &Path) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p")).arg("export");
    command.arg("-o").arg(root.join("out"));
    command
}

const EXPORT: Deed = Deed {
    before: |world, root| {
        copy(world.wanted.project(), &root.join("p"));
    },
    command: export,
    after: |world, root, done| {
        if !done {
            assert!(!root.join("out").exists());
        }
        call(&mut export(root)).expect(0);
        world.wanted.is_exported_to(&root.join("out"));
        let hidden = std::fs::read_dir(root).expect("a folder").count();
        assert_eq!(hidden, 2);
    },
};

/// Moments at which each fault strikes, evenly over all there are.
fn moments() -> usize {
    asked("MOCBAN_FAULT_MOMENTS", 1)
}

#[test]
fn a_refusing_disk_under_the_catalog_is_told_of_and_costs_nothing() {
    RUN.survives_all(OF_THE_CATALOG, moments());
}

#[test]
fn a_refusing_disk_under_the_files_is_told_of_and_costs_nothing() {
    RUN.survives_all(OF_THE_FILES, moments());
}

#[test]
fn an_import_or_export_that_the_disk_refuses_leaves_nothing_half_made() {
    IMPORT.survives_all(OF_AN_IMPORT, moments());
    EXPORT.survives_all(OF_AN_EXPORT, moments());
}

/// Another process holds each lock of the database for longer than SQLite itself waits.
#[test]
fn a_locked_catalog_is_waited_for() {
    RUN.survives_all(LOCKED, 4 * moments());
}
