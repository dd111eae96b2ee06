//! `report --compare`: the tables of two projects side by side.

use crate::cli::output::table::columns;
use mocban_report::{MetricRow, Report};
use mocban_results::number_format::NumberStyle::{self, Score, Share};
use mocban_results::number_format::{format_number, format_share};

/// Formats the numbers of both projects and their differences, one line per metric and number.
///
/// The numbers come from the report tables, so the projects may contain different pairs.
pub(crate) fn side_by_side(here: &Report, there: &Report, names: [&str; 2]) -> String {
    let head = ["", "", names[0], names[1], "difference"];
    let mut rows = vec![head.map(ToOwned::to_owned).to_vec()];
    for row in &here.rows {
        if let Some(other) = there.row(row.metric) {
            rows.extend(lines(row, other));
        }
    }
    columns(rows, "<<>>>")
}

fn lines(here: &MetricRow, there: &MetricRow) -> Vec<Vec<String>> {
    let acc_by_truth = |row: &MetricRow| row.truth.as_ref()?.acc;
    let within_5deg = |row: &MetricRow| row.truth.as_ref()?.angle_le_5deg;
    let numbers = [
        ("Acc %", Share, here.acc, there.acc),
        ("SSIM", Score, here.ssim, there.ssim),
        ("IoU", Score, here.iou, there.iou),
        ("IoU box", Score, here.iou_box, there.iou_box),
        ("Dice", Score, here.dice, there.dice),
        (
            "Acc % by truth",
            Share,
            acc_by_truth(here),
            acc_by_truth(there),
        ),
        (
            "in 5° % by truth",
            Share,
            within_5deg(here),
            within_5deg(there),
        ),
    ];
    let counts = vec!["n".to_owned(), here.n.to_string(), there.n.to_string()];
    let lines = numbers
        .iter()
        .filter(|(_, _, a, b)| a.is_some() || b.is_some())
        .map(|(name, style, a, b)| {
            let difference = a.zip(*b).map(|(a, b)| signed(a - b, *style));
            let show =
                |value: &Option<f64>| value.map_or("-".to_owned(), |value| shown(value, *style));
            let mut line = vec![(*name).to_owned(), show(a), show(b)];
            line.extend(difference);
            line
        });
    let mut title = here.metric.title().to_owned();
    std::iter::once(counts)
        .chain(lines)
        .map(|line| [vec![std::mem::take(&mut title)], line].concat())
        .collect()
}

/// Formats a number as the tables of a report do.
fn shown(value: f64, style: NumberStyle) -> String {
    match style {
        Share => format_share(value),
        other => format_number(value, other),
    }
}

/// Formats a difference with its sign; that of two shares is in percentage points.
fn signed(difference: f64, style: NumberStyle) -> String {
    let text = format_number(difference, style);
    if text.starts_with('-') {
        text
    } else {
        format!("+{text}")
    }
}

#[cfg(test)]
mod tests {
    use super::{Score, Share, side_by_side, signed};
    use mocban_report::ReportAccumulator;

    #[test]
    fn differences_have_a_sign() {
        assert_eq!(signed(0.012, Share), "+1.2");
        assert_eq!(signed(-0.012, Score), "-0.012");
        assert_eq!(signed(-0.0001, Score), "+0.000");
    }

    #[test]
    fn empty_projects_have_only_counts() {
        let report = ReportAccumulator::default().finish();
        let text = side_by_side(&report, &report, ["a", "b"]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + report.rows.len());
        assert!(lines[1].starts_with("Non-luminous SSIM  n  0  0"), "{text}");
    }
}
