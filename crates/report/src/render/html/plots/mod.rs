//! SVG plots of numbers in the tables of the page. They use the page's colours.

mod axis;
mod coverage;
mod dots;
mod histograms;

use maud::{Markup, html};

use self::axis::PlotAxis;
use super::markup::prose;

pub(super) use coverage::risk_coverage;
pub(super) use dots::{accuracy, times};
pub(super) use histograms::thresholds;

/// Width of a plot in SVG units.
const WIDTH: f64 = 460.0;
/// Left end of the axis, right of the names of rows.
const LEFT: f64 = 140.0;
/// Right end of the axis, left of the numbers.
const RIGHT: f64 = 400.0;
/// Height of the tick labels and the title of the axis below the rows.
const SCALE: f64 = 42.0;

/// Returns a plot with its caption. `alt` is its text for screen readers.
fn figure(height: f64, alt: &str, caption: &str, drawing: &Markup) -> Markup {
    let frame = format!("0 0 {WIDTH} {height}");
    html! {
        figure class="plot" {
            svg role="img" aria-label=(prose(alt)) viewBox=(frame) { (drawing) }
            figcaption { (prose(caption)) "." }
        }
    }
}

/// Returns tick labels and title of a horizontal axis below `bottom`, with grid lines from `top`.
fn horizontal_axis(axis: &PlotAxis, [top, bottom]: [f64; 2], title: &str) -> Markup {
    html! {
        @for value in axis.ticks() {
            @let x = at(axis.place(value));
            line.grid x1=(x) x2=(x) y1=(at(top)) y2=(at(bottom)) {}
            text.mark x=(x) y=(at(bottom + 16.0)) { (axis.label(value)) }
        }
        text.title x=(at(axis.middle())) y=(at(bottom + 34.0)) { (prose(title)) }
    }
}

/// Returns the text of a plot for screen readers.
fn alt_text(caption: &str, labels: impl Iterator<Item = String>) -> String {
    format!("{caption}. {}.", labels.collect::<Vec<_>>().join(". "))
}

/// Formats a coordinate.
fn at(place: f64) -> String {
    format!("{place:.1}")
}
