//! The rows and columns of a depth map from which its heights are measured.

/// Pixel step at which heights are sampled.
const STRIDE: usize = 3;

/// Returns the rows or columns from `low` to `high` at which heights are sampled. The samples are symmetric about the
/// middle, so a map rotated by 180 degrees gives the same samples.
pub(super) fn sampled(low: usize, high: usize) -> impl Iterator<Item = usize> {
    let rest = 2 * (high - low) % STRIDE;
    (low + rest..=high).step_by(STRIDE)
}
