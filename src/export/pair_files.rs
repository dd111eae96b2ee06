//! The files of one exported pair.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::pictures::PrintView;
use crate::catalog::PairResults;
use crate::domain::artifact_role::{CANVAS_PRINT_MASK, DEPTH, canvas_depth_mask};
use crate::domain::{ContentHash, DepthScale, FileKind, MetricOutcome, Stage, ThresholdMetric};
use crate::raster::{
    self, DecodeError, DepthMap, Mask, PrintImage, png_grey16, png_mask, png_rgb8, warp_depth,
    warp_mask,
};
use crate::report::pair_artifacts::{PairArtifacts, PairArtifactsError};
use crate::store::Project;

/// Folder of the pairs below the export folder.
pub(super) const PAIRS: &str = "pairs";

/// Paths of one line's files below the export folder. Masks are 8-bit PNG, 255 = stroke.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Files {
    /// The print image as given.
    pub print: String,
    /// Its ink, in its own frame and size.
    pub print_mask: String,
    /// The depth map, 16 bits; `depth.json` beside it tells how to read it.
    pub depth: String,
    /// Its strokes at this metric's threshold, in the depth map's frame.
    pub depth_mask: String,
    /// The depth map in the print image's frame and size.
    pub aligned_depth: String,
    /// The strokes in the print image's frame and size.
    pub aligned_mask: String,
    /// The strokes on the canvas the scores were computed on.
    pub canvas_depth_mask: String,
    /// The ink on that canvas.
    pub canvas_print_mask: String,
    /// The print with the edges of the strokes, enlarged, for people.
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
            overlay: own("overlay"),
        }
    }
}

/// Why the files of a pair cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// A result or artifact cannot be read; the pair is told and the others go on.
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
    /// The print cannot be read any more.
    #[error("{path}: {source}")]
    SourcePrint {
        /// The print.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The print cannot be decoded any more, as with lower limits.
    #[error("{path}: {source}")]
    Decode {
        /// The print.
        path: PathBuf,
        /// Why.
        source: DecodeError,
    },
    /// The print is another than the one that was aligned.
    #[error("{0} has changed since it was aligned; run again")]
    Changed(PathBuf),
    /// The export folder cannot be written to; nothing can go on.
    #[error("{path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// What a depth PNG's levels mean; written beside it.
#[derive(Debug, Serialize)]
struct Sidecar<'a> {
    /// Level of pixels without data.
    no_data: u16,
    #[serde(flatten)]
    scale: &'a DepthScale,
    /// Millimetres in a mesh unit, where the unit is known.
    mm_per_mesh_unit: Option<f64>,
}

/// Everything of a pair that is drawn or copied, in memory.
pub(super) struct PairFiles<'a> {
    aligned: PairArtifacts<'a>,
    name: &'a str,
    print: SourcePrint,
    print_mask: Mask,
    depth: DepthMap,
}

/// The files of one alignment, encoded.
pub(super) struct EncodedAlignment {
    depth_mask: Vec<u8>,
    aligned_depth: Vec<u8>,
    aligned_mask: Vec<u8>,
    overlay: Vec<u8>,
}

/// A print as given and as decoded.
#[derive(Debug)]
pub struct SourcePrint {
    bytes: Vec<u8>,
    /// As decoded.
    pub picture: PrintImage,
}

impl SourcePrint {
    /// Reads a pair's print and makes sure it is the one that was aligned.
    ///
    /// # Errors
    /// When it cannot be read or decoded, or is another one.
    pub fn read(
        project: &Project,
        pair: &PairResults,
        limits: &raster::ImageLimits,
    ) -> Result<Self, FilesError> {
        let path = project.input_path(&pair.attributes.print_path);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) => return Err(FilesError::SourcePrint { path, source }),
        };
        let aligned = pair
            .stage(Stage::Normalize)
            .and_then(|record| record.print_hash);
        if aligned.is_some_and(|hash| hash != ContentHash::of(&bytes)) {
            return Err(FilesError::Changed(path));
        }
        match raster::decode(&bytes, limits) {
            Ok(picture) => Ok(Self { bytes, picture }),
            Err(source) => Err(FilesError::Decode { path, source }),
        }
    }

    /// Ending of the file name that goes with the content.
    fn ext(&self) -> &'static str {
        match FileKind::of(&self.bytes) {
            FileKind::Png => "png",
            FileKind::Jpeg => "jpg",
            FileKind::Tiff => "tif",
            FileKind::OtherImage(_)
            | FileKind::Ply
            | FileKind::OtherMesh(_)
            | FileKind::Other(_)
            | FileKind::Text
            | FileKind::Binary => "img",
        }
    }
}

impl<'a> PairFiles<'a> {
    /// Reads what the files are made from.
    pub(super) fn read(
        project: &'a Project,
        pair: &'a PairResults,
        limits: &raster::ImageLimits,
    ) -> Result<Self, FilesError> {
        let aligned = PairArtifacts::new(project, pair);
        Ok(Self {
            aligned,
            name: pair.attributes.name.as_str(),
            print: SourcePrint::read(project, pair, limits)?,
            print_mask: aligned.print_mask()?,
            depth: aligned.depth()?,
        })
    }

    /// The results this was read for.
    pub(super) const fn aligned(&self) -> &PairArtifacts<'a> {
        &self.aligned
    }

    /// Writes the files that all metrics share.
    pub(super) fn write_shared(&self, root: &Path) -> Result<(), FilesError> {
        let files = self.files(ThresholdMetric::NlSsim);
        let canvas = self.aligned.bytes(Stage::Register, CANVAS_PRINT_MASK)?;
        let depth = self.aligned.bytes(Stage::Depth, DEPTH)?;
        write(root, &files.print, &self.print.bytes)?;
        write(root, &files.print_mask, &png_mask(&self.print_mask))?;
        write(root, &files.depth, &depth)?;
        write(
            root,
            &format!("{PAIRS}/{}/depth.json", self.name),
            self.sidecar().as_bytes(),
        )?;
        write(root, &files.canvas_print_mask, &canvas)
    }

    /// Draws what depends on the alignment alone.
    pub(super) fn draw(&self, outcome: &MetricOutcome) -> EncodedAlignment {
        let (width, height) = (self.print_mask.width(), self.print_mask.height());
        let print_from_depth = &outcome.print_from_depth;
        let strokes = self.depth.stroke_mask(outcome.threshold_level);
        let aligned = warp_mask(&strokes, print_from_depth, width, height);
        let heights = warp_depth(&self.depth, print_from_depth, width, height);
        let view = PrintView::to_judge_by(&self.print.picture);
        EncodedAlignment {
            depth_mask: png_mask(&strokes),
            aligned_depth: png_grey16(&heights),
            aligned_mask: png_mask(&aligned),
            overlay: png_rgb8(&view.overlay(&self.print.picture, &self.depth, outcome)),
        }
    }

    /// Writes the files of one metric; says where all files of its line are.
    pub(super) fn write_metric(
        &self,
        root: &Path,
        metric: ThresholdMetric,
        drawn: &EncodedAlignment,
    ) -> Result<Files, FilesError> {
        let files = self.files(metric);
        let role = canvas_depth_mask(metric);
        let canvas = self.aligned.bytes(Stage::Register, &role)?;
        write(root, &files.depth_mask, &drawn.depth_mask)?;
        write(root, &files.aligned_depth, &drawn.aligned_depth)?;
        write(root, &files.aligned_mask, &drawn.aligned_mask)?;
        write(root, &files.canvas_depth_mask, &canvas)?;
        write(root, &files.overlay, &drawn.overlay)?;
        Ok(files)
    }

    fn files(&self, metric: ThresholdMetric) -> Files {
        Files::of(self.name, metric, self.print.ext())
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

/// Writes a file below the export folder, making the folders it lies in.
fn write(root: &Path, below: &str, bytes: &[u8]) -> Result<(), FilesError> {
    let path = root.join(below);
    let made = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    made.and_then(|()| std::fs::write(&path, bytes))
        .map_err(|source| FilesError::Write { path, source })
}

#[cfg(test)]
mod tests {
    use super::Files;
    use crate::domain::ThresholdMetric;

    #[test]
    fn metrics_share_what_is_the_same_and_part_what_is_not() {
        let density = Files::of("b01-2", ThresholdMetric::Density, "jpg");
        let ensemble = Files::of("b01-2", ThresholdMetric::Ensemble, "jpg");
        assert_eq!(density.print, "pairs/b01-2/print.jpg");
        assert_eq!(density.depth, ensemble.depth);
        assert_eq!(density.aligned_mask, "pairs/b01-2/density/aligned_mask.png");
        assert_ne!(density.canvas_depth_mask, ensemble.canvas_depth_mask);
    }
}
