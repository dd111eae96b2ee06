//! Decides whether a pair can be aligned: print and relief must both show the character. Only the tiers with a kind use
//! this.

use super::carved_block::CarvedBlock;
use super::rendered_print::{PrintFrame, RenderedPrint};
use super::scene::Scene;
use super::tear::SheetTear;
use super::truth_line::{IGNORED, STROKE_TOP};
use mocban_core::raster::Grid;

/// Smallest intersection over union of the strokes and the print under its best global threshold.
const MIN_PRINT_IOU: f64 = 0.6;
/// Smallest intersection over union of the true tops and the relief under its best global threshold. It is higher than
/// the 0.7 from which a mask counts as right.
const MIN_TOPS_IOU: f64 = 0.8;

/// Returns whether some threshold of the print's colours, in the direction from sheet to ink, reproduces the strokes.
/// Ignores pixels on or near neighbours and on the ground beside a torn sheet.
pub(super) fn is_legible(
    scene: &Scene,
    frame: &PrintFrame,
    tear: Option<&SheetTear>,
    picture: &RenderedPrint,
) -> bool {
    let mut samples = Vec::new();
    for (y, x) in pixels(frame) {
        let point = frame.uv(x, y);
        let Some(point) = tear.map_or(Some(point), |tear| tear.source(point)) else {
            continue;
        };
        let is_stroke = scene.artwork.strokes.value(point) > 0.0;
        if is_stroke || scene.print_neighbours.value(point) < -0.2 {
            let ([r, g, b], to_ink) = (picture.rgb.at(x, y), picture.to_ink);
            samples.push((r * to_ink[0] + g * to_ink[1] + b * to_ink[2], is_stroke));
        }
    }
    best_iou(samples) >= MIN_PRINT_IOU
}

/// Returns whether some threshold of the heights that the scanner sees reproduces the mask of the true tops. Ignores
/// the excluded pixels of the mask.
pub(super) fn is_solvable(block: &CarvedBlock, frame: &PrintFrame, tops: &Grid<u8>) -> bool {
    let labelled = pixels(frame).filter(|(y, x)| tops.at(*x, *y) != IGNORED);
    let samples = labelled.map(|(y, x)| {
        let height = block.scanned().value(frame.uv(x, y));
        (height, tops.at(x, y) == STROKE_TOP)
    });
    best_iou(samples.collect()) >= MIN_TOPS_IOU
}

fn pixels(frame: &PrintFrame) -> impl Iterator<Item = (usize, usize)> {
    let width = frame.width;
    (0..frame.height).flat_map(move |y| (0..width).map(move |x| (y, x)))
}

/// Returns the highest intersection over union, for any threshold, of the samples labelled `true` and the samples with
/// values above the threshold. Returns 0 if no label is `true`.
fn best_iou(mut samples: Vec<(f64, bool)>) -> f64 {
    samples.sort_by(|a, b| b.0.total_cmp(&a.0));
    let wanted = samples.iter().filter(|(_, is_wanted)| *is_wanted).count();
    let (mut hits, mut best) = (0, 0.0_f64);
    for (above, (_, is_wanted)) in samples.iter().enumerate() {
        hits += usize::from(*is_wanted);
        best = best.max(hits as f64 / (above + 1 + wanted - hits) as f64);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::best_iou;

    #[test]
    fn the_best_threshold_of_several_counts() {
        let samples = vec![
            (0.1, false),
            (0.9, true),
            (0.5, false),
            (0.7, true),
            (0.4, true),
        ];
        assert!((best_iou(samples) - 0.75).abs() < 1e-12);
        assert!((best_iou(vec![(1.0, false)])).abs() < 1e-12);
    }
}
