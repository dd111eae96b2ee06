//! Layout and drawing of contact sheets: many pairs on one image.

use super::paint::{
    BACKGROUND, Rgb, copy, fill, resized, text_height, text_width, truncated, write,
};

/// Width of a contact sheet, pixels.
pub const SHEET_WIDTH: usize = 2000;
/// Images in a cell: print, relief, overlay.
const TILES: usize = 3;
/// Space around cells and between images, pixels.
const GAP: usize = 6;
/// Cells narrower than this have small text, pixels.
const WIDE_CELL: usize = 300;
/// Dot size of the text of a long note, pixels.
const SMALL: usize = 1;
/// Most columns that leave the images large enough.
const MAX_COLUMNS: usize = 12;
/// Frame colour of a wrong result.
const WRONG: [u8; 3] = [213, 94, 0];
/// Frame colour of other results.
const FRAME: [u8; 3] = [205, 205, 205];
/// Colour of a missing image.
const MISSING: [u8; 3] = [240, 240, 240];

/// One pair on the sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSheetCell {
    /// The pair's id.
    pub id: String,
    /// Its scores, or why it failed.
    pub note: String,
    /// Whether the result is missing, was failed by reviewers, or misses the ground truth.
    pub wrong: bool,
    /// Print, aligned relief and overlay, where they exist.
    pub tiles: [Option<Rgb>; TILES],
}

/// Sizes of the parts of a contact sheet, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct SheetLayout {
    columns: usize,
    cell: [usize; 2],
    tile: usize,
    dot: usize,
}

impl SheetLayout {
    fn new(columns: usize) -> Self {
        let columns = columns.clamp(1, MAX_COLUMNS);
        let width = SHEET_WIDTH / columns;
        let tile = (width - GAP * (TILES + 3)) / TILES;
        let dot = if width < WIDE_CELL { 1 } else { 2 };
        let height = tile + 2 * text_height(dot) + 4 * GAP;
        Self {
            columns,
            cell: [width, height],
            tile,
            dot,
        }
    }
}

/// Returns the side, in pixels, of the square space for one image on a sheet with this many columns.
pub fn tile_side(columns: usize) -> usize {
    SheetLayout::new(columns).tile
}

/// Draws cells in 1 to 12 columns on a sheet [`SHEET_WIDTH`] pixels wide. Images larger than their space are shrunk.
pub fn contact_sheet(cells: &[ContactSheetCell], columns: usize) -> Rgb {
    let layout = SheetLayout::new(columns);
    let height = cells.len().div_ceil(layout.columns).max(1) * layout.cell[1];
    let mut sheet = Rgb::new(SHEET_WIDTH, height, BACKGROUND);
    for (i, cell) in cells.iter().enumerate() {
        let corner = [
            i % layout.columns * layout.cell[0],
            i / layout.columns * layout.cell[1],
        ];
        paint(&mut sheet, corner, cell, &layout);
    }
    sheet
}

fn paint(sheet: &mut Rgb, [x, y]: [usize; 2], cell: &ContactSheetCell, layout: &SheetLayout) {
    let colour = if cell.wrong { WRONG } else { FRAME };
    fill(
        sheet,
        [x + 2, y + 2],
        layout.cell.map(|side| side - 4),
        colour,
    );
    let inside = layout.cell.map(|side| side - 8);
    fill(sheet, [x + 4, y + 4], inside, BACKGROUND);
    let (left, width) = (x + 2 * GAP, layout.cell[0] - 4 * GAP);
    let line = text_height(layout.dot);
    let texts = [(&cell.id, y + 2 * GAP), (&cell.note, y + 2 * GAP + line)];
    for (text, top) in texts {
        let text = truncated(text, width, layout.dot);
        write(sheet, &text, left, top, layout.dot);
    }
    for (i, tile) in cell.tiles.iter().enumerate() {
        let corner = [left + i * (layout.tile + GAP), y + 2 * GAP + 2 * line];
        paint_tile(sheet, corner, tile.as_ref(), layout.tile);
    }
    if let [_, None, None] = cell.tiles {
        let corner = [left + layout.tile + 2 * GAP, y + 3 * GAP + 2 * line];
        paint_note(sheet, corner, &cell.note, layout);
    }
}

/// Draws the whole note in place of the missing relief and overlay.
fn paint_note(sheet: &mut Rgb, [x, y]: [usize; 2], note: &str, layout: &SheetLayout) {
    let letters = (2 * layout.tile - 2 * GAP) / text_width(1, SMALL);
    let lines = (layout.tile - GAP) / text_height(SMALL);
    let note: Vec<char> = note.chars().collect();
    for (i, line) in note.chunks(letters.max(1)).take(lines).enumerate() {
        let text: String = line.iter().collect();
        write(sheet, &text, x, y + i * text_height(SMALL), SMALL);
    }
}

/// Draws an image centred in its square.
fn paint_tile(sheet: &mut Rgb, [x, y]: [usize; 2], tile: Option<&Rgb>, side: usize) {
    let Some(tile) = tile else {
        fill(sheet, [x, y], [side, side], MISSING);
        return;
    };
    let longest = tile.width().max(tile.height()).max(side);
    let [width, height] = [tile.width(), tile.height()].map(|n| (n * side / longest).max(1));
    let fitted = resized(tile, width, height);
    let [x, y] = [x + (side - width) / 2, y + (side - height) / 2];
    copy(sheet, &fitted, x, y);
}

#[cfg(test)]
mod tests {
    use super::{ContactSheetCell, MISSING, Rgb, SHEET_WIDTH, WRONG, contact_sheet, tile_side};

    fn cell(id: &str, wrong: bool) -> ContactSheetCell {
        let side = tile_side(5);
        ContactSheetCell {
            id: id.to_owned(),
            note: "IoU 0.812  margin 0.31".to_owned(),
            wrong,
            tiles: [Some(Rgb::new(side, side / 2, [10, 20, 30])), None, None],
        }
    }

    #[test]
    fn fifty_cells_fit_on_one_sheet() {
        let cells: Vec<_> = (0..50).map(|i| cell(&format!("p{i:03}"), false)).collect();
        let sheet = contact_sheet(&cells, 5);
        assert_eq!(sheet.width(), SHEET_WIDTH);
        assert!((1500..2200).contains(&sheet.height()), "{}", sheet.height());
        assert!(tile_side(5) >= 110);
    }

    #[test]
    fn wrong_cells_are_framed_and_missing_images_are_blank() {
        let sheet = contact_sheet(&[cell("a", true), cell("b", false)], 2);
        assert_eq!(sheet.at(3, 3), WRONG);
        assert_ne!(sheet.at(SHEET_WIDTH / 2 + 3, 3), WRONG);
        assert_eq!(sheet.at(500, sheet.height() - 60), MISSING);
    }

    #[test]
    fn a_long_reason_replaces_missing_images() {
        let mut failed = cell("a", true);
        failed.note = "bad_input: ".to_owned() + &"x".repeat(300);
        let (short, long) = (cell("a", true), failed);
        let ink = |cell: &ContactSheetCell| {
            let sheet = contact_sheet(std::slice::from_ref(cell), 5);
            let below = (70..sheet.height()).flat_map(|y| sheet.row(y)[150..390].to_vec());
            below
                .filter(|colour| *colour == super::super::paint::TEXT)
                .count()
        };
        assert!(ink(&long) > 5 * ink(&short).max(1));
    }

    #[test]
    fn extreme_numbers_of_columns_and_cells_are_accepted() {
        assert_eq!(contact_sheet(&[], 5).width(), SHEET_WIDTH);
        assert!(contact_sheet(&[cell("a", false)], 400).height() > 0);
        assert!(contact_sheet(&[cell("a", false)], 0).height() > 0);
    }
}
