//! Why a block cannot be processed.

use crate::mesh::MeshReadError;

/// Why a block cannot be processed.
#[derive(Debug, thiserror::Error)]
pub enum BlockError {
    /// The mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshReadError),
    /// There are no triangles, or all are degenerate.
    #[error(
        "the scan has no surface ({triangles} triangles with an area of zero): a block needs a triangle mesh; \
         export it with faces, not as points"
    )]
    NoArea {
        /// Triangles in the file.
        triangles: u64,
    },
    /// No side looks like a carved face.
    #[error("the scan shows no carved face: {found}; is this the scan of a whole block?")]
    NoFace {
        /// What was seen instead.
        found: String,
    },
    /// The page has no ink.
    #[error("the page image shows no ink: {found}")]
    NoInk {
        /// What was seen instead.
        found: String,
    },
    /// The scan is a point set.
    #[error(
        "the scan is a point set ({points} points without faces): a block needs a triangle mesh; export it with faces"
    )]
    NoFaces {
        /// Points in the file.
        points: usize,
    },
    /// Page and block do not agree.
    #[error(
        "the page does not belong to this block: at the best position found, {share:.0} % of the places agree; on \
         the right page nearly all do; the scan was taken to be {width_mm:.0} x {height_mm:.0} mm; check the file names \
         and the unit"
    )]
    Refused {
        /// Sides of the face, mm.
        width_mm: f64,
        /// Sides of the face, mm.
        height_mm: f64,
        /// Percentage of places that agree.
        share: f64,
    },
}

impl BlockError {
    /// Returns the error of a scan without a side that may be a face.
    pub fn no_face() -> Self {
        Self::NoFace {
            found: "no side has a large flat part".to_owned(),
        }
    }
}
