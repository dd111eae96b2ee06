//! Formats of numbers in reports. JSON and CSV reports do not use them, because they hold all digits.
//!
//! - A share of counted results, such as Acc, is a percentage with one decimal: `96.6 %`. Below 1 it is never `100.0 %`.
//! - A score, confidence, height or coefficient has three decimals: `0.872`.
//! - An interval has the format of its value, with an en dash: `88.5–99.1`. After its value it is in parentheses:
//!   `96.6 % (88.5–99.1)`. If its bounds may be negative, it has a comma instead: `-0.050, 0.050`.
//! - Angles have two decimals, seconds and percentages of a length have one, counts and milliseconds have none. A comma
//!   separates thousands.
//! - A p-value has three decimals, and is `<0.001` below that.

/// The kind of a number, which determines its format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberStyle {
    /// A whole number.
    Count,
    /// A score, confidence, height or coefficient, usually in 0..=1.
    Score,
    /// A share of counted results, in 0..=1, shown in percent.
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
            Self::Share | Self::Percent | Self::Seconds => 1,
            Self::Degrees => 2,
            Self::Score | Self::PValue => 3,
        }
    }
}

/// Formats a number in its style, without a unit or sign of percent.
pub fn format_number(value: f64, style: NumberStyle) -> String {
    if style == NumberStyle::PValue && value < 0.0005 {
        return "<0.001".to_owned();
    }
    let value = match style {
        NumberStyle::Share => 100.0 * value,
        _ => value,
    };
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

/// Formats a share in 0..=1 of counted results for a table in percent, such as `96.6`. A share below 1 is at most
/// `99.9`, and one above 0 at least `0.1`.
pub fn format_share(share: f64) -> String {
    let rounded = share.clamp(0.001, 0.999);
    let is_whole = share <= 0.0 || share >= 1.0;
    format_number(if is_whole { share } else { rounded }, NumberStyle::Share)
}

/// Formats the bounds of an interval, such as `88.5–99.1`.
pub fn format_interval(bounds: [f64; 2], style: NumberStyle) -> String {
    let bounds = bounds.map(|bound| format_number(bound, style));
    bounds.join("\u{2013}")
}

/// Formats a share in 0..=1 of counted results with its interval, such as `96.6 % (88.5–99.1)`.
pub fn format_rate(share: f64, interval: Option<[f64; 2]>) -> String {
    let mut text = format!("{} %", format_share(share));
    text.extend(
        interval.map(|bounds| format!(" ({})", format_interval(bounds, NumberStyle::Share))),
    );
    text
}

/// Formats a p-value in a sentence, such as `p = 0.016` or `p < 0.001`.
pub fn format_p(p: f64) -> String {
    let text = format_number(p, NumberStyle::PValue);
    match text.strip_prefix('<') {
        Some(limit) => format!("p < {limit}"),
        None => format!("p = {text}"),
    }
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

/// Joins words by commas and, before the last one, by `and`.
pub fn joined(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::NumberStyle::{Count, Degrees, PValue, Percent, Score, Seconds, Share};
    use super::{format_interval, format_number, format_p, format_rate, format_share};

    #[test]
    fn every_style_has_its_decimals_and_thousands_are_separated() {
        let table = [
            (999.0, Count, "999"),
            (1000.0, Count, "1,000"),
            (1_234_567.0, Count, "1,234,567"),
            (0.9949, Score, "0.995"),
            (-0.05, Score, "-0.050"),
            (-0.0004, Score, "0.000"),
            (-0.0006, Score, "-0.001"),
            (0.9949, Share, "99.5"),
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
    #[test]
    fn only_all_and_none_are_rounded_to_100_and_0_percent() {
        let shares = [1.0, 0.9999, 0.99949, 0.5, 0.0001, 0.0];
        let wanted = ["100.0", "99.9", "99.9", "50.0", "0.1", "0.0"];
        assert_eq!(shares.map(format_share), wanted);
    }

    #[test]
    fn intervals_follow_the_format_of_their_value() {
        assert_eq!(
            format_rate(0.95, Some([0.901, 0.976])),
            "95.0 % (90.1–97.6)"
        );
        assert_eq!(format_rate(1.0, None), "100.0 %");
        assert_eq!([0.0156, 0.0].map(format_p), ["p = 0.016", "p < 0.001"]);
        assert_eq!(format_interval([0.81, 0.9], Score), "0.810–0.900");
    }
}
