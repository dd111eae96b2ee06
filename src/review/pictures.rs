//! Pictures of a card as PNG, drawn once and kept in memory for a while. What is planted goes the same way as the rest.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use tokio::sync::{Mutex, OnceCell};

use super::card::Card;
use crate::catalog::{Catalog, CatalogError, PairResults};
use crate::domain::{Affine2, Stage};
use crate::export::pictures::{PrintView, shaded};
use crate::export::{SourcePrint, SourcePrintError};
use crate::raster::{self, DepthMap, Mask, png_mask, png_rgb8};
use crate::report::pair_artifacts::{PairArtifacts, PairArtifactsError};
use crate::store::Project;

/// Longest side of a picture in pixels.
pub(super) const SIDE: usize = 640;
/// Cards whose pictures are kept.
const KEPT: usize = 48;

/// One of the pictures of a card.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layer {
    /// The print.
    Print,
    /// Its ink.
    PrintMask,
    /// The relief laid on the print, in raking light.
    Relief,
    /// Its strokes laid on the print.
    DepthMask,
    /// The relief in its own frame, for the correction by hand.
    OwnRelief,
    /// Its strokes in that frame.
    OwnMask,
    /// The ink on the canvas of the scores.
    CanvasInk,
}

impl Layer {
    /// Every layer.
    pub(super) const ALL: [Self; 7] = [
        Self::Print,
        Self::PrintMask,
        Self::Relief,
        Self::DepthMask,
        Self::OwnRelief,
        Self::OwnMask,
        Self::CanvasInk,
    ];

    /// Name in the picture's address.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Print => "print",
            Self::PrintMask => "print-mask",
            Self::Relief => "relief",
            Self::DepthMask => "depth-mask",
            Self::OwnRelief => "own-relief",
            Self::OwnMask => "own-mask",
            Self::CanvasInk => "canvas-ink",
        }
    }

    /// The layer of a name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layer| layer.name() == name)
    }
}

/// Why a card cannot be shown.
#[derive(Debug, thiserror::Error)]
pub(super) enum PictureError {
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// A result or artifact cannot be read.
    #[error(transparent)]
    PairArtifacts(#[from] PairArtifactsError),
    /// The print cannot be read.
    #[error(transparent)]
    Print(#[from] SourcePrintError),
    /// Another result has come since.
    #[error("this pair was aligned anew meanwhile; reload the page")]
    Gone,
    /// A thread was lost.
    #[error("drawing stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

/// Where the scores of a pair are counted.
#[derive(Debug)]
pub(super) struct Canvas {
    pub(super) ink: Mask,
    pub(super) from_print: Affine2,
}

impl Canvas {
    fn read(aligned: &PairArtifacts<'_>) -> Result<Self, PictureError> {
        Ok(Self {
            ink: aligned.canvas_print_mask()?,
            from_print: aligned.canvas_from_print()?,
        })
    }
}

/// All that a card shows, read from the project.
#[derive(Debug)]
pub(super) struct Subject {
    pub(super) print: SourcePrint,
    print_mask: Mask,
    pub(super) canvas: Canvas,
    pub(super) depth: DepthMap,
    pub(super) strokes: Mask,
}

impl Subject {
    fn read(
        project: &Project,
        pair: &PairResults,
        card: &Card,
        limits: &raster::ImageLimits,
    ) -> Result<Self, PictureError> {
        let aligned = PairArtifacts::new(project, pair);
        let hashes = (
            aligned.stage(Stage::Depth)?.result_hash,
            aligned.stage(Stage::Normalize)?.print_hash,
        );
        if hashes != (card.view.depth_hash, Some(card.view.print_hash)) {
            return Err(PictureError::Gone);
        }
        let depth = aligned.depth()?;
        Ok(Self {
            print: SourcePrint::read(project, pair, limits)?,
            print_mask: aligned.print_mask()?,
            canvas: Canvas::read(&aligned)?,
            strokes: depth.stroke_mask(card.view.level),
            depth,
        })
    }

    /// The print's frame as it is shown.
    pub(super) fn view(&self) -> PrintView {
        PrintView::of_side(&self.print.picture, SIDE)
    }
}

/// The encoded pictures of a card, and what they were drawn from.
#[derive(Debug)]
pub(super) struct Drawn {
    pub(super) subject: Subject,
    print: Vec<u8>,
    print_mask: Vec<u8>,
    relief: Vec<u8>,
    depth_mask: Vec<u8>,
}

impl Drawn {
    fn of(subject: Subject, print_from_depth: &Affine2) -> Self {
        let view = subject.view();
        Self {
            print: png_rgb8(&view.print(&subject.print.picture)),
            print_mask: png_mask(&view.mask(&subject.print_mask, &Affine2::IDENTITY)),
            relief: png_rgb8(&view.relief(&subject.depth, print_from_depth)),
            depth_mask: png_mask(&view.mask(&subject.strokes, print_from_depth)),
            subject,
        }
    }

    /// A picture as PNG. Those of other frames are drawn when they are asked for: few cards are corrected.
    pub(super) fn layer(&self, wanted: Layer) -> Vec<u8> {
        match wanted {
            Layer::Print => self.print.clone(),
            Layer::PrintMask => self.print_mask.clone(),
            Layer::Relief => self.relief.clone(),
            Layer::DepthMask => self.depth_mask.clone(),
            Layer::OwnRelief => {
                let depth = &self.subject.depth;
                let slope = depth.scale.height_per_level / depth.scale.mesh_unit_per_px;
                png_rgb8(&shaded(&depth.levels, slope))
            }
            Layer::OwnMask => png_mask(&self.subject.strokes),
            Layer::CanvasInk => png_mask(&self.subject.canvas.ink),
        }
    }
}

/// Draws cards and keeps the last ones.
#[derive(Debug)]
pub(super) struct Pictures {
    catalog: Catalog,
    project: Project,
    limits: raster::ImageLimits,
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    drawn: BTreeMap<String, Arc<OnceCell<Arc<Drawn>>>>,
    /// Oldest first.
    order: VecDeque<String>,
}

impl Kept {
    /// The place of a card; the oldest makes room.
    fn place(&mut self, id: &str) -> Arc<OnceCell<Arc<Drawn>>> {
        if !self.drawn.contains_key(id) {
            self.order.push_back(id.to_owned());
            if self.order.len() > KEPT
                && let Some(oldest) = self.order.pop_front()
            {
                self.drawn.remove(&oldest);
            }
        }
        Arc::clone(self.drawn.entry(id.to_owned()).or_default())
    }
}

impl Pictures {
    pub(super) fn new(catalog: Catalog, project: Project, limits: raster::ImageLimits) -> Self {
        Self {
            catalog,
            project,
            limits,
            kept: Mutex::default(),
        }
    }

    /// The pictures of a card, drawn now or before. Who asks while it is being drawn waits for the same.
    ///
    /// # Errors
    /// When something of the pair cannot be read, or another result has come.
    pub(super) async fn of(&self, card: &Arc<Card>) -> Result<Arc<Drawn>, PictureError> {
        let place = self.kept.lock().await.place(&card.id);
        let drawn = place.get_or_try_init(|| self.draw(card)).await?;
        Ok(Arc::clone(drawn))
    }

    async fn draw(&self, card: &Arc<Card>) -> Result<Arc<Drawn>, PictureError> {
        let found = self.catalog.pair(&card.pair).await?;
        let pair = found.ok_or(PictureError::Gone)?.results;
        let (project, limits, card) = (self.project.clone(), self.limits, Arc::clone(card));
        tokio::task::spawn_blocking(move || {
            let subject = Subject::read(&project, &pair, &card, &limits)?;
            Ok(Arc::new(Drawn::of(subject, &card.view.print_from_depth)))
        })
        .await?
    }
}

#[cfg(test)]
mod tests {
    use super::{KEPT, Kept, Layer};

    #[test]
    fn layers_are_found_by_name_and_nothing_else_is() {
        for layer in Layer::ALL {
            assert_eq!(Layer::named(layer.name()), Some(layer));
        }
        for name in ["", "PRINT", "../print", "print.png"] {
            assert_eq!(Layer::named(name), None, "{name}");
        }
    }

    #[test]
    fn the_oldest_pictures_make_room() {
        let mut kept = Kept::default();
        for i in 0..=KEPT {
            kept.place(&i.to_string());
        }
        kept.place("1");
        assert_eq!(kept.drawn.len(), KEPT);
        assert!(!kept.drawn.contains_key("0") && kept.drawn.contains_key("1"));
    }
}
