//! Numbers with a fixed number of significant digits, for lengths in any unit, and numbers with a fixed number of decimals.

use mocban_core::domain::LengthUnit;

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
/// Most decimals: a nanometre in metres.
const MAX_DECIMALS: i32 = 9;

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

/// Formats a number with this many significant digits and without an exponent. Digits before the decimal point are all kept.
pub(crate) fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value:.0}").replace("-0", "0");
    }
    let decimals = |value: f64| digits - 1 - value.abs().log10().floor() as i32;
    let clamped = |decimals: i32| decimals.clamp(0, MAX_DECIMALS) as usize;
    let text = format!("{value:.*}", clamped(decimals(value)));
    // Rounding may add a digit, as from 0.9996 to 1.000.
    match text.parse::<f64>() {
        Ok(rounded) if rounded != 0.0 => format!("{value:.*}", clamped(decimals(rounded))),
        Ok(_) | Err(_) => "0".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::{DEGREES, PIXELS, SCORE, fixed, significant};

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

    #[test]
    fn lengths_keep_their_digits_in_any_unit() {
        for (value, expected) in [
            (2.134_56, "2.13"),
            (0.002_134_56, "0.00213"),
            (0.084_037_6, "0.0840"),
            (0.000_014_8, "0.0000148"),
            (1234.5, "1234"),
            (-0.065_602, "-0.0656"),
            (0.999_6, "1.00"),
            (99.96, "100"),
            (0.0, "0"),
            (-0.0, "0"),
            (1e-15, "0"),
        ] {
            assert_eq!(significant(value, 3), expected, "{value}");
        }
    }
}
