//! Sentences about values of known pairs and blocks that an import empties, such as by a forgotten column or an empty cell.

use mocban_catalog::{LostColumn, LostValues};

/// Returns a sentence for each column. `kind` is `pair` or `block`.
pub(crate) fn lost_values<'l>(
    lost: &'l LostValues,
    kind: &'static str,
) -> impl Iterator<Item = String> + use<'l> {
    lost.columns().map(move |(column, lost)| {
        let LostColumn { count, first } = lost;
        let advice = "if that was not meant, import again with these values";
        match count {
            1 => format!(
                "1 known {kind} loses its {column}, empty or missing in this import: {first}; {advice}"
            ),
            _ => format!(
                "{count} known {kind}s lose their {column}, empty or missing in this import, first {first}; {advice}"
            ),
        }
    })
}
