//! Fills a column with characters and notes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::page_appearance::PageAppearance;
use super::text_cell::TextCell;
use super::text_source::TextSource;

/// Room for the text of a column, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct TextColumn {
    /// Number from the right, from 1.
    pub number: usize,
    /// Middle, along u.
    pub middle_u: f64,
    /// Upper end, along v.
    pub top: f64,
    /// Number of rows of full-size characters.
    pub rows: usize,
    /// Number of rows of the same column above.
    pub lines_above: usize,
}

/// How the columns of a page are written.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColumnText {
    row_pitch: f64,
    em_mm: f64,
    /// Side of the em square of notes.
    note_em_mm: f64,
    /// Distance of two rows of notes.
    note_pitch: f64,
    /// Distance of the two columns of notes from the middle.
    note_offset: f64,
    /// Width of notes, in their em squares.
    note_stretch: f64,
    /// Fraction of the columns that contain notes.
    notes: f64,
    /// Largest fraction of the rows of a column that hold characters, on a page with few of them.
    filled: Option<f64>,
    /// Whether notes may stand in a single row or on one side.
    has_odd_notes: bool,
}

/// Part of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Segment {
    Character,
    Blank,
    Notes { rows: usize },
}

impl ColumnText {
    /// Draws sizes for columns with the given pitches in mm. `notes` is the fraction of columns that contain notes.
    pub(super) fn draw(
        [row_pitch, column_pitch]: [f64; 2],
        notes: f64,
        appearance: &PageAppearance,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let em_mm = (row_pitch * rng.random_range(0.9..0.97)).min(column_pitch - 1.2);
        let note_pitch = row_pitch * rng.random_range(0.5..0.62);
        let note_offset = (column_pitch - 1.0) / 4.0;
        let mut text = Self {
            row_pitch,
            em_mm,
            note_em_mm: (0.94 * note_pitch).min(1.9 * note_offset),
            note_pitch,
            note_offset,
            note_stretch: 1.0,
            notes,
            filled: appearance.filled,
            has_odd_notes: appearance.notes.is_some(),
        };
        if let Some(tall) = appearance.notes {
            text.note_pitch = tall.pitch * row_pitch;
            text.note_em_mm = tall.height * text.note_pitch;
            text.note_offset = tall.offset * column_pitch / 4.0;
            text.note_stretch = (tall.width * text.note_offset / text.note_em_mm).min(1.0);
        }
        text
    }

    /// Returns the characters of a column from the top, and the number of its last row. The last column of a page often ends
    /// early.
    pub(super) fn fill(
        &self,
        column: &TextColumn,
        is_last: bool,
        texts: &TextSource,
        rng: &mut ChaCha8Rng,
    ) -> (Vec<TextCell>, usize) {
        let mut cells = Vec::new();
        let (mut v, mut line) = (column.top, column.lines_above);
        for segment in self.segments(column, is_last, rng) {
            match segment {
                Segment::Character => {
                    line += 1;
                    let name = format!("c{:02}-r{line:02}", column.number);
                    let centre = [column.middle_u, v + self.row_pitch / 2.0];
                    cells.push(self.cell(name, centre, false, texts, rng));
                    v += self.row_pitch;
                }
                Segment::Blank => v += self.row_pitch,
                Segment::Notes { rows } => {
                    let height = rows as f64 * self.row_pitch;
                    let lines = (height / self.note_pitch) as usize;
                    let slack = (height - lines as f64 * self.note_pitch) / 2.0;
                    let is_one_sided = self.has_odd_notes && rng.random_bool(0.15);
                    for row in 0..lines {
                        line += 1;
                        let middle = v + slack + (row as f64 + 0.5) * self.note_pitch;
                        let is_half = (row + 1 == lines && rng.random_bool(0.4)) || is_one_sided;
                        for (letter, side) in [('a', 1.0), ('b', -1.0)] {
                            if letter == 'b' && is_half {
                                continue;
                            }
                            let name = format!("c{:02}-r{line:02}{letter}", column.number);
                            let centre = [column.middle_u + side * self.note_offset, middle];
                            cells.push(self.cell(name, centre, true, texts, rng));
                        }
                    }
                    v += height;
                }
            }
        }
        (cells, line)
    }

    fn segments(&self, column: &TextColumn, is_last: bool, rng: &mut ChaCha8Rng) -> Vec<Segment> {
        if let Some(filled) = self.filled {
            return Self::few_segments(column.rows, filled, rng);
        }
        let indent = if rng.random_bool(0.12) {
            rng.random_range(1..3)
        } else {
            0
        };
        let end = match rng.random_range(0..10_u32) {
            0 => rng.random_range(column.rows / 2..=column.rows),
            _ if is_last => rng.random_range(column.rows / 3..=column.rows),
            _ => column.rows,
        };
        let mut segments = vec![Segment::Blank; indent];
        let mut row = indent;
        if self.notes > 0.0 && rng.random_bool(self.notes.min(1.0)) {
            let least = if self.has_odd_notes { 1 } else { 2 };
            let rows = rng
                .random_range(least..7_usize)
                .min(end.saturating_sub(indent).max(1));
            let start = rng.random_range(indent..=end.saturating_sub(rows).max(indent));
            segments.extend((row..start).map(|_| Self::character_or_blank(rng)));
            segments.push(Segment::Notes { rows });
            row = start + rows;
        }
        segments.extend((row..end.max(row)).map(|_| Self::character_or_blank(rng)));
        segments
    }

    /// Returns a short run of characters at the top, in the middle or at the foot of a column, or none.
    fn few_segments(rows: usize, filled: f64, rng: &mut ChaCha8Rng) -> Vec<Segment> {
        if rng.random_bool(0.3) {
            return Vec::new();
        }
        let most = ((filled * rows as f64) as usize).max(1);
        let count = rng.random_range(1..=most);
        let indent = match rng.random_range(0..4_u32) {
            0 => rng.random_range(0..=rows - count),
            1 => rows - count,
            _ => rng.random_range(0..2).min(rows - count),
        };
        let mut segments = vec![Segment::Blank; indent];
        segments.extend((0..count).map(|_| Self::character_or_blank(rng)));
        segments
    }

    fn character_or_blank(rng: &mut ChaCha8Rng) -> Segment {
        // A blank cell sets off a new sentence or a name.
        if rng.random_bool(0.012) {
            Segment::Blank
        } else {
            Segment::Character
        }
    }

    fn cell(
        &self,
        name: String,
        centre: [f64; 2],
        is_note: bool,
        texts: &TextSource,
        rng: &mut ChaCha8Rng,
    ) -> TextCell {
        let (em_mm, stretch) = if is_note {
            (self.note_em_mm, self.note_stretch)
        } else {
            (self.em_mm, 1.0)
        };
        let shift = 0.02 * em_mm;
        TextCell {
            name,
            character: texts.character(rng),
            centre: centre.map(|c| c + rng.random_range(-shift..shift)),
            em_mm: em_mm * rng.random_range(0.93..1.02),
            stretch,
            angle_rad: rng.random_range(-0.035..0.035),
            is_note,
            is_strip: false,
        }
    }
}
