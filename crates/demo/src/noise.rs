//! Value noise and random draws.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A smooth random function of the plane with features of about one unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    seed: u64,
}

impl Noise {
    /// Draws a new function.
    pub(super) fn draw(rng: &mut ChaCha8Rng) -> Self {
        Self { seed: rng.random() }
    }

    /// Returns the value at a point, -1..1.
    pub(super) fn at(self, x: f64, y: f64) -> f64 {
        let (ix, iy) = (floor(x), floor(y));
        let [fx, fy] = [x - ix as f64, y - iy as f64].map(smoothstep_unit);
        let row = |y| lerp(self.lattice_value(ix, y), self.lattice_value(ix + 1, y), fx);
        lerp(row(iy), row(iy + 1), fy)
    }

    /// Returns the sum of two octaves, which lies in -1.5..1.5. The second octave has half the amplitude of the first.
    pub(super) fn two_octaves(self, x: f64, y: f64) -> f64 {
        self.at(x, y) + 0.5 * self.at(2.17 * x + 31.7, 2.17 * y - 11.3)
    }

    /// Returns the random value of a lattice point, in -1..1, computed by integer hashing.
    fn lattice_value(self, x: i64, y: i64) -> f64 {
        let mut bits = self.seed
            ^ (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        bits = (bits ^ (bits >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 32)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^= bits >> 31;
        (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Draws from the standard normal distribution (Box and Muller 1958).
pub(super) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

/// Interpolates linearly from `a` at `t` = 0 to `b` at `t` = 1.
pub(super) fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// Returns 0 if `x` is below `low`, 1 if `x` is above `high`, and a smooth transition in between.
pub(super) fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    smoothstep_unit(((x - low) / (high - low)).clamp(0.0, 1.0))
}

/// Returns the largest integer that is not above `x`. This function runs a million times per pair. On the baseline
/// x86-64 target, `f64::floor` would be a library call.
fn floor(x: f64) -> i64 {
    let toward_zero = x as i64;
    toward_zero - i64::from((toward_zero as f64) > x)
}

fn smoothstep_unit(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::{Noise, normal};

    #[test]
    fn noise_is_smooth_bounded_and_random() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (one, other) = (Noise::draw(&mut rng), Noise::draw(&mut rng));
        let mut differ = 0;
        for i in 0..500 {
            let (x, y) = (f64::from(i) * 0.37 - 80.0, f64::from(i) * 0.11);
            assert!(one.at(x, y).abs() <= 1.0);
            assert!((one.at(x + 1e-6, y) - one.at(x, y)).abs() < 1e-5);
            differ += i32::from((one.at(x, y) - other.at(x, y)).abs() > 0.01);
        }
        assert!(differ > 400);
    }

    #[test]
    fn normal_draws_have_unit_variance() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let n = 20_000;
        let square: f64 = (0..n).map(|_| normal(&mut rng).powi(2)).sum();
        assert!((square / f64::from(n) - 1.0).abs() < 0.05);
    }
}
