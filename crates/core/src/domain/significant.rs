//! Numbers with a fixed number of significant digits, for lengths in any unit.

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

#[cfg(test)]
mod tests {
    use super::significant;

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
