//! Depth map and print to masks on one canvas (paper III-C).
//!
//! Two methods behind one entry. [`NormalizeMethod::BoundingBox`] is the paper's: wrap both by their boxes and choose thresholds
//! before the rotation is known. [`NormalizeMethod::PoseFirst`] is ours: find the pose first with soft relief, which needs no
//! threshold, then choose each threshold in the aligned frame.

mod height_histogram;
mod params;
mod pose_search;
mod relief;
mod threshold;

pub use params::{NormalizeError, NormalizeMethod, NormalizeParams, PrintThreshold};
pub use relief::Relief;
pub(super) use relief::soft_stroke;

use super::binarize;
use super::paper_method::normalize::{self as bounding_box, box_wrap};
use super::print::Print;
use crate::domain::{Affine2, NormalizeOutcome, Pose};
use crate::raster::{DepthMap, Mask};

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 9;

/// What the stage gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Normalized {
    /// The numbers.
    pub outcome: NormalizeOutcome,
    /// Ink of the print, in the print image frame.
    pub ink: Mask,
    /// Where the print image is paper or ink; outside it (white beyond the cut) nothing is known.
    pub known: Mask,
}

/// What the pose search found; empty for the method that registers afterwards.
#[derive(Debug, Default)]
struct Search {
    poses: Vec<Pose>,
    mirrored: Option<Pose>,
    at_bound: bool,
}

impl Search {
    /// Score of the best pose as read.
    fn score(&self) -> f64 {
        self.poses.first().map_or(0.0, |pose| pose.score)
    }
}

/// Finds the print's ink, the canvas, and each metric's depth threshold.
///
/// `depth` reads like the print; `print` is the whole image as given. The outcome's poses map depth-map pixels to
/// print pixels, best first; `wrap` leaves them to the register stage.
///
/// # Errors
/// When the print shows no ink, the depth map no strokes, or no pose fits.
pub fn normalize(
    depth: &DepthMap,
    print: &Print,
    params: &NormalizeParams,
) -> Result<Normalized, NormalizeError> {
    let hypotheses = match params.print_threshold {
        PrintThreshold::Adaptive => print.hypotheses()?.to_vec(),
        PrintThreshold::Fixed => vec![binarize::fixed(print.picture(), params.print_grey)?],
    };
    let (ink, canvas_from_print, search, thresholds) = match params.method {
        NormalizeMethod::PoseFirst => {
            let relief = Relief::of(depth).ok_or(NormalizeError::NoStrokes)?;
            let (ink, search) = pose_search::search(depth, &relief, hypotheses, params)?;
            let canvas = canvas_from_print(&ink.mask, params).ok_or(NormalizeError::NoStrokes)?;
            let thresholds =
                pose_search::thresholds(depth, &relief, &ink, &canvas, &search, params)?;
            (ink, canvas, search, thresholds)
        }
        NormalizeMethod::BoundingBox => {
            let ink = hypotheses
                .into_iter()
                .next()
                .ok_or(NormalizeError::NoStrokes)?;
            let canvas = canvas_from_print(&ink.mask, params).ok_or(NormalizeError::NoStrokes)?;
            let thresholds = bounding_box::choose(depth, &ink, &canvas, params)?;
            (ink, canvas, Search::default(), thresholds)
        }
    };
    Ok(Normalized {
        outcome: NormalizeOutcome {
            threshold_print: ink.threshold * 65_535.0,
            light_on_dark: ink.light_on_dark,
            canvas_px: params.canvas_px,
            canvas_from_print,
            poses: search.poses,
            mirrored: search.mirrored,
            search_at_bound: search.at_bound,
            thresholds,
        },
        ink: ink.mask,
        known: ink.soft.known,
    })
}

/// The pair's canvas: the ink's longest side takes `character_px`, its centroid is in the middle.
fn canvas_from_print(ink: &Mask, params: &NormalizeParams) -> Option<Affine2> {
    box_wrap(
        ink,
        params.canvas_px as usize,
        f64::from(params.character_px),
    )
}

#[cfg(test)]
pub(super) mod tests_support {
    //! Settings for tests of this room.

    use super::{NormalizeMethod, NormalizeParams, PrintThreshold};
    use crate::stages::score::SsimWindow;

    /// The default method at full size.
    pub(crate) fn params() -> NormalizeParams {
        NormalizeParams {
            method: NormalizeMethod::PoseFirst,
            print_threshold: PrintThreshold::Adaptive,
            print_grey: 127,
            canvas_px: 256,
            character_px: 192,
            scale_band: 1.6,
            threshold_min: 0.01,
            threshold_max: 0.6,
            ink_spread: 1.3,
            density_greys: [50, 139],
            structure_greys: [90, 149],
            window: SsimWindow::Gaussian,
        }
    }
}
