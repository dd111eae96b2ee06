//! What speaks for and against an alignment.

use serde::{Deserialize, Serialize};

/// How well relief and print agree at the best pose, and how well at the best of the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Correlation of relief and ink over what both know, over what each holds; at most 1.
    pub correlation: f64,
    /// Share of the tops that have printed, 0..=1.
    pub tops_met: f64,
    /// Share of the ink that has tops under it, 0..=1.
    pub ink_met: f64,
    /// Score of the best pose at another angle, over that of the best pose.
    pub other_angle: f64,
    /// Score of the best pose of the mirrored relief, over that of the best pose.
    pub mirrored: f64,
    /// How far the answers lie apart that are found from smaller and larger poses, a share of the depth map's longest
    /// side.
    #[serde(default)]
    pub spread: f64,
}
