//! An export of all formats that is killed, or whose disk is full, leaves the earlier export whole, and the next one is
//! the same as without the interruption.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mocban::export::ExportFormat;
use mocban::store::Project;

use crate::backup::files as names;
use crate::check::{at, done};
use crate::cli::{binary, call};
use crate::export_readback::every_format;
use crate::fault::{ENOSPC, Fault};
use crate::uninterrupted::files;

/// Files of each format, whose writes are interrupted.
const FILES: [&str; 11] = [
    ".out.*/new/jsonl/pairs/*",
    ".out.*/new/csv/pairs.csv",
    ".out.*/new/csv/matrices.csv",
    ".out.*/new/parquet/pairs.parquet",
    ".out.*/new/huggingface/data/*",
    ".out.*/new/webdataset/*.tar",
    ".out.*/new/mesh/pairs/*/scan.glb",
    ".out.*/new/fiji/pairs/*/stack.tif",
    ".out.*/new/annotations/coco.json",
    ".out.*/new/viewer/pairs/*/viewer.html",
    ".out.*/new/export.json",
];

#[test]
fn writes_of_every_format_are_interrupted() {
    for format in ExportFormat::ALL {
        let folder = format!(".out.*/new/{format}/");
        let is_listed = FILES.iter().any(|path| path.starts_with(&folder));
        assert!(is_listed, "no file of {format}");
    }
}

/// How long an interrupted write takes, in milliseconds: until the process is killed.
const UNTIL_KILLED: u32 = 600_000;

/// A project with an earlier export in all formats, whose next export differs.
struct EarlierExport {
    dir: tempfile::TempDir,
    root: PathBuf,
    before: BTreeMap<PathBuf, Vec<u8>>,
    names: Vec<String>,
}

impl EarlierExport {
    fn create() -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let root = dir.path().join("root");
        std::fs::create_dir(&root).expect("a folder");
        let root = root.canonicalize().expect("a folder");
        let project = done(&root);
        call(&mut export(&root, "out")).expect(0);
        let set = [
            "verdict",
            "set",
            "upright-0001",
            "fail",
            "--reviewer",
            "minh",
        ];
        at(&project, &set).expect(0);
        let before = files(&root.join("out"));
        let names = names(&root);
        Self {
            dir,
            root,
            before,
            names,
        }
    }

    /// Returns an empty folder for the notes of a fault.
    fn notes(&self) -> PathBuf {
        let notes = self.dir.path().join("notes");
        if notes.exists() {
            std::fs::remove_dir_all(&notes).expect("removed");
        }
        std::fs::create_dir(&notes).expect("a folder");
        notes
    }

    fn assert_kept(&self, after: &str) {
        assert!(files(&self.root.join("out")) == self.before, "{after}");
    }

    /// Asserts that an export without interruption replaces the earlier one and leaves nothing else.
    fn assert_replaced_by_the_next(&self) {
        call(&mut export(&self.root, "../expected")).expect(0);
        call(&mut export(&self.root, "out")).expect(0);
        let found = files(&self.root.join("out"));
        assert!(found == files(&self.dir.path().join("expected")));
        assert!(found != self.before);
        assert_eq!(names(&self.root), self.names);
    }
}

/// Returns the command that exports the project `p` in all formats, with pictures in all of them.
fn export(root: &Path, out: &str) -> Command {
    let mut command = binary();
    let project = Project::at(&root.join("p"));
    command.arg("-C").arg(project.dir());
    command.args(["export", "--to", &every_format(), "--images", "-o"]);
    command.arg(root.join(out));
    command
}

#[test]
fn an_export_on_a_full_disk_keeps_the_earlier_one() {
    let earlier = EarlierExport::create();
    for path in FILES {
        let notes = earlier.notes();
        let full = Fault::once("write", path, ENOSPC).and_later();
        let mut command = export(&earlier.root, "out");
        let failed = call(full.inject(1, &earlier.root, &notes, &mut command)).expect(1);
        assert!(Fault::injected(&notes) > 0, "{path} is not written");
        let name = path.rsplit(['/', '*']).next().expect("a name");
        let is_named = failed.err.contains("disk is full") || failed.err.contains("No space left");
        assert!(
            is_named && failed.err.contains(name),
            "{path}: {}",
            failed.err
        );
        earlier.assert_kept(path);
        assert_eq!(names(&earlier.root), earlier.names, "{path}");
    }
    earlier.assert_replaced_by_the_next();
}

#[test]
fn an_export_that_is_killed_keeps_the_earlier_one() {
    let earlier = EarlierExport::create();
    for path in FILES {
        let notes = earlier.notes();
        let held = Fault::slow("write", path, UNTIL_KILLED);
        let mut command = export(&earlier.root, "out");
        let command = held.inject(1, &earlier.root, &notes, &mut command);
        let mut child = (command.stdout(Stdio::null()).stderr(Stdio::null()))
            .spawn()
            .expect("the binary starts");
        crate::waiting::until(&mut child, || Fault::injected(&notes) > 0);
        child.kill().expect("killed");
        child.wait().expect("a child");
        earlier.assert_kept(path);
        assert!(names(&earlier.root).len() > earlier.names.len(), "{path}");
    }
    earlier.assert_replaced_by_the_next();
}
