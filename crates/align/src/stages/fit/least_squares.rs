//! Points of a height map, and weighted least squares over them.
//!
//! Fitting a surface takes about thirty passes. The points are stored in blocks, so that SIMD instructions apply.

use nalgebra::{Matrix6, Vector6};

use mocban_core::simd::dispatch;

/// Points in a block.
const LANES: usize = 4;
type PointLanes = [f64; LANES];

/// Coefficients of 1, u, v, u^2, u v, v^2.
pub(super) type Coefficients = [f64; 6];

/// Points u, v, z.
#[derive(Debug, Default)]
pub(super) struct Points {
    /// u, v and z of a block of points; zeros after the last point.
    blocks: Vec<[PointLanes; 3]>,
    count: usize,
}

/// Gaussian prior of a coefficient.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    pub(super) mean: f64,
    /// Inverse variance, in the units of the points' weights.
    pub(super) precision: f64,
}

impl Points {
    /// Creates an empty list with room for `count` points.
    pub(super) fn with_capacity(count: usize) -> Self {
        Self {
            blocks: Vec::with_capacity(count.div_ceil(LANES)),
            count: 0,
        }
    }

    pub(super) fn push(&mut self, point: [f64; 3]) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.blocks.push([[0.0; LANES]; 3]);
        }
        if let Some(last) = self.blocks.last_mut() {
            for (axis, value) in last.iter_mut().zip(point) {
                axis[lane] = value;
            }
        }
        self.count += 1;
    }

    pub(super) const fn len(&self) -> usize {
        self.count
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = [f64; 3]> {
        let points = self.blocks.iter();
        points
            .flat_map(|block| (0..LANES).map(move |k| [0, 1, 2].map(|axis: usize| block[axis][k])))
            .take(self.count)
    }

    /// Returns the height of each point over a surface.
    pub(super) fn residuals(&self, c: &Coefficients) -> Vec<f64> {
        let mut residuals: Vec<f64> = self.blocks.iter().flat_map(|b| over::<6>(b, c)).collect();
        residuals.truncate(self.count);
        residuals
    }

    /// Computes the first `TERMS` coefficients by weighted least squares: 3 for a plane, 6 for a curved surface.
    /// `weight` maps the height of a point over the surface `from` to the weight of the point.
    pub(super) fn solve<const TERMS: usize>(
        &self,
        from: &Coefficients,
        weight: impl Fn(f64) -> f64,
        priors: &[Prior; 6],
    ) -> Coefficients {
        let (blocks, whole) = (&self.blocks, self.count / LANES);
        // The sums are local and each block is copied, because possible aliasing would prevent vectorization.
        let mut sums = dispatch!({
            let mut sums = MomentSums::default();
            for block in &blocks[..whole] {
                let block = *block;
                let mut weights = over::<TERMS>(&block, from);
                for over in &mut weights {
                    *over = weight(*over);
                }
                sums.add::<TERMS>(&block, weights);
            }
            sums
        });
        if let Some(block) = self.blocks.get(whole) {
            let mut weights = over::<TERMS>(block, from).map(&weight);
            weights[self.count % LANES..].fill(0.0);
            sums.add::<TERMS>(block, weights);
        }
        sums.solve(TERMS, priors)
    }
}

/// Priors without weight.
pub(super) const OPEN: [Prior; 6] = [Prior {
    mean: 0.0,
    precision: 0.0,
}; 6];

/// Returns the height of a surface at a point.
pub(super) fn value(c: &Coefficients, [u, v]: [f64; 2]) -> f64 {
    c[0] + c[1] * u + c[2] * v + c[3] * (u * u) + c[4] * (u * v) + c[5] * (v * v)
}

/// Returns the heights of points over the surface given by the first `TERMS` coefficients.
#[inline(always)]
fn over<const TERMS: usize>([u, v, z]: &[PointLanes; 3], c: &Coefficients) -> PointLanes {
    let mut over = [0.0; LANES];
    for k in 0..LANES {
        let mut height = c[0] + c[1] * u[k] + c[2] * v[k];
        if TERMS == 6 {
            height += c[3] * (u[k] * u[k]) + c[4] * (u[k] * v[k]) + c[5] * (v[k] * v[k]);
        }
        over[k] = z[k] - height;
    }
    over
}

/// Multiplies lane by lane, in a loop that is inlined and vectorized.
#[inline(always)]
fn times(a: &PointLanes, b: &PointLanes) -> PointLanes {
    let mut products = [0.0; LANES];
    for k in 0..LANES {
        products[k] = a[k] * b[k];
    }
    products
}

/// Number of monomials of u and v up to the second degree.
const SECOND: usize = 6;
/// Number of monomials of u and v up to the fourth degree.
const FOURTH: usize = 15;

/// Weighted sums over points, one sum per lane.
#[derive(Default)]
struct MomentSums {
    /// Sums of the monomials `u^i v^j` in the order of degree.
    powers: [PointLanes; FOURTH],
    /// Sums of z times the first six monomials.
    heights: [PointLanes; SECOND],
}

impl MomentSums {
    #[inline(always)]
    fn add<const TERMS: usize>(&mut self, [u, v, z]: &[PointLanes; 3], weights: PointLanes) {
        let mut put = |place: usize, product: &PointLanes| {
            for k in 0..LANES {
                self.powers[place][k] += product[k];
                if place < TERMS {
                    self.heights[place][k] += product[k] * z[k];
                }
            }
        };
        // All monomials of a degree follow from the degree before: each one times u, and the last one times v. A loop
        // over the degrees would take four times as long.
        let (one, first) = (weights, [times(&weights, u), times(&weights, v)]);
        let second = [
            times(&first[0], u),
            times(&first[1], u),
            times(&first[1], v),
        ];
        put(0, &one);
        put(1, &first[0]);
        put(2, &first[1]);
        for (k, product) in second.iter().enumerate() {
            put(3 + k, product);
        }
        if TERMS < SECOND {
            return;
        }
        let [uu, uv, vv] = second;
        let third = [times(&uu, u), times(&uv, u), times(&vv, u), times(&vv, v)];
        for (k, product) in third.iter().enumerate() {
            put(6 + k, product);
        }
        let [uuu, uuv, uvv, vvv] = third;
        let fourth = [
            times(&uuu, u),
            times(&uuv, u),
            times(&uvv, u),
            times(&vvv, u),
            times(&vvv, v),
        ];
        for (k, product) in fourth.iter().enumerate() {
            put(10 + k, product);
        }
    }

    /// Solves the normal equations for the first `terms` coefficients. Returns zeros if the equations are singular.
    fn solve(&self, terms: usize, priors: &[Prior; 6]) -> Coefficients {
        let total = |lanes: &PointLanes| lanes.iter().sum::<f64>();
        let mut normal = Matrix6::<f64>::identity();
        let mut side = Vector6::<f64>::zeros();
        for i in 0..terms {
            let Prior { mean, precision } = priors[i];
            side[i] = total(&self.heights[i]) + precision * mean;
            for j in 0..terms {
                normal[(i, j)] = total(&self.powers[product(i, j)]);
            }
            normal[(i, i)] += precision + 1e-12;
        }
        normal
            .cholesky()
            .map_or([0.0; 6], |factor| factor.solve(&side).into())
    }
}

/// Returns the index of the product of monomials `i` and `j` in the order 1, u, v, uu, uv, vv, uuu and so on.
fn product(i: usize, j: usize) -> usize {
    // Degree and exponent of v of each monomial 1, u, v, uu, uv, vv.
    let of = |k: usize| [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)][k];
    let ((a, p), (b, q)) = (of(i), of(j));
    let degree: usize = a + b;
    degree * (degree + 1) / 2 + p + q
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{OPEN, Points, Prior, value};

    fn scattered(count: usize, height: impl Fn([f64; 2]) -> f64) -> Points {
        let mut points = Points::default();
        for k in 0..count {
            let at = [7, 13].map(|step| (k * step % 31) as f64 / 31.0 - 0.5);
            points.push([at[0], at[1], height(at)]);
        }
        points
    }

    proptest! {
        #[test]
        fn a_surface_is_found_again(
            c in prop::array::uniform6(-2.0..2.0_f64),
            count in 40_usize..90,
            tilt in 0.0..0.9_f64,
        ) {
            let points = scattered(count, |at| value(&c, at));
            let found = points.solve::<6>(&[0.0; 6], |r| 1.0 + tilt * r.sin(), &OPEN);
            for (one, two) in found.iter().zip(c) {
                prop_assert!((one - two).abs() < 1e-7, "{found:?} {c:?}");
            }
            let over = points.residuals(&c);
            prop_assert_eq!(over.len(), count);
            prop_assert!(over.iter().all(|r| r.abs() < 1e-12));
        }
    }

    #[test]
    fn points_of_weight_zero_have_no_effect() {
        let plane = [0.3, -0.1, 0.2, 0.0, 0.0, 0.0];
        let spiked = |at: [f64; 2]| value(&plane, at) + if at[0] > 0.3 { 5.0 } else { 0.0 };
        let weight = |r: f64| f64::from(u8::from(r < 1.0));
        let found = scattered(61, spiked).solve::<3>(&plane, weight, &OPEN);
        for (one, two) in found.iter().zip(plane) {
            assert!((one - two).abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn a_prior_decides_where_points_do_not() {
        let mut points = Points::default();
        (0..20).for_each(|k| points.push([f64::from(k) / 20.0, 0.0, 1.0]));
        let mut priors = OPEN;
        priors[2] = Prior {
            mean: 0.7,
            precision: 1.0,
        };
        let found = points.solve::<3>(&[0.0; 6], |_| 1.0, &priors);
        assert!((found[2] - 0.7).abs() < 1e-6, "{found:?}");
        assert!((found[0] - 1.0).abs() < 1e-6, "{found:?}");
    }
}
