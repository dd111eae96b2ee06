//! The sentence about columns of a list that were read under other names.

use std::collections::BTreeMap;

use mocban_core::domain::sanitize;
use mocban_core::domain::spelling::quoted;

/// Beginning of the sentence about columns that were read under other names.
pub const RENAMED: &str = "columns with other names were read";

/// Longest name of a column in a message, in characters.
const MAX_NAME_CHARS: usize = 60;

/// Says which columns were read under other names. They are given as written, each with its name.
pub fn renamed_columns(renamed: &BTreeMap<String, &'static str>) -> Option<String> {
    let columns = renamed.iter();
    let columns = columns.map(|(written, name)| {
        let written = quoted(&sanitize(written, MAX_NAME_CHARS));
        format!("{written} as {name}")
    });
    let columns: Vec<String> = columns.collect();
    (!columns.is_empty()).then(|| format!("{RENAMED}: {}", columns.join(", ")))
}
