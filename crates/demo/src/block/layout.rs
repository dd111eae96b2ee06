//! The layout of a page: columns of characters from right to left inside a frame of rules.
//!
//! All positions are in mm in the face frame: u to the right and v down, as the print is read. The origin is the middle
//! of the block.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::column::{ColumnText, TextColumn};
use super::kind::BlockRanges;
use super::page_appearance::PageAppearance;
use super::page_measures::PageMeasures;
use super::page_rule::PageRule;
use super::text_cell::TextCell;
use super::text_source::TextSource;
use crate::draw::within;
use crate::polygon::BoundsMm;

/// Gap between the frame and the first and last characters, mm.
const HEAD_MM: f64 = 0.8;
/// Distance between two registers, mm.
const REGISTER_GAP_MM: f64 = 2.4;

/// A fish tail: a black rectangle with a V-shaped notch in one side.
#[derive(Debug, Clone, Copy)]
pub(super) struct FishTail {
    /// Middle, mm.
    pub centre: [f64; 2],
    /// Half the width and half the height, mm.
    pub half_mm: [f64; 2],
    /// 1 if the notch is at the bottom, -1 if it is at the top.
    pub notch: f64,
}

/// The text of a page and where it stands.
#[derive(Debug, Clone)]
pub(super) struct PageLayout {
    /// The characters, column by column from the right, each from the top.
    pub cells: Vec<TextCell>,
    /// Frame, rules between columns and those beside the middle strip.
    pub rules: Vec<PageRule>,
    /// Ornaments of the middle strip.
    pub fish_tails: Vec<FishTail>,
    /// Outer edge of the frame.
    pub outer: BoundsMm,
    /// Position of the fold, mm, if the page is folded.
    pub fold_u: Option<f64>,
}

impl PageLayout {
    /// Draws the layout and the text of a page.
    pub(super) fn draw(
        ranges: &BlockRanges,
        is_folded: bool,
        appearance: &PageAppearance,
        texts: &TextSource,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let measures = PageMeasures::draw(ranges, is_folded, rng);
        let registers = Registers::of(&measures, appearance);
        let width = measures.column_pitch * measures.columns as f64 + measures.strip;
        let height = measures.row_pitch * measures.rows as f64 + 2.0 * HEAD_MM + registers.gap_mm();
        let inner = BoundsMm {
            min: [-width / 2.0, -height / 2.0],
            max: [width / 2.0, height / 2.0],
        };
        let margin = measures.outer_line() + measures.outer_half_width;
        let mut page = Self {
            cells: Vec::new(),
            rules: Vec::new(),
            fish_tails: Vec::new(),
            outer: inner.with_margin(margin),
            fold_u: is_folded.then_some(0.0),
        };
        page.add_frame(inner, &measures);
        let notes = within(ranges.notes, rng);
        let has_rules = rng.random_bool(0.85);
        let rule_half_width = rng.random_range(0.12..0.22);
        let pitches = [measures.row_pitch, measures.column_pitch];
        let text = ColumnText::draw(pitches, notes, appearance, rng);
        let rule = has_rules.then_some(rule_half_width);
        page.add_columns(inner, &measures, &registers, &text, (texts, rng));
        page.add_rules(inner, &measures, rule, rule_half_width);
        if let Some(v) = registers.rule_v(inner.min[1]) {
            page.rules.push(PageRule {
                ends: [[inner.min[0], v], [inner.max[0], v]],
                half_width_mm: rule_half_width,
            });
        }
        if let Some(broken) = &appearance.rules {
            page.rules = broken.clone().apply(&page.rules, inner, page.outer);
        }
        page
    }

    fn add_frame(&mut self, inner: BoundsMm, measures: &PageMeasures) {
        let outer_line = measures.outer_line();
        for (offset, half_width_mm) in [
            (0.0, measures.inner_half_width),
            (outer_line, measures.outer_half_width),
        ] {
            let corners = inner.with_margin(offset).corners();
            for i in 0..4 {
                self.rules.push(PageRule {
                    ends: [corners[i], corners[(i + 1) % 4]],
                    half_width_mm,
                });
            }
        }
    }

    /// Adds the columns from the right, and the middle strip.
    fn add_columns(
        &mut self,
        inner: BoundsMm,
        measures: &PageMeasures,
        registers: &Registers,
        text: &ColumnText,
        (texts, rng): (&TextSource, &mut ChaCha8Rng),
    ) {
        let strip_at = measures.columns / 2;
        let mut right = inner.max[0];
        let mut number = 0;
        for index in 0..measures.columns {
            if measures.strip > 0.0 && index == strip_at {
                number += 1;
                let strip = TextColumn {
                    number,
                    middle_u: right - measures.strip / 2.0,
                    top: inner.min[1],
                    rows: measures.rows,
                    lines_above: 0,
                };
                self.add_strip(&strip, measures, texts, rng);
                right -= measures.strip;
            }
            number += 1;
            let is_last = index + 1 == measures.columns;
            let mut lines_above = 0;
            for (top, rows) in registers.tops_and_rows(inner.min[1] + HEAD_MM) {
                let column = TextColumn {
                    number,
                    middle_u: right - measures.column_pitch / 2.0,
                    top,
                    rows,
                    lines_above,
                };
                let (cells, last_line) = text.fill(&column, is_last, texts, rng);
                lines_above = last_line;
                self.cells.extend(cells);
            }
            right -= measures.column_pitch;
        }
    }

    /// Adds rules between the columns, if there are any, and at both sides of the middle strip.
    fn add_rules(
        &mut self,
        inner: BoundsMm,
        measures: &PageMeasures,
        between: Option<f64>,
        beside_strip: f64,
    ) {
        let strip_at = measures.columns / 2;
        let mut right = inner.max[0];
        for index in 1..measures.columns {
            right -= measures.column_pitch;
            let is_beside_strip = measures.strip > 0.0 && index == strip_at;
            if let Some(half_width) = between.or(is_beside_strip.then_some(beside_strip)) {
                self.add_vertical_rule(right, inner, half_width);
            }
            if is_beside_strip {
                right -= measures.strip;
                self.add_vertical_rule(right, inner, beside_strip);
            }
        }
    }

    fn add_vertical_rule(&mut self, u: f64, inner: BoundsMm, half_width_mm: f64) {
        self.rules.push(PageRule {
            ends: [[u, inner.min[1]], [u, inner.max[1]]],
            half_width_mm,
        });
    }

    /// Adds the middle strip: a fish tail, the title below it, a second fish tail, and the number of the leaf.
    fn add_strip(
        &mut self,
        strip: &TextColumn,
        measures: &PageMeasures,
        texts: &TextSource,
        rng: &mut ChaCha8Rng,
    ) {
        let em_mm = (0.78 * measures.strip).min(0.85 * measures.row_pitch);
        let half_mm = [
            measures.strip / 2.0 - 0.9,
            rng.random_range(0.35..0.6) * measures.strip,
        ];
        let pitch = em_mm * 1.12;
        let height = measures.row_pitch * measures.rows as f64;
        let first = strip.top + height * rng.random_range(0.14..0.24);
        let u = strip.middle_u;
        self.fish_tails.push(FishTail {
            centre: [u, first],
            half_mm,
            notch: 1.0,
        });
        let mut v = first + half_mm[1] + 0.4 * pitch;
        let mut row = 0;
        let title = rng.random_range(2..5_usize);
        for index in 0..title + rng.random_range(1..4_usize) {
            if index == title {
                v = v.max(strip.top + height * 0.6) + half_mm[1];
                if rng.random_bool(0.6) {
                    self.fish_tails.push(FishTail {
                        centre: [u, v],
                        half_mm,
                        notch: -1.0,
                    });
                }
                v += half_mm[1] + 0.4 * pitch;
            }
            row += 1;
            v += pitch;
            self.cells.push(TextCell {
                name: format!("c{:02}-r{row:02}", strip.number),
                character: texts.character(rng),
                centre: [u, v - pitch / 2.0],
                em_mm,
                stretch: 1.0,
                angle_rad: rng.random_range(-0.02..0.02),
                is_note: false,
                is_strip: true,
            });
        }
    }
}

/// One or two registers of text.
struct Registers {
    row_pitch: f64,
    /// Rows of each register from the top.
    rows: Vec<usize>,
}

impl Registers {
    fn of(measures: &PageMeasures, appearance: &PageAppearance) -> Self {
        let rows = match appearance.upper {
            None => vec![measures.rows],
            Some(upper) => {
                let upper = (upper * measures.rows as f64).round() as usize;
                vec![upper, measures.rows - upper]
            }
        };
        Self {
            row_pitch: measures.row_pitch,
            rows,
        }
    }

    /// Returns the distance between the registers, mm.
    fn gap_mm(&self) -> f64 {
        REGISTER_GAP_MM * (self.rows.len() - 1) as f64
    }

    /// Returns the upper end and the number of rows of each register below the head of a page.
    fn tops_and_rows(&self, head: f64) -> Vec<(f64, usize)> {
        let mut top = head;
        let mut registers = Vec::new();
        for rows in &self.rows {
            registers.push((top, *rows));
            top += *rows as f64 * self.row_pitch + REGISTER_GAP_MM;
        }
        registers
    }

    /// Returns the position of the rule between two registers, mm.
    fn rule_v(&self, top: f64) -> Option<f64> {
        let [upper, _] = self.rows[..] else {
            return None;
        };
        Some(top + HEAD_MM + upper as f64 * self.row_pitch + REGISTER_GAP_MM / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::PageLayout;
    use crate::block::kind::BlockKind;
    use crate::block::page_appearance::PageAppearance;
    use crate::block::seeding::part_rng;
    use crate::block::text_source::TextSource;
    use crate::glyph::Glyphs;

    fn layouts(kind: BlockKind) -> Vec<PageLayout> {
        let glyphs = Glyphs::embedded();
        let texts = TextSource::draw(&glyphs, &mut part_rng(1, 0));
        let draw = |seed: u64| {
            let mut rng = part_rng(seed, 3);
            let ranges = kind.ranges();
            let appearance = PageAppearance::draw(&ranges.appearance, &mut part_rng(seed, 12));
            PageLayout::draw(
                ranges,
                seed.is_multiple_of(2),
                &appearance,
                &texts,
                &mut rng,
            )
        };
        (0..24).map(draw).collect()
    }

    #[test]
    fn names_are_unique_and_columns_run_from_right_to_left() {
        let kinds = [BlockKind::Notes, BlockKind::TallNotes, BlockKind::Registers];
        for page in kinds.into_iter().flat_map(layouts) {
            let names: BTreeSet<&str> = page.cells.iter().map(|cell| cell.name.as_str()).collect();
            assert_eq!(names.len(), page.cells.len());
            for (one, next) in page.cells.iter().zip(&page.cells[1..]) {
                if one.name[..3] == next.name[..3] {
                    let is_below = next.centre[1] > one.centre[1] - 0.5;
                    assert!(is_below, "{} before {}", one.name, next.name);
                } else {
                    assert!(next.centre[0] < one.centre[0], "{}", next.name);
                }
            }
        }
    }

    #[test]
    fn pages_hold_as_many_characters_as_real_ones() {
        for kind in [BlockKind::Plain, BlockKind::Fine] {
            for page in layouts(kind) {
                assert!(
                    (85..=560).contains(&page.cells.len()),
                    "{}",
                    page.cells.len()
                );
                let size = page.outer.size();
                assert!((180.0..310.0).contains(&size[0]), "{size:?}");
                assert!((130.0..235.0).contains(&size[1]), "{size:?}");
            }
        }
    }

    #[test]
    fn pages_of_small_blocks_hold_few_characters() {
        for page in layouts(BlockKind::Small) {
            assert!(
                (12..=105).contains(&page.cells.len()),
                "{}",
                page.cells.len()
            );
            let [width, height] = page.outer.size();
            assert!((55.0..105.0).contains(&width), "{width}");
            assert!((95.0..142.0).contains(&height), "{height}");
        }
    }

    #[test]
    fn notes_have_half_the_size_and_do_not_overlap() {
        let mut notes = 0;
        for page in layouts(BlockKind::Notes) {
            let largest = page.cells.iter().map(|cell| cell.em_mm).fold(0.0, f64::max);
            let all: Vec<_> = page.cells.iter().filter(|cell| cell.is_note).collect();
            notes += all.len();
            for (k, cell) in all.iter().enumerate() {
                assert!(cell.em_mm < 0.68 * largest, "{} of {largest}", cell.em_mm);
                for other in &all[k + 1..] {
                    let apart = [0, 1].map(|i| (cell.centre[i] - other.centre[i]).abs());
                    assert!(apart[0].max(apart[1]) > 0.8 * cell.em_mm, "{}", cell.name);
                }
            }
        }
        assert!(notes > 500, "{notes}");
    }

    #[test]
    fn pages_of_libraries_differ_from_clean_pages() {
        let count = |kind: BlockKind| {
            let pages = layouts(kind);
            let cells: usize = pages.iter().map(|page| page.cells.len()).sum();
            let rules: usize = pages.iter().map(|page| page.rules.len()).sum();
            (cells, rules)
        };
        let (plain, rules) = count(BlockKind::Plain);
        assert!(count(BlockKind::Sparse).0 * 3 < plain);
        assert!(count(BlockKind::BrokenRules).1 > 3 * rules);
        let text = |page: &PageLayout| {
            let full = page
                .cells
                .iter()
                .filter(|cell| !cell.is_note && !cell.is_strip);
            full.map(|cell| cell.em_mm).fold(0.0, f64::max)
        };
        for page in layouts(BlockKind::TallNotes) {
            let usual = text(&page);
            for note in page.cells.iter().filter(|cell| cell.is_note) {
                assert!(
                    note.em_mm > 0.55 * usual && note.stretch <= 1.0,
                    "{}",
                    note.name
                );
            }
        }
    }
}
