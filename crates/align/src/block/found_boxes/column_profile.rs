//! The ink of a column line by line, and what is usual on a page.

use super::columns::FoundColumn;
use super::layout::{CELL, Layout};

/// Pitches of rows that are tried, in pitches of columns.
const ROW_PITCHES: [f64; 2] = [0.5, 1.2];
/// Largest fraction of lines with strokes on a page with few characters, and the sum of the cells of a line that counts as
/// strokes.
const FEW_LINES: f64 = 0.4;
const INKED_LINE: f64 = 0.5;
/// Position of the usual height of a character among the heights of all, and the fewest heights that say what is usual.
const USUAL_HEIGHT: f64 = 0.75;
const MIN_HEIGHTS: usize = 4;
/// Middles that are tried, in widths of the column on both sides.
const MIDDLE_REACH: f64 = 0.09;
/// Ink of a line that counts as a stroke, in the usual ink of a line.
const MIDDLE_LINE: f64 = 0.2;

/// Distance of a gap from the middle of the column, in its widths, and the fraction of a gap that may be inked.
const GAP_REACH: f64 = 0.12;
const GAP_INK: f64 = 0.02;

/// Where the strokes of a row lie across its column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowSpan {
    /// First position with strokes, and the one after the last, cells.
    pub(super) across: [usize; 2],
    /// The widest gap near the middle of the column, likewise.
    pub(super) gap: Option<[usize; 2]>,
    /// Mean number of strokes that a line across the row meets, of the lines with strokes.
    pub(super) strokes: f64,
}

impl RowSpan {
    /// Returns the width of the strokes, cells.
    pub(super) fn width(&self) -> f64 {
        (self.across[1] - self.across[0]) as f64
    }
}

/// Sums of the cells of a column.
pub(super) struct ColumnProfile {
    pub(super) is_strip: bool,
    pub(super) left: usize,
    pub(super) width: usize,
    pub(super) top: usize,
    /// Sum of each line of cells.
    pub(super) lines: Vec<f64>,
    /// Sums of all lines before each line, of the left and the right half.
    pub(super) halves: [Vec<f64>; 2],
    /// Positions across near the middle, with the sums of all lines before each line.
    pub(super) middles: Vec<(usize, Vec<f64>)>,
    /// Pixels of strokes at each position across, in all lines before each line.
    inked: Vec<Vec<u32>>,
    /// Numbers of strokes that lines across meet, and of pixel lines with strokes, in all lines before each line.
    strokes: Vec<[u32; 2]>,
}

impl ColumnProfile {
    pub(super) fn of(layout: &Layout, column: &FoundColumn) -> Self {
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
            left,
            width: right - left,
            top,
            lines: (top..bottom).map(|y| line(y, left, right)).collect(),
            halves: [before(left, middle), before(middle, right)],
            middles: (middle.saturating_sub(reach)..=middle + reach)
                .filter(|x| *x > left && x + 1 < right)
                .map(|x| (x, before(x, x + 1)))
                .collect(),
            inked: (left..right)
                .map(|x| pixels_before(layout, x, [top, bottom]))
                .collect(),
            strokes: strokes_before(layout, [left, right], [top, bottom]),
        }
    }

    /// Returns where the strokes of the lines `from..to` lie; `None` if there are none.
    pub(super) fn span(&self, from: usize, to: usize) -> Option<RowSpan> {
        let count = |x: usize| self.inked[x][to] - self.inked[x][from];
        let first = (0..self.width).find(|x| count(*x) > 0)?;
        let last = (0..self.width).rfind(|x| count(*x) > 0)?;
        let few = (GAP_INK * ((to - from) * CELL * CELL) as f64) as u32;
        let middle = self.width as f64 / 2.0;
        let reach = GAP_REACH * self.width as f64;
        let mut gap: Option<[usize; 2]> = None;
        let mut x = first;
        while x < last {
            let end = (x..last).find(|x| count(*x) > few).unwrap_or(last);
            let is_near = x as f64 <= middle + reach && end as f64 >= middle - reach;
            if is_near && end > x && gap.is_none_or(|[from, to]| end - x > to - from) {
                gap = Some([x, end]);
            }
            x = end + 1;
        }
        let [strokes, lines] = [0, 1].map(|k: usize| self.strokes[to][k] - self.strokes[from][k]);
        Some(RowSpan {
            across: [first + self.left, last + 1 + self.left],
            gap: gap.map(|ends| ends.map(|x| x + self.left)),
            strokes: f64::from(strokes) / f64::from(lines.max(1)),
        })
    }

    /// Returns 1 if a line in the middle third of a row is empty, 0 if all have usual ink.
    pub(super) fn emptiest(&self, from: usize, to: usize, usual: f64) -> f64 {
        let third = (to - from) / 3;
        let lines = &self.lines[from + third..to - third];
        let least = lines.iter().copied().fold(f64::INFINITY, f64::min);
        (1.0 - least / (MIDDLE_LINE * usual)).max(0.0)
    }

    /// Returns the position across with the least ink near the middle of a row, and the fraction of it that is inked.
    pub(super) fn middle(&self, from: usize, to: usize) -> (usize, f64) {
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

/// Returns the pixels of strokes at a position across in all lines before each line.
fn pixels_before(layout: &Layout, x: usize, [top, bottom]: [usize; 2]) -> Vec<u32> {
    let mut sums = vec![0];
    let mut sum = 0;
    for y in top * CELL..bottom * CELL {
        let pixels = &layout.rules.text.row(y)[x * CELL..(x + 1) * CELL];
        sum += pixels.iter().filter(|is_stroke| **is_stroke).count() as u32;
        if (y + 1).is_multiple_of(CELL) {
            sums.push(sum);
        }
    }
    sums
}

/// Returns the numbers of strokes and of lines with strokes in all lines before each line.
fn strokes_before(
    layout: &Layout,
    [left, right]: [usize; 2],
    [top, bottom]: [usize; 2],
) -> Vec<[u32; 2]> {
    let mut sums = vec![[0; 2]];
    let mut sum = [0; 2];
    for y in top * CELL..bottom * CELL {
        let line = &layout.rules.text.row(y)[left * CELL..right * CELL];
        let starts = line.windows(2).filter(|ends| !ends[0] && ends[1]).count();
        let strokes = starts as u32 + u32::from(line[0]);
        sum = [sum[0] + strokes, sum[1] + u32::from(strokes > 0)];
        if (y + 1).is_multiple_of(CELL) {
            sums.push(sum);
        }
    }
    sums
}

/// Returns the usual ink of a line.
pub(super) fn usual_ink(profiles: &[ColumnProfile]) -> f64 {
    let full = profiles.iter().filter(|profile| !profile.is_strip);
    let mut lines: Vec<f64> = full
        .flat_map(|profile| profile.lines.iter().copied())
        .filter(|line| *line > 1.0)
        .collect();
    lines.sort_by(f64::total_cmp);
    lines.get(lines.len() / 2).copied().unwrap_or(1.0)
}

/// Returns the usual height of a character on a page with few of them, in cells and within [`ROW_PITCHES`]; `None` on other
/// pages.
///
/// On such a page, most characters have no neighbour above or below, so that the autocorrelation of a column is largest at
/// a lag within a character.
fn usual_height_if_sparse(profiles: &[ColumnProfile], column_pitch: f64) -> Option<usize> {
    let [shortest, longest] = ROW_PITCHES.map(|share| share * column_pitch);
    let (mut inked, mut all) = (0, 0);
    let mut heights = Vec::new();
    for profile in profiles.iter().filter(|profile| !profile.is_strip) {
        all += profile.lines.len();
        for run in profile.lines.split(|line| *line < INKED_LINE) {
            inked += run.len();
            if (shortest..=longest).contains(&(run.len() as f64)) {
                heights.push(run.len());
            }
        }
    }
    if inked as f64 > FEW_LINES * all as f64 || heights.len() < MIN_HEIGHTS {
        return None;
    }
    heights.sort_unstable();
    Some(heights[(USUAL_HEIGHT * heights.len() as f64) as usize])
}

/// Returns the lag at which the columns are most like themselves.
pub(super) fn row_pitch(profiles: &[ColumnProfile], column_pitch: f64) -> f64 {
    let mut lags = ROW_PITCHES.map(|share| (share * column_pitch) as usize);
    if let Some(height) = usual_height_if_sparse(profiles, column_pitch) {
        lags[0] = height;
    }
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
