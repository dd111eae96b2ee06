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
