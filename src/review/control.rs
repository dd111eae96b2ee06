//! Planted faults and repeats: how well a reviewer sees can be told only from what is known beforehand.

use super::card::{Card, View};
use crate::domain::{AttentionCheck, SeededRandom};
use crate::raster::{DepthMap, Mask};

/// How often reviewers are tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Planted faults for each result, 0 to 1.
    pub controls: f64,
    /// Share of results that are shown a second time, 0 to 1.
    pub repeats: f64,
}

/// A turned relief is turned by so much, degrees: more than the rule allows, less than anybody would see at once.
const TURN_DEG: [f64; 2] = [7.0, 15.0];
/// A relief whose mirror image covers this much of it (`IoU`) reads nearly the same from behind: no fault to plant.
const TOO_SYMMETRIC: f64 = 0.6;
/// Share of the stroke that is left when strokes are made to go.
const LOST: f64 = 0.45;
/// Share of the stroke that there is when ground is let in.
const FLOODED: f64 = 1.9;
/// Cards between a result and its repeat, at least, and how many more at most.
const REPEAT_AFTER: f64 = 10.0;
const REPEAT_SPREAD: f64 = 30.0;

/// Cards that get a fault planted beside them.
pub(super) fn chosen<'a>(cards: &'a [Card], rates: &Rates, lots: &SeededRandom) -> Vec<&'a Card> {
    let rate = rates.controls;
    let good = cards.iter().filter(|card| card.is_good);
    good.filter(|card| lots.draw(&card.view.seen(), "control") < rate)
        .collect()
}

/// A fault made from a good result. What would be no fault, such as a symmetric relief in the mirror, is turned.
pub(super) fn plant(card: &Card, depth: &DepthMap, lots: &SeededRandom) -> Card {
    let draw = |purpose| lots.draw(&card.view.seen(), purpose);
    let strokes = depth.stroke_mask(card.view.level);
    let (control, view) = match draw("kind") {
        ..0.2 if !is_symmetric(&strokes) => (AttentionCheck::Mirrored, card.view.mirrored()),
        0.2..0.5 => match broken_level(depth, card.view.level, draw("cut") < 0.5) {
            Some(level) => (
                AttentionCheck::Threshold { level },
                View {
                    level,
                    ..card.view.clone()
                },
            ),
            None => turned(card, draw("turn")),
        },
        _ => turned(card, draw("turn")),
    };
    Card {
        control: Some(control),
        view,
        ..card.clone()
    }
}

fn turned(card: &Card, lot: f64) -> (AttentionCheck, View) {
    let [least, most] = TURN_DEG;
    let sign = if lot < 0.5 { -1.0 } else { 1.0 };
    let share = (2.0 * lot).fract();
    let angle_deg = sign * (least + share * (most - least));
    (
        AttentionCheck::Turned { angle_deg },
        card.view.turned(angle_deg),
    )
}

/// Whether the strokes cover about the same in the mirror, about the middle of their own box.
fn is_symmetric(strokes: &Mask) -> bool {
    let Some(found) = strokes.bounding_box() else {
        return true;
    };
    let flipped = Mask::from_fn(strokes.width(), strokes.height(), |x, y| {
        let across = (found.x0 + found.x1) as i64 - x as i64;
        strokes.get(across, y as i64).unwrap_or(false)
    });
    strokes.overlap(&flipped).iou > TOO_SYMMETRIC
}

/// A level at which much of the stroke goes, or much ground comes in; `None` where the relief has no such level.
fn broken_level(depth: &DepthMap, level: u16, loses: bool) -> Option<u16> {
    let mut above = depth.valid_levels();
    above.sort_unstable_by(|a, b| b.cmp(a));
    let area = above.partition_point(|found| *found >= level);
    let share = if loses { LOST } else { FLOODED };
    let wanted = (area as f64 * share) as usize;
    let broken = *above.get(wanted)?;
    let left = above.partition_point(|found| *found >= broken) as f64 / area.max(1) as f64;
    let is_broken = if loses {
        (0.1..0.7).contains(&left)
    } else {
        (1.5..3.0).contains(&left)
    };
    is_broken.then_some(broken)
}

/// Puts faults and repeats among results, so that nothing in the place of a card tells what it is.
pub(super) fn mixed(
    real: Vec<Card>,
    faults: Vec<Card>,
    rates: &Rates,
    lots: &SeededRandom,
) -> Vec<Card> {
    let count = real.len() as f64;
    let mut placed: Vec<(f64, Card)> = Vec::with_capacity(real.len() + faults.len());
    for (place, card) in real.into_iter().enumerate() {
        let seen = card.view.seen();
        if lots.draw(&seen, "repeat") < rates.repeats {
            let after = REPEAT_AFTER + REPEAT_SPREAD * lots.draw(&seen, "repeat after");
            // Near the end there is less room.
            let at = (place as f64 + after).min(count) + 0.25;
            if at - place as f64 > REPEAT_AFTER / 2.0 {
                let repeat = Card {
                    control: Some(AttentionCheck::Duplicate),
                    ..card.clone()
                };
                placed.push((at, repeat));
            }
        }
        placed.push((place as f64, card));
    }
    for fault in faults {
        let lot = lots.draw(&fault.view.seen(), "place");
        placed.push((lot * count + 0.5, fault));
    }
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    placed.into_iter().map(|(_, card)| card).collect()
}

#[cfg(test)]
mod tests {
    use super::{Rates, chosen, mixed, plant};
    use crate::domain::{AttentionCheck, SeededRandom};
    use crate::raster::{DepthMap, Grid};
    use crate::review::card::Card;
    use crate::review::card::test_fixtures::card;

    const RATES: Rates = Rates {
        controls: 0.1,
        repeats: 0.1,
    };

    fn depth(level: impl Fn(usize, usize) -> u16) -> DepthMap {
        DepthMap::of_levels(Grid::from_fn(101, 51, level))
    }

    /// A wedge that leans to one side, on a slope.
    fn wedge() -> DepthMap {
        depth(|x, y| (if x < 20 + y { 600 } else { 0 }) + (x * 4 + y) as u16 + 1)
    }

    fn planted(depth: &DepthMap) -> Vec<Card> {
        let lots = SeededRandom::new(3, "ana");
        (0..300).map(|n| plant(&card(n), depth, &lots)).collect()
    }

    #[test]
    fn every_kind_of_fault_is_planted_and_differs_from_the_result() {
        let faults = planted(&wedge());
        let good = card(0).view;
        let count = |name: &str| {
            let of_kind = faults.iter().filter(|card| {
                let control = card.control.expect("a control");
                assert!(control.is_fault());
                control.name() == name
            });
            of_kind.count()
        };
        for name in ["turned", "mirrored", "threshold"] {
            assert!(count(name) > 20, "{name}: {}", count(name));
        }
        for fault in &faults {
            match fault.control.expect("a control") {
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
                AttentionCheck::Duplicate => unreachable!("repeats are not planted here"),
            }
        }
    }

    #[test]
    fn a_symmetric_relief_is_never_mirrored() {
        let bar = depth(|x, _| if (40..61).contains(&x) { 900 } else { 100 });
        for fault in planted(&bar) {
            assert_ne!(fault.control, Some(AttentionCheck::Mirrored));
        }
    }

    #[test]
    fn repeats_come_well_after_their_results_and_faults_anywhere() {
        let lots = SeededRandom::new(5, "ana");
        let real: Vec<Card> = (0..400).map(card).collect();
        let faults: Vec<Card> = chosen(&real, &RATES, &lots)
            .into_iter()
            .map(|card| plant(card, &wedge(), &lots))
            .collect();
        let planted = faults.len();
        assert!((20..70).contains(&planted), "{planted}");
        let deck = mixed(real, faults, &RATES, &lots);
        let repeats: Vec<usize> = (0..deck.len())
            .filter(|i| deck[*i].control == Some(AttentionCheck::Duplicate))
            .collect();
        assert!((20..70).contains(&repeats.len()), "{}", repeats.len());
        assert_eq!(deck.len(), 400 + planted + repeats.len());
        for place in repeats {
            let first = deck
                .iter()
                .position(|card| card.control.is_none() && card.pair == deck[place].pair);
            let apart = place - first.expect("its result");
            assert!(apart > 5, "{apart}");
        }
        let halves = deck.split_at(deck.len() / 2);
        for half in [halves.0, halves.1] {
            let faults = half.iter().filter_map(|card| card.control);
            assert!(faults.filter(AttentionCheck::is_fault).count() > planted / 4);
        }
    }

    #[test]
    fn results_of_low_confidence_are_no_ground_for_faults() {
        let mut low_confidence: Vec<Card> = (0..400).map(card).collect();
        for card in &mut low_confidence {
            card.is_good = false;
        }
        assert!(chosen(&low_confidence, &RATES, &SeededRandom::new(5, "ana")).is_empty());
    }
}
