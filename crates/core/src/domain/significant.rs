//! Numbers with a fixed number of significant digits, for lengths in any unit, or with a fixed number of decimals.

/// Most decimals: a nanometre in metres.
const MAX_DECIMALS: i32 = 9;

/// Formats a number with this many significant digits and without an exponent. Digits before the decimal point are all kept.
pub fn significant(value: f64, digits: i32) -> String {
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

/// Formats a number with this many decimals. A number that rounds to zero has no sign.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if !zero.contains(|c| matches!(c, '1'..='9')) => zero.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::{fixed, significant};

    #[test]
    fn a_number_that_rounds_to_zero_has_no_sign() {
        for (value, decimals, expected) in [
            (-0.004, 2, "0.00"),
            (-0.005_1, 2, "-0.01"),
            (-0.04, 1, "0.0"),
            (0.998, 3, "0.998"),
            (-12.0, 1, "-12.0"),
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
