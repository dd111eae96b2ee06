//! Length units of meshes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{any_case, enum_names};

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
    /// Parses a short or a long name, such as `mm` and `millimeters`. Upper and lower case are equal.
    ///
    /// # Errors
    /// Returns an error that shows the name as it was typed.
    pub fn named(text: &str) -> Result<Self, String> {
        match text.trim().to_lowercase().as_str() {
            "millimeter" | "millimeters" | "millimetre" | "millimetres" => Ok(Self::Mm),
            "centimeter" | "centimeters" | "centimetre" | "centimetres" => Ok(Self::Cm),
            "meter" | "meters" | "metre" | "metres" => Ok(Self::M),
            "inch" | "inches" => Ok(Self::In),
            _ => any_case(text),
        }
    }

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

#[cfg(test)]
mod tests {
    use super::LengthUnit;

    #[test]
    fn long_names_are_read_in_any_case() {
        for (text, unit) in [
            (" Millimeters", LengthUnit::Mm),
            ("centimetre", LengthUnit::Cm),
            ("METERS", LengthUnit::M),
            ("inches", LengthUnit::In),
            ("In", LengthUnit::In),
        ] {
            assert_eq!(LengthUnit::named(text), Ok(unit), "{text}");
        }
        let refused = LengthUnit::named("Feet").expect_err("no unit");
        assert!(refused.starts_with("\"Feet\" is not a unit"), "{refused}");
    }
}
