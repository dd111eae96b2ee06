//! Scores of two masks on one canvas: SSIM, its structure part, IoU, Dice and bounding-box IoU.

mod ssim;

pub use ssim::{SsimReference, SsimScores, SsimWindow};

use mocban_core::domain::Scores;
use mocban_core::raster::{Mask, PixelBox};

/// Computes all scores of a depth mask against a print mask of the same size. SSIM and its structure part are in
/// -1..=1, and the other scores are in 0..=1.
///
/// Masks are treated as images of zeros and ones. SSIM follows Wang et al. 2004, doi:10.1109/TIP.2003.819861.
///
/// ```
/// use mocban_core::raster::Mask;
/// use mocban_align::stages::score::{SsimReference, SsimWindow, score_masks};
///
/// // Two bars of 4 x 12 pixels, shifted by 2: 24 pixels in both, 72 in either.
/// let bar = |x0: usize| Mask::from_fn(12, 12, |x, _| (x0..x0 + 4).contains(&x));
/// let print = SsimReference::new(&bar(3), SsimWindow::Gaussian);
/// let scores = score_masks(&print, &bar(5));
/// assert_eq!(scores.iou, 24.0 / 72.0);
/// assert_eq!(scores.dice, 0.5);
/// assert_eq!(scores.iou_box, 24.0 / 72.0);
/// assert_eq!(score_masks(&print, &bar(3)).ssim, 1.0);
/// ```
pub fn score_masks(print: &SsimReference, depth: &Mask) -> Scores {
    let structure = print.compare(depth);
    let (print, print_bounds) = (print.mask(), print.bounds);
    let overlap = print.overlap(depth);
    Scores {
        ssim: structure.ssim,
        nl_ssim: structure.nl_ssim,
        iou: overlap.iou,
        iou_box: box_iou(print_bounds, depth.bounding_box()),
        dice: overlap.dice,
        density_print: print.density(),
        density_depth: depth.density(),
    }
}

/// Returns the intersection over union of two pixel boxes, or 0 if either is missing.
fn box_iou(a: Option<PixelBox>, b: Option<PixelBox>) -> f64 {
    let (Some(a), Some(b)) = (a, b) else {
        return 0.0;
    };
    let along =
        |a0: usize, a1: usize, b0: usize, b1: usize| (a1.min(b1) + 1).saturating_sub(a0.max(b0));
    let both = along(a.x0, a.x1, b.x0, b.x1) * along(a.y0, a.y1, b.y0, b.y1);
    let either = a.width() * a.height() + b.width() * b.height() - both;
    both as f64 / either as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{SsimReference, SsimWindow, box_iou, score_masks};
    use mocban_core::raster::Mask;

    fn masks() -> impl Strategy<Value = (Mask, Mask)> {
        let side = 24_usize;
        let bits = proptest::collection::vec(any::<bool>(), side * side);
        (bits.clone(), bits).prop_map(move |(a, b)| {
            let mask = |bits| Mask::from_vec(side, side, bits).expect("the size is right");
            (mask(a), mask(b))
        })
    }

    proptest! {
        #[test]
        fn scores_are_symmetric((a, b) in masks()) {
            let means = |mask| SsimReference::new(mask, SsimWindow::Gaussian);
            let (p, q) = (score_masks(&means(&a), &b), score_masks(&means(&b), &a));
            prop_assert!((p.ssim - q.ssim).abs() < 1e-12);
            prop_assert_eq!(p.iou_box, q.iou_box);
        }
    }

    #[test]
    fn a_mask_scores_one_against_itself() {
        let mask = Mask::from_fn(40, 40, |x, y| (10..30).contains(&x) && (5..20).contains(&y));
        let scores = score_masks(&SsimReference::new(&mask, SsimWindow::Gaussian), &mask);
        for one in [
            scores.ssim,
            scores.nl_ssim,
            scores.iou,
            scores.iou_box,
            scores.dice,
        ] {
            assert!((one - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn adjacent_boxes_do_not_overlap() {
        let left = Mask::from_fn(10, 4, |x, _| x < 5).bounding_box();
        let right = Mask::from_fn(10, 4, |x, _| x >= 5).bounding_box();
        let three = Mask::from_fn(10, 4, |x, _| (2..5).contains(&x)).bounding_box();
        assert_eq!(box_iou(left, right), 0.0);
        assert_eq!(box_iou(left, three), 0.6);
        assert_eq!(box_iou(left, None), 0.0);
    }
}
