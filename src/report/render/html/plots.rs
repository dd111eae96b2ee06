//! Small drawings of the numbers in the tables beside them, as SVG in the colours of the page.

use maud::{Markup, html};

use crate::report::model::{Basis, Report};
use crate::report::render::table::fixed;
use crate::report::thresholds::ThresholdDistribution;

/// Width of a drawing in its own units.
const WIDTH: f64 = 460.0;
/// Where a drawing's rows begin, right of their names.
const LEFT: f64 = 130.0;
/// Where they end, left of the numbers.
const RIGHT: f64 = 400.0;
/// Height of a row.
const ROW: f64 = 26.0;
/// Height of the scale below the rows.
const SCALE: f64 = 24.0;
/// Height of the bars of a distribution.
const BARS: f64 = 54.0;
/// Parts of a scale that are marked.
const MARKS: usize = 5;

/// One row: a name, a value, and the ends of the line through it.
struct PlotRow {
    name: &'static str,
    value: f64,
    ends: [f64; 2],
    told: String,
}

/// Acc of every method with its interval; nothing where there is none.
pub(super) fn accuracy(report: &Report, basis: Basis) -> Markup {
    let found = report.rows.iter().filter_map(|row| {
        let truth = row.truth.as_ref();
        let (acc, ends) = match basis {
            Basis::Verdicts => (row.acc, row.acc_ci95),
            Basis::Truth => (
                truth.and_then(|truth| truth.acc),
                truth.and_then(|truth| truth.acc_ci95),
            ),
        };
        let value = acc?;
        Some(PlotRow {
            name: row.metric.title(),
            value,
            ends: ends?,
            told: format!("{value:.3}"),
        })
    });
    let rows: Vec<PlotRow> = found.collect();
    let lowest = rows.iter().map(|row| row.ends[0]).fold(1.0, f64::min);
    // The scale begins at a tenth, so that near-perfect rows can still be told apart.
    let from = ((lowest * 10.0).floor() / 10.0).min(0.9);
    let by = match basis {
        Basis::Verdicts => "by reviewers",
        Basis::Truth => "by truth",
    };
    let what = format!("Acc {by} with its {} interval", report.interval.title());
    lines(&rows, [from, 1.0], 2, &what)
}

/// The median time of every stage with its 95th percentile, in milliseconds.
pub(super) fn times(report: &Report) -> Markup {
    let found = report.times.iter().map(|time| PlotRow {
        name: time.stage.name(),
        value: time.median_ms,
        ends: [time.median_ms, time.p95_ms],
        told: format!("{:.0}", time.median_ms),
    });
    let rows: Vec<PlotRow> = found.collect();
    let longest = rows.iter().map(|row| row.ends[1]).fold(1.0, f64::max);
    let what = "Milliseconds a pair by stage: the median, with a line to the 95th percentile";
    lines(&rows, [0.0, round_up(longest)], 0, what)
}

/// The next number of one digit and zeros.
fn round_up(number: f64) -> f64 {
    let unit = 10.0_f64.powf(number.log10().floor());
    (number / unit).ceil() * unit
}

/// Rows of points on lines over a scale; nothing without rows.
fn lines(rows: &[PlotRow], [from, to]: [f64; 2], decimals: usize, what: &str) -> Markup {
    let place = |value: f64| LEFT + (RIGHT - LEFT) * (value - from) / (to - from);
    let below = ROW * rows.len() as f64;
    let told: Vec<String> = rows
        .iter()
        .map(|row| format!("{} {}", row.name, row.told))
        .collect();
    let alt = format!("{what}: {}", told.join(", "));
    let drawing = html! {
        @for i in 0..=MARKS {
            @let value = from + (to - from) * i as f64 / MARKS as f64;
            line.grid x1=(at(place(value))) x2=(at(place(value))) y1="0" y2=(at(below)) {}
            text.mark x=(at(place(value))) y=(at(below + 16.0)) { (fixed(Some(value), decimals).unwrap_or_default()) }
        }
        @for (i, row) in rows.iter().enumerate() {
            @let y = ROW * (i as f64 + 0.5);
            text.name x="0" y=(at(y + 4.0)) { (row.name) }
            line.span x1=(at(place(row.ends[0]))) x2=(at(place(row.ends[1]))) y1=(at(y)) y2=(at(y)) {}
            circle.point cx=(at(place(row.value))) cy=(at(y)) r="4.5" {}
            text.told x=(at(RIGHT + 12.0)) y=(at(y + 4.0)) { (row.told) }
        }
    };
    html! { @if !rows.is_empty() { (figure(below + SCALE, &alt, what, &drawing)) } }
}

/// The distribution of every metric's thresholds, one under the other on the same scale.
pub(super) fn thresholds(report: &Report) -> Markup {
    let found = &report.thresholds;
    let below = (BARS + 14.0) * found.len() as f64;
    let what =
        "Results by the height of their cut, from the lowest point of a depth map to its highest";
    let told: Vec<String> = found
        .iter()
        .map(|cuts| format!("{} median {:.3}", cuts.metric.title(), cuts.median))
        .collect();
    let alt = format!("{what}: {}", told.join(", "));
    let drawing = html! {
        @for (i, cuts) in found.iter().enumerate() { (bars(cuts, (BARS + 14.0) * i as f64)) }
        @for i in 0..=MARKS {
            @let share = i as f64 / MARKS as f64;
            text.mark x=(at(LEFT + (RIGHT - LEFT) * share)) y=(at(below + 12.0)) { (format!("{share:.1}")) }
        }
    };
    figure(below + SCALE, &alt, what, &drawing)
}

fn bars(cuts: &ThresholdDistribution, top: f64) -> Markup {
    let most = cuts.bins.iter().copied().max().unwrap_or(0).max(1) as f64;
    let wide = (RIGHT - LEFT) / cuts.bins.len() as f64;
    let base = top + BARS;
    let median = LEFT + (RIGHT - LEFT) * cuts.median;
    html! {
        text.name x="0" y=(at(base - 4.0)) { (cuts.metric.title()) }
        @for (i, n) in cuts.bins.iter().enumerate().filter(|(_, n)| **n > 0) {
            @let tall = (BARS - 8.0) * *n as f64 / most;
            rect.bar x=(at(LEFT + wide * i as f64 + 0.5)) y=(at(base - tall)) width=(at(wide - 1.0)) height=(at(tall)) {}
        }
        line.axis x1=(at(LEFT)) x2=(at(RIGHT)) y1=(at(base)) y2=(at(base)) {}
        line.median x1=(at(median)) x2=(at(median)) y1=(at(top + 4.0)) y2=(at(base)) {}
        text.told x=(at(RIGHT + 12.0)) y=(at(base - 4.0)) { (format!("{:.3}", cuts.median)) }
    }
}

/// A drawing of a height with its caption, and its numbers for who cannot see it.
fn figure(height: f64, alt: &str, caption: &str, drawing: &Markup) -> Markup {
    let frame = format!("0 0 {WIDTH} {height}");
    html! {
        figure class="plot" {
            svg role="img" aria-label=(alt) viewBox=(frame) { (drawing) }
            figcaption { (caption) "." }
        }
    }
}

/// A coordinate.
fn at(place: f64) -> String {
    format!("{place:.1}")
}

#[cfg(test)]
mod tests {
    use super::{accuracy, round_up, thresholds, times};
    use crate::domain::{Stage, Verdict};
    use crate::report::model::Basis;
    use crate::report::{ReportAccumulator, TruthEvaluation, test_fixtures};

    #[test]
    fn points_stand_where_their_numbers_are_on_the_scale() {
        let mut tally = ReportAccumulator::default();
        for (name, verdict) in [("a", Verdict::Pass), ("b", Verdict::Fail)] {
            let pair = test_fixtures::done(name, 0.8, &[verdict]);
            tally.add(&pair, &TruthEvaluation::default());
        }
        let report = tally.finish();
        // 1 of 2 has the interval 0.095 to 0.905, so that the scale goes from 0 to 1, and the half lies in its middle.
        let drawn = accuracy(&report, Basis::Verdicts).into_string();
        assert_eq!(drawn.matches("cx=\"265.0\"").count(), 4, "{drawn}");
        assert!(drawn.contains("Ensemble 0.500"), "{drawn}");
        assert_eq!(accuracy(&report, Basis::Truth).into_string(), "");
    }

    #[test]
    fn times_and_thresholds_are_drawn_once_a_row() {
        let mut tally = ReportAccumulator::default();
        let mut pair = test_fixtures::done("a", 0.8, &[]);
        pair.stages = [(Stage::Fit, 40), (Stage::Depth, 80)]
            .map(|(stage, ms)| test_fixtures::stage(stage, ms))
            .to_vec();
        tally.add(&pair, &TruthEvaluation::default());
        let report = tally.finish();
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
    fn a_scale_ends_at_a_round_number() {
        assert_eq!([37.0, 100.0, 101.0].map(round_up), [40.0, 100.0, 200.0]);
    }
}
