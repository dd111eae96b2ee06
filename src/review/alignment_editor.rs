//! Manual alignment: the page places the relief on the print, and the server scores and stores the resulting map.

use serde::{Deserialize, Serialize};

use super::answer::{InvalidInput, check_event, check_note};
use super::item::{ItemView, ReviewItem};
use super::item_images::{IMAGE_SIDE, ItemImages, ItemInputs};
use crate::catalog::{ManualAlignment, PairResults};
use crate::domain::{Affine2, Stage};
use crate::raster::{MaskOverlap, warp_mask};
use crate::report::ManualCorrection;
use crate::report::pair_artifacts::{PairArtifacts, PairArtifactsError};
use crate::store::Project;

/// Accepted scale of the relief relative to the image.
const SCALES: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Initial state of the editor.
#[derive(Debug, Serialize)]
pub(super) struct EditorStart {
    /// Depth-map pixels to image pixels, as the item shows the result.
    view_from_depth: Affine2,
    /// The same map as the reviewer saved it before, if so.
    previous: Option<Affine2>,
    /// Image pixels to pixels of the canvas on which the masks are compared.
    canvas_from_view: Option<Affine2>,
}

/// A manual alignment as the page sends it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AlignmentBody {
    /// Id of the event, made by the page. An event that is sent again is stored once.
    pub(super) event: String,
    /// Id of the item on which the alignment was started.
    pub(super) item: String,
    /// Depth-map pixels to image pixels.
    view_from_depth: Affine2,
    note: Option<String>,
}

/// How well the two masks overlap on the canvas.
#[derive(Debug, Serialize)]
pub(super) struct MaskScores {
    /// Intersection over union, 0 to 1.
    pub(super) iou: f64,
    /// Dice coefficient, 0 to 1.
    pub(super) dice: f64,
}

impl From<MaskOverlap> for MaskScores {
    fn from(found: MaskOverlap) -> Self {
        Self {
            iou: found.iou,
            dice: found.dice,
        }
    }
}

/// Returns where the editor starts: at the result, and where the reviewer left it before.
pub(super) fn start(
    item: &ReviewItem,
    images: &ItemImages,
    previous: Option<&ManualAlignment>,
) -> EditorStart {
    let view = images.inputs.view();
    let in_view = |map: &Affine2| view.from_print().after(map);
    let print_from_view = view.from_print().inverse();
    EditorStart {
        view_from_depth: in_view(&item.view.print_from_depth),
        previous: previous.map(|made| in_view(&made.print_from_depth)),
        canvas_from_view: print_from_view.map(|map| images.inputs.canvas.from_print.after(&map)),
    }
}

/// Computes the overlap of an item's masks under a map, in the same way as the scores of results.
pub(super) fn mask_scores(images: &ItemImages, print_from_depth: &Affine2) -> MaskScores {
    let ItemInputs {
        canvas, strokes, ..
    } = &images.inputs;
    let map = canvas.from_print.after(print_from_depth);
    let (width, height) = (canvas.print_mask.width(), canvas.print_mask.height());
    let warped = warp_mask(strokes, &map, width, height);
    warped.overlap(&canvas.print_mask).into()
}

/// A manual alignment as the page shows it.
#[derive(Debug, Serialize)]
pub(super) struct AlignmentSummary {
    reviewer: String,
    /// Rotation against the result, degrees clockwise on the screen.
    rotation_deg: f64,
    /// Shift of the relief's centre against the result, print pixels.
    shift_px: [f64; 2],
    /// Scale relative to the result.
    scale: f64,
    mirrored: bool,
    iou: f64,
    dice: f64,
}

impl AlignmentSummary {
    /// Compares a manual alignment with what the item shows; `None` if one of the two maps is singular.
    pub(super) fn of(item: &ReviewItem, made: &ManualAlignment) -> Option<Self> {
        let ItemView {
            print_from_depth,
            depth_px,
            ..
        } = &item.view;
        let change =
            ManualCorrection::between(print_from_depth, &made.print_from_depth, *depth_px)?;
        Some(Self {
            reviewer: made.reviewer.clone(),
            rotation_deg: change.turned_deg,
            shift_px: change.shifted_px,
            scale: change.scaled,
            mirrored: change.mirrored,
            iou: made.iou,
            dice: made.dice,
        })
    }
}

impl AlignmentBody {
    /// Returns the map from depth-map pixels to print pixels.
    ///
    /// # Errors
    /// When the map is singular, not finite, or places the relief far outside the print.
    pub(super) fn print_from_depth(&self, images: &ItemImages) -> Result<Affine2, InvalidInput> {
        check_event(&self.event)?;
        let is_finite = self
            .view_from_depth
            .0
            .as_flattened()
            .iter()
            .all(|n| n.is_finite());
        let [x, y] = [self.view_from_depth.0[0][2], self.view_from_depth.0[1][2]];
        let is_near = x.abs().max(y.abs()) <= 1000.0 * IMAGE_SIDE as f64;
        let print_from_view = images.inputs.view().from_print().inverse();
        let map = print_from_view.map(|map| map.after(&self.view_from_depth));
        match map {
            Some(map) if is_finite && is_near && SCALES.contains(&map.scale()) => Ok(map),
            Some(_) | None => Err(InvalidInput::Map),
        }
    }

    /// Returns the note, trimmed.
    ///
    /// # Errors
    /// When it is too long.
    pub(super) fn note(&self) -> Result<Option<String>, InvalidInput> {
        check_note(self.note.as_deref())
    }
}

/// Builds the record of a manual alignment, without its event and note.
///
/// # Errors
/// When the pair's results cannot be read.
pub(super) fn to_record(
    project: &Project,
    pair: &PairResults,
    item: &ReviewItem,
    reviewer: &str,
    print_from_depth: Affine2,
    scores: &MaskScores,
) -> Result<ManualAlignment, PairArtifactsError> {
    let aligned = PairArtifacts::new(project, pair);
    Ok(ManualAlignment {
        event: String::new(),
        pair: item.pair.clone(),
        reviewer: reviewer.to_owned(),
        print_from_depth,
        print_from_mesh: aligned.print_from_mesh(&print_from_depth)?,
        mesh_hash: aligned.stage(Stage::Fit)?.mesh_hash,
        print_hash: item.view.print_hash,
        depth_hash: item.view.depth_hash,
        seen: item.view.hash(),
        iou: scores.iou,
        dice: scores.dice,
        note: None,
    })
}
