//! Found boxes compared with true ones.

use super::{TrueBox, box_iou};

/// Counts of found and true boxes at one threshold of the intersection over union.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BoxMatches {
    /// Found boxes without the ones that match a character of which the page shows only a part.
    pub found: u64,
    /// True boxes of whole characters.
    pub whole: u64,
    /// Pairs of a found box and a whole character.
    pub matched: u64,
}

impl BoxMatches {
    /// Matches boxes one to one, those with the highest intersection over union first; `min_iou` is the least one.
    pub fn of(truth: &[TrueBox], found: &[[f64; 4]], min_iou: f64) -> Self {
        let mut candidates = Vec::new();
        for (f, found) in found.iter().enumerate() {
            let overlaps = truth.iter().map(|one| box_iou(one.bounds, *found));
            let near = overlaps.enumerate().filter(|(_, iou)| *iou >= min_iou);
            candidates.extend(near.map(|(t, iou)| (iou, f, t)));
        }
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut is_found_taken, mut is_true_taken) =
            (vec![false; found.len()], vec![false; truth.len()]);
        let (mut matched, mut partial) = (0, 0);
        for (_, f, t) in candidates {
            if is_found_taken[f] || is_true_taken[t] {
                continue;
            }
            (is_found_taken[f], is_true_taken[t]) = (true, true);
            if truth[t].is_partial {
                partial += 1;
            } else {
                matched += 1;
            }
        }
        Self {
            found: found.len() as u64 - partial,
            whole: truth.iter().filter(|one| !one.is_partial).count() as u64,
            matched,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::BoxMatches;
    use crate::domain::{TrueBox, box_iou};

    fn square(left: f64, is_partial: bool) -> TrueBox {
        TrueBox {
            bounds: [left, 0.0, left + 10.0, 10.0],
            is_partial,
        }
    }

    #[test]
    fn overlap_is_that_of_the_areas() {
        let a = [0.0, 0.0, 10.0, 10.0];
        assert_eq!(box_iou(a, a), 1.0);
        // 50 of 150.
        assert_eq!(box_iou(a, [5.0, 0.0, 15.0, 10.0]), 1.0 / 3.0);
        assert_eq!(box_iou(a, [10.0, 0.0, 20.0, 10.0]), 0.0);
        assert_eq!(box_iou([3.0; 4], [3.0; 4]), 0.0);
    }

    #[test]
    fn boxes_match_one_to_one_and_parts_of_characters_count_for_nothing() {
        let truth = [square(0.0, false), square(20.0, false), square(40.0, true)];
        let found = [
            // IoU 0.8 with the first, 0.6 with the first again, 1 with the part, and nothing.
            [0.0, 0.0, 10.0, 8.0],
            [0.0, 0.0, 10.0, 6.0],
            [40.0, 0.0, 50.0, 10.0],
            [80.0, 0.0, 90.0, 10.0],
        ];
        let expected = BoxMatches {
            found: 3,
            whole: 2,
            matched: 1,
        };
        assert_eq!(BoxMatches::of(&truth, &found, 0.5), expected);
        assert_eq!(BoxMatches::of(&truth, &found, 0.7), expected);
        let none = BoxMatches::of(&truth, &found, 0.85);
        assert_eq!((none.matched, none.found), (0, 3));
        assert_eq!(BoxMatches::of(&truth, &[], 0.5).matched, 0);
    }

    #[test]
    fn a_better_box_takes_the_character_whatever_the_order() {
        let truth = [square(0.0, false), square(6.0, false)];
        // The first box lies between the characters, nearer to the second one, which the second box covers.
        let found = [[4.0, 0.0, 14.0, 10.0], [6.0, 0.0, 16.0, 10.0]];
        assert_eq!(BoxMatches::of(&truth, &found, 0.25).matched, 2);
        // 6 of 14 with the first character: below 0.5.
        assert_eq!(BoxMatches::of(&truth, &found, 0.5).matched, 1);
    }
}
