//! Manual alignment: the page places the relief on the print, and the server scores and stores the resulting transform.

use serde::{Deserialize, Serialize};

use super::answer::{InvalidInput, check_note};
use super::item::ReviewItem;
use super::item_images::{IMAGE_SIDE, ItemImages};
use mocban_catalog::ManualAlignment;
use mocban_catalog::check_event;
use mocban_core::domain::Affine2;
use mocban_results::ManualCorrection;

/// Accepted scale of the relief relative to the image.
const SCALES: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Initial state of the editor.
#[derive(Debug, Serialize)]
pub(super) struct EditorStart {
    /// Depth-map pixels to image pixels, as the item shows the result.
    view_from_depth: Affine2,
    /// The map that the reviewer saved before, if any.
    previous: Option<Affine2>,
    /// Image pixels to pixels of the canvas on which the masks are compared.
    canvas_from_view: Option<Affine2>,
}

/// A manual alignment as the page sends it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AlignmentBody {
    /// Id that the page generates for this event. If the page sends the event twice, it is stored once.
    pub(super) event: String,
    /// Id of the item on which the alignment was started.
    pub(super) item: String,
    /// Depth-map pixels to image pixels.
    view_from_depth: Affine2,
    note: Option<String>,
}

/// Returns the initial state of the editor: the alignment of the result, and the reviewer's saved alignment if any.
pub(super) fn start(
    item: &ReviewItem,
    images: &ItemImages,
    previous: Option<&ManualAlignment>,
) -> EditorStart {
    let view = images.view;
    let in_view = |map: &Affine2| view.from_print().after(map);
    let print_from_view = view.from_print().inverse();
    EditorStart {
        view_from_depth: in_view(&item.view.print_from_depth),
        previous: previous.map(|made| in_view(&made.print_from_depth)),
        canvas_from_view: print_from_view.map(|map| images.canvas_from_print.after(&map)),
    }
}

/// A manual alignment as the page shows it.
#[derive(Debug, Serialize)]
pub(super) struct AlignmentSummary {
    reviewer: String,
    /// Difference from the alignment of the result.
    #[serde(flatten)]
    correction: ManualCorrection,
    iou: f64,
    dice: f64,
}

impl AlignmentSummary {
    /// Compares a manual alignment with the alignment that the item shows. Returns `None` if either map is singular.
    pub(super) fn of(item: &ReviewItem, made: &ManualAlignment) -> Option<Self> {
        let found = &item.view.print_from_depth;
        let correction =
            ManualCorrection::between(found, &made.print_from_depth, item.view.depth_px)?;
        Some(Self {
            reviewer: made.reviewer.clone(),
            correction,
            iou: made.iou,
            dice: made.dice,
        })
    }
}

impl AlignmentBody {
    /// Returns the map from depth-map pixels to print pixels.
    ///
    /// # Errors
    /// Returns an error if the event id is not valid, or if the map is singular, not finite, or out of range.
    pub(super) fn print_from_depth(&self, images: &ItemImages) -> Result<Affine2, InvalidInput> {
        check_event(&self.event)?;
        let rows = self.view_from_depth.0;
        let is_finite = rows.as_flattened().iter().all(|n| n.is_finite());
        let [x, y] = rows.map(|row| row[2]);
        let is_near = x.abs().max(y.abs()) <= 1000.0 * IMAGE_SIDE as f64;
        let print_from_view = images.view.from_print().inverse();
        let map = print_from_view.map(|map| map.after(&self.view_from_depth));
        match map {
            Some(map) if is_finite && is_near && SCALES.contains(&map.scale()) => Ok(map),
            Some(_) | None => Err(InvalidInput::Map),
        }
    }

    /// Returns the note, trimmed.
    ///
    /// # Errors
    /// Returns an error if the note is too long.
    pub(super) fn note(&self) -> Result<Option<String>, InvalidInput> {
        check_note(self.note.as_deref())
    }
}
