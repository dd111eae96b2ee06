//! The files of the cache of objects, of which the oldest are removed.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Copies are removed until this fraction of the space is free again.
const FREE_SHARE: f64 = 0.1;

/// A file of the cache.
pub(super) struct CacheFile {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    used: SystemTime,
}

impl CacheFile {
    fn of(path: &Path) -> Option<Self> {
        let meta = std::fs::metadata(path).ok()?;
        Some(Self {
            path: path.to_owned(),
            bytes: meta.len(),
            used: meta.modified().ok()?,
        })
    }
}

/// Removes the copies that were not used for the longest time. Returns the length of the others.
pub(super) fn remove_oldest(folder: &Path, max_bytes: u64) -> u64 {
    let mut files = list(folder);
    files.sort_by_key(|file| file.used);
    let mut total: u64 = files.iter().map(|file| file.bytes).sum();
    let wanted = (max_bytes as f64 * (1.0 - FREE_SHARE)) as u64;
    for file in files {
        if total <= wanted {
            break;
        }
        // Another process may have removed it. A file that another process reads stays readable.
        if std::fs::remove_file(&file.path).is_ok() {
            total = total.saturating_sub(file.bytes);
        }
    }
    total
}

/// Returns all files of the cache.
pub(super) fn list(folder: &Path) -> Vec<CacheFile> {
    let folders = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let inside = folders.flat_map(|entry| match std::fs::read_dir(entry.path()) {
        Ok(entries) => entries.flatten().map(|entry| entry.path()).collect(),
        Err(error) if error.kind() == ErrorKind::NotADirectory => vec![entry.path()],
        Err(_) => Vec::new(),
    });
    inside.filter_map(|path| CacheFile::of(&path)).collect()
}
