//! Depth map and print to masks on one canvas (paper III-C).
//!
//! Two methods behind one entry. [`Method::Wrap`] is the paper's: wrap both by their boxes and choose thresholds
//! before the rotation is known. [`Method::Aligned`] is ours: find the pose first with soft relief, which needs no
//! threshold, then choose each threshold in the aligned frame.

mod aligned;
mod heap;
mod relief;
mod threshold;
mod wrap;

use serde::{Deserialize, Serialize};

pub use relief::Relief;
pub(in crate::stages) use relief::soft_stroke;
use wrap::box_wrap;

use super::Print;
use super::ink;
use super::score::SsimWindow;
use crate::domain::{Affine2, FailureClass, NormalizeOutcome, Pose, ThresholdMetric};
use crate::raster::{DepthMap, Mask};

/// Raised whenever the same inputs and settings may give another result than before.
pub const REVISION: u32 = 9;

/// When thresholds are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// After the pose was found with soft relief.
    Aligned,
    /// Before, on both pictures wrapped by box and centroid: the paper's.
    Wrap,
}

impl Method {
    /// The metrics that get a threshold, in the order of [`ThresholdMetric::ALL`].
    pub const fn metrics(self) -> &'static [ThresholdMetric] {
        match self {
            Self::Aligned => &ThresholdMetric::ALL,
            Self::Wrap => &ThresholdMetric::PAPER,
        }
    }
}

/// How the print's ink is told from its paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PrintThreshold {
    /// Paper levelled, polarity and threshold found in each image (Otsu).
    Levelled,
    /// Darker than `print_grey` is ink: the paper's.
    Fixed,
}

/// Settings of the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// When thresholds are chosen.
    pub method: Method,
    /// How the print's ink is told from its paper.
    pub print_threshold: PrintThreshold,
    /// Grey 0..=255 below which `fixed` takes a pixel for ink.
    pub print_grey: u8,
    /// Side of the square canvas in pixels, 64..=2048.
    pub canvas_px: u32,
    /// Longest side of the print character on the canvas in pixels, below `canvas_px`.
    pub character_px: u32,
    /// Largest ratio, up or down, between the sizes of print and depth map that the pose search tries, 1..=2.
    pub scale_band: f64,
    /// Depth under the tops at which `aligned` starts looking for thresholds, as a share of the relief.
    pub cut_from: f64,
    /// Depth under the tops at which `aligned` stops looking for thresholds, as a share of the relief.
    pub cut_to: f64,
    /// `aligned`: the print's ink spreads beyond the wood; density aims at the print's divided by this, 1 or more.
    pub ink_spread: f64,
    /// `wrap`: first and last grey of the density threshold.
    pub density_greys: [u8; 2],
    /// `wrap`: first and last grey of the structure threshold.
    pub structure_greys: [u8; 2],
    /// Window of the structure score.
    pub window: SsimWindow,
}

/// Why the stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The print shows no ink.
    #[error(transparent)]
    Print(#[from] ink::Error),
    /// The depth map has no strokes at any threshold.
    #[error("no threshold gives the depth map any strokes")]
    NoStrokes,
    /// The relief reads in mirror writing.
    #[error(
        "the relief matches the print only in mirror writing ({mirrored:.3} against {upright:.3}); was the mesh mirrored?"
    )]
    Mirrored {
        /// Best score of the mirrored relief.
        mirrored: f64,
        /// Best score as read.
        upright: f64,
    },
    /// Nothing matches.
    #[error(
        "no pose of the relief matches the print: the best correlation is {best:.3}, needs {needs}"
    )]
    NoMatch {
        /// Best correlation.
        best: f64,
        /// Least that counts.
        needs: f64,
    },
}

impl Error {
    /// What the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        match self {
            Self::Print(_) => FailureClass::BadInput,
            Self::NoStrokes | Self::Mirrored { .. } | Self::NoMatch { .. } => {
                FailureClass::NoSolution
            }
        }
    }
}

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
pub fn normalize(depth: &DepthMap, print: &Print, params: &Params) -> Result<Normalized, Error> {
    let readings = match params.print_threshold {
        PrintThreshold::Levelled => print.readings()?.to_vec(),
        PrintThreshold::Fixed => vec![ink::fixed(print.picture(), params.print_grey)?],
    };
    let (ink, canvas_from_print, search, thresholds) = match params.method {
        Method::Aligned => {
            let relief = Relief::of(depth).ok_or(Error::NoStrokes)?;
            let (ink, search) = aligned::search(depth, &relief, readings, params)?;
            let canvas = canvas_from_print(&ink.mask, params).ok_or(Error::NoStrokes)?;
            let thresholds = aligned::thresholds(depth, &relief, &ink, &canvas, &search, params)?;
            (ink, canvas, search, thresholds)
        }
        Method::Wrap => {
            let ink = readings.into_iter().next().ok_or(Error::NoStrokes)?;
            let canvas = canvas_from_print(&ink.mask, params).ok_or(Error::NoStrokes)?;
            let thresholds = wrap::choose(depth, &ink, &canvas, params)?;
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
fn canvas_from_print(ink: &Mask, params: &Params) -> Option<Affine2> {
    box_wrap(
        ink,
        params.canvas_px as usize,
        f64::from(params.character_px),
    )
}

#[cfg(test)]
pub(super) mod tests_support {
    //! Settings for tests of this room.

    use super::{Method, Params, PrintThreshold};
    use crate::stages::score::SsimWindow;

    /// The default method at full size.
    pub(crate) fn params() -> Params {
        Params {
            method: Method::Aligned,
            print_threshold: PrintThreshold::Levelled,
            print_grey: 127,
            canvas_px: 256,
            character_px: 192,
            scale_band: 1.6,
            cut_from: 0.01,
            cut_to: 0.6,
            ink_spread: 1.3,
            density_greys: [50, 139],
            structure_greys: [90, 149],
            window: SsimWindow::Gaussian,
        }
    }
}
