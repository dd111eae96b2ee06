//! The projects of the folder of the app, found once for a request that asks for several of them.

use std::path::{Path, PathBuf};

use super::failure::AppResult;
use super::project_name::new_project_dir;
use super::projects::{FoundProject, find};

/// The projects of a folder when they were found.
#[derive(Debug)]
pub(super) struct ProjectPlaces {
    folder: PathBuf,
    found: Vec<FoundProject>,
}

impl ProjectPlaces {
    /// Finds the projects of a folder. Reads the folder and those in it.
    pub(super) fn find(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            found: find(folder),
        }
    }

    /// Returns a project by its name.
    pub(super) fn named(&self, name: &str) -> Option<&FoundProject> {
        self.found.iter().find(|found| found.key == name)
    }

    /// Returns the project in a folder.
    pub(super) fn at(&self, dir: &Path) -> Option<&FoundProject> {
        self.found.iter().find(|found| found.dir == dir)
    }

    /// Returns the folder of a project, which need not exist.
    ///
    /// # Errors
    /// Refuses what cannot be the name of a new project.
    pub(super) fn dir(&self, name: &str) -> AppResult<PathBuf> {
        match self.named(name) {
            Some(found) => Ok(found.dir.clone()),
            None => new_project_dir(name, &self.folder),
        }
    }

    /// Returns the folder of a project, or a new one if its name is not valid.
    pub(super) fn dir_or_new(&self, name: &str) -> PathBuf {
        self.dir(name).unwrap_or_else(|_| self.folder.join("new"))
    }
}

#[cfg(test)]
mod tests {
    use super::ProjectPlaces;
    use mocban_store::CATALOG_FILE;

    #[test]
    fn a_known_project_has_its_folder_and_a_new_one_gets_one() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let folder = dir.path().join("a/b");
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join(CATALOG_FILE), "").expect("written");
        let places = ProjectPlaces::find(dir.path());
        assert_eq!(places.dir("a/b").expect("a project"), folder);
        assert_eq!(places.at(&folder), places.named("a/b"));
        assert!(places.named("a/b").is_some() && places.named("c").is_none());
        let new = places.dir(" c ").expect("a name");
        assert_eq!(new, dir.path().join("c"));
        assert_eq!(places.at(&new), None);
        places.dir("a/c").expect_err("no name of a project");
        assert_eq!(places.dir_or_new("a/c"), dir.path().join("new"));
    }
}
