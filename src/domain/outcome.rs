//! What each stage leaves behind in numbers. Pictures go beside it as artifacts.
//!
//! Every outcome is stored as JSON and read back bit for bit, so that a resumed run continues exactly where the
//! interrupted one was.

use serde::{Deserialize, Serialize};

use super::{Affine2, LengthUnit, Rigid3, ThresholdMetric};

/// A second-degree surface over the tops: height over the plane at plane (x, y), all in mesh units.
///
/// `z = c[0] + c[1] x + c[2] y + c[3] x^2 + c[4] x y + c[5] y^2`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bow(pub [f64; 6]);

impl Bow {
    /// Height of the surface at a point of the plane.
    ///
    /// # Examples
    /// ```
    /// use mocban::domain::Bow;
    ///
    /// let bow = Bow([0.0, 0.0, 0.0, 0.5, 0.0, 0.0]);
    /// assert_eq!(bow.height(2.0, 9.0), 2.0);
    /// ```
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let c = &self.0;
        c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y
    }
}

/// What speaks for the side of the plane that was taken to be the carved one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SideEvidence {
    /// Share of the facing area whose winding looks out on the chosen side, 0..=1; `None` without faces.
    pub winding: Option<f64>,
    /// Share of the seen area within a fifth of the relief of the extreme layer on the chosen side, 0..=1.
    pub flatness: f64,
    /// How sure the choice is, 0 (a coin's throw) to 1.
    pub confidence: f64,
}

/// Numbers of the fit stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitOutcome {
    /// Mesh coordinates to the right-handed plane frame, mesh units; z is height, positive out of the block.
    pub plane_from_mesh: Rigid3,
    /// Second-degree surface over the tops, when the residual says the block is bent.
    pub bow: Option<Bow>,
    /// Largest minus smallest height of the bow over the character, mesh units; 0 without bow.
    pub bow_height: f64,
    /// Share of the sampled tops that lie near the fitted surface, 0..=1.
    pub inlier_ratio: f64,
    /// Root mean square distance of those inliers to the surface, mesh units.
    pub rms: f64,
    /// Depth of the carving under the surface, mesh units.
    pub relief: f64,
    /// What speaks for the chosen side.
    pub side: SideEvidence,
    /// Vertices as read, repeated ones counted each time.
    pub vertices: u64,
    /// Triangles as read; 0 for a point set.
    pub triangles: u64,
}

/// How a depth map's levels and pixels are to be read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepthScale {
    /// Height of level 1 over the fitted surface, mesh units.
    pub height_min: f64,
    /// Height between two levels, mesh units.
    pub height_per_level: f64,
    /// Side of a pixel, mesh units.
    pub mesh_unit_per_px: f64,
    /// Plane x, y to depth-map pixels. Holds the reflection: the map reads like the print.
    pub depth_from_plane: Affine2,
    /// The surface that heights are measured from, where it is not the plane itself.
    pub bow: Option<Bow>,
    /// Unit of the mesh, where it is known.
    pub unit: Option<LengthUnit>,
}

impl DepthScale {
    /// Height over the fitted surface of a level 1..=65535, mesh units.
    pub fn height(&self, level: u16) -> f64 {
        self.height_min + f64::from(level.saturating_sub(1)) * self.height_per_level
    }
}

/// Numbers of the depth stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepthOutcome {
    /// Width of the map in pixels.
    pub width: u32,
    /// Height of the map in pixels.
    pub height: u32,
    /// How levels and pixels are to be read.
    pub scale: DepthScale,
    /// Share of the map's pixels that hold data, 0..=1.
    pub coverage: f64,
}

/// The threshold one metric chose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThresholdChoice {
    /// Which metric.
    pub metric: ThresholdMetric,
    /// Depth-map levels from this one up are stroke.
    pub level: u16,
    /// The metric's own score at this level.
    pub score: f64,
    /// Whether the best level was the first or last of the range that was searched.
    pub at_bound: bool,
}

/// One interpretation of the print as ink and background. More than one is kept where the image leaves the polarity
/// or stains unclear; the register stage chooses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct InkHypothesis {
    /// Grey level (0..=65535) between ink and background.
    pub threshold_print: f64,
    /// Whether the print is light on dark, as a rubbing is.
    pub light_on_dark: bool,
    /// Print pixels to the pair's canvas: the ink's longest side has a fixed length, its centroid is in the middle.
    pub canvas_from_print: Affine2,
}

/// Heights of the parts of the carving over the fitted surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReliefHeights {
    /// Height at which most of the stroke tops lie, mesh units.
    pub top: f64,
    /// Median height of the ground, mesh units.
    pub ground: f64,
    /// Depth below `top` at which the tops end and the walls begin, as a share of [`Self::depth`].
    pub tops_end: f64,
}

impl ReliefHeights {
    /// Returns the depth of the carving, `top - ground`, mesh units.
    pub fn depth(&self) -> f64 {
        self.top - self.ground
    }

    /// Returns the depth-map level, 1..=65535, at a depth below the tops given as a share of the relief.
    ///
    /// # Examples
    /// ```
    /// use mocban::domain::{Affine2, DepthScale, ReliefHeights};
    ///
    /// let relief = ReliefHeights { top: 0.0, ground: -1.0, tops_end: 0.08 };
    /// let scale = DepthScale {
    ///     height_min: -1.0,
    ///     height_per_level: 0.001,
    ///     mesh_unit_per_px: 0.02,
    ///     depth_from_plane: Affine2::IDENTITY,
    ///     bow: None,
    ///     unit: None,
    /// };
    /// let level = relief.level_at(&scale, relief.tops_end);
    /// assert!((scale.height(level) - -0.08).abs() < 0.001);
    /// ```
    pub fn level_at(&self, scale: &DepthScale, share: f64) -> u16 {
        let height = self.top - share * self.depth();
        let steps = (height - scale.height_min) / scale.height_per_level;
        (1.0 + steps.round()).clamp(1.0, 65_535.0) as u16
    }
}

/// Numbers of the normalize stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NormalizeOutcome {
    /// Side of the pair's square canvas in pixels.
    pub canvas_px: u32,
    /// Interpretations of the print, the likeliest first; at least one.
    pub inks: Vec<InkHypothesis>,
    /// Heights of tops and ground, from which soft strokes are computed; `None` under the paper's method.
    pub relief: Option<ReliefHeights>,
    /// Thresholds chosen before registration: empty unless under the paper's method, which leaves out the ensemble.
    pub thresholds: Vec<ThresholdChoice>,
}

/// Agreement of the two canvas masks of one metric. See `stages::score` for the formulas.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Structural similarity (Wang et al. 2004), gaussian windows unless set otherwise.
    pub ssim: f64,
    /// The same without the luminance factor.
    pub nl_ssim: f64,
    /// Intersection over union of the masks by pixel.
    pub iou: f64,
    /// Intersection over union of the masks' bounding boxes.
    pub iou_box: f64,
    /// Dice coefficient of the masks by pixel.
    pub dice: f64,
    /// Share of the canvas that is ink.
    pub density_print: f64,
    /// Share of the canvas that is stroke top.
    pub density_depth: f64,
}

/// How well relief and print agree at the best pose, and how well at the best of the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseFeatures {
    /// Correlation of relief and ink over what both know, over what each holds; at most 1.
    pub correlation: f64,
    /// Share of the tops that have printed, 0..=1.
    pub tops_covered: f64,
    /// Share of the ink that has tops under it, 0..=1.
    pub ink_covered: f64,
    /// Score of the best pose at another angle, over that of the best pose.
    pub other_angle: f64,
    /// Score of the best pose of the mirrored relief, over that of the best pose.
    pub mirrored: f64,
    /// How far the answers lie apart that are found from smaller and larger poses, a share of the depth map's longest
    /// side.
    #[serde(default)]
    pub spread: f64,
}

/// One metric's aligned result: a row of the catalog, of the export and, summed up, of the report.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MetricOutcome {
    /// Which metric.
    pub metric: ThresholdMetric,
    /// Depth-map levels from this one up are stroke.
    pub threshold_level: u16,
    /// The same as height over the fitted surface, mesh units.
    pub threshold_depth: f64,
    /// Depth-map pixels to print-image pixels.
    pub print_from_depth: Affine2,
    /// How far the depth map is turned to lie on the print, degrees in (-180, 180], clockwise on the screen.
    pub angle_deg: f64,
    /// Print pixels per depth-map pixel.
    pub scale: f64,
    /// Where the centre of the depth map goes, relative to the centre of the print, print pixels.
    pub shift_px: [f64; 2],
    /// Agreement on the canvas.
    pub scores: Scores,
    /// Best search score less the best of any other pose (another angle, or mirrored); above 0 is right.
    pub margin: f64,
    /// Calibrated chance, 0..=1, that this alignment is right: angle within 5 degrees and landmarks within 5 % of the
    /// character's height. `None` under a method that gives none.
    pub confidence: Option<f64>,
    /// Whether the search ended at a bound of angle, scale or shift.
    pub at_bound: bool,
}

impl MetricOutcome {
    /// Results with less confidence than this are worth a look before they are used.
    pub const LOW_CONFIDENCE: f64 = 0.5;

    /// Whether it is known to be less confident than [`Self::LOW_CONFIDENCE`].
    pub fn is_low_confidence(&self) -> bool {
        self.confidence
            .is_some_and(|confidence| confidence < Self::LOW_CONFIDENCE)
    }
}

/// Numbers of the register stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegisterOutcome {
    /// Which of the normalize stage's interpretations of the print was used, counted from 0.
    pub ink: usize,
    /// One result a metric that the method gives, in the order of [`ThresholdMetric::ALL`].
    pub metrics: Vec<MetricOutcome>,
    /// Evidence for and against the pose that all metrics share; `None` under the paper's method.
    #[serde(default)]
    pub features: Option<PoseFeatures>,
}
