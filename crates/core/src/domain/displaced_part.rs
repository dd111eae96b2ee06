//! The part of a torn print or a cracked block that has a pose of its own.

use serde::{Deserialize, Serialize};

use super::Affine2;

/// Smaller part of a print whose strokes lie elsewhere than the pose of the rest puts them: the sheet is torn or folded, or
/// the block is cracked.
///
/// ```
/// use mocban_core::domain::{Affine2, DisplacedPart};
///
/// let part = DisplacedPart {
///     normal: [1.0, 0.0],
///     offset_px: 80.0,
///     ink_share: 0.3,
///     shift_px: [9.0, -12.0],
///     angle_deg: 1.5,
///     print_from_depth: Affine2::IDENTITY,
/// };
/// assert!(part.contains([81.0, 5.0]) && !part.contains([79.0, 5.0]));
/// let sentence = "a part of the print with 30 % of the ink lies 15.0 px and 1.5 degrees from where the rest puts it";
/// assert_eq!(part.to_string(), sentence);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DisplacedPart {
    /// Unit vector across the line between the parts, towards this part, in the print.
    pub normal: [f64; 2],
    /// Distance of the line from the print's origin along `normal`, in print pixels.
    pub offset_px: f64,
    /// Share of the ink that lies on this part or within the strip that is left out beside the line.
    pub ink_share: f64,
    /// Where the middle of this part's ink lies, relative to where the pose of the rest puts it, in print pixels.
    pub shift_px: [f64; 2],
    /// Rotation of this part against the rest in degrees, in (-180, 180], positive clockwise on the screen.
    pub angle_deg: f64,
    /// Maps depth-map pixels to print pixels on this part. It is found on images of about 60 pixels, so it is coarse.
    pub print_from_depth: Affine2,
}

impl DisplacedPart {
    /// Returns whether a pixel of the print is on this part.
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        self.normal[0] * x + self.normal[1] * y > self.offset_px
    }
}

impl std::fmt::Display for DisplacedPart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "a part of the print with {:.0} % of the ink lies {:.1} px and {:.1} degrees from where the rest puts it",
            100.0 * self.ink_share,
            self.shift_px[0].hypot(self.shift_px[1]),
            self.angle_deg.abs()
        )
    }
}
