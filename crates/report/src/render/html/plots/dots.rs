//! Plots with a point and a line for each row: Acc with its interval, computing times.

use maud::{Markup, html};

use super::axis::PlotAxis;
use super::{LEFT, RIGHT, SCALE, alt_text, at, figure, horizontal_axis};
use crate::comparison::Basis;
use crate::model::Report;
use mocban_results::number_format::NumberStyle::Milliseconds;
use mocban_results::number_format::{format_number, format_rate};

/// Height of a row.
const ROW: f64 = 26.0;

/// One row: a name, a value, and the ends of the line through it.
struct PlotRow {
    name: &'static str,
    value: f64,
    ends: [f64; 2],
    /// The value as text beside the row.
    label: String,
    /// The value as text for screen readers.
    spoken: String,
}

/// Returns the plot of every metric's Acc with its interval. The plot is empty if no metric has an Acc.
pub(in crate::render::html) fn accuracy(report: &Report, basis: Basis) -> Markup {
    let found = report.rows.iter().filter_map(|row| {
        let (acc, ends) = match (basis, &row.truth) {
            (Basis::Verdicts, _) => (row.acc, row.acc_ci95),
            (Basis::Truth, truth) => truth.as_ref().map(|truth| (truth.acc, truth.acc_ci95))?,
        };
        let value = acc?;
        Some(PlotRow {
            name: row.metric.title(),
            value: 100.0 * value,
            ends: ends?.map(|end| 100.0 * end),
            label: format_rate(value, None),
            spoken: format_rate(value, ends),
        })
    });
    let rows: Vec<PlotRow> = found.collect();
    let lowest = rows.iter().map(|row| row.ends[0]).fold(100.0, f64::min);
    let title = format!("Acc by {} (%)", basis.title());
    let caption = format!(
        "Acc by {} of each metric (point), with its {} interval (line)",
        basis.title(),
        report.interval.title()
    );
    let axis = PlotAxis::percent(lowest, [LEFT, RIGHT]);
    dot_plot(&rows, &axis, &title, &caption)
}

/// Returns the plot of every stage's median time and 95th percentile, in milliseconds.
pub(in crate::render::html) fn times(report: &Report) -> Markup {
    let found = report.times.iter().map(|time| {
        let label = format!("{} ms", format_number(time.median_ms, Milliseconds));
        PlotRow {
            name: time.stage.name(),
            value: time.median_ms,
            ends: [time.median_ms, time.p95_ms],
            spoken: label.clone(),
            label,
        }
    });
    let rows: Vec<PlotRow> = found.collect();
    let longest = rows.iter().map(|row| row.ends[1]).fold(1.0, f64::max);
    let caption =
        "Computing time of a pair by stage: the median (point), with a line to the 95th percentile";
    let axis = PlotAxis::covering(0.0, longest, [LEFT, RIGHT]);
    dot_plot(&rows, &axis, "Computing time per pair (ms)", caption)
}

/// Returns a plot with one line and one point for each row. The plot is empty if there are no rows.
fn dot_plot(rows: &[PlotRow], axis: &PlotAxis, title: &str, caption: &str) -> Markup {
    let below = ROW * rows.len() as f64;
    let labels = rows
        .iter()
        .map(|row| format!("{} {}", row.name, row.spoken));
    let alt = alt_text(caption, labels);
    let drawing = html! {
        (horizontal_axis(axis, [0.0, below], title))
        @for (i, row) in rows.iter().enumerate() {
            @let y = ROW * (i as f64 + 0.5);
            text.name x="0" y=(at(y + 4.0)) { (row.name) }
            line.span x1=(at(axis.place(row.ends[0]))) x2=(at(axis.place(row.ends[1]))) y1=(at(y)) y2=(at(y)) {}
            circle.point cx=(at(axis.place(row.value))) cy=(at(y)) r="4.5" {}
            text.value x=(at(RIGHT + 12.0)) y=(at(y + 4.0)) { (super::prose(&row.label)) }
        }
    };
    html! { @if !rows.is_empty() { (figure(below + SCALE, &alt, caption, &drawing)) } }
}

#[cfg(test)]
mod tests {
    use super::{accuracy, times};
    use crate::{Basis, ReportAccumulator, test_fixtures};
    use mocban_core::domain::{Stage, Verdict};
    use mocban_results::TruthEvaluation;

    #[test]
    fn points_are_at_their_numbers_on_the_axis() {
        let mut report = ReportAccumulator::default();
        for (name, verdict) in [("a", Verdict::Pass), ("b", Verdict::Fail)] {
            let pair = test_fixtures::done(name, 0.8, &[verdict]);
            report.add(&pair, &TruthEvaluation::default());
        }
        let report = report.finish();
        // The 95 % interval of 1 pass in 2 is 9.5 to 90.5, so the axis runs from 0 to 100 with 50 in the middle.
        let drawn = accuracy(&report, Basis::Verdicts).into_string();
        assert_eq!(drawn.matches("cx=\"270.0\"").count(), 4, "{drawn}");
        assert!(
            drawn.contains("Ensemble 50.0\u{202f}% (9.5–90.5)"),
            "{drawn}"
        );
        assert!(drawn.contains(">Acc by verdicts (%)</text>"), "{drawn}");
        assert_eq!(accuracy(&report, Basis::Truth).into_string(), "");
    }

    #[test]
    fn times_have_a_unit() {
        let mut report = ReportAccumulator::default();
        let mut pair = test_fixtures::done("a", 0.8, &[]);
        pair.stages = [(Stage::Fit, 40), (Stage::Depth, 80)]
            .map(|(stage, ms)| test_fixtures::stage(stage, ms))
            .to_vec();
        report.add(&pair, &TruthEvaluation::default());
        let drawn = times(&report.finish()).into_string();
        for part in ["cx=\"270.0\"", "cx=\"400.0\"", ">40 ms<", "per pair (ms)"] {
            assert!(drawn.contains(part), "{part}: {drawn}");
        }
    }
}
