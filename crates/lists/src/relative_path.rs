//! Relative paths of files as browsers and archives name them, which must be safe on every system.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mocban_core::domain::spelling::{composed, fold_case};
use mocban_core::domain::{is_device, is_hidden, sanitize};

/// Longest name of a file or folder, in bytes. File systems allow 255.
const MAX_NAME_BYTES: usize = 200;
/// Longest path, in bytes.
const MAX_PATH_BYTES: usize = 1000;
/// Most names in a path.
const MAX_PARTS: usize = 20;
/// Characters that a name on Windows may not have.
const FORBIDDEN: &str = "\\:\"*<>?|";
/// Folders that hold no scans and prints of their own.
pub const SYSTEM_FOLDERS: [&str; 2] = ["__MACOSX", "@eaDir"];
/// Longest path in a message, in characters.
const MAX_SHOWN: usize = 120;

/// Why a path is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PathFault {
    /// A part is empty, `.` or `..`, so the path leads elsewhere.
    #[error("it leads to another folder")]
    Outside,
    /// A name or the path is too long.
    #[error("its name is too long")]
    TooLong,
    /// The path has too many folders.
    #[error("it is in more than {} folders", MAX_PARTS - 1)]
    TooDeep,
    /// A name has a character that another system does not allow.
    #[error("its name has {0:?}")]
    Character(char),
    /// A name begins or ends with a space, or ends with a dot.
    #[error("its name begins or ends with a space or a dot")]
    Ends,
    /// A name is that of a device on Windows.
    #[error("its name is that of a device on Windows")]
    Device,
    /// There is such a file already.
    #[error("this file is there twice")]
    Twice,
    /// A file and a folder have the same name.
    #[error("{} is both a file and a folder", sanitize(.0, MAX_SHOWN))]
    Folder(String),
    /// Another name differs only in case.
    #[error("its name differs from {} only in upper and lower case", sanitize(.0, MAX_SHOWN))]
    Similar(String),
}

/// A path below a folder: names in composed letters (NFC) with slashes between them.
///
/// ```
/// use mocban_lists::relative_path::{PathFault, RelativePath};
///
/// let path = RelativePath::new("ván 4/chữ 1.stl").expect("a path");
/// assert_eq!(path.as_str(), "ván 4/chữ 1.stl");
/// assert_eq!(RelativePath::new("../1.stl"), Err(PathFault::Outside));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RelativePath(String);

impl RelativePath {
    /// Checks a path and converts it to NFC.
    ///
    /// # Errors
    /// Returns an error if the path leads elsewhere, or a file of this name cannot be stored on every system.
    pub fn new(text: &str) -> Result<Self, PathFault> {
        let text = composed(text).into_owned();
        if text.len() > MAX_PATH_BYTES {
            return Err(PathFault::TooLong);
        }
        text.split('/').try_for_each(check_name)?;
        if text.split('/').count() > MAX_PARTS {
            return Err(PathFault::TooDeep);
        }
        Ok(Self(text))
    }

    /// Returns the path with slashes.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns the path below a folder.
    pub fn below(&self, folder: &Path) -> PathBuf {
        folder.join(self.0.split('/').collect::<PathBuf>())
    }

    /// Returns the path of a file in the folder of this one.
    ///
    /// # Errors
    /// Returns an error like [`Self::new`].
    pub fn beside(&self, name: &str) -> Result<Self, PathFault> {
        match self.0.rsplit_once('/') {
            Some((folder, _)) => Self::new(&format!("{folder}/{name}")),
            None => Self::new(name),
        }
    }

    /// Returns whether this is a hidden file, or one that a system keeps for itself.
    pub fn is_of_system(&self) -> bool {
        is_of_system(&self.0)
    }

    /// Returns the extension in lower case.
    pub fn extension(&self) -> Option<String> {
        extension_of(&self.0)
    }
}

/// Returns whether a path with slashes, which may be refused, is hidden or that of a file that a system keeps for itself.
pub fn is_of_system(path: &str) -> bool {
    // Such as `..` and `..\a`, which are not hidden but lead elsewhere.
    let is_unsafe = |name: &str| matches!(name, "." | "..") || name.contains('\\');
    let is_hidden = |name: &str| name.starts_with('.') && !is_unsafe(name);
    let mut names = path.split('/');
    names.any(|name| is_hidden(name) || SYSTEM_FOLDERS.contains(&name))
}

/// Returns the extension of a path in lower case. The path may be one that is refused.
pub fn extension_of(path: &str) -> Option<String> {
    let extension = Path::new(path).extension()?.to_str()?;
    Some(extension.to_ascii_lowercase())
}

fn check_name(name: &str) -> Result<(), PathFault> {
    let is_bad = |c: &char| is_hidden(*c) || FORBIDDEN.contains(*c);
    match name {
        "" | "." | ".." => Err(PathFault::Outside),
        _ if name.len() > MAX_NAME_BYTES => Err(PathFault::TooLong),
        _ if name.trim() != name || name.ends_with('.') => Err(PathFault::Ends),
        _ if is_device(name) => Err(PathFault::Device),
        _ => name
            .chars()
            .find(is_bad)
            .map_or(Ok(()), |bad| Err(PathFault::Character(bad))),
    }
}

/// The paths of files that were stored together, as systems compare them that ignore case.
#[derive(Debug, Default)]
pub struct TakenPaths(BTreeMap<String, TakenPath>);

#[derive(Debug)]
struct TakenPath {
    path: String,
    is_file: bool,
}

impl TakenPaths {
    /// Adds the path of a file, and its folders.
    ///
    /// # Errors
    /// Returns an error if the file is there, a folder has its name, or a name differs only in case.
    pub fn insert(&mut self, path: &RelativePath) -> Result<(), PathFault> {
        let text = path.as_str();
        let ends = text.match_indices('/').map(|(end, _)| end);
        for end in ends.chain([text.len()]) {
            let (part, is_file) = (&text[..end], end == text.len());
            let folded = fold_case(part);
            match self.0.get(&folded) {
                Some(taken) if taken.path != part => {
                    return Err(PathFault::Similar(taken.path.clone()));
                }
                Some(taken) if is_file && taken.is_file => return Err(PathFault::Twice),
                Some(taken) if is_file || taken.is_file => {
                    return Err(PathFault::Folder(taken.path.clone()));
                }
                Some(_) => {}
                None => {
                    let path = part.to_owned();
                    self.0.insert(folded, TakenPath { path, is_file });
                }
            }
        }
        Ok(())
    }

    /// Returns the number of files and folders.
    pub fn count(&self) -> usize {
        self.0.len()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{PathFault, RelativePath, TakenPaths};

    #[test]
    fn paths_that_lead_elsewhere_or_cannot_be_stored_everywhere_are_refused() {
        for (path, fault) in [
            ("", PathFault::Outside),
            ("/etc/passwd", PathFault::Outside),
            ("../1.stl", PathFault::Outside),
            ("a/../../1.stl", PathFault::Outside),
            ("a/./1.stl", PathFault::Outside),
            ("a//1.stl", PathFault::Outside),
            ("a/", PathFault::Outside),
            ("..\\1.stl", PathFault::Character('\\')),
            ("C:1.stl", PathFault::Character(':')),
            ("C:\\1.stl", PathFault::Character(':')),
            ("1.stl:stream", PathFault::Character(':')),
            ("1\0.stl", PathFault::Character('\0')),
            ("1\n.stl", PathFault::Character('\n')),
            ("a\u{202e}lts.exe", PathFault::Character('\u{202e}')),
            ("a?.stl", PathFault::Character('?')),
            ("a /1.stl", PathFault::Ends),
            ("1.stl.", PathFault::Ends),
            ("NUL", PathFault::Device),
            ("scans/con.stl", PathFault::Device),
            ("Lpt1.stl", PathFault::Device),
        ] {
            assert_eq!(RelativePath::new(path), Err(fault), "{path:?}");
        }
        for long in [
            "a".repeat(201),
            ["a".repeat(150), String::new()].join("/").repeat(7) + "a",
        ] {
            assert_eq!(RelativePath::new(&long), Err(PathFault::TooLong));
        }
        RelativePath::new(&("a/".repeat(19) + "1.stl")).expect("not too deep");
        let deep = RelativePath::new(&("a/".repeat(20) + "1.stl"));
        assert_eq!(deep, Err(PathFault::TooDeep));
    }

    #[test]
    fn names_of_any_script_are_kept_in_composed_letters() {
        let path = RelativePath::new("va\u{301}n 4/chu\u{31b}\u{303} 明.STL").expect("a path");
        assert_eq!(path.as_str(), "ván 4/chữ 明.STL");
        assert_eq!(path.extension().as_deref(), Some("stl"));
        assert_eq!(path.below(Path::new("x")), Path::new("x/ván 4/chữ 明.STL"));
        let beside = path.beside("b/2.stl").expect("a path");
        assert_eq!(beside.as_str(), "ván 4/b/2.stl");
        assert_eq!(path.beside("../2.stl"), Err(PathFault::Outside));
        for (path, is_of_system) in [
            ("a/._1.stl", true),
            ("__MACOSX/1.stl", true),
            (".git/1.stl", true),
            ("a.b/1.stl", false),
        ] {
            let path = RelativePath::new(path).expect("a path");
            assert_eq!(path.is_of_system(), is_of_system, "{path:?}");
        }
        assert!(super::is_of_system("__MACOSX/._Icon\r"), "a refused name");
        for path in ["../1.stl", "a/../1.stl", "..\\1.stl"] {
            assert!(!super::is_of_system(path), "{path:?} leads elsewhere");
        }
    }

    #[test]
    fn names_that_differ_in_case_only_are_refused() {
        let mut taken = TakenPaths::default();
        let mut insert = |path: &str| taken.insert(&RelativePath::new(path).expect("a path"));
        insert("Ván/1.stl").expect("new");
        insert("Ván/2.stl").expect("new");
        assert_eq!(insert("Ván/1.stl"), Err(PathFault::Twice));
        for (path, other) in [("Ván/1.STL", "Ván/1.stl"), ("ván/3.stl", "Ván")] {
            assert_eq!(insert(path), Err(PathFault::Similar(other.to_owned())));
        }
        for (path, other) in [("Ván", "Ván"), ("Ván/1.stl/x.stl", "Ván/1.stl")] {
            assert_eq!(insert(path), Err(PathFault::Folder(other.to_owned())));
        }
        assert_eq!(taken.count(), 3, "a folder and two files");
    }
}
