//! Rooms of the characters of a page, and what is measured of the strokes in them.

use super::columns::Columns;
use super::rows::{FoundRow, RowKind};
use super::text_image::PIXEL_MM;

/// Least fraction of the relief of a character that is printed, or least correlation of relief and ink.
const MIN_PRINTED: f64 = 0.5;
const MIN_LIKENESS: f64 = 0.3;

/// Half of a row of notes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Half {
    Left,
    Right,
}

/// Room for one character.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CharacterPlace {
    /// Index of the column from the left and of the row from the top.
    pub(super) column: usize,
    pub(super) row: usize,
    pub(super) half: Option<Half>,
    /// First column and row of cells, and the ones after the last.
    pub(super) room: [usize; 4],
}

/// The strokes in a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Strokes {
    /// Number of pixels.
    pub(super) area: usize,
    /// Left, top, right and bottom edge in the frame, pixels.
    pub(super) bounds: [f64; 4],
    /// The same on the page, pixels of the page.
    pub(super) page_bounds: [f64; 4],
    /// Sum of the relief below the strokes, 0..=255.
    pub(super) relief: u64,
    /// Number of pixels where only the relief shows the text.
    pub(super) only_relief: usize,
    /// Fraction of the relief in the place that is printed.
    pub(super) printed: f64,
    /// Correlation of relief and ink in the place.
    pub(super) likeness: f64,
}

impl Strokes {
    pub(super) const EMPTY: Self = Self {
        area: 0,
        bounds: [
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
        ],
        page_bounds: [
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
        ],
        relief: 0,
        only_relief: 0,
        printed: 0.0,
        likeness: 0.0,
    };

    /// Returns the area in mm^2.
    pub(super) fn area_mm2(&self) -> f64 {
        self.area as f64 * PIXEL_MM * PIXEL_MM
    }

    /// Returns the fraction of the text that only the relief shows, because the page does not show the place.
    pub(super) fn unseen(&self) -> f64 {
        self.only_relief as f64 / self.area.max(1) as f64
    }

    /// Returns whether the page shows the relief of the place. Thin strokes never cover it, because it is a little wider
    /// than they were carved, but lie where it is high.
    pub(super) fn is_printed(&self) -> bool {
        self.printed >= MIN_PRINTED || self.likeness >= MIN_LIKENESS
    }

    /// Returns width and height in mm.
    pub(super) fn size_mm(&self) -> [f64; 2] {
        [0, 1].map(|k: usize| (self.bounds[k + 2] - self.bounds[k]) * PIXEL_MM)
    }

    /// Returns the mean relief below the strokes, 0..=1.
    pub(super) fn support(&self) -> f64 {
        self.relief as f64 / (255 * self.area.max(1)) as f64
    }
}

/// Returns the places of all columns and rows.
pub(super) fn places(columns: &Columns, rows: &[Vec<FoundRow>]) -> Vec<CharacterPlace> {
    let mut places = Vec::new();
    for (column, (across, rows)) in columns.all.iter().zip(rows).enumerate() {
        let [left, right] = across.across;
        for (row, found) in rows.iter().enumerate() {
            let [top, bottom] = found.along;
            let mut add = |half: Option<Half>, left: usize, right: usize| {
                places.push(CharacterPlace {
                    column,
                    row,
                    half,
                    room: [left, top, right, bottom],
                });
            };
            match found.kind {
                RowKind::Character => add(None, left, right),
                RowKind::Notes { middle } => {
                    add(Some(Half::Right), middle, right);
                    add(Some(Half::Left), left, middle);
                }
            }
        }
    }
    places
}
