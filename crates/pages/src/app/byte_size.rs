//! Numbers as text: of bytes, and in groups of digits.

/// Returns a number of bytes as a person reads it.
pub(super) fn file_size(bytes: u64) -> String {
    match bytes {
        0..=9_999 => format!("{bytes} B"),
        10_000..=999_999 => format!("{} kB", bytes / 1000),
        1_000_000..=999_999_999 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// Returns a number with a thin space between groups of three digits.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::file_size;

    #[test]
    fn bytes_have_a_unit_that_fits() {
        for (bytes, text) in [
            (7, "7 B"),
            (12_345, "12 kB"),
            (2_500_000, "2.5 MB"),
            (1 << 30, "1.1 GB"),
        ] {
            assert_eq!(file_size(bytes), text);
        }
    }
}
