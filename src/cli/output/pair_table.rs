//! The table of pairs that `status --pairs` and `show --low` print.

use super::digits::{DEGREES, SCALE, SCORE, fixed};
use super::screen::{Palette, Tone};
use super::show_text::state_name;
use super::table::columns;
use mocban_core::domain::{JobStatus, MetricOutcome};
use mocban_project::pair_table::PairRow;

/// Formats the table. Columns without a value in any line are left out.
pub(crate) fn pair_table(rows: &[PairRow], palette: Palette) -> String {
    const HEAD: [&str; 9] = [
        "pair",
        "character",
        "block",
        "state",
        "angle °",
        "scale",
        "iou",
        "confidence",
        "verdict",
    ];
    const ALIGNS: &str = "<<<<>>>><";
    let cells: Vec<[String; 9]> = rows.iter().map(|row| line(row, palette)).collect();
    let is_used = |column: usize| cells.iter().any(|row| !row[column].is_empty());
    let used: Vec<usize> = (0..HEAD.len()).filter(|column| is_used(*column)).collect();
    let chosen = |row: &[String; 9]| used.iter().map(|column| row[*column].clone()).collect();
    let head = HEAD.map(|name| palette.paint(Tone::Strong, name));
    let aligns: String = (ALIGNS.chars().zip(0..))
        .filter(|(_, column)| used.contains(column))
        .map(|(align, _)| align)
        .collect();
    let lines = std::iter::once(&head).chain(&cells);
    columns(lines.map(chosen), &aligns)
}

fn line(row: &PairRow, palette: Palette) -> [String; 9] {
    let number = |value: Option<f64>, digits: usize| {
        value.map_or_else(String::new, |value| fixed(value, digits))
    };
    let (tone, at) = match row.status {
        JobStatus::Done => (Tone::Good, None),
        JobStatus::Quarantined => (Tone::Bad, row.stage),
        JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff => (Tone::Warn, None),
    };
    let at = at.map_or_else(String::new, |stage| format!(" at {stage}"));
    let confidence = number(row.confidence, SCORE);
    let is_low = |value| value < MetricOutcome::LOW_CONFIDENCE;
    [
        row.id.to_string(),
        row.character.clone().unwrap_or_default(),
        row.block.clone().unwrap_or_default(),
        palette.paint(tone, format!("{}{at}", state_name(row.status))),
        number(row.angle_deg, DEGREES),
        number(row.scale, SCALE),
        number(row.iou, SCORE),
        if row.confidence.is_some_and(is_low) {
            palette.paint(Tone::Warn, confidence)
        } else {
            confidence
        },
        row.verdict
            .map_or_else(String::new, |verdict| verdict.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::{PairRow, Palette, pair_table};
    use mocban_core::domain::{JobStatus, Stage, ThresholdMetric, Verdict};

    #[test]
    fn pairs_are_lines_and_empty_columns_are_left_out() {
        let done = PairRow {
            id: "b04-0117".parse().expect("an id"),
            character: Some("明".to_owned()),
            block: None,
            status: JobStatus::Done,
            stage: None,
            metric: Some(ThresholdMetric::Ensemble),
            angle_deg: Some(-1.25),
            scale: Some(1.01),
            iou: Some(0.8125),
            confidence: Some(0.31),
            verdict: Some(Verdict::Fail),
        };
        let failed = PairRow {
            id: "b04-0118".parse().expect("an id"),
            character: None,
            status: JobStatus::Quarantined,
            stage: Some(Stage::Depth),
            metric: None,
            angle_deg: None,
            scale: None,
            iou: None,
            confidence: None,
            verdict: None,
            ..done.clone()
        };
        insta::assert_snapshot!(pair_table(&[done, failed.clone()], Palette::PLAIN));
        let text = pair_table(&[failed], Palette::PLAIN);
        assert_eq!(text, "pair      state\nb04-0118  failed at depth\n");
    }
}
