//! A pair aligned by a method and compared with the ground truth.

use std::num::NonZeroUsize;

use mocban::demo::{DemoPair, Tier};
use mocban::domain::{MetricOutcome, ThresholdMetric};
use mocban::results::{
    ground_truth::{TruthErrors, TruthRecord},
    tops_iou,
};
use mocban::stages::AlignedPair;

use super::case::Case;
use super::method::Method;
use super::numbers::Numbers;
use super::run::Run;
use super::times::Times;
use super::workers::in_order;

/// Result of a pair under a method.
pub(super) struct Trial {
    /// The pair.
    pub(super) case: Case,
    /// Its id within tier and seed.
    pub(super) id: String,
    /// Its character.
    pub(super) character: String,
    /// Name of the method.
    pub(super) method: &'static str,
    /// Vertices of the mesh, each counted once.
    pub(super) vertices: usize,
    /// How long each part took.
    pub(super) times: Times,
    /// Angle in degrees between the normal of the found plane and the true normal, or `None` if no plane was found.
    pub(super) normal_deg: Option<f64>,
    /// One result a metric, or the error.
    pub(super) outcome: Result<Vec<Found>, String>,
}

/// A metric's alignment and its distance from the truth.
pub(super) struct Found {
    /// Which metric.
    pub(super) metric: ThresholdMetric,
    /// Distance from the truth.
    pub(super) errors: TruthErrors,
    /// Intersection over union with the print's ink on the canvas.
    pub(super) print_iou: f64,
    /// Confidence, 0..=1, where the method has one.
    pub(super) confidence: Option<f64>,
    /// Every number of the four stages.
    pub(super) numbers: Numbers,
}

/// Runs every pair with every method. Returns the results pair by pair, in the order of the methods.
pub(super) fn all(
    cases: &[Case],
    methods: &[Method],
    workers: NonZeroUsize,
) -> anyhow::Result<Vec<Trial>> {
    let of_case = |index: usize| {
        let case: &Case = &cases[index];
        let (pair, input) = case.make()?;
        let truth = TruthRecord::read(&serde_json::to_value(&pair.truth)?)?;
        let trial = |method: &Method| {
            let run = Run::new(&input, &method.settings);
            Trial::new(*case, &pair, &truth, method, &run)
        };
        methods
            .iter()
            .map(trial)
            .collect::<anyhow::Result<Vec<_>>>()
    };
    let trials = in_order(cases.len(), workers, of_case)?;
    Ok(trials.into_iter().flatten().collect())
}

/// Returns the trials of a tier under a method.
pub(super) fn of<'a>(trials: &'a [Trial], tier: Tier, method: &Method) -> Vec<&'a Trial> {
    let name = method.name;
    trials
        .iter()
        .filter(|trial| trial.case.tier == tier && trial.method == name)
        .collect()
}

impl Trial {
    fn new(
        case: Case,
        pair: &DemoPair,
        truth: &TruthRecord,
        method: &Method,
        run: &Run,
    ) -> anyhow::Result<Self> {
        let plane = run.fit.as_ref().map(|fit| &fit.plane_from_mesh);
        let normal_deg = plane
            .map(|plane| truth.normal_error_deg(plane))
            .transpose()?;
        let times = run.times;
        let outcome = match &run.result {
            Ok((_, aligned)) => Ok(found(pair, truth, aligned)?),
            Err(failed) => Err(failed.to_string()),
        };
        Ok(Self {
            case,
            id: pair.id.clone(),
            character: pair.character.clone(),
            method: method.name,
            vertices: pair.mesh.vertices.len(),
            times,
            normal_deg,
            outcome,
        })
    }

    /// Returns a metric's result.
    pub(super) fn found(&self, metric: ThresholdMetric) -> Option<&Found> {
        let found = self.outcome.as_ref().ok()?;
        found.iter().find(|found| found.metric == metric)
    }

    /// Returns how wrong a metric's result is; infinite for a failed pair.
    pub(super) fn severity(&self, metric: ThresholdMetric) -> f64 {
        self.found(metric)
            .map_or(f64::INFINITY, |found| found.errors.severity())
    }
}

/// Returns the results of all metrics.
fn found(
    pair: &DemoPair,
    truth: &TruthRecord,
    aligned: &AlignedPair,
) -> anyhow::Result<Vec<Found>> {
    let shared = Numbers::of_stages(aligned)?;
    let held = |(k, outcome): (usize, &MetricOutcome)| {
        let mut numbers = shared.clone();
        numbers.add("metric", outcome)?;
        numbers.add_inputs(aligned, k)?;
        let map = aligned.print_from_mesh(outcome);
        let tops = tops_iou(&aligned.depth, outcome, &pair.tops);
        Ok(Found {
            metric: outcome.metric,
            errors: truth.measure(&map, Some(tops))?,
            print_iou: outcome.scores.iou,
            confidence: numbers.number("metric.confidence"),
            numbers,
        })
    };
    aligned.metrics().iter().enumerate().map(held).collect()
}
