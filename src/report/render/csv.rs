//! The report as CSV (RFC 4180): one line a metric, numbers in full.

use crate::report::model::{Report, Row, TruthBlock};

/// Names of the columns, in order.
const COLUMNS: [&str; 26] = [
    "metric",
    "n",
    "read",
    "passed",
    "failed",
    "unsure",
    "conflicts",
    "stale",
    "acc",
    "acc_ci95_low",
    "acc_ci95_high",
    "ssim",
    "nl_ssim",
    "iou",
    "iou_box",
    "dice",
    "truth_n",
    "truth_passed",
    "truth_acc",
    "truth_acc_ci95_low",
    "truth_acc_ci95_high",
    "truth_angle_le_5deg",
    "truth_angle_median_deg",
    "truth_tre_median_pct",
    "truth_mask_iou_median",
    "truth_mirrored",
];

/// The report as CSV. What does not exist is an empty field.
pub(super) fn render(report: &Report) -> String {
    let mut text = line(COLUMNS.iter().map(|name| field(name)));
    for row in &report.rows {
        text += &line(fields(row).into_iter());
    }
    text
}

fn fields(row: &Row) -> Vec<String> {
    let [low, high] = bounds(row.acc_ci95);
    let mut fields = vec![
        field(row.metric.name()),
        row.n.to_string(),
        row.read.to_string(),
        row.passed.to_string(),
        row.failed.to_string(),
        row.unsure.to_string(),
        row.conflicts.to_string(),
        row.stale.to_string(),
        number(row.acc),
        low,
        high,
        number(row.ssim),
        number(row.nl_ssim),
        number(row.iou),
        number(row.iou_box),
        number(row.dice),
    ];
    fields.extend(truth_fields(row.truth.as_ref()));
    fields
}

fn truth_fields(truth: Option<&TruthBlock>) -> [String; 10] {
    let value = |read: fn(&TruthBlock) -> Option<f64>| number(truth.and_then(read));
    let count = |read: fn(&TruthBlock) -> u64| {
        truth.map_or_else(String::new, |truth| read(truth).to_string())
    };
    let [low, high] = bounds(truth.and_then(|truth| truth.acc_ci95));
    [
        count(|truth| truth.n),
        count(|truth| truth.passed),
        value(|truth| truth.acc),
        low,
        high,
        value(|truth| truth.angle_le_5deg),
        value(|truth| truth.angle_median_deg),
        value(|truth| truth.tre_median_pct),
        value(|truth| truth.mask_iou_median),
        count(|truth| truth.mirrored),
    ]
}

fn bounds(bounds: Option<[f64; 2]>) -> [String; 2] {
    bounds.map_or_else(Default::default, |bounds| {
        bounds.map(|bound| number(Some(bound)))
    })
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// A text field: quoted where it must be, and with `'` before what a spreadsheet would take for a formula.
fn field(text: &str) -> String {
    let guarded = if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        format!("'{text}")
    } else {
        text.to_owned()
    };
    if guarded.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", guarded.replace('"', "\"\""))
    } else {
        guarded
    }
}

fn line(fields: impl Iterator<Item = String>) -> String {
    fields.collect::<Vec<_>>().join(",") + "\r\n"
}

#[cfg(test)]
mod tests {
    use super::{COLUMNS, field, render};
    use crate::domain::Verdict;
    use crate::report::{Tally, TruthFinding, fixture};

    #[test]
    fn every_line_has_every_field_and_ends_with_crlf() {
        let mut tally = Tally::default();
        tally.add(
            &fixture::done("a", 0.75, &[Verdict::Pass]),
            &TruthFinding::default(),
        );
        tally.add(
            &fixture::done("b", 0.75, &[]),
            &fixture::truth(1.5, 2.0, 0.9),
        );
        let text = render(&tally.finish());
        let lines: Vec<&str> = text.split("\r\n").collect();
        assert_eq!(lines.len(), 6);
        assert_eq!(lines[5], "");
        for line in &lines[..5] {
            assert_eq!(line.split(',').count(), COLUMNS.len(), "{line}");
        }
        let golden = "nl_ssim,2,1,1,0,0,0,0,1,0.20654931437723745,1,0.81,0.82,0.75,0.9,";
        assert!(lines[1].starts_with(golden), "{}", lines[1]);
        assert!(lines[1].ends_with(",1,1.5,2,0.9,0"), "{}", lines[1]);
    }

    #[test]
    fn what_is_not_there_is_an_empty_field() {
        let text = render(&Tally::default().finish());
        assert!(
            text.contains("\r\ndensity,0,0,0,0,0,0,0,,,,,,,,,,,,,,,,,,\r\n"),
            "{text}"
        );
    }

    #[test]
    fn formulas_are_disarmed_and_quotes_doubled() {
        assert_eq!(field("=1+1"), "'=1+1");
        assert_eq!(field("-id"), "'-id");
        assert_eq!(field("a,\"b\"\n"), "\"a,\"\"b\"\"\n\"");
        assert_eq!(field("ensemble"), "ensemble");
    }
}
