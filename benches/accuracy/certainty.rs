//! Table of how well confidence separates right results from wrong ones.

use mocban::demo::Tier;
use mocban::domain::ThresholdMetric;

use super::accuracy::{metrics, share};
use super::markdown::Table;
use super::method::Method;
use super::trial::{Found, Trial, of};

/// Share of the pairs that a reviewer would check.
const LEAST_SURE: f64 = 0.03;

const NOTE: &str = "\
Wrong pairs that did not fail; how many of them are among the 3 % of the pairs (at least one) with the lowest \
confidence; share of all couples of a right and a wrong pair in which the right one has the higher confidence (AUC: 0.5 \
is chance, 1 perfect); Acc of the other 97 %.";

/// Makes a table of confidences with a row for each tier, method and metric. Returns `None` if no pair has a
/// confidence.
pub(super) fn table(tiers: &[Tier], methods: &[Method], trials: &[Trial]) -> Option<String> {
    let heads = [
        "tier",
        "preset",
        "metric",
        "wrong",
        "among the lowest 3 %",
        "AUC",
        "Acc of the other 97 %",
    ];
    let mut table = Table::new("Confidence", &heads);
    let mut is_empty = true;
    for tier in tiers {
        for method in methods {
            let trials = of(trials, *tier, method);
            for metric in metrics(&trials) {
                let sorted = by_confidence(&trials, metric);
                if sorted.is_empty() {
                    continue;
                }
                let mut cells = vec![tier.to_string(), method.name.to_owned(), metric.to_string()];
                cells.extend(row(&sorted));
                table.push(cells);
                is_empty = false;
            }
        }
    }
    (!is_empty).then(|| table.render(NOTE))
}

/// Returns the confidence of each pair and whether the pair is right, least confident first.
fn by_confidence(trials: &[&Trial], metric: ThresholdMetric) -> Vec<(f64, bool)> {
    let found = trials.iter().filter_map(|trial| trial.found(metric));
    let sure = |found: &Found| Some((found.confidence?, found.errors.pass()));
    let mut sorted: Vec<_> = found.filter_map(sure).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    sorted
}

fn row(sorted: &[(f64, bool)]) -> [String; 4] {
    let looked_at = ((sorted.len() as f64 * LEAST_SURE).round() as usize).max(1);
    let (least, rest) = sorted.split_at(looked_at.min(sorted.len()));
    let wrong = |pairs: &[(f64, bool)]| pairs.iter().filter(|(_, is_right)| !is_right).count();
    let right = rest.len() - wrong(rest);
    [
        wrong(sorted).to_string(),
        wrong(least).to_string(),
        order(sorted).map_or("–".to_owned(), |order| format!("{order:.3}")),
        share(right, rest.len()),
    ]
}

/// Returns the area under the ROC curve: the probability that a right pair has a higher confidence than a wrong pair.
/// Ties count half.
fn order(sorted: &[(f64, bool)]) -> Option<f64> {
    let of = |wanted: bool| {
        sorted
            .iter()
            .filter(move |(_, is_right)| *is_right == wanted)
    };
    let couples = of(true).count() * of(false).count();
    let won: f64 = of(false)
        .flat_map(|(wrong, _)| of(true).map(move |(right, _)| (right, wrong)))
        .map(|(right, wrong)| f64::from(right > wrong).midpoint(f64::from(right >= wrong)))
        .sum();
    (couples > 0).then(|| won / couples as f64)
}
