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
    /// Where it is in an object store. `None` for a file of its own in the project's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pack: Option<PackLocation>,
}

/// Position of an artifact in a pack, an object that holds the artifacts of a pair.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackLocation {
    /// Name of the pack.
    pub name: String,
    /// Position of the artifact's first byte.
    pub offset: u64,
}

/// Artifacts of one stage by role, such as `depth.png` or `canvas_depth_mask.nl_ssim.png`.
pub type ArtifactSet = BTreeMap<String, ArtifactRef>;
