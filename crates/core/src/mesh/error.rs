//! Errors of the mesh readers, and the limits they check.

use serde::{Deserialize, Serialize};

use crate::domain::{FailureClass, FileKind, ONLY_ZEROS};

/// Why a mesh could not be read from a file.
#[derive(Debug, thiserror::Error)]
pub enum MeshReadError {
    /// Reading the source failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The content is not a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Why a mesh could not be read. The caller adds the file's name.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The file has no bytes.
    #[error("the file is empty (0 bytes)")]
    Empty,
    /// All bytes of the file are zero.
    #[error("the file {ONLY_ZEROS}")]
    OnlyZeros,
    /// The content is of an unsupported format.
    #[error("{}", not_a_mesh(*.0))]
    NotAMesh(FileKind),
    /// More than the settings allow.
    #[error("the file has {count} {what}; limits.mesh.max_{what} is {limit}")]
    TooMany {
        /// Bytes, vertices or triangles.
        what: &'static str,
        /// Count in the header, or as far as was read.
        count: u64,
        /// The setting's value.
        limit: u64,
    },
    /// The file ends early.
    #[error("the {format} is truncated: it holds {have} of {want} {what}")]
    Truncated {
        /// Format and encoding.
        format: &'static str,
        /// What is missing, plural.
        what: String,
        /// Complete ones.
        have: u64,
        /// Count in the header.
        want: u64,
    },
    /// A text has fewer points than a line before them says.
    #[error(
        "line {line} says that {want} points follow, but {have} do; copy the file again if it was cut, or correct the number"
    )]
    FewerPoints {
        /// The line with the number, counted from 1.
        line: u64,
        /// Points that follow.
        have: u64,
        /// Their number as stated.
        want: u64,
    },
    /// The file holds more than its header says.
    #[error(
        "the {format} holds {have} {what}, but its header says {want}; save it again with the right count"
    )]
    Uncounted {
        /// Format and encoding.
        format: &'static str,
        /// What is not counted, plural.
        what: &'static str,
        /// Complete ones.
        have: u64,
        /// Count in the header.
        want: u64,
    },
    /// The records of a binary STL have another length.
    #[error(
        "the binary STL has {bytes} bytes a triangle instead of 50; save it again without attributes, or as PLY"
    )]
    FacetBytes {
        /// Bytes of each triangle.
        bytes: u64,
    },
    /// The file goes on after the rows that its header counts.
    #[error(
        "the {format} has {bytes} bytes after the rows that its header counts; save it again with the right counts"
    )]
    BytesAfterRows {
        /// Format and encoding.
        format: &'static str,
        /// Number of bytes.
        bytes: u64,
    },
    /// The file ends early, and no count says how much is missing.
    #[error("the {format} is truncated: it ends after {have} facets without {missing}")]
    EndMissing {
        /// Format and encoding.
        format: &'static str,
        /// Complete facets.
        have: u64,
        /// The missing keyword.
        missing: &'static str,
    },
    /// Nothing is left without the vertices that have no position.
    #[error(
        "{missing} of {vertices} vertices have no position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside), and without them nothing is left"
    )]
    NothingLeft {
        /// Vertices without a position.
        missing: u64,
        /// All vertices of the file.
        vertices: u64,
    },
    /// The file has no vertices.
    #[error("the mesh has no vertices")]
    NoVertices,
    /// A file of a format of faces has none.
    #[error("the mesh has no faces")]
    NoFaces,
    /// A face refers to a missing vertex.
    #[error("face {face} refers to vertex {index}, but the file has {vertices} vertices")]
    IndexOutOfRange {
        /// Position in the file, counted from 1.
        face: u64,
        /// The index as written.
        index: i64,
        /// Number of vertices.
        vertices: u64,
    },
    /// A face refers to a missing vertex, and neither is known.
    #[error("a face refers to a vertex that the file does not have")]
    NoSuchVertex,
    /// A line of a text format cannot be parsed.
    #[error("line {line}: {reason}")]
    Line {
        /// Counted from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// The PLY header is invalid.
    #[error("the PLY header is wrong: {0}")]
    Header(String),
    /// A row of a PLY body cannot be parsed.
    #[error("{element} {row}: {reason}")]
    Row {
        /// Name of the element.
        element: String,
        /// Counted from 1.
        row: u64,
        /// What is wrong with it.
        reason: String,
    },
}

impl MeshError {
    /// Returns the failure class, which is always `BadInput`. A file over a limit can be read only with a higher limit,
    /// and the message names the setting.
    pub const fn class(&self) -> FailureClass {
        FailureClass::BadInput
    }
}

fn not_a_mesh(kind: FileKind) -> String {
    let formats = "OBJ, PLY and STL meshes and XYZ points";
    kind.refusal("mesh", formats, kind.mesh_advice())
}

/// Limits on meshes, checked before memory is reserved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshLimits {
    /// Largest file in bytes; 2 GiB holds any scan of one character.
    pub max_bytes: u64,
    /// Largest number of vertices. 50 million take 0.6 GB in single precision and 1.2 GB in double precision.
    pub max_vertices: u64,
    /// Most triangles after triangulation; 100 million take 1.2 GB.
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
        check_count("bytes", count, self.max_bytes)
    }

    /// Checks a number of vertices against the limit. More vertices than a 32-bit index can address are never allowed.
    pub(super) fn check_vertices(&self, count: u64) -> Result<(), MeshError> {
        check_count("vertices", count, self.most_vertices())
    }

    /// Returns the most vertices that the settings allow and that have an index.
    fn most_vertices(&self) -> u64 {
        self.max_vertices.min(u64::from(u32::MAX))
    }

    pub(super) fn check_triangles(&self, count: u64) -> Result<(), MeshError> {
        check_count("triangles", count, self.max_triangles)
    }

    /// Returns whether a mesh of this size is within the limits.
    pub(super) fn allow(&self, vertices: usize, triangles: usize) -> bool {
        vertices as u64 <= self.most_vertices() && triangles as u64 <= self.max_triangles
    }
}

fn check_count(what: &'static str, count: u64, limit: u64) -> Result<(), MeshError> {
    if count <= limit {
        return Ok(());
    }
    Err(MeshError::TooMany { what, count, limit })
}
