//! Settings and errors of the register stage.

use serde::{Deserialize, Serialize};

use super::observation::Observation;
use crate::stages::score::SsimWindow;
use mocban_core::domain::{Affine2, FailureClass, ThresholdMetric};

/// Settings of the register stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegisterParams {
    /// Largest scale from depth map to print that the pose search tries, 1..=2. The smallest scale is its reciprocal.
    /// Scale 1 gives both areas with data the same longest side.
    pub scale_band: f64,
    /// Working size of the refinement, 32..=1024: the longest side of the area with data, in pixels.
    pub working_px: u32,
    /// Smoothing of the refinement in working pixels (sigma), 0..=10.
    pub smoothing_px: f64,
    /// Whether the pose may have different scales along two perpendicular axes, because a sheet shrinks across its
    /// grain.
    pub anisotropic_scale: bool,
    /// Smallest depth below the tops that is tried as a threshold, as a fraction of the relief's depth.
    pub threshold_min: f64,
    /// Largest depth below the tops that is tried as a threshold, as a fraction of the relief's depth.
    pub threshold_max: f64,
    /// Smallest confidence in the pose, 0..=1, with which a pair is accepted.
    pub min_confidence: f64,
    /// SSIM window, used for the scores and for choosing the threshold of `nl_ssim`.
    pub window: SsimWindow,
    /// Number of angles over the full circle that the paper's method tries first, 4 or more.
    pub coarse_angles: u32,
    /// Number of angular steps in the second search of the paper's method, 2 or more. This search covers three coarse
    /// steps on either side of the best angle.
    pub fine_angles: u32,
}

/// The pose that the registration of a whole block gives a character that was cut from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedPose {
    /// Maps depth-map pixels to print-image pixels.
    pub print_from_depth: Affine2,
    /// How sure the block is of the pose, 0..=1.
    pub confidence: f64,
}

/// Why the register stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegisterError {
    /// Print or relief holds nothing to register.
    #[error("print or relief has no strokes to register")]
    NoPose,
    /// No threshold leaves strokes on the canvas.
    #[error("no threshold gives the depth map any strokes")]
    NoStrokes,
    /// A threshold was not chosen for a metric.
    #[error("normalize chose no threshold for {0}")]
    NoThreshold(ThresholdMetric),
    /// The mask of a threshold is empty.
    #[error("the depth map has no strokes at the threshold of {0}")]
    EmptyMask(ThresholdMetric),
    /// The relief reads in mirror writing.
    #[error(
        "the relief matches the mirrored print better ({} as well as the print itself); the print or the mesh may be mirrored, the print may be of another character, or the scan may show another side of the block",
        ratio(*.times)
    )]
    Mirrored {
        /// Score of the mirrored relief divided by the score as read.
        times: f64,
    },
    /// Nothing correlates.
    #[error(
        "no pose of the relief matches the print: the best correlation is {best:.3}, needs {needs}"
    )]
    NoCorrelation {
        /// Best correlation.
        best: f64,
        /// Smallest that counts.
        needs: f64,
    },
    /// The relief matches the print only if light areas are ink. The print shows dark ink, or the areas surround the
    /// character.
    #[error(
        "the strokes of the print match the valleys of the relief, not its tops; was the mesh mirrored, or does it show the back of the scanned surface?"
    )]
    Inverted,
    /// Strokes of the relief or of the print have no partner in the other one.
    #[error(
        "relief and print have strokes that the other one lacks (confidence in the pose {pose:.2}, in the same character {character:.3}); {seen}"
    )]
    OtherCharacter {
        /// Probability that the best pose is right.
        pose: f64,
        /// Probability that relief and print show the same character.
        character: f64,
        /// What is unusual.
        seen: Observation,
    },
    /// Relief and print show different characters, or the evidence for the best pose is too weak.
    #[error(
        "relief and print do not match: confidence {:.2} in the pose is below register.min_confidence {needs}; {seen}",
        rounded_down(*.confidence)
    )]
    NoMatch {
        /// Probability that the best pose is right.
        confidence: f64,
        /// The setting.
        needs: f64,
        /// What is unusual.
        seen: Observation,
    },
}

/// Rounds down to two decimals, so that what is below a bound is written so.
fn rounded_down(value: f64) -> f64 {
    (100.0 * value).floor() / 100.0
}

/// Largest ratio that is given as a number. A larger ratio means that the upright relief does not match at all.
const LARGEST_RATIO: f64 = 100.0;

/// Formats the ratio of two scores.
fn ratio(times: f64) -> String {
    if times < LARGEST_RATIO {
        format!("{times:.2} times")
    } else {
        format!("more than {LARGEST_RATIO} times")
    }
}

impl RegisterError {
    /// Adds what is unusual about a pair that does not match.
    pub(super) fn with(mut self, observe: impl FnOnce() -> Observation) -> Self {
        if let Self::OtherCharacter { seen, .. } | Self::NoMatch { seen, .. } = &mut self {
            *seen = observe();
        }
        self
    }

    /// Returns what the failure means for the pair.
    pub const fn class(&self) -> FailureClass {
        FailureClass::NoSolution
    }
}
