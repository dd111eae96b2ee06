//! Atomic and durable writes: a file is written in a staging folder, synced, and renamed.

use std::fs::{File, Metadata};
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use std::time::SystemTime;

use super::parent_folder::{parent_folder, sync_folder};
use super::staging::StagingFolder;
use mocban_system::platform::{canonicalize, rename, sync_file};

/// Name of the new file in its staging folder.
const NEW: &str = "new";

/// Writes a file atomically: an existing file is replaced only after the new content is on the disk. If two processes
/// write the same file, the complete file of the last process stays. If `path` is not a regular file, such as a pipe or
/// a terminal, writes to it directly.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // A symbolic link stays; its target is replaced.
    let path = match canonicalize(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => path.to_owned(),
        found => found?,
    };
    if metadata(&path)?.is_some_and(|meta| !meta.is_file()) {
        return std::fs::write(path, bytes);
    }
    let staging = StagingFolder::beside(&path)?;
    let partial = staging.path().join(NEW);
    File::create(&partial)?.write_all(bytes)?;
    rename_into_place(&partial, &path)
}

/// Writes a new file and syncs its content to the disk. Does not sync the folder, so the name may be lost in a crash.
///
/// # Errors
/// Returns an error if the file exists or cannot be written. A partly written file is not removed.
pub fn write_synced(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Returns the metadata of a file, or `None` if it does not exist.
fn metadata(path: &Path) -> std::io::Result<Option<Metadata>> {
    match std::fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        found => found.map(Some),
    }
}

/// Renames a written file durably: syncs the file, renames it, and syncs the folder. If `path` exists, the new file
/// gets the permissions of the old one.
///
/// # Errors
/// Returns an error if syncing, renaming or setting the permissions fails. If syncing the folder fails, the file is
/// already renamed, and the message says that it is complete.
pub fn rename_into_place(partial: &Path, path: &Path) -> std::io::Result<()> {
    sync_file(partial)?;
    if let Some(earlier) = metadata(path)? {
        std::fs::set_permissions(partial, earlier.permissions())?;
    }
    rename(partial, path)?;
    sync_name(path)
}

/// Makes the new name of a file durable.
fn sync_name(path: &Path) -> std::io::Result<()> {
    sync_folder(&parent_folder(path)).map_err(|error| {
        let text = format!("the file is complete, but the disk did not confirm its name: {error}");
        std::io::Error::new(error.kind(), text)
    })
}

/// Syncs a complete file and gives it its final name, unless that name is taken. Returns whether the file was renamed.
///
/// # Errors
/// Returns an error if the file system does, or if the new name may not survive a power cut.
pub fn place_new_file(partial: &Path, path: &Path) -> std::io::Result<bool> {
    sync_file(partial)?;
    match tempfile::TempPath::try_from_path(partial)?.persist_noclobber(path) {
        Ok(()) => {}
        Err(refused) if refused.error.kind() == std::io::ErrorKind::AlreadyExists => {
            return Ok(false);
        }
        Err(refused) => return Err(refused.error),
    }
    sync_name(path)?;
    Ok(true)
}

/// Sets the time of change of a file to the present, so that it is not removed as an old unreferenced file. Returns
/// whether this succeeded.
pub(super) fn set_modified_now(path: &Path) -> bool {
    let file = File::options().append(true).open(path);
    file.and_then(|file| file.set_modified(SystemTime::now()))
        .is_ok()
}

#[cfg(test)]
mod tests {
    use super::write_atomic;

    #[test]
    fn the_earlier_file_stays_until_the_new_one_is_complete() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("report.txt");
        write_atomic(&path, b"one").expect("written");
        assert_eq!(std::fs::read(&path).expect("read"), b"one");
        write_atomic(&path, b"two").expect("written");
        assert_eq!(std::fs::read(&path).expect("read"), b"two");
        assert_eq!(std::fs::read_dir(dir.path()).expect("listed").count(), 1);
    }

    #[test]
    fn writers_of_the_same_file_never_disturb_each_other() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("report.txt");
        let texts = ["one", "two", "three", "four"].map(|word| word.repeat(100_000));
        std::thread::scope(|scope| {
            for text in &texts {
                scope.spawn(|| {
                    for _ in 0..50 {
                        write_atomic(&path, text.as_bytes()).expect("written");
                        let found = std::fs::read_to_string(&path).expect("read");
                        assert!(texts.contains(&found), "{} bytes", found.len());
                    }
                });
            }
        });
        assert_eq!(std::fs::read_dir(dir.path()).expect("listed").count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_name_of_the_greatest_length_can_be_written() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        write_atomic(&dir.path().join("a".repeat(255)), b"one").expect("written");
        let refused = write_atomic(&dir.path().join("a".repeat(256)), b"one");
        let error = refused.expect_err("no such file can exist").to_string();
        assert!(error.contains("name too long"), "{error}");
    }

    #[cfg(unix)]
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
