//! Layout and drawing of contact sheets: a legend, and many pairs below it on one image.

use super::font::{cut_at_end, cut_in_middle, has_glyphs, line_height, lines, text_width, write};
use super::paint::{BACKGROUND, BLUE, Rgb, TEXT, VERMILLION, copy, fill, resized};

/// Width of a contact sheet, pixels.
pub const SHEET_WIDTH: usize = 2000;
/// Images in a cell: print, relief, overlay.
const TILES: usize = 3;
/// Space around cells and between images, pixels.
const GAP: usize = 6;
/// Width of a cell in sizes of its font.
const CELL_BY_FONT: f32 = 20.0;
/// Smallest and largest size of the font of a cell, pixels.
const FONT_SIZES: [f32; 2] = [13.0, 24.0];
/// Size of the font of the legend, pixels.
const LEGEND_FONT: f32 = 20.0;
/// Size of the font of a long note, in sizes of the font of the cell.
const NOTE_FONT: f32 = 0.8;
/// Most columns that leave the images large enough.
const MAX_COLUMNS: usize = 12;
/// Fraction of the width of a cell that a long id has at least, percent.
const ID_PERCENT: usize = 60;
/// Space between the numbers of a note.
pub const NOTE_SPACE: &str = "   ";
/// Colour of a missing image.
const MISSING: [u8; 3] = [240, 240, 240];
/// Colour of less important text.
const FAINT: [u8; 3] = [90, 90, 90];

/// What the colour of a cell's frame stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameKind {
    /// The result is missing, was failed by reviewers, or misses the ground truth.
    Wrong,
    /// Reviewers passed the result.
    Passed,
    /// Neither: nobody has judged the result, or reviewers are unsure.
    Other,
}

impl FrameKind {
    /// Every kind, in the order of the legend.
    const ALL: [Self; 3] = [Self::Wrong, Self::Passed, Self::Other];

    /// Returns its colour.
    const fn colour(self) -> [u8; 3] {
        match self {
            Self::Wrong => VERMILLION,
            Self::Passed => BLUE,
            Self::Other => [190, 190, 190],
        }
    }

    /// Returns its text in the legend.
    const fn title(self) -> &'static str {
        match self {
            Self::Wrong => "failed, or off the ground truth",
            Self::Passed => "passed by reviewers",
            Self::Other => "not judged, or undecided",
        }
    }
}

/// One pair on the sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSheetCell {
    /// The pair's id.
    pub id: String,
    /// The character, if it is known.
    pub character: Option<String>,
    /// Confidence and verdict, on the line of the id. In narrow cells, the first ones are left out.
    pub state: Vec<String>,
    /// Its scores, separated by [`NOTE_SPACE`], or why it failed.
    pub note: String,
    /// What its frame stands for.
    pub frame: FrameKind,
    /// Print, aligned relief and overlay, where they exist.
    pub tiles: [Option<Rgb>; TILES],
}

/// The texts above the cells, besides the legend of the frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SheetLegend {
    /// What the sheet shows.
    pub title: String,
    /// What pictures and numbers of a cell are.
    pub explanation: String,
}

/// Sizes of the parts of a contact sheet, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SheetLayout {
    columns: usize,
    cell: [usize; 2],
    tile: usize,
    font: f32,
}

impl SheetLayout {
    /// Returns the layout of a number of cells in at most `columns` columns. Fewer cells have fewer columns, so that they
    /// fill the width.
    fn new(columns: usize, cells: usize) -> Self {
        let columns = columns.min(cells).clamp(1, MAX_COLUMNS);
        let width = SHEET_WIDTH / columns;
        let tile = (width - GAP * (TILES + 3)) / TILES;
        let [smallest, largest] = FONT_SIZES;
        let font = (width as f32 / CELL_BY_FONT).clamp(smallest, largest);
        let height = tile + 2 * line_height(font) + 5 * GAP;
        Self {
            columns,
            cell: [width, height],
            tile,
            font,
        }
    }
}

/// Returns the side, in pixels, of the square space for one image on a sheet with this many cells in at most `columns`
/// columns.
pub fn tile_side(columns: usize, cells: usize) -> usize {
    SheetLayout::new(columns, cells).tile
}

/// Draws cells in 1 to 12 columns on a sheet [`SHEET_WIDTH`] pixels wide, below a legend of two lines. Images larger than
/// their space are shrunk.
pub fn contact_sheet(cells: &[ContactSheetCell], columns: usize, legend: &SheetLegend) -> Rgb {
    let layout = SheetLayout::new(columns, cells.len());
    let top = legend_height();
    let height = top + cells.len().div_ceil(layout.columns).max(1) * layout.cell[1];
    let mut sheet = Rgb::new(SHEET_WIDTH, height, BACKGROUND);
    paint_legend(&mut sheet, legend);
    for (i, cell) in cells.iter().enumerate() {
        let corner = [
            i % layout.columns * layout.cell[0],
            top + i / layout.columns * layout.cell[1],
        ];
        paint(&mut sheet, corner, cell, &layout);
    }
    sheet
}

fn legend_height() -> usize {
    2 * line_height(LEGEND_FONT) + 2 * GAP
}

/// Draws the title with the colours of frames, and the explanation below.
fn paint_legend(sheet: &mut Rgb, legend: &SheetLegend) {
    let (left, line, size) = (2 * GAP, line_height(LEGEND_FONT), LEGEND_FONT);
    write(sheet, &legend.title, [left, GAP], size, TEXT);
    let mut x = left + text_width(&legend.title, size) + 6 * GAP;
    for kind in FrameKind::ALL {
        let side = line / 2;
        let y = GAP + (line - side) / 2;
        fill(sheet, [x, y], [side, side], kind.colour());
        fill(sheet, [x + 3, y + 3], [side - 6, side - 6], BACKGROUND);
        x += side + GAP;
        write(sheet, kind.title(), [x, GAP], size, TEXT);
        x += text_width(kind.title(), size) + 4 * GAP;
    }
    let text = cut_at_end(&legend.explanation, SHEET_WIDTH - 2 * left, size);
    write(sheet, &text, [left, GAP + line], size, FAINT);
}

fn paint(sheet: &mut Rgb, [x, y]: [usize; 2], cell: &ContactSheetCell, layout: &SheetLayout) {
    let [outer, inner] = [4, 8].map(|space| layout.cell.map(|side| side - space));
    fill(sheet, [x + 2, y + 2], outer, cell.frame.colour());
    fill(sheet, [x + 4, y + 4], inner, BACKGROUND);
    let (left, width) = (x + 2 * GAP, layout.cell[0] - 4 * GAP);
    let (line, top) = (line_height(layout.font), y + GAP);
    paint_title(sheet, [left, top], width, cell, layout);
    let note = fitting_note(&cell.note, width, layout.font);
    write(sheet, &note, [left, top + line], layout.font, FAINT);
    let top = top + 2 * line + GAP;
    for (i, tile) in cell.tiles.iter().enumerate() {
        let corner = [left + i * (layout.tile + GAP), top];
        paint_tile(sheet, corner, tile.as_ref(), layout.tile);
    }
    if let [_, None, None] = cell.tiles {
        let corner = [left + layout.tile + 2 * GAP, top + GAP];
        paint_note(sheet, corner, &cell.note, layout);
    }
}

/// Returns a note without the last numbers if it is too wide. A note that is one text is shortened.
fn fitting_note(note: &str, width: usize, size: f32) -> String {
    let parts: Vec<&str> = note.split(NOTE_SPACE).collect();
    let starts = (1..=parts.len()).rev().map(|n| parts[..n].join(NOTE_SPACE));
    let fitting = starts
        .into_iter()
        .find(|text| text_width(text, size) <= width);
    fitting.unwrap_or_else(|| cut_at_end(note, width, size))
}

/// Draws the id with the character, and the state at the right. The state is shortened so that the id has most of the
/// width if it needs it, and then the id.
fn paint_title(
    sheet: &mut Rgb,
    [x, y]: [usize; 2],
    width: usize,
    cell: &ContactSheetCell,
    layout: &SheetLayout,
) {
    let size = layout.font;
    let character = cell.character.as_deref().map(shown).unwrap_or_default();
    let space = 2 * GAP;
    let needed = text_width(&cell.id, size).min(width * ID_PERCENT / 100);
    let left = width.saturating_sub(needed + text_width(&character, size) + 2 * space);
    let states = (0..=cell.state.len()).map(|from| cell.state[from..].join(" \u{b7} "));
    let fitting = states
        .into_iter()
        .find(|text| text_width(text, size) <= left);
    let state = fitting.unwrap_or_default();
    let state_width = text_width(&state, size);
    write(
        sheet,
        &state,
        [x + width.saturating_sub(state_width), y],
        size,
        TEXT,
    );
    let taken = state_width + text_width(&character, size) + 2 * space;
    let id = cut_in_middle(&cell.id, width.saturating_sub(taken), size);
    write(sheet, &id, [x, y], size, TEXT);
    let x = x + text_width(&id, size) + space;
    write(sheet, &character, [x, y], size, TEXT);
}

/// Returns a character, or its code points if the fonts lack it.
fn shown(character: &str) -> String {
    if has_glyphs(character) {
        return character.to_owned();
    }
    let points = character.chars().map(|c| format!("U+{:04X}", u32::from(c)));
    points.collect::<Vec<_>>().join(" ")
}

/// Draws the whole note in place of the missing relief and overlay.
fn paint_note(sheet: &mut Rgb, [x, y]: [usize; 2], note: &str, layout: &SheetLayout) {
    let size = (NOTE_FONT * layout.font).max(FONT_SIZES[0]);
    let line = line_height(size);
    let fitting = (layout.tile - GAP) / line;
    let broken = lines(note, 2 * layout.tile - 2 * GAP, size);
    for (i, text) in broken.iter().take(fitting).enumerate() {
        write(sheet, text, [x, y + i * line], size, TEXT);
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
    use super::{
        ContactSheetCell, FrameKind, MISSING, Rgb, SHEET_WIDTH, SheetLegend, contact_sheet,
        legend_height, shown, tile_side,
    };

    fn cell(id: &str, frame: FrameKind, side: usize) -> ContactSheetCell {
        ContactSheetCell {
            id: id.to_owned(),
            character: Some("明".to_owned()),
            state: vec!["conf. 0.990".to_owned(), "pass".to_owned()],
            note: "IoU 0.812   margin 0.310".to_owned(),
            frame,
            tiles: [Some(Rgb::new(side, side / 2, [10, 20, 30])), None, None],
        }
    }

    fn sheet(cells: &[ContactSheetCell], columns: usize) -> Rgb {
        let legend = SheetLegend {
            title: "Ensemble: 60 of 60 pairs, worst first".to_owned(),
            explanation: "Pictures".to_owned(),
        };
        contact_sheet(cells, columns, &legend)
    }

    /// Counts the pixels of a rectangle that are darker than a missing image.
    fn ink(sheet: &Rgb, x: std::ops::Range<usize>, y: std::ops::Range<usize>) -> usize {
        let rows = y.flat_map(|y| sheet.row(y)[x.clone()].to_vec());
        rows.filter(|colour| colour[0] < 120 && colour[1] < 120)
            .count()
    }

    #[test]
    fn fifty_cells_fit_on_one_sheet() {
        let cells: Vec<_> = (0..50)
            .map(|i| cell(&format!("p{i:03}"), FrameKind::Other, tile_side(5, 50)))
            .collect();
        let sheet = sheet(&cells, 5);
        assert_eq!(sheet.width(), SHEET_WIDTH);
        assert!((1500..2400).contains(&sheet.height()), "{}", sheet.height());
        assert!(tile_side(5, 50) >= 110);
    }

    #[test]
    fn one_cell_fills_the_width() {
        assert!(tile_side(5, 1) > 600);
        let side = tile_side(5, 1);
        let mut only = cell("a", FrameKind::Other, side);
        only.tiles = [0, 1, 2].map(|_| Some(Rgb::new(side, side, [10, 20, 30])));
        let sheet = sheet(&[only], 5);
        let middle = sheet.row(sheet.height() - side / 2);
        let dark = middle
            .iter()
            .filter(|colour| **colour == [10, 20, 30])
            .count();
        assert!(dark * 100 > SHEET_WIDTH * 95, "{dark} of {SHEET_WIDTH}");
        assert_eq!(tile_side(2, 1), side, "fewer cells than columns");
    }

    #[test]
    fn captions_and_legend_have_ink() {
        let side = tile_side(5, 5);
        let cells = [0; 5].map(|_| cell("upright-0036", FrameKind::Other, side));
        let drawn = sheet(&cells, 5);
        let top = legend_height();
        assert!(ink(&drawn, 0..SHEET_WIDTH, 0..top) > 1500, "legend");
        for i in 0..5 {
            let columns = 400 * i + 8..400 * i + 392;
            assert!(
                ink(&drawn, columns.clone(), top + 6..top + 33) > 600,
                "id of {i}"
            );
        }
        let mut without = cells.clone();
        without[0].character = None;
        let fewer = sheet(&without, 5);
        let title = |sheet: &Rgb| ink(sheet, 8..392, top + 6..top + 33);
        assert!(title(&fewer) + 40 < title(&drawn), "the character is drawn");
    }

    #[test]
    fn no_number_of_a_note_is_shortened() {
        let note = "IoU 0.812   0.10°   0.2 %";
        let width = super::text_width("IoU 0.812   0.10", 20.0);
        assert_eq!(super::fitting_note(note, width, 20.0), "IoU 0.812");
        assert_eq!(super::fitting_note(note, 400, 20.0), note);
        assert!(super::fitting_note(&"x".repeat(90), 400, 20.0).ends_with('…'));
    }

    #[test]
    fn in_narrow_cells_the_id_has_most_of_the_line() {
        let side = tile_side(12, 12);
        let cells = [0; 12].map(|_| cell("upright-0036", FrameKind::Other, side));
        let drawn = sheet(&cells, 12);
        let mut without = cells.clone();
        for cell in &mut without {
            cell.state.clear();
        }
        let bare = sheet(&without, 12);
        let top = legend_height();
        let id = |sheet: &Rgb| ink(sheet, 12..90, top + 6..top + 24);
        assert_eq!(id(&drawn), id(&bare), "the id is whole");
        assert!(id(&drawn) > 100);
    }

    #[test]
    fn a_character_without_glyph_has_its_code_points() {
        assert_eq!(shown("明"), "明");
        assert_eq!(shown("\u{20000}"), "U+20000");
    }

    #[test]
    fn frames_have_the_colours_of_the_legend_and_missing_images_are_blank() {
        let side = tile_side(3, 3);
        let kinds = [FrameKind::Wrong, FrameKind::Passed, FrameKind::Other];
        let sheet = sheet(&kinds.map(|kind| cell("a", kind, side)), 3);
        let top = legend_height();
        for (i, kind) in kinds.into_iter().enumerate() {
            assert_eq!(sheet.at(SHEET_WIDTH / 3 * i + 3, top + 3), kind.colour());
            let legend = (0..top).flat_map(|y| sheet.row(y).to_vec());
            assert!(legend.filter(|colour| *colour == kind.colour()).count() > 50);
        }
        assert_eq!(sheet.at(600, sheet.height() - 20), MISSING);
    }

    #[test]
    fn a_long_reason_replaces_missing_images() {
        let (short, mut long) = (
            cell("a", FrameKind::Wrong, 600),
            cell("a", FrameKind::Wrong, 600),
        );
        long.note = "bad_input: ".to_owned() + &"x".repeat(300);
        let reason = |cell: &ContactSheetCell| {
            let sheet = sheet(std::slice::from_ref(cell), 1);
            ink(&sheet, 700..1980, legend_height() + 90..sheet.height() - 10)
        };
        assert!(reason(&long) > 5 * reason(&short).max(1));
    }

    #[test]
    fn extreme_numbers_of_columns_and_cells_are_accepted() {
        assert_eq!(sheet(&[], 5).width(), SHEET_WIDTH);
        for columns in [0, 12, 400] {
            let cells = vec![cell(&"x".repeat(300), FrameKind::Other, 90); 13];
            assert!(sheet(&cells, columns).height() > 0);
        }
    }
}
