//! Files and folders that the command line names.

use std::path::{Path, PathBuf};

use super::exit::Refusal;

/// Reads a file that was named.
///
/// # Errors
/// When it cannot be read: the command line is wrong then.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Refusal> {
    std::fs::read(path).map_err(|error| refused("read", path, &error))
}

/// Lists a folder that was named.
///
/// # Errors
/// When it cannot be listed.
pub(super) fn list(dir: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let refuse = |error: std::io::Error| refused("list", dir, &error);
    let entries = std::fs::read_dir(dir).map_err(refuse)?;
    entries
        .map(|entry| Ok(entry.map_err(refuse)?.path()))
        .collect()
}

fn refused(deed: &str, path: &Path, error: &std::io::Error) -> Refusal {
    Refusal::Usage(format!("cannot {deed} {}: {error}", path.display()))
}
