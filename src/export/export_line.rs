//! One line of `pairs.jsonl`: the result of one pair and metric.

use std::collections::BTreeMap;

use serde::Serialize;

use super::pair_files::Files;
use crate::catalog::{Catalog, CatalogError, MetricRecord, PairResults, StoredAlignment};
use crate::domain::{
    Affine2, ContentHash, DepthOutcome, Failure, FailureClass, FitOutcome, InkHypothesis,
    JobStatus, MetricOutcome, NormalizeOutcome, PairName, PrintFromMesh, RegisterOutcome, Rigid3,
    Stage, ThresholdMetric, UnixMillis, Verdict,
};
use crate::report::Consensus;
use crate::report::pair_artifacts::{PairArtifacts, PairArtifactsError};

/// State of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LineStatus {
    /// Aligned; every number and file exists.
    Done,
    /// It failed, or its files cannot be read; `error` holds the reason.
    Failed,
    /// Not aligned yet.
    Pending,
}

/// A line. A value that does not exist is null; field names are fixed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportLine {
    /// The pair's id.
    pub id: PairName,
    /// The metric that chose the depth threshold.
    pub metric: ThresholdMetric,
    /// State of the pair.
    pub status: LineStatus,
    /// Class of the failure.
    pub error_class: Option<FailureClass>,
    /// Why it failed.
    pub error: Option<String>,
    /// The numbers of the alignment.
    #[serde(flatten)]
    pub numbers: Numbers,
    /// The maps between the frames.
    #[serde(flatten)]
    pub maps: Maps,
    /// Files below the export folder.
    pub files: Option<Files>,
    /// Hashes of the inputs and of the result.
    #[serde(flatten)]
    pub hashes: Hashes,
    /// The consensus of the reviewers on this result.
    pub verdict: Option<Verdict>,
    /// The newest valid manual alignment, where there is one.
    pub manual_alignment: Option<LineManualAlignment>,
    /// Computing time of the pair's stages in seconds, if times were requested.
    pub seconds: Option<f64>,
}

/// Threshold, pose and scores.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Numbers {
    /// Depth threshold: pixels at or above this height over the fitted surface, in mesh units, count as stroke.
    pub threshold_depth: Option<f64>,
    /// Grey level 0..=65535 that separates ink from background.
    pub threshold_print: Option<f64>,
    /// Clockwise rotation on the screen from depth map to print, in degrees in (-180, 180].
    pub angle_deg: Option<f64>,
    /// Print pixels per depth-map pixel.
    pub scale: Option<f64>,
    /// Offset of the depth map's centre from the print's, print pixels.
    pub shift_px: Option<[f64; 2]>,
    /// Structural similarity on the canvas.
    pub ssim: Option<f64>,
    /// Structural similarity without the luminance factor.
    pub nl_ssim: Option<f64>,
    /// Intersection over union of the canvas masks by pixel.
    pub iou: Option<f64>,
    /// Intersection over union of their bounding boxes.
    pub iou_box: Option<f64>,
    /// Dice coefficient of the canvas masks by pixel.
    pub dice: Option<f64>,
    /// Share of the canvas that is ink.
    pub density_print: Option<f64>,
    /// Share of the canvas that is stroke.
    pub density_depth: Option<f64>,
    /// Number of pieces of missing ink and of missing wood.
    pub disagreements: Option<u32>,
    /// Area of the stroke tops without ink near them, as a share of the mask's area.
    pub missing_ink: Option<f64>,
    /// Area of the ink without wood near it, as a share of the ink's area.
    pub missing_wood: Option<f64>,
    /// Calibrated probability that the alignment is right, 0..=1; null for methods without a confidence.
    pub confidence: Option<f64>,
}

/// Maps between frames, row-major.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Maps {
    /// 3x4: mesh point to print pixel and height.
    pub print_from_mesh: Option<PrintFromMesh>,
    /// 4x4: mesh point to plane frame.
    pub plane_from_mesh: Option<Rigid3>,
    /// 2x3: plane x, y to depth-map pixel.
    pub depth_from_plane: Option<Affine2>,
    /// 3x3: depth-map pixel to print pixel.
    pub print_from_depth: Option<[[f64; 3]; 3]>,
}

/// Hashes of a result and of what it was made from.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Hashes {
    /// Of the mesh file's content.
    pub mesh_hash: Option<ContentHash>,
    /// Of the print file's content.
    pub print_hash: Option<ContentHash>,
    /// Of this metric's result.
    pub result_hash: Option<ContentHash>,
    /// Of the settings of all stages.
    pub config_hash: Option<ContentHash>,
}

/// A manual alignment of the current mesh and print.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LineManualAlignment {
    /// Who made it.
    pub reviewer: String,
    /// When.
    pub at: UnixMillis,
    /// 3x4: mesh point to print pixel and height.
    pub print_from_mesh: PrintFromMesh,
    /// 3x3: depth-map pixel to print pixel. Null if the depth map has changed since the manual alignment.
    pub print_from_depth: Option<[[f64; 3]; 3]>,
    /// Intersection over union of the stroke mask and the ink mask, on the canvas used for scores.
    pub iou: f64,
    /// Dice coefficient of the same masks.
    pub dice: f64,
    /// The reviewer's note.
    pub note: Option<String>,
}

impl LineManualAlignment {
    fn of(stored: StoredAlignment) -> Self {
        let made = stored.made;
        let print_from_depth = homogeneous(&made.print_from_depth);
        Self {
            reviewer: made.reviewer,
            at: stored.at,
            print_from_mesh: made.print_from_mesh,
            print_from_depth: stored.on_current_depth.then_some(print_from_depth),
            iou: made.iou,
            dice: made.dice,
            note: made.note,
        }
    }
}

/// Returns the newest manual alignment of each pair. Alignments that were undone or are outdated are skipped.
///
/// # Errors
/// Returns an error if the catalog cannot be read.
pub(super) async fn newest_manual_alignments(
    catalog: &Catalog,
) -> Result<BTreeMap<PairName, LineManualAlignment>, CatalogError> {
    let newest = catalog.newest_manual_alignments().await?.into_iter();
    Ok(newest
        .map(|(pair, stored)| (pair, LineManualAlignment::of(stored)))
        .collect())
}

/// The outcomes of a finished pair that all its lines share.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outcomes {
    fit: FitOutcome,
    depth: DepthOutcome,
    /// Interpretation of the print that was used.
    ink: Option<InkHypothesis>,
}

impl Outcomes {
    /// Parses the stored results.
    pub(super) fn read(artifacts: &PairArtifacts<'_>) -> Result<Self, PairArtifactsError> {
        let normalize: NormalizeOutcome = artifacts.outcome(Stage::Normalize)?;
        let register: RegisterOutcome = artifacts.outcome(Stage::Register)?;
        Ok(Self {
            fit: artifacts.outcome(Stage::Fit)?,
            depth: artifacts.outcome(Stage::Depth)?,
            ink: normalize.inks.get(register.ink).copied(),
        })
    }
}

impl ExportLine {
    /// Returns the line of a pair without a result.
    pub(super) fn without_result(pair: &PairResults, metric: ThresholdMetric) -> Self {
        let failure = pair.failure.as_ref().map(|stored| &stored.failure);
        Self {
            id: pair.attributes.name.clone(),
            metric,
            status: status(pair.status),
            error_class: failure.map(|failure| failure.class),
            error: failure.map(|failure| failure.message.clone()),
            numbers: Numbers::default(),
            maps: Maps::default(),
            files: None,
            hashes: hashes(pair),
            verdict: None,
            manual_alignment: None,
            seconds: None,
        }
    }

    /// Returns the line of a pair whose result cannot be read.
    pub(super) fn unreadable(pair: &PairResults, metric: ThresholdMetric, why: &Failure) -> Self {
        Self {
            status: LineStatus::Failed,
            error_class: Some(why.class),
            error: Some(why.message.clone()),
            ..Self::without_result(pair, metric)
        }
    }

    /// Returns the line of a result.
    pub(super) fn of(
        pair: &PairResults,
        record: &MetricRecord,
        outcomes: &Outcomes,
        files: Files,
    ) -> Self {
        Self {
            numbers: Numbers::of(&record.outcome, outcomes.ink.as_ref()),
            maps: Maps::of(&record.outcome, outcomes),
            files: Some(files),
            hashes: Hashes {
                result_hash: Some(record.result_hash),
                ..hashes(pair)
            },
            verdict: Consensus::of(record).verdict(),
            ..Self::without_result(pair, record.outcome.metric)
        }
    }
}

impl Numbers {
    fn of(outcome: &MetricOutcome, ink: Option<&InkHypothesis>) -> Self {
        let scores = &outcome.scores;
        Self {
            threshold_depth: Some(outcome.threshold_depth),
            threshold_print: ink.map(|ink| ink.threshold_print),
            angle_deg: Some(outcome.angle_deg),
            scale: Some(outcome.scale),
            shift_px: Some(outcome.shift_px),
            ssim: Some(scores.ssim),
            nl_ssim: Some(scores.nl_ssim),
            iou: Some(scores.iou),
            iou_box: Some(scores.iou_box),
            dice: Some(scores.dice),
            density_print: Some(scores.density_print),
            density_depth: Some(scores.density_depth),
            disagreements: Some(outcome.disagreement.pieces),
            missing_ink: Some(outcome.disagreement.missing_ink),
            missing_wood: Some(outcome.disagreement.missing_wood),
            confidence: outcome.confidence,
        }
    }
}

impl Maps {
    fn of(outcome: &MetricOutcome, outcomes: &Outcomes) -> Self {
        let plane_from_mesh = outcomes.fit.plane_from_mesh;
        let depth_from_plane = outcomes.depth.scale.depth_from_plane;
        let print_from_depth = &outcome.print_from_depth;
        let print_from_mesh =
            PrintFromMesh::new(print_from_depth, &depth_from_plane, &plane_from_mesh);
        Self {
            print_from_mesh: Some(print_from_mesh),
            plane_from_mesh: Some(plane_from_mesh),
            depth_from_plane: Some(depth_from_plane),
            print_from_depth: Some(homogeneous(print_from_depth)),
        }
    }
}

/// Returns an affine map as a 3x3 matrix.
const fn homogeneous(map: &Affine2) -> [[f64; 3]; 3] {
    let [first, second] = map.0;
    [first, second, [0.0, 0.0, 1.0]]
}

/// Returns the hashes that all lines of a pair share.
fn hashes(pair: &PairResults) -> Hashes {
    let [fit, normalize, register] =
        [Stage::Fit, Stage::Normalize, Stage::Register].map(|stage| pair.stage(stage));
    Hashes {
        mesh_hash: fit.map(|record| record.mesh_hash),
        print_hash: normalize.and_then(|record| record.print_hash),
        result_hash: None,
        config_hash: register.map(|record| record.fingerprint_hash),
    }
}

const fn status(status: JobStatus) -> LineStatus {
    match status {
        JobStatus::Done => LineStatus::Done,
        JobStatus::Quarantined => LineStatus::Failed,
        JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff => LineStatus::Pending,
    }
}

#[cfg(test)]
mod tests {
    use super::ExportLine;
    use crate::domain::{Failure, FailureClass, ThresholdMetric};
    use crate::report::test_fixtures;
    use serde_json::{Value, json};

    /// The fields in the order the interface gives them.
    const FIELDS: [&str; 33] = [
        "id",
        "metric",
        "status",
        "error_class",
        "error",
        "threshold_depth",
        "threshold_print",
        "angle_deg",
        "scale",
        "shift_px",
        "ssim",
        "nl_ssim",
        "iou",
        "iou_box",
        "dice",
        "density_print",
        "density_depth",
        "disagreements",
        "missing_ink",
        "missing_wood",
        "confidence",
        "print_from_mesh",
        "plane_from_mesh",
        "depth_from_plane",
        "print_from_depth",
        "files",
        "mesh_hash",
        "print_hash",
        "result_hash",
        "config_hash",
        "verdict",
        "manual_alignment",
        "seconds",
    ];

    #[test]
    fn failed_pair_has_every_field_and_nulls() {
        let pair = test_fixtures::failed("a", FailureClass::BadInput, "a.stl is empty");
        let line = ExportLine::without_result(&pair, ThresholdMetric::Density);
        let text = serde_json::to_string(&line).expect("a line is JSON");
        let value: Value = serde_json::from_str(&text).expect("a line is JSON");
        let mut place = 0;
        for field in FIELDS {
            let at = text.find(&format!("\"{field}\":")).expect(field);
            assert!(at >= place, "{field} is out of order");
            place = at;
        }
        assert_eq!(value.as_object().expect("an object").len(), FIELDS.len());
        assert_eq!(value["status"], "failed");
        assert_eq!(value["error_class"], "bad_input");
        assert_eq!(value["error"], "a.stl is empty");
        assert!(FIELDS[5..].iter().all(|field| value[field] == Value::Null));
    }

    #[test]
    fn unfinished_pair_is_pending_and_damaged_one_failed() {
        let metric = ThresholdMetric::Density;
        let pending = ExportLine::without_result(&test_fixtures::pending("a"), metric);
        assert_eq!(json!(pending.status), "pending");
        let gone = Failure::new(FailureClass::Io, "depth.png is gone");
        let damaged = ExportLine::unreadable(&test_fixtures::done("a", 0.8, &[]), metric, &gone);
        assert_eq!(
            (json!(damaged.status), damaged.error.as_deref()),
            (json!("failed"), Some("depth.png is gone"))
        );
    }
}
