//! The folder that holds the name of a file or folder.

use std::path::{Path, PathBuf};

use mocban_system::platform::{open_folder, sync_names};

/// Returns the folder that holds the name of a file or folder.
pub(super) fn parent_folder(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// Makes the names in a folder durable.
pub(super) fn sync_folder(folder: &Path) -> std::io::Result<()> {
    sync_names(&open_folder(folder)?)
}
