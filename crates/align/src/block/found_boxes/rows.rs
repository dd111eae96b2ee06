//! Rows of a column: the cheapest sequence of characters, notes and blanks.

use super::column_profile::{ColumnProfile, row_pitch, usual_ink};
use super::columns::Columns;
use super::layout::Layout;
use super::tall_notes::{FEW_ROWS, UsualCharacter};

/// Pitches of notes that are tried, in pitches of rows.
const NOTE_PITCHES: [f64; 2] = [0.44, 0.64];
const NOTE_PITCH_STEP: f64 = 0.02;
/// Pitches of the strip at the fold that are tried, in widths of the strip.
const STRIP_PITCHES: [f64; 2] = [0.66, 1.06];
/// Heights of a row of characters, and of notes and in the strip that are tried, in pitches.
const HEIGHTS: [f64; 2] = [0.65, 1.4];
const NARROW_HEIGHTS: [f64; 2] = [0.75, 1.25];
/// Cost of a row whose height differs by a whole pitch from the pitch.
const HEIGHT_COST: f64 = 7.0;
/// Cost of a cut through as much ink as is usual.
const CUT_COST: f64 = 0.75;
/// Largest ink of a cut that counts, in the usual ink of a line.
const MAX_CUT: f64 = 1.5;
/// Cost of the ink of a character that belongs to no row, and of a blank of one pitch.
const SKIPPED_INK_COST: f64 = 4.0;
const BLANK_COST: f64 = 0.3;
/// Cost of a blank of one pitch of rows among notes, which stand closely.
const NOTE_BLANK_COST: f64 = 2.5;
/// Cost of a row of characters.
const ROW_COST: f64 = 0.35;
/// Cost of a character without ink in the middle, and of a note with it.
const EMPTY_MIDDLE_COST: f64 = 1.1;
const INKED_MIDDLE_COST: f64 = 2.5;
/// Further cost of a character without ink in the middle across and along.
const EMPTY_CROSS_COST: f64 = 1.5;
/// Cost of two notes that are as high as a character.
const TALL_NOTES_COST: f64 = 0.3;
/// Cost of a change from characters to notes.
const NOTES_COST: f64 = 1.4;
/// Ink of a half of a character that has two, in the usual ink of a character.
const MIN_HALF_INK: f64 = 0.1;
/// Usual ink of a line of the strip, in that of a column.
const STRIP_INK: f64 = 0.7;
/// Ink of the middle that counts as a stroke.
const MIDDLE_INK: f64 = 0.12;

/// What a row holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowKind {
    /// One character.
    Character,
    /// Two notes side by side, divided at a position across, in cells.
    Notes { middle: usize },
}

/// A row of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FoundRow {
    /// First position along y and the one after the last, cells.
    pub(super) along: [usize; 2],
    pub(super) kind: RowKind,
}

/// Pitches of a page, cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowPitches {
    pub(super) row: f64,
    pub(super) note: f64,
}

/// Finds the rows of each column from the top, and their pitches.
pub(super) fn find_rows(layout: &Layout, columns: &Columns) -> (Vec<Vec<FoundRow>>, RowPitches) {
    let profiles: Vec<ColumnProfile> = (columns.all.iter())
        .map(|column| ColumnProfile::of(layout, column))
        .collect();
    let usual = usual_ink(&profiles);
    let row = row_pitch(&profiles, columns.pitch);
    let character = usual_character(&profiles, usual, row);
    let mut best: Option<(f64, f64)> = None;
    let steps = ((NOTE_PITCHES[1] - NOTE_PITCHES[0]) / NOTE_PITCH_STEP).round() as i32;
    for step in 0..=steps {
        let note = row * (NOTE_PITCHES[0] + f64::from(step) * NOTE_PITCH_STEP);
        let pitches = RowPitches { row, note };
        let full = profiles.iter().filter(|profile| !profile.is_strip);
        let cost = full
            .map(|profile| RowSearch::run(profile, usual, pitches, character).cost())
            .sum();
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, note));
        }
    }
    let note = best.map_or(row / 2.0, |(_, note)| note);
    let pitches = RowPitches { row, note };
    let divide = |character: Option<UsualCharacter>| -> Vec<Vec<FoundRow>> {
        let rows = profiles.iter().map(|profile| {
            if profile.is_strip {
                strip_rows(profile, usual)
            } else {
                RowSearch::run(profile, usual, pitches, character).rows()
            }
        });
        rows.collect()
    };
    let mut rows = divide(character);
    let is_tall = |row: &&FoundRow| {
        let height = (row.along[1] - row.along[0]) as f64;
        row.kind != RowKind::Character && height > NARROW_HEIGHTS[1] * note
    };
    let tall = rows.iter().flatten().filter(is_tall).count();
    if (1..FEW_ROWS).contains(&tall) {
        rows = divide(character.map(UsualCharacter::of_few_notes));
    }
    (rows, pitches)
}

/// Returns what is usual for a character, from the rows that are found if notes may be only half as high.
fn usual_character(profiles: &[ColumnProfile], usual: f64, row: f64) -> Option<UsualCharacter> {
    let pitches = RowPitches {
        row,
        note: row / 2.0,
    };
    let full = profiles.iter().filter(|profile| !profile.is_strip);
    UsualCharacter::of(full.flat_map(|profile| {
        let rows = RowSearch::run(profile, usual, pitches, None).rows();
        let characters = rows
            .into_iter()
            .filter(|row| row.kind == RowKind::Character);
        characters.filter_map(|row| {
            let [from, to] = row.along.map(|y| y - profile.top);
            profile.span(from, to)
        })
    }))
}

/// One step of a sequence: where it came from.
#[derive(Clone, Copy)]
struct Step {
    cost: f64,
    from: usize,
    from_notes: bool,
    is_row: bool,
}

const UNREACHED: Step = Step {
    cost: f64::INFINITY,
    from: 0,
    from_notes: false,
    is_row: false,
};

/// A search for the cheapest rows of a column.
struct RowSearch<'a> {
    profile: &'a ColumnProfile,
    /// Usual ink of a line.
    usual: f64,
    pitches: RowPitches,
    /// What is usual for a character, if notes may be as high as one.
    character: Option<UsualCharacter>,
    /// Cost of a cut before each line.
    cuts: Vec<f64>,
    /// The best step to each position, among characters and among notes.
    best: [Vec<Step>; 2],
}

impl<'a> RowSearch<'a> {
    /// Finds the best steps to all positions. The strip at the fold has no notes.
    fn run(
        profile: &'a ColumnProfile,
        usual: f64,
        pitches: RowPitches,
        character: Option<UsualCharacter>,
    ) -> Self {
        let count = profile.lines.len();
        let cut = |k: usize| {
            if k == 0 || k == count {
                return 0.0;
            }
            let ink = f64::midpoint(profile.lines[k - 1], profile.lines[k]);
            CUT_COST * (ink / usual).min(MAX_CUT)
        };
        let mut search = Self {
            profile,
            usual,
            pitches,
            character,
            cuts: (0..=count).map(cut).collect(),
            best: [vec![UNREACHED; count + 1], vec![UNREACHED; count + 1]],
        };
        search.best[0][0].cost = 0.0;
        for to in 0..=count {
            if to > 0 {
                search.best[0][to] = search.best_step(to, false);
            }
            if !profile.is_strip {
                if to > 0 {
                    search.best[1][to] = search.best_step(to, true);
                }
                search.change_at(to);
            }
        }
        search
    }

    /// Returns the cost of the whole column.
    fn cost(&self) -> f64 {
        self.best[0][self.profile.lines.len()].cost
    }

    fn pitch(&self, notes: bool) -> f64 {
        if notes {
            self.pitches.note
        } else {
            self.pitches.row
        }
    }

    /// Returns the best step to a position: a blank line or a row.
    fn best_step(&self, to: usize, notes: bool) -> Step {
        let best = &self.best[usize::from(notes)];
        let blank = if notes { NOTE_BLANK_COST } else { BLANK_COST };
        let ink = self.profile.lines[to - 1] / self.usual;
        let mut step = Step {
            cost: best[to - 1].cost + (SKIPPED_INK_COST * ink + blank) / self.pitches.row,
            from: to - 1,
            from_notes: notes,
            is_row: false,
        };
        let heights = if notes || self.profile.is_strip {
            NARROW_HEIGHTS
        } else {
            HEIGHTS
        };
        let [shortest, longest] = heights.map(|share| (share * self.pitch(notes)) as usize);
        for from in to.saturating_sub(longest)..=to.saturating_sub(shortest.max(1)) {
            let cost = best[from].cost + self.cuts[from] + self.cuts[to];
            if cost >= step.cost || to - from < shortest {
                continue;
            }
            let cost = cost + self.row_cost(notes, from, to);
            if cost < step.cost {
                step = Step {
                    cost,
                    from,
                    from_notes: notes,
                    is_row: true,
                };
            }
        }
        step
    }

    /// Changes between characters and notes at a position where that is cheaper.
    fn change_at(&mut self, to: usize) {
        let [text, notes] = [self.best[0][to].cost, self.best[1][to].cost];
        let change = |cost: f64, from_notes: bool| Step {
            cost,
            from: to,
            from_notes,
            is_row: false,
        };
        if text + NOTES_COST < notes {
            self.best[1][to] = change(text + NOTES_COST, false);
        } else if notes < text {
            self.best[0][to] = change(notes, true);
        }
    }

    /// Returns the cost of a row apart from the cuts at its ends.
    fn row_cost(&self, notes: bool, from: usize, to: usize) -> f64 {
        let profile = self.profile;
        let pitch = self.pitch(notes);
        let height = (to - from) as f64 / pitch - 1.0;
        let (_, middle) = profile.middle(from, to);
        let empty = (1.0 - middle / MIDDLE_INK).max(0.0);
        let least = MIN_HALF_INK * self.usual * pitch;
        let has_ink = |half: &Vec<f64>| half[to] - half[from] > least;
        let middle = if notes {
            INKED_MIDDLE_COST * (1.0 - empty)
        } else if profile.halves.iter().all(has_ink) {
            let cross = EMPTY_CROSS_COST * profile.emptiest(from, to, self.usual);
            let one = (EMPTY_MIDDLE_COST + cross) * empty;
            let is_two = one > TALL_NOTES_COST && self.tall_middle(from, to).is_some();
            if is_two {
                one.min(TALL_NOTES_COST + cross)
            } else {
                one
            }
        } else {
            0.0
        };
        pitch / self.pitches.row * (HEIGHT_COST * height * height + ROW_COST + middle)
    }

    /// Returns the position across between two notes that are as high as a character, if a row looks like that.
    fn tall_middle(&self, from: usize, to: usize) -> Option<usize> {
        let span = self.profile.span(from, to)?;
        self.character?.middle_of_two(self.profile, &span)
    }

    /// Returns the rows of the cheapest sequence from the top.
    fn rows(&self) -> Vec<FoundRow> {
        let mut rows = Vec::new();
        let (mut to, mut notes) = (self.profile.lines.len(), false);
        loop {
            let step = self.best[usize::from(notes)][to];
            if step.is_row {
                let kind = if notes {
                    let (middle, _) = self.profile.middle(step.from, to);
                    RowKind::Notes { middle }
                } else if let Some(middle) = self.tall_middle(step.from, to) {
                    RowKind::Notes { middle }
                } else {
                    RowKind::Character
                };
                rows.push(FoundRow {
                    along: [step.from + self.profile.top, to + self.profile.top],
                    kind,
                });
            }
            if step.from == to && step.from_notes == notes {
                break;
            }
            (to, notes) = (step.from, step.from_notes);
        }
        rows.reverse();
        rows
    }
}

/// Divides the strip at the fold, whose characters are often smaller: the pitch with the clearest cuts.
fn strip_rows(profile: &ColumnProfile, usual: f64) -> Vec<FoundRow> {
    let steps = 10;
    (0..=steps)
        .map(|step| {
            let share = f64::from(step) / f64::from(steps);
            let pitch = profile.width as f64
                * (STRIP_PITCHES[0] + share * (STRIP_PITCHES[1] - STRIP_PITCHES[0]));
            let pitches = RowPitches {
                row: pitch,
                note: pitch / 2.0,
            };
            let search = RowSearch::run(profile, STRIP_INK * usual, pitches, None);
            let rows = search.rows();
            // Only the cuts decide, not the number of rows.
            (search.cost() - ROW_COST * rows.len() as f64, rows)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, rows)| rows)
        .unwrap_or_default()
}
