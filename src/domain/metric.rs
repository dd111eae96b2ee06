//! The ways of choosing the depth threshold: the three that the paper compares, and one by the relief alone.

use serde::{Deserialize, Serialize};

/// How the height at which a depth map becomes a mask is chosen (paper III-C).
///
/// The paper's three match the mask to the print and so copy its ink spread; [`Self::Relief`] does not look at the
/// print and is true to the wood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ThresholdMetric {
    /// The threshold with the highest mean of `(2 s_xy + C) / (s_x^2 + s_y^2 + C)`: SSIM without its
    /// luminance factor (Wang et al. 2004, doi:10.1109/TIP.2003.819861). Higher is better.
    NlSsim,
    /// The threshold whose share of ink is closest to the print's, the same or slightly denser.
    /// Lower difference is better.
    Density,
    /// Both: the better by the registered masks' agreement, as the settings say.
    Ensemble,
    /// A fixed share of the relief below the fitted tops, from geometry alone. No score: the print has no say.
    Relief,
}

impl ThresholdMetric {
    /// Every metric: the paper's in the order of its table, then ours.
    pub const ALL: [Self; 4] = [Self::NlSsim, Self::Density, Self::Ensemble, Self::Relief];
    /// The paper's three, which every method gives.
    pub const PAPER: [Self; 3] = [Self::NlSsim, Self::Density, Self::Ensemble];

    /// Name in JSON, in the catalog and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NlSsim => "nl_ssim",
            Self::Density => "density",
            Self::Ensemble => "ensemble",
            Self::Relief => "relief",
        }
    }

    /// Name in the printed table; the paper's as the paper has them.
    pub const fn title(self) -> &'static str {
        match self {
            Self::NlSsim => "Non-luminous SSIM",
            Self::Density => "Pixel density",
            Self::Ensemble => "Ensemble",
            Self::Relief => "Relief",
        }
    }
}

impl std::fmt::Display for ThresholdMetric {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for ThresholdMetric {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|metric| metric.name() == text)
            .ok_or_else(|| format!("{text:?} is not a metric (nl_ssim, density, ensemble, relief)"))
    }
}
