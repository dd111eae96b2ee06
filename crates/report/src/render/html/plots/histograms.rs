//! Histograms of the thresholds.

use maud::{Markup, html};

use super::axis::PlotAxis;
use super::{LEFT, RIGHT, SCALE, alt_text, at, figure, horizontal_axis};
use crate::model::Report;
use crate::thresholds::ThresholdDistribution;
use mocban_results::number_format::NumberStyle::Score;
use mocban_results::number_format::{counted, format_number};

/// Height of the bars of a distribution.
const BARS: f64 = 54.0;
/// Height of a distribution with the space above it.
const PANEL: f64 = BARS + 14.0;

/// Returns a histogram of each metric's thresholds. All histograms share one axis.
pub(in crate::render::html) fn thresholds(report: &Report) -> Markup {
    let found = &report.thresholds;
    let below = PANEL * found.len() as f64;
    let caption = "Results of each metric by the relative height of their threshold. A dashed line and the number \
                   beside it show the median";
    let labels = found.iter().map(|found| {
        let median = format_number(found.median, Score);
        format!("{} median {median}", found.metric.title())
    });
    let alt = alt_text(caption, labels);
    let axis = PlotAxis::covering(0.0, 1.0, [LEFT, RIGHT]);
    let title = "Relative height (0 lowest, 1 highest point of the depth map)";
    let drawing = html! {
        (horizontal_axis(&axis, [below, below], title))
        @for (i, found) in found.iter().enumerate() { (bars(found, &axis, PANEL * i as f64)) }
    };
    figure(below + SCALE, &alt, caption, &drawing)
}

fn bars(found: &ThresholdDistribution, axis: &PlotAxis, top: f64) -> Markup {
    let most = found.bins.iter().copied().max().unwrap_or(0);
    let wide = (RIGHT - LEFT) / found.bins.len() as f64;
    let base = top + PANEL - 6.0;
    let tallest = BARS - 8.0;
    let median = axis.place(found.median);
    html! {
        text.name x="0" y=(at(base - 4.0)) { (found.metric.title()) }
        text.count x=(at(LEFT - 6.0)) y=(at(base - tallest + 4.0)) { (counted(most, "result")) }
        line.grid x1=(at(LEFT)) x2=(at(RIGHT)) y1=(at(base - tallest)) y2=(at(base - tallest)) {}
        @for (i, n) in found.bins.iter().enumerate().filter(|(_, n)| **n > 0) {
            @let tall = tallest * *n as f64 / most.max(1) as f64;
            rect.bar x=(at(LEFT + wide * i as f64 + 0.5)) y=(at(base - tall)) width=(at(wide - 1.0)) height=(at(tall)) {}
        }
        line.axis x1=(at(LEFT)) x2=(at(RIGHT)) y1=(at(base)) y2=(at(base)) {}
        line.median x1=(at(median)) x2=(at(median)) y1=(at(top + 4.0)) y2=(at(base)) {}
        text.value x=(at(RIGHT + 12.0)) y=(at(base - 4.0)) { (format_number(found.median, Score)) }
    }
}

#[cfg(test)]
mod tests {
    use super::thresholds;
    use crate::{ReportAccumulator, test_fixtures};
    use mocban_results::TruthEvaluation;

    #[test]
    fn every_metric_has_bars_with_a_scale() {
        let mut report = ReportAccumulator::default();
        let pair = test_fixtures::done("a", 0.8, &[]);
        report.add(&pair, &TruthEvaluation::default());
        let bars = thresholds(&report.finish()).into_string();
        assert_eq!(bars.matches("<rect").count(), 4, "{bars}");
        assert_eq!(bars.matches(">1 result<").count(), 4, "{bars}");
        assert!(bars.contains("Relief median 0.458"), "{bars}");
    }
}
