//! Missing and misspelt names of columns.

/// Largest number of wrong, missing or swapped letters in a misspelt name of a column.
const SIMILAR: usize = 2;

/// Returns whether a name may be a misspelt name of a column.
pub(super) fn similar_column(found: &str, name: &str) -> bool {
    strsim::osa_distance(found, name) <= SIMILAR
}

/// Describes a missing column. Suggests an unknown column with a similar name.
pub(super) fn missing_column(
    name: &str,
    record: &::csv::ByteRecord,
    is_known: impl Fn(&str) -> bool,
) -> String {
    let found: Vec<_> = record
        .iter()
        .take(12)
        .map(|field| String::from_utf8_lossy(field))
        .collect();
    let shown = found.join(", ");
    let is_similar = |field: &&std::borrow::Cow<'_, str>| {
        let field = field.trim().to_lowercase();
        !is_known(&field) && similar_column(&field, name)
    };
    let hint = found.iter().find(is_similar).map(|field| {
        let field = field.trim();
        format!("; rename {field:?} to {name:?} if it is meant")
    });
    format!(
        "column {name:?} is missing{}; the header has: {shown}",
        hint.unwrap_or_default()
    )
}
