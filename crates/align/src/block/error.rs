//! Why a block cannot be processed.

use mocban_core::mesh::MeshReadError;

/// Why a block cannot be processed.
#[derive(Debug, thiserror::Error)]
pub enum BlockError {
    /// The mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshReadError),
    /// There are no triangles, or all are degenerate.
    #[error(
        "the scan has no surface ({triangles} triangles with an area of zero, or with coordinates that are too large to \
         compute with): a block needs a triangle mesh; export it with faces, not as points"
    )]
    NoArea {
        /// Triangles in the file.
        triangles: u64,
    },
    /// The height map of the block would be too large.
    #[error(
        "the scan is {:.2} x {:.2} m large if a unit of it is {mm} mm, more than the {:.2} square metres of which height \
         maps are computed{}; check the unit, or remove what does not belong to the block",
        .size_mm[0] / 1e3, .size_mm[1] / 1e3, .limit_mm2 / 1e6,
        if *is_of_memory { " with this --memory" } else { "" }
    )]
    TooLarge {
        /// Width and height, mm.
        size_mm: [f64; 2],
        /// Millimetres per unit of the mesh.
        mm: f64,
        /// Largest area, square millimetres.
        limit_mm2: f64,
        /// Whether the limit follows from the memory that the run may use.
        is_of_memory: bool,
    },
    /// Large triangles overlap too often to be drawn.
    #[error(
        "its {triangles} triangles overlap more than {limit} times, or most are slivers across the scan; remove repeated \
         faces or remesh the scan"
    )]
    Overlap {
        /// Triangles in the file.
        triangles: u64,
        /// How often triangles may overlap.
        limit: u64,
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
