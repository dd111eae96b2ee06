//! One run of the four stages on a mesh and a print.

use mocban::domain::{Affine2, FitOutcome};
use mocban::mesh;
use mocban::raster;
use mocban::stages::{AlignedPair, Print, Scan, ScanHints, Settings, StageError, depth, pipeline};

use super::times::{Part, Times};

/// Input files of a run.
pub(super) struct Input {
    /// A binary STL.
    pub(super) mesh: Vec<u8>,
    /// The print's file.
    pub(super) print: Vec<u8>,
    /// Maps pixels of the print to those of the print to which the ground truth belongs.
    pub(super) full_from_print: Affine2,
}

/// Result of a run.
pub(super) struct Run {
    /// How long each part took.
    pub(super) times: Times,
    /// The plane, if the fit succeeded.
    pub(super) fit: Option<FitOutcome>,
    /// The print as read and the results of the stages, or the error. Alignments are in the frame of the ground truth.
    pub(super) result: Result<(Print, AlignedPair), Failed>,
}

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failed {
    /// The mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] mesh::MeshError),
    /// The print cannot be read.
    #[error(transparent)]
    Print(#[from] raster::DecodeError),
    /// A stage found no result.
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

/// Runs the stages; `fit` keeps the plane when a later stage fails.
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
            pipeline::fit(&scan, Some(&print), None, None, settings)
        })
        .map_err(StageError::from)?;
    let plane = &*fit.insert(plane);
    let print = print.within(plane.print_outline.as_ref());
    let depth = times
        .book(Part::Depth, || {
            depth::depth(&scan, plane, None, &settings.depth)
        })
        .map_err(StageError::from)?;
    let normalized = times
        .book(Part::Normalize, || {
            pipeline::normalize(&depth, &print, settings)
        })
        .map_err(StageError::from)?;
    let mut registered = times
        .book(Part::Register, || {
            pipeline::register(&depth, &normalized, None, settings)
        })
        .map_err(StageError::from)?;
    for metric in &mut registered.outcome.metrics {
        metric.print_from_depth = input.full_from_print.after(&metric.print_from_depth);
    }
    let aligned = AlignedPair {
        hints: ScanHints::default(),
        fit: plane.clone(),
        depth: registered.levelled(depth),
        normalized,
        registered,
    };
    Ok((print, aligned))
}
