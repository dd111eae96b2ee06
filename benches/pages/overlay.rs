//! Pictures of pages with their boxes.

use std::fs;
use std::path::Path;

use mocban_align::block::FoundBox;
use mocban_core::raster::{Grid, png_rgb8};

use super::page::RegisteredPage;

/// Longer side of a picture, pixels.
const SIDE: usize = 1_600;

/// Writes a page with its true boxes in green and the found ones in red.
pub(super) fn write(page: &RegisteredPage, found: &[FoundBox], path: &Path) {
    let rgb = &page.image.rgb;
    let longer = rgb.width().max(rgb.height());
    let scale = (SIDE as f64 / longer as f64).min(2.0);
    let size = [rgb.width(), rgb.height()].map(|side| (side as f64 * scale) as usize);
    let mut picture = Grid::from_fn(size[0], size[1], |x, y| {
        let at = [x, y].map(|k| (k as f64 / scale) as usize);
        rgb.at(at[0].min(rgb.width() - 1), at[1].min(rgb.height() - 1))
            .map(|c| (c / 257) as u8)
    });
    let mut draw = |bounds: [f64; 4], grow: f64, colour: [u8; 3]| {
        let [left, top, right, bottom] = bounds.map(|edge| edge * scale);
        let line = |from: f64, to: f64| (from.max(0.0) as usize)..=(to.max(0.0) as usize);
        let mut set = |x: usize, y: usize| {
            if x < size[0] && y < size[1] {
                picture.set(x, y, colour);
            }
        };
        for x in line(left - grow, right + grow) {
            for y in [top - grow, bottom + grow] {
                set(x, y.max(0.0) as usize);
            }
        }
        for y in line(top - grow, bottom + grow) {
            for x in [left - grow, right + grow] {
                set(x.max(0.0) as usize, y);
            }
        }
    };
    for character in page.truth.characters.iter().filter(|one| one.on_page) {
        if let Some(bounds) = character.box_px {
            draw(bounds, 2.0, [0, 170, 0]);
        }
    }
    for found in found {
        draw(found.page_box, 0.0, [230, 0, 0]);
    }
    fs::write(path, png_rgb8(&picture)).expect("written");
}
