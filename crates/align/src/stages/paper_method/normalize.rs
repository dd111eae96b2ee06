//! The paper's normalization (III-C): scales both images to one size by their bounding boxes, before the rotation is
//! known, and searches for a grey threshold on the scaled images.
//!
//! If the text leaves a choice open, the authors' program decides. Depths become greys, the nearest the darkest: 1 % of
//! the pixels get at most 49, and 95 % get at most 201. Each threshold is tried at four rotations by 90 degrees.

use crate::stages::binarize::{self, InkMask};
use crate::stages::normalize::{NormalizeError, NormalizeParams, Normalized, box_wrap};
use crate::stages::print::Print;
use crate::stages::score::SsimReference;
use mocban_core::domain::{Affine2, MaskScale, ThresholdChoice, ThresholdMetric};
use mocban_core::raster::components::remove_specks;
use mocban_core::raster::{DepthMap, Mask, warp_mask};

/// Percentiles and their greys.
const STRETCH: [(f64, f64); 2] = [(0.01, 49.0), (0.95, 201.0)];

/// Depth-map levels by grey of the stretched image; dark is near.
struct Greys {
    near: f64,
    per_level: f64,
}

impl Greys {
    fn of(depth: &DepthMap) -> Option<Self> {
        let mut levels = depth.valid_levels();
        if levels.is_empty() {
            return None;
        }
        // The highest level is the nearest and so the darkest.
        levels.sort_unstable_by(|a, b| b.cmp(a));
        let at = |share: f64| f64::from(levels[((levels.len() - 1) as f64 * share) as usize]);
        let [(low, dark), (high, light)] = STRETCH;
        let span = at(low) - at(high);
        (span > 0.0).then(|| {
            let per_level = (light - dark) / span;
            Self {
                near: at(low) + dark / per_level,
                per_level,
            }
        })
    }

    /// Returns the lowest level that is darker than a grey.
    fn level(&self, grey: u8) -> u16 {
        (self.near - f64::from(grey) / self.per_level)
            .ceil()
            .clamp(1.0, 65_535.0) as u16
    }
}

/// A candidate threshold with its scores.
#[derive(Debug, Clone, Copy)]
struct Tried {
    level: u16,
    grey: u8,
    structure: f64,
    density_gap: f64,
}

/// Binarizes the print at a fixed grey. Chooses the density threshold and the structure threshold on the wrapped
/// images, which are scaled and centred.
///
/// # Errors
/// Returns an error if the print shows no ink or no threshold leaves strokes.
pub(crate) fn normalize(
    depth: &DepthMap,
    print: &Print,
    params: &NormalizeParams,
) -> Result<Normalized, NormalizeError> {
    let ink = binarize::fixed(print.image(), params.print_grey)?;
    let mut normalized =
        Normalized::new(std::slice::from_ref(&ink), MaskScale::Same, None, params)?;
    let canvas_from_print = normalized.outcome.inks[0].canvas_from_print;
    normalized.outcome.thresholds = choose(depth, &ink, &canvas_from_print, params)?;
    Ok(normalized)
}

/// Chooses the density threshold and the structure threshold on the wrapped images. The ensemble has no threshold of
/// its own: registration chooses one of the two results.
fn choose(
    depth: &DepthMap,
    print: &InkMask,
    canvas_from_print: &Affine2,
    params: &NormalizeParams,
) -> Result<Vec<ThresholdChoice>, NormalizeError> {
    let greys = Greys::of(depth).ok_or(NormalizeError::NoStrokes)?;
    let side = params.canvas_px as usize;
    let canvas = SsimReference::new(
        &warp_mask(&print.mask, canvas_from_print, side, side),
        params.window,
    );
    let first = params.density_greys[0].min(params.structure_greys[0]);
    let last = params.density_greys[1].max(params.structure_greys[1]);
    let tried: Vec<Tried> = (first..=last)
        .filter_map(|grey| attempt(depth, &canvas, grey, greys.level(grey), params))
        .collect();
    let within = |[from, to]: [u8; 2]| tried.iter().filter(move |t| (from..=to).contains(&t.grey));
    let density = within(params.density_greys)
        .min_by(|a, b| a.density_gap.abs().total_cmp(&b.density_gap.abs()))
        .ok_or(NormalizeError::NoStrokes)?;
    let structure = within(params.structure_greys)
        .max_by(|a, b| a.structure.total_cmp(&b.structure))
        .ok_or(NormalizeError::NoStrokes)?;
    let choice = |metric, t: &Tried, score, greys: [u8; 2]| ThresholdChoice {
        metric,
        level: t.level,
        score,
        at_bound: greys.contains(&t.grey),
    };
    let structure_score = structure.structure;
    let density_score = -density.density_gap.abs();
    Ok(vec![
        choice(
            ThresholdMetric::NlSsim,
            structure,
            structure_score,
            params.structure_greys,
        ),
        choice(
            ThresholdMetric::Density,
            density,
            density_score,
            params.density_greys,
        ),
    ])
}

/// Scores one threshold at the best of four rotations by 90 degrees. Returns `None` if the threshold leaves no strokes.
fn attempt(
    depth: &DepthMap,
    canvas: &SsimReference,
    grey: u8,
    level: u16,
    params: &NormalizeParams,
) -> Option<Tried> {
    let side = params.canvas_px as usize;
    let mask = mask_above(depth, level);
    let wrap = box_wrap(&mask, params)?;
    let wrapped = warp_mask(&mask, &wrap, side, side);
    let mut turned = wrapped.clone();
    let mut best: Option<(f64, Mask)> = None;
    for _ in 0..4 {
        let iou = canvas.mask().overlap(&turned).iou;
        if best.as_ref().is_none_or(|(other, _)| iou > *other) {
            best = Some((iou, turned.clone()));
        }
        turned = quarter_turn(&turned);
    }
    let (_, turned) = best?;
    Some(Tried {
        level,
        grey,
        structure: canvas.compare(&turned).nl_ssim,
        density_gap: wrapped.density() - canvas.mask().density(),
    })
}

/// Returns the stroke mask of a level without specks.
fn mask_above(depth: &DepthMap, level: u16) -> Mask {
    let raw = depth.stroke_mask(level);
    remove_specks(&raw, raw.data().len())
}

fn quarter_turn(mask: &Mask) -> Mask {
    let last = mask.height() - 1;
    Mask::from_fn(mask.width(), mask.height(), |x, y| mask.at(y, last - x))
}
