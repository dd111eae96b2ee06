//! An alignment by hand: where the page laid the relief, as a map from the mesh, with how well the masks agree there.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::answer::{BadAnswer, check_event, note};
use super::card::{Card, View};
use super::pictures::{Drawn, SIDE, Subject};
use crate::catalog::{Catalog, CatalogError, ManualAlignment, PairResults};
use crate::domain::{Affine2, ContentHash, Stage};
use crate::raster::{MaskOverlap, warp_mask};
use crate::report::ManualCorrection;
use crate::report::pair_artifacts::{PairArtifacts, PairArtifactsError};
use crate::store::Project;

/// How much larger or smaller than the print a relief may be laid.
const SCALES: std::ops::RangeInclusive<f64> = 0.01..=100.0;

/// Where the page begins.
#[derive(Debug, Serialize)]
pub(super) struct Start {
    /// Pixels of the depth map to pixels of the pictures, as the card shows it.
    view_from_depth: Affine2,
    /// The same as the reviewer laid it before.
    laid: Option<Affine2>,
    /// Pixels of the pictures to the canvas on which the agreement is counted.
    canvas_from_view: Option<Affine2>,
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
    /// Intersection over union on the canvas of the scores.
    pub(super) iou: f64,
    /// Dice coefficient there.
    pub(super) dice: f64,
}

impl From<MaskOverlap> for Agreement {
    fn from(found: MaskOverlap) -> Self {
        Self {
            iou: found.iou,
            dice: found.dice,
        }
    }
}

/// Where the correction of a card begins: at what was shown, or where the reviewer left it before.
pub(super) fn start(card: &Card, drawn: &Drawn, before: Option<&ManualAlignment>) -> Start {
    let view = drawn.subject.view();
    let in_view = |map: &Affine2| view.from_print().after(map);
    let print_from_view = view.from_print().inverse();
    Start {
        view_from_depth: in_view(&card.view.print_from_depth),
        laid: before.map(|made| in_view(&made.print_from_depth)),
        canvas_from_view: print_from_view.map(|map| drawn.subject.canvas.from_print.after(&map)),
    }
}

/// How well the masks of a card agree under a map, counted as the scores of results are.
pub(super) fn agreement(drawn: &Drawn, print_from_depth: &Affine2) -> Agreement {
    let Subject {
        canvas, strokes, ..
    } = &drawn.subject;
    let map = canvas.from_print.after(print_from_depth);
    let (width, height) = (canvas.ink.width(), canvas.ink.height());
    let laid = warp_mask(strokes, &map, width, height);
    laid.overlap(&canvas.ink).into()
}

/// What is told of a correction.
#[derive(Debug, Serialize)]
pub(super) struct Corrected {
    reviewer: String,
    #[serde(flatten)]
    moved: ManualCorrection,
    iou: f64,
    dice: f64,
}

impl Corrected {
    /// Against what the card shows; `None` where one of the two maps is flat.
    pub(super) fn of(card: &Card, made: &ManualAlignment) -> Option<Self> {
        let View {
            print_from_depth,
            depth_px,
            ..
        } = &card.view;
        let moved = ManualCorrection::between(print_from_depth, &made.print_from_depth, *depth_px)?;
        Some(Self {
            reviewer: made.reviewer.clone(),
            moved,
            iou: made.iou,
            dice: made.dice,
        })
    }
}

/// The newest correction by one reviewer of each thing seen, of those that hold.
#[derive(Debug, Default)]
pub(super) struct Corrections(BTreeMap<ContentHash, ManualAlignment>);

impl Corrections {
    /// Reads those that were not taken back.
    ///
    /// # Errors
    /// When the catalog refuses.
    pub(super) async fn read(catalog: &Catalog, reviewer: &str) -> Result<Self, CatalogError> {
        let stored = catalog.manual_alignments().await?.into_iter();
        let ours = stored.filter(|stored| {
            stored.made.reviewer == reviewer
                && stored.holds
                && stored.on_current_depth
                && stored.undone_at.is_none()
        });
        // Oldest first, so that the newest stays.
        Ok(Self(
            ours.map(|stored| (stored.made.seen, stored.made)).collect(),
        ))
    }

    /// The correction of what a card shows.
    pub(super) fn of(&self, card: &Card) -> Option<&ManualAlignment> {
        self.0.get(&card.view.seen())
    }
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
    reviewer: &str,
    print_from_depth: Affine2,
    agreement: &Agreement,
) -> Result<ManualAlignment, PairArtifactsError> {
    let aligned = PairArtifacts::new(project, pair);
    Ok(ManualAlignment {
        event: String::new(),
        pair: card.pair.clone(),
        reviewer: reviewer.to_owned(),
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
