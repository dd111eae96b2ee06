//! How much a mesh may hold before it is refused.

use serde::{Deserialize, Serialize};

use super::MeshError;

/// Limits on meshes, checked before memory is reserved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshLimits {
    /// Largest file in bytes; 2 GiB holds any scan of one character.
    pub max_bytes: u64,
    /// Most vertices; 50 million take 0.6 GB in single precision, 1.2 in double.
    pub max_vertices: u64,
    /// Most triangles after polygons are cut into fans; 100 million take 1.2 GB.
    pub max_triangles: u64,
}

impl MeshLimits {
    /// 2 GiB, 50 million vertices, 100 million triangles.
    pub const SUGGESTED: Self = Self {
        max_bytes: 2 << 30,
        max_vertices: 50_000_000,
        max_triangles: 100_000_000,
    };

    pub(super) fn check_bytes(&self, count: u64) -> Result<(), MeshError> {
        check("bytes", count, self.max_bytes, "limits.mesh.max_bytes")
    }

    /// Never more than a 32-bit index can name, whatever the setting.
    pub(super) fn check_vertices(&self, count: u64) -> Result<(), MeshError> {
        let limit = self.max_vertices.min(u64::from(u32::MAX));
        check("vertices", count, limit, "limits.mesh.max_vertices")
    }

    pub(super) fn check_triangles(&self, count: u64) -> Result<(), MeshError> {
        check(
            "triangles",
            count,
            self.max_triangles,
            "limits.mesh.max_triangles",
        )
    }
}

fn check(
    what: &'static str,
    count: u64,
    limit: u64,
    setting: &'static str,
) -> Result<(), MeshError> {
    if count <= limit {
        return Ok(());
    }
    Err(MeshError::TooMany {
        what,
        count,
        limit,
        setting,
    })
}
