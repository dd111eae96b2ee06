//! Result of a stage: numbers and files with the hashes that identify them, or an error.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use mocban_catalog::MetricResult;
use mocban_core::domain::artifact_role::{CANVAS_PRINT_MASK, DEPTH, canvas_depth_mask};
use mocban_core::domain::{
    ArtifactSet, ContentHash, DepthOutcome, Failure, FailureClass, MetricOutcome, Stage,
};
use mocban_core::raster::DepthMap;
use mocban_store::{ArtifactError, NewArtifact};

/// What a stage returns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PairStageOutput {
    /// The numbers as JSON.
    pub(super) outcome: Value,
    pub(super) files: Vec<NewArtifact>,
    /// The metrics, for the last stage.
    pub(super) metrics: Vec<MetricOutcome>,
}

/// Why a stage returned nothing.
#[derive(Debug)]
pub(super) enum PairStageError {
    /// The result of an earlier stage is missing, or belongs to other inputs. The pair runs again from that stage on.
    RerunFrom(Stage),
    /// An object store failed, which is not the fault of the pair.
    Store(ArtifactError),
    /// The stage failed.
    Failed {
        failure: Failure,
        /// Whether a retry may succeed.
        is_transient: bool,
    },
}

impl PairStageError {
    /// A failure that a retry does not change.
    pub(super) fn failed(class: FailureClass, message: impl Into<String>) -> Self {
        Self::Failed {
            failure: Failure::new(class, message),
            is_transient: false,
        }
    }
}

impl PairStageOutput {
    /// Numbers without files.
    pub(super) const fn numbers(outcome: Value) -> Self {
        Self {
            outcome,
            files: Vec::new(),
            metrics: Vec::new(),
        }
    }
}

/// Returns a PNG image with its role.
pub(super) fn png(role: &str, bytes: Vec<u8>) -> NewArtifact {
    NewArtifact::new(role, "png", bytes)
}

/// Returns the numbers that are stored beside a depth map's image.
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

/// Returns the hash of a stage's numbers and files. Times are not included.
pub fn result_hash(outcome: &str, files: &ArtifactSet) -> ContentHash {
    let mut files = files.clone();
    for artifact in files.values_mut() {
        artifact.pack = None;
    }
    let result = json!({ "outcome": outcome, "files": files });
    hash_of_json(&result)
}

/// Returns the hash of a value's compact JSON text.
fn hash_of_json(value: &Value) -> ContentHash {
    ContentHash::of(&serde_json::to_vec(value).expect("a JSON value has a JSON text"))
}

/// Adds a hash to each metric. The hash covers the numbers and images that a reviewer sees. Verdicts refer to it.
pub fn metric_results(
    metrics: &[MetricOutcome],
    files: &ArtifactSet,
    depth: Option<&ArtifactSet>,
) -> Vec<MetricResult> {
    let hash_of = |files: Option<&ArtifactSet>, role: &str| {
        files
            .and_then(|files| files.get(role))
            .map(|artifact| artifact.hash)
    };
    let with_hash = |outcome: &MetricOutcome| {
        let mask = canvas_depth_mask(outcome.metric);
        let judged = BTreeMap::from([
            ("outcome", without_confidence(outcome)),
            ("depth", json!(hash_of(depth, DEPTH))),
            ("print", json!(hash_of(Some(files), CANVAS_PRINT_MASK))),
            ("mask", json!(hash_of(Some(files), &mask))),
        ]);
        MetricResult {
            outcome: *outcome,
            result_hash: hash_of_json(&json!(judged)),
        }
    };
    metrics.iter().map(with_hash).collect()
}

/// Returns the numbers that a reviewer judges: all except the confidence. Verdicts therefore stay valid if the
/// confidence is calibrated anew.
fn without_confidence(outcome: &MetricOutcome) -> Value {
    let mut numbers = json!(outcome);
    if let Value::Object(fields) = &mut numbers {
        fields.remove("confidence");
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::{metric_results, result_hash};
    use crate::tests::values;
    use mocban_core::domain::{ArtifactSet, MetricOutcome, ThresholdMetric};

    #[test]
    fn a_verdict_outlives_another_confidence_but_not_another_alignment() {
        let hash = |change: fn(&mut MetricOutcome)| {
            let mut outcome = values::metric_outcome(ThresholdMetric::Density);
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
