//! Metrics compared pair by pair, by which results are right.

use serde::Serialize;

use mocban_core::domain::ThresholdMetric::{self, Density, Ensemble, NlSsim, Relief};
use mocban_core::domain::enum_names;
use mocban_results::number_format::format_count;
use mocban_results::stats::{McNemarTest, SIGNIFICANCE_LEVEL, holm_of_known};

/// Largest sample size that is stated. Above it, texts say "more than".
const MAX_SAMPLE_SIZE: u64 = 100_000;

/// Fewest pairs on which metrics are compared. With fewer, no difference can be significant at the 5 % level.
pub(super) const MIN_PAIRS: u64 = 6;

/// Fewest pairs from which a sample size is estimated.
const MIN_PAIRS_FOR_ESTIMATE: u64 = 20;

/// The sentence on the sample size if there are fewer pairs.
pub(super) const TOO_FEW_TO_ESTIMATE: &str =
    "How many pairs would show one cannot be estimated from fewer than 20.";

/// The comparisons between metrics: every two of the paper's metrics, and `relief` with `ensemble`.
pub const COMPARED_METRICS: [(ThresholdMetric, ThresholdMetric); 4] = [
    (Ensemble, NlSsim),
    (Ensemble, Density),
    (NlSsim, Density),
    (Relief, Ensemble),
];

/// What decides whether a result is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Basis {
    /// Reviewers' verdicts.
    Verdicts,
    /// Ground truth.
    Truth,
}

impl Basis {
    /// Returns the words for pairs that count on this basis.
    pub(super) const fn pairs(self) -> &'static str {
        match self {
            Self::Verdicts => "judged pairs",
            Self::Truth => "pairs with ground truth",
        }
    }

    /// Returns its name in texts.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Verdicts => "verdicts",
            Self::Truth => "ground truth",
        }
    }
}

enum_names! { pub Basis, "a basis": Verdicts = "verdicts", Truth = "truth" }

/// Two metrics on the same pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// What decides whether a result is right.
    pub basis: Basis,
    /// The first metric.
    pub a: ThresholdMetric,
    /// The second metric.
    pub b: ThresholdMetric,
    /// Pairs on which both are known to be right or wrong.
    pub n: u64,
    /// Pairs on which only `a` is right.
    pub a_only: u64,
    /// Pairs on which only `b` is right.
    pub b_only: u64,
    /// Name of the test that gave `p`.
    pub test: &'static str,
    /// Two-sided p-value of the test. `None` without discordant pairs.
    pub p: Option<f64>,
    /// `p` after Holm's correction over the comparisons of this basis.
    pub p_holm: Option<f64>,
    /// Pairs that would be needed to show the difference with 80 % power at the 5 % level, rounded up to two significant
    /// digits. `None` if each metric alone is right on as many pairs as the other, or if fewer than 20 pairs are known.
    pub pairs_needed: Option<u64>,
    /// The conclusion, in whole sentences.
    pub conclusion: String,
}

/// The tests of [`COMPARED_METRICS`] while pairs are counted.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ComparisonSums([McNemarTest; COMPARED_METRICS.len()]);

impl ComparisonSums {
    /// Counts one pair. `right` returns whether the result of a metric is right, or `None` if that is unknown.
    pub(super) fn add(&mut self, right: impl Fn(ThresholdMetric) -> Option<bool>) {
        for (test, (a, b)) in self.0.iter_mut().zip(COMPARED_METRICS) {
            if let (Some(a), Some(b)) = (right(a), right(b)) {
                test.add(a, b);
            }
        }
    }

    /// Returns the comparisons with enough pairs on which both metrics are known to be right or wrong.
    pub(super) fn finish(self, basis: Basis) -> Vec<Comparison> {
        let compared = self.0.into_iter().zip(COMPARED_METRICS);
        let compared: Vec<_> = compared.filter(|(test, _)| test.n >= MIN_PAIRS).collect();
        let p_values: Vec<Option<f64>> = compared.iter().map(|(test, _)| test.p()).collect();
        let adjusted = compared.into_iter().zip(holm_of_known(&p_values));
        adjusted
            .map(|((test, (a, b)), p_holm)| Comparison {
                basis,
                a,
                b,
                n: test.n,
                a_only: test.a_only,
                b_only: test.b_only,
                test: McNemarTest::NAME,
                p: test.p(),
                p_holm,
                pairs_needed: pairs_needed(test),
                conclusion: conclusion(basis, (a, b), test, p_holm),
            })
            .collect()
    }
}

/// Returns the titles of two metrics that are compared.
pub(super) fn versus(a: ThresholdMetric, b: ThresholdMetric) -> String {
    format!("{} v. {}", a.title(), b.title())
}

/// Returns the conclusion of a test from its p-values before and after Holm's correction.
fn conclusion(
    basis: Basis,
    (a, b): (ThresholdMetric, ThresholdMetric),
    test: McNemarTest,
    p_holm: Option<f64>,
) -> String {
    let better = if test.a_only > test.b_only { a } else { b }.title();
    let Some((p, p_holm)) = test.p().zip(p_holm) else {
        return "No difference: on each pair both are right, or both are wrong.".to_owned();
    };
    if p_holm < SIGNIFICANCE_LEVEL {
        return format!("{better} is right significantly more often.");
    }
    if p < SIGNIFICANCE_LEVEL {
        return format!(
            "{better} is right more often, but not significantly after correction for several comparisons."
        );
    }
    let Some(pairs) = pairs_needed(test) else {
        if test.a_only != test.b_only {
            return format!("No significant difference. {TOO_FEW_TO_ESTIMATE}");
        }
        return "No significant difference: each alone is right on as many pairs as the other."
            .to_owned();
    };
    let needed = sample_size(basis, (a, b), pairs);
    format!("No significant difference. {needed}")
}

/// Returns the sentences on how many pairs would show a difference between two metrics.
pub(super) fn sample_size(
    basis: Basis,
    (a, b): (ThresholdMetric, ThresholdMetric),
    pairs: u64,
) -> String {
    format!(
        "To show one between {} and {}, {} {} would be needed. This assumes 80 % power and a 5 % level.",
        a.title(),
        b.title(),
        about(pairs),
        basis.pairs()
    )
}

/// Estimates how many pairs would show the difference. See [`Comparison::pairs_needed`].
fn pairs_needed(test: McNemarTest) -> Option<u64> {
    let is_estimable = test.n >= MIN_PAIRS_FOR_ESTIMATE;
    let pairs = test.sample_size().filter(|_| is_estimable);
    pairs.map(two_digits)
}

/// Rounds a sample size up to two significant digits. The estimate is not more precise than that.
fn two_digits(pairs: f64) -> u64 {
    let unit = 10.0_f64.powf((pairs.log10().floor() - 1.0).max(0.0));
    ((pairs / unit).ceil() * unit) as u64
}

/// Formats a sample size, such as `about 4,700` or `more than 100,000`.
fn about(pairs: u64) -> String {
    if pairs > MAX_SAMPLE_SIZE {
        return format!("more than {}", format_count(MAX_SAMPLE_SIZE));
    }
    format!("about {}", format_count(pairs))
}

#[cfg(test)]
mod tests {
    use super::{Basis, Comparison, ComparisonSums, about, two_digits};
    use mocban_core::domain::ThresholdMetric;

    /// Compares over `(times, [nl_ssim, density, ensemble])`.
    fn compare(outcomes: &[(usize, [Option<bool>; 3])]) -> Vec<Comparison> {
        let mut sums = ComparisonSums::default();
        for (times, right) in outcomes {
            for _ in 0..*times {
                sums.add(|metric| right.get(metric as usize).copied().flatten());
            }
        }
        sums.finish(Basis::Verdicts)
    }

    #[test]
    fn the_papers_counts_do_not_separate_ensemble_from_structure() {
        let found = compare(&[
            (574, [Some(true), Some(true), Some(true)]),
            (3, [Some(false), Some(true), Some(true)]),
            (9, [Some(true), Some(false), Some(true)]),
            (1, [Some(true), Some(true), Some(false)]),
        ]);
        assert_eq!(found[0].a, ThresholdMetric::Ensemble);
        assert_eq!((found[0].n, found[0].a_only, found[0].b_only), (587, 3, 1));
        assert_eq!(found[0].p, Some(0.625));
        assert_eq!(
            found[0].conclusion,
            "No significant difference. To show one between Ensemble and Non-luminous SSIM, about 4,700 judged pairs \
             would be needed. This assumes 80 % power and a 5 % level."
        );
        assert!((found[1].p.expect("ten discordant") - 0.021_484_375).abs() < 1e-12);
        assert!((found[1].p_holm.expect("ten discordant") - 0.064_453_125).abs() < 1e-12);
        assert!(found[1].conclusion.contains("not significantly after"));
    }

    /// Of 587 pairs, `nl_ssim` fails on 3, density on the same 3 and on 6 others, and the ensemble on one of the 3.
    #[test]
    fn nested_failures_of_the_paper_equal_statsmodels() {
        let found = compare(&[
            (578, [Some(true), Some(true), Some(true)]),
            (1, [Some(false), Some(false), Some(false)]),
            (2, [Some(false), Some(false), Some(true)]),
            (6, [Some(true), Some(false), Some(true)]),
        ]);
        assert!(found[0].conclusion.contains("about 2,400 judged pairs"));
        // The values are from statsmodels 0.15.0: `mcnemar(exact=True)` and `multipletests(method="holm")`.
        let wanted = [(0.5, 0.5), (0.007_812_5, 0.023_437_5), (0.031_25, 0.062_5)];
        for (found, (p, holm)) in found.iter().zip(wanted) {
            assert!((found.p.expect("discordant pairs") - p).abs() < 1e-12);
            assert!((found.p_holm.expect("discordant pairs") - holm).abs() < 1e-12);
        }
        let better = "Ensemble is right significantly more often.";
        assert_eq!(found[1].conclusion, better);
    }

    #[test]
    fn an_even_split_names_no_sample_size() {
        let found = compare(&[
            (3, [Some(true), Some(false), Some(true)]),
            (3, [Some(true), Some(true), Some(false)]),
        ]);
        assert!(found[1].conclusion.contains("each alone"), "{found:?}");
    }

    #[test]
    fn few_pairs_estimate_no_sample_size() {
        for (times, is_estimated) in [(6, false), (19, false), (20, true)] {
            let found = compare(&[
                (1, [Some(true), Some(false), Some(true)]),
                (times - 1, [Some(true), Some(true), Some(true)]),
            ]);
            assert_eq!(found[1].pairs_needed.is_some(), is_estimated, "{found:?}");
            let text = &found[1].conclusion;
            assert_eq!(text.contains("from fewer than 20"), !is_estimated, "{text}");
        }
    }

    #[test]
    fn sample_sizes_have_two_digits_and_a_limit() {
        let wanted = ["about 7", "about 99", "about 240", "about 4,700"];
        let sizes = [6.3, 99.0, 233.1, 4605.0].map(two_digits);
        assert_eq!(sizes.map(about), wanted);
        assert_eq!(about(two_digits(100_001.0)), "more than 100,000");
    }

    #[test]
    fn only_pairs_judged_for_both_count() {
        let found = compare(&[
            (5, [Some(false), None, Some(false)]),
            (1, [Some(true), None, Some(true)]),
            (2, [None, None, Some(true)]),
        ]);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].n, found[0].p), (6, None));
        assert_eq!(
            found[0].conclusion,
            "No difference: on each pair both are right, or both are wrong."
        );
        assert_eq!(compare(&[(5, [Some(true), Some(false), Some(true)])]), []);
    }

    #[test]
    fn metrics_without_results_do_not_enlarge_the_family_of_tests() {
        let found = compare(&[(9, [Some(true), Some(false), Some(true)])]);
        assert_eq!(found.len(), 3);
        let (p, holm) = (found[1].p.expect("nine"), found[1].p_holm.expect("nine"));
        assert!((holm - 3.0 * p).abs() < 1e-12, "{p} {holm}");
    }
}
