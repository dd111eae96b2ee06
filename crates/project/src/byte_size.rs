//! Numbers of bytes as text.

/// Returns a number of bytes in the unit that fits, with a decimal point.
pub fn byte_size(bytes: u64) -> String {
    match bytes {
        0..=9_999 => format!("{bytes} B"),
        10_000..=999_999 => format!("{} kB", bytes / 1000),
        1_000_000..=999_999_999 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::byte_size;

    #[test]
    fn sizes_have_the_unit_that_fits() {
        for (bytes, text) in [
            (9_999, "9999 B"),
            (12_345, "12 kB"),
            (12_345_678, "12.3 MB"),
            (12_345_678_901, "12.3 GB"),
        ] {
            assert_eq!(byte_size(bytes), text);
        }
    }
}
