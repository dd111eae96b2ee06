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
    /// Returns the version of a file that is missing, so that a later run finds out when it is there.
    pub fn gone() -> Self {
        Self {
            hash: ContentHash::of(b""),
            stat: GONE.to_owned(),
        }
    }

    /// Returns whether the file was missing.
    pub fn is_gone(&self) -> bool {
        self.stat == GONE
    }
}
