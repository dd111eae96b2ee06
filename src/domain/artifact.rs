//! References to artifacts, the files that stages produce. A file is named by its hash, so equal files are stored once.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::ContentHash;

/// Reference to one artifact: content hash, extension and length.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArtifactRef {
    /// Hash of the bytes, which is also the file name.
    pub hash: ContentHash,
    /// File extension without the dot, such as `png`.
    pub ext: String,
    /// Length in bytes.
    pub bytes: u64,
}

/// Artifacts of one stage by role, such as `depth.png` or `canvas_depth_mask.nl_ssim.png`.
pub type ArtifactSet = BTreeMap<String, ArtifactRef>;
