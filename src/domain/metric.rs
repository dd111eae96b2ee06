//! The metrics that choose the depth threshold: the paper's three metrics, and one that uses the relief alone.

use serde::{Deserialize, Serialize};

use super::enum_names;

/// How the threshold between strokes and background of a depth map is selected (paper III-C).
///
/// `P` is the ink mask of the print. `D(t)` is the depth mask: the pixels at or above the height `t`. The default
/// method compares the masks after alignment, where both images have data. It tries 40 evenly spaced depths below the
/// stroke tops, from `register.threshold_min` to `register.threshold_max` (shares of the carving's depth). The paper's
/// method compares the masks before alignment, over fixed ranges of grey levels. It scales each mask by its bounding
/// box and centres it on its centroid.
///
/// The paper's three metrics depend on the print, so its ink spread can affect them. [`Self::Relief`] depends on the
/// scanned relief alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ThresholdMetric {
    /// Maximizes `mean((2 s_xy + C) / (s_x^2 + s_y^2 + C))`, from the local variances and the covariance of `P` and
    /// `D(t)`. This is SSIM without its luminance factor (Wang et al. 2004, doi:10.1109/TIP.2003.819861). The score is
    /// the maximum.
    NlSsim,
    /// Minimizes `|a(D(t)) / a(P) * s - 1|`, where `a` is a mask's area and `s` is `register.ink_spread`. The paper's
    /// method minimizes `|d(D(t)) - d(P)|`, where `d` is a mask's share of the canvas. The score is minus the minimum.
    Density,
    /// Maximizes the same mean as [`Self::NlSsim`], but only over masks with an area between `A / 1.12` and `1.12 A`.
    /// `A` is the area of [`Self::Relief`]'s mask, clamped to `a(P) / 2.2 ..= 1.15 a(P)`. If no mask qualifies, the
    /// threshold nearest to [`Self::Relief`]'s is used. The score is the mean. The paper's method instead uses the
    /// threshold of [`Self::NlSsim`] or [`Self::Density`], whichever gives the higher IoU of the registered masks.
    Ensemble,
    /// The depth at which the stroke tops end and the walls begin, as a share of the carving's depth. It is computed
    /// from the histogram of heights alone: the geometric mean of 0.075 (the usual value) and a measured depth (clamped
    /// to 0.02..=0.25). The measured depth is the first below the peak with a frequency of at most `min(2.5 w, (w +
    /// peak) / 2)`, where `w` is the median frequency on the walls. The score is 0. Not part of the paper's method.
    Relief,
}

enum_names! { pub ThresholdMetric, "a metric":
    NlSsim = "nl_ssim", Density = "density", Ensemble = "ensemble", Relief = "relief",
}

impl ThresholdMetric {
    /// The paper's three metrics, which both methods compute.
    pub const PAPER: [Self; 3] = [Self::NlSsim, Self::Density, Self::Ensemble];

    /// Returns the name shown in reports. The paper's metrics have the names that the paper uses.
    pub const fn title(self) -> &'static str {
        match self {
            Self::NlSsim => "Non-luminous SSIM",
            Self::Density => "Pixel density",
            Self::Ensemble => "Ensemble",
            Self::Relief => "Relief",
        }
    }
}
