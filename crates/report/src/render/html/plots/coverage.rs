//! Risk-coverage curves: Acc of the most confident results by the share of results that is kept.

use maud::{Markup, html};

use super::axis::PlotAxis;
use super::{SCALE, WIDTH, alt_text, at, figure, horizontal_axis};
use crate::comparison::Basis;
use crate::model::Report;
use crate::risk_coverage::RiskCoverageCurve;
use mocban_results::number_format::format_rate;

/// Left end of the axis of coverage, right of the tick labels of Acc.
const LEFT: f64 = 62.0;
/// Right end of the axis of coverage.
const RIGHT: f64 = WIDTH - 20.0;
/// Top and bottom of the axis of Acc, below the legend.
const TOP: f64 = 52.0;
const BOTTOM: f64 = 232.0;
/// Size of a marker.
const MARKER: f64 = 4.0;

/// One line of the plot: its name, and coverage and Acc of its points, in percent.
struct PlotLine {
    name: &'static str,
    points: Vec<[f64; 2]>,
}

/// Returns the plot of all metrics on a basis. The plot is empty if no metric has confidences there.
pub(in crate::render::html) fn risk_coverage(report: &Report, basis: Basis) -> Markup {
    let curves = report.risk_coverage.iter();
    let curves: Vec<&RiskCoverageCurve> = curves.filter(|curve| curve.basis == basis).collect();
    let lines: Vec<PlotLine> = curves.iter().map(|curve| line(curve)).collect();
    let points = lines.iter().flat_map(|line| &line.points);
    let lowest = points.map(|[_, acc]| *acc).fold(100.0, f64::min);
    let vertical = PlotAxis::percent(lowest, [BOTTOM, TOP]);
    let horizontal = PlotAxis::covering(50.0, 100.0, [LEFT, RIGHT]);
    let by = basis.title();
    let caption = format!(
        "Acc by {by} of the most confident results, by the share of results that is kept{}",
        coincidence(&lines)
    );
    let alt = alt_text(&caption, curves.iter().map(|curve| spoken(curve)));
    let drawing = html! {
        (horizontal_axis(&horizontal, [TOP, BOTTOM], "Results kept, the most confident first (%)"))
        @for value in vertical.ticks() {
            @let y = vertical.place(value);
            line.grid x1=(at(LEFT)) x2=(at(RIGHT)) y1=(at(y)) y2=(at(y)) {}
            text.count x=(at(LEFT - 8.0)) y=(at(y + 4.0)) { (vertical.label(value)) }
        }
        @let [x, y] = [14.0, vertical.middle()].map(at);
        text.title x=(x) y=(y) transform={ "rotate(-90 " (x) " " (y) ")" } { "Acc by " (by) " (%)" }
        @for (i, line) in lines.iter().enumerate() { (drawn(i, line, [&horizontal, &vertical])) }
    };
    html! { @if !lines.is_empty() { (figure(BOTTOM + SCALE, &alt, &caption, &drawing)) } }
}

fn line(curve: &RiskCoverageCurve) -> PlotLine {
    let points = curve.points.iter();
    PlotLine {
        name: curve.metric.title(),
        points: points
            .filter_map(|point| Some([100.0 * point.coverage, 100.0 * point.acc?]))
            .collect(),
    }
}

/// Returns the sentence on metrics with the same line, whose names only the legend shows.
fn coincidence(lines: &[PlotLine]) -> String {
    let is_same =
        |line: &&PlotLine| lines.iter().filter(|one| one.points == line.points).count() > 1;
    let same: Vec<&str> = lines.iter().filter(is_same).map(|line| line.name).collect();
    if same.is_empty() {
        return String::new();
    }
    format!(". Lines that lie on each other: {}", same.join(", "))
}

/// Returns Acc of a curve at full and at half coverage in words.
fn spoken(curve: &RiskCoverageCurve) -> String {
    let acc = |point: Option<&crate::RiskCoveragePoint>| {
        point
            .and_then(|point| point.acc)
            .map_or("unknown".to_owned(), |acc| format_rate(acc, None))
    };
    let [all, half] = [curve.points.first(), curve.points.last()].map(acc);
    format!(
        "{} {all} of all results and {half} of half of them",
        curve.metric.title()
    )
}

/// Returns a line with its markers and its entry in the legend. Each line has its own colour, dashes and marker.
fn drawn(i: usize, line: &PlotLine, [horizontal, vertical]: [&PlotAxis; 2]) -> Markup {
    let places: Vec<[f64; 2]> = (line.points.iter())
        .map(|[coverage, acc]| [horizontal.place(*coverage), vertical.place(*acc)])
        .collect();
    let path = places.iter().map(|[x, y]| format!("{},{}", at(*x), at(*y)));
    let legend = [LEFT + 190.0 * (i % 2) as f64, 10.0 + 18.0 * (i / 2) as f64];
    html! {
        g class={ "series s" (i) } {
            polyline points=(path.collect::<Vec<_>>().join(" ")) {}
            @for place in &places { (marker(i, *place)) }
            line x1=(at(legend[0])) x2=(at(legend[0] + 26.0)) y1=(at(legend[1])) y2=(at(legend[1])) {}
            (marker(i, [legend[0] + 13.0, legend[1]]))
            text x=(at(legend[0] + 34.0)) y=(at(legend[1] + 4.0)) { (line.name) }
        }
    }
}

fn marker(i: usize, [x, y]: [f64; 2]) -> Markup {
    let m = MARKER;
    let corners: &[[f64; 2]] = match i % 4 {
        1 => &[[-m, -m], [m, -m], [m, m], [-m, m]],
        2 => &[[0.0, -1.3 * m], [1.2 * m, m], [-1.2 * m, m]],
        3 => &[
            [0.0, -1.4 * m],
            [1.4 * m, 0.0],
            [0.0, 1.4 * m],
            [-1.4 * m, 0.0],
        ],
        _ => return html! { circle cx=(at(x)) cy=(at(y)) r=(at(m)) {} },
    };
    let corners = corners
        .iter()
        .map(|[dx, dy]| format!("{},{}", at(x + dx), at(y + dy)));
    html! { polygon points=(corners.collect::<Vec<_>>().join(" ")) {} }
}

#[cfg(test)]
mod tests {
    use super::risk_coverage;
    use crate::{Basis, ReportAccumulator, test_fixtures};

    #[test]
    fn every_metric_has_a_line_and_both_axes_a_title() {
        let mut report = ReportAccumulator::default();
        for i in 0..20_u32 {
            let angle_deg = if i == 0 { 90.0 } else { 1.0 };
            let pair = test_fixtures::with_confidence(&format!("p{i:02}"), f64::from(i) / 20.0);
            report.add(&pair, &test_fixtures::truth(angle_deg, 1.0, 0.9));
        }
        let report = report.finish();
        let drawn = risk_coverage(&report, Basis::Truth).into_string();
        assert_eq!(drawn.matches("<polyline").count(), 4, "{drawn}");
        for part in [
            ">Results kept, the most confident first (%)</text>",
            ">Acc by ground truth (%)</text>",
            "Ensemble 95.0\u{202f}% of all results and 100.0\u{202f}% of half of them",
            ". Lines that lie on each other: Non-luminous SSIM, Pixel density, Ensemble, Relief.",
            // All results at 95 %: the middle of an axis from 90 to 100.
            "440.0,142.0",
        ] {
            assert!(drawn.contains(part), "{part}: {drawn}");
        }
        assert_eq!(risk_coverage(&report, Basis::Verdicts).into_string(), "");
    }
}
