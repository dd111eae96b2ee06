//! A mesh and a print on their way through the stages.

use mocban::domain::FitOutcome;
use mocban::mesh;
use mocban::raster;
use mocban::stages::{
    AlignedPair, Print, Scan, Settings, StageError, depth, fit, normalize, register,
};

use super::times::{Part, Times};

/// What the stages are given.
pub(super) struct Input {
    /// A binary STL.
    pub(super) mesh: Vec<u8>,
    /// The print's file.
    pub(super) print: Vec<u8>,
}

/// What became of an input.
pub(super) struct Run {
    /// How long each part took.
    pub(super) times: Times,
    /// The plane, if it came so far.
    pub(super) fit: Option<FitOutcome>,
    /// The print as read and what the stages found, or why there is nothing.
    pub(super) result: Result<(Print, AlignedPair), Failed>,
}

/// Why nothing was found.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failed {
    /// The mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] mesh::MeshError),
    /// The print cannot be read.
    #[error(transparent)]
    Print(#[from] raster::DecodeError),
    /// A stage gave up.
    #[error(transparent)]
    Stage(#[from] StageError),
}

impl Run {
    /// Reads an input and runs the four stages on it.
    pub(super) fn new(input: &Input, settings: &Settings) -> Self {
        let (mut times, mut fit) = (Times::default(), None);
        let result = align(input, settings, &mut times, &mut fit);
        Self { times, fit, result }
    }
}

/// The way of an input; `fit` keeps the plane when a later stage gives up.
fn align(
    input: &Input,
    settings: &Settings,
    times: &mut Times,
    fit: &mut Option<FitOutcome>,
) -> Result<(Print, AlignedPair), Failed> {
    let scan = times.book(Part::ReadMesh, || {
        mesh::read(&input.mesh, "mesh.stl", &mesh::MeshLimits::SUGGESTED).map(Scan::from)
    })?;
    let print = times.book(Part::ReadPrint, || {
        raster::decode(&input.print, &raster::ImageLimits::SUGGESTED).map(Print::from)
    })?;
    let plane = times
        .book(Part::Fit, || {
            fit::fit(&scan, Some(&print), None, &settings.fit)
        })
        .map_err(StageError::from)?;
    let plane = &*fit.insert(plane);
    let depth = times
        .book(Part::Depth, || {
            depth::depth(&scan, plane, None, &settings.depth)
        })
        .map_err(StageError::from)?;
    let normalized = times
        .book(Part::Normalize, || {
            normalize::normalize(&depth, &print, &settings.normalize)
        })
        .map_err(StageError::from)?;
    let registered = times
        .book(Part::Register, || {
            register::register(&depth, &normalized, &settings.register)
        })
        .map_err(StageError::from)?;
    let aligned = AlignedPair {
        fit: plane.clone(),
        depth,
        normalized,
        registered,
    };
    Ok((print, aligned))
}
