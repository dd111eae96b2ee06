//! What an unbroken run gives, to hold a broken one against it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mocban::domain::JobStatus;
use mocban::store::Project;

use crate::cli::{call, mocban};
use crate::resume::{copy, finished, pairs, project, results, run};

/// A project that has not run, and what an unbroken run of it gives.
pub(crate) struct World {
    pub(crate) dir: tempfile::TempDir,
    pub(crate) fresh: Project,
    pub(crate) wanted: Wanted,
}

impl World {
    /// With so many pairs.
    pub(crate) fn new(pairs: &str) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let fresh = project(dir.path(), "fresh", pairs);
        let wanted = Wanted::of(&fresh, &dir.path().join("unbroken"));
        Self { dir, fresh, wanted }
    }

    /// An empty folder of that name.
    pub(crate) fn folder(&self, name: &str) -> PathBuf {
        let folder = self.dir.path().join(name);
        if folder.exists() {
            std::fs::remove_dir_all(&folder).expect("removed");
        }
        std::fs::create_dir(&folder).expect("a folder");
        folder.canonicalize().expect("a folder")
    }
}

/// A project that ran without a break, and what it gave.
pub(crate) struct Wanted {
    project: Project,
    results: Vec<String>,
    told: BTreeMap<PathBuf, Vec<u8>>,
    artifacts: Vec<PathBuf>,
}

/// Every file below a folder, by its path in it.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(at) = open.pop() {
        for entry in std::fs::read_dir(at).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let inside = path.strip_prefix(folder).expect("below").to_owned();
                found.insert(inside, std::fs::read(path).expect("a file"));
            }
        }
    }
    found
}

/// Forms of the report that are compared.
const FORMS: [&str; 3] = ["csv", "json", "text"];

/// The report and the export of the project `p` in a folder, as bytes.
fn told(parent: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    mocban(parent, &["-C", "p", "export", "-o", "out"]).expect(0);
    let mut told = files(&parent.join("out"));
    for form in FORMS {
        let report = mocban(parent, &["-C", "p", "report", "-f", form]).expect(0);
        told.insert(PathBuf::from(form), report.out.into_bytes());
    }
    told
}

fn artifacts(project: &Project) -> Vec<PathBuf> {
    files(&project.artifacts_dir()).into_keys().collect()
}

impl Wanted {
    /// Runs a copy of the project without a break.
    pub(crate) fn of(fresh: &Project, parent: &Path) -> Self {
        let project = copy(fresh, &parent.join("p"));
        call(&mut run(&project, &[])).expect(0);
        Self {
            results: results(&project),
            told: told(parent),
            artifacts: artifacts(&project),
            project,
        }
    }

    /// The project that ran without a break.
    pub(crate) fn project(&self) -> &Project {
        &self.project
    }

    /// Holds a broken run's project, done at last, against the unbroken one's.
    pub(crate) fn is_met_by(&self, broken: &Project) {
        for pair in pairs(broken) {
            assert_eq!(pair.results.status, JobStatus::Done);
        }
        assert_eq!(results(broken), self.results);
        assert_eq!(finished(broken), finished(&self.project));
        assert!(finished(broken).iter().all(|times| *times == 1));
        assert_eq!(artifacts(broken), self.artifacts);
        let told = told(broken.dir().parent().expect("a folder"));
        assert!(told.keys().eq(self.told.keys()), "{:?}", told.keys());
        self.holds(&told);
    }

    /// Holds an export against that of the unbroken run.
    pub(crate) fn is_exported_to(&self, folder: &Path) {
        let exported = files(folder);
        assert_eq!(exported.len() + FORMS.len(), self.told.len());
        self.holds(&exported);
    }

    fn holds(&self, told: &BTreeMap<PathBuf, Vec<u8>>) {
        for (path, bytes) in told {
            assert!(*bytes == self.told[path], "{} differs", path.display());
        }
    }
}
