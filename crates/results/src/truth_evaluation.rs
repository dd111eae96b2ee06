//! The stored results of a pair measured against its ground truth.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::ground_truth::{TruthError, TruthErrors, TruthRecord};
use super::pair_artifacts::{PairArtifacts, PairArtifactsError, group_identical};
use mocban_catalog::PairResults;
use mocban_core::domain::{MetricOutcome, ThresholdMetric};
use mocban_core::raster::{self, DepthMap, Grid, ImageLimits, Mask, warp_mask};
use mocban_store::{Project, read_input};

/// Value of pixels in a tops mask that are a true stroke top.
const TOP: u8 = 255;
/// Value of pixels in a tops mask that are not scored, for example a neighbouring character's stroke or a border line.
const IGNORED: u8 = 128;

/// One pair's errors against ground truth.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TruthEvaluation {
    /// Errors by metric. Empty without usable ground truth.
    pub errors: BTreeMap<ThresholdMetric, TruthErrors>,
    /// Why existing ground truth cannot be used.
    pub problem: Option<String>,
}

/// Why a pair cannot be measured.
#[derive(Debug, thiserror::Error)]
enum EvaluationError {
    #[error(transparent)]
    Truth(#[from] TruthError),
    #[error(transparent)]
    Artifacts(#[from] PairArtifactsError),
}

/// Evaluates pairs against their ground truth on all cores. Returns each pair with its evaluation.
///
/// # Errors
/// Returns an error if the worker task panics or is cancelled.
pub async fn evaluate_pairs(
    project: &Project,
    pairs: Vec<PairResults>,
) -> Result<Vec<(PairResults, TruthEvaluation)>, tokio::task::JoinError> {
    if pairs.iter().all(|pair| pair.truth.is_none()) {
        let none = |pair| (pair, TruthEvaluation::default());
        return Ok(pairs.into_iter().map(none).collect());
    }
    let project = project.clone();
    tokio::task::spawn_blocking(move || {
        let evaluations: Vec<TruthEvaluation> = pairs
            .par_iter()
            .map(|pair| evaluate(&project, pair))
            .collect();
        pairs.into_iter().zip(evaluations).collect()
    })
    .await
}

/// Evaluates a pair against its ground truth. The evaluation is empty if there is no ground truth or no result.
fn evaluate(project: &Project, pair: &PairResults) -> TruthEvaluation {
    let Some(truth) = pair.truth.as_ref().filter(|_| !pair.metrics.is_empty()) else {
        return TruthEvaluation::default();
    };
    match errors_by_metric(project, pair, truth) {
        Ok(errors) => TruthEvaluation {
            errors,
            problem: None,
        },
        Err(error) => TruthEvaluation {
            errors: BTreeMap::new(),
            problem: Some(error.to_string()),
        },
    }
}

fn errors_by_metric(
    project: &Project,
    pair: &PairResults,
    truth: &serde_json::Value,
) -> Result<BTreeMap<ThresholdMetric, TruthErrors>, EvaluationError> {
    let (record, artifacts) = (TruthRecord::read(truth)?, PairArtifacts::new(project, pair));
    let record = match &pair.print_place {
        Some(place) => record.in_crop(place)?,
        None => record,
    };
    let tops = match &record.tops_mask {
        Some(path) => Some(read_tops_and_depth(project, path, &artifacts)?),
        None => None,
    };
    let mut by_metric = BTreeMap::new();
    // Results with the same threshold and alignment have the same errors. Each group is measured once.
    for group in group_identical(&pair.metrics) {
        let outcome = &group[0].outcome;
        let found = artifacts.print_from_mesh(&outcome.print_from_depth)?;
        let iou = tops
            .as_ref()
            .map(|(tops, depth)| tops_iou(depth, outcome, tops));
        let errors = record.measure(&found, iou)?;
        by_metric.extend(group.iter().map(|same| (same.outcome.metric, errors)));
    }
    Ok(by_metric)
}

/// Reads the mask of a pair's true stroke tops, and the depth map to compare with this mask.
fn read_tops_and_depth(
    project: &Project,
    path: &str,
    artifacts: &PairArtifacts<'_>,
) -> Result<(Grid<u8>, DepthMap), EvaluationError> {
    let print = artifacts.print_mask()?;
    let tops = read_tops(project, path)?;
    check_size(&tops, [print.width(), print.height()])?;
    Ok((tops, artifacts.depth()?))
}

/// Reads the grey values of a tops mask, whatever its image format.
fn read_tops(project: &Project, path: &str) -> Result<Grid<u8>, TruthError> {
    let input = project.input(path);
    let refused = |why: String| TruthError::Mask(format!("{}: {why}", input.path().display()));
    let limits = ImageLimits::SUGGESTED;
    let file = read_input(&input, limits.max_bytes, "a constant for masks")
        .map_err(|error| TruthError::Mask(error.to_string()))?;
    let picture =
        raster::decode(&file.bytes, &limits).map_err(|error| refused(error.to_string()))?;
    Ok(picture.rgb.map(|[level, ..]| (level / 257) as u8))
}

/// Warps a metric's depth mask to the print. Returns the mask's intersection over union with the true stroke tops.
pub fn tops_iou(depth: &DepthMap, outcome: &MetricOutcome, tops: &Grid<u8>) -> f64 {
    let mask = depth.stroke_mask(outcome.threshold_level);
    let (width, height) = (tops.width(), tops.height());
    let warped = warp_mask(&mask, &outcome.print_from_depth, width, height);
    mask_iou(&warped, tops).expect("the mask was warped to the size of the tops")
}

/// Returns the intersection over union of a depth mask and the true stroke tops, both in the print's frame, in 0..=1.
///
/// Pixels with the value 128 in the tops mask are ignored. If neither mask has a set pixel among the others, the value
/// is 0.
///
/// # Errors
/// Returns an error if the masks differ in size.
pub fn mask_iou(depth_mask: &Mask, tops: &Grid<u8>) -> Result<f64, TruthError> {
    check_size(tops, [depth_mask.width(), depth_mask.height()])?;
    let (mut both, mut either) = (0_u64, 0_u64);
    for (set, top) in depth_mask.data().iter().zip(tops.data()) {
        if *top == IGNORED {
            continue;
        }
        both += u64::from(*set && *top == TOP);
        either += u64::from(*set || *top == TOP);
    }
    Ok(if either == 0 {
        0.0
    } else {
        both as f64 / either as f64
    })
}

fn check_size(tops: &Grid<u8>, wanted: [usize; 2]) -> Result<(), TruthError> {
    let found = [tops.width(), tops.height()];
    if found == wanted {
        Ok(())
    } else {
        Err(TruthError::MaskSize { found, wanted })
    }
}

#[cfg(test)]
mod tests {
    use super::mask_iou;
    use crate::ground_truth::TruthError;
    use mocban_core::raster::{Grid, Mask};

    #[test]
    fn ignored_pixels_count_for_neither_mask() {
        let tops = Grid::from_vec(4, 1, vec![255, 255, 128, 0]).expect("four values");
        let mask = Mask::from_vec(4, 1, vec![true, false, true, true]).expect("four values");
        assert_eq!(mask_iou(&mask, &tops), Ok(1.0 / 3.0));
        assert_eq!(
            mask_iou(&Mask::new(4, 1, false), &Grid::new(4, 1, 128)),
            Ok(0.0)
        );
        let other = mask_iou(&Mask::new(3, 1, false), &tops);
        assert!(matches!(other, Err(TruthError::MaskSize { .. })));
    }
}
