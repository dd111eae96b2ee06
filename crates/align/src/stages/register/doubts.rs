//! What lowers the confidence of an alignment beside the models of `confidence`: a part of the print that was left out,
//! edges of another block, and ink beside the scan.

/// Displacement of whole edges at which it is as probable that print and relief come from two blocks as from one, and its
/// deviation, both as fractions of the stroke width.
const OTHER_BLOCK: f64 = 0.115;
const OTHER_BLOCK_DEVIATION: f64 = 0.006;
/// Fraction of the ink that must lie where the depth map has data.
const LEAST_SEEN: f64 = 0.5;

/// What lowers the confidence of an alignment, apart from the three logistic models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubts {
    /// Fraction of the print's ink that lies on the registered part, 1 for a whole print.
    pub share: f64,
    /// Displacement of whole edges, as a fraction of the stroke width.
    pub smooth_misfit: f64,
    /// Fraction of the ink of the registered part that lies where the depth map has data, 0..=1.
    pub seen_ink: f64,
}

impl Doubts {
    /// Returns the factor of the confidence, 0..=1.
    pub(super) fn factor(&self) -> f64 {
        self.share * of_same_block(self.smooth_misfit) * of_seen_ink(self.seen_ink)
    }
}

/// Returns the probability, 0..=1, that print and relief come from the same block and not from another one with the same or
/// a similar character. `smooth_misfit` is the displacement of whole edges, as a fraction of the stroke width. It is 0.03 to
/// 0.1 on right pairs, 0.11 if much wood is lost, and 0.1 to 0.17 on prints of another hand.
fn of_same_block(smooth_misfit: f64) -> f64 {
    1.0 / (1.0 + ((smooth_misfit - OTHER_BLOCK) / OTHER_BLOCK_DEVIATION).exp())
}

/// Returns the factor of the confidence if only the fraction `seen_ink` of the ink lies where the depth map has data: the
/// strokes of a small part of the print fit many reliefs.
fn of_seen_ink(seen_ink: f64) -> f64 {
    (seen_ink / LEAST_SEEN).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::{of_same_block, of_seen_ink};

    #[test]
    fn little_ink_on_the_scan_lowers_the_confidence() {
        assert_eq!([0.25, 0.5, 0.9].map(of_seen_ink), [0.5, 1.0, 1.0]);
    }

    #[test]
    fn edges_that_are_displaced_as_a_whole_are_evidence_against_the_block() {
        assert!(of_same_block(0.07) > 0.99 && of_same_block(0.1) > 0.9);
        assert!(of_same_block(0.14) < 0.05);
    }
}
