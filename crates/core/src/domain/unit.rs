//! Length units of meshes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::enum_names;

/// Unit of a mesh's coordinates. If the unit is unknown, no lengths in mm are reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
    /// Inches.
    In,
}

enum_names! { pub LengthUnit, "a unit":
    Mm = "mm", Cm = "cm", M = "m", In = "in",
}

impl LengthUnit {
    /// Returns the length of one unit in millimetres.
    ///
    /// ```
    /// use mocban_core::domain::LengthUnit;
    ///
    /// let unit: LengthUnit = "in".parse()?;
    /// assert_eq!(unit.mm(), 25.4);
    /// # Ok::<(), String>(())
    /// ```
    pub const fn mm(self) -> f64 {
        match self {
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::M => 1000.0,
            Self::In => 25.4,
        }
    }

    /// Returns the unit in which a length is usual, or `None` if it is in none. `usual_mm` are the shortest and the longest
    /// usual length. If several units fit, mm is preferred, then m, as scanners and programs for photogrammetry write.
    ///
    /// ```
    /// use mocban_core::domain::LengthUnit;
    ///
    /// assert_eq!(LengthUnit::likely(42.0, [8.0, 150.0]), Some(LengthUnit::Mm));
    /// assert_eq!(LengthUnit::likely(0.042, [8.0, 150.0]), Some(LengthUnit::M));
    /// assert_eq!(LengthUnit::likely(4.2, [8.0, 150.0]), Some(LengthUnit::Cm));
    /// assert_eq!(LengthUnit::likely(5000.0, [8.0, 150.0]), None);
    /// ```
    pub fn likely(length: f64, usual_mm: [f64; 2]) -> Option<Self> {
        let [low, high] = usual_mm;
        let is_usual = |unit: &Self| (low..=high).contains(&(length * unit.mm()));
        let preferred = [Self::Mm, Self::M, Self::Cm, Self::In];
        preferred.into_iter().find(is_usual)
    }
}
