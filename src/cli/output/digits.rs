//! Numbers with a fixed number of significant digits, for lengths in any unit, and numbers with a fixed number of decimals.

use mocban_core::domain::LengthUnit;
pub(crate) use mocban_core::domain::significant;

/// Significant digits of lengths.
pub(crate) const LENGTH_DIGITS: i32 = 3;
/// Decimals of scores and confidences.
pub(crate) const SCORE: usize = 3;
/// Decimals of angles in degrees.
pub(crate) const DEGREES: usize = 2;
/// Decimals of scales.
pub(crate) const SCALE: usize = 4;
/// Decimals of shifts in pixels.
pub(crate) const PIXELS: usize = 1;

/// Formats a length of a mesh, such as `0.00213 m`, or `2.13 mesh units` if the unit is unknown.
pub(crate) fn length(value: f64, unit: Option<LengthUnit>) -> String {
    let value = significant(value, LENGTH_DIGITS);
    format!("{value} {}", unit_name(unit))
}

/// Formats a number with this many decimals. A number that rounds to zero has no sign.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if !zero.contains(|c| matches!(c, '1'..='9')) => zero.to_owned(),
        _ => text,
    }
}

/// Returns the unit of lengths of a mesh.
pub(crate) fn unit_name(unit: Option<LengthUnit>) -> &'static str {
    unit.map_or("mesh units", LengthUnit::name)
}

#[cfg(test)]
mod tests {
    use super::{DEGREES, PIXELS, SCORE, fixed};

    #[test]
    fn a_number_that_rounds_to_zero_has_no_sign() {
        for (value, decimals, expected) in [
            (-0.004, DEGREES, "0.00"),
            (-0.005_1, DEGREES, "-0.01"),
            (-0.04, PIXELS, "0.0"),
            (0.998, SCORE, "0.998"),
            (-12.0, PIXELS, "-12.0"),
        ] {
            assert_eq!(fixed(value, decimals), expected);
        }
    }
}
