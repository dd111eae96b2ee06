//! The table of whole blocks.

use super::table::Table;
use crate::block_accuracy::{BlockAccuracy, BoxAccuracy};
use crate::model::Report;
use mocban_core::domain::{ThresholdMetric, one_line};
use mocban_results::stats::ratio;

/// Maximum length of the name of a block in a table, characters. The table then fits a terminal.
const MAX_NAME_CHARS: usize = 20;

/// Returns how well the characters of whole blocks were found and aligned, or `None` without true boxes.
pub(super) fn blocks(report: &Report) -> Option<Table> {
    let boxes = |block: &BlockAccuracy, read: fn(&BoxAccuracy) -> Option<f64>| {
        block.boxes.as_ref().and_then(read)
    };
    (!report.blocks.is_empty()).then(|| {
        Table::of(&report.blocks)
            .text("Block", |block| shortened(&block.block))
            .count("true", |block| block.characters)
            .count("found", |block| block.found)
            .share("right %", |block| ratio(block.right as f64, block.found))
            .share("tight %", |block| ratio(block.tight as f64, block.found))
            .share("P50 %", |block| boxes(block, |found| found.iou_50.precision))
            .share("R50 %", |block| boxes(block, |found| found.iou_50.recall))
            .share("P70 %", |block| boxes(block, |found| found.iou_70.precision))
            .share("R70 %", |block| boxes(block, |found| found.iou_70.recall))
            .caption("blocks", format!(
                "Whole blocks against ground truth. True: characters that the page shows whole. Found: those that were cut \
                 and aligned. Right as above, and tight if landmarks are within 1.5 %, both for {}. P and R: precision and \
                 recall of boxes that were found without labels. 50 and 70: at an IoU of at least 0.5 and 0.7.",
                ThresholdMetric::DEFAULT.title()
            ))
    })
}

/// Returns a name for a table, shortened if it is long.
fn shortened(name: &str) -> String {
    let name = one_line(name);
    match name.char_indices().nth(MAX_NAME_CHARS) {
        Some(_) => name
            .chars()
            .take(MAX_NAME_CHARS - 1)
            .chain(['\u{2026}'])
            .collect(),
        None => name.into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::{blocks, shortened};
    use crate::{ReportAccumulator, test_fixtures};

    #[test]
    fn a_block_has_a_row_and_a_dash_where_boxes_come_from_labels() {
        let table = blocks(&test_fixtures::full_report()).expect("two blocks");
        let row = |k: usize| -> Vec<&str> {
            let cells = table.rows[k].iter();
            cells.map(|cell| cell.as_deref().unwrap_or("-")).collect()
        };
        let found = [
            "block 0", "3", "3", "33.3", "33.3", "50.0", "66.7", "25.0", "33.3",
        ];
        assert_eq!(row(0), found);
        let labelled = ["block 1", "3", "3", "100.0", "100.0", "-", "-", "-", "-"];
        assert_eq!(row(1), labelled);
        assert_eq!(blocks(&ReportAccumulator::default().finish()), None);
    }

    #[test]
    fn long_names_are_shortened() {
        assert_eq!(shortened("Kiều 12a"), "Kiều 12a");
        assert_eq!(shortened(&"x".repeat(20)).len(), 20);
        assert_eq!(shortened(&"ề".repeat(21)), "ề".repeat(19) + "\u{2026}");
    }
}
