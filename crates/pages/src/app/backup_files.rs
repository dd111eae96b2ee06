//! The backups in the folder of the app.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use super::folder_picker::{holds_results, is_named_like_backup};
use mocban_core::domain::UnixMillis;
use mocban_project::backup_content::written;
use mocban_project::files::is_backup;

/// The folder of backups in a project.
pub(super) const BACKUPS: &str = "backups";
/// How deep backups are searched below the folder of the app.
const MAX_DEPTH: usize = 3;
/// Most entries of all folders that are looked at.
const MAX_ENTRIES: usize = 20_000;
/// Most backups that are found.
const MAX_BACKUPS: usize = 50;

/// A backup below the folder of the app.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FoundBackup {
    pub(super) path: PathBuf,
    /// Its length.
    pub(super) bytes: u64,
    /// When it was last written.
    pub(super) written: Option<UnixMillis>,
}

/// Returns the backups below a folder, the newest first. Looks into few folders below it, and first into those of backups.
pub(super) fn backups_below(folder: &Path) -> Vec<FoundBackup> {
    let (mut found, mut budget) = (Vec::new(), MAX_ENTRIES);
    let mut open = VecDeque::from([(folder.to_owned(), MAX_DEPTH)]);
    'folders: while let Some((folder, depth)) = open.pop_front() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            if budget == 0 || found.len() >= MAX_BACKUPS {
                break 'folders;
            }
            budget -= 1;
            let (name, path) = (entry.file_name(), entry.path());
            if name.as_encoded_bytes().starts_with(b".") {
                continue;
            }
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            if is_folder && depth > 0 && name == BACKUPS {
                open.push_front((path, depth - 1));
            } else if is_folder && depth > 1 && !holds_results(&folder, &path) {
                open.push_back((path, depth - 1));
            } else if !is_folder && is_named_like_backup(&path) {
                found.extend(backup_at(path));
            }
        }
    }
    found.sort_by(|a, b| b.written.cmp(&a.written).then_with(|| a.path.cmp(&b.path)));
    found
}

/// Returns a file if it is a backup.
fn backup_at(path: PathBuf) -> Option<FoundBackup> {
    let meta = std::fs::metadata(&path).ok()?;
    is_backup(&path).ok()?.then(|| FoundBackup {
        bytes: meta.len(),
        written: written(&meta),
        path,
    })
}

#[cfg(test)]
mod tests {
    use super::backups_below;

    #[test]
    fn backups_are_found_by_their_names_and_first_bytes() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let mut head = b"SQLite format 3\0".to_vec();
        head.resize(68, 0);
        head.extend_from_slice(b"mocb");
        for (path, is_one) in [
            ("blocks.sqlite", true),
            ("p/backups/backup.sqlite", true),
            ("a/b/c/deep.sqlite", false),
            ("p/catalog.sqlite", false),
            ("p/artifacts/00/x.sqlite", false),
            (".hidden/x.sqlite", false),
            ("notes.sqlite", false),
        ] {
            let path = dir.path().join(path);
            let folder = path.parent().expect("a folder");
            std::fs::create_dir_all(folder).expect("a folder");
            let is_text = path.ends_with("notes.sqlite");
            let bytes: &[u8] = if is_text { b"text" } else { &head };
            std::fs::write(&path, bytes).expect("written");
            let found = backups_below(dir.path());
            let is_found = found.iter().any(|found| found.path == path);
            assert_eq!(is_found, is_one, "{}", path.display());
        }
    }
}
