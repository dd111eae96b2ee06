//! Small catalog rows for unit tests.

use std::collections::BTreeMap;

use super::attention_checks::AttentionCheckRates;
use super::ground_truth::TruthErrors;
use super::reviewer_agreement::{ReviewerAgreement, ReviewerPair, ReviewerRecord, VerdictTable};
use super::stats::Rate;
use super::truth_evaluation::TruthEvaluation;
use mocban_catalog::{
    MetricRecord, PairAttributes, PairResults, ReviewerVerdict, StageRecord, StoredFailure,
};
use mocban_core::domain::test_values::metric_outcome;
use mocban_core::domain::{
    ContentHash, Failure, FailureClass, JobStatus, PairName, Stage, ThresholdMetric, Verdict,
};

/// Returns a result with an IoU, and the Dice that follows from it. The reviewers are named `r0`, `r1` and so on.
pub fn metric(metric: ThresholdMetric, iou: f64, verdicts: &[Verdict]) -> MetricRecord {
    MetricRecord {
        outcome: metric_outcome(metric, iou),
        result_hash: ContentHash::of(metric.name().as_bytes()),
        verdicts: verdicts
            .iter()
            .enumerate()
            .map(|(i, verdict)| ReviewerVerdict {
                reviewer: format!("r{i}"),
                verdict: *verdict,
                reason: None,
                review_order: None,
            })
            .collect(),
        older_verdicts: 0,
    }
}

/// Returns a finished pair whose metrics all have the same IoU and verdicts.
pub fn done(name: &str, iou: f64, verdicts: &[Verdict]) -> PairResults {
    PairResults {
        status: JobStatus::Done,
        next_stage: None,
        metrics: ThresholdMetric::ALL
            .into_iter()
            .map(|kind| metric(kind, iou, verdicts))
            .collect(),
        ..pending(name)
    }
}

/// Returns a pair finished by the paper's method, which has no `relief`.
pub fn done_by_paper(name: &str, iou: f64, verdicts: &[Verdict]) -> PairResults {
    let mut pair = done(name, iou, verdicts);
    pair.metrics
        .retain(|record| ThresholdMetric::PAPER.contains(&record.outcome.metric));
    pair
}

/// Returns a finished pair without verdicts, whose metrics all have the same confidence.
pub fn with_confidence(name: &str, confidence: f64) -> PairResults {
    let mut pair = done(name, 0.8, &[]);
    for record in &mut pair.metrics {
        record.outcome.confidence = Some(confidence);
    }
    pair
}

/// Returns a pair that failed in its first stage.
pub fn failed(name: &str, class: FailureClass, message: &str) -> PairResults {
    PairResults {
        status: JobStatus::Quarantined,
        failure: Some(StoredFailure {
            stage: Stage::Fit,
            failure: Failure::new(class, message),
            at: 0,
        }),
        ..pending(name)
    }
}

/// Returns the result of a stage with a computing time, but without outcome and files.
pub fn stage(stage: Stage, ms: u64) -> StageRecord {
    let hash = ContentHash::of(stage.name().as_bytes());
    StageRecord {
        stage,
        outcome: serde_json::Value::Null,
        files: BTreeMap::new(),
        result_hash: hash,
        fingerprint_hash: hash,
        fingerprint_fields: serde_json::Value::Null,
        mesh_hash: hash,
        print_hash: Some(hash),
        ms,
        at: 0,
    }
}

/// Returns a pair that waits for its first stage.
pub fn pending(name: &str) -> PairResults {
    PairResults {
        attributes: PairAttributes {
            name: PairName::new(name).expect("test names are ids"),
            mesh_path: format!("{name}.stl"),
            print_path: format!("{name}.png"),
            unit: None,
            scanned_face_down: None,
            character: None,
            block: None,
            meta: serde_json::Map::new(),
            prior: None,
        },
        status: JobStatus::Ready,
        next_stage: Some(Stage::Fit),
        failure: None,
        stages: Vec::new(),
        metrics: Vec::new(),
        truth: None,
        print_place: None,
    }
}

/// Returns an evaluation with the same errors for all metrics.
pub fn truth(angle_deg: f64, tre_pct: f64, mask_iou: f64) -> TruthEvaluation {
    let errors = TruthErrors {
        angle_deg,
        mirrored: false,
        tre_pct,
        mask_iou: Some(mask_iou),
    };
    TruthEvaluation {
        errors: BTreeMap::from(ThresholdMetric::ALL.map(|metric| (metric, errors))),
        problem: None,
    }
}

/// Returns the agreement of two reviewers who both pass `pass` results and disagree on `disputed` other results.
pub fn agreement(pass: u64, disputed: u64) -> ReviewerAgreement {
    let mut table = VerdictTable::default();
    (0..pass).for_each(|_| table.add(Verdict::Pass, Verdict::Pass));
    for i in 0..disputed {
        let [first, second] = if i == 0 {
            [Verdict::Pass, Verdict::Fail]
        } else {
            [Verdict::Fail, Verdict::Pass]
        };
        table.add(first, second);
    }
    let reviewer = |name: &str, detected: Rate| ReviewerRecord {
        reviewer: name.to_owned(),
        judged: pass + disputed,
        duplicates: Rate::default(),
        attention_checks: AttentionCheckRates {
            all: detected,
            ..AttentionCheckRates::default()
        },
    };
    ReviewerAgreement {
        retired: 0,
        set_apart: mocban_catalog::SetApart::default(),
        schema: 1,
        conflicts: disputed,
        conflicts_by_metric: BTreeMap::new(),
        conflicting_pairs: Vec::new(),
        reviewer_pairs: vec![ReviewerPair {
            a: "lan".to_owned(),
            b: "minh".to_owned(),
            agreement: table.finish(),
        }],
        reviewers: vec![
            reviewer("lan", Rate::new(19, 20)),
            reviewer("minh", Rate::default()),
        ],
        attention_checks: Rate::new(19, 20),
    }
}
