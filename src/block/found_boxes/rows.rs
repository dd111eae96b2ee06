//! Rows of a column: the cheapest sequence of characters, notes and blanks.

use super::columns::{Column, Columns};
use super::layout::Layout;

/// Pitches of rows that are tried, in pitches of columns.
const ROW_PITCHES: [f64; 2] = [0.5, 1.2];
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
const CUT_COST: f64 = 1.5;
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
/// Cost of a change from characters to notes.
const NOTES_COST: f64 = 1.4;
/// Middles that are tried, in widths of the column on both sides.
const MIDDLE_REACH: f64 = 0.09;
/// Ink of the middle that counts as a stroke.
const MIDDLE_INK: f64 = 0.12;
/// Ink of a line that counts as a stroke, in the usual ink of a line.
const MIDDLE_LINE: f64 = 0.2;

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
pub(super) struct Row {
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
pub(super) fn find_rows(layout: &Layout, columns: &Columns) -> (Vec<Vec<Row>>, RowPitches) {
    let profiles: Vec<ColumnProfile> = (columns.columns.iter())
        .map(|column| ColumnProfile::of(layout, column))
        .collect();
    let usual = usual_ink(&profiles);
    let row = row_pitch(&profiles, columns.pitch);
    let mut best: Option<(f64, f64)> = None;
    let steps = ((NOTE_PITCHES[1] - NOTE_PITCHES[0]) / NOTE_PITCH_STEP).round() as i32;
    for step in 0..=steps {
        let note = row * (NOTE_PITCHES[0] + f64::from(step) * NOTE_PITCH_STEP);
        let pitches = RowPitches { row, note };
        let full = profiles.iter().filter(|profile| !profile.is_strip);
        let cost = full
            .map(|profile| divide(profile, usual, pitches, true).0)
            .sum();
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, note));
        }
    }
    let note = best.map_or(row / 2.0, |(_, note)| note);
    let pitches = RowPitches { row, note };
    let rows = profiles
        .iter()
        .map(|profile| {
            if profile.is_strip {
                strip_rows(profile, usual)
            } else {
                divide(profile, usual, pitches, true).1
            }
        })
        .collect();
    (rows, pitches)
}

/// Sums of the cells of a column.
struct ColumnProfile {
    is_strip: bool,
    width: usize,
    top: usize,
    /// Sum of each line of cells.
    lines: Vec<f64>,
    /// Sums of all lines before each line: of all cells, of the left and the right half.
    all: Vec<f64>,
    halves: [Vec<f64>; 2],
    /// Positions across near the middle, with the sums of all lines before each line.
    middles: Vec<(usize, Vec<f64>)>,
}

impl ColumnProfile {
    fn of(layout: &Layout, column: &Column) -> Self {
        let [top, bottom] = [layout.inside[1], layout.inside[3]];
        let [left, right] = column.across;
        let middle = usize::midpoint(left, right);
        let reach = (MIDDLE_REACH * (right - left) as f64).ceil() as usize;
        let line = |y: usize, from: usize, to: usize| {
            let cells = &layout.cells.row(y)[from..to];
            cells.iter().map(|cell| f64::from(*cell)).sum::<f64>()
        };
        let before = |from: usize, to: usize| {
            let mut sums = Vec::with_capacity(bottom - top + 1);
            let mut sum = 0.0;
            sums.push(sum);
            for y in top..bottom {
                sum += line(y, from, to);
                sums.push(sum);
            }
            sums
        };
        Self {
            is_strip: column.is_strip,
            width: right - left,
            top,
            lines: (top..bottom).map(|y| line(y, left, right)).collect(),
            all: before(left, right),
            halves: [before(left, middle), before(middle, right)],
            middles: (middle.saturating_sub(reach)..=middle + reach)
                .filter(|x| *x > left && x + 1 < right)
                .map(|x| (x, before(x, x + 1)))
                .collect(),
        }
    }

    /// Returns 1 if a line in the middle third of a row is empty, 0 if all have usual ink.
    fn emptiest(&self, from: usize, to: usize, usual: f64) -> f64 {
        let third = (to - from) / 3;
        let lines = &self.lines[from + third..to - third];
        let least = lines.iter().copied().fold(f64::INFINITY, f64::min);
        (1.0 - least / (MIDDLE_LINE * usual)).max(0.0)
    }

    /// Returns the position across with the least ink near the middle of a row, and the share of it that is inked.
    fn middle(&self, from: usize, to: usize) -> (usize, f64) {
        let rows = (to - from) as f64;
        let mut best = (0, f64::INFINITY);
        for (x, sums) in &self.middles {
            let ink = (sums[to] - sums[from]) / rows;
            if ink < best.1 {
                best = (*x, ink);
            }
        }
        best
    }
}

/// Returns the usual ink of a line.
fn usual_ink(profiles: &[ColumnProfile]) -> f64 {
    let full = profiles.iter().filter(|profile| !profile.is_strip);
    let mut lines: Vec<f64> = full
        .flat_map(|profile| profile.lines.iter().copied())
        .filter(|line| *line > 1.0)
        .collect();
    lines.sort_by(f64::total_cmp);
    lines.get(lines.len() / 2).copied().unwrap_or(1.0)
}

/// Returns the lag at which the columns are most like themselves.
fn row_pitch(profiles: &[ColumnProfile], column_pitch: f64) -> f64 {
    let lags = ROW_PITCHES.map(|share| (share * column_pitch) as usize);
    let mut sums = vec![0.0; lags[1] + 2];
    for profile in profiles.iter().filter(|profile| !profile.is_strip) {
        let lines = &profile.lines;
        let mean = lines.iter().sum::<f64>() / lines.len().max(1) as f64;
        let lines: Vec<f64> = lines
            .iter()
            .map(|line| line.min(3.0 * mean) - mean)
            .collect();
        for (lag, sum) in sums.iter_mut().enumerate().skip(lags[0].saturating_sub(1)) {
            let pairs = lines.iter().zip(lines.iter().skip(lag));
            *sum += pairs.map(|(a, b)| a * b).sum::<f64>();
        }
    }
    let best = (lags[0]..=lags[1]).max_by(|a, b| sums[*a].total_cmp(&sums[*b]));
    let Some(best) = best.filter(|best| *best > 0) else {
        return column_pitch;
    };
    let (before, at, after) = (sums[best - 1], sums[best], sums[best + 1]);
    let curvature = 2.0 * at - before - after;
    let offset = if curvature > 0.0 {
        ((after - before) / (2.0 * curvature)).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    best as f64 + offset
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

/// Divides a column into rows. Returns the cost and the rows.
fn divide(
    profile: &ColumnProfile,
    usual: f64,
    pitches: RowPitches,
    with_notes: bool,
) -> (f64, Vec<Row>) {
    let count = profile.lines.len();
    let cut = |k: usize| {
        if k == 0 || k == count {
            0.0
        } else {
            CUT_COST * ((profile.lines[k - 1] + profile.lines[k]) / 2.0 / usual).min(1.5) / 2.0
        }
    };
    let cuts: Vec<f64> = (0..=count).map(cut).collect();
    // Steps to each position, in characters and in notes.
    let mut best = [vec![UNREACHED; count + 1], vec![UNREACHED; count + 1]];
    best[0][0].cost = 0.0;
    for to in 0..=count {
        for notes in [false, true] {
            if notes && !with_notes {
                continue;
            }
            let mut step = best[usize::from(notes)][to];
            if to > 0 {
                let before = best[usize::from(notes)][to - 1];
                let blank = if notes { NOTE_BLANK_COST } else { BLANK_COST };
                let ink = profile.lines[to - 1] / (usual * pitches.row);
                let cost = before.cost + SKIPPED_INK_COST * ink + blank / pitches.row;
                if cost < step.cost {
                    step = Step {
                        cost,
                        from: to - 1,
                        from_notes: notes,
                        is_row: false,
                    };
                }
                let pitch = if notes { pitches.note } else { pitches.row };
                let heights = if notes || profile.is_strip {
                    NARROW_HEIGHTS
                } else {
                    HEIGHTS
                };
                let [shortest, longest] = heights.map(|share| (share * pitch) as usize);
                for height in shortest.max(1)..=longest.min(to) {
                    let from = to - height;
                    let before = best[usize::from(notes)][from];
                    if before.cost + cuts[from] + cuts[to] >= step.cost {
                        continue;
                    }
                    let row = row_cost(profile, usual, pitches, notes, from, to);
                    let cost = before.cost + row + cuts[from] + cuts[to];
                    if cost < step.cost {
                        step = Step {
                            cost,
                            from,
                            from_notes: notes,
                            is_row: true,
                        };
                    }
                }
            }
            best[usize::from(notes)][to] = step;
        }
        if with_notes {
            let [text, notes] = [best[0][to], best[1][to]];
            if text.cost + NOTES_COST < notes.cost {
                best[1][to] = Step {
                    cost: text.cost + NOTES_COST,
                    from: to,
                    from_notes: false,
                    is_row: false,
                };
            } else if notes.cost < text.cost {
                best[0][to] = Step {
                    cost: notes.cost,
                    from: to,
                    from_notes: true,
                    is_row: false,
                };
            }
        }
    }
    (best[0][count].cost, rows_of(profile, &best))
}

/// Returns the cost of a row apart from the cuts at its ends.
fn row_cost(
    profile: &ColumnProfile,
    usual: f64,
    pitches: RowPitches,
    notes: bool,
    from: usize,
    to: usize,
) -> f64 {
    let pitch = if notes { pitches.note } else { pitches.row };
    let share = pitch / pitches.row;
    let full = usual * pitch;
    let height = (to - from) as f64 / pitch - 1.0;
    let even = HEIGHT_COST * height * height;
    let (_, middle) = profile.middle(from, to);
    let empty = (1.0 - middle / MIDDLE_INK).max(0.0);
    let middle = if notes {
        INKED_MIDDLE_COST * (1.0 - empty)
    } else {
        let has_ink = |half: &Vec<f64>| half[to] - half[from] > 0.1 * full;
        if profile.halves.iter().all(has_ink) {
            (EMPTY_MIDDLE_COST + EMPTY_CROSS_COST * profile.emptiest(from, to, usual)) * empty
        } else {
            0.0
        }
    };
    share * (even + ROW_COST + middle)
}

/// Returns the rows of the cheapest sequence.
fn rows_of(profile: &ColumnProfile, best: &[Vec<Step>; 2]) -> Vec<Row> {
    let mut rows = Vec::new();
    let (mut to, mut notes) = (profile.lines.len(), false);
    loop {
        let step = best[usize::from(notes)][to];
        if step.is_row {
            let kind = if notes {
                let (middle, _) = profile.middle(step.from, to);
                RowKind::Notes { middle }
            } else {
                RowKind::Character
            };
            rows.push(Row {
                along: [step.from + profile.top, to + profile.top],
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

/// Divides the strip at the fold, whose characters are often smaller: the pitch with the clearest cuts.
fn strip_rows(profile: &ColumnProfile, usual: f64) -> Vec<Row> {
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
            let (cost, rows) = divide(profile, 0.7 * usual, pitches, false);
            // Only the cuts decide, not the number of rows.
            (cost - ROW_COST * rows.len() as f64, rows)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, rows)| rows)
        .unwrap_or_default()
}
