//! Whether a page belongs to a block: the agreement of many places.
//!
//! Measures of the whole page mislead: the frame and the rules of another page, or of the right page turned by 180
//! degrees, correlate well. But the places of a wrong page lie in no smooth field.

use serde::{Deserialize, Serialize};

use super::bounds::bounds;
use super::field::ShiftField;
use super::windows::WindowMatch;

/// Windows within this distance of the field agree, mm.
const AGREEMENT_MM: f64 = 0.5;
/// Windows with at least this correlation agree. Wrong ones reach 0.5 here and there.
const AGREEMENT_NCC: f64 = 0.5;
/// Least fraction of agreeing windows, and least median of the correlations. Of 30 generated blocks with the page of
/// another one, the highest values were 0.44 and 0.53, where both pages have the same columns.
const MIN_AGREEMENT: f64 = 0.68;
const MIN_MEDIAN_NCC: f64 = 0.6;
/// Fewer windows prove nothing: about 22 cm2 of text.
const MIN_WINDOWS: usize = 60;
/// A part of the face is accepted alone if it has at least this fraction of the windows. In the same 30 blocks, the
/// highest value was 0.25.
const MIN_PART: f64 = 0.4;
/// The same where a person gave the position. Of 96 positions on four generated blocks that were wrong by 18 to 30 mm,
/// the highest fraction was 0.24, and none reached the least part; of 64 right ones, the lowest fraction was 0.96.
const MIN_AGREEMENT_GIVEN: f64 = 0.5;
const MIN_PART_GIVEN: f64 = 0.2;
/// Spacing of [`Support`], and the distance over which windows are counted, mm.
const SUPPORT_STEP_MM: f64 = 10.0;
const SUPPORT_REACH_MM: f64 = 30.0;
/// Places with at least this support belong to the part of the face that agrees.
const MIN_SUPPORT: f64 = 0.6;

/// How well the places of a face agree with a page.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Number of windows with relief on the face and on the page.
    pub windows: usize,
    /// Fraction of the windows that lie within 0.5 mm of the field.
    pub share: f64,
    /// Median of the windows' correlations.
    pub median_ncc: f64,
    /// Fraction of the windows that lie within 0.5 mm of the field and have a correlation of at least 0.5.
    pub agreeing: f64,
    /// Fraction of the windows in the part of the face that agrees.
    pub part: f64,
    /// Fraction of that part's windows that lie within 0.5 mm of the field.
    pub part_share: f64,
    /// Median of the correlations in that part.
    pub part_ncc: f64,
}

/// The fraction of agreeing windows around the places of a face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Support {
    /// Position of the first value, mm.
    pub origin_mm: [f64; 2],
    /// Number of columns, 10 mm apart.
    pub columns: usize,
    /// Fractions in percent, row by row.
    pub percent: Vec<u8>,
}

impl Agreement {
    /// Compares windows with the field that was fitted to them.
    pub(super) fn of(windows: &[WindowMatch], field: &ShiftField) -> (Self, Support) {
        let positions: Vec<[f64; 2]> = windows.iter().map(|w| w.at).collect();
        let fitted = field.at_all(&positions);
        let is_near: Vec<bool> = windows
            .iter()
            .zip(&fitted)
            .map(|(window, fitted)| distance(window, *fitted) <= AGREEMENT_MM)
            .collect();
        let agrees: Vec<bool> = (windows.iter().zip(&is_near))
            .map(|(window, near)| *near && window.ncc >= AGREEMENT_NCC)
            .collect();
        let support = Support::of(&positions, &agrees);
        let whole: Vec<usize> = (0..windows.len()).collect();
        let part: Vec<usize> = (whole.iter().copied())
            .filter(|k| support.at(positions[*k]) >= MIN_SUPPORT)
            .collect();
        let share = |places: &[usize]| {
            let near = places.iter().filter(|k| is_near[**k]).count();
            near as f64 / places.len().max(1) as f64
        };
        let median = |places: &[usize]| {
            let mut values: Vec<f64> = places.iter().map(|k| windows[*k].ncc).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        };
        let agreement = Self {
            windows: windows.len(),
            share: share(&whole),
            median_ncc: median(&whole),
            agreeing: agrees.iter().filter(|agrees| **agrees).count() as f64
                / windows.len().max(1) as f64,
            part: part.len() as f64 / windows.len().max(1) as f64,
            part_share: share(&part),
            part_ncc: median(&part),
        };
        (agreement, support)
    }

    /// Returns whether the page belongs to the block, or at least to a large part of it.
    pub(super) fn is_sure(&self) -> bool {
        let enough = |share: f64, ncc: f64| share >= MIN_AGREEMENT && ncc >= MIN_MEDIAN_NCC;
        (self.windows >= MIN_WINDOWS && enough(self.agreeing, self.median_ncc))
            || (self.windows as f64 * self.part >= MIN_WINDOWS as f64
                && self.part >= MIN_PART
                && enough(self.part_share, self.part_ncc))
    }

    /// Returns whether the page belongs to the block at the position that a person gave, or at least to a part of it. A
    /// search finds chance agreement, a given position does not, so less is needed.
    pub(super) fn is_sure_where_given(&self) -> bool {
        let windows = self.windows as f64;
        (self.windows >= MIN_WINDOWS
            && self.agreeing >= MIN_AGREEMENT_GIVEN
            && self.median_ncc >= AGREEMENT_NCC)
            || (windows * self.part >= MIN_WINDOWS as f64
                && self.part >= MIN_PART_GIVEN
                && self.part_share >= MIN_AGREEMENT
                && self.part_ncc >= MIN_MEDIAN_NCC)
    }

    /// Returns a number that orders alignments.
    pub(super) fn quality(&self) -> f64 {
        self.share * self.median_ncc.max(0.0) + self.part * self.part_share * self.part_ncc.max(0.0)
    }
}

impl Support {
    fn of(positions: &[[f64; 2]], agrees: &[bool]) -> Self {
        let [u0, v0, u1, v1] = bounds(positions.iter().copied());
        let origin_mm = [u0, v0];
        let count = |extent: f64| (extent / SUPPORT_STEP_MM).ceil() as usize + 1;
        let (columns, rows) = (count(u1 - u0), count(v1 - v0));
        let share = |place: usize| {
            let at = [
                origin_mm[0] + (place % columns) as f64 * SUPPORT_STEP_MM,
                origin_mm[1] + (place / columns) as f64 * SUPPORT_STEP_MM,
            ];
            let (mut all, mut agreeing) = (0.0, 0.0);
            for (other, agrees) in positions.iter().zip(agrees) {
                let distance = (other[0] - at[0]).hypot(other[1] - at[1]) / SUPPORT_REACH_MM;
                let weight = (1.0 - distance * distance).max(0.0);
                all += weight;
                agreeing += if *agrees { weight } else { 0.0 };
            }
            if all > 0.0 {
                (100.0 * agreeing / all).round() as u8
            } else {
                0
            }
        };
        Self {
            origin_mm,
            columns,
            percent: (0..columns * rows).map(share).collect(),
        }
    }

    /// Returns the fraction of agreeing windows around a place of the face, 0..=1; 0 outside the windows.
    pub fn at(&self, place: [f64; 2]) -> f64 {
        let rows = self.percent.len().checked_div(self.columns).unwrap_or(0);
        let cell = |k: usize, count: usize| {
            let at = ((place[k] - self.origin_mm[k]) / SUPPORT_STEP_MM).round();
            (at >= -1.0 && at <= count as f64).then(|| (at.max(0.0) as usize).min(count - 1))
        };
        if rows == 0 {
            return 0.0;
        }
        match (cell(0, self.columns), cell(1, rows)) {
            (Some(x), Some(y)) => f64::from(self.percent[y * self.columns + x]) / 100.0,
            _ => 0.0,
        }
    }
}

/// Returns the distance of a window's shift from the field, mm.
fn distance(window: &WindowMatch, fitted: [f64; 2]) -> f64 {
    (window.shift[0] - fitted[0]).hypot(window.shift[1] - fitted[1])
}

/// Returns the mean correlation of windows, counting those farther than `reach_mm` from the field as 0.
pub(super) fn mean_near(windows: &[WindowMatch], field: &ShiftField, reach_mm: f64) -> f64 {
    let sum: f64 = windows
        .iter()
        .filter(|window| distance(window, field.at(window.at)) <= reach_mm)
        .map(|window| window.ncc)
        .sum();
    sum / windows.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::{Agreement, ShiftField};
    use crate::block::WindowMatch;

    /// Windows every 6 mm; those with u below `right_until` agree.
    fn agreement(right_until: f64) -> (Agreement, super::Support) {
        let places = (0..50).flat_map(|x| (0..34).map(move |y| [x, y]));
        let windows: Vec<WindowMatch> = places
            .map(|[x, y]| {
                let at = [f64::from(x) * 6.0, f64::from(y) * 6.0];
                let is_right = at[0] < right_until;
                let scatter = [(x * 7 + y * 3) % 11, (x * 5 + y * 7) % 13];
                WindowMatch {
                    at,
                    shift: if is_right {
                        [0.2, -0.1]
                    } else {
                        [
                            f64::from(scatter[0]) / 3.0 - 1.8,
                            f64::from(scatter[1]) / 3.0 - 2.0,
                        ]
                    },
                    ncc: if is_right { 0.85 } else { 0.45 },
                    curvature: [0.2, 0.2, 0.0],
                }
            })
            .collect();
        let field = ShiftField::fit(&windows, 45.0, Some(12.0)).unwrap();
        Agreement::of(&windows, &field)
    }

    #[test]
    fn pages_that_agree_everywhere_or_in_a_large_part_are_accepted() {
        let (whole, _) = agreement(1_000.0);
        assert!(whole.is_sure() && whole.share > 0.99, "{whole:?}");
        let (part, support) = agreement(150.0);
        assert!(part.is_sure(), "{part:?}");
        assert!(support.at([60.0, 100.0]) > 0.9);
        assert!(support.at([260.0, 100.0]) < 0.4);
        assert_eq!(support.at([900.0, 100.0]), 0.0);
    }

    #[test]
    fn pages_that_agree_nowhere_or_in_a_corner_are_refused() {
        for right_until in [-1.0, 30.0] {
            let (agreement, _) = agreement(right_until);
            assert!(!agreement.is_sure(), "{agreement:?}");
        }
    }
}
