//! Table of accuracy against the ground truth.

use mocban::demo::Tier;
use mocban::domain::ThresholdMetric;
use mocban::results::ground_truth::MAX_ANGLE_DEG;
use mocban::results::stats::{quantile, wilson_95};

use super::markdown::{Table, number, two};
use super::method::Method;
use super::trial::{Found, Trial, of};

const HEADS: [&str; 12] = [
    "tier",
    "preset",
    "metric",
    "n",
    "failed",
    "within 5°",
    "within 1°",
    "Acc",
    "landmarks %",
    "normal °",
    "tops IoU",
    "print IoU",
];

const NOTE: &str = "\
Shares are of all n pairs, with Wilson's 95 % interval; failed pairs ended in a stage's error and count as wrong. \
Acc: angle within 5°, landmarks within 5 % of the character's height, tops IoU at least 0.7. Landmarks (percent of \
the character's height) and normal: median / 95th percentile; tops IoU (depth mask with the true stroke tops): \
median / 5th percentile; print IoU: median. These are over the pairs that did not fail.";

/// Makes a row for each tier, method and metric.
pub(super) fn table(tiers: &[Tier], methods: &[Method], trials: &[Trial]) -> String {
    let mut table = Table::new("Accuracy", &HEADS);
    for tier in tiers {
        for method in methods {
            let trials = of(trials, *tier, method);
            for metric in metrics(&trials) {
                let mut cells = vec![tier.to_string(), method.name.to_owned(), metric.to_string()];
                cells.extend(shares(&trials, metric));
                cells.extend(distances(&trials, metric));
                table.push(cells);
            }
        }
    }
    table.render(NOTE)
}

/// Returns the metrics that occur in any trial, in order. If every trial failed, returns only the first metric.
pub(super) fn metrics(trials: &[&Trial]) -> Vec<ThresholdMetric> {
    let has = |metric: &ThresholdMetric| trials.iter().any(|trial| trial.found(*metric).is_some());
    let found: Vec<_> = ThresholdMetric::ALL.into_iter().filter(has).collect();
    if found.is_empty() {
        return vec![ThresholdMetric::ALL[0]];
    }
    found
}

/// Returns the cells that count pairs.
fn shares(trials: &[&Trial], metric: ThresholdMetric) -> [String; 5] {
    let right = |is_right: fn(&Found) -> bool| {
        let found = trials.iter().filter_map(|trial| trial.found(metric));
        share(found.filter(|found| is_right(found)).count(), trials.len())
    };
    let failed = trials.iter().filter(|trial| trial.found(metric).is_none());
    [
        trials.len().to_string(),
        failed.count().to_string(),
        right(|found| found.errors.angle_deg <= MAX_ANGLE_DEG),
        right(|found| found.errors.angle_deg <= 1.0),
        right(|found| found.errors.pass()),
    ]
}

/// Returns the cells that measure distances.
fn distances(trials: &[&Trial], metric: ThresholdMetric) -> [String; 4] {
    let of_found = |value: fn(&Found) -> Option<f64>| -> Vec<f64> {
        let found = trials.iter().filter_map(|trial| trial.found(metric));
        found.filter_map(value).collect()
    };
    let mut landmarks = of_found(|found| Some(found.errors.tre_pct));
    let mut normals: Vec<f64> = trials.iter().filter_map(|trial| trial.normal_deg).collect();
    let mut tops = of_found(|found| found.errors.mask_iou);
    let mut print = of_found(|found| Some(found.print_iou));
    [
        two([0.5, 0.95].map(|share| quantile(&mut landmarks, share)), 2),
        two([0.5, 0.95].map(|share| quantile(&mut normals, share)), 2),
        two([0.5, 0.05].map(|share| quantile(&mut tops, share)), 3),
        number(quantile(&mut print, 0.5), 3),
    ]
}

/// Formats a share with its interval.
pub(super) fn share(right: usize, n: usize) -> String {
    let Some([low, high]) = wilson_95(right as u64, n as u64) else {
        return number(None, 0);
    };
    format!("{:.3} [{low:.3}, {high:.3}]", right as f64 / n as f64)
}
