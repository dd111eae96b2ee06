//! What identifies the content of an input file.

use serde::Serialize;

use super::ContentHash;

/// The content of an input file when it was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputVersion {
    /// Hash of its bytes.
    pub hash: ContentHash,
    /// Size, modification time and inode of the file when it was opened, as text.
    pub stat: String,
}

/// The `stat` of a missing file.
const GONE: &str = "gone";

impl InputVersion {
    /// The `stat` that the catalog writes for a file that was read at another path, before a backup was restored.
    pub const RESTORED: &str = "restored";

    /// Returns the version of a file that is missing, so that a later run finds out when it is there.
    pub fn gone() -> Self {
        Self {
            hash: ContentHash::of(b""),
            stat: GONE.to_owned(),
        }
    }

    /// Returns whether the file was read at another path only: the size and time of the file at its new path are unknown.
    pub fn has_new_path(&self) -> bool {
        self.stat.is_empty() || self.stat == Self::RESTORED
    }

    /// Returns whether the file was missing.
    pub fn is_gone(&self) -> bool {
        self.stat == GONE
    }
}
