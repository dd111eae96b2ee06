//! Irregular outlines along which scans and prints are cut.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// An axis-aligned box in (u, v), in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BoundsMm {
    /// Minimum u and v.
    pub min: [f64; 2],
    /// Maximum u and v.
    pub max: [f64; 2],
}

impl BoundsMm {
    /// Returns the bounding box of some points. Without points, its minimum is infinite.
    pub(super) fn around(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            min = [0, 1].map(|i| min[i].min(point[i]));
            max = [0, 1].map(|i| max[i].max(point[i]));
        }
        Self { min, max }
    }

    /// Returns width and height.
    pub(super) fn size(self) -> [f64; 2] {
        [0, 1].map(|i| self.max[i] - self.min[i])
    }

    /// Returns the box with a margin around it.
    pub(super) fn with_margin(self, margin_mm: f64) -> Self {
        Self {
            min: self.min.map(|c| c - margin_mm),
            max: self.max.map(|c| c + margin_mm),
        }
    }

    /// Returns the corners in order around the box, from the minimum.
    pub(super) const fn corners(self) -> [[f64; 2]; 4] {
        let ([u0, v0], [u1, v1]) = (self.min, self.max);
        [[u0, v0], [u1, v0], [u1, v1], [u0, v1]]
    }
}

/// A closed polygon in (u, v), in mm.
#[derive(Debug, Clone)]
pub(super) struct Polygon {
    /// Vertices in order.
    pub corners: Vec<[f64; 2]>,
}

impl Polygon {
    /// Draws an irregular polygon around a box. Its sides lie between `margin_mm` and `margin_mm + max_excess_mm`
    /// outside the box.
    pub(super) fn around(
        inner: BoundsMm,
        margin_mm: f64,
        max_excess_mm: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let around = inner.with_margin(margin_mm).corners();
        let outward = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
        let mut corners = Vec::new();
        for i in 0..4 {
            let (from, to) = (around[i], around[(i + 1) % 4]);
            let (out, before): ([f64; 2], [f64; 2]) = (outward[i], outward[(i + 3) % 4]);
            corners.push([0, 1].map(|k| {
                from[k] + (out[k] + before[k]) * rng.random_range(0.0..0.7 * max_excess_mm)
            }));
            for middle in 0..rng.random_range(0..3_u32) {
                let t = 0.5 * (f64::from(middle) + rng.random_range(0.3..0.7));
                let push = rng.random_range(0.0..max_excess_mm);
                corners.push([0, 1].map(|k| from[k] + (to[k] - from[k]) * t + out[k] * push));
            }
        }
        Self { corners }
    }

    /// Returns the bounding box.
    pub(super) fn bounds(&self) -> BoundsMm {
        BoundsMm::around(self.corners.iter().copied())
    }

    /// Returns whether a point lies inside (crossing-number test).
    pub(super) fn contains(&self, [u, v]: [f64; 2]) -> bool {
        let n = self.corners.len();
        let mut inside = false;
        for i in 0..n {
            let ([ua, va], [ub, vb]) = (self.corners[i], self.corners[(i + 1) % n]);
            if (va > v) != (vb > v) && u < ua + (v - va) / (vb - va) * (ub - ua) {
                inside = !inside;
            }
        }
        inside
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::{BoundsMm, Polygon};

    #[test]
    fn polygon_contains_the_box_and_its_margin() {
        let inner = BoundsMm {
            min: [-4.0, -5.0],
            max: [4.5, 5.0],
        };
        for seed in 0..50 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let polygon = Polygon::around(inner, 0.3, 1.0, &mut rng);
            for u in [-4.29, 0.0, 4.79] {
                for v in [-5.29, 0.7, 5.29] {
                    assert!(polygon.contains([u, v]), "seed {seed}: {u}, {v}");
                }
            }
            assert!(!polygon.contains([-6.0, 0.0]) && !polygon.contains([0.0, 7.0]));
        }
    }
}
