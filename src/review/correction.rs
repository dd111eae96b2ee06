//! An alignment by hand: where the page laid the relief, as a map from the mesh, with how well the masks agree there.

use serde::{Deserialize, Serialize};

use super::answer::{BadAnswer, check_event, note};
use super::card::Card;
use super::pictures::{Drawn, SIDE};
use crate::catalog::{HandAlignment, PairResults};
use crate::domain::{Affine2, Stage};
use crate::raster::{Overlap, warp_mask};
use crate::report::aligned::{Aligned, AlignedError};
use crate::store::Project;

/// How much larger or smaller than the print a relief may be laid.
const SCALES: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Where the page begins.
#[derive(Debug, Serialize)]
pub(super) struct Start {
    /// Pixels of the depth map to pixels of the pictures.
    view_from_depth: Affine2,
    /// Size of the depth map in pixels.
    depth_px: [u32; 2],
}

/// An alignment as the page sends it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AlignBody {
    /// The page's number of the act; sent again, it is stored once.
    pub(super) event: String,
    /// The card on which the correction began.
    pub(super) item: String,
    /// Pixels of the depth map to pixels of the pictures.
    view_from_depth: Affine2,
    note: Option<String>,
}

/// How well the masks agree.
#[derive(Debug, Serialize)]
pub(super) struct Agreement {
    /// Intersection over union in the print's frame.
    pub(super) iou: f64,
    /// Dice coefficient there.
    pub(super) dice: f64,
}

impl From<Overlap> for Agreement {
    fn from(found: Overlap) -> Self {
        Self {
            iou: found.iou,
            dice: found.dice,
        }
    }
}

/// Where the correction of a card begins: at what was shown.
pub(super) fn start(card: &Card, drawn: &Drawn) -> Start {
    let view = drawn.subject.view();
    Start {
        view_from_depth: view.from_print().after(&card.view.print_from_depth),
        depth_px: card.view.depth_px,
    }
}

/// How well the masks of a card agree under a map, counted in the print's own pixels.
pub(super) fn agreement(drawn: &Drawn, print_from_depth: &Affine2) -> Agreement {
    let ink = &drawn.subject.print_mask;
    let laid = warp_mask(
        &drawn.subject.strokes,
        print_from_depth,
        ink.width(),
        ink.height(),
    );
    laid.overlap(ink).into()
}

impl AlignBody {
    /// Where the relief lies on the print.
    ///
    /// # Errors
    /// When the map flattens it, is not finite, or throws it far away.
    pub(super) fn print_from_depth(&self, drawn: &Drawn) -> Result<Affine2, BadAnswer> {
        check_event(&self.event)?;
        let is_finite = self
            .view_from_depth
            .0
            .as_flattened()
            .iter()
            .all(|n| n.is_finite());
        let [x, y] = [self.view_from_depth.0[0][2], self.view_from_depth.0[1][2]];
        let is_near = x.abs().max(y.abs()) <= 1000.0 * SIDE as f64;
        let print_from_view = drawn.subject.view().from_print().inverse();
        let map = print_from_view.map(|map| map.after(&self.view_from_depth));
        match map {
            Some(map) if is_finite && is_near && SCALES.contains(&map.scale()) => Ok(map),
            Some(_) | None => Err(BadAnswer::Map),
        }
    }

    /// The note, checked.
    ///
    /// # Errors
    /// When it is too long.
    pub(super) fn note(&self) -> Result<Option<String>, BadAnswer> {
        note(self.note.as_deref())
    }
}

/// What is stored of an alignment by hand.
///
/// # Errors
/// When the pair's results cannot be read.
pub(super) fn made(
    project: &Project,
    pair: &PairResults,
    card: &Card,
    reader: &str,
    print_from_depth: Affine2,
    agreement: &Agreement,
) -> Result<HandAlignment, AlignedError> {
    let aligned = Aligned::new(project, pair);
    Ok(HandAlignment {
        event: String::new(),
        pair: card.pair.clone(),
        reader: reader.to_owned(),
        print_from_depth,
        print_from_mesh: aligned.print_from_mesh(&print_from_depth)?,
        mesh_hash: aligned.stage(Stage::Fit)?.mesh_hash,
        print_hash: card.view.print_hash,
        depth_hash: card.view.depth_hash,
        seen: card.view.seen(),
        iou: agreement.iou,
        dice: agreement.dice,
        note: None,
    })
}
