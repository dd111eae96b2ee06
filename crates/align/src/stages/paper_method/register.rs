//! The paper's registration (III-D) as its authors' program does it.
//!
//! The depth mask is rotated through a full circle, then in finer steps about the best angle. At each angle the mask is
//! scaled and centred on the canvas, then shifted pixel by pixel as long as its IoU with the print rises. The program
//! tries 60 angles, and 60 more about the best. The text of the paper has only one angle in each of six sectors, so the
//! angle could be off by half a sector.

use crate::stages::normalize::Normalized;
use crate::stages::register::{
    Alignment, RegisterError, RegisterParams, Registered, StrokeMap, canvas_print, score_alignments,
};
use mocban_core::domain::{Affine2, ThresholdMetric};
use mocban_core::raster::components::remove_specks;
use mocban_core::raster::{DepthMap, Mask, warp_mask};

/// The paper's method has one interpretation of the print.
const INK: usize = 0;
/// Span of the fine pass to each side, in coarse steps.
const FINE_REACH: f64 = 3.0;
/// Maximum number of one-pixel steps of a climb.
const MOST_STEPS: usize = 64;

/// A rotation of the wrapped mask with its climbed shift.
#[derive(Debug, Clone, Copy)]
struct Turn {
    angle_deg: f64,
    shift: [i64; 2],
    iou: f64,
}

/// Registers the masks of the structure and the density threshold. Uses the alignment with the higher IoU for the
/// ensemble. Scores all three alignments.
///
/// # Errors
/// Returns an error if normalization chose no threshold or a mask is empty.
pub(crate) fn register(
    depth: &DepthMap,
    normalized: &Normalized,
    params: &RegisterParams,
) -> Result<Registered, RegisterError> {
    let target = canvas_print(normalized, INK);
    let one = |metric| align(depth, &target, normalized, metric, params);
    let (structure, structure_iou) = one(ThresholdMetric::NlSsim)?;
    let (density, density_iou) = one(ThresholdMetric::Density)?;
    let better = if structure_iou >= density_iou {
        structure
    } else {
        density
    };
    let ensemble = Alignment {
        metric: ThresholdMetric::Ensemble,
        ..better
    };
    let alignments = [structure, density, ensemble];
    let stroke_map = |alignment: &Alignment| {
        StrokeMap::of_alignment(
            depth,
            &normalized.prints[INK],
            &normalized.outcome.inks[INK].canvas_from_print,
            &alignment.print_from_depth,
            normalized.outcome.canvas_px,
            alignment.level,
        )
    };
    score_alignments(
        depth,
        normalized,
        INK,
        target,
        &alignments,
        stroke_map,
        params.window,
    )
}

/// Registers the mask of one metric's threshold and returns the alignment with its IoU.
fn align(
    depth: &DepthMap,
    canvas_print: &Mask,
    normalized: &Normalized,
    metric: ThresholdMetric,
    params: &RegisterParams,
) -> Result<(Alignment, f64), RegisterError> {
    let mut thresholds = normalized.outcome.thresholds.iter();
    let threshold = thresholds
        .find(|choice| choice.metric == metric)
        .ok_or(RegisterError::NoThreshold(metric))?;
    let raw = depth.stroke_mask(threshold.level);
    let mask = remove_specks(&raw, raw.data().len());
    let character_px = longest_side(canvas_print).ok_or(RegisterError::EmptyMask(metric))?;
    let side = canvas_print.width();
    let turner = Turner::new(&mask, side, character_px).ok_or(RegisterError::EmptyMask(metric))?;
    let target = Packed::of(canvas_print);
    let attempt =
        |angle_deg: f64| climb(&target, &Packed::of(&turner.turned(angle_deg)), angle_deg);
    let coarse = 360.0 / f64::from(params.coarse_angles);
    let first: Vec<Turn> = (0..params.coarse_angles)
        .map(|k| attempt(f64::from(k) * coarse))
        .collect();
    let best = best_of(&first).ok_or(RegisterError::NoPose)?;
    let fine = 2.0 * FINE_REACH * coarse / f64::from(params.fine_angles);
    let from = best.angle_deg - FINE_REACH * coarse;
    let second: Vec<Turn> = (0..=params.fine_angles)
        .map(|k| attempt(from + f64::from(k) * fine))
        .collect();
    let best = best_of(&second)
        .filter(|turn| turn.iou >= best.iou)
        .unwrap_or(best);
    let rival = best_of_others(&first, best.angle_deg, FINE_REACH * coarse);
    let shift = Affine2::scale_shift(1.0, [best.shift[0] as f64, best.shift[1] as f64]);
    let canvas_from_depth = shift.after(&turner.canvas_from_depth(best.angle_deg));
    let print_from_canvas = normalized.outcome.inks[INK]
        .canvas_from_print
        .inverse()
        .ok_or(RegisterError::NoPose)?;
    let alignment = Alignment {
        metric,
        level: threshold.level,
        print_from_depth: print_from_canvas.after(&canvas_from_depth),
        margin: best.iou - rival,
        at_bound: threshold.at_bound,
    };
    Ok((alignment, best.iou))
}

fn longest_side(mask: &Mask) -> Option<f64> {
    Some(mask.bounding_box()?.longest_side() as f64)
}

/// A depth mask that is scaled and centred again after each rotation, because a rotation changes the bounding box.
struct Turner {
    /// Set pixels of the depth mask.
    points: Vec<[f64; 2]>,
    /// The mask scaled to about the size of the canvas, so that rotating it needs no averaging of pixels.
    small: Mask,
    small_from_depth: Affine2,
    side: usize,
    character_px: f64,
}

impl Turner {
    fn new(mask: &Mask, side: usize, character_px: f64) -> Option<Self> {
        let scale = character_px / longest_side(mask)?;
        let small_from_depth = Affine2::scale_shift(scale, [0.0, 0.0]);
        let [width, height] =
            [mask.width(), mask.height()].map(|length| (length as f64 * scale).ceil() as usize + 1);
        let set = |i: usize| [(i % mask.width()) as f64, (i / mask.width()) as f64];
        Some(Self {
            points: (0..mask.data().len())
                .filter(|i| mask.data()[*i])
                .map(set)
                .collect(),
            small: warp_mask(mask, &small_from_depth, width, height),
            small_from_depth,
            side,
            character_px,
        })
    }

    /// Returns the rotation followed by the paper's wrap W. The wrap scales the longest side of the rotated mask to
    /// `character_px`, and moves the centroid to the middle of the canvas.
    fn canvas_from_depth(&self, angle_deg: f64) -> Affine2 {
        let turn = Affine2::similarity(1.0, angle_deg.to_radians(), [0.0, 0.0]);
        let (mut low, mut high, mut sum) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], [0.0; 2]);
        for p in &self.points {
            let turned = turn.apply(*p);
            for k in 0..2 {
                low[k] = low[k].min(turned[k]);
                high[k] = high[k].max(turned[k]);
                sum[k] += turned[k];
            }
        }
        let n = self.points.len() as f64;
        let scale = self.character_px / ((high[0] - low[0]).max(high[1] - low[1]) + 1.0);
        let middle = (self.side - 1) as f64 / 2.0;
        let shift = [middle - scale * sum[0] / n, middle - scale * sum[1] / n];
        Affine2::scale_shift(scale, shift).after(&turn)
    }

    /// Returns the rotated and wrapped mask.
    fn turned(&self, angle_deg: f64) -> Mask {
        let from_depth = self.canvas_from_depth(angle_deg);
        match self.small_from_depth.inverse() {
            Some(depth) => warp_mask(&self.small, &from_depth.after(&depth), self.side, self.side),
            None => Mask::new(self.side, self.side, false),
        }
    }
}

fn best_of(turns: &[Turn]) -> Option<Turn> {
    turns
        .iter()
        .copied()
        .reduce(|a, b| if b.iou > a.iou { b } else { a })
}

/// Returns the best IoU among the rotations more than `apart_deg` away from `angle_deg`, or 0 if there are none.
fn best_of_others(turns: &[Turn], angle_deg: f64, apart_deg: f64) -> f64 {
    let apart = |turn: &&Turn| {
        let d = (turn.angle_deg - angle_deg).rem_euclid(360.0);
        d.min(360.0 - d) > apart_deg
    };
    turns
        .iter()
        .filter(apart)
        .map(|turn| turn.iou)
        .fold(0.0, f64::max)
}

/// Finds a shift by hill climbing: moves one pixel in the best of four directions as long as the IoU rises.
fn climb(target: &Packed, moving: &Packed, angle_deg: f64) -> Turn {
    let mut best = Turn {
        angle_deg,
        shift: [0, 0],
        iou: target.iou(moving, [0, 0]),
    };
    for _ in 0..MOST_STEPS {
        let [x, y] = best.shift;
        let next = [[x + 1, y], [x - 1, y], [x, y + 1], [x, y - 1]].map(|shift| Turn {
            angle_deg,
            shift,
            iou: target.iou(moving, shift),
        });
        match best_of(&next) {
            Some(step) if step.iou > best.iou => best = step,
            _ => break,
        }
    }
    best
}

/// A mask as bits, each row padded to whole words, for counting overlaps.
struct Packed {
    words: Vec<u64>,
    per_row: usize,
    rows: usize,
    count: u32,
}

impl Packed {
    fn of(mask: &Mask) -> Self {
        let per_row = mask.width().div_ceil(64);
        let mut words = vec![0_u64; per_row * mask.height()];
        for y in 0..mask.height() {
            for (x, set) in mask.row(y).iter().enumerate() {
                if *set {
                    words[y * per_row + x / 64] |= 1 << (x % 64);
                }
            }
        }
        let count = words.iter().map(|w| w.count_ones()).sum();
        Self {
            words,
            per_row,
            rows: mask.height(),
            count,
        }
    }

    /// Returns the IoU with `moving` shifted by whole pixels. Pixels that leave the canvas count in the union only.
    fn iou(&self, moving: &Self, [dx, dy]: [i64; 2]) -> f64 {
        let mut both = 0;
        for y in 0..self.rows as i64 {
            let from = y - dy;
            if from < 0 || from >= self.rows as i64 {
                continue;
            }
            let row = &self.words[y as usize * self.per_row..][..self.per_row];
            let other = &moving.words[from as usize * self.per_row..][..self.per_row];
            for (k, word) in row.iter().enumerate() {
                both += (word & shifted(other, k, dx)).count_ones();
            }
        }
        let union = self.count + moving.count - both;
        if union == 0 {
            0.0
        } else {
            f64::from(both) / f64::from(union)
        }
    }
}

/// Returns word `k` of a row shifted right by `dx` pixels.
fn shifted(row: &[u64], k: usize, dx: i64) -> u64 {
    let first = k as i64 * 64 - dx;
    let (word, bit) = (first.div_euclid(64), first.rem_euclid(64));
    let at = |i: i64| {
        let word = usize::try_from(i).ok().and_then(|i| row.get(i));
        word.copied().unwrap_or(0)
    };
    if bit == 0 {
        at(word)
    } else {
        (at(word) >> bit) | (at(word + 1) << (64 - bit))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::Packed;
    use mocban_core::raster::Mask;

    proptest! {
        #[test]
        fn packed_overlap_equals_the_plain_count(
            bits in proptest::collection::vec(any::<bool>(), 2 * 80 * 30),
            dx in -90_i64..90,
            dy in -31_i64..31,
        ) {
            let a = Mask::from_vec(80, 30, bits[..2400].to_vec()).expect("the size is right");
            let b = Mask::from_vec(80, 30, bits[2400..].to_vec()).expect("the size is right");
            let moved = Mask::from_fn(80, 30, |x, y| {
                b.get(x as i64 - dx, y as i64 - dy).unwrap_or(false)
            });
            let both = Mask::from_fn(80, 30, |x, y| a.at(x, y) && moved.at(x, y)).count();
            let plain = both as f64 / (a.count() + b.count() - both).max(1) as f64;
            let packed = Packed::of(&a).iou(&Packed::of(&b), [dx, dy]);
            prop_assert!((packed - plain).abs() < 1e-12);
        }
    }
}
