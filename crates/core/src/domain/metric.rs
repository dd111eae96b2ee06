//! The metrics that choose the depth threshold: the paper's three metrics, and one that measures the relief.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::enum_names;

/// How the threshold between strokes and background of a depth map is selected (paper III-C).
///
/// `P` is the ink mask of the print. `D(t)` is the depth mask: the pixels at or above the height `t`. The default
/// method compares the masks after alignment, where both images have data. It tries 40 depths `d` below the stroke
/// tops, from `register.threshold_min` to `register.threshold_max` (shares of the carving's depth). Their square roots
/// are evenly spaced. The paper's method compares the masks before alignment, over fixed ranges of grey levels. It scales
/// each mask by its bounding box and centres it on its centroid.
///
/// The default method first corrects the ink's spread. The spread `r` is the robust mean distance of the edge of
/// [`Self::Relief`]'s mask from the edge of `P`: positive if the ink spreads over the wood, negative if dry ink leaves
/// the rim of the strokes bare. `P'` is `P` with its edge moved inward by `r`. `s` is the signed distance from the edge
/// of `P'`, in pixels of a canvas of half the size (positive on ink).
///
/// The paper's three metrics match the print. `relief` follows the relief, and uses the print only where the
/// relief leaves the depth uncertain.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum ThresholdMetric {
    /// Maximizes `mean((2 s_xy + C) / (s_x^2 + s_y^2 + C))`, from the local variances and the covariance of `P'` and
    /// `D(t)`. This is SSIM without its luminance factor (Wang et al. 2004, doi:10.1109/TIP.2003.819861). The score is
    /// the maximum.
    NlSsim,
    /// Minimizes `|a(D(t)) / a(P') - 1|`, where `a` counts pixels. Strokes far from any ink (`s <= -3`) and ink below
    /// the deepest threshold are left out. The paper's method minimizes `|d(D(t)) - d(P)|`, where `d` is a mask's share
    /// of the canvas. The score is minus the minimum.
    Density,
    /// Maximizes `sum over D(t) of w / sum of max(w, 0) - 0.05 ln(d / d_r)^2`. `w` is `s` clamped to -1..=1, and `d_r`
    /// is the depth of `relief`. The score is the maximum. The first term is 1 if the strokes cover all ink and
    /// no paper. The paper's method uses the better of `nl_ssim` and `density`, by the IoU of the
    /// registered masks.
    Ensemble,
    /// Selects the depth at which the stroke tops end and the walls begin. The relief gives an estimate and its
    /// uncertainty: the smallest depth at which the mean steepness reaches `g_w^0.78 max(g_t, 0.05 g_w)^0.22`, where
    /// `g_w` is the steepness of the walls, and `g_t` that of the flattest tops. The uncertainty is small if the tops
    /// are flat and the walls are even, and large if wear has rounded the strokes. Each tried depth has a
    /// probability: the normalized product of the densities of this estimate and of the ink's spread, which is
    /// usually 3 % of the stroke width. The metric maximizes the expected IoU under these probabilities. The score is
    /// always 0. On a levelled depth map, whose heights come from the ink, it then takes the nearest depth that agrees with
    /// the ink about as well as the best one. Not part of the paper's method.
    Relief,
}

enum_names! { pub ThresholdMetric, "a metric":
    NlSsim = "nl_ssim", Density = "density", Ensemble = "ensemble", Relief = "relief",
}

impl Default for ThresholdMetric {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl ThresholdMetric {
    /// The metric of everything that shows one result per pair: files, contact sheets, the headline of a report, and the
    /// pairs of low confidence in `status`. Both methods compute it.
    pub const DEFAULT: Self = Self::Ensemble;

    /// The paper's three metrics, which both methods compute.
    pub const PAPER: [Self; 3] = [Self::NlSsim, Self::Density, Self::Ensemble];

    /// Returns the name in the printed table. The paper's metrics have the names that the paper uses.
    pub const fn title(self) -> &'static str {
        match self {
            Self::NlSsim => "Non-luminous SSIM",
            Self::Density => "Pixel density",
            Self::Ensemble => "Ensemble",
            Self::Relief => "Relief",
        }
    }
}
