//! Agreement of two raters beyond chance.

use super::rate::ratio;

/// Two raters' pass or fail of the same items, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AgreementTable {
    /// Items that both passed.
    pub both_pass: u64,
    /// Items that both failed.
    pub both_fail: u64,
    /// Items that only the first failed.
    pub first_fails: u64,
    /// Items that only the second failed.
    pub second_fails: u64,
}

impl AgreementTable {
    /// Counts one item.
    pub fn add(&mut self, first_passes: bool, second_passes: bool) {
        let cell = match (first_passes, second_passes) {
            (true, true) => &mut self.both_pass,
            (false, false) => &mut self.both_fail,
            (false, true) => &mut self.first_fails,
            (true, false) => &mut self.second_fails,
        };
        *cell += 1;
    }

    /// Returns the number of items.
    pub const fn n(self) -> u64 {
        self.both_pass + self.failed_by_any()
    }

    /// Returns the number of items that both passed or both failed.
    pub const fn agreed(self) -> u64 {
        self.both_pass + self.both_fail
    }

    /// Returns the number of items that at least one failed.
    pub const fn failed_by_any(self) -> u64 {
        self.both_fail + self.first_fails + self.second_fails
    }

    /// Returns Cohen's kappa, in -1..=1, or `None` if there are no items or the chance agreement is 1.
    ///
    /// Kappa is `(a - c) / (1 - c)`, where a is the observed agreement and c is the agreement expected by chance. If f1
    /// and f2 are the shares of items failed by each rater, `c = f1 f2 + (1 - f1)(1 - f2)`. If failures are rare, kappa
    /// may be near 0 even if the raters almost always agree. Source: Cohen 1960, doi:10.1177/001316446002000104.
    ///
    /// ```
    /// use mocban_results::stats::AgreementTable;
    ///
    /// // a = 40/60; each rater failed half, so c = 1/2 and kappa = 1/3.
    /// let table = AgreementTable { both_pass: 20, first_fails: 10, second_fails: 10, both_fail: 20 };
    /// assert!((table.cohen_kappa().unwrap() - 1.0 / 3.0).abs() < 1e-12);
    /// ```
    pub fn cohen_kappa(self) -> Option<f64> {
        self.beyond_chance(|first, second| first * second + (1.0 - first) * (1.0 - second))
    }

    /// Returns Gwet's AC1, in -1..=1, or `None` if there are no items.
    ///
    /// AC1 is `(a - c) / (1 - c)`, where a is the observed agreement and c is the agreement expected by chance. If f is
    /// the mean of the raters' shares of failed items, `c = 2 f (1 - f)`. Rare failures do not lower AC1. Source: Gwet
    /// 2008, doi:10.1348/000711006X126600.
    ///
    /// ```
    /// use mocban_results::stats::AgreementTable;
    ///
    /// // a = 36/40 and f = 2/40: c = 0.095, AC1 = (0.9 - 0.095) / 0.905.
    /// let table = AgreementTable { both_pass: 36, first_fails: 2, second_fails: 2, both_fail: 0 };
    /// assert!((table.gwet_ac1().unwrap() - 0.805 / 0.905).abs() < 1e-12);
    /// ```
    pub fn gwet_ac1(self) -> Option<f64> {
        self.beyond_chance(|first, second| {
            let fail = f64::midpoint(first, second);
            2.0 * fail * (1.0 - fail)
        })
    }

    /// Returns `(a - c) / (1 - c)`, where a is the observed agreement, and `chance` computes the expected agreement c.
    fn beyond_chance(self, chance: fn(f64, f64) -> f64) -> Option<f64> {
        let share = |count: u64| ratio(count as f64, self.n());
        let observed = share(self.agreed())?;
        let chance = chance(
            share(self.both_fail + self.first_fails)?,
            share(self.both_fail + self.second_fails)?,
        );
        (chance < 1.0).then(|| (observed - chance) / (1.0 - chance))
    }
}

#[cfg(test)]
mod tests {
    use super::AgreementTable;

    fn table([both_pass, first_fails, second_fails, both_fail]: [u64; 4]) -> AgreementTable {
        AgreementTable {
            both_pass,
            both_fail,
            first_fails,
            second_fails,
        }
    }

    /// Each entry holds the counts (both pass, first fails, second fails, both fail), kappa, and AC1. Kappa is from
    /// scikit-learn 1.9.1 `cohen_kappa_score` and equals statsmodels 0.15.0 `cohens_kappa`.
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
            let found = table(counts);
            let found = found.cohen_kappa().zip(found.gwet_ac1());
            let (found_kappa, found_ac1) = found.expect("both exist");
            assert!((found_kappa - kappa).abs() < 1e-12, "{counts:?}: {found:?}");
            assert!((found_ac1 - ac1).abs() < 1e-12, "{counts:?}: {found:?}");
        }
    }

    #[test]
    fn coefficients_that_do_not_exist_are_none() {
        let nothing = table([0; 4]);
        assert_eq!((nothing.cohen_kappa(), nothing.gwet_ac1()), (None, None));
        let all_passed = table([40, 0, 0, 0]);
        assert_eq!(all_passed.cohen_kappa(), None);
        assert_eq!(all_passed.gwet_ac1(), Some(1.0));
        assert_eq!(table([0, 0, 0, 40]).cohen_kappa(), None);
    }
}
