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
}
