//! Attention checks: planted faults and duplicates, shown among the results to measure how reliable a reviewer is.

use std::collections::BTreeSet;

use super::item::{ItemView, ReviewItem};
use mocban_core::domain::{AttentionCheck, ContentHash, SeededRandom};
use mocban_core::raster::{DepthMap, Mask};

/// How many attention checks are added to a queue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckRates {
    /// Planted faults per result, 0 to 1.
    pub faults: f64,
    /// Fraction of the results that are shown a second time, 0 to 1.
    pub duplicates: f64,
}

/// The rates if none are given: four planted faults and five duplicates in a hundred results.
impl Default for CheckRates {
    fn default() -> Self {
        Self {
            faults: 0.04,
            duplicates: 0.05,
        }
    }
}

/// Minimum number of faults in a queue that has any. The catch rate of a small sample would otherwise say nothing.
const MIN_FAULTS: usize = 5;
/// Range of planted rotations in degrees: more than the 5 degrees allowed in a pass, but not obvious at first sight.
const ROTATION_DEG: [f64; 2] = [7.0, 15.0];
/// A relief is mirrored as a fault only if the `IoU` of its strokes with their mirror image is at most this value.
const MAX_SYMMETRY_IOU: f64 = 0.6;
/// Target stroke area of a fault that loses strokes, as a multiple of the result's stroke area.
const REDUCED_STROKES: f64 = 0.45;
/// Target stroke area of a fault that includes background, as a multiple of the result's stroke area.
const ENLARGED_STROKES: f64 = 1.9;
/// Minimum distance from a result to its duplicate, in results. Near the end of the queue, half of it is enough.
const DUPLICATE_GAP: f64 = 10.0;
/// Largest random distance that is added to `DUPLICATE_GAP`.
const DUPLICATE_SPREAD: f64 = 30.0;

/// Results in which faults may be planted, and how many faults are wanted.
#[derive(Debug, Default)]
pub(super) struct FaultCandidates<'a> {
    /// The candidates in the order in which they are taken.
    pub(super) items: Vec<&'a ReviewItem>,
    /// Number of faults to plant. There are at least as many candidates.
    pub(super) wanted: usize,
}

/// Returns the items from which a fault may be made. Wanted are `rates.faults` of the reviewed items, and at least
/// [`MIN_FAULTS`]. If there are too few reviewed items, `others` are used, which are not reviewed themselves. Items with
/// a result of `answered`, whose fault the reviewer has answered before, come first: the faults of a queue stay when others
/// judge the same results.
pub(super) fn fault_candidates<'a>(
    items: &'a [ReviewItem],
    others: &'a [ReviewItem],
    answered: &BTreeSet<ContentHash>,
    rates: &CheckRates,
    random: &SeededRandom,
) -> FaultCandidates<'a> {
    if rates.faults <= 0.0 {
        return FaultCandidates::default();
    }
    let draw = |item: &ReviewItem| random.draw(&item.view.hash(), "control");
    let is_answered = |item: &ReviewItem| {
        let mut results = item.results.iter();
        results.any(|(_, hash)| answered.contains(hash))
    };
    let by_draw = |items: &'a [ReviewItem]| {
        let reliable = items
            .iter()
            .filter(|item| item.is_reliable || is_answered(item));
        let mut drawn: Vec<(f64, &ReviewItem)> = reliable.map(|item| (draw(item), item)).collect();
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
        drawn
    };
    let mut drawn = by_draw(items);
    let count = drawn.partition_point(|(number, _)| *number < rates.faults);
    drawn.extend(by_draw(others));
    drawn.sort_by_key(|(_, item)| !is_answered(item));
    FaultCandidates {
        wanted: count.max(MIN_FAULTS).min(drawn.len()),
        items: drawn.into_iter().map(|(_, item)| item).collect(),
    }
}

/// Makes a fault from a good result: mirrors the relief, changes the threshold, or rotates the relief. If mirroring or
/// another threshold would not be a visible fault, rotates the relief instead. The fault depends only on the view.
pub(super) fn plant_fault(
    item: &ReviewItem,
    depth: &DepthMap,
    random: &SeededRandom,
) -> (AttentionCheck, ItemView) {
    let draw = |purpose| random.draw(&item.view.hash(), purpose);
    let strokes = depth.stroke_mask(item.view.level);
    let changed = match draw("kind") {
        ..0.2 if !is_symmetric(&strokes) => Some((AttentionCheck::Mirrored, item.view.mirrored())),
        0.2..0.5 => faulty_threshold(depth, item.view.level, draw("cut") < 0.5).map(|level| {
            let view = item.view.clone();
            (
                AttentionCheck::Threshold { level },
                ItemView { level, ..view },
            )
        }),
        _ => None,
    };
    changed.unwrap_or_else(|| rotated(item, draw("turn")))
}

/// Rotates the relief of an item. `number` in 0..1 selects the direction and the angle.
fn rotated(item: &ReviewItem, number: f64) -> (AttentionCheck, ItemView) {
    let [min, max] = ROTATION_DEG;
    let sign = if number < 0.5 { -1.0 } else { 1.0 };
    let share = (2.0 * number).fract();
    let angle_deg = sign * (min + share * (max - min));
    let view = item.view.rotated(angle_deg);
    (AttentionCheck::Turned { angle_deg }, view)
}

/// Returns whether the strokes largely coincide with their left-right mirror image in the same bounding box.
fn is_symmetric(strokes: &Mask) -> bool {
    let Some(found) = strokes.bounding_box() else {
        return true;
    };
    let flipped = Mask::from_fn(strokes.width(), strokes.height(), |x, y| {
        let across = (found.x0 + found.x1) as i64 - x as i64;
        strokes.get(across, y as i64).unwrap_or(false)
    });
    strokes.overlap(&flipped).iou > MAX_SYMMETRY_IOU
}

/// Returns a threshold that loses many strokes or includes much background. Returns `None` if the stroke area would
/// change too little or too much.
fn faulty_threshold(depth: &DepthMap, level: u16, loses_strokes: bool) -> Option<u16> {
    let mut levels = depth.valid_levels();
    levels.sort_unstable_by(|a, b| b.cmp(a));
    let area = levels.partition_point(|found| *found >= level);
    let (share, accepted) = if loses_strokes {
        (REDUCED_STROKES, 0.1..0.7)
    } else {
        (ENLARGED_STROKES, 1.5..3.0)
    };
    let wanted = (area as f64 * share) as usize;
    let faulty = *levels.get(wanted)?;
    let ratio = levels.partition_point(|found| *found >= faulty) as f64 / area.max(1) as f64;
    accepted.contains(&ratio).then_some(faulty)
}

/// Inserts faults and duplicates among the results, so that the position of an item does not reveal its kind.
pub(super) fn interleave(
    results: Vec<ReviewItem>,
    faults: Vec<ReviewItem>,
    rates: &CheckRates,
    random: &SeededRandom,
) -> Vec<ReviewItem> {
    let count = results.len() as f64;
    let mut placed: Vec<(f64, ReviewItem)> = Vec::with_capacity(results.len() + faults.len());
    for (index, item) in results.into_iter().enumerate() {
        let index = index as f64;
        let hash = item.view.hash();
        if random.draw(&hash, "repeat") < rates.duplicates {
            let distance = DUPLICATE_GAP + DUPLICATE_SPREAD * random.draw(&hash, "repeat after");
            // Near the end of the queue the distance is cut short.
            let position = (index + distance).min(count) + 0.25;
            if position - index > DUPLICATE_GAP / 2.0 {
                let duplicate = ReviewItem {
                    check: Some(AttentionCheck::Duplicate),
                    ..item.clone()
                };
                placed.push((position, duplicate));
            }
        }
        placed.push((index, item));
    }
    for fault in faults {
        let number = random.draw(&fault.view.hash(), "place");
        placed.push((number * count + 0.5, fault));
    }
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    placed.into_iter().map(|(_, item)| item).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{CheckRates, fault_candidates, interleave, plant_fault};
    use crate::review::item::ReviewItem;
    use crate::review::item::test_fixtures::item;
    use mocban_core::domain::{AttentionCheck, SeededRandom};
    use mocban_core::raster::{DepthMap, Grid};

    const RATES: CheckRates = CheckRates {
        faults: 0.1,
        duplicates: 0.1,
    };

    fn depth(level: impl Fn(usize, usize) -> u16) -> DepthMap {
        DepthMap::of_levels(Grid::from_fn(101, 51, level))
    }

    /// Returns an asymmetric wedge on a slope.
    fn wedge() -> DepthMap {
        depth(|x, y| (if x < 20 + y { 600 } else { 0 }) + (x * 4 + y) as u16 + 1)
    }

    fn planted(depth: &DepthMap) -> Vec<ReviewItem> {
        let random = SeededRandom::new(3, "ana");
        (0..300).map(|n| fault(&item(n), depth, &random)).collect()
    }

    fn fault(item: &ReviewItem, depth: &DepthMap, random: &SeededRandom) -> ReviewItem {
        let (check, view) = plant_fault(item, depth, random);
        ReviewItem {
            check: Some(check),
            view,
            ..item.clone()
        }
    }

    /// Returns the results in which faults are planted if all can be read.
    fn selected<'a>(
        items: &'a [ReviewItem],
        others: &'a [ReviewItem],
        rates: &CheckRates,
        random: &SeededRandom,
    ) -> Vec<&'a ReviewItem> {
        let mut found = fault_candidates(items, others, &BTreeSet::new(), rates, random);
        found.items.truncate(found.wanted);
        found.items
    }

    #[test]
    fn every_kind_of_fault_is_planted_and_differs_from_the_result() {
        let faults = planted(&wedge());
        let good = item(0).view;
        let count = |name: &str| {
            let of_kind = faults.iter().filter(|item| {
                let check = item.check.expect("an attention check");
                assert!(check.is_fault());
                check.name() == name
            });
            of_kind.count()
        };
        for name in ["turned", "mirrored", "threshold"] {
            assert!(count(name) > 20, "{name}: {}", count(name));
        }
        for fault in &faults {
            match fault.check.expect("an attention check") {
                AttentionCheck::Turned { angle_deg } => {
                    assert!((7.0..=15.0).contains(&angle_deg.abs()), "{angle_deg}");
                }
                AttentionCheck::Mirrored => {
                    assert!(fault.view.print_from_depth.determinant() < 0.0);
                }
                AttentionCheck::Threshold { level } => {
                    let area = |level| wedge().stroke_mask(level).count() as f64;
                    let share = area(level) / area(good.level);
                    assert!(!(0.7..=1.5).contains(&share), "{share}");
                }
                AttentionCheck::Duplicate => unreachable!("plant_fault makes no duplicates"),
            }
        }
    }

    #[test]
    fn a_symmetric_relief_is_never_mirrored() {
        let bar = depth(|x, _| if (40..61).contains(&x) { 900 } else { 100 });
        for fault in planted(&bar) {
            assert_ne!(fault.check, Some(AttentionCheck::Mirrored));
        }
    }

    #[test]
    fn duplicates_keep_a_distance_and_faults_are_spread_evenly() {
        let random = SeededRandom::new(5, "ana");
        let results: Vec<ReviewItem> = (0..400).map(item).collect();
        let faults: Vec<ReviewItem> = selected(&results, &[], &RATES, &random)
            .into_iter()
            .map(|item| fault(item, &wedge(), &random))
            .collect();
        let planted = faults.len();
        assert!((20..70).contains(&planted), "{planted}");
        let queue = interleave(results, faults, &RATES, &random);
        let duplicates: Vec<usize> = (0..queue.len())
            .filter(|i| queue[*i].check == Some(AttentionCheck::Duplicate))
            .collect();
        assert!((20..70).contains(&duplicates.len()), "{}", duplicates.len());
        assert_eq!(queue.len(), 400 + planted + duplicates.len());
        for place in duplicates {
            let first = queue
                .iter()
                .position(|item| item.check.is_none() && item.pair == queue[place].pair);
            let distance = place - first.expect("its result");
            assert!(distance > 5, "{distance}");
        }
        let halves = queue.split_at(queue.len() / 2);
        for half in [halves.0, halves.1] {
            let faults = half.iter().filter_map(|item| item.check);
            assert!(faults.filter(AttentionCheck::is_fault).count() > planted / 4);
        }
    }

    #[test]
    fn no_fault_is_planted_in_unreliable_results() {
        let mut unreliable: Vec<ReviewItem> = (0..400).map(item).collect();
        for item in &mut unreliable {
            item.is_reliable = false;
        }
        let random = SeededRandom::new(5, "ana");
        assert!(selected(&unreliable, &unreliable, &RATES, &random).is_empty());
    }

    #[test]
    fn answered_faults_stay_when_others_judge_the_results() {
        let random = SeededRandom::new(5, "ana");
        let mut all: Vec<ReviewItem> = (0..60).map(item).collect();
        for unjudged in all.iter_mut().step_by(2) {
            unjudged.is_reliable = false;
        }
        let names = |all: &[ReviewItem], answered: &BTreeSet<_>| -> BTreeSet<_> {
            let (items, others) = all.split_at(8);
            let found = fault_candidates(items, others, answered, &RATES, &random);
            let planted = found.items.iter().take(found.wanted);
            planted.map(|item| item.pair.clone()).collect()
        };
        let planted = names(&all, &BTreeSet::new());
        let of_planted = all.iter().filter(|item| planted.contains(&item.pair));
        let answered: BTreeSet<_> = of_planted.map(|item| item.results[0].1).collect();
        for judged in &mut all {
            judged.is_reliable = !judged.is_reliable;
        }
        assert_ne!(names(&all, &BTreeSet::new()), planted);
        assert_eq!(names(&all, &answered), planted);
    }

    #[test]
    fn a_small_sample_has_five_faults() {
        let random = SeededRandom::new(5, "ana");
        let all: Vec<ReviewItem> = (0..60).map(item).collect();
        for sampled in [1, 3, 5, 8, 20] {
            let (items, others) = all.split_at(sampled);
            let found = selected(items, others, &RATES, &random);
            assert!(found.len() >= 5, "{sampled}: {}", found.len());
            let of_sample = found.iter().filter(|item| items.contains(item)).count();
            assert!(of_sample >= sampled.min(5), "{sampled}: {of_sample}");
        }
        assert_eq!(selected(&all[..3], &[], &RATES, &random).len(), 3);
        let none = CheckRates {
            faults: 0.0,
            duplicates: 0.1,
        };
        assert!(selected(&all, &[], &none, &random).is_empty());
    }
}
