//! The project directory: the paths of its catalog, settings, artifacts and inputs.

use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::create_folders::create_folders;
use super::parent_folder::{parent_folder, sync_folder};
use super::remote::ProjectStorage;
use mocban_core::domain::{ARTIFACTS, CATALOG_FILE, ErrorCode, Explained};
use mocban_system::platform::{FileId, stat};

/// Name of the settings file in a project.
pub const SETTINGS_FILE: &str = "mocban.toml";

/// A project directory.
#[derive(Debug, Clone)]
pub struct Project {
    dir: PathBuf,
    /// Identity of the directory when it was opened. `None` if the project may not exist yet.
    identity: Option<FileId>,
    /// Named roots of inputs, and an object store for artifacts, if the settings name any.
    storage: Option<Arc<ProjectStorage>>,
}

/// Why a project's directory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The directory holds no catalog.
    #[error("no project at {0}: it has no {CATALOG_FILE}")]
    NoProject(PathBuf),
    /// A file is where the project's directory should be.
    #[error("{0} is a file; name the folder of a project")]
    NotAFolder(PathBuf),
    /// A path that the catalog cannot store.
    #[error("path {0:?} is not UTF-8, so the catalog cannot store it; rename the file or folder")]
    NotUtf8(PathBuf),
    /// A file operation failed.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl Explained for StoreError {
    fn code(&self) -> ErrorCode {
        match self {
            Self::NoProject(_) => ErrorCode::NoProject,
            Self::NotAFolder(_) | Self::NotUtf8(_) => ErrorCode::Usage,
            Self::Io { .. } => ErrorCode::Unexpected,
        }
    }
}

impl StoreError {
    pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

impl Project {
    /// Opens an existing project.
    ///
    /// # Errors
    /// Returns an error if the directory holds no catalog.
    pub fn open(dir: &Path) -> Result<Self, StoreError> {
        // The content of the file is checked when the catalog is opened.
        let catalog = dir.join(CATALOG_FILE);
        if dir.is_file() {
            return Err(StoreError::NotAFolder(dir.to_owned()));
        }
        if !catalog.try_exists().map_err(StoreError::io(&catalog))? {
            return Err(StoreError::NoProject(dir.to_owned()));
        }
        Self::open_directory(dir)
    }

    /// Opens a project whose catalog is not a file in its directory.
    ///
    /// # Errors
    /// Returns an error if there is no such directory.
    pub fn open_directory(dir: &Path) -> Result<Self, StoreError> {
        let found = stat(dir).map_err(StoreError::io(dir))?;
        Ok(Self {
            dir: dir.to_owned(),
            identity: Some(found.id),
            storage: None,
        })
    }

    /// Returns a project that may not exist yet; touches no file.
    pub fn at(dir: &Path) -> Self {
        Self {
            dir: dir.to_owned(),
            identity: None,
            storage: None,
        }
    }

    /// Returns whether the directory is still at its path. If not, nothing may be created at that path.
    pub(super) fn is_in_place(&self) -> std::io::Result<bool> {
        let Some(identity) = self.identity else {
            return Ok(true);
        };
        match stat(&self.dir) {
            Ok(found) => Ok(found.id == identity),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Creates the project directory durably if it is missing. `Catalog::create` creates the catalog.
    pub fn create(dir: &Path) -> Result<Self, StoreError> {
        let missing: Vec<_> = dir.ancestors().take_while(|dir| !dir.exists()).collect();
        create_folders(dir).map_err(StoreError::io(dir))?;
        for created in missing {
            let folder = parent_folder(created);
            sync_folder(&folder).map_err(StoreError::io(&folder))?;
        }
        Self::open_directory(dir)
    }

    /// Returns the directory.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Returns the path of the catalog.
    pub fn catalog_path(&self) -> PathBuf {
        self.dir.join(CATALOG_FILE)
    }

    /// Returns the path of the settings file, which need not exist.
    pub fn settings_path(&self) -> PathBuf {
        self.dir.join(SETTINGS_FILE)
    }

    /// Returns the folder of the artifacts.
    pub fn artifacts_dir(&self) -> PathBuf {
        self.dir.join(ARTIFACTS)
    }

    /// Returns the project with named roots of inputs and an object store for artifacts.
    #[must_use]
    pub fn with_storage(self, storage: Option<ProjectStorage>) -> Self {
        Self {
            storage: storage.map(Arc::new),
            ..self
        }
    }

    /// Returns the named roots and the object store.
    pub fn storage(&self) -> Option<&ProjectStorage> {
        self.storage.as_deref()
    }

    pub(super) const fn storage_arc(&self) -> Option<&Arc<ProjectStorage>> {
        self.storage.as_ref()
    }

    /// Looks for a moved input below `folder`: first at its whole stored path, then without its first folder, and so on
    /// down to its file name. Returns the first existing path in the form in which it is stored.
    ///
    /// # Errors
    /// Returns an error if a path cannot be looked up for another reason than that it does not exist, the working directory
    /// is unknown, or the path is not UTF-8.
    pub fn find_input(&self, stored: &str, folder: &Path) -> Result<Option<String>, StoreError> {
        let parts = Path::new(stored).components();
        let parts = parts.filter(|part| matches!(part, Component::Normal(_)));
        let parts: Vec<_> = parts.collect();
        for first in 0..parts.len() {
            let path = folder.join(PathBuf::from_iter(&parts[first..]));
            if exists(&path).map_err(StoreError::io(&path))? {
                return self.stored_path(&path).map(Some);
            }
        }
        Ok(None)
    }
}

/// Returns whether a path exists. A path below a file, and one that no folder can hold, do not.
fn exists(path: &Path) -> std::io::Result<bool> {
    use std::io::ErrorKind::{InvalidFilename, NotADirectory, NotFound};
    match std::fs::metadata(path) {
        Err(error) if matches!(error.kind(), InvalidFilename | NotADirectory | NotFound) => {
            Ok(false)
        }
        found => found.map(|_| true),
    }
}

#[cfg(test)]
mod tests {
    use super::{Project, StoreError};

    #[test]
    fn a_moved_input_is_found_by_the_end_of_its_path() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(&dir.path().join("project")).expect("a project");
        let folder = project.dir().join("moved");
        std::fs::create_dir_all(folder.join("b")).expect("a folder");
        std::fs::write(folder.join("b/1.stl"), "x").expect("written");
        let find = |stored: &str| project.find_input(stored, &folder).expect("looked up");
        assert_eq!(find("/old/b/1.stl").as_deref(), Some("moved/b/1.stl"));
        for missing in ["/old/c/1.stl", "1.stl/2.stl", &"n".repeat(300)] {
            assert_eq!(find(missing), None);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_cannot_be_read_is_not_a_missing_input() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let folder = dir.path().join("moved");
        std::fs::create_dir(&folder).expect("a folder");
        // Also fails for root, unlike a folder without permissions.
        std::os::unix::fs::symlink("b", folder.join("b")).expect("a link to itself");
        let error = project.find_input("/old/b/1.stl", &folder);
        let text = error.expect_err("not readable").to_string();
        assert!(text.contains("moved/b/1.stl: "), "{text}");
    }

    #[test]
    fn a_directory_without_a_catalog_is_no_project() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let outcome = Project::open(dir.path());
        assert!(matches!(outcome, Err(StoreError::NoProject(_))));
    }
}
