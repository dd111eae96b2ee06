//! Random numbers of the parts of a world.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Returns the random numbers of a part of the world of a seed. The numbers of two parts are independent, so a change of
/// one part does not change the others.
pub(super) fn part_rng(seed: u64, part: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(part);
    rng
}

/// Returns a hash of a seed and two coordinates, by the finalizer of `SplitMix64`.
pub(super) fn hash(seed: u64, x: u64, y: u64) -> u64 {
    let mut bits = seed
        ^ x.wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F).rotate_left(23);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^ (bits >> 31)
}

/// Returns a random number of mean 0 and variance 1 that depends only on its arguments: the scaled sum of four uniform
/// numbers of 16 bits.
pub(super) fn hashed_normal(seed: u64, x: u64, y: u64) -> f64 {
    let bits = hash(seed, x, y);
    let sum = (0..4)
        .map(|k| ((bits >> (16 * k)) & 0xFFFF) as f64)
        .sum::<f64>();
    // A uniform number on 0..1 has a variance of 1/12.
    (sum / 65_536.0 - 2.0) * 3.0_f64.sqrt()
}
