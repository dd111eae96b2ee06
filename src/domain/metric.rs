//! The three ways of choosing the depth threshold that the paper compares.

use serde::{Deserialize, Serialize};

/// How the height at which a depth map becomes a mask is chosen (paper III-C).
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
}

impl ThresholdMetric {
    /// Every metric in the order of the paper's table.
    pub const ALL: [Self; 3] = [Self::NlSsim, Self::Density, Self::Ensemble];

    /// Name in JSON, in the catalog and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NlSsim => "nl_ssim",
            Self::Density => "density",
            Self::Ensemble => "ensemble",
        }
    }

    /// Name in the printed table, as the paper has it.
    pub const fn title(self) -> &'static str {
        match self {
            Self::NlSsim => "Non-luminous SSIM",
            Self::Density => "Pixel density",
            Self::Ensemble => "Ensemble",
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
            .ok_or_else(|| format!("{text:?} is not a metric (nl_ssim, density, ensemble)"))
    }
}
