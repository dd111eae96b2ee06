//! The strokes of a page without frame and rules, and the part of the page inside the frame.

use super::page_rules::PageRules;
use super::rules::{Rule, find_solid, solid_parts};
use super::text_image::{PIXEL_MM, TextImage, Trust};
use mocban_core::raster::{Grid, Mask};

/// Pixels per side of a cell.
pub(super) const CELL: usize = 2;
/// Side of a cell, mm.
pub(super) const CELL_MM: f64 = CELL as f64 * PIXEL_MM;
/// Rules within this distance of the outermost one belong to the frame, mm.
const FRAME_MM: f64 = 5.0;
/// Fraction of the strokes beyond a frame, at most.
const BEYOND_FRAME: f64 = 0.02;
/// Marks in the strip that contain a square of this side are ornaments, in widths of the strip.
const SOLID: f64 = 0.18;
/// The same in other narrow columns.
const SOLID_IN_COLUMN: f64 = 0.4;
/// The same in columns of text, the least fraction of a mark that such squares cover, and its least size. Notes may be solid.
const SOLID_IN_TEXT: f64 = 0.25;
const SOLID_SHARE: f64 = 0.7;
const SOLID_SIZE: f64 = 0.5;

/// Strokes of a page, by which columns and rows are found.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    /// Fraction of each cell that is covered by strokes of text, 0..=1.
    pub(super) cells: Grid<f32>,
    /// Strokes of text and rules in the pixels of the image.
    pub(super) rules: PageRules,
    /// First column and row of cells inside the frame, and the ones after the last.
    pub(super) inside: [usize; 4],
    /// Middles of the rules along y inside the frame, in cells.
    pub(super) inner_rules: Vec<f64>,
    /// Lengths of the inner rules along y and along x, mm.
    pub(super) rule_lengths_mm: [f64; 2],
}

impl Layout {
    /// Takes frame, rules and ornaments out of the strokes of an image.
    pub(super) fn of(image: &TextImage) -> Self {
        let mut layout = Self {
            cells: Grid::new(1, 1, 0.0),
            rules: PageRules::of(image),
            inside: [0; 4],
            inner_rules: Vec::new(),
            rule_lengths_mm: [0.0; 2],
        };
        layout.measure(image);
        layout
    }

    /// Erases rules in pieces: those near the edges of columns, which are given in cells with their pitch, and those
    /// across the page. Returns whether there are any.
    pub(super) fn erase_broken_rules(
        &mut self,
        image: &TextImage,
        (edges, pitch): (&[usize], f64),
    ) -> bool {
        let edges: Vec<f64> = (edges.iter())
            .map(|edge| (edge * CELL) as f64 - 0.5)
            .collect();
        let found = self.rules.erase_broken(&edges, pitch * CELL as f64);
        if found {
            self.measure(image);
        }
        found
    }

    /// Measures the cells of the text, the inside of the frame and the rules in it.
    fn measure(&mut self, image: &TextImage) {
        self.cells = cells(image, &self.rules.erased);
        let [along_y, along_x] = &self.rules.found;
        let (left, right) = frame(along_y, &sums(&self.cells, false));
        let (top, bottom) = frame(along_x, &sums(&self.cells, true));
        self.inside = [left, top, right, bottom];
        let is_within = |rule: &Rule, low: usize, high: usize| {
            let at = rule.at / CELL as f64;
            at > low as f64 + 1.0 && at + 1.0 < high as f64
        };
        let inner = |rules: &[Rule], low: usize, high: usize| -> Vec<Rule> {
            let inner = rules.iter().filter(|rule| is_within(rule, low, high));
            inner.copied().collect()
        };
        let (inner_y, inner_x) = (inner(along_y, left, right), inner(along_x, top, bottom));
        let length = |rules: &[Rule]| {
            let lengths = rules.iter().map(|rule| rule.length as f64 * PIXEL_MM);
            lengths.sum::<f64>()
        };
        self.rule_lengths_mm = [length(&inner_y), length(&inner_x)];
        self.inner_rules = inner_y
            .iter()
            .map(|rule| (rule.at + 0.5) / CELL as f64)
            .collect();
    }

    /// Erases the ornaments of a column, from its first position across to the one after the last, in cells.
    pub(super) fn erase_ornaments(&mut self, across: [usize; 2], is_strip: bool) {
        let side = if is_strip { SOLID } else { SOLID_IN_COLUMN };
        self.erase(across, side, find_solid);
    }

    /// Erases the solid marks of a column of text, such as the ornaments of a strip that is as wide as the columns.
    pub(super) fn erase_solid_parts(&mut self, across: [usize; 2]) {
        let size = SOLID_SIZE * ((across[1] - across[0]) * CELL) as f64;
        self.erase(across, SOLID_IN_TEXT, |part, side| {
            solid_parts(part, side, SOLID_SHARE, (size * size) as usize)
        });
    }

    /// Erases what `find` returns for the text of a column and a side of squares, in pixels. `side` is in widths of the
    /// column.
    fn erase(&mut self, across: [usize; 2], side: f64, find: impl Fn(&Mask, usize) -> Mask) {
        let [left, right] = across.map(|x| x * CELL);
        let height = self.rules.text.height();
        let part = Mask::from_fn(right - left, height, |x, y| self.rules.text.at(left + x, y));
        let solid = find(&part, (side * (right - left) as f64) as usize);
        for y in 0..height {
            for x in (left..right).filter(|x| solid.at(x - left, y)) {
                self.rules.text.set(x, y, false);
                if y / CELL < self.cells.height() {
                    self.cells.set(x / CELL, y / CELL, 0.0);
                }
            }
        }
    }

    /// Returns the mean of the cells at each position across, inside the frame.
    pub(super) fn profile_across(&self) -> Vec<f64> {
        let [left, top, right, bottom] = self.inside;
        let mut sums = vec![0.0_f64; right - left];
        for y in top..bottom {
            for (sum, cell) in sums.iter_mut().zip(&self.cells.row(y)[left..right]) {
                *sum += f64::from(*cell);
            }
        }
        let rows = (bottom - top).max(1) as f64;
        sums.into_iter().map(|sum| sum / rows).collect()
    }

    /// Returns the fractions of gaps in the profiles across and along y of squares, weighted by the ink in them. A gap has
    /// less than a fraction of the mean ink of its profile.
    pub(super) fn gaps(&self, gap_ink: f64, side_mm: f64) -> [f64; 2] {
        let side = ((side_mm / CELL_MM) as usize).max(1);
        let [left, top, right, bottom] = self.inside;
        let (mut ink, mut gaps) = (0.0, [0.0; 2]);
        for y in (top..bottom).step_by(side) {
            for x in (left..right).step_by(side) {
                let (end_x, end_y) = ((x + side).min(right), (y + side).min(bottom));
                let mut profiles = [vec![0.0; end_x - x], vec![0.0; end_y - y]];
                for row in y..end_y {
                    for (column, cell) in self.cells.row(row)[x..end_x].iter().enumerate() {
                        profiles[0][column] += f64::from(*cell);
                        profiles[1][row - y] += f64::from(*cell);
                    }
                }
                let all: f64 = profiles[0].iter().sum();
                ink += all;
                for (sum, profile) in gaps.iter_mut().zip(profiles) {
                    let least = gap_ink * all / profile.len() as f64;
                    let low = profile.iter().filter(|ink| **ink < least).count();
                    *sum += all * low as f64 / profile.len() as f64;
                }
            }
        }
        gaps.map(|sum| sum / ink.max(1e-9))
    }
}

/// Returns the means of the strokes that relief and ink show together, apart from what was erased.
fn cells(image: &TextImage, erased: &Mask) -> Grid<f32> {
    let (width, height) = (erased.width() / CELL, erased.height() / CELL);
    let scale = 1.0 / (2 * 255 * CELL * CELL) as f32;
    Grid::from_fn(width, height, |x, y| {
        let mut sum = 0_u32;
        let trust = image.trust_at(x * CELL, y * CELL);
        for row in y * CELL..(y + 1) * CELL {
            for column in x * CELL..(x + 1) * CELL {
                if erased.at(column, row) {
                    return 0.0;
                }
                let relief = u32::from(image.relief.at(column, row));
                let ink = u32::from(image.ink.at(column, row));
                sum += match trust {
                    Trust::Both => relief + ink,
                    Trust::Relief => 2 * relief,
                    Trust::Ink => 2 * ink,
                };
            }
        }
        sum as f32 * scale
    })
}

/// Returns the sums of the cells of each column or row.
fn sums(cells: &Grid<f32>, of_rows: bool) -> Vec<f64> {
    let mut sums = vec![
        0.0;
        if of_rows {
            cells.height()
        } else {
            cells.width()
        }
    ];
    for y in 0..cells.height() {
        for (x, cell) in cells.row(y).iter().enumerate() {
            sums[if of_rows { y } else { x }] += f64::from(*cell);
        }
    }
    sums
}

/// Returns the first cell inside the frame and the one after the last. Without a rule that has nearly all strokes on one
/// side, the text itself decides.
fn frame(rules: &[Rule], sums: &[f64]) -> (usize, usize) {
    let count = sums.len();
    let all: f64 = sums.iter().sum();
    let cell = |at: f64| ((at.max(0.0) / CELL as f64) as usize).min(count);
    let near = FRAME_MM / PIXEL_MM;
    let beyond = |from: usize, to: usize| sums[from..to].iter().sum::<f64>() <= BEYOND_FRAME * all;
    let mut low = None;
    let mut high = None;
    if let (Some(first), Some(last)) = (rules.first(), rules.last()) {
        let inner = rules.iter().take_while(|r| r.at <= first.at + near).last();
        low = inner
            .map(|rule| cell(rule.edges[1]) + 1)
            .filter(|low| beyond(0, *low));
        let inner = rules
            .iter()
            .rev()
            .take_while(|r| r.at >= last.at - near)
            .last();
        high = inner
            .map(|rule| cell(rule.edges[0]))
            .filter(|high| beyond(*high, count));
    }
    let text = |share: f64| {
        let mut sum = 0.0;
        sums.iter().position(|value| {
            sum += value;
            sum > share * all
        })
    };
    let low = low.or_else(|| text(0.002)).unwrap_or(0);
    let high = high
        .or_else(|| text(0.998).map(|at| at + 1))
        .unwrap_or(count);
    if low + 1 < high {
        (low, high)
    } else {
        (0, count)
    }
}
