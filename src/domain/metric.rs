//! The metrics that choose the depth threshold: the paper's three metrics, and one that uses the relief alone.

use serde::{Deserialize, Serialize};

use super::enum_names;

/// How the threshold between strokes and background of a depth map is selected (paper III-C).
///
/// `P` is the ink mask of the print. `D(t)` is the depth mask: the heights at and above threshold `t`. The default
/// method compares the masks after alignment, where both images have data, at 40 evenly spaced depths below the stroke
/// tops, from `register.threshold_min` to `register.threshold_max` (shares of the relief). The paper's method compares
/// the masks before alignment, each scaled by its bounding box and centred on its centroid (the paper's wrap W), over
/// the authors' ranges of grey.
///
/// The paper's three metrics are fitted to the print, so the print's ink spread can affect them. [`Self::Relief`]
/// depends on the scanned relief alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ThresholdMetric {
    /// `argmax_t mean((2 s_xy + C) / (s_x^2 + s_y^2 + C))` with the local variances and the covariance of `P` and
    /// `D(t)`: SSIM without its luminance factor (Wang et al. 2004, doi:10.1109/TIP.2003.819861). The score is that
    /// mean.
    NlSsim,
    /// `argmin_t |a(D(t)) / a(P) * s - 1|` with areas `a` and the ink spread `s` (`register.ink_spread`). The score is
    /// minus that value. Under the paper's method `argmin_t |d(D(t)) - d(P)|` with densities `d`, the shares of the
    /// canvas.
    Density,
    /// `argmax_t` of the same mean as [`Self::NlSsim`] among the thresholds with `|ln(a(D(t)) / A)| <= ln 1.12`, where
    /// `A` is the area of [`Self::Relief`]'s mask clamped to `a(P) / 2.2 ..= 1.15 a(P)`; where none is that close, the
    /// threshold nearest to [`Self::Relief`]'s. The score is that mean. Under the paper's method the better of
    /// [`Self::NlSsim`] and [`Self::Density`] by the IoU of the registered masks.
    Ensemble,
    /// The threshold at which the stroke tops end and the walls begin, from the histogram of heights alone: the
    /// geometric mean of 0.075 of the relief (the usual depth) and the depth below the peak at which heights are no
    /// more frequent than `min(2.5 w, (w + peak) / 2)`, where `w` is the median frequency on the walls; that depth is
    /// clamped to 0.02..=0.25. It does not depend on the print and has no score (0). Not part of the paper's method.
    Relief,
}

enum_names! { pub ThresholdMetric, "a metric":
    NlSsim = "nl_ssim", Density = "density", Ensemble = "ensemble", Relief = "relief",
}

impl ThresholdMetric {
    /// The paper's three, which both methods give.
    pub const PAPER: [Self; 3] = [Self::NlSsim, Self::Density, Self::Ensemble];

    /// Returns the name in the printed table; the paper's metrics as the paper names them.
    pub const fn title(self) -> &'static str {
        match self {
            Self::NlSsim => "Non-luminous SSIM",
            Self::Density => "Pixel density",
            Self::Ensemble => "Ensemble",
            Self::Relief => "Relief",
        }
    }
}
