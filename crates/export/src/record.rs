//! The complete record of a pair, from which every export format takes its fields.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use super::stage_outcomes::StageOutcomes;
use mocban_catalog::{CutOrigin, MetricRecord, PairResults, ReviewerVerdict, StoredAlignment};
use mocban_core::domain::{
    Affine2, ContentHash, DisplacedPart, Failure, FailureClass, HeightFromMesh, JobStatus,
    LengthUnit, PairName, PrintFromMesh, Reason, ReviewOrder, Rigid3, Stage, ThresholdMetric,
    UnixMillis, Verdict,
};
use mocban_results::Consensus;

/// State of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RecordStatus {
    /// Aligned; every number and file exists.
    Done,
    /// It failed, or its files cannot be read; `error` holds the reason.
    Failed,
    /// Not aligned yet.
    Pending,
}

impl RecordStatus {
    /// Returns the state of a job.
    pub(super) const fn of(status: JobStatus) -> Self {
        match status {
            JobStatus::Done => Self::Done,
            JobStatus::Quarantined => Self::Failed,
            JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff => Self::Pending,
        }
    }
}

/// Part of a dataset that a pair belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SplitName {
    /// Pairs to fit a model on.
    Train,
    /// Pairs to choose settings on.
    Validation,
    /// Pairs to measure on.
    Test,
}

impl SplitName {
    /// Returns the name in exports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }
}

/// Everything an export knows about a pair. A value that does not exist is null.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PairRecord {
    /// What all metrics of the pair share.
    #[serde(flatten)]
    pub pair: PairFields,
    /// Results of the selected metrics. Empty if the pair has no result.
    pub metrics: Vec<MetricFields>,
}

/// The fields of a pair that its metrics share.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PairFields {
    /// Id of the pair, in Unicode's composed form.
    pub id: PairName,
    /// The character, as text from the manifest.
    pub character: Option<String>,
    /// Name of the block that the character belongs to.
    pub block: Option<String>,
    /// Label of the character in its block, if the pair was cut from the scan of a whole block.
    pub label: Option<String>,
    /// Edges of the box on the page: left, top, right, bottom.
    #[serde(rename = "box")]
    pub bounds: Option<[f64; 4]>,
    /// Unit of the mesh.
    pub unit: Option<LengthUnit>,
    /// Whether the carved side faces down in the scan.
    pub scanned_face_down: Option<bool>,
    /// Path of the mesh in the catalog: relative to the project or to a named root, or absolute.
    pub mesh: String,
    /// Path of the print in the catalog: relative to the project or to a named root, or absolute.
    pub print: String,
    /// All other columns of the manifest.
    pub meta: Map<String, Value>,
    /// Part of the dataset, if the export was split.
    pub split: Option<SplitName>,
    /// `done`, `failed` or `pending`.
    pub status: RecordStatus,
    /// Class of the failure.
    pub error_class: Option<FailureClass>,
    /// Why the pair failed.
    pub error: Option<String>,
    /// Rigid map (4 x 4, row-major) from mesh coordinates to the right-handed plane frame; z points out of the block.
    pub plane_from_mesh: Option<Rigid3>,
    /// Map (2 x 3) from plane x, y to depth-map pixels; it mirrors, so that the depth map reads like the print.
    pub depth_from_plane: Option<Affine2>,
    /// Map from mesh points to heights over the fitted, possibly curved surface.
    pub height_from_mesh: Option<HeightFromMesh>,
    /// Height of level 1 of the depth map over the fitted surface.
    pub height_min: Option<f64>,
    /// Height between two levels of the depth map.
    pub height_per_level: Option<f64>,
    /// Side of a depth-map pixel.
    pub mesh_unit_per_px: Option<f64>,
    /// Millimetres per mesh unit, if the unit is known.
    pub mm_per_mesh_unit: Option<f64>,
    /// Width and height of the depth map.
    pub depth_size_px: Option<[u32; 2]>,
    /// Grey level that separates ink from background in the print.
    pub threshold_print: Option<f64>,
    /// Whether the print is light on dark, like a rubbing.
    pub light_on_dark: Option<bool>,
    /// EXIF orientation of the print file (2 to 8) that was applied; null if its pixels were upright.
    pub print_orientation: Option<u8>,
    /// Side of the square canvas on which scores are computed.
    pub canvas_px: Option<u32>,
    /// Map (2 x 3) from print pixels to canvas pixels.
    pub canvas_from_print: Option<Affine2>,
    /// Map (2 x 3) from print pixels to pixels of the exported pictures; the identity unless a canvas was requested.
    pub picture_from_print: Option<Affine2>,
    /// Map (3 x 3) from print pixels to page pixels, if the pair was cut from a whole block.
    pub page_from_crop: Option<[[f64; 3]; 3]>,
    /// Map (3 x 4) near the character: rows 1 and 2 give the page pixel of a point [X, Y, Z, 1] of the scan of the block, row
    /// 3 its height over the stroke tops.
    pub page_from_mesh: Option<PrintFromMesh>,
    /// The newest valid manual alignment.
    pub manual_alignment: Option<ManualAlignmentFields>,
    /// The part of a torn print or a cracked block that lies elsewhere than the pose of the rest puts it.
    pub displaced: Option<DisplacedFields>,
    /// BLAKE3 hash of the mesh file.
    pub mesh_hash: Option<ContentHash>,
    /// BLAKE3 hash of the print file.
    pub print_hash: Option<ContentHash>,
    /// Hash of the settings of all stages.
    pub config_hash: Option<ContentHash>,
    /// Computing time of the stages, if times were requested.
    pub seconds: Option<f64>,
}

/// The fields of one metric of a pair.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct MetricFields {
    /// The metric that chose the depth threshold.
    pub metric: ThresholdMetric,
    /// Lowest level of the depth map that counts as stroke.
    pub threshold_level: Option<u16>,
    /// Height of `threshold_level` over the fitted surface: points at or above it are stroke.
    pub threshold_depth: Option<f64>,
    /// Rotation of the depth map onto the print, in (-180, 180], positive clockwise on the screen.
    pub angle_deg: Option<f64>,
    /// Print pixels per depth-map pixel.
    pub scale: Option<f64>,
    /// Offset of the depth map's centre from the centre of the print.
    pub shift_px: Option<[f64; 2]>,
    /// Structural similarity of the canvas masks.
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
    /// Calibrated probability that the alignment is right; null for methods without a confidence.
    pub confidence: Option<f64>,
    /// Score of the best pose minus the score of the best competing pose.
    pub margin: Option<f64>,
    /// Whether the search for scale or threshold ended at a limit of its range.
    pub at_bound: Option<bool>,
    /// Map (3 x 4): rows 1 and 2 give the print pixel of a mesh point [X, Y, Z, 1], row 3 its height over the plane.
    pub print_from_mesh: Option<PrintFromMesh>,
    /// Map (3 x 3) from depth-map pixels to print pixels.
    pub print_from_depth: Option<[[f64; 3]; 3]>,
    /// Consensus of the reviewers on this result; null if nobody judged it.
    pub verdict: Option<Verdict>,
    /// Newest verdict of each reviewer on this result.
    pub verdicts: Vec<ReviewerFields>,
    /// Hash of this result, to which verdicts refer.
    pub result_hash: Option<ContentHash>,
}

/// The newest verdict of one reviewer on a result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ReviewerFields {
    /// Name of the reviewer.
    pub reviewer: String,
    /// The judgement.
    pub verdict: Verdict,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// Whether the reviewer decided between conflicting verdicts.
    pub adjudication: bool,
}

/// A manual alignment of the current mesh and print.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ManualAlignmentFields {
    /// Who made it.
    pub reviewer: String,
    /// When, in milliseconds since 1970-01-01 UTC.
    pub at: UnixMillis,
    /// Map (3 x 4) from a mesh point to print pixel and height.
    pub print_from_mesh: PrintFromMesh,
    /// Map (3 x 3) from depth-map pixel to print pixel. Null if the depth map has changed since the manual alignment.
    pub print_from_depth: Option<[[f64; 3]; 3]>,
    /// Intersection over union of the stroke mask and the ink mask, on the canvas used for scores.
    pub iou: f64,
    /// Dice coefficient of the same masks.
    pub dice: f64,
    /// The reviewer's note.
    pub note: Option<String>,
}

/// A part of a print with a pose of its own.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct DisplacedFields {
    /// Share of the ink on this part, with the strip beside the line that belongs to neither part.
    pub ink_share: f64,
    /// Offset of the middle of its ink from where the pose of the rest puts it, in print pixels.
    pub shift_px: [f64; 2],
    /// Rotation against the rest in degrees, positive clockwise on the screen.
    pub angle_deg: f64,
    /// Unit vector in the print across the line between the parts, towards this part.
    pub normal: [f64; 2],
    /// Pixels x, y of the print are on this part if their product with `normal` is larger than this.
    pub offset_px: f64,
    /// Map (3 x 3) from depth-map pixels to print pixels on this part, found at a low resolution.
    pub print_from_depth: [[f64; 3]; 3],
}

impl From<DisplacedPart> for DisplacedFields {
    fn from(part: DisplacedPart) -> Self {
        Self {
            ink_share: part.ink_share,
            shift_px: part.shift_px,
            angle_deg: part.angle_deg,
            normal: part.normal,
            offset_px: part.offset_px,
            print_from_depth: homogeneous(&part.print_from_depth),
        }
    }
}

impl From<StoredAlignment> for ManualAlignmentFields {
    fn from(stored: StoredAlignment) -> Self {
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

impl From<&ReviewerVerdict> for ReviewerFields {
    fn from(given: &ReviewerVerdict) -> Self {
        Self {
            reviewer: given.reviewer.clone(),
            verdict: given.verdict,
            reason: given.reason,
            adjudication: given.review_order == Some(ReviewOrder::Adjudicate),
        }
    }
}

impl PairRecord {
    /// Returns the record of a pair, with the results of `metrics` if the pair is finished.
    pub(super) fn of(
        pair: &PairResults,
        outcomes: Option<&StageOutcomes>,
        metrics: &[&MetricRecord],
    ) -> Self {
        let metrics = outcomes.into_iter().flat_map(|outcomes| {
            let metrics = metrics.iter();
            metrics.map(|record| MetricFields::of(record, outcomes))
        });
        Self {
            pair: PairFields::of(pair, outcomes),
            metrics: metrics.collect(),
        }
    }

    /// Returns the record of a pair whose result cannot be read.
    pub(super) fn unreadable(pair: &PairResults, why: &Failure) -> Self {
        Self {
            pair: PairFields {
                status: RecordStatus::Failed,
                error_class: Some(why.class),
                error: Some(why.message.clone()),
                ..PairFields::of(pair, None)
            },
            metrics: Vec::new(),
        }
    }
}

impl PairFields {
    fn of(pair: &PairResults, outcomes: Option<&StageOutcomes>) -> Self {
        let attributes = &pair.attributes;
        let plane_from_mesh = outcomes.map(|found| found.fit.plane_from_mesh);
        let scale = outcomes.map(|found| &found.depth.scale);
        let ink = outcomes.and_then(StageOutcomes::ink);
        let unit = scale.and_then(|scale| scale.unit).or(attributes.unit);
        let failure = pair.failure.as_ref().map(|stored| &stored.failure);
        let [fit, normalize, register] =
            [Stage::Fit, Stage::Normalize, Stage::Register].map(|stage| pair.stage(stage));
        Self {
            id: attributes.name.clone(),
            character: attributes.character.clone(),
            block: attributes.block.clone(),
            label: None,
            bounds: None,
            unit: attributes.unit,
            scanned_face_down: attributes.scanned_face_down,
            mesh: attributes.mesh_path.clone(),
            print: attributes.print_path.clone(),
            meta: attributes.meta.clone(),
            split: None,
            status: RecordStatus::of(pair.status),
            error_class: failure.map(|failure| failure.class),
            error: failure.map(|failure| failure.message.clone()),
            plane_from_mesh,
            depth_from_plane: scale.map(|scale| scale.depth_from_plane),
            height_from_mesh: plane_from_mesh
                .zip(scale)
                .map(|(plane, scale)| HeightFromMesh::new(&plane, scale.curvature.as_ref())),
            height_min: scale.map(|scale| scale.height_min),
            height_per_level: scale.map(|scale| scale.height_per_level),
            mesh_unit_per_px: scale.map(|scale| scale.mesh_unit_per_px),
            mm_per_mesh_unit: unit.map(LengthUnit::mm),
            depth_size_px: outcomes.map(|found| [found.depth.width, found.depth.height]),
            threshold_print: ink.map(|ink| ink.threshold_print),
            light_on_dark: ink.map(|ink| ink.light_on_dark),
            print_orientation: outcomes.and_then(|found| found.normalize.print_orientation),
            canvas_px: outcomes.map(|found| found.normalize.canvas_px),
            canvas_from_print: ink.map(|ink| ink.canvas_from_print),
            picture_from_print: outcomes.map(|_| Affine2::IDENTITY),
            page_from_crop: None,
            page_from_mesh: None,
            manual_alignment: None,
            displaced: outcomes.and_then(|found| Some(found.register.displaced?.into())),
            mesh_hash: fit.map(|record| record.mesh_hash),
            print_hash: normalize.and_then(|record| record.print_hash),
            config_hash: register.map(|record| record.fingerprint_hash),
            seconds: None,
        }
    }

    /// Adds from where the pair was cut out of its block.
    pub(super) fn add_origin(&mut self, origin: &CutOrigin) {
        self.label = Some(origin.label.clone());
        self.bounds = Some(origin.bounds);
        self.page_from_crop = origin.maps.map(|maps| maps.page_from_crop);
        self.page_from_mesh = origin.maps.map(|maps| maps.page_from_mesh);
    }
}

impl MetricFields {
    /// Returns the fields of a metric without a result.
    pub(super) fn without_result(metric: ThresholdMetric) -> Self {
        Self {
            metric,
            ..Self::default()
        }
    }

    fn of(record: &MetricRecord, outcomes: &StageOutcomes) -> Self {
        let outcome = &record.outcome;
        let scores = &outcome.scores;
        let print_from_mesh = PrintFromMesh::new(
            &outcome.print_from_depth,
            &outcomes.depth.scale.depth_from_plane,
            &outcomes.fit.plane_from_mesh,
        );
        Self {
            metric: outcome.metric,
            threshold_level: Some(outcome.threshold_level),
            threshold_depth: Some(outcome.threshold_depth),
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
            margin: Some(outcome.margin),
            at_bound: Some(outcome.at_bound),
            print_from_mesh: Some(print_from_mesh),
            print_from_depth: Some(homogeneous(&outcome.print_from_depth)),
            verdict: Consensus::of(record).verdict(),
            verdicts: record.verdicts.iter().map(ReviewerFields::from).collect(),
            result_hash: Some(record.result_hash),
        }
    }
}

/// Returns an affine map as a 3x3 matrix.
const fn homogeneous(map: &Affine2) -> [[f64; 3]; 3] {
    let [first, second] = map.0;
    [first, second, [0.0, 0.0, 1.0]]
}
