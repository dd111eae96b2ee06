//! The files of one exported pair.

use std::io::ErrorKind;
use std::path::Path;

use serde::Serialize;

use super::export_folder::{FolderError, at};
use super::file_names::PAIRS;
use super::pictures::PrintView;
use super::source_print::{SourcePrint, SourcePrintError};
use crate::catalog::PairResults;
use crate::domain::artifact_role::{CANVAS_PRINT_MASK, DEPTH, canvas_depth_mask, stroke_map};
use crate::domain::{DepthScale, MetricOutcome, Stage, ThresholdMetric};
use crate::raster::{
    DepthMap, ImageLimits, Mask, png_grey16, png_mask, png_rgb8, warp_depth, warp_mask,
};
use crate::report::pair_artifacts::{PairArtifacts, PairArtifactsError};
use crate::store::Project;

/// Paths of the files of one line, relative to the export folder. Masks are 8-bit PNG images in which 255 is stroke.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Files {
    /// The print image as given.
    pub print: String,
    /// Its ink mask, in the print's frame and size.
    pub print_mask: String,
    /// The depth map, 16 bits; `depth.json` next to it holds the scale.
    pub depth: String,
    /// Its strokes at this metric's threshold, in the depth map's frame.
    pub depth_mask: String,
    /// The depth map in the print image's frame and size.
    pub aligned_depth: String,
    /// The strokes in the print image's frame and size.
    pub aligned_mask: String,
    /// The strokes on the canvas the scores were computed on.
    pub canvas_depth_mask: String,
    /// The ink mask on that canvas.
    pub canvas_print_mask: String,
    /// Where the two masks on the canvas disagree: 128 where ink is missing, 255 where wood is missing, 0 elsewhere.
    pub stroke_map: String,
    /// The print with the edges of the strokes, enlarged for viewing.
    pub overlay: String,
}

impl Files {
    fn of(pair: &str, metric: ThresholdMetric, print_ext: &str) -> Self {
        let shared = |name: &str| format!("{PAIRS}/{pair}/{name}");
        let own = |name: &str| format!("{PAIRS}/{pair}/{metric}/{name}.png");
        Self {
            print: shared(&format!("print.{print_ext}")),
            print_mask: shared("print_mask.png"),
            depth: shared("depth.png"),
            depth_mask: own("depth_mask"),
            aligned_depth: own("aligned_depth"),
            aligned_mask: own("aligned_mask"),
            canvas_depth_mask: own("canvas_depth_mask"),
            canvas_print_mask: shared("canvas_print_mask.png"),
            stroke_map: own("stroke_map"),
            overlay: own("overlay"),
        }
    }
}

/// Why the files of a pair cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// A result or artifact cannot be read; the other pairs go on.
    #[error(transparent)]
    Artifacts(#[from] PairArtifactsError),
    /// The print cannot be used; the other pairs go on.
    #[error(transparent)]
    Print(#[from] SourcePrintError),
    /// The export folder cannot be written to; the export stops.
    #[error(transparent)]
    Folder(#[from] FolderError),
}

/// The meaning of a depth PNG's levels; written next to it.
#[derive(Debug, Serialize)]
struct Sidecar<'a> {
    /// Level of pixels without data.
    no_data: u16,
    #[serde(flatten)]
    scale: &'a DepthScale,
    /// Millimetres per mesh unit, where the unit is known.
    mm_per_mesh_unit: Option<f64>,
}

/// The inputs and artifacts of a pair from which its files are made.
pub(super) struct PairFiles<'a> {
    pub(super) artifacts: PairArtifacts<'a>,
    name: &'a str,
    print: SourcePrint,
    print_mask: Mask,
    depth: DepthMap,
}

/// PNG images that metrics with the same threshold and alignment share: depth mask, aligned depth, aligned mask,
/// overlay.
pub(super) type EncodedImages = [Vec<u8>; 4];

impl<'a> PairFiles<'a> {
    /// Reads the inputs and artifacts.
    pub(super) fn read(
        project: &'a Project,
        pair: &'a PairResults,
        limits: &ImageLimits,
    ) -> Result<Self, FilesError> {
        let artifacts = PairArtifacts::new(project, pair);
        Ok(Self {
            artifacts,
            name: pair.attributes.name.as_str(),
            print: SourcePrint::read(project, pair, limits)?,
            print_mask: artifacts.print_mask()?,
            depth: artifacts.depth()?,
        })
    }

    /// Writes the files shared by all metrics.
    pub(super) fn write_shared(&self, root: &Path) -> Result<(), FilesError> {
        let files = self.files(ThresholdMetric::NlSsim);
        let canvas = self.artifacts.bytes(Stage::Register, CANVAS_PRINT_MASK)?;
        let depth = self.artifacts.bytes(Stage::Depth, DEPTH)?;
        write(root, &files.print, &self.print.upright_file())?;
        write(root, &files.print_mask, &png_mask(&self.print_mask))?;
        write(root, &files.depth, &depth)?;
        let sidecar = format!("{PAIRS}/{}/depth.json", self.name);
        write(root, &sidecar, self.sidecar().as_bytes())?;
        write(root, &files.canvas_print_mask, &canvas)
    }

    /// Draws the images of an alignment.
    pub(super) fn draw(&self, outcome: &MetricOutcome) -> EncodedImages {
        let (width, height) = (self.print_mask.width(), self.print_mask.height());
        let print_from_depth = &outcome.print_from_depth;
        let strokes = self.depth.stroke_mask(outcome.threshold_level);
        let aligned = warp_mask(&strokes, print_from_depth, width, height);
        let heights = warp_depth(&self.depth, print_from_depth, width, height);
        let view = PrintView::enlarged(&self.print.picture);
        [
            png_mask(&strokes),
            png_grey16(&heights),
            png_mask(&aligned),
            png_rgb8(&view.overlay(&self.print.picture, &self.depth, outcome)),
        ]
    }

    /// Writes the files of one metric. Returns the paths for the metric's line, including the paths of files shared by
    /// all metrics.
    pub(super) fn write_metric(
        &self,
        root: &Path,
        metric: ThresholdMetric,
        drawn: &EncodedImages,
    ) -> Result<Files, FilesError> {
        let files = self.files(metric);
        for (role, path) in [
            (canvas_depth_mask(metric), &files.canvas_depth_mask),
            (stroke_map(metric), &files.stroke_map),
        ] {
            let image = self.artifacts.bytes(Stage::Register, &role)?;
            write(root, path, &image)?;
        }
        let paths = [
            &files.depth_mask,
            &files.aligned_depth,
            &files.aligned_mask,
            &files.overlay,
        ];
        for (path, image) in paths.into_iter().zip(drawn) {
            write(root, path, image)?;
        }
        Ok(files)
    }

    fn files(&self, metric: ThresholdMetric) -> Files {
        Files::of(self.name, metric, self.print.extension())
    }

    fn sidecar(&self) -> String {
        let scale = &self.depth.scale;
        let sidecar = Sidecar {
            no_data: 0,
            scale,
            mm_per_mesh_unit: scale.unit.map(crate::domain::LengthUnit::mm),
        };
        let text = serde_json::to_string_pretty(&sidecar)
            .expect("a scale holds only numbers, lists and names");
        text + "\n"
    }
}

/// Writes a file below the export folder, and creates its parent folders.
fn write(root: &Path, below: &str, bytes: &[u8]) -> Result<(), FilesError> {
    let path = root.join(below);
    match path.parent().map_or(Ok(()), std::fs::create_dir_all) {
        // `AlreadyExists` means that the folder exists but cannot be inspected. The write below reports the cause.
        Err(error) if error.kind() != ErrorKind::AlreadyExists => {
            return Err(at(&path)(error).into());
        }
        Ok(()) | Err(_) => {}
    }
    Ok(std::fs::write(&path, bytes).map_err(at(&path))?)
}

#[cfg(test)]
mod tests {
    use super::Files;
    use crate::domain::ThresholdMetric;

    #[test]
    fn metrics_share_files_that_do_not_depend_on_them() {
        let density = Files::of("b01-2", ThresholdMetric::Density, "jpg");
        let ensemble = Files::of("b01-2", ThresholdMetric::Ensemble, "jpg");
        assert_eq!(density.print, "pairs/b01-2/print.jpg");
        assert_eq!(density.depth, ensemble.depth);
        assert_eq!(density.aligned_mask, "pairs/b01-2/density/aligned_mask.png");
        assert_ne!(density.canvas_depth_mask, ensemble.canvas_depth_mask);
    }
}
