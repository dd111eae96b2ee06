//! Formats of numbers in reports.

/// The kind of a number, which determines its format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberStyle {
    /// A whole number.
    Count,
    /// A share, score or probability in 0..=1.
    Share,
    /// A percentage.
    Percent,
    /// An angle in degrees.
    Degrees,
    /// Milliseconds.
    Milliseconds,
    /// Seconds.
    Seconds,
    /// The p-value of a test.
    PValue,
}

impl NumberStyle {
    /// Returns the digits after the decimal point.
    pub const fn decimals(self) -> usize {
        match self {
            Self::Count | Self::Milliseconds => 0,
            Self::Percent | Self::Seconds => 1,
            Self::Degrees => 2,
            Self::Share | Self::PValue => 3,
        }
    }
}

/// Formats a number for a report. JSON and CSV reports do not use this format, because they hold all digits.
///
/// The number of decimals is 3 for shares and p-values, 2 for angles, 1 for percentages and seconds, and 0 for counts
/// and milliseconds. A comma separates thousands. A p-value that would round to 0 is `<0.001`.
pub fn format_number(value: f64, style: NumberStyle) -> String {
    if style == NumberStyle::PValue && value < 0.0005 {
        return "<0.001".to_owned();
    }
    let mut text = format!("{value:.*}", style.decimals());
    // A negative number that rounds to zero has no sign.
    if !text.contains(|c| matches!(c, '1'..='9')) {
        text = text.replace('-', "");
    }
    let digits_end = text.find('.').unwrap_or(text.len());
    let digits_start = usize::from(text.starts_with('-'));
    let mut grouped = String::with_capacity(text.len() + 3);
    for (i, digit) in text.char_indices() {
        let left = digits_end.saturating_sub(i);
        if i > digits_start && left > 0 && left.is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// Returns a count as text.
pub fn format_count(n: u64) -> String {
    format_number(n as f64, NumberStyle::Count)
}

/// Returns a count with its noun, such as `1 pair` and `2,000 pairs`.
pub fn counted(n: u64, noun: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{} {noun}{plural}", format_count(n))
}

/// Returns the counts that are not 0, such as `2 failed, 1 not finished`. Returns `None` if all counts are 0.
pub fn count_list<const N: usize>(counts: [(u64, &str); N]) -> Option<String> {
    let known = counts.into_iter().filter(|(n, _)| *n > 0);
    let parts: Vec<String> = known
        .map(|(n, what)| format!("{} {what}", format_count(n)))
        .collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::NumberStyle::{Count, Degrees, PValue, Percent, Seconds, Share};
    use super::format_number;

    #[test]
    fn every_style_has_its_decimals_and_thousands_are_separated() {
        let table = [
            (999.0, Count, "999"),
            (1000.0, Count, "1,000"),
            (1_234_567.0, Count, "1,234,567"),
            (0.9949, Share, "0.995"),
            (-0.05, Share, "-0.050"),
            (-0.0004, Share, "0.000"),
            (-0.0006, Share, "-0.001"),
            (-0.4, Count, "0"),
            (12.34, Percent, "12.3"),
            (-179.996, Degrees, "-180.00"),
            (-123_456.78, Seconds, "-123,456.8"),
            (0.0004, PValue, "<0.001"),
            (0.0215, PValue, "0.021"),
        ];
        for (value, style, wanted) in table {
            assert_eq!(format_number(value, style), wanted);
        }
    }
}
