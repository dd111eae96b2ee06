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
        let [u0, v0] = inner.min.map(|c| c - margin_mm);
        let [u1, v1] = inner.max.map(|c| c + margin_mm);
        let sides = [
            ([u0, v0], [u1, v0], [0.0, -1.0]),
            ([u1, v0], [u1, v1], [1.0, 0.0]),
            ([u1, v1], [u0, v1], [0.0, 1.0]),
            ([u0, v1], [u0, v0], [-1.0, 0.0]),
        ];
        let mut corners = Vec::new();
        for (i, (from, to, out)) in sides.into_iter().enumerate() {
            let before = sides[(i + 3) % 4].2;
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
        let extreme = |start: f64, pick: fn(f64, f64) -> f64| {
            let corners = self.corners.iter();
            corners.fold([start; 2], |found, corner| {
                [0, 1].map(|i| pick(found[i], corner[i]))
            })
        };
        BoundsMm {
            min: extreme(f64::INFINITY, f64::min),
            max: extreme(f64::NEG_INFINITY, f64::max),
        }
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
