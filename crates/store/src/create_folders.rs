//! Creates folders.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;

/// Creates a folder and its parents, like [`fs::create_dir_all`].
///
/// # Errors
/// Returns an error if a folder cannot be created. If one exists but cannot be inspected, the error is the reason for that,
/// and not that it exists.
pub fn create_folders(path: impl AsRef<Path>) -> io::Result<()> {
    let path = path.as_ref();
    match fs::create_dir_all(path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            let cause = |folder| fs::metadata(folder).err();
            let mut causes = path.ancestors().filter_map(cause);
            match causes.find(|cause| cause.kind() != ErrorKind::NotFound) {
                Some(cause) => Err(cause),
                // The disk works again, or a file is in the way.
                None => fs::create_dir_all(path),
            }
        }
        outcome => outcome,
    }
}

#[cfg(test)]
mod tests {
    use super::create_folders;
    use std::io::ErrorKind;

    #[test]
    fn folders_are_created_once_and_a_file_is_in_the_way() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("a/b");
        for _ in 0..2 {
            create_folders(&path).expect("a folder");
        }
        let file = path.join("file");
        std::fs::write(&file, "").expect("a file");
        let refused = create_folders(&file).expect_err("a file");
        assert_eq!(refused.kind(), ErrorKind::AlreadyExists);
        assert!(create_folders(file.join("c")).is_err());
    }
}
