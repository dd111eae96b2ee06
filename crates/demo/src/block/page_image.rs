//! Renders the image of a page and measures the boxes of its characters.

use rayon::prelude::*;

use super::impression::{INK_REACH_MM, Impression};
use super::leaf::PrintedLeaf;
use super::page_marks::PageMarks;
use super::page_sheet::PageSheet;
use super::true_map::TruePageMap;
use crate::noise::lerp;
use mocban_core::raster::Grid;

/// Side of the cells in which the inverse map is interpolated, pixels. The error is below 0.01 px, because the map is
/// smooth over 80 mm.
const CELL_PX: usize = 8;
/// Rows of pixels that are rendered by one thread at a time.
const BAND: usize = 64;

/// A box of whole pixels: first and last column, first and last row.
pub(super) type InkBox = Option<[u32; 4]>;

/// What is printed and how it is seen.
pub(super) struct PageRendering<'a> {
    /// The leaf of which boxes are measured, and others.
    pub leaves: Vec<PrintedLeaf<'a>>,
    pub sheet: &'a PageSheet,
    pub marks: &'a PageMarks,
    pub ink: &'a Impression,
    pub map: &'a TruePageMap,
    /// Width and height, pixels.
    pub size: [usize; 2],
    /// Number of characters of the first leaf.
    pub characters: usize,
}

impl PageRendering<'_> {
    /// Renders the image. Returns it with the bounding boxes of the ink of the characters of the first leaf. Pixels of
    /// which more than half lies in a stroke count, also where the ink is missing.
    pub(super) fn render(&self) -> (Grid<[u8; 3]>, Vec<InkBox>) {
        let [width, height] = self.size;
        let cells = self.inverse_map();
        let mut picture = Grid::new(width, height, [0_u8; 3]);
        let bands = picture.data_mut().par_chunks_mut(width * BAND);
        let boxes: Vec<Vec<InkBox>> = bands
            .enumerate()
            .map(|(band, pixels)| {
                let mut boxes = vec![None; self.characters];
                for (row, pixels) in pixels.chunks_mut(width).enumerate() {
                    self.render_row(band * BAND + row, &cells, pixels, &mut boxes);
                }
                boxes
            })
            .collect();
        let merged = (0..self.characters).map(|character| {
            let parts = boxes.iter().filter_map(|band| band[character]);
            parts.reduce(|a, b| {
                [
                    a[0].min(b[0]),
                    a[1].max(b[1]),
                    a[2].min(b[2]),
                    a[3].max(b[3]),
                ]
            })
        });
        let merged = merged.collect();
        (picture, merged)
    }

    /// Returns the positions in the page's plane of every eighth pixel.
    fn inverse_map(&self) -> Grid<[f64; 2]> {
        let size = self.size.map(|side| side / CELL_PX + 2);
        let rows: Vec<[f64; 2]> = (0..size[1])
            .into_par_iter()
            .flat_map_iter(|y| {
                (0..size[0]).map(move |x| {
                    let pixel = [x, y].map(|c| (c * CELL_PX) as f64);
                    self.map.face_from_page(pixel)
                })
            })
            .collect();
        Grid::from_vec(size[0], size[1], rows).expect("one position for each cell")
    }

    fn render_row(
        &self,
        y: usize,
        cells: &Grid<[f64; 2]>,
        pixels: &mut [[u8; 3]],
        boxes: &mut [InkBox],
    ) {
        let px_mm = 1.0 / self.map.px_per_mm;
        let cell_y = y / CELL_PX;
        let fy = (y % CELL_PX) as f64 / CELL_PX as f64;
        for (x, pixel) in pixels.iter_mut().enumerate() {
            let cell_x = x / CELL_PX;
            let fx = (x % CELL_PX) as f64 / CELL_PX as f64;
            let corner = |dx: usize, dy: usize| cells.at(cell_x + dx, cell_y + dy);
            let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
            let point = [0, 1].map(|i| lerp(lerp(a[i], b[i], fx), lerp(c[i], d[i], fx), fy));
            let (mut colour, on_sheet) = self.sheet.at(point, px_mm);
            if on_sheet > 0.0 {
                let (ink, character) = self.ink_at(point, px_mm);
                let ink_colour = self.ink.colour();
                colour = [0, 1, 2].map(|i| lerp(colour[i], ink_colour[i], ink * on_sheet));
                if let Some(index) = character {
                    grow(&mut boxes[index], x as u32, y as u32);
                }
                // Marks are translucent: they darken what lies below them.
                if let Some((mark, density)) = self.marks.at(point) {
                    let dark = |c: f64, mark: f64| c * (1.0 - density * (1.0 - mark / 255.0));
                    colour = [0, 1, 2].map(|i| dark(colour[i], mark[i]));
                }
            }
            *pixel = colour.map(|c| c.clamp(0.0, 255.0).round() as u8);
        }
    }

    /// Returns the ink density at a point of the page's plane, and the character of the first leaf in whose strokes it
    /// lies.
    fn ink_at(&self, point: [f64; 2], px_mm: f64) -> (f64, Option<usize>) {
        let speck = self.ink.speck(point);
        for (index, leaf) in self.leaves.iter().enumerate() {
            let Some(face) = leaf.face_from_plane(point) else {
                continue;
            };
            let carved = leaf.field.value(face);
            if carved < -INK_REACH_MM {
                return (speck, None);
            }
            let lost = leaf
                .damage
                .map_or(f64::NEG_INFINITY, |damage| damage.lost_mm(face, true));
            let cover = self.ink.cover(face, carved.min(-lost), px_mm);
            if cover <= 0.0 {
                return (speck, None);
            }
            let cracked = leaf
                .damage
                .is_some_and(|damage| damage.is_cracked_in_print(face));
            let density = self.ink.density(face) * if cracked { 0.12 } else { 1.0 };
            let is_stroke = index == 0 && cover > 0.5;
            let character = is_stroke.then(|| leaf.field.owner(face)).flatten();
            return ((cover * density).max(speck), character);
        }
        (speck, None)
    }
}

/// Extends a box to a pixel.
fn grow(ink: &mut InkBox, x: u32, y: u32) {
    *ink = Some(match *ink {
        None => [x, x, y, y],
        Some([x0, x1, y0, y1]) => [x0.min(x), x1.max(x), y0.min(y), y1.max(y)],
    });
}
