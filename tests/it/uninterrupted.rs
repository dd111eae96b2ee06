//! The results of an uninterrupted run, to be compared with those of an interrupted run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mocban::domain::JobStatus;
use mocban::store::Project;

use crate::cli::{call, mocban};
use crate::resume::{attempts, copy, pairs, project, results, run};

/// A project that has not run, and the expected results of its run.
pub(crate) struct Comparison {
    pub(crate) dir: tempfile::TempDir,
    pub(crate) fresh: Project,
    pub(crate) expected: Expected,
}

impl Comparison {
    /// Creates a project with this number of pairs.
    pub(crate) fn new(pairs: &str) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let fresh = project(dir.path(), "fresh", pairs);
        let expected = Expected::of(&fresh, &dir.path().join("uninterrupted"));
        Self {
            dir,
            fresh,
            expected,
        }
    }

    /// Creates an empty folder of this name.
    pub(crate) fn folder(&self, name: &str) -> PathBuf {
        let folder = self.dir.path().join(name);
        if folder.exists() {
            std::fs::remove_dir_all(&folder).expect("removed");
        }
        std::fs::create_dir(&folder).expect("a folder");
        folder.canonicalize().expect("a folder")
    }
}

/// A project after an uninterrupted run, and its results.
pub(crate) struct Expected {
    project: Project,
    results: Vec<String>,
    /// Export and report, by path.
    output: BTreeMap<PathBuf, Vec<u8>>,
    artifacts: Vec<PathBuf>,
}

/// Returns the content of every file below a folder, by path relative to the folder.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(at).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let relative = path.strip_prefix(folder).expect("below").to_owned();
                found.insert(relative, std::fs::read(path).expect("a file"));
            }
        }
    }
    found
}

/// Checks that two folders have the same files. Returns their number.
#[track_caller]
pub(crate) fn assert_same_files(one: &Path, other: &Path) -> usize {
    let (one, other) = (files(one), files(other));
    let differing = (one.iter()).filter(|(path, bytes)| other.get(*path) != Some(bytes));
    let differing: Vec<_> = differing.map(|(path, _)| path).collect();
    assert!(
        one.len() == other.len() && differing.is_empty(),
        "{differing:?} differ"
    );
    one.len()
}

/// The format of the report that is compared: it has all of the numbers.
const REPORT: &str = "json";

/// Returns the export and the report of the project `p` in a folder.
fn output(parent: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    mocban(parent, &["-C", "p", "export", "-o", "out"]).expect(0);
    let mut output = files(&parent.join("out"));
    let report = mocban(parent, &["-C", "p", "report", "-f", REPORT]).expect(0);
    output.insert(PathBuf::from(REPORT), report.out.into_bytes());
    output
}

fn artifacts(project: &Project) -> Vec<PathBuf> {
    files(&project.artifacts_dir()).into_keys().collect()
}

impl Expected {
    /// Runs a copy of a project without interruption.
    pub(crate) fn of(fresh: &Project, parent: &Path) -> Self {
        let project = copy(fresh, &parent.join("p"));
        call(&mut run(&project, &[])).expect(0);
        Self {
            results: results(&project),
            output: output(parent),
            artifacts: artifacts(&project),
            project,
        }
    }

    /// Returns the project that ran without interruption.
    pub(crate) fn project(&self) -> &Project {
        &self.project
    }

    /// Asserts that a project has the same results after its interrupted run was completed.
    pub(crate) fn assert_met_by(&self, resumed: &Project) {
        for pair in pairs(resumed) {
            assert_eq!(pair.results.status, JobStatus::Done);
        }
        assert_eq!(results(resumed), self.results);
        assert_eq!(attempts(resumed), attempts(&self.project));
        assert!(attempts(resumed).iter().all(|count| *count == 1));
        assert_eq!(artifacts(resumed), self.artifacts);
        let output = output(resumed.dir().parent().expect("a folder"));
        assert!(output.keys().eq(self.output.keys()), "{:?}", output.keys());
        self.assert_equal(&output);
    }

    /// Asserts that an export is the same as that of the uninterrupted run.
    pub(crate) fn assert_exported_to(&self, folder: &Path) {
        let exported = files(folder);
        assert_eq!(exported.len() + 1, self.output.len());
        self.assert_equal(&exported);
    }

    fn assert_equal(&self, output: &BTreeMap<PathBuf, Vec<u8>>) {
        for (path, bytes) in output {
            assert!(*bytes == self.output[path], "{} differs", path.display());
        }
    }
}
