//! Reads the inputs and artifacts of a finished pair when they are needed, and draws its pictures.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::path::PathBuf;

use super::mesh::MeshPlacement;
use super::pictures::{PrintView, Rgb};
use super::source_print::{SourcePrint, SourcePrintError};
use super::stage_outcomes::StageOutcomes;
use mocban_catalog::{MetricRecord, PairResults};
use mocban_core::InputLimits;
use mocban_core::domain::artifact_role::DEPTH;
use mocban_core::domain::{Affine2, ArtifactRef, DepthScale, Explained, MetricOutcome, Stage};
use mocban_core::mesh::{self, Mesh, MeshError, MeshLimits, MeshReadError};
use mocban_core::raster::{
    DepthMap, Grid, Mask, png_grey16, png_rgb8, warp_depth, warp_mask, warp_rgb,
};
use mocban_results::pair_artifacts::{PairArtifacts, PairArtifactsError};
use mocban_store::{InputError, Project, open_input};

/// Why the pictures or the mesh of a pair cannot be used. The other pairs are exported.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// A result or artifact cannot be read.
    #[error(transparent)]
    Artifacts(#[from] PairArtifactsError),
    /// The print cannot be used.
    #[error(transparent)]
    Print(#[from] SourcePrintError),
    /// The mesh file cannot be read.
    #[error(transparent)]
    MeshFile(#[from] InputError),
    /// The mesh file is not valid, for example because limits were lowered.
    #[error("{path}: {source}")]
    Mesh {
        /// The mesh file.
        path: PathBuf,
        /// Why.
        source: MeshError,
    },
    /// The mesh is not the one that was aligned.
    #[error("{0} has changed since it was aligned; run again")]
    MeshChanged(PathBuf),
    /// The result has no form in a format.
    #[error("{0}")]
    Unencodable(String),
}

impl Explained for PictureError {}

/// The frame of the exported pictures of a pair: the print's, or the square canvas that was requested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PictureFrame {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Maps print pixels to pixels of the pictures.
    pub(super) from_print: Affine2,
}

/// The inputs and artifacts of a finished pair. Each is read and decoded when it is first needed.
pub(super) struct PairPictures<'a> {
    project: &'a Project,
    pair: &'a PairResults,
    limits: InputLimits,
    /// Map of a square canvas of the given side, if all pictures have this size.
    canvas: Option<(usize, Affine2)>,
    /// The parsed outcomes of the stages.
    pub(super) outcomes: &'a StageOutcomes,
    /// The selected results, in the order of `ThresholdMetric::ALL`; parallel to the metrics of the record.
    pub(super) metrics: Vec<&'a MetricRecord>,
    print: OnceCell<SourcePrint>,
    print_mask: OnceCell<Mask>,
    depth_file: OnceCell<Vec<u8>>,
    depth: OnceCell<DepthMap>,
    /// The print, as overlays show it.
    enlarged: OnceCell<Rgb>,
    /// The strokes of each of `metrics` in the frame of the print.
    on_print: Vec<OnceCell<Mask>>,
}

impl<'a> PairPictures<'a> {
    pub(super) fn new(
        project: &'a Project,
        pair: &'a PairResults,
        outcomes: &'a StageOutcomes,
        metrics: Vec<&'a MetricRecord>,
        limits: InputLimits,
        canvas_px: Option<u32>,
    ) -> Self {
        Self {
            project,
            pair,
            limits,
            canvas: canvas_px
                .and_then(|side| Some((side as usize, canvas_from_print(outcomes, side)?))),
            outcomes,
            on_print: metrics.iter().map(|_| OnceCell::new()).collect(),
            metrics,
            print: OnceCell::new(),
            print_mask: OnceCell::new(),
            depth_file: OnceCell::new(),
            depth: OnceCell::new(),
            enlarged: OnceCell::new(),
        }
    }

    /// Returns the reader of stored artifacts.
    pub(super) const fn artifacts(&self) -> PairArtifacts<'a> {
        PairArtifacts::new(self.project, self.pair)
    }

    /// Returns an artifact of a stage by its role. Equal artifacts have equal hashes.
    pub(super) fn artifact(
        &self,
        stage: Stage,
        role: &str,
    ) -> Result<&'a ArtifactRef, PictureError> {
        Ok(self.artifacts().artifact(stage, role)?)
    }

    /// Returns the bytes of a stored picture, whose hash is checked.
    pub(super) fn stored_file(&self, stage: Stage, role: &str) -> Result<Vec<u8>, PictureError> {
        Ok(self.artifacts().bytes(stage, role)?)
    }

    /// Returns the print as given, decoded.
    pub(super) fn source_print(&self) -> Result<&SourcePrint, PictureError> {
        let read = || SourcePrint::read(self.project, self.pair, &self.limits.image);
        get_or_read(&self.print, || Ok(read()?))
    }

    /// Returns the ink mask in the frame of the print.
    pub(super) fn source_mask(&self) -> Result<&Mask, PictureError> {
        get_or_read(&self.print_mask, || Ok(self.artifacts().print_mask()?))
    }

    /// Returns the depth map, in its own frame, as a PNG. It is the stored file unless the map was levelled.
    pub(super) fn depth_file(&self) -> Result<Cow<'_, [u8]>, PictureError> {
        if self.outcomes.register.levelling.is_some() {
            return Ok(Cow::Owned(png_grey16(&self.depth()?.levels)));
        }
        Ok(Cow::Borrowed(self.stored_depth()?))
    }

    /// Returns the depth map as the depth stage stored it.
    fn stored_depth(&self) -> Result<&[u8], PictureError> {
        let file = get_or_read(&self.depth_file, || self.stored_file(Stage::Depth, DEPTH))?;
        Ok(file)
    }

    /// Returns the depth map, in its own frame.
    pub(super) fn depth(&self) -> Result<&DepthMap, PictureError> {
        get_or_read(&self.depth, || {
            Ok(self.artifacts().decode_depth(self.stored_depth()?)?)
        })
    }

    /// Returns the frame that the print, the ink mask and the aligned pictures share.
    pub(super) fn frame(&self) -> Result<PictureFrame, PictureError> {
        if let Some((side, from_print)) = self.canvas {
            return Ok(PictureFrame {
                width: side,
                height: side,
                from_print,
            });
        }
        let mask = self.source_mask()?;
        Ok(PictureFrame {
            width: mask.width(),
            height: mask.height(),
            from_print: Affine2::IDENTITY,
        })
    }

    /// Returns the print in the frame of the pictures, 8 bits per channel.
    pub(super) fn print_rgb(&self) -> Result<Rgb, PictureError> {
        let print = self.source_print()?.picture.rgb.to_rgb8();
        Ok(match self.canvas {
            None => print.into_owned(),
            Some((side, from_print)) => warp_rgb(&print, &from_print, side, side),
        })
    }

    /// Returns the print as an image file with its extension: the original where possible, otherwise a PNG.
    pub(super) fn print_file(&self) -> Result<(Vec<u8>, &'static str), PictureError> {
        if self.canvas.is_some() {
            return Ok((png_rgb8(&self.print_rgb()?), "png"));
        }
        self.original_file()
    }

    /// Returns the print in its own frame as an image file with its extension: the original where possible.
    pub(super) fn original_file(&self) -> Result<(Vec<u8>, &'static str), PictureError> {
        let print = self.source_print()?;
        Ok((print.upright_file().into_owned(), print.extension()))
    }

    /// Returns the strokes at the threshold of one of `metrics`, in the frame of the print.
    pub(super) fn mask_on_print(&self, outcome: &MetricOutcome) -> Result<&Mask, PictureError> {
        let place = self
            .metrics
            .iter()
            .position(|record| record.outcome.metric == outcome.metric)
            .expect("the metric is selected");
        get_or_read(&self.on_print[place], || {
            let (strokes, print) = (self.depth_mask(outcome)?, self.source_mask()?);
            let (width, height) = (print.width(), print.height());
            let map = &outcome.print_from_depth;
            Ok(warp_mask(&strokes, map, width, height))
        })
    }

    /// Returns the ink mask in the frame of the pictures.
    pub(super) fn print_mask(&self) -> Result<Mask, PictureError> {
        let (mask, frame) = (self.source_mask()?, self.frame()?);
        Ok(match self.canvas {
            None => mask.clone(),
            Some(_) => warp_mask(mask, &frame.from_print, frame.width, frame.height),
        })
    }

    /// Returns the strokes at the metric's threshold, in the frame of the depth map.
    pub(super) fn depth_mask(&self, outcome: &MetricOutcome) -> Result<Mask, PictureError> {
        Ok(self.depth()?.stroke_mask(outcome.threshold_level))
    }

    /// Returns the levels of the depth map in the frame of the pictures. Level 0 is no data; a level means the same
    /// height as in the depth map.
    pub(super) fn aligned_depth(&self, outcome: &MetricOutcome) -> Result<Grid<u16>, PictureError> {
        let (depth, frame) = (self.depth()?, self.frame()?);
        let to_depth = frame.from_print.after(&outcome.print_from_depth);
        Ok(warp_depth(depth, &to_depth, frame.width, frame.height))
    }

    /// Returns the strokes at the threshold of one of `metrics`, in the frame of the pictures.
    pub(super) fn aligned_mask(
        &self,
        outcome: &MetricOutcome,
    ) -> Result<Cow<'_, Mask>, PictureError> {
        if self.canvas.is_none() {
            return Ok(Cow::Borrowed(self.mask_on_print(outcome)?));
        }
        let (strokes, frame) = (self.depth_mask(outcome)?, self.frame()?);
        let to_depth = frame.from_print.after(&outcome.print_from_depth);
        let mask = warp_mask(&strokes, &to_depth, frame.width, frame.height);
        Ok(Cow::Owned(mask))
    }

    /// Returns the print with the edges of the strokes of one of `metrics`, small prints enlarged.
    pub(super) fn overlay(&self, outcome: &MetricOutcome) -> Result<Rgb, PictureError> {
        let print = &self.source_print()?.picture;
        let view = PrintView::enlarged(print);
        let enlarged = get_or_read(&self.enlarged, || Ok(view.print(print)))?;
        let strokes = self.depth_mask(outcome)?;
        let displaced = self.outcomes.register.displaced.as_ref();
        let displaced = displaced.map(|part| (part, &strokes));
        Ok(view.overlay_on(enlarged.clone(), self.mask_on_print(outcome)?, displaced))
    }

    /// Places the scan under an alignment on a print of `print` pixels. Heights are those of the depth map with this scale,
    /// over its levelling if it was levelled.
    pub(super) fn placement(
        &self,
        outcome: &MetricOutcome,
        scale: DepthScale,
        print: [usize; 2],
    ) -> Result<MeshPlacement, PictureError> {
        let (map, levelling) = (&self.outcomes.depth, &self.outcomes.register.levelling);
        let placement = MeshPlacement::new(self.outcomes.fit.clone(), scale, outcome, print);
        let none = || PictureError::Unencodable("the alignment has no inverse".to_owned());
        Ok(placement
            .ok_or_else(none)?
            .levelled(levelling.as_ref(), [map.width, map.height]))
    }

    /// Reads the mesh file, and checks that it is the one that was aligned.
    pub(super) fn mesh(&self) -> Result<Mesh, PictureError> {
        read_mesh(self.project, self.pair, &self.limits.mesh)
    }
}

/// Reads the mesh file of a pair, and checks that it is the one that was aligned, if it was.
///
/// # Errors
/// Returns an error if the mesh cannot be read, or has changed.
pub fn read_mesh(
    project: &Project,
    pair: &PairResults,
    limits: &MeshLimits,
) -> Result<Mesh, PictureError> {
    let stored = &pair.attributes.mesh_path;
    let input = project.input(stored);
    let mut file = open_input(&input, limits.max_bytes, "limits.mesh.max_bytes")?;
    let size = file.size();
    let mesh = match mesh::read_from(&mut file, size, stored, limits) {
        Err(MeshReadError::Io(error)) => return Err(file.error(error).into()),
        Err(MeshReadError::Mesh(source)) => Err(source),
        Ok(read) => Ok(read.mesh),
    };
    let digest = file.finish()?;
    let aligned = pair.stage(Stage::Fit).map(|record| record.mesh_hash);
    if aligned.is_some_and(|hash| hash != digest.hash) {
        return Err(PictureError::MeshChanged(input.path().to_owned()));
    }
    let path = input.path().to_owned();
    mesh.map_err(|source| PictureError::Mesh { path, source })
}

/// Returns the map from print pixels to a square canvas of `side` pixels. `None` if the print's interpretation is not
/// stored.
pub(super) fn canvas_from_print(outcomes: &StageOutcomes, side: u32) -> Option<Affine2> {
    let scale = f64::from(side) / f64::from(outcomes.normalize.canvas_px);
    Some(Affine2::resize(scale).after(&outcomes.ink()?.canvas_from_print))
}

/// Returns the value of a cell, which is read when it is first needed.
fn get_or_read<T>(
    cell: &OnceCell<T>,
    read: impl FnOnce() -> Result<T, PictureError>,
) -> Result<&T, PictureError> {
    if let Some(found) = cell.get() {
        return Ok(found);
    }
    let value = read()?;
    Ok(cell.get_or_init(|| value))
}
