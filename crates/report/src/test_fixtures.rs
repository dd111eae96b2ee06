//! Reports for unit tests, and the rows that they are made of.

use std::collections::BTreeMap;

pub(crate) use mocban_results::test_fixtures::*;

use super::accumulate::ReportAccumulator;
use super::block_accuracy::{BlockBoxes, BlockSums};
use super::model::{MetricRow, Report};
use super::score_bootstrap::MeanIntervals;
use mocban_core::domain::{
    BlockName, FailureClass, Reason, Stage, ThresholdMetric, TrueBox, Verdict,
};
use mocban_results::stats::Rate;
use mocban_results::{AttentionCheckRates, ManualErrors, TruthEvaluation};

/// Returns a row of 587 pairs without verdicts.
pub(crate) fn row(metric: ThresholdMetric, iou: f64, dice: f64) -> MetricRow {
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

/// Returns the sentences of a text that have more than 20 words. A word holds a letter or a digit. The `v.` between two
/// compared metrics ends no sentence.
pub(crate) fn long_sentences(text: &str) -> Vec<String> {
    let text = text.replace(" v. ", " v ");
    let sentences = text.split(". ").flat_map(str::lines);
    let count = |sentence: &&str| {
        let words = sentence.split_whitespace();
        words
            .filter(|word| word.chars().any(char::is_alphanumeric))
            .count()
    };
    let long = sentences.filter(|sentence| count(sentence) > 20);
    long.map(str::to_owned).collect()
}

/// Returns the boxes of a block with four characters, of which the page shows three whole. Without labels, one of them was
/// found well, one roughly and one not at all.
pub(crate) fn block_boxes(name: &str, is_found: bool) -> BlockBoxes {
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
pub(crate) fn full_report() -> Report {
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
