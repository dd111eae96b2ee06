//! The paper's normalisation (III-C): both pictures cropped to their box and brought to one size before anything is
//! turned, then a grey threshold searched over the wrapped pictures.
//!
//! Where the text is silent the authors' own program decides: greys stretched so that the 1st percentile of
//! nearness is 49 and the 95th 201, dark is near, each threshold tried at four quarter turns.

use crate::domain::{Affine2, ThresholdChoice, ThresholdMetric};
use crate::raster::{DepthMap, Mask, warp_mask};
use crate::stages::binarize::InkMask;
use crate::stages::components::remove_specks;
use crate::stages::normalize::{NormalizeError, NormalizeParams};
use crate::stages::score::SsimReference;

/// Greys of the two percentiles, and the percentiles.
const STRETCH: [(f64, f64); 2] = [(0.01, 49.0), (0.95, 201.0)];

/// Depth-map levels by grey: the stretched picture of the authors' figure, dark is near.
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
        // Nearness runs down the levels: the highest is the darkest.
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

    /// The lowest level that is darker than a grey.
    fn level(&self, grey: u8) -> u16 {
        (self.near - f64::from(grey) / self.per_level)
            .ceil()
            .clamp(1.0, 65_535.0) as u16
    }
}

/// One threshold tried.
#[derive(Debug, Clone, Copy)]
struct Tried {
    level: u16,
    grey: u8,
    structure: f64,
    density_gap: f64,
}

/// Chooses the density and the structure threshold on the wrapped pictures. The ensemble keeps the better of the
/// two once they are registered.
pub(in crate::stages) fn choose(
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
    let choice = |metric, t: &Tried, score, [from, to]: [u8; 2]| ThresholdChoice {
        metric,
        level: t.level,
        score,
        at_bound: t.grey == from || t.grey == to,
    };
    Ok(vec![
        choice(
            ThresholdMetric::NlSsim,
            structure,
            structure.structure,
            params.structure_greys,
        ),
        choice(
            ThresholdMetric::Density,
            density,
            -density.density_gap.abs(),
            params.density_greys,
        ),
    ])
}

/// Scores one threshold at four quarter turns; `None` when it leaves no strokes.
fn attempt(
    depth: &DepthMap,
    canvas: &SsimReference,
    grey: u8,
    level: u16,
    params: &NormalizeParams,
) -> Option<Tried> {
    let side = params.canvas_px as usize;
    let mask = mask_above(depth, level);
    let wrap = box_wrap(&mask, side, f64::from(params.character_px))?;
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

/// Strokes of the depth map at a level, specks removed.
fn mask_above(depth: &DepthMap, level: u16) -> Mask {
    let raw = depth.levels.map(|l| *l >= level && *l > 0);
    remove_specks(&raw, raw.data().len())
}

/// W(I): the box's longest side to `character_px`, the centroid to the middle of a square canvas.
pub(in crate::stages) fn box_wrap(
    mask: &Mask,
    canvas_px: usize,
    character_px: f64,
) -> Option<Affine2> {
    let bounds = mask.bounding_box()?;
    let [x, y] = mask.centroid()?;
    let scale = character_px / bounds.width().max(bounds.height()) as f64;
    let middle = (canvas_px - 1) as f64 / 2.0;
    Some(Affine2::scale_shift(
        scale,
        [middle - scale * x, middle - scale * y],
    ))
}

fn quarter_turn(mask: &Mask) -> Mask {
    let last = mask.height() - 1;
    Mask::from_fn(mask.width(), mask.height(), |x, y| mask.at(y, last - x))
}
