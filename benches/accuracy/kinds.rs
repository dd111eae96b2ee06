//! Table with one row for each kind of pair: right poses, right masks, refusals and errors with high confidence.

use mocban::demo::Tier;
use mocban::domain::ThresholdMetric;
use mocban::results::ground_truth::{MAX_ANGLE_DEG, MAX_TRE_PCT};

use super::accuracy::share;
use super::markdown::Table;
use super::method::Method;
use super::trial::{Found, Trial, of};

/// Confidence from which a wrong result counts as an error with high confidence.
pub(super) const SURE: f64 = 0.5;
/// Confidence from which hardly any result may be wrong.
const VERY_SURE: f64 = 0.95;

const NOTE: &str = "\
Pose right: angle within 5° and landmarks within 5 % of the character's height. Refused pairs count as wrong. The last \
columns are, by metric, the numbers of wrong results with a confidence of at least 0.5 and of at least 0.95, and of \
right results with a confidence below 0.5.";

/// Makes the table. The pose is that of `metric`.
pub(super) fn table(
    tiers: &[Tier],
    methods: &[Method],
    trials: &[Trial],
    metric: ThresholdMetric,
) -> String {
    let names = ThresholdMetric::ALL.map(ThresholdMetric::name).join(" / ");
    let acc = format!("Acc {names}");
    let heads = [
        "tier",
        "preset",
        "n",
        "pose right",
        &acc,
        "refused",
        "wrong at 0.5",
        "wrong at 0.95",
        "right below 0.5",
    ];
    let mut table = Table::new("Kinds", &heads);
    for method in methods {
        for tier in tiers {
            let trials = of(trials, *tier, method);
            table.push(row(tier.name(), method, &trials, metric));
        }
        let all = trials.iter().filter(|trial| trial.method == method.name);
        table.push(row("sum", method, &all.collect::<Vec<_>>(), metric));
    }
    table.render(NOTE)
}

fn row(name: &str, method: &Method, trials: &[&Trial], metric: ThresholdMetric) -> Vec<String> {
    let found = |metric| trials.iter().filter_map(move |trial| trial.found(metric));
    let has_right_pose = |found: &&Found| {
        found.errors.angle_deg <= MAX_ANGLE_DEG && found.errors.tre_pct <= MAX_TRE_PCT
    };
    let acc = ThresholdMetric::ALL.map(|metric| {
        let right = found(metric).filter(|found| found.errors.pass()).count();
        format!("{:.2}", right as f64 / trials.len().max(1) as f64)
    });
    let counts = |is_counted: &dyn Fn(&Found) -> bool| {
        let of_metric = |metric| found(metric).filter(|found| is_counted(found)).count();
        ThresholdMetric::ALL
            .map(|metric| of_metric(metric).to_string())
            .join(" / ")
    };
    let is_wrong_from = |least: f64| {
        move |found: &Found| {
            !found.errors.pass() && found.confidence.is_some_and(|sure| sure >= least)
        }
    };
    let is_right_but_doubted =
        |found: &Found| found.errors.pass() && found.confidence.is_some_and(|sure| sure < SURE);
    vec![
        name.to_owned(),
        method.name.to_owned(),
        trials.len().to_string(),
        share(found(metric).filter(has_right_pose).count(), trials.len()),
        acc.join(" / "),
        trials
            .iter()
            .filter(|trial| trial.outcome.is_err())
            .count()
            .to_string(),
        counts(&is_wrong_from(SURE)),
        counts(&is_wrong_from(VERY_SURE)),
        counts(&is_right_but_doubted),
    ]
}
