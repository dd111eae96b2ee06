//! Atomic and durable writes: a file is written under a temporary name, synced, and renamed.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Writes a file atomically: an existing file is replaced only after the new content is on the disk. If `path` is not a
/// regular file, such as a pipe or a terminal, writes to it directly.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // A symbolic link stays; its target is replaced.
    let path = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if path.exists() && !path.is_file() {
        return std::fs::write(path, bytes);
    }
    let partial = partial_path(&path);
    let written = File::create(&partial)
        .and_then(|mut file| file.write_all(bytes))
        .and_then(|()| rename_into_place(&partial, &path));
    if written.is_err() {
        // A partial file that cannot be removed does no harm.
        let _ = std::fs::remove_file(&partial);
    }
    written
}

/// Writes a file and syncs its content to the disk. Does not sync the folder, so the name may be lost in a crash.
///
/// # Errors
/// Returns an error if the file cannot be written. A partly written file is not removed.
pub fn write_synced(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Returns the temporary path for writing a file. It has a hidden name in the same folder.
pub fn partial_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.mocban-partial"))
}

/// Renames a written file durably: syncs the file, renames it, and syncs the folder. If `path` exists, the new file
/// gets the permissions of the old one.
///
/// # Errors
/// Returns an error if syncing, renaming or setting the permissions fails.
pub fn rename_into_place(partial: &Path, path: &Path) -> std::io::Result<()> {
    File::open(partial)?.sync_all()?;
    if let Ok(earlier) = std::fs::metadata(path) {
        std::fs::set_permissions(partial, earlier.permissions())?;
    }
    std::fs::rename(partial, path)?;
    sync_folder(&parent_folder(path))
}

/// Returns the folder that holds the name of a file or folder.
pub(super) fn parent_folder(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// Makes the names in a folder durable.
pub(super) fn sync_folder(folder: &Path) -> std::io::Result<()> {
    File::open(folder)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::{partial_path, write_atomic};

    #[test]
    fn the_earlier_file_stays_until_the_new_one_is_complete() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("report.txt");
        write_atomic(&path, b"one").expect("written");
        // A folder at the temporary path makes the write fail.
        std::fs::create_dir(partial_path(&path)).expect("a folder");
        assert!(write_atomic(&path, b"two").is_err());
        assert_eq!(std::fs::read(&path).expect("read"), b"one");
        std::fs::remove_dir(partial_path(&path)).expect("removed");
        write_atomic(&path, b"two").expect("written");
        assert_eq!(std::fs::read(&path).expect("read"), b"two");
        assert_eq!(std::fs::read_dir(dir.path()).expect("listed").count(), 1);
    }

    #[test]
    fn a_link_stays_a_link_and_a_device_is_written_to_directly() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (path, link) = (dir.path().join("a.txt"), dir.path().join("link.txt"));
        std::fs::write(&path, "one").expect("written");
        std::os::unix::fs::symlink(&path, &link).expect("a link");
        write_atomic(&link, b"two").expect("written");
        assert_eq!(std::fs::read(&path).expect("read"), b"two");
        assert!(link.is_symlink());
        write_atomic(std::path::Path::new("/dev/null"), b"x").expect("written");
    }
}
