//! The irregular outline along which a scan or a print is cut.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A box in mm as the print reads: least and greatest u and v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BoxMm {
    /// Least u and v.
    pub min: [f64; 2],
    /// Greatest u and v.
    pub max: [f64; 2],
}

/// A closed polygon in mm, as the print reads.
#[derive(Debug, Clone)]
pub(super) struct Polygon {
    /// Corners in order.
    pub corners: Vec<[f64; 2]>,
}

impl Polygon {
    /// An irregular polygon that holds the box and `margin_mm` around it, nowhere more than `wander_mm` farther out.
    pub(super) fn around(
        inner: BoxMm,
        margin_mm: f64,
        wander_mm: f64,
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
            corners.push(
                [0, 1].map(|k| {
                    from[k] + (out[k] + before[k]) * rng.random_range(0.0..0.7 * wander_mm)
                }),
            );
            for middle in 0..rng.random_range(0..3_u32) {
                let t = 0.5 * (f64::from(middle) + rng.random_range(0.3..0.7));
                let push = rng.random_range(0.0..wander_mm);
                corners.push([0, 1].map(|k| from[k] + (to[k] - from[k]) * t + out[k] * push));
            }
        }
        Self { corners }
    }

    /// The smallest box that holds it.
    pub(super) fn bounds(&self) -> BoxMm {
        let extreme = |start: f64, pick: fn(f64, f64) -> f64| {
            [0, 1].map(|i| {
                self.corners
                    .iter()
                    .map(|corner| corner[i])
                    .fold(start, pick)
            })
        };
        BoxMm {
            min: extreme(f64::INFINITY, f64::min),
            max: extreme(f64::NEG_INFINITY, f64::max),
        }
    }

    /// Whether a point lies inside (crossing number).
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

    use super::{BoxMm, Polygon};

    #[test]
    fn polygon_holds_the_box_and_its_margin() {
        let inner = BoxMm {
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
