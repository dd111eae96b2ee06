//! Carves all characters, rules and ornaments of a page.

use rayon::prelude::*;

use super::carved_line::{add_fish_tail, add_rule};
use super::carved_text::{CarvedCell, TextCarver};
use super::face_field::FaceField;
use super::layout::PageLayout;
use super::seeding::part_rng;
use crate::glyph::Glyphs;

/// Number of characters that are carved at a time, so that only their samples are in memory.
const GROUP: usize = 64;

/// Carves a page. Each character has random numbers of its own, those of the parts after `part`, so the result does not
/// depend on the number of threads.
pub(super) fn carve_page(layout: &PageLayout, glyphs: &Glyphs, seed: u64, part: u64) -> FaceField {
    let mut rng = part_rng(seed, part);
    let mut field = FaceField::empty(layout.outer);
    for rule in &layout.rules {
        add_rule(&mut field, rule, &mut rng);
    }
    for tail in &layout.fish_tails {
        add_fish_tail(&mut field, tail, &mut rng);
    }
    let carver = TextCarver::draw(glyphs, &mut rng);
    for (group, cells) in layout.cells.chunks(GROUP).enumerate() {
        let first = part + 1 + (group * GROUP) as u64;
        let carved: Vec<CarvedCell> = cells
            .par_iter()
            .enumerate()
            .map(|(k, cell)| carver.carve(cell, &mut part_rng(seed, first + k as u64)))
            .collect();
        for cell in &carved {
            field.add_character(cell.bounds, cell.reach, |point| cell.inside_mm(point));
        }
    }
    field
}
