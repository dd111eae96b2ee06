//! References to artifacts, the files that stages produce. A file is named by its hash, so equal files are stored once.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::ContentHash;

/// Name of the folder of artifacts in a project.
pub const ARTIFACTS: &str = "artifacts";

/// Reference to one artifact: content hash, extension and length.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArtifactRef {
    /// Hash of the bytes, which is also the file name.
    pub hash: ContentHash,
    /// File extension without the dot, such as `png`.
    pub ext: String,
    /// Length in bytes.
    pub bytes: u64,
    /// Its pack in an object store. `None` for a file of its own in the project's folder, or an object of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pack: Option<PackLocation>,
}

impl ArtifactRef {
    /// Returns the path of the file below the project, with slashes, or the key of its object in an object store. `None`
    /// for an artifact in a pack.
    pub fn stored_path(&self) -> Option<String> {
        self.pack.is_none().then(|| self.path_of_file())
    }

    /// Returns the path that the artifact has below the project if it is a file of its own, with slashes.
    pub fn path_of_file(&self) -> String {
        let hex = self.hash.to_hex();
        format!("{ARTIFACTS}/{}/{hex}.{}", &hex[..2], self.ext)
    }

    /// Returns the artifact at a path below the project, of unknown length, or `None` if the path is not one of an
    /// artifact.
    ///
    /// ```
    /// use mocban_core::domain::ArtifactRef;
    ///
    /// let hex = "5f".repeat(32);
    /// let path = format!("artifacts/5f/{hex}.ply");
    /// let artifact = ArtifactRef::at_path(&path);
    /// assert_eq!(artifact.and_then(|artifact| artifact.stored_path()), Some(path));
    /// assert_eq!(ArtifactRef::at_path("scans/1.ply"), None);
    /// ```
    pub fn at_path(path: &str) -> Option<Self> {
        let name = path.strip_prefix(ARTIFACTS)?.rsplit('/').next()?;
        let (hash, ext) = name.split_once('.')?;
        let found = Self {
            hash: hash.parse().ok()?,
            ext: ext.to_owned(),
            bytes: 0,
            pack: None,
        };
        (found.stored_path().as_deref() == Some(path)).then_some(found)
    }
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
