//! What stages give, as numbers and files on disk, and the hashes that name them.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::steps::StageOutput;
use crate::catalog::MetricResult;
use crate::domain::artifact_role::{CANVAS_PRINT_MASK, canvas_depth_mask};
pub(super) use crate::domain::artifact_role::{DEPTH, PRINT_MASK};
use crate::domain::{
    ArtifactSet, ContentHash, DepthOutcome, MetricOutcome, NormalizeOutcome, RegisterOutcome,
};
use crate::raster::{DepthMap, Grid, Mask, png_grey8, png_grey16, png_mask};
use crate::stages::normalize::Normalized;
use crate::stages::register::Registered;
use crate::store::NewArtifact;

const INK: u8 = 255;
const PAPER: u8 = 0;
const UNKNOWN: u8 = 128;

/// A stage that leaves numbers only.
pub(super) const fn numbers(outcome: String) -> StageOutput {
    StageOutput {
        outcome,
        files: Vec::new(),
        metrics: Vec::new(),
    }
}

/// What is told of a depth map beside its picture.
pub(super) fn depth_outcome(map: &DepthMap) -> DepthOutcome {
    let levels = map.levels.data();
    let seen = levels.iter().filter(|level| **level > 0).count();
    DepthOutcome {
        width: map.levels.width() as u32,
        height: map.levels.height() as u32,
        scale: map.scale.clone(),
        coverage: seen as f64 / levels.len().max(1) as f64,
    }
}

/// The depth stage's output.
pub(super) fn depth(outcome: String, map: &DepthMap) -> StageOutput {
    StageOutput {
        files: vec![png(DEPTH, png_grey16(&map.levels))],
        ..numbers(outcome)
    }
}

/// Ink, paper and the unknown in one picture.
pub(super) fn print_mask(ink: &Mask, known: &Mask) -> Grid<u8> {
    Grid::from_fn(ink.width(), ink.height(), |x, y| {
        match (ink.at(x, y), known.at(x, y)) {
            (true, _) => INK,
            (false, true) => PAPER,
            (false, false) => UNKNOWN,
        }
    })
}

/// The masks as the picture holds them, so that a run that goes on from the file sees what an unbroken one sees.
pub(super) fn from_print_mask(outcome: NormalizeOutcome, grey: &Grid<u8>) -> Normalized {
    Normalized {
        outcome,
        ink: grey.map(|grey| *grey == INK),
        known: grey.map(|grey| *grey != UNKNOWN),
    }
}

/// The normalize stage's output.
pub(super) fn normalized(outcome: String, grey: &Grid<u8>) -> StageOutput {
    StageOutput {
        files: vec![png(PRINT_MASK, png_grey8(grey))],
        ..numbers(outcome)
    }
}

/// The register stage's output.
pub(super) fn registered(
    json: String,
    outcome: RegisterOutcome,
    registered: &Registered,
) -> StageOutput {
    let mut files = vec![png(CANVAS_PRINT_MASK, png_mask(&registered.canvas_print))];
    for canvas in &registered.canvases {
        let role = canvas_depth_mask(canvas.metric);
        files.push(png(&role, png_mask(&canvas.depth)));
    }
    StageOutput {
        outcome: json,
        files,
        metrics: outcome.metrics,
    }
}

fn png(role: &str, bytes: Vec<u8>) -> NewArtifact {
    NewArtifact::new(role, "png", bytes)
}

/// Hash of a stage's result: its numbers and its files, no times.
pub fn result_hash(outcome: &str, files: &ArtifactSet) -> ContentHash {
    let whole = json!({ "outcome": outcome, "files": files });
    ContentHash::of(whole.to_string().as_bytes())
}

/// The metrics with the hashes that verdicts are bound to: over the numbers and the pictures a reviewer sees.
pub(super) fn metric_results(
    metrics: &[MetricOutcome],
    files: &ArtifactSet,
    depth: Option<&ArtifactSet>,
) -> Vec<MetricResult> {
    let hash_of = |files: Option<&ArtifactSet>, role: &str| {
        files
            .and_then(|files| files.get(role))
            .map(|artifact| artifact.hash)
    };
    metrics
        .iter()
        .map(|outcome| {
            let seen = BTreeMap::from([
                ("outcome", judged(outcome)),
                ("depth", json!(hash_of(depth, DEPTH))),
                ("print", json!(hash_of(Some(files), CANVAS_PRINT_MASK))),
                (
                    "mask",
                    json!(hash_of(Some(files), &canvas_depth_mask(outcome.metric))),
                ),
            ]);
            let whole: Value = json!(seen);
            MetricResult {
                outcome: *outcome,
                result_hash: ContentHash::of(whole.to_string().as_bytes()),
            }
        })
        .collect()
}

/// The numbers that a reviewer judges: all but the confidence, which may be calibrated anew under the same alignment.
fn judged(outcome: &MetricOutcome) -> Value {
    let mut numbers = json!(outcome);
    if let Value::Object(fields) = &mut numbers {
        fields.remove("confidence");
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::{INK, PAPER, UNKNOWN, metric_results, print_mask, result_hash};
    use crate::domain::{ArtifactSet, MetricOutcome, ThresholdMetric};
    use crate::raster::Mask;
    use crate::report::test_fixtures;

    #[test]
    fn ink_is_ink_wherever_it_lies() {
        let ink = Mask::from_fn(3, 1, |x, _| x == 0);
        let known = Mask::from_fn(3, 1, |x, _| x == 1);
        assert_eq!(print_mask(&ink, &known).data(), [INK, PAPER, UNKNOWN]);
    }

    #[test]
    fn a_verdict_outlives_another_confidence_but_not_another_alignment() {
        let hash = |change: fn(&mut MetricOutcome)| {
            let mut outcome = test_fixtures::metric(ThresholdMetric::Density, 0.8, &[]).outcome;
            change(&mut outcome);
            metric_results(&[outcome], &ArtifactSet::new(), None)[0].result_hash
        };
        let first = hash(|_| {});
        assert_eq!(first, hash(|outcome| outcome.confidence = Some(0.75)));
        assert_ne!(first, hash(|outcome| outcome.scale += 1e-9));
    }

    #[test]
    fn another_outcome_has_another_hash() {
        let files = ArtifactSet::new();
        assert_eq!(result_hash("{}", &files), result_hash("{}", &files));
        assert_ne!(result_hash("{}", &files), result_hash("[]", &files));
    }
}
