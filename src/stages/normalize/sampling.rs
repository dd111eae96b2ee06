//! The rows and columns of a depth map from which its heights are measured.

/// Pixel step at which heights are sampled.
const STRIDE: usize = 3;

/// Returns the rows or columns from `low` to `high` at which heights are sampled. `margin` is the share left out at
/// each end. The samples are symmetric about the middle, so a map rotated by 180 degrees gives the same samples.
pub(super) fn sampled(low: usize, high: usize, margin: f64) -> impl Iterator<Item = usize> {
    let cut = ((high - low) as f64 * margin) as usize;
    let rest = 2 * (high - low - 2 * cut) % STRIDE;
    (low + cut + rest..=high - cut).step_by(STRIDE)
}
