//! SVG plots of numbers in the tables of the page. They use the page's colours.

use maud::{Markup, html};

use crate::report::comparison::Basis;
use crate::report::model::Report;
use crate::report::number_format::NumberStyle::{self, Milliseconds, Share};
use crate::report::number_format::format_number;
use crate::report::thresholds::ThresholdDistribution;

/// Width of a plot in SVG units.
const WIDTH: f64 = 460.0;
/// Left end of the rows, right of their names.
const LEFT: f64 = 130.0;
/// Right end of the rows, left of the numbers.
const RIGHT: f64 = 400.0;
/// Height of a row.
const ROW: f64 = 26.0;
/// Height of the axis below the rows.
const SCALE: f64 = 24.0;
/// Height of the bars of a distribution.
const BARS: f64 = 54.0;
/// Intervals of an axis.
const TICKS: usize = 5;

/// One row: a name, a value, and the ends of the line through it.
struct PlotRow {
    name: &'static str,
    value: f64,
    ends: [f64; 2],
    label: String,
}

/// Returns the plot of every metric's Acc with its interval. The plot is empty if no metric has an Acc.
pub(super) fn accuracy(report: &Report, basis: Basis) -> Markup {
    let found = report.rows.iter().filter_map(|row| {
        let (acc, ends) = match (basis, &row.truth) {
            (Basis::Verdicts, _) => (row.acc, row.acc_ci95),
            (Basis::Truth, truth) => truth.as_ref().map(|truth| (truth.acc, truth.acc_ci95))?,
        };
        let value = acc?;
        Some(PlotRow {
            name: row.metric.title(),
            value,
            ends: ends?,
            label: format_number(value, Share),
        })
    });
    let rows: Vec<PlotRow> = found.collect();
    let lowest = rows.iter().map(|row| row.ends[0]).fold(1.0, f64::min);
    // The axis begins at the multiple of 0.1 below the lowest value, at most 0.9, so that values near 1 stay apart.
    let from = ((lowest * 10.0).floor() / 10.0).min(0.9);
    let (by, interval) = (basis.name(), report.interval.title());
    let caption = format!("Acc by {by} with its {interval} interval");
    dot_plot(&rows, [from, 1.0], Share, &caption)
}

/// Returns the plot of every stage's median time and 95th percentile, in milliseconds.
pub(super) fn times(report: &Report) -> Markup {
    let found = report.times.iter().map(|time| PlotRow {
        name: time.stage.name(),
        value: time.median_ms,
        ends: [time.median_ms, time.p95_ms],
        label: format_number(time.median_ms, Milliseconds),
    });
    let rows: Vec<PlotRow> = found.collect();
    let longest = rows.iter().map(|row| row.ends[1]).fold(1.0, f64::max);
    let caption = "Milliseconds a pair by stage: the median, with a line to the 95th percentile";
    dot_plot(&rows, [0.0, round_up(longest)], Milliseconds, caption)
}

/// Rounds up to a number of one digit and zeros.
fn round_up(number: f64) -> f64 {
    let unit = 10.0_f64.powf(number.log10().floor());
    (number / unit).ceil() * unit
}

/// Returns a plot with one line and one point for each row. The plot is empty if there are no rows.
fn dot_plot(rows: &[PlotRow], [from, to]: [f64; 2], style: NumberStyle, caption: &str) -> Markup {
    let place = |value: f64| LEFT + (RIGHT - LEFT) * (value - from) / (to - from);
    let below = ROW * rows.len() as f64;
    let labels = rows.iter().map(|row| format!("{} {}", row.name, row.label));
    let alt = alt_text(caption, labels);
    let drawing = html! {
        @for i in 0..=TICKS {
            @let value = from + (to - from) * i as f64 / TICKS as f64;
            line.grid x1=(at(place(value))) x2=(at(place(value))) y1="0" y2=(at(below)) {}
            text.mark x=(at(place(value))) y=(at(below + 16.0)) { (tick(value, style)) }
        }
        @for (i, row) in rows.iter().enumerate() {
            @let y = ROW * (i as f64 + 0.5);
            text.name x="0" y=(at(y + 4.0)) { (row.name) }
            line.span x1=(at(place(row.ends[0]))) x2=(at(place(row.ends[1]))) y1=(at(y)) y2=(at(y)) {}
            circle.point cx=(at(place(row.value))) cy=(at(y)) r="4.5" {}
            text.value x=(at(RIGHT + 12.0)) y=(at(y + 4.0)) { (row.label) }
        }
    };
    html! { @if !rows.is_empty() { (figure(below + SCALE, &alt, caption, &drawing)) } }
}

/// Returns a histogram of each metric's thresholds. All histograms share one axis.
pub(super) fn thresholds(report: &Report) -> Markup {
    let found = &report.thresholds;
    let below = (BARS + 14.0) * found.len() as f64;
    let caption =
        "Results by relative threshold height, from the lowest point of a depth map to its highest";
    let labels = found.iter().map(|found| {
        let median = format_number(found.median, Share);
        format!("{} median {median}", found.metric.title())
    });
    let alt = alt_text(caption, labels);
    let drawing = html! {
        @for (i, found) in found.iter().enumerate() { (bars(found, (BARS + 14.0) * i as f64)) }
        @for i in 0..=TICKS {
            @let share = i as f64 / TICKS as f64;
            text.mark x=(at(LEFT + (RIGHT - LEFT) * share)) y=(at(below + 12.0)) { (format!("{share:.1}")) }
        }
    };
    figure(below + SCALE, &alt, caption, &drawing)
}

fn bars(found: &ThresholdDistribution, top: f64) -> Markup {
    let most = found.bins.iter().copied().max().unwrap_or(0).max(1) as f64;
    let wide = (RIGHT - LEFT) / found.bins.len() as f64;
    let base = top + BARS;
    let median = LEFT + (RIGHT - LEFT) * found.median;
    html! {
        text.name x="0" y=(at(base - 4.0)) { (found.metric.title()) }
        @for (i, n) in found.bins.iter().enumerate().filter(|(_, n)| **n > 0) {
            @let tall = (BARS - 8.0) * *n as f64 / most;
            rect.bar x=(at(LEFT + wide * i as f64 + 0.5)) y=(at(base - tall)) width=(at(wide - 1.0)) height=(at(tall)) {}
        }
        line.axis x1=(at(LEFT)) x2=(at(RIGHT)) y1=(at(base)) y2=(at(base)) {}
        line.median x1=(at(median)) x2=(at(median)) y1=(at(top + 4.0)) y2=(at(base)) {}
        text.value x=(at(RIGHT + 12.0)) y=(at(base - 4.0)) { (format_number(found.median, Share)) }
    }
}

/// Returns a plot with its caption.
fn figure(height: f64, alt: &str, caption: &str, drawing: &Markup) -> Markup {
    let frame = format!("0 0 {WIDTH} {height}");
    html! {
        figure class="plot" {
            svg role="img" aria-label=(alt) viewBox=(frame) { (drawing) }
            figcaption { (caption) "." }
        }
    }
}

/// Returns the text of a plot for screen readers.
fn alt_text(caption: &str, labels: impl Iterator<Item = String>) -> String {
    format!("{caption}: {}", labels.collect::<Vec<_>>().join(", "))
}

/// Formats a coordinate.
fn at(place: f64) -> String {
    format!("{place:.1}")
}

/// Formats an axis label. Shares have only two decimals there.
fn tick(value: f64, style: NumberStyle) -> String {
    match style {
        Share => format!("{value:.2}"),
        other => format_number(value, other),
    }
}

#[cfg(test)]
mod tests {
    use super::{accuracy, round_up, thresholds, times};
    use crate::domain::{Stage, Verdict};
    use crate::report::{Basis, ReportAccumulator, TruthEvaluation, test_fixtures};

    #[test]
    fn points_are_at_their_numbers_on_the_axis() {
        let mut report = ReportAccumulator::default();
        for (name, verdict) in [("a", Verdict::Pass), ("b", Verdict::Fail)] {
            let pair = test_fixtures::done(name, 0.8, &[verdict]);
            report.add(&pair, &TruthEvaluation::default());
        }
        let report = report.finish();
        // The 95 % interval of 1 pass in 2 is 0.095 to 0.905, so the axis runs from 0 to 1 with 0.5 in the middle.
        let drawn = accuracy(&report, Basis::Verdicts).into_string();
        assert_eq!(drawn.matches("cx=\"265.0\"").count(), 4, "{drawn}");
        assert!(drawn.contains("Ensemble 0.500"), "{drawn}");
        assert_eq!(accuracy(&report, Basis::Truth).into_string(), "");
    }

    #[test]
    fn times_and_thresholds_have_one_plot_a_row() {
        let mut report = ReportAccumulator::default();
        let mut pair = test_fixtures::done("a", 0.8, &[]);
        pair.stages = [(Stage::Fit, 40), (Stage::Depth, 80)]
            .map(|(stage, ms)| test_fixtures::stage(stage, ms))
            .to_vec();
        report.add(&pair, &TruthEvaluation::default());
        let report = report.finish();
        let drawn = times(&report).into_string();
        assert!(
            drawn.contains("cx=\"265.0\"") && drawn.contains("cx=\"400.0\""),
            "{drawn}"
        );
        let bars = thresholds(&report).into_string();
        assert_eq!(bars.matches("<rect").count(), 4, "{bars}");
        assert!(bars.contains("Relief median 0.458"), "{bars}");
    }

    #[test]
    fn an_axis_ends_at_a_round_number() {
        assert_eq!([37.0, 100.0, 101.0].map(round_up), [40.0, 100.0, 200.0]);
    }
}
