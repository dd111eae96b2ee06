//! The projects of a folder.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::failure::{AppFailure, AppResult};
use super::moved_blocks::MovedFiles;
use crate::local_server::WorkThread;
use crate::on_thread::on_thread;
use mocban_catalog::Catalog;
use mocban_config::Loaded;
use mocban_project::location::Location;
use mocban_store::{CATALOG_FILE, Project, SETTINGS_FILE};
use mocban_system::platform;

/// Maximum number of entries that are read in a folder.
const MAX_ENTRIES: usize = 10_000;
/// How deep projects are searched below the folder.
const MAX_DEPTH: usize = 2;

/// A project of the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FoundProject {
    /// Name in addresses: the path below the folder, or the name of the folder if it is the project.
    pub(super) key: String,
    pub(super) dir: PathBuf,
}

/// A project with its catalog, opened for reading.
#[derive(Debug)]
pub(super) struct OpenProject {
    pub(super) key: String,
    pub(super) dir: PathBuf,
    pub(super) project: Project,
    pub(super) catalog: Catalog,
    /// Whether this user may store verdicts in the catalog.
    pub(super) may_store: bool,
    /// Versions of the files of blocks that an import moved.
    pub(super) moved_files: Arc<MovedFiles>,
    /// Reads results for reports; started by the first one.
    reports: OnceLock<WorkThread>,
    /// Identity of the catalog's file, which changes if the project is made anew.
    file: Option<platform::FileId>,
}

/// Returns the identity of the catalog's file.
fn catalog_file(dir: &Path) -> Option<platform::FileId> {
    let file = platform::stat(&dir.join(CATALOG_FILE));
    file.ok().map(|stat| stat.id)
}

impl OpenProject {
    /// Returns whether the project is still there, with the catalog that was opened.
    pub(super) fn is_current(&self) -> bool {
        // A project whose catalog is on a server has no file of it.
        catalog_file(&self.dir) == self.file && (self.file.is_some() || self.dir.is_dir())
    }

    /// Returns whether another one has the same catalog.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.dir == other.dir && self.file == other.file
    }

    /// Returns the folder with its current settings, which are read again for each use.
    pub(super) fn location(&self) -> Location {
        Location::new(&self.dir)
    }

    /// Returns its current settings.
    pub(super) fn settings(&self) -> AppResult<Loaded> {
        let settings = self.location().settings();
        settings.map_err(|error| AppFailure::of(error, &self.dir))
    }
}

/// Returns whether a folder is a project: it has a catalog, or settings that name one on a server.
pub(super) fn is_project(dir: &Path) -> bool {
    dir.join(CATALOG_FILE).is_file()
        || dir.join(SETTINGS_FILE).is_file()
            && matches!(Location::new(dir).catalog_url(), Ok(Some(_)))
}

/// Returns the projects of a folder by name: the folder itself, or those in it.
pub(super) fn find(folder: &Path) -> Vec<FoundProject> {
    if is_project(folder) {
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = whole.file_name().unwrap_or_default().to_string_lossy();
        return vec![FoundProject {
            key: if name.is_empty() {
                "project".to_owned()
            } else {
                name.into_owned()
            },
            dir: folder.to_owned(),
        }];
    }
    let mut found = Vec::new();
    search(folder, "", MAX_DEPTH, &mut found);
    found.sort_by(|a: &FoundProject, b| a.key.cmp(&b.key));
    found
}

/// Adds the projects below a folder. Hidden folders are left out.
fn search(folder: &Path, prefix: &str, depth: usize, found: &mut Vec<FoundProject>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    for entry in entries.take(MAX_ENTRIES).flatten() {
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        let dir = entry.path();
        if name.starts_with('.') || !dir.is_dir() {
            continue;
        }
        let key = format!("{prefix}{name}");
        if is_project(&dir) {
            found.push(FoundProject { key, dir });
        } else if depth > 1 {
            search(&dir, &format!("{key}/"), depth - 1, found);
        }
    }
}

impl OpenProject {
    /// Opens a project that was found.
    pub(super) async fn open(found: FoundProject) -> AppResult<Arc<Self>> {
        let file = catalog_file(&found.dir);
        let dir = found.dir.clone();
        let open = async move || {
            let (project, catalog) = Location::new(dir).open_read_only().await?;
            let rights = catalog.review_rights().await?;
            Ok((project, catalog, rights))
        };
        let opened = on_thread(open).await;
        let (project, catalog, rights) =
            opened.map_err(|error| AppFailure::of(error, &found.dir))?;
        Ok(Arc::new(Self {
            key: found.key,
            dir: found.dir,
            project,
            catalog,
            may_store: rights.may_store(),
            moved_files: Arc::default(),
            reports: OnceLock::new(),
            file,
        }))
    }

    /// Returns the thread that reads results for reports. A project whose server does not answer stops no other one.
    pub(super) fn reports(&self) -> &WorkThread {
        self.reports.get_or_init(WorkThread::default)
    }
}

#[cfg(test)]
mod tests {
    use super::find;
    use mocban_store::CATALOG_FILE;

    #[test]
    fn projects_are_found_in_folders_and_a_project_is_alone() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for name in ["b", "a/c", ".hidden", "x/y/z"] {
            let folder = dir.path().join(name);
            std::fs::create_dir_all(&folder).expect("a folder");
            std::fs::write(folder.join(CATALOG_FILE), "").expect("written");
        }
        std::fs::create_dir(dir.path().join("empty")).expect("a folder");
        let keys = |folder| find(folder).into_iter().map(|found| found.key);
        assert_eq!(keys(dir.path()).collect::<Vec<_>>(), ["a/c", "b"]);
        let one = dir.path().join("b");
        assert_eq!(keys(&one).collect::<Vec<_>>(), ["b"]);
    }
}
