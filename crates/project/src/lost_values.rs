//! Sentences about values of known pairs and blocks that an import empties, such as by a forgotten column.

use mocban_catalog::{LostColumn, LostValues};

/// Returns a sentence for each column. `kind` is `pair` or `block`.
pub(crate) fn lost_values<'l>(
    lost: &'l LostValues,
    kind: &'static str,
) -> impl Iterator<Item = String> + use<'l> {
    lost.columns().map(move |(column, lost)| {
        let LostColumn { count, first } = lost;
        let advice = "if that was not meant, import again with this column or option";
        match count {
            1 => format!(
                "1 known {kind} loses its {column}, which this import does not name: {first}; {advice}"
            ),
            _ => format!(
                "{count} known {kind}s lose their {column}, which this import does not name, first {first}; {advice}"
            ),
        }
    })
}
