//! Names of files that stages leave behind: by content, so that the same bytes are one file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::ContentHash;

/// One artifact: its content hash, its ending and its length.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArtifactRef {
    /// Hash of the bytes; also the file's name.
    pub hash: ContentHash,
    /// Ending of the file name without the dot, such as `png`.
    pub ext: String,
    /// Length in bytes.
    pub bytes: u64,
}

/// Artifacts of one stage by role, such as `depth.png` or `canvas_depth_mask.nl_ssim.png`.
pub type ArtifactSet = BTreeMap<String, ArtifactRef>;
