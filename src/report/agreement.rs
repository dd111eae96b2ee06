//! How far two reviewers agree on what both have read.

use serde::Serialize;

use super::accumulate::share;
use super::stats::wilson_95;
use crate::domain::Verdict::{self, Fail, Pass, Unsure};

/// Results that both reviewers must have told of before anything is said of their agreement.
///
/// At 30 the 95 % interval of full agreement still goes down to 0.89.
pub const ENOUGH: u64 = 30;

/// Two reviewers' verdicts on the same results, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Crosstab {
    both_pass: u64,
    both_fail: u64,
    first_fails: u64,
    second_fails: u64,
    unsure: u64,
}

/// How far two reviewers agree. Each number is `None` where it does not exist.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Agreement {
    /// Results on which both told pass or fail; all numbers but `unsure` are of these.
    pub n: u64,
    /// Results that both read and one at least could not tell of.
    pub unsure: u64,
    /// On how many they told the same.
    pub agreed: u64,
    /// `agreed / n`.
    pub agreement: Option<f64>,
    /// Wilson's 95 % interval of `agreement`.
    pub agreement_ci95: Option<[f64; 2]>,
    /// Cohen's kappa; there is none where chance alone would make them agree always. Near 0 for reviewers who agree on
    /// almost all when failures are rare. Source: Cohen 1960, doi:10.1177/001316446002000104.
    pub kappa: Option<f64>,
    /// Gwet's AC1, which rare failures do not pull down. Source: Gwet 2008, doi:10.1348/000711006X126600.
    pub ac1: Option<f64>,
    /// Results that one at least failed.
    pub flagged: u64,
    /// Those of the flagged that both failed.
    pub flagged_by_both: u64,
    /// Whether `n` is at least [`ENOUGH`].
    pub enough: bool,
}

impl Crosstab {
    /// Counts one result in.
    pub(super) fn add(&mut self, first: Verdict, second: Verdict) {
        let cell = match (first, second) {
            (Unsure, _) | (_, Unsure) => &mut self.unsure,
            (Pass, Pass) => &mut self.both_pass,
            (Fail, Fail) => &mut self.both_fail,
            (Fail, Pass) => &mut self.first_fails,
            (Pass, Fail) => &mut self.second_fails,
        };
        *cell += 1;
    }

    /// The numbers that follow.
    pub(super) fn finish(self) -> Agreement {
        let agreed = self.both_pass + self.both_fail;
        let flagged = self.both_fail + self.first_fails + self.second_fails;
        let n = self.both_pass + flagged;
        let agreement = share(agreed as f64, n);
        let chances = share((self.both_fail + self.first_fails) as f64, n)
            .zip(share((self.both_fail + self.second_fails) as f64, n));
        let beyond = |chance: fn(f64, f64) -> f64| {
            let (first, second) = chances?;
            beyond_chance(agreement?, chance(first, second))
        };
        Agreement {
            n,
            unsure: self.unsure,
            agreed,
            agreement,
            agreement_ci95: wilson_95(agreed, n),
            kappa: beyond(|first, second| first * second + (1.0 - first) * (1.0 - second)),
            ac1: beyond(|first, second| {
                let fail = f64::midpoint(first, second);
                2.0 * fail * (1.0 - fail)
            }),
            flagged,
            flagged_by_both: self.both_fail,
            enough: n >= ENOUGH,
        }
    }
}

/// The share of what chance leaves open that they agree on; `None` where it leaves nothing open.
fn beyond_chance(agreement: f64, chance: f64) -> Option<f64> {
    (chance < 1.0).then(|| (agreement - chance) / (1.0 - chance))
}

#[cfg(test)]
mod tests {
    use super::{Agreement, Crosstab, ENOUGH};
    use crate::domain::Verdict;

    fn of([both_pass, first_fails, second_fails, both_fail]: [u64; 4]) -> Agreement {
        Crosstab {
            both_pass,
            both_fail,
            first_fails,
            second_fails,
            unsure: 0,
        }
        .finish()
    }

    /// Counts (both pass, first fails, second fails, both fail), kappa, AC1.
    /// Kappa of scikit-learn 1.9.1 `cohen_kappa_score`, equal to statsmodels 0.15.0 `cohens_kappa`.
    const TABLE: [([u64; 4], f64, f64); 7] = [
        (
            [584, 1, 2, 0],
            -0.002_276_607_854_297_063_6,
            0.994_863_081_130_355_5,
        ),
        ([584, 3, 0, 0], 0.0, 0.994_863_081_130_355_5),
        (
            [583, 1, 2, 1],
            0.397_536_777_283_612_8,
            0.994_845_549_420_234_1,
        ),
        (
            [40, 5, 3, 12],
            0.659_574_468_085_106_3,
            0.781_021_897_810_219_1,
        ),
        (
            [20, 10, 10, 20],
            0.333_333_333_333_333_37,
            0.333_333_333_333_333_26,
        ),
        ([0, 7, 9, 0], -0.969_230_769_230_769_3, -1.0),
        ([578, 0, 0, 9], 1.0, 1.0),
    ];

    #[test]
    fn kappa_equals_scikit_learn_and_ac1_its_formula() {
        for (counts, kappa, ac1) in TABLE {
            let found = of(counts);
            let (found_kappa, found_ac1) = found.kappa.zip(found.ac1).expect("both exist");
            assert!((found_kappa - kappa).abs() < 1e-12, "{counts:?}: {found:?}");
            assert!((found_ac1 - ac1).abs() < 1e-12, "{counts:?}: {found:?}");
        }
    }

    #[test]
    fn rare_failures_leave_no_kappa_but_an_ac1() {
        let found = of([584, 1, 2, 0]);
        let shown = |value: Option<f64>| format!("{:.3}", value.expect("587 results"));
        assert_eq!(shown(found.agreement), "0.995");
        assert_eq!(shown(found.kappa), "-0.002");
        assert_eq!(shown(found.ac1), "0.995");
        assert_eq!((found.flagged, found.flagged_by_both), (3, 0));
    }

    #[test]
    fn what_does_not_exist_is_none() {
        let nothing = of([0; 4]);
        assert_eq!(
            (nothing.agreement, nothing.kappa, nothing.ac1),
            (None, None, None)
        );
        let all_passed = of([40, 0, 0, 0]);
        assert_eq!((all_passed.kappa, all_passed.ac1), (None, Some(1.0)));
        assert_eq!(of([0, 0, 0, 40]).kappa, None);
    }

    #[test]
    fn who_cannot_tell_neither_agrees_nor_contradicts() {
        let mut crosstab = Crosstab::default();
        for (first, second) in [
            (Verdict::Pass, Verdict::Pass),
            (Verdict::Fail, Verdict::Pass),
            (Verdict::Unsure, Verdict::Pass),
            (Verdict::Fail, Verdict::Unsure),
        ] {
            crosstab.add(first, second);
        }
        let found = crosstab.finish();
        assert_eq!((found.n, found.agreed, found.unsure), (2, 1, 2));
        assert_eq!(found.flagged, 1);
    }

    #[test]
    fn under_thirty_is_too_few() {
        assert!(!of([ENOUGH - 1, 0, 0, 0]).enough);
        assert!(of([ENOUGH - 1, 0, 1, 0]).enough);
    }
}
