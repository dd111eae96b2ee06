//! Finds the larger part of a torn or folded print whose parts do not meet.
//!
//! Poses are refined on one side of each of several lines. If the other side fits a displaced pose, and both sides together
//! fit much better than the whole print fits any pose, the line is placed where both poses predict the ink best. The part
//! with more ink is the larger one.

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
/// Number of the best lines of each pose whose other side is compared with displaced poses.
const TRIED: usize = 6;
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
/// A score is lower if less than this fraction of the ink of the larger or of the smaller part lies where the depth map has
/// data: the rest may fit by chance.
const LEAST_SEEN: [f64; 2] = [0.85, 0.4];
/// The parts are used if they bring the score of the whole print closer to 1 by at least this fraction.
const LEAST_GAIN: f64 = 0.3;
/// The displaced pose brings the score of the smaller part closer to 1 by at least this fraction.
const LEAST_GAIN_OF_SMALLER: f64 = 0.25;
/// If the part with less ink has at least this fraction of the other's ink, either may be the larger one.
const BALANCED: f64 = 0.85;
/// Least fraction of the ink on a part without the strip beside the line.
const LEAST_SHARE: f64 = 0.45;
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
/// both parts if they have about the same ink, the one with more ink first. Returns none if one pose fits the whole print
/// about as well, or if the line cuts off no print or most of it.
pub(super) fn find(
    depths: &SoftMask,
    print: &PrintMasks,
    poses: &[PoseCandidate],
) -> Vec<LargerPart> {
    let levels = PartLevels::new(depths, print);
    let parts = levels.and_then(|levels| levels.parts(print, poses));
    parts.unwrap_or_default()
}

/// Print and relief at working size.
struct PartLevels {
    fixed: PyramidLevel,
    moving: PyramidLevel,
    /// Longest side of the print, pixels of the masks.
    longest: f64,
}

impl PartLevels {
    fn new(depths: &SoftMask, print: &PrintMasks) -> Option<Self> {
        let wood = ImagePyramid::new(depths, PX)?.map(|d| soft_stroke(d, CUT, SOFTNESS));
        Some(Self {
            fixed: ImagePyramid::new(&print.soft_ink(), PX)?.level(PX, SIGMA),
            moving: wood.level(PX, SIGMA),
            longest: print.known.bounding_box()?.longest_side() as f64,
        })
    }

    fn parts(&self, print: &PrintMasks, poses: &[PoseCandidate]) -> Option<Vec<LargerPart>> {
        let starts = &poses[..poses.len().min(STARTS)];
        let whole = Refiner::new(&self.fixed, &self.moving);
        let refined = starts
            .iter()
            .map(|start| whole.refine(start, STEPS, Loss::Huber));
        let of_whole = refined
            .map(|pose| seen_score(&whole, &pose, LEAST_SEEN[0]))
            .fold(0.0, f64::max);
        let sides = self.posed_sides(starts)?;
        let parts = sides.iter().filter_map(|larger| {
            let smaller = self.displaced(larger)?;
            let sum = larger.share * larger.score + (1.0 - larger.share) * smaller.score;
            Some((larger, smaller, sum))
        });
        let (larger, smaller, sum) = parts.max_by(|a, b| a.2.total_cmp(&b.2))?;
        if sum - of_whole < LEAST_GAIN * (1.0 - of_whole) {
            return None;
        }
        let line = Side::between(&whole, &self.fixed, &larger.pose, &smaller.pose)?;
        let mut sides = [(line, larger.pose), (line.opposite(), smaller.pose)];
        let mut ink = sides.map(|(side, _)| side.masks(print).ink.count() as f64);
        if ink[0] < ink[1] {
            sides.reverse();
            ink.reverse();
        }
        let [more, less] = sides;
        let mut parts = vec![self.part(print, more, less)];
        if ink[1] >= BALANCED * ink[0] {
            parts.push(self.part(print, less, more));
        }
        Some(parts.into_iter().flatten().collect())
    }

    /// Returns the first of two sides, each with its pose, as the larger part. Returns `None` if the line cuts off no print
    /// or most of it.
    fn part(
        &self,
        print: &PrintMasks,
        (line, pose): (Side, PoseCandidate),
        (beyond, of_other): (Side, PoseCandidate),
    ) -> Option<LargerPart> {
        let beyond = self.fixed.restricted(|point| beyond.contains(point))?;
        let other = OtherPart {
            larger: line,
            pose: of_other,
            middle: moving_middle(&of_other, &beyond)?,
        };
        let side = Side {
            offset: line.offset - STRIP * self.longest,
            ..line
        };
        let kept = self.fixed.restricted(|point| side.contains(point))?;
        let masks = side.masks(print);
        let share = masks.ink.count() as f64 / print.ink.count().max(1) as f64;
        let is_cut = masks.known.count() < print.known.count();
        (is_cut && share >= LEAST_SHARE).then(|| LargerPart {
            pose: Refiner::new(&kept, &self.moving).refine(&pose, STEPS, Loss::Tukey),
            masks,
            share,
            other,
        })
    }

    /// Refines each pose on the larger sides of several lines. Returns the best few sides of each pose.
    fn posed_sides(&self, starts: &[PoseCandidate]) -> Option<Vec<PosedSide>> {
        let mut of_starts = vec![Vec::new(); starts.len()];
        for (side, share) in self.sides()? {
            poll();
            let part = self.fixed.restricted(|point| side.contains(point))?;
            let refiner = Refiner::new(&part, &self.moving);
            for (start, sides) in starts.iter().zip(&mut of_starts) {
                let pose = refiner.refine(start, STEPS, Loss::Huber);
                sides.push(PosedSide {
                    side,
                    pose,
                    score: seen_score(&refiner, &pose, LEAST_SEEN[0]),
                    share,
                });
            }
        }
        for sides in &mut of_starts {
            sides.sort_by(|a, b| b.score.total_cmp(&a.score));
            sides.truncate(TRIED);
        }
        Some(of_starts.concat())
    }

    /// Returns the larger sides of lines in several directions, each with its share of the ink.
    fn sides(&self) -> Option<Vec<(Side, f64)>> {
        let mut ink = Vec::new();
        let each = |point, amount| ink.push((point, f64::from(amount)));
        self.fixed.each_amount(each)?;
        let all: f64 = ink.iter().map(|(_, amount)| amount).sum();
        let mut sides = Vec::new();
        for k in 0..DIRECTIONS {
            let (sin, cos) = (k as f64 * std::f64::consts::TAU / DIRECTIONS as f64).sin_cos();
            let along = |[x, y]: [f64; 2]| cos * x + sin * y;
            let mut sorted: Vec<(f64, f64)> =
                ink.iter().map(|(at, ink)| (along(*at), *ink)).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            for share in LARGER {
                let mut sum = 0.0;
                let (offset, _) = sorted.iter().find(|(_, ink)| {
                    sum += ink;
                    sum >= share * all
                })?;
                let side = Side {
                    normal: [cos, sin],
                    offset: *offset,
                };
                sides.push((side, share));
            }
        }
        Some(sides)
    }

    /// Finds the pose of the smaller part, displaced from that of the larger one. Returns `None` if it fits no better
    /// displaced.
    fn displaced(&self, larger: &PosedSide) -> Option<PosedSide> {
        if larger.score < LEAST_SCORES[0] {
            return None;
        }
        let longest = self.longest;
        let beyond = larger.side.opposite();
        let part = self.fixed.restricted(|point| beyond.contains(point))?;
        let refiner = Refiner::new(&part, &self.moving);
        let shifted = |[x, y]: [f64; 2]| PoseCandidate {
            fixed_from_moving: Affine2::scale_shift(1.0, [x, y])
                .after(&larger.pose.fixed_from_moving),
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
        let score_of = |pose: &PoseCandidate| seen_score(&refiner, pose, LEAST_SEEN[1]);
        let refined = tried.iter().take(STARTS).map(|(_, start)| {
            let pose = refiner.refine(start, STEPS, Loss::Huber);
            (score_of(&pose), pose)
        });
        let (score, pose) = refined.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let middle = moving_middle(&larger.pose, &part)?;
        let moved = |pose: &PoseCandidate| {
            let [a, b] = [pose, &larger.pose].map(|pose| pose.fixed_from_moving.apply(middle));
            (a[0] - b[0]).hypot(a[1] - b[1]) / longest
        };
        // A pose refined from that of the larger part may end at the displaced one.
        let in_place = refiner.refine(&larger.pose, STEPS, Loss::Huber);
        let stays = moved(&in_place) <= LEAST_DISPLACED;
        let in_place = score_of(if stays { &in_place } else { &larger.pose });
        let is_rigid = pose.rotation_to(&larger.pose) < LARGEST_TURN_DEG
            && (pose.fixed_from_moving.scale() / larger.pose.fixed_from_moving.scale())
                .ln()
                .abs()
                < LARGEST_RATIO;
        let is_better = score - in_place >= LEAST_GAIN_OF_SMALLER * (1.0 - in_place);
        let is_displaced =
            is_rigid && is_better && score >= LEAST_SCORES[1] && moved(&pose) > LEAST_DISPLACED;
        is_displaced.then_some(PosedSide {
            pose,
            score,
            ..*larger
        })
    }
}

/// Scores a pose on the pixels that are valid for it. The score is lower if less than the fraction `least_seen` of the ink
/// lies where the depth map has data.
fn seen_score(refiner: &Refiner, pose: &PoseCandidate, least_seen: f64) -> f64 {
    refiner.local_score(pose) * (refiner.seen_share(pose) / least_seen).min(1.0)
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

    /// Seeks the larger part of a print whose part right of a column is displaced.
    fn parts(column: i64, displaced: [i64; 2]) -> Vec<LargerPart> {
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
                if x < column {
                    is_stroke(x, y)
                } else {
                    source[0] >= column && is_stroke(source[0], source[1])
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
        let parts = parts(78, [3, 22]);
        assert_eq!(parts.len(), 1);
        let part = &parts[0];
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
    fn a_part_that_is_displaced_by_a_stroke_is_left_out() {
        let parts = parts(78, [2, 10]);
        let part = parts.first().expect("two parts");
        let moved = part.other.pose.fixed_from_moving.apply([90.0, 60.0]);
        assert!(
            (moved[0] - 92.0).hypot(moved[1] - 70.0) < 3.0,
            "{:?}",
            part.other
        );
    }

    #[test]
    fn either_of_two_parts_with_about_the_same_ink_may_be_the_larger_one() {
        let parts = parts(55, [3, -22]);
        let middles = parts
            .iter()
            .map(|part| part.pose.fixed_from_moving.apply([60.0, 60.0]));
        let middles: Vec<[f64; 2]> = middles.collect();
        assert_eq!(middles.len(), 2);
        let apart = [0, 1].map(|k| (middles[0][k] - middles[1][k]).abs());
        assert!((apart[0] - 3.0).hypot(apart[1] - 22.0) < 4.0, "{middles:?}");
        assert!(parts.iter().all(|part| part.share > 0.4));
    }

    #[test]
    fn a_whole_print_has_no_parts() {
        assert!(parts(78, [0, 0]).is_empty());
    }
}
