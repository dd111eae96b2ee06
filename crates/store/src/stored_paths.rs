//! The form in which the paths of inputs are stored.

use std::cell::OnceCell;
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use super::project::{Project, StoreError};
use mocban_system::platform::with_slashes;

/// Maximum number of folders that are remembered.
const MAX_FOLDERS: usize = 1_000;

/// Converts paths to the form in which they are stored. What was found out about a folder counts for all its files, because a
/// list may name millions of them.
#[derive(Debug)]
pub struct StoredPaths<'p> {
    project: &'p Project,
    /// Absolute path of the project's directory.
    dir: PathBuf,
    /// The same after links are resolved, or `None` if it does not exist. Looked up when it is first needed.
    resolved_dir: OnceCell<Option<PathBuf>>,
    /// Folders as they are written.
    folders: HashMap<PathBuf, InputFolder>,
}

/// Where a folder of inputs is.
#[derive(Debug, Clone)]
struct InputFolder {
    absolute: PathBuf,
    /// Relative to the project after links are resolved, or `None` if it does not exist or is not below the project.
    below_project: Option<PathBuf>,
}

impl<'p> StoredPaths<'p> {
    /// Begins with no folder.
    ///
    /// # Errors
    /// Returns an error if the working directory is unknown.
    pub fn new(project: &'p Project) -> Result<Self, StoreError> {
        let dir = project.dir();
        Ok(Self {
            project,
            dir: plain_absolute(dir).map_err(StoreError::io(dir))?,
            resolved_dir: OnceCell::new(),
            folders: HashMap::new(),
        })
    }

    /// Returns the form in which a path is stored. A path below a named root is stored relative to the root, and so is
    /// a path that already has this form, such as `scans:1/mesh.obj`. A path below the project is stored relative to
    /// the project, so that the project can be moved with its data. Any other path is stored as absolute. A file has the
    /// same form however its folders are written, such as `lists/../scans/1.stl`. The file need not exist.
    ///
    /// # Errors
    /// Returns an error if the working directory is unknown, or the path is not UTF-8.
    pub fn stored(&mut self, path: &Path) -> Result<String, StoreError> {
        if let Some(text) = path.to_str()
            && self.project.is_below_root(text)
        {
            return Ok(text.to_owned());
        }
        let (absolute, below_project) = self.places(path).map_err(StoreError::io(path))?;
        let storage = self.project.storage();
        if let Some(below) = storage.and_then(|storage| storage.path_below_root(&absolute)) {
            return Ok(with_slashes(below));
        }
        let stored = below_project.unwrap_or(absolute);
        match stored.to_str() {
            Some(text) if stored.is_relative() => Ok(with_slashes(text.to_owned())),
            Some(text) => Ok(text.to_owned()),
            None => Err(StoreError::NotUtf8(stored)),
        }
    }

    /// Returns the absolute path of a file, and its path relative to the project if it is below the project.
    fn places(&mut self, path: &Path) -> std::io::Result<(PathBuf, Option<PathBuf>)> {
        let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
            let absolute = plain_absolute(path)?;
            let below = self.below_project(&absolute);
            return Ok((absolute, below));
        };
        if !self.folders.contains_key(folder) {
            if self.folders.len() == MAX_FOLDERS {
                self.folders.clear();
            }
            let absolute = plain_absolute(&Path::new(".").join(folder))?;
            let below_project = self.below_project(&absolute);
            let found = InputFolder {
                absolute,
                below_project,
            };
            self.folders.insert(folder.to_owned(), found);
        }
        let found = &self.folders[folder];
        let absolute = found.absolute.join(name);
        let below = found.below_project.as_ref();
        let mut below = below.map(|folder| folder.join(name));
        // A link may lead into the project.
        if below.is_none() && absolute.is_symlink() {
            below = self.below_project(&absolute);
        }
        Ok((absolute, below))
    }

    /// Returns an absolute path relative to the project. Links are resolved if its text is not below the project.
    fn below_project(&self, absolute: &Path) -> Option<PathBuf> {
        if let Ok(below) = absolute.strip_prefix(&self.dir) {
            return Some(below.to_owned());
        }
        let resolved_dir = self
            .resolved_dir
            .get_or_init(|| self.dir.canonicalize().ok());
        let resolved = absolute.canonicalize().ok()?;
        let below = resolved.strip_prefix(resolved_dir.as_ref()?).ok()?;
        Some(below.to_owned())
    }
}

impl Project {
    /// Returns the form in which a path is stored, as [`StoredPaths::stored`] does.
    ///
    /// # Errors
    /// Returns an error if the working directory is unknown, or the path is not UTF-8.
    pub fn stored_path(&self, path: &Path) -> Result<String, StoreError> {
        StoredPaths::new(self)?.stored(path)
    }
}

/// Returns an absolute path without `..` and the folder before it, unless this folder is a link, which may lead elsewhere.
fn plain_absolute(path: &Path) -> std::io::Result<PathBuf> {
    let mut plain = PathBuf::new();
    for part in std::path::absolute(path)?.components() {
        if part == Component::ParentDir && plain.file_name().is_some() && !plain.is_symlink() {
            plain.pop();
        } else {
            plain.push(part);
        }
    }
    Ok(plain)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::StoredPaths;
    use crate::Project;

    #[test]
    fn a_file_is_stored_under_one_path_however_its_folders_are_written() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(&dir.path().join("project")).expect("a project");
        let mut paths = StoredPaths::new(&project).expect("a folder");
        let mut stored = |path: &str| paths.stored(&dir.path().join(path)).expect("a path");
        assert_eq!(stored("lists/../scans/./1.stl"), stored("scans/1.stl"));
        assert_eq!(stored("a/b/../../scans/1.stl"), stored("scans/1.stl"));
        assert_eq!(stored("lists/../project/data/1.stl"), "data/1.stl");
        assert_eq!(stored("project/1.stl"), "1.stl");
        let project = Project::at(&dir.path().join("lists/../project"));
        let inside = project.stored_path(&dir.path().join("project/data/1.stl"));
        assert_eq!(inside.expect("a path"), "data/1.stl");
    }

    #[test]
    fn a_relative_path_is_below_the_working_directory() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let mut paths = StoredPaths::new(&project).expect("a folder");
        let here = std::env::current_dir().expect("a directory");
        for path in ["no such file.stl", "./no such file.stl", "no/such.stl"] {
            let stored = paths.stored(Path::new(path)).expect("a path");
            assert_eq!(Path::new(&stored), here.join(path.trim_start_matches("./")));
        }
    }

    #[cfg(unix)]
    #[test]
    fn the_folder_above_a_link_is_that_of_its_target() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(&dir.path().join("project")).expect("a project");
        std::fs::create_dir_all(dir.path().join("disk/lists")).expect("folders");
        std::os::unix::fs::symlink("disk/lists", dir.path().join("lists")).expect("a link");
        let path = dir.path().join("lists/../1.stl");
        let stored = project.stored_path(&path).expect("a path");
        assert_eq!(Path::new(&stored), path);
    }

    #[cfg(unix)]
    #[test]
    fn files_that_links_lead_to_are_stored_relative_to_the_project() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(&dir.path().join("project")).expect("a project");
        std::fs::create_dir(project.dir().join("data")).expect("a folder");
        std::fs::write(project.dir().join("data/1.stl"), "scan").expect("written");
        let link = |target: &str, name: &str| {
            std::os::unix::fs::symlink(target, dir.path().join(name)).expect("a link");
        };
        link("project/data", "folder");
        link("project/data/1.stl", "2.stl");
        link("elsewhere.stl", "3.stl");
        let mut paths = StoredPaths::new(&project).expect("a folder");
        for (written, expected) in [
            ("folder/1.stl", Some("data/1.stl")),
            // Nothing changes when the file is added.
            ("folder/later.stl", Some("data/later.stl")),
            ("2.stl", Some("data/1.stl")),
            ("3.stl", None),
            ("4.stl", None),
        ] {
            let path = dir.path().join(written);
            let expected = expected.map_or_else(|| path.clone(), Into::into);
            let stored = paths.stored(&path).expect("a path");
            assert_eq!(Path::new(&stored), expected, "{written}");
        }
    }

    #[test]
    fn a_file_below_the_project_is_stored_relative_to_it() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(&dir.path().join("project")).expect("a project");
        let inside = project.dir().join("data/1.stl");
        let stored = project.stored_path(&inside).expect("a path");
        assert_eq!(stored, "data/1.stl");
        assert_eq!(project.input_path(&stored), inside);
        let outside = dir.path().join("scans/1.stl");
        let stored = project.stored_path(&outside).expect("a path");
        assert_eq!(Path::new(&stored), outside);
        assert_eq!(project.input_path(&stored), outside);
    }
}
