//! Small catalog rows for unit tests.

use std::collections::BTreeMap;

use super::accumulate::ReportAccumulator;
use super::attention_checks::AttentionCheckRates;
use super::block_accuracy::{BlockBoxes, BlockSums};
use super::ground_truth::TruthErrors;
use super::manual_alignment::ManualErrors;
use super::model::{MetricRow, Report};
use super::reviewer_agreement::{ReviewerAgreement, ReviewerPair, ReviewerRecord, VerdictTable};
use super::score_bootstrap::MeanIntervals;
use super::stats::Rate;
use super::truth_evaluation::TruthEvaluation;
use mocban_catalog::{
    MetricRecord, PairAttributes, PairResults, ReviewerVerdict, StageRecord, StoredFailure,
};
use mocban_core::domain::test_values::metric_outcome;
use mocban_core::domain::{
    BlockName, ContentHash, Failure, FailureClass, JobStatus, PairName, Reason, Stage,
    ThresholdMetric, TrueBox, Verdict,
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

/// Returns a row of 587 pairs without verdicts.
pub fn row(metric: ThresholdMetric, iou: f64, dice: f64) -> MetricRow {
    MetricRow {
        metric,
        n: 587,
        judged: 0,
        passed: 0,
        failed: 0,
        unsure: 0,
        conflicts: 0,
        stale: 0,
        low_confidence: None,
        acc: None,
        acc_ci95: None,
        rules: None,
        failed_reasons: Vec::new(),
        ssim: Some(0.813),
        nl_ssim: Some(0.815),
        iou: Some(iou),
        iou_box: Some(0.9),
        dice: Some(dice),
        disagreeing: 12,
        missing_ink: Some(0.004),
        missing_wood: Some(0.002),
        means_ci95: MeanIntervals::default(),
        truth: None,
        manual_alignment: None,
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
        set_apart: mocban_catalog::SetApart::default(),
        schema: 1,
        conflicts: disputed,
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

/// Returns the boxes of a block with four characters, of which the page shows three whole. Without labels, one of them was
/// found well, one roughly and one not at all.
pub(super) fn block_boxes(name: &str, is_found: bool) -> BlockBoxes {
    let truth = [0.0, 20.0, 40.0, 60.0].map(|left| TrueBox {
        bounds: [left, 0.0, left + 10.0, 10.0],
        is_partial: left == 60.0,
    });
    let found = vec![
        [0.0, 0.0, 10.0, 10.0],
        [20.0, 0.0, 30.0, 6.0],
        [40.0, 0.0, 50.0, 4.0],
        [60.0, 0.0, 70.0, 9.0],
        [90.0, 0.0, 99.0, 10.0],
    ];
    BlockBoxes {
        block: BlockName::new(name).expect("test names are ids"),
        truth: truth.to_vec(),
        found: is_found.then_some(found),
    }
}

/// Returns a report with something in every field: verdicts, a conflict, ground truth, blocks, confidences, attention
/// checks, manual alignments, times and failures.
pub fn full_report() -> Report {
    let mut report = ReportAccumulator::default();
    let mut blocks = BlockSums::default();
    for (block, is_found) in [("block 0", true), ("block 1", false)] {
        blocks.add_boxes(block_boxes(block, is_found));
    }
    for i in 0..36_u32 {
        let verdicts: &[Verdict] = match i % 12 {
            0 => &[Verdict::Pass, Verdict::Fail],
            1 => &[Verdict::Fail],
            2 => &[Verdict::Unsure],
            3 => &[],
            _ => &[Verdict::Pass, Verdict::Pass],
        };
        let mut pair = done(&format!("p{i:02}"), 0.8, verdicts);
        pair.attributes.block = Some(format!("block {}", i / 3));
        pair.stages = Stage::ALL
            .map(|kind| stage(kind, u64::from(10 + i)))
            .to_vec();
        for (k, record) in (0_u32..).zip(&mut pair.metrics) {
            let outcome = &mut record.outcome;
            outcome.scores.iou = 0.7 + f64::from((i * 7 + k * 5) % 10) / 50.0;
            outcome.scores.dice = 2.0 * outcome.scores.iou / (1.0 + outcome.scores.iou);
            outcome.confidence = Some(f64::from(i) / 40.0);
            outcome.threshold_level = 20_000 + 500 * (i as u16);
            if let [given] = &mut record.verdicts[..] {
                given.reason = [Some(Reason::Angle), None][(k % 2) as usize];
            }
        }
        let wrong_until = if i % 2 == 0 { 3 } else { 1 };
        let mut errors = truth(if i < wrong_until { 40.0 } else { 0.5 }, 1.25, 0.9);
        if i % 9 == 5 {
            errors.errors.remove(&ThresholdMetric::Density);
        }
        report.add(&pair, &errors);
        blocks.add(&pair, &errors);
        if i < 4 {
            let errors = ManualErrors::of(f64::from(2 * i), f64::from(i), 0.5);
            report.add_manual_errors(&ThresholdMetric::ALL.map(|metric| (metric, errors)).into());
        }
    }
    report.add(
        &failed("q0", FailureClass::BadInput, "q0.stl is empty"),
        &TruthEvaluation::default(),
    );
    report.add(&pending("q1"), &TruthEvaluation::default());
    report.set_attention_checks(AttentionCheckRates {
        all: Rate::new(18, 22),
        by_kind: BTreeMap::from([
            ("threshold", Rate::new(1, 2)),
            ("turned", Rate::new(17, 20)),
        ]),
        by_reviewer: BTreeMap::from([
            ("lan".to_owned(), Rate::new(1, 5)),
            ("minh".to_owned(), Rate::new(17, 17)),
        ]),
    });
    Report {
        blocks: blocks.finish(),
        ..report.finish()
    }
}
