//! Table of how many decoys, pairs without a right answer, are rejected.

use mocban::domain::{MetricOutcome, ThresholdMetric};
use mocban::mesh::write::MeshFormat;
use mocban::results::stats::quantile;

use super::accuracy::share;
use super::case::Case;
use super::decoy::{Decoy, decoy_pair};
use super::kinds::SURE;
use super::markdown::{Table, number};
use super::method::Method;
use super::numbers::Numbers;
use super::options::Options;
use super::run::{Input, Run};
use super::trial::Trial;
use super::workers::in_order;

/// Share of the right pairs that may be rejected.
const FALSE_ALARMS: f64 = 0.01;

const NOTE: &str = "\
Rejected by a stage: the pair ended in an error. Rejected: that, or a confidence of the metric below the level under \
which 1 % of the preset's right pairs of all tiers lie. The last columns count the decoys \
that no stage rejected, and those among them with a confidence of at least 0.5.";

/// Result of a decoy.
pub(super) struct Answer {
    /// The pair from which the decoy was made.
    pub(super) case: Case,
    /// What was changed.
    pub(super) kind: Decoy,
    /// Name of the method.
    pub(super) method: &'static str,
    /// Every number of the alignment under the chosen metric, or the error of the stage that rejected the decoy.
    pub(super) outcome: Result<Numbers, String>,
}

/// Runs every kind of decoy of every pair under every method.
pub(super) fn all(
    cases: &[Case],
    methods: &[Method],
    options: &Options,
) -> anyhow::Result<Vec<Answer>> {
    let of_case = |index: usize| {
        let mut answers = Vec::new();
        for kind in Decoy::ALL {
            let input = input(&cases[index], kind)?;
            for method in methods {
                answers.push(Answer {
                    case: cases[index],
                    kind,
                    method: method.name,
                    outcome: outcome(&Run::new(&input, &method.settings), options.metric)?,
                });
            }
        }
        Ok(answers)
    };
    let answers = in_order(cases.len(), options.workers, of_case)?;
    Ok(answers.into_iter().flatten().collect())
}

/// Makes a decoy of a case.
pub(super) fn input(case: &Case, kind: Decoy) -> anyhow::Result<Input> {
    let decoy = decoy_pair(&case.pairs(), kind, case.index)?;
    case.input(MeshFormat::StlBinary.encode(&decoy.mesh), decoy.print)
}

fn outcome(run: &Run, metric: ThresholdMetric) -> anyhow::Result<Result<Numbers, String>> {
    match &run.result {
        Ok((_, aligned)) => {
            let mut numbers = Numbers::of_stages(aligned)?;
            numbers.add("metric", &aligned.metric(metric))?;
            let of_metric = |found: &MetricOutcome| found.metric == metric;
            if let Some(k) = aligned.metrics().iter().position(of_metric) {
                numbers.add_inputs(aligned, k)?;
            }
            Ok(Ok(numbers))
        }
        Err(failed) => Ok(Err(failed.to_string())),
    }
}

impl Answer {
    /// Returns the confidence of the alignment. `Ok(None)` if it has no confidence, `Err` if a stage failed.
    fn confidence(&self) -> Result<Option<f64>, &String> {
        let numbers = self.outcome.as_ref()?;
        Ok(numbers.number("metric.confidence"))
    }
}

/// Makes a row for each tier, method and kind.
pub(super) fn table(
    options: &Options,
    methods: &[Method],
    trials: &[Trial],
    answers: &[Answer],
) -> String {
    let heads = [
        "tier",
        "preset",
        "decoy",
        "n",
        "rejected by a stage",
        "level",
        "rejected",
        "accepted",
        "accepted at 0.5",
    ];
    let mut table = Table::new("Decoys", &heads);
    for tier in &options.tiers {
        for method in methods {
            let level = level(trials, method, options.metric);
            for kind in Decoy::ALL {
                let is_of = |answer: &&Answer| {
                    (answer.case.tier, answer.method, answer.kind) == (*tier, method.name, kind)
                };
                let answers: Vec<_> = answers.iter().filter(is_of).collect();
                let mut cells = vec![
                    tier.to_string(),
                    method.name.to_owned(),
                    kind.name().to_owned(),
                ];
                cells.extend(row(&answers, level));
                table.push(cells);
            }
        }
    }
    table.render(NOTE)
}

fn row(answers: &[&Answer], level: Option<f64>) -> [String; 6] {
    let count = |is_rejected: &dyn Fn(&Answer) -> bool| {
        let rejected = answers.iter().filter(|answer| is_rejected(answer)).count();
        share(rejected, answers.len())
    };
    let by_stage = count(&|answer| answer.outcome.is_err());
    let rejected = count(&|answer| match answer.confidence() {
        Err(_) => true,
        Ok(confidence) => confidence.is_some_and(|sure| level.is_some_and(|level| sure < level)),
    });
    let accepted = answers
        .iter()
        .filter_map(|answer| answer.confidence().ok())
        .map(Option::unwrap_or_default);
    [
        answers.len().to_string(),
        by_stage,
        number(level, 3),
        rejected,
        accepted.clone().count().to_string(),
        accepted.filter(|sure| *sure >= SURE).count().to_string(),
    ]
}

/// Returns the confidence that is not reached by the share `FALSE_ALARMS` of the right pairs.
fn level(trials: &[Trial], method: &Method, metric: ThresholdMetric) -> Option<f64> {
    let of_method = trials.iter().filter(|trial| trial.method == method.name);
    let found = of_method.filter_map(|trial| trial.found(metric));
    let right = found.filter(|found| found.errors.pass());
    let mut sure: Vec<f64> = right.filter_map(|found| found.confidence).collect();
    quantile(&mut sure, FALSE_ALARMS)
}
