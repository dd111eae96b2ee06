//! Finds the larger part of a torn or folded print whose parts do not meet.
//!
//! A pose is refined on one side of each of several lines. If the other side fits a displaced pose, and both sides together
//! fit much better than the whole print fits any pose, the line is placed where both poses predict the ink best.

use super::print_side::Side;
use crate::stages::normalize::{PrintMasks, soft_stroke};
use crate::stages::pose::{ImagePyramid, Loss, PoseCandidate, PyramidLevel, Refiner, SoftMask};
use mocban_core::domain::cancel::poll;
use mocban_core::domain::{Affine2, DisplacedPart};

/// Working size of print and relief, pixels, and the smoothing there.
const PX: usize = 60;
const SIGMA: f64 = 1.0;
/// Threshold of the soft strokes, and the range over which they fall from 1 to 0, as fractions of the relief's depth.
const CUT: f64 = 0.2;
const SOFTNESS: f64 = 0.3;
/// Number of directions of lines that are tried first.
const DIRECTIONS: usize = 12;
/// Fractions of the ink that are tried first for the larger part.
const LARGER: [f64; 3] = [0.52, 0.64, 0.76];
/// Number of poses that are refined on each side of each line.
const STARTS: usize = 3;
/// A pose is refined on a side only if it scores at least this fraction of the best one there.
const PROMISING: f64 = 0.6;
/// Number of the best lines whose other side is compared with displaced poses.
const TRIED: usize = 5;
/// Steps of a refinement.
const STEPS: usize = 8;
/// Largest displacement of the smaller part, and the step between tried ones, as fractions of the print's
/// longest side. The least displacement is larger than that of wavy sheets.
const FARTHEST: f64 = 0.36;
const STEP: f64 = 0.04;
const LEAST_DISPLACED: f64 = 0.06;
/// Largest rotation between the parts, degrees, and largest natural logarithm of the ratio of their scales.
const LARGEST_TURN_DEG: f64 = 6.0;
const LARGEST_RATIO: f64 = 0.08;
/// Least score of the larger and of the smaller part.
const LEAST_SCORES: [f64; 2] = [0.62, 0.5];
/// The parts are used if they bring the score of the whole print closer to 1 by at least this fraction.
const LEAST_GAIN: f64 = 0.3;
/// The displaced pose brings the score of the smaller part closer to 1 by at least this fraction.
const LEAST_GAIN_OF_SMALLER: f64 = 0.25;
/// Width of the strip beside the line that is left out, as a fraction of the print's longest side.
const STRIP: f64 = 0.012;

/// The larger part of a torn print.
pub(super) struct LargerPart {
    /// The masks, in which the other part is unknown.
    pub(super) masks: PrintMasks,
    /// The pose on this part.
    pub(super) pose: PoseCandidate,
    /// Fraction of the ink that lies on it.
    pub(super) share: f64,
    /// The other part.
    pub(super) other: OtherPart,
}

/// The part of a torn print that is left out.
#[derive(Debug, Clone, Copy)]
pub(super) struct OtherPart {
    /// The side of the line that it is not on.
    larger: Side,
    pose: PoseCandidate,
    /// Depth-map pixel that its pose maps to the middle of its ink.
    middle: [f64; 2],
}

impl OtherPart {
    /// Returns the masks of the part, and the map from depth-map pixels to print pixels on it.
    pub(super) fn masks(&self, print: &PrintMasks) -> (PrintMasks, Affine2) {
        let print_from_depth = print.print_from_masks().after(&self.pose.fixed_from_moving);
        (self.larger.opposite().masks(print), print_from_depth)
    }

    /// Returns the part in pixels of the print. `rest` maps depth-map pixels to print pixels on the larger part, which has
    /// the given share of the ink.
    pub(super) fn in_print(&self, print: &PrintMasks, rest: &Affine2, share: f64) -> DisplacedPart {
        let print_from_masks = print.print_from_masks();
        let print_from_depth = print_from_masks.after(&self.pose.fixed_from_moving);
        let [x, y] = print_from_depth.apply(self.middle);
        let [expected_x, expected_y] = rest.apply(self.middle);
        let Side { normal, offset } = self.larger;
        let on_line = print_from_masks.apply(normal.map(|cosine| cosine * offset));
        let turn = rest
            .inverse()
            .map(|inverse| print_from_depth.after(&inverse));
        DisplacedPart {
            normal,
            offset_px: normal[0] * on_line[0] + normal[1] * on_line[1],
            ink_share: 1.0 - share,
            shift_px: [x - expected_x, y - expected_y],
            angle_deg: turn.map_or(0.0, |turn| turn.angle_deg()),
            print_from_depth,
        }
    }
}

/// A side of a line with the pose that is refined on it, and its score there.
#[derive(Debug, Clone, Copy)]
struct PosedSide {
    side: Side,
    pose: PoseCandidate,
    score: f64,
    share: f64,
}

/// Finds the larger part of a print that shows a displaced part. `poses` are poses on the whole print, best first. Returns
/// `None` if one pose fits the whole print about as well, or if the line cuts off no print or most of it.
pub(super) fn find(
    depths: &SoftMask,
    print: &PrintMasks,
    poses: &[PoseCandidate],
) -> Option<LargerPart> {
    let wood = ImagePyramid::new(depths, PX)?.map(|d| soft_stroke(d, CUT, SOFTNESS));
    let (moving, fixed) = (
        wood.level(PX, SIGMA),
        ImagePyramid::new(&print.soft_ink(), PX)?.level(PX, SIGMA),
    );
    let longest = print.known.bounding_box()?.longest_side() as f64;
    let starts: Vec<PoseCandidate> = poses.iter().take(STARTS).copied().collect();
    let whole = Refiner::new(&fixed, &moving);
    let refined = starts
        .iter()
        .map(|start| whole.refine(start, STEPS, Loss::Huber));
    let of_whole = refined
        .map(|pose| whole.local_score(&pose))
        .fold(0.0, f64::max);
    let mut sides = posed_sides(&whole, &fixed, &starts)?;
    sides.sort_by(|a, b| b.score.total_cmp(&a.score));
    let parts = sides.iter().take(TRIED).filter_map(|larger| {
        let smaller = displaced(&whole, &fixed, larger, longest)?;
        let sum = larger.share * larger.score + (1.0 - larger.share) * smaller.score;
        Some((larger, smaller, sum))
    });
    let (larger, smaller, sum) = parts.max_by(|a, b| a.2.total_cmp(&b.2))?;
    if sum - of_whole < LEAST_GAIN * (1.0 - of_whole) {
        return None;
    }
    let line = Side::between(&whole, &fixed, &larger.pose, &smaller.pose)?;
    let beyond = fixed.restricted(|point| !line.contains(point))?;
    let other = OtherPart {
        larger: line,
        pose: smaller.pose,
        middle: moving_middle(&smaller.pose, &beyond)?,
    };
    let side = Side {
        offset: line.offset - STRIP * longest,
        ..line
    };
    let kept = fixed.restricted(|point| side.contains(point))?;
    let pose = whole.on(&kept).refine(&larger.pose, STEPS, Loss::Tukey);
    let masks = side.masks(print);
    let share = masks.ink.count() as f64 / print.ink.count().max(1) as f64;
    let is_cut = masks.known.count() < print.known.count();
    (is_cut && share >= LARGER[0]).then_some(LargerPart {
        masks,
        pose,
        share,
        other,
    })
}

/// Returns the larger sides of several lines, each with the best pose that is refined on it.
fn posed_sides(
    whole: &Refiner,
    fixed: &PyramidLevel,
    starts: &[PoseCandidate],
) -> Option<Vec<PosedSide>> {
    let mut ink = Vec::new();
    fixed.each_amount(|point, amount| ink.push((point, f64::from(amount))))?;
    let all: f64 = ink.iter().map(|(_, amount)| amount).sum();
    let mut sides = Vec::new();
    for k in 0..DIRECTIONS {
        poll();
        let (sin, cos) = (k as f64 * std::f64::consts::TAU / DIRECTIONS as f64).sin_cos();
        let along = |[x, y]: [f64; 2]| cos * x + sin * y;
        let mut sorted: Vec<(f64, f64)> = ink.iter().map(|(at, ink)| (along(*at), *ink)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        for share in LARGER {
            let mut sum = 0.0;
            let offset = sorted.iter().find(|(_, ink)| {
                sum += ink;
                sum >= share * all
            })?;
            let side = Side {
                normal: [cos, sin],
                offset: offset.0,
            };
            let part = fixed.restricted(|point| side.contains(point))?;
            let refiner = whole.on(&part);
            let scores = starts.iter().map(|start| refiner.evaluate(start).score);
            let scores: Vec<f64> = scores.collect();
            let least = PROMISING * scores.iter().copied().fold(0.0, f64::max);
            let promising = starts.iter().zip(&scores);
            let promising = promising.filter(|(_, score)| **score >= least);
            let posed = promising.map(|(start, _)| {
                let pose = refiner.refine(start, STEPS, Loss::Huber);
                let score = refiner.local_score(&pose);
                PosedSide {
                    side,
                    pose,
                    score,
                    share,
                }
            });
            sides.extend(posed.max_by(|a, b| a.score.total_cmp(&b.score)));
        }
    }
    Some(sides)
}

/// Finds the pose of the smaller part, displaced from that of the larger one. Returns `None` if it fits no better displaced.
fn displaced(
    whole: &Refiner,
    fixed: &PyramidLevel,
    larger: &PosedSide,
    longest: f64,
) -> Option<PosedSide> {
    if larger.score < LEAST_SCORES[0] {
        return None;
    }
    let part = fixed.restricted(|point| !larger.side.contains(point))?;
    let refiner = whole.on(&part);
    let shifted = |[x, y]: [f64; 2]| PoseCandidate {
        fixed_from_moving: Affine2::scale_shift(1.0, [x, y]).after(&larger.pose.fixed_from_moving),
        ..larger.pose
    };
    let reach = (FARTHEST / STEP).round() as i32;
    let steps = || (-reach..=reach).map(|step| f64::from(step) * STEP * longest);
    let shifts = steps().flat_map(|y| steps().map(move |x| [x, y]));
    let mut tried: Vec<(f64, PoseCandidate)> = shifts
        .filter(|[x, y]| x.hypot(*y) <= FARTHEST * longest)
        .map(|shift| {
            poll();
            let pose = shifted(shift);
            (refiner.evaluate(&pose).score, pose)
        })
        .collect();
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let refined = tried.iter().take(STARTS).map(|(_, start)| {
        let pose = refiner.refine(start, STEPS, Loss::Huber);
        (refiner.local_score(&pose), pose)
    });
    let (score, pose) = refined.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let in_place = refiner.refine(&larger.pose, STEPS, Loss::Huber);
    let in_place = refiner.local_score(&in_place);
    let is_rigid = pose.rotation_to(&larger.pose) < LARGEST_TURN_DEG
        && (pose.fixed_from_moving.scale() / larger.pose.fixed_from_moving.scale())
            .ln()
            .abs()
            < LARGEST_RATIO;
    let middle = moving_middle(&larger.pose, &part)?;
    let [a, b] = [&pose, &larger.pose].map(|pose| pose.fixed_from_moving.apply(middle));
    let moved = (a[0] - b[0]).hypot(a[1] - b[1]) / longest;
    let is_better = score - in_place >= LEAST_GAIN_OF_SMALLER * (1.0 - in_place);
    let is_displaced = is_rigid && is_better && score >= LEAST_SCORES[1] && moved > LEAST_DISPLACED;
    is_displaced.then_some(PosedSide {
        pose,
        score,
        ..*larger
    })
}

/// Returns the point of the depth map that lies at the middle of the ink of a part of the print.
fn moving_middle(pose: &PoseCandidate, part: &PyramidLevel) -> Option<[f64; 2]> {
    let (mut sum, mut all) = ([0.0; 2], 0.0);
    part.each_amount(|point, amount| {
        let amount = f64::from(amount);
        sum = [0, 1].map(|k| sum[k] + amount * point[k]);
        all += amount;
    })?;
    let middle = sum.map(|sum| sum / f64::max(all, 1e-9));
    Some(pose.fixed_from_moving.inverse()?.apply(middle))
}

#[cfg(test)]
mod tests {
    use super::{LargerPart, find};
    use crate::stages::normalize::PrintMasks;
    use crate::stages::pose::{PoseCandidate, SoftMask};
    use mocban_core::domain::{Affine2, MaskScale};
    use mocban_core::raster::{Grid, Mask};

    const SIDE: usize = 120;

    /// Strokes of different lengths in two directions.
    fn is_stroke(x: i64, y: i64) -> bool {
        let down = [(20, 12, 100), (52, 20, 74), (80, 40, 108), (100, 14, 60)];
        let across = [(18, 14, 66), (44, 30, 108), (70, 14, 90), (98, 36, 112)];
        let on = |at: i64, along: i64, bars: [(i64, i64, i64); 4]| {
            let mut bars = bars.into_iter();
            bars.any(|(middle, from, to)| (at - middle).abs() < 5 && (from..to).contains(&along))
        };
        on(x, y, down) || on(y, x, across)
    }

    /// Seeks the larger part of a print whose part right of column 78 is displaced.
    fn part(displaced: [i64; 2]) -> Option<LargerPart> {
        let relief = SoftMask {
            amount: Grid::from_fn(SIDE, SIDE, |x, y| {
                f32::from(u8::from(!is_stroke(x as i64, y as i64)))
            }),
            known: Mask::new(SIDE, SIDE, true),
        };
        let print = PrintMasks {
            ink: Mask::from_fn(SIDE, SIDE, |x, y| {
                let (x, y) = (x as i64, y as i64);
                let source = [x - displaced[0], y - displaced[1]];
                if x < 78 {
                    is_stroke(x, y)
                } else {
                    source[0] >= 78 && is_stroke(source[0], source[1])
                }
            }),
            specks: Mask::new(SIDE, SIDE, false),
            known: Mask::new(SIDE, SIDE, true),
            scale: MaskScale::Same,
        };
        let pose = PoseCandidate {
            fixed_from_moving: Affine2::IDENTITY,
            score: 0.6,
            mirrored: false,
        };
        find(&relief, &print, &[pose])
    }

    #[test]
    fn a_displaced_part_is_left_out() {
        let part = part([3, 22]).expect("two parts");
        assert!((0.5..0.8).contains(&part.share), "{}", part.share);
        let known = &part.masks.known;
        assert!(known.at(40, 60) && !known.at(95, 60) && !part.masks.ink.at(100, 60));
        let moved = part.pose.fixed_from_moving.apply([60.0, 60.0]);
        assert!((moved[0] - 60.0).hypot(moved[1] - 60.0) < 1.5, "{moved:?}");
        let other = &part.other;
        assert!((other.larger.offset - 78.0).abs() < 5.0, "{other:?}");
        let moved = other.pose.fixed_from_moving.apply([90.0, 60.0]);
        assert!((moved[0] - 93.0).hypot(moved[1] - 82.0) < 3.0, "{moved:?}");
    }

    #[test]
    fn a_whole_print_has_no_parts() {
        assert!(part([0, 0]).is_none());
    }
}
