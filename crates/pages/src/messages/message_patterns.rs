//! Patterns of messages: a text with `{}` for each part that varies, and days in them.

/// Returns what stands in a text in place of the `{}` of a pattern, or `None` if the text does not match.
pub(super) fn parts_of<'t>(text: &'t str, pattern: &str) -> Option<Vec<&'t str>> {
    let mut pieces = pattern.split("{}");
    let mut rest = text.strip_prefix(pieces.next()?)?;
    let mut parts = Vec::new();
    let mut pieces = pieces.peekable();
    while let Some(piece) = pieces.next() {
        let is_last = pieces.peek().is_none();
        let at = if is_last {
            rest.strip_suffix(piece)?.len()
        } else {
            rest.find(piece)?
        };
        if at == 0 {
            return None;
        }
        parts.push(&rest[..at]);
        rest = &rest[at + piece.len()..];
    }
    rest.is_empty().then_some(parts)
}

/// Returns a pattern with `{0}` and so on replaced by the texts of what stands in the braces. Braces without a text stay as
/// they are.
pub(super) fn filled_by(pattern: &str, text_of: impl Fn(&str) -> Option<String>) -> String {
    let mut pieces = pattern.split('{');
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let filled = piece.split_once('}').and_then(|(index, rest)| {
            let part = text_of(index)?;
            Some([part.as_str(), rest].concat())
        });
        text += &filled.unwrap_or_else(|| format!("{{{piece}"));
    }
    text
}

/// Returns a day, perhaps with a time, with the day before the month.
pub(super) fn day_first(text: &str) -> Option<String> {
    let (day, time) = text.split_at_checked("2026-11-21".len())?;
    let numbers: Vec<&str> = day.split('-').collect();
    let [year, month, of_month] = numbers[..] else {
        return None;
    };
    let are_digits = numbers
        .iter()
        .all(|number| number.bytes().all(|byte| byte.is_ascii_digit()));
    let is_day = are_digits && [year, month, of_month].map(str::len) == [4, 2, 2];
    let is_alone = time.is_empty() || time.starts_with(' ');
    (is_day && is_alone).then(|| format!("{of_month}/{month}/{year}{time}"))
}
