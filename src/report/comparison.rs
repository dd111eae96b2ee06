//! Metrics against each other on the same pairs.

use super::model::{Basis, Comparison};
use super::stats::{MOST_PAIRS, holm, mcnemar_exact, pairs_needed};
use crate::domain::ThresholdMetric::{self, Density, Ensemble, NlSsim, Relief};

/// Level below which a difference is said to be there.
pub(super) const LEVEL: f64 = 0.05;
/// Name of the test, with what makes it that one.
const TEST: &str = "McNemar, exact, two-sided";

/// Metrics that are compared: every two of the paper's, and the mask true to the wood with the one matched to the print.
pub(super) const PAIRS: [(ThresholdMetric, ThresholdMetric); 4] = [
    (Ensemble, NlSsim),
    (Ensemble, Density),
    (NlSsim, Density),
    (Relief, Ensemble),
];

/// Counts of the metrics of [`PAIRS`].
#[derive(Debug, Clone)]
pub(super) struct McNemarTests([McNemarTest; PAIRS.len()]);

/// Counts of two metrics.
#[derive(Debug, Clone, Copy)]
struct McNemarTest {
    a: ThresholdMetric,
    b: ThresholdMetric,
    n: u64,
    a_only: u64,
    b_only: u64,
}

impl Default for McNemarTests {
    fn default() -> Self {
        Self(PAIRS.map(|(a, b)| McNemarTest {
            a,
            b,
            n: 0,
            a_only: 0,
            b_only: 0,
        }))
    }
}

impl McNemarTests {
    /// Counts one pair in; `right` tells whether a metric's result is right, where that is known.
    pub(super) fn add(&mut self, right: impl Fn(ThresholdMetric) -> Option<bool>) {
        for duel in &mut self.0 {
            if let (Some(a), Some(b)) = (right(duel.a), right(duel.b)) {
                duel.n += 1;
                duel.a_only += u64::from(a && !b);
                duel.b_only += u64::from(b && !a);
            }
        }
    }

    /// The comparisons of all metrics that were judged on the same pairs.
    pub(super) fn finish(self, basis: Basis) -> Vec<Comparison> {
        let duels: Vec<McNemarTest> = self.0.into_iter().filter(|duel| duel.n > 0).collect();
        let ps: Vec<Option<f64>> = duels
            .iter()
            .map(|duel| mcnemar_exact(duel.a_only, duel.b_only))
            .collect();
        let corrected = after_holm(&ps);
        let both = ps.into_iter().zip(corrected);
        duels
            .into_iter()
            .zip(both)
            .map(|(duel, (p, p_holm))| duel.finish(basis, p.zip(p_holm)))
            .collect()
    }
}

/// Holm's correction where there is a p. A comparison that has none, as without discordant pairs, has nothing to tell
/// apart: it is as sure as p = 1.
pub(super) fn after_holm(ps: &[Option<f64>]) -> Vec<Option<f64>> {
    let all: Vec<f64> = ps.iter().map(|p| p.unwrap_or(1.0)).collect();
    let corrected = ps.iter().zip(holm(&all));
    corrected.map(|(p, p_holm)| p.map(|_| p_holm)).collect()
}

impl McNemarTest {
    fn finish(self, basis: Basis, p: Option<(f64, f64)>) -> Comparison {
        Comparison {
            basis,
            a: self.a,
            b: self.b,
            n: self.n,
            a_only: self.a_only,
            b_only: self.b_only,
            test: TEST,
            p: p.map(|(p, _)| p),
            p_holm: p.map(|(_, p_holm)| p_holm),
            words: self.words(p),
        }
    }

    /// What follows from p, raw and corrected.
    fn words(&self, p: Option<(f64, f64)>) -> String {
        let better = if self.a_only > self.b_only {
            self.a
        } else {
            self.b
        };
        match p {
            None => "right on the same pairs".to_owned(),
            Some((_, p_holm)) if p_holm < LEVEL => format!("{} is better", better.title()),
            Some((p, _)) if p < LEVEL => format!(
                "{} looks better, but not after correction for several comparisons",
                better.title()
            ),
            Some(_) => format!("cannot tell them apart; {}", self.needed()),
        }
    }

    /// How many pairs would tell them apart.
    fn needed(&self) -> String {
        if self.a_only == self.b_only {
            return "as many are right for the one only as for the other".to_owned();
        }
        match pairs_needed(self.a_only, self.b_only, self.n, LEVEL) {
            Some(pairs) => format!("at this rate about {} pairs would", grouped(rounded(pairs))),
            None => format!("at this rate {} pairs would not", grouped(MOST_PAIRS)),
        }
    }
}

/// To three digits.
fn rounded(number: u64) -> u64 {
    let unit = 10_u64.pow(number.checked_ilog10().unwrap_or(0).saturating_sub(2));
    (number + unit / 2) / unit * unit
}

/// With a comma before every three digits.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{McNemarTests, grouped, rounded};
    use crate::domain::ThresholdMetric;
    use crate::report::model::Basis;

    /// `(times, [nl_ssim, density, ensemble])`
    fn finish(worlds: &[(usize, [Option<bool>; 3])]) -> Vec<crate::report::Comparison> {
        let mut duels = McNemarTests::default();
        for (times, right) in worlds {
            for _ in 0..*times {
                duels.add(|metric| right.get(metric as usize).copied().flatten());
            }
        }
        duels.finish(Basis::Verdicts)
    }

    #[test]
    fn the_papers_counts_do_not_tell_ensemble_from_structure() {
        let found = finish(&[
            (574, [Some(true), Some(true), Some(true)]),
            (3, [Some(false), Some(true), Some(true)]),
            (9, [Some(true), Some(false), Some(true)]),
            (1, [Some(true), Some(true), Some(false)]),
        ]);
        assert_eq!(found[0].a, ThresholdMetric::Ensemble);
        assert_eq!((found[0].n, found[0].a_only, found[0].b_only), (587, 3, 1));
        assert_eq!(found[0].p, Some(0.625));
        assert_eq!(
            found[0].words,
            "cannot tell them apart; at this rate about 2,940 pairs would"
        );
        assert!((found[1].p.expect("ten discordant") - 0.021_484_375).abs() < 1e-12);
        assert!((found[1].p_holm.expect("ten discordant") - 0.064_453_125).abs() < 1e-12);
        assert!(found[1].words.contains("not after correction"));
    }

    /// 3, 9 and 1 failures of 587, where the ensemble's is one of structure's, and structure's are of density's.
    #[test]
    fn the_papers_failures_one_within_the_other_need_three_times_as_many_pairs() {
        let found = finish(&[
            (578, [Some(true), Some(true), Some(true)]),
            (1, [Some(false), Some(false), Some(false)]),
            (2, [Some(false), Some(false), Some(true)]),
            (6, [Some(true), Some(false), Some(true)]),
        ]);
        let said = "cannot tell them apart; at this rate about 1,760 pairs would";
        assert_eq!((found[0].p, found[0].words.as_str()), (Some(0.5), said));
        // statsmodels 0.15.0 `mcnemar(exact=True)` and `multipletests(method="holm")`.
        let wanted = [(0.5, 0.5), (0.007_812_5, 0.023_437_5), (0.031_25, 0.062_5)];
        for (found, (p, holm)) in found.iter().zip(wanted) {
            assert!((found.p.expect("discordant pairs") - p).abs() < 1e-12);
            assert!((found.p_holm.expect("discordant pairs") - holm).abs() < 1e-12);
        }
        assert_eq!(found[1].words, "Ensemble is better");
    }

    #[test]
    fn where_no_number_of_pairs_would_tell_none_is_said() {
        let found = finish(&[
            (2, [Some(true), Some(false), Some(true)]),
            (2, [Some(true), Some(true), Some(false)]),
        ]);
        assert_eq!(
            found[1].words,
            "cannot tell them apart; as many are right for the one only as for the other"
        );
    }

    #[test]
    fn numbers_are_rounded_to_three_digits_and_grouped() {
        let said = |number| grouped(rounded(number));
        assert_eq!(
            [6, 999, 1761, 2935].map(said),
            ["6", "999", "1,760", "2,940"]
        );
        assert_eq!(grouped(1_234_567), "1,234,567");
    }

    #[test]
    fn only_pairs_judged_for_both_count() {
        let found = finish(&[
            (4, [Some(true), None, Some(true)]),
            (2, [None, None, Some(true)]),
        ]);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].n, found[0].p), (4, None));
        assert_eq!(found[0].words, "right on the same pairs");
    }

    #[test]
    fn a_metric_nobody_has_results_of_is_not_compared_and_does_not_weaken_the_others() {
        let found = finish(&[(9, [Some(true), Some(false), Some(true)])]);
        assert_eq!(found.len(), 3);
        let (p, holm) = (found[1].p.expect("nine"), found[1].p_holm.expect("nine"));
        assert!((holm - 3.0 * p).abs() < 1e-12, "{p} {holm}");
    }

    #[test]
    fn a_plain_difference_is_named() {
        let found = finish(&[(20, [Some(false), Some(true), Some(true)])]);
        assert_eq!(found[0].words, "Ensemble is better");
        assert_eq!(found[2].words, "Pixel density is better");
    }
}
