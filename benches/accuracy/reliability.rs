//! Tables of how often results of a given confidence are right.

use std::fmt::Write as _;

use mocban::domain::ThresholdMetric;
use mocban::results::stats::wilson_95;

use super::accuracy::share;
use super::markdown::{Table, number};
use super::method::Method;
use super::trial::Trial;

/// Upper ends of the bins of confidence.
const BINS: [f64; 7] = [0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0];

const NOTE: &str = "\
Results of all tiers and metrics, one row for each range of confidence: number of results, mean confidence, and share \
that is right with Wilson's 95 % interval, marked with ! if the mean lies outside it. Refused pairs have no confidence \
and are not counted.";

/// The confidence of a result and whether the result is right.
pub(super) type Judged = (f64, bool);

/// Makes the table of each method over all trials.
pub(super) fn tables(methods: &[Method], trials: &[Trial]) -> String {
    let columns: Vec<_> = methods
        .iter()
        .map(|method| (method.name, judged(method, trials)))
        .collect();
    table("Reliability", &columns, NOTE)
}

fn judged(method: &Method, trials: &[Trial]) -> Vec<Judged> {
    let of_method = trials.iter().filter(|trial| trial.method == method.name);
    of_method
        .flat_map(|trial| ThresholdMetric::ALL.map(|metric| trial.found(metric)))
        .flatten()
        .filter_map(|found| Some((found.confidence?, found.errors.pass())))
        .collect()
}

/// Makes a table with three columns for each named list of results, followed by their calibration errors.
pub(super) fn table(title: &'static str, columns: &[(&str, Vec<Judged>)], note: &str) -> String {
    let mut heads = vec!["confidence up to".to_owned()];
    for (name, _) in columns {
        heads.extend([format!("{name} n"), "mean".to_owned(), "right".to_owned()]);
    }
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new(title, &heads);
    for index in 0..BINS.len() {
        let mut cells = vec![BINS[index].to_string()];
        for (_, judged) in columns {
            let bin = bin(judged, index);
            cells.push(bin.len().to_string());
            cells.push(number(mean(&bin), 3));
            let outside = if is_outside(&bin) { " !" } else { "" };
            cells.push(format!("{}{outside}", share(right(&bin), bin.len())));
        }
        table.push(cells);
    }
    let mut text = table.render(note);
    for (name, judged) in columns {
        let _ = writeln!(
            text,
            "\nCalibration error, {name}: {:.4}; mean log loss: {:.4}",
            calibration_error(judged),
            log_loss(judged),
        );
    }
    text
}

/// Returns the results whose confidence lies in a bin, which excludes its upper end. The last bin includes 1.
fn bin(judged: &[Judged], index: usize) -> Vec<Judged> {
    let of = |confidence: f64| {
        BINS.iter()
            .position(|to| confidence < *to)
            .unwrap_or(BINS.len() - 1)
    };
    let inside = judged
        .iter()
        .filter(|(confidence, _)| of(*confidence) == index);
    inside.copied().collect()
}

fn mean(judged: &[Judged]) -> Option<f64> {
    let sum: f64 = judged.iter().map(|(confidence, _)| confidence).sum();
    (!judged.is_empty()).then(|| sum / judged.len() as f64)
}

/// Returns whether the mean confidence lies outside the interval of the share that is right.
fn is_outside(judged: &[Judged]) -> bool {
    let interval = wilson_95(right(judged) as u64, judged.len() as u64);
    let both = mean(judged).zip(interval);
    both.is_some_and(|(mean, [low, high])| !(low..=high).contains(&mean))
}

fn right(judged: &[Judged]) -> usize {
    judged.iter().filter(|(_, is_right)| *is_right).count()
}

/// Returns the mean distance, over all results, between the mean confidence of their bin and the share that is right.
fn calibration_error(judged: &[Judged]) -> f64 {
    let of_bin = |index| {
        let bin = bin(judged, index);
        mean(&bin).map_or(0.0, |mean| {
            (mean * bin.len() as f64 - right(&bin) as f64).abs()
        })
    };
    (0..BINS.len()).map(of_bin).sum::<f64>() / judged.len().max(1) as f64
}

fn log_loss(judged: &[Judged]) -> f64 {
    let loss =
        |(sure, is_right): &Judged| -(if *is_right { *sure } else { 1.0 - sure }).max(1e-9).ln();
    judged.iter().map(loss).sum::<f64>() / judged.len().max(1) as f64
}
