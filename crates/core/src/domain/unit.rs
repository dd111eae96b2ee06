//! Length units of meshes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::spelling::{plain_form, quoted};
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

/// Letters of the longest name whose blanks and hyphens count.
const SHORT_NAME: usize = 4;
/// Long names of units in plain form, in the languages of those who scan woodblocks. Those of micrometres are in
/// [`MICROMETRES`].
const LONG_NAMES: [(LengthUnit, &[&str]); 4] = [
    (
        LengthUnit::Mm,
        &[
            "millimeter",
            "millimeters",
            "millimetre",
            "millimetres",
            "milimeter",
            "milimeters",
            "milimetre",
            "milimetres",
            "milimetro",
            "milimetros",
            "milimet",
            "毫米",
            "㎜",
        ],
    ),
    (
        LengthUnit::Cm,
        &[
            "centimeter",
            "centimeters",
            "centimetre",
            "centimetres",
            "centimetro",
            "centimetros",
            "zentimeter",
            "centimet",
            "xentimet",
            "xangtimet",
            "厘米",
            "㎝",
        ],
    ),
    (
        LengthUnit::M,
        &[
            "meter", "meters", "metre", "metres", "metro", "metros", "met", "米",
        ],
    ),
    (
        LengthUnit::In,
        &[
            "inch", "inches", "zoll", "pouce", "pouces", "pulgada", "pulgadas", "英寸", "\"", "″",
        ],
    ),
];

/// Names of micrometres, in plain form. They are recognized, but no mesh is read in this unit.
const MICROMETRES: [&str; 17] = [
    "um",
    "µm",
    "μm",
    "㎛",
    "µ",
    "μ",
    "micron",
    "microns",
    "micrometer",
    "micrometers",
    "micrometre",
    "micrometres",
    "mikrometer",
    "mikrometre",
    "micromet",
    "mikromet",
    "微米",
];

impl LengthUnit {
    /// Parses a short or a long name, such as `mm` and `millimeters`, which may be in brackets or end in a full stop. Upper and
    /// lower case are equal.
    ///
    /// # Errors
    /// Returns an error that shows the name as it was typed. Micrometres have their own.
    pub fn named(text: &str) -> Result<Self, String> {
        let name = bare_name(text);
        let long = long_form(name);
        let mut units = LONG_NAMES.into_iter();
        let of_long = units.find(|(_, names)| names.contains(&&*long));
        if let Some((unit, _)) = of_long {
            return Ok(unit);
        }
        if is_micrometres(&long) {
            let typed = quoted(text.trim());
            return Err(format!(
                "micrometres ({typed}) are not read; divide the coordinates by 1000 and use mm"
            ));
        }
        any_case(name).or_else(|_: String| any_case(text))
    }

    /// Returns whether a text is the name of a unit, also of micrometres, which are not read.
    pub fn is_name(text: &str) -> bool {
        Self::named(text).is_ok() || is_micrometres(&long_form(bare_name(text)))
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

/// Returns a name without brackets around it and without full stops at its end.
fn bare_name(text: &str) -> &str {
    let mut name = text.trim();
    for (open, close) in [("(", ")"), ("[", "]"), ("{", "}"), ("<", ">")] {
        let inner = name.strip_prefix(open);
        let inner = inner.and_then(|inner| inner.strip_suffix(close));
        name = inner.unwrap_or(name).trim();
    }
    let bare = name.trim_end_matches('.').trim_end();
    if bare.is_empty() { name } else { bare }
}

/// Returns a name in lower case, without accents, hyphens and blanks, which some languages write between syllables.
fn long_form(name: &str) -> String {
    let mut plain = plain_form(name);
    if name.chars().count() > SHORT_NAME {
        plain.retain(|c| c != '-' && c != ' ');
    }
    plain
}

fn is_micrometres(long_form: &str) -> bool {
    MICROMETRES.contains(&long_form)
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
            ("(mm)", LengthUnit::Mm),
            ("[ CM. ]", LengthUnit::Cm),
            ("in.", LengthUnit::In),
            ("milimét", LengthUnit::Mm),
            ("Xăng-ti-mét", LengthUnit::Cm),
            ("mét", LengthUnit::M),
            ("Zentimeter", LengthUnit::Cm),
            ("\"", LengthUnit::In),
            ("毫米", LengthUnit::Mm),
        ] {
            assert_eq!(LengthUnit::named(text), Ok(unit), "{text}");
        }
        let refused = LengthUnit::named("Feet").expect_err("no unit");
        assert!(refused.starts_with("\"Feet\" is not a unit"), "{refused}");
        for text in ["", ".", "()", "m m", "m-m", "mm cm", "(mm", "mm2"] {
            assert!(LengthUnit::named(text).is_err(), "{text}");
        }
    }

    #[test]
    fn micrometres_are_refused_with_the_way_to_mm() {
        for text in [
            "µm",
            "\u{3bc}m",
            "(um)",
            "Microns",
            "micrometres",
            "mikrômét",
        ] {
            assert_eq!(
                LengthUnit::named(text),
                Err(format!(
                    "micrometres (\"{text}\") are not read; divide the coordinates by 1000 and use mm"
                ))
            );
            assert!(LengthUnit::is_name(text), "{text}");
        }
        assert!(LengthUnit::is_name("mm") && !LengthUnit::is_name("x"));
    }
}
