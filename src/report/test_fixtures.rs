//! Small catalog rows for the tests of report and export.

use std::collections::BTreeMap;

use super::accumulate::TruthEvaluation;
use super::ground_truth::TruthErrors;
use super::model::MetricRow;
use super::score_bootstrap::MeanIntervals;
use crate::catalog::{
    MetricRecord, PairAttributes, PairResults, ReviewerVerdict, StageRecord, StoredFailure,
};
use crate::domain::{
    Affine2, ContentHash, Failure, FailureClass, JobStatus, MetricOutcome, PairName, Scores, Stage,
    ThresholdMetric, Verdict,
};

/// A result with an IoU and the Dice that belongs to it; the verdicts are of reviewers `r0`, `r1`, ...
pub(crate) fn metric(metric: ThresholdMetric, iou: f64, verdicts: &[Verdict]) -> MetricRecord {
    MetricRecord {
        outcome: MetricOutcome {
            metric,
            threshold_level: 30_000,
            threshold_depth: -0.25,
            print_from_depth: Affine2::similarity(0.5, 0.1, [3.0, 4.0]),
            angle_deg: 0.1_f64.to_degrees(),
            scale: 0.5,
            shift_px: [1.5, -2.5],
            scores: Scores {
                ssim: 0.81,
                nl_ssim: 0.82,
                iou,
                iou_box: 0.9,
                dice: 2.0 * iou / (1.0 + iou),
                density_print: 0.2,
                density_depth: 0.21,
            },
            margin: 0.3,
            confidence: None,
            at_bound: false,
        },
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

/// A finished pair with the same IoU and verdicts for all metrics.
pub(crate) fn done(name: &str, iou: f64, verdicts: &[Verdict]) -> PairResults {
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

/// The same under the paper's method, which gives no `relief`.
pub(crate) fn done_by_paper(name: &str, iou: f64, verdicts: &[Verdict]) -> PairResults {
    let mut pair = done(name, iou, verdicts);
    pair.metrics
        .retain(|record| ThresholdMetric::PAPER.contains(&record.outcome.metric));
    pair
}

/// A finished pair nobody has read, with the same confidence for all metrics.
pub(crate) fn sure(name: &str, confidence: f64) -> PairResults {
    let mut pair = done(name, 0.8, &[]);
    for record in &mut pair.metrics {
        record.outcome.confidence = Some(confidence);
    }
    pair
}

/// A pair that failed at its first stage.
pub(crate) fn failed(name: &str, class: FailureClass, message: &str) -> PairResults {
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

/// A stage's result that took so long, without numbers and files.
pub(crate) fn stage(stage: Stage, ms: u64) -> StageRecord {
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

/// A pair nothing was done with.
pub(crate) fn pending(name: &str) -> PairResults {
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
        },
        status: JobStatus::Ready,
        next_stage: Some(Stage::Fit),
        failure: None,
        stages: Vec::new(),
        metrics: Vec::new(),
        truth: None,
    }
}

/// The same errors for all metrics.
pub(crate) fn truth(angle_deg: f64, tre_pct: f64, mask_iou: f64) -> TruthEvaluation {
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

/// A row of 587 pairs nobody has read.
pub(crate) fn row(metric: ThresholdMetric, iou: f64, dice: f64) -> MetricRow {
    MetricRow {
        metric,
        n: 587,
        read: 0,
        passed: 0,
        failed: 0,
        unsure: 0,
        conflicts: 0,
        stale: 0,
        acc: None,
        acc_ci95: None,
        rules: None,
        failed_reasons: Vec::new(),
        ssim: Some(0.813),
        nl_ssim: Some(0.815),
        iou: Some(iou),
        iou_box: Some(0.9),
        dice: Some(dice),
        means_ci95: MeanIntervals::default(),
        truth: None,
        by_hand: None,
    }
}
