//! Sizes of the parts of a page.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::kind::BlockRanges;
use crate::draw::within;

/// Most characters of a page, without notes.
const MAX_CELLS: usize = 520;
/// Fewest and most rows of a column.
const ROWS: [usize; 2] = [7, 22];
/// Fewest columns.
const MIN_COLUMNS: usize = 4;

/// Sizes of the parts of a page, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct PageMeasures {
    /// Distance of two rows.
    pub row_pitch: f64,
    /// Distance of two columns.
    pub column_pitch: f64,
    /// Number of rows of full-size characters.
    pub rows: usize,
    /// Number of columns without the middle strip.
    pub columns: usize,
    /// Width of the middle strip; 0 without one.
    pub strip: f64,
    /// Gap between the outer and the inner rule of the frame.
    pub frame_gap: f64,
    /// Half the width of the frame's outer rule.
    pub outer_half_width: f64,
    /// Half the width of the frame's inner rule.
    pub inner_half_width: f64,
}

impl PageMeasures {
    /// Returns the distance of the frame's outer rule from the inner one, mm.
    pub(super) fn outer_line(&self) -> f64 {
        self.inner_half_width + self.frame_gap + self.outer_half_width
    }

    /// Draws the sizes of a page.
    pub(super) fn draw(ranges: &BlockRanges, is_folded: bool, rng: &mut ChaCha8Rng) -> Self {
        let [width_mm, height_mm] = ranges.text_mm.map(|[low, high]| low..high);
        let scale = within(ranges.scale, rng);
        let row_pitch = scale * rng.random_range(10.0..13.6);
        let height = rng.random_range(height_mm);
        let rows = ((height / row_pitch) as usize).clamp(ROWS[0], ROWS[1]);
        let column_pitch = row_pitch * rng.random_range(1.1..1.42);
        let strip = if is_folded {
            row_pitch * rng.random_range(0.75..1.0)
        } else {
            0.0
        };
        let width = rng.random_range(width_mm);
        let fitting = ((width - strip) / column_pitch) as usize;
        let columns = fitting.clamp(MIN_COLUMNS, (MAX_CELLS / rows).max(MIN_COLUMNS));
        Self {
            row_pitch,
            column_pitch,
            rows,
            // Both halves of a folded page have the same number of columns.
            columns: if is_folded {
                columns - columns % 2
            } else {
                columns
            },
            strip,
            frame_gap: rng.random_range(0.9..1.6),
            outer_half_width: rng.random_range(0.5..1.0),
            inner_half_width: rng.random_range(0.15..0.25),
        }
    }
}
