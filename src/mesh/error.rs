//! Why a mesh could not be read.

use crate::domain::{FailureClass, FileKind};

/// Why a mesh could not be read from a file.
#[derive(Debug, thiserror::Error)]
pub enum MeshReadError {
    /// Reading failed half-way.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// What was read is no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Why a mesh could not be read. The messages leave the file's name to the caller.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No bytes at all.
    #[error("the file is empty (0 bytes)")]
    Empty,
    /// The content is of no format that is read.
    #[error("the file is {0}; OBJ, PLY and STL meshes and XYZ points are read")]
    NotAMesh(FileKind),
    /// More than the settings allow.
    #[error("the file has {count} {what}; {setting} is {limit}")]
    TooMany {
        /// Bytes, vertices or triangles.
        what: &'static str,
        /// How many there are, by the header or as far as was read.
        count: u64,
        /// The setting's value.
        limit: u64,
        /// The setting's name.
        setting: &'static str,
    },
    /// The file ends early.
    #[error("the {format} is truncated: it holds {have} of {want} {what}")]
    Truncated {
        /// Format and encoding.
        format: &'static str,
        /// What is missing, in the plural.
        what: String,
        /// How many are whole.
        have: u64,
        /// How many the header promises.
        want: u64,
    },
    /// The file ends early, and nothing in it says how much there should be.
    #[error("the {format} is truncated: it ends after {have} facets without {missing}")]
    EndMissing {
        /// Format and encoding.
        format: &'static str,
        /// Whole facets before the end.
        have: u64,
        /// The word that is missing.
        missing: &'static str,
    },
    /// A coordinate that is NaN or infinite.
    #[error("vertex {vertex} has the coordinate {value}, which is not a finite number")]
    NotFinite {
        /// Position in the file, counted from 1.
        vertex: u64,
        /// The coordinate.
        value: f64,
    },
    /// Not a single vertex.
    #[error("the mesh has no vertices")]
    NoVertices,
    /// A format of faces without any.
    #[error("the mesh has no faces")]
    NoFaces,
    /// A face names a vertex that is not there.
    #[error("face {face} refers to vertex {index}, but the file has {vertices} vertices")]
    IndexOutOfRange {
        /// Position in the file, counted from 1.
        face: u64,
        /// The index as the file has it.
        index: i64,
        /// How many vertices there are.
        vertices: u64,
    },
    /// A line of a text format that cannot be read.
    #[error("line {line}: {reason}")]
    Line {
        /// Counted from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A header that does not make sense.
    #[error("the PLY header is wrong: {0}")]
    Header(String),
    /// A row of a PLY body that cannot be read.
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
    /// Decides retry or quarantine. The file is at fault in every case: one over a limit can only be read by
    /// raising the setting that the message names.
    pub const fn class(&self) -> FailureClass {
        FailureClass::BadInput
    }
}

/// Checks that a vertex is finite; `vertex` counts from 1.
pub(super) fn finite(position: [f64; 3], vertex: u64) -> Result<[f64; 3], MeshError> {
    match position.into_iter().find(|value| !value.is_finite()) {
        Some(value) => Err(MeshError::NotFinite { vertex, value }),
        None => Ok(position),
    }
}

/// Checks that vertices are finite, of which `before` came before.
pub(super) fn all_finite<T: Copy + Into<f64>>(
    positions: &[[T; 3]],
    before: usize,
) -> Result<(), MeshError> {
    let values = positions.as_flattened().iter();
    if values.fold(true, |finite, value| finite & (*value).into().is_finite()) {
        return Ok(());
    }
    for (vertex, position) in (before as u64 + 1..).zip(positions) {
        finite(position.map(Into::into), vertex)?;
    }
    Ok(())
}
