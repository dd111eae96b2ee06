//! Measures the smooth part of the misfit between the edges of ink and strokes: how far whole stretches of edges are
//! displaced from each other.
//!
//! Dry ink and lost wood make edges rough, and a sheet that shrank or was photographed at an angle displaces them by an
//! affine map. Ink that spreads unevenly, worn tops and heights that drift widen or narrow strokes: both edges of a stroke
//! move by the same distance, but in opposite directions. Another block of the same text has its strokes in slightly other
//! places: both edges of a stroke move in the same direction, by other distances in each part of the character.

use nalgebra::{DMatrix, DVector};

use super::half_canvas::HalfCanvas;
use super::ink_edge::InkEdge;

/// Number of cells along a side of the canvas. In each, the edges may have a displacement of their own.
const CELLS: usize = 8;
/// Edges that are farther apart than this fraction of the stroke width are no partners.
const NEAR: f64 = 0.5;
/// Least number of edges for a measurement.
const LEAST_EDGES: usize = 200;
/// Weight of the prior that an unknown is 0, in edges. It keeps directions without edges at 0.
const PRIOR: f64 = 4.0;
/// Misfit that the pixels of a small print cause if they are as wide as strokes. Measured on right pairs with prints of 12 to
/// 24 px.
const PIXEL_MISFIT: f64 = 0.08;

/// An edge between ink and background.
#[derive(Debug, Clone, Copy)]
struct Edge {
    /// Position relative to the middle of the canvas, as a fraction of its half side.
    at: [f64; 2],
    /// Unit vector towards the ink.
    normal: [f64; 2],
    /// Distance from the edge of the strokes, in stroke widths, positive inside the strokes.
    distance: f64,
}

/// Returns the root mean square of the displacements of the edges that neither an affine map, nor the width of the strokes
/// in each part of the character, nor the roughness of the edges explains, as a fraction of the stroke width. `strokes` are
/// the distances to the edge of the strokes.
pub(super) fn smooth_misfit(canvas: &HalfCanvas, strokes: &InkEdge) -> f64 {
    let mut edges = edges(canvas, strokes);
    if edges.len() < LEAST_EDGES {
        return 0.0;
    }
    fit(
        &mut edges,
        |_| 0,
        |edge| {
            let ([x, y], [a, b]) = (edge.at, edge.normal);
            [a, b, a * x, a * y, b * x, b * y, 1.0]
        },
    );
    let squares = |edges: &[Edge]| edges.iter().map(|edge| edge.distance.powi(2)).sum::<f64>();
    let cell = |edge: &Edge| {
        let [x, y] = edge.at.map(|at| {
            let cell = at.midpoint(1.0) * CELLS as f64;
            (cell as usize).min(CELLS - 1)
        });
        y * CELLS + x
    };
    let count = edges.len() as f64;
    fit(&mut edges, cell, |_| [1.0]);
    let before = squares(&edges);
    fit(&mut edges, cell, |edge| {
        [edge.normal[0], edge.normal[1], 1.0]
    });
    let misfit = ((before - squares(&edges)).max(0.0) / count).sqrt();
    canvas.without_pixels(misfit, PIXEL_MISFIT)
}

/// Subtracts from the distances what a linear model explains in each group of edges.
fn fit<const N: usize>(
    edges: &mut [Edge],
    group: impl Fn(&Edge) -> usize,
    row: impl Fn(&Edge) -> [f64; N],
) {
    let groups = 1 + edges.iter().map(&group).max().unwrap_or(0);
    let empty = || (DMatrix::identity(N, N) * PRIOR, DVector::zeros(N));
    let mut equations: Vec<(DMatrix<f64>, DVector<f64>)> = (0..groups).map(|_| empty()).collect();
    for edge in edges.iter() {
        let (normal, right) = &mut equations[group(edge)];
        let row = row(edge);
        for i in 0..N {
            for j in 0..N {
                normal[(i, j)] += row[i] * row[j];
            }
            right[i] += row[i] * edge.distance;
        }
    }
    let solved: Vec<Option<DVector<f64>>> = equations
        .into_iter()
        .map(|(normal, right)| Some(normal.cholesky()?.solve(&right)))
        .collect();
    for edge in edges {
        let Some(unknowns) = &solved[group(edge)] else {
            continue;
        };
        let row = row(edge);
        edge.distance -= (0..N).map(|i| row[i] * unknowns[i]).sum::<f64>();
    }
}

/// Returns the edges of the ink that have a partner.
fn edges(canvas: &HalfCanvas, strokes: &InkEdge) -> Vec<Edge> {
    let ink = canvas.edge.grid();
    let (width, half) = (ink.width(), ink.width().max(ink.height()) as f64 / 2.0);
    let mut edges = Vec::new();
    canvas.each_adjacent_pair(|one, other| {
        if canvas.ink.data()[one] == canvas.ink.data()[other] {
            return;
        }
        let distance = f64::from(strokes.at(one).midpoint(strokes.at(other))) / canvas.stroke_width;
        let (x, y) = (one % width, one / width);
        let slope = |dx: i64, dy: i64| {
            let at = |sign: i64| ink.get(x as i64 + 2 * sign * dx, y as i64 + 2 * sign * dy);
            f64::from(at(1).unwrap_or(0.0) - at(-1).unwrap_or(0.0))
        };
        let towards = [slope(1, 0), slope(0, 1)];
        let length = towards[0].hypot(towards[1]);
        if distance.abs() < NEAR && length > 0.5 {
            edges.push(Edge {
                at: [x, y].map(|at| at as f64 / half - 1.0),
                normal: towards.map(|part| part / length),
                distance,
            });
        }
    });
    edges
}

#[cfg(test)]
mod tests {
    use super::smooth_misfit;
    use crate::stages::register::half_canvas::HalfCanvas;
    use crate::stages::register::ink_edge::InkEdge;
    use mocban_core::raster::{Grid, Mask};

    const SIDE: usize = 192;

    /// Returns whether a point lies on one of the bars in two directions, each of which is `wider` px wider on each side.
    fn is_bar(x: f64, y: f64, wider: f64) -> bool {
        let inside = |at: f64| (16.0 - wider..176.0 + wider).contains(&at);
        let on = |at: f64| (at + wider).rem_euclid(48.0) < 14.0 + 2.0 * wider;
        inside(x) && inside(y) && (on(x) || on(y))
    }

    /// Measures the ink against the bars. `is_ink` returns whether a pixel is ink.
    fn measured(is_ink: impl Fn(usize, usize) -> bool) -> f64 {
        let ink = Mask::from_fn(SIDE, SIDE, is_ink);
        let wood = Mask::from_fn(SIDE, SIDE, |x, y| is_bar(x as f64, y as f64, 0.0));
        let canvas = HalfCanvas::of(Grid::new(SIDE, SIDE, 1), ink);
        smooth_misfit(&canvas, &InkEdge::of(&wood))
    }

    /// Measures bars of displaced ink. `shift` returns how far the ink of a place is displaced, in pixels.
    fn misfit(shift: impl Fn(usize, usize) -> [f64; 2]) -> f64 {
        measured(|x, y| {
            let [dx, dy] = shift(x, y);
            is_bar(x as f64 - dx, y as f64 - dy, 0.0)
        })
    }

    /// Measures bars of ink that spreads. `wider` returns how far the ink of a place spreads, in pixels.
    fn widened(wider: impl Fn(usize, usize) -> f64) -> f64 {
        measured(|x, y| is_bar(x as f64, y as f64, wider(x, y)))
    }

    #[test]
    fn only_displacements_that_differ_between_parts_count() {
        assert!(misfit(|_, _| [0.0; 2]) < 0.02);
        assert!(misfit(|_, _| [2.0, -1.0]) < 0.05);
        // A sheet that shrank along one axis.
        assert!(misfit(|x, _| [0.02 * (x as f64 - 96.0), 0.0]) < 0.06);
        // Ink that spreads farther at the left and at the right than in the middle.
        let uneven = widened(|x, _| 1.5 * ((x as f64 - 96.0) / 40.0).abs());
        assert!(uneven < 0.04, "{uneven}");
        // Ragged edges.
        let ragged = misfit(|x, y| [((x * 7 + y * 13) % 5) as f64 - 2.0, 0.0]);
        assert!(ragged < 0.09, "{ragged}");
        let other = misfit(|x, y| {
            let wave = |at: usize| 4.0 * (at as f64 / 11.0).sin();
            [wave(y), wave(x)]
        });
        assert!(other > 0.1, "{other}");
    }
}
