//! What lowers the confidence of an alignment beside the models of `confidence`: a part of the print that was left out,
//! strokes of another block, a whole stroke that only one of print and relief has, ink beside the scan, and a mirrored relief
//! that matches better.

/// Displacement of whole strokes at which it is as probable that print and relief come from two blocks as from one, and its
/// deviation, both as fractions of the stroke width.
const OTHER_BLOCK: f64 = 0.077;
const OTHER_BLOCK_DEVIATION: f64 = 0.0035;
/// Edge scatter of a usual pair, and the displacement of whole strokes that rougher edges explain, as a fraction of the
/// scatter beyond it. On two generated blocks with a vertex every 0.85 mm, 486 right pairs have a scatter of 0.1 to 0.24 and
/// a displacement of 0.05 to 0.14; all but 3 of one block's 284 fall below [`OTHER_BLOCK`].
const USUAL_SCATTER: f64 = 0.05;
const EXPLAINED: f64 = 0.35;
/// Fraction of the print's ink that must lie on the registered part and where the depth map has data.
const LEAST_SEEN: f64 = 0.6;
/// Factor of the confidence of a part with hardly any ink. It is 1 for a whole print.
const OF_PART: f64 = 0.5;
/// Factor of the confidence if one of print and relief surely has a whole stroke that the other one lacks.
const OF_LONE_STROKE: f64 = 0.25;
/// Range of the product of the overlaps of ink and strokes on the two parts of a torn print, in which the confidence falls
/// to [`OF_BAD_PARTS`]. It is 0.47 to 0.88 on right pairs, and 0.25 to 0.59 on prints of similar characters.
const PARTS_OVERLAPS: [f64; 2] = [0.4, 0.5];
/// Factor of the confidence of parts of a torn print that agree badly with the relief.
const OF_BAD_PARTS: f64 = 0.4;
/// Range of the side of a print's pixels, as a fraction of the stroke width, in which the confidence falls to [`COARSE`].
const PIXEL_WIDTHS: [f64; 2] = [0.88, 1.02];
/// Factor of the confidence of a print whose pixels are about as wide as its strokes. Prints by another hand or
/// of a similar character may then agree as well as the right one.
const COARSE: f64 = 0.5;
/// Score of the mirrored relief, as a fraction of that of the relief, at which the pair is as probably mirrored as not,
/// and its deviation. It is above 1, because mirrored pairs are rare. Right pairs of symmetric characters are near 1.
const MIRRORED: f64 = 1.03;
const MIRRORED_DEVIATION: f64 = 0.008;

/// What lowers the confidence of an alignment, apart from the three logistic models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubts {
    /// Fraction of the print's ink that lies on the registered part, 1 for a whole print.
    pub share: f64,
    /// Displacement of whole strokes, as a fraction of the stroke width.
    pub smooth_misfit: f64,
    /// Fraction of the ink of the registered part that lies where the depth map has data, 0..=1.
    pub seen_ink: f64,
    /// How surely one of print and relief has a whole stroke that the other one lacks, 0..=1.
    pub lone_stroke: f64,
    /// Product of the intersections over union of ink and strokes on the two parts of a torn print, 1 for a whole print.
    pub parts_overlap: f64,
}

impl Doubts {
    /// Returns the factor of the confidence for strokes that tell similar characters apart, 0..=1.
    pub(super) fn of_similar_characters(&self) -> f64 {
        of_lone_stroke(self.lone_stroke) * of_parts(self.parts_overlap)
    }

    /// Returns the factor of the confidence for all else, 0..=1.
    pub(super) fn factor(&self) -> f64 {
        of_part(self.share)
            * of_same_block(self.smooth_misfit)
            * of_seen_ink(self.share * self.seen_ink)
    }
}

/// Returns the probability, 0..=1, that print and relief come from the same block and not from another one with the same or
/// a similar character. `smooth_misfit` is the displacement of whole strokes, as a fraction of the stroke width. It is 0.02 to
/// 0.06 on right pairs, up to 0.077 if much wood is lost, and 0.078 to 0.12 on nearly all prints of another hand.
fn of_same_block(smooth_misfit: f64) -> f64 {
    1.0 / (1.0 + ((smooth_misfit - OTHER_BLOCK) / OTHER_BLOCK_DEVIATION).exp())
}

/// Returns the displacement of whole strokes that rough edges do not explain, as a fraction of the stroke width. That is all
/// of it, unless the whole page agrees with the block, by the odds `prior`: then a coarse scan or faint ink are likelier
/// causes of rough edges than another block.
pub(super) fn unexplained_misfit(smooth_misfit: f64, edge_scatter: f64, prior: f64) -> f64 {
    if prior > 0.0 {
        (smooth_misfit - EXPLAINED * (edge_scatter - USUAL_SCATTER).max(0.0)).max(0.0)
    } else {
        smooth_misfit
    }
}

/// Returns the factor of the confidence if only the fraction `share` of the ink is registered, because the print is torn. Nine
/// in ten of such results are right.
fn of_part(share: f64) -> f64 {
    OF_PART + (1.0 - OF_PART) * share
}

/// Returns the factor of the confidence if only the fraction `seen_ink` of the ink lies where the depth map has data: the
/// strokes of a small part of the print fit many reliefs.
fn of_seen_ink(seen_ink: f64) -> f64 {
    (seen_ink / LEAST_SEEN).clamp(0.0, 1.0)
}

/// Returns the factor of the confidence for the overlap of ink and strokes on the two parts of a torn print. A tear that
/// explains the print of a similar character leaves a smaller part that agrees badly.
fn of_parts(overlap: f64) -> f64 {
    let [bad, good] = PARTS_OVERLAPS;
    let part = ((overlap - bad) / (good - bad)).clamp(0.0, 1.0);
    OF_BAD_PARTS + (1.0 - OF_BAD_PARTS) * part
}

/// Returns the factor of the confidence for how surely one of print and relief has a whole stroke that the other one
/// lacks.
fn of_lone_stroke(lone_stroke: f64) -> f64 {
    1.0 - (1.0 - OF_LONE_STROKE) * lone_stroke
}

/// Returns the factor of the confidence for the side of a print's pixels as a fraction of the stroke width. It is 1 if the
/// whole page agrees with the block, by the odds `prior`: then print and wood belong together.
pub(super) fn of_pixels(pixel_width: f64, prior: f64) -> f64 {
    if prior > 0.0 {
        return 1.0;
    }
    let [fine, coarse] = PIXEL_WIDTHS;
    let part = ((pixel_width - fine) / (coarse - fine)).clamp(0.0, 1.0);
    1.0 - (1.0 - COARSE) * part
}

/// Returns the probability, 0..=1, that the pair is not mirrored. `mirrored` is the score of the mirrored relief, as a
/// fraction of that of the relief. It is 1 if the whole page agrees with the block, by the odds `prior`: then the pair is
/// known not to be mirrored.
pub(super) fn of_upright(mirrored: f64, prior: f64) -> f64 {
    if prior > 0.0 {
        return 1.0;
    }
    1.0 / (1.0 + ((mirrored - MIRRORED) / MIRRORED_DEVIATION).exp())
}

#[cfg(test)]
mod tests {
    use super::{
        COARSE, Doubts, OF_BAD_PARTS, of_lone_stroke, of_parts, of_pixels, of_same_block,
        of_seen_ink, of_upright, unexplained_misfit,
    };

    #[test]
    fn little_ink_on_the_scan_lowers_the_confidence() {
        assert_eq!([0.3, 0.6, 0.9].map(of_seen_ink), [0.5, 1.0, 1.0]);
    }

    #[test]
    fn a_part_that_is_hardly_seen_is_sure_of_nothing() {
        let factor = |share, seen_ink| {
            let smooth_misfit = 0.03;
            Doubts {
                share,
                smooth_misfit,
                seen_ink,
                lone_stroke: 0.0,
                parts_overlap: 1.0,
            }
            .factor()
        };
        // Half of a print that lies on the scan is likely right. If much of it lies beside the scan, it is not.
        assert!(factor(0.55, 0.98) > 0.65);
        assert!(factor(0.53, 0.68) < 0.5);
        assert!(factor(1.0, 0.68) > 0.99);
    }

    #[test]
    fn a_lone_stroke_and_parts_that_agree_badly_are_sure_of_nothing() {
        assert_eq!(of_lone_stroke(0.0), 1.0);
        assert!(of_lone_stroke(1.0) < 0.5);
        assert_eq!([0.3, 0.6, 1.0].map(of_parts), [OF_BAD_PARTS, 1.0, 1.0]);
        const { assert!(OF_BAD_PARTS < 0.5) };
    }

    #[test]
    fn strokes_that_are_displaced_are_evidence_against_the_block() {
        assert!(of_same_block(0.05) > 0.99 && of_same_block(0.068) > 0.9);
        assert!(of_same_block(0.09) < 0.05);
    }

    #[test]
    fn rough_edges_explain_displaced_strokes_only_where_the_page_agrees_with_the_block() {
        let factor = |scatter, prior| of_same_block(unexplained_misfit(0.085, scatter, prior));
        assert!(factor(0.14, 4.5) > 0.95);
        assert!(factor(0.14, 0.0) < 0.1);
        // Strokes with sharp edges lie where they were carved.
        assert!(factor(0.04, 4.5) < 0.1);
    }

    #[test]
    fn a_mirrored_relief_that_matches_better_lowers_the_confidence_of_a_pair_alone() {
        assert!(of_upright(0.98, 0.0) > 0.99 && of_upright(1.0, 0.0) > 0.95);
        assert!(of_upright(1.045, 0.0) < 0.2);
        assert_eq!(of_upright(1.045, 3.0), 1.0);
    }

    #[test]
    fn pixels_as_wide_as_strokes_lower_the_confidence_of_a_pair_alone() {
        assert_eq!(of_pixels(0.0, 0.0), 1.0);
        assert_eq!(of_pixels(1.2, 0.0), COARSE);
        assert!(of_pixels(0.9, 0.0) > of_pixels(1.0, 0.0));
        assert_eq!(of_pixels(1.2, 3.0), 1.0);
    }
}
