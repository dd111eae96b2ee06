//! Paths that are written differently.

use std::path::{Component, Path, PathBuf};

/// Returns a path without `.`, and without `..` and the folder before it. Links are not followed, so that equal results
/// are the same file unless such a folder is a link.
///
/// ```
/// use mocban_core::domain::plain_path;
/// use std::path::Path;
///
/// assert_eq!(plain_path(Path::new("lists/../scans/./1.stl")), Path::new("scans/1.stl"));
/// assert_eq!(plain_path(Path::new("../scans/1.stl")), Path::new("../scans/1.stl"));
/// ```
pub fn plain_path(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}
