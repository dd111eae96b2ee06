//! A picture of two strokes for tests.

/// Side of the picture, pixels.
pub(super) const SIDE: usize = 150;

/// Returns whether a pixel lies on a stroke.
pub(super) fn is_stroke(x: usize, y: usize) -> bool {
    (60..74).contains(&x) && (15..135).contains(&y)
        || (20..130).contains(&x) && (40..52).contains(&y)
}
