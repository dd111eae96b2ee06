//! Vertices with the smallest and the largest coordinates along each axis.

use crate::domain::cancel::polled;
use crate::mesh::triangle_mesh::Vertices;

/// The extreme ones of some vertices.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExtremeVertices {
    /// A vertex with the smallest and one with the largest coordinate along each axis.
    ends: Option<[[[f64; 3]; 2]; 3]>,
}

impl ExtremeVertices {
    /// Has seen no vertex.
    pub(super) const NONE: Self = Self { ends: None };

    /// Returns the extreme ones of the vertices that have a position.
    pub(super) fn of(vertices: &Vertices, is_position: impl Fn([f64; 3]) -> bool) -> Self {
        let mut extremes = Self::NONE;
        for vertex in polled(vertices.iter()).filter(|vertex| is_position(*vertex)) {
            extremes.add(vertex);
        }
        extremes
    }

    pub(super) fn add(&mut self, vertex: [f64; 3]) {
        let ends = self.ends.get_or_insert([[vertex; 2]; 3]);
        for (axis, [low, high]) in ends.iter_mut().enumerate() {
            if vertex[axis] < low[axis] {
                *low = vertex;
            }
            if vertex[axis] > high[axis] {
                *high = vertex;
            }
        }
    }

    /// Returns the extreme vertices; one may be there several times.
    pub(super) fn all(&self) -> impl Iterator<Item = [f64; 3]> {
        self.ends.into_iter().flatten().flatten()
    }

    /// Returns the largest absolute value of a coordinate; 0 without vertices.
    pub(super) fn largest(&self) -> f64 {
        let values = self.all().flatten().map(f64::abs);
        values.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::ExtremeVertices;

    #[test]
    fn the_ends_of_each_axis_are_kept() {
        assert_eq!(ExtremeVertices::NONE.all().count(), 0);
        let all = vec![
            [0.0, 5.0, 1.0],
            [3.0, -7.0, 2.0],
            [1.0, 1.0, 1.5],
            [f64::NAN; 3],
        ];
        let extremes = ExtremeVertices::of(&all.into(), |vertex| !vertex[0].is_nan());
        let found: Vec<[f64; 3]> = extremes.all().collect();
        let [a, b] = [[0.0, 5.0, 1.0], [3.0, -7.0, 2.0]];
        assert_eq!(found, [a, b, b, a, a, b]);
        assert!((extremes.largest() - 7.0).abs() < 1e-12);
    }
}
