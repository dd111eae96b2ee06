//! The soft ink of a page: 1 on ink, 0 on the sheet and on the scanner's bed.

use rayon::prelude::*;

use super::error::BlockError;
use mocban_core::domain::cancel::ThreadToken;
use mocban_core::raster::blur::gaussian_blur;
use mocban_core::raster::otsu;
use mocban_core::raster::{Grid, PrintImage};

/// Cells along the longer side of the page, in which the brightness of the sheet is estimated: about 1 mm each.
const CELLS: usize = 400;
/// Pixels per side of a cell that are looked at.
const SAMPLES: usize = 6;
/// The brightness of a cell is this quantile of its pixels.
const SHEET_QUANTILE: f64 = 0.9;
/// Strokes and rules narrower than twice this many cells are removed from the sheet.
const CLOSING: usize = 4;
/// Blur of the sheet, cells.
const SHEET_BLUR: f64 = 3.0;
/// Cells darker than this fraction of the bright cells are bed, not sheet.
const BED_SHARE: f32 = 0.55;
/// Cells this near to the bed hold no ink: the edge of the sheet.
const BED_RIM: usize = 1;
/// Width of the ramp of soft ink, as a fraction of the difference between ink and sheet.
const RAMP: f64 = 0.5;
/// Least darkness of ink in relation to the sheet.
const MIN_CONTRAST: f64 = 0.12;

/// Soft ink of a page and smaller copies of it, each of half the size.
#[derive(Debug, Clone)]
pub struct PageInk {
    levels: Vec<Grid<u8>>,
}

impl PageInk {
    /// Finds the ink of a page.
    ///
    /// # Errors
    /// Returns an error if the image has no ink.
    pub fn of(page: &PrintImage) -> Result<Self, BlockError> {
        let grey = grey(page);
        let darkness = Sheet::of(&grey).darkness(&grey);
        let (threshold, contrast) = threshold(&darkness)?;
        let ramp = (RAMP * contrast * 255.0).max(1.0);
        let low = threshold * 255.0 - ramp / 2.0;
        let table: Vec<u8> = (0..=255_u8)
            .map(|dark| {
                (255.0 * (f64::from(dark) - low) / ramp)
                    .clamp(0.0, 255.0)
                    .round() as u8
            })
            .collect();
        Ok(Self::of_soft(
            darkness.map(|dark| table[usize::from(*dark)]),
        ))
    }

    /// Creates the smaller copies of soft ink.
    pub fn of_soft(soft: Grid<u8>) -> Self {
        let mut levels = vec![soft];
        while let Some(last) = levels.last().filter(|l| l.width().min(l.height()) >= 64) {
            let half = halved(last);
            levels.push(half);
        }
        Self { levels }
    }

    /// Returns the soft ink in the pixels of the page, 0..=255.
    pub fn soft(&self) -> &Grid<u8> {
        &self.levels[0]
    }

    /// Returns the width and height of the page, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.levels[0].width(), self.levels[0].height()]
    }

    /// Returns the ink shrunk by 2 for each level, 0..=1.
    pub fn reduced(&self, level: usize) -> Grid<f32> {
        let level = &self.levels[level.min(self.levels.len() - 1)];
        level.map(|ink| f32::from(*ink) / 255.0)
    }

    /// Returns a sampler of means over about `footprint` pixels.
    pub fn sampler(&self, footprint: f64) -> InkSampler<'_> {
        let level = footprint.max(1.0).log2().round() as usize;
        let level = level.min(self.levels.len() - 1);
        InkSampler {
            ink: &self.levels[level],
            scale: (-(level as f64)).exp2(),
        }
    }
}

/// Samples one of the copies of the ink.
#[derive(Debug, Clone, Copy)]
pub struct InkSampler<'a> {
    ink: &'a Grid<u8>,
    scale: f64,
}

impl InkSampler<'_> {
    /// Returns the ink at a point of the page in pixels, 0..=1; `None` outside the page.
    #[inline]
    pub fn at(&self, [x, y]: [f64; 2]) -> Option<f32> {
        let x = ((x + 0.5) * self.scale - 0.5) as f32;
        let y = ((y + 0.5) * self.scale - 0.5) as f32;
        let (width, height) = (self.ink.width(), self.ink.height());
        // Half a pixel around the outer centres still belongs to the page.
        if !(x >= -0.5 && y >= -0.5 && x <= width as f32 - 0.5 && y <= height as f32 - 0.5) {
            return None;
        }
        let x = x.clamp(0.0, (width - 1) as f32);
        let y = y.clamp(0.0, (height - 1) as f32);
        let (left, top) = (x as usize, y as usize);
        let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
        let (across, down) = (x - left as f32, y - top as f32);
        let data = self.ink.data();
        let value = |x: usize, y: usize| f32::from(data[y * width + x]);
        let upper = value(left, top) + across * (value(right, top) - value(left, top));
        let lower = value(left, bottom) + across * (value(right, bottom) - value(left, bottom));
        Some((upper + down * (lower - upper)) / 255.0)
    }
}

/// Returns the brightness of each pixel, 0..=255.
fn grey(page: &PrintImage) -> Grid<u8> {
    let rgb = &page.rgb;
    let bright = |[r, g, b]: [u16; 3]| {
        let sum = 77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b);
        (sum >> 16) as u8
    };
    let mut grey = Grid::new(rgb.width(), rgb.height(), 0);
    let rows = grey.data_mut().par_chunks_mut(rgb.width().max(1));
    rows.enumerate().for_each(|(y, row)| {
        for (x, grey) in row.iter_mut().enumerate() {
            *grey = bright(rgb.at(x, y));
        }
    });
    grey
}

/// Brightness of the sheet around each cell; 0 on the bed.
struct Sheet {
    cell: usize,
    brightness: Grid<f32>,
}

impl Sheet {
    fn of(grey: &Grid<u8>) -> Self {
        let cell = grey.width().max(grey.height()).div_ceil(CELLS).max(1);
        let bright = cell_brightness(grey, cell);
        let closed = closed(&bright, CLOSING);
        let mut sorted = closed.data().to_vec();
        sorted.sort_by(f32::total_cmp);
        let paper = sorted[sorted.len() * 9 / 10];
        let is_bed = closed.map(|value| *value < BED_SHARE * paper);
        let is_sheet = filtered(
            &is_bed.map(|bed| f32::from(u8::from(*bed))),
            BED_RIM,
            f32::max,
        )
        .map(|bed| 1.0 - bed);
        let weighted = closed.zip_map(&is_sheet, |value, sheet| value * sheet);
        let sums = gaussian_blur(&weighted, SHEET_BLUR);
        let weights = gaussian_blur(&is_sheet, SHEET_BLUR);
        let mean = sums.zip_map(&weights, |sum, weight| sum / weight.max(1e-3));
        Self {
            cell,
            brightness: mean.zip_map(&is_sheet, |mean, sheet| mean * sheet),
        }
    }

    /// Returns the fraction of light that the ink takes, in 255ths; 0 on the bed.
    fn darkness(&self, grey: &Grid<u8>) -> Grid<u8> {
        let width = grey.width();
        let mut dark = vec![0_u8; width * grey.height()];
        let token = ThreadToken::current();
        let darken = |y: usize, row: &mut [u8]| {
            let levels = self.row(y, width);
            for ((out, value), sheet) in row.iter_mut().zip(grey.row(y)).zip(&levels) {
                let share = 1.0 - f32::from(*value) / sheet.max(1.0);
                *out = if *sheet > 0.0 {
                    (share.max(0.0) * 255.0) as u8
                } else {
                    0
                };
            }
        };
        dark.par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| token.scope(|| darken(y, row)));
        Grid::from_vec(width, grey.height(), dark).expect("one value for each pixel")
    }

    /// Returns the brightness of the sheet along a row of pixels, by bilinear interpolation.
    fn row(&self, y: usize, width: usize) -> Vec<f32> {
        let cells = &self.brightness;
        let cell_at = |pixel: usize, count: usize| {
            let at = (pixel as f32 + 0.5) / self.cell as f32 - 0.5;
            let at = at.clamp(0.0, count as f32 - 1.0);
            (at as usize, (at as usize + 1).min(count - 1), at.fract())
        };
        // Where one of the cells is bed, the nearest cell decides.
        let mix = |a: f32, b: f32, share: f32| {
            if a == 0.0 || b == 0.0 {
                if share < 0.5 { a } else { b }
            } else {
                a + share * (b - a)
            }
        };
        let (top, bottom, down) = cell_at(y, cells.height());
        let rows = cells.row(top).iter().zip(cells.row(bottom));
        let levels: Vec<f32> = rows.map(|(a, b)| mix(*a, *b, down)).collect();
        (0..width)
            .map(|x| {
                let (left, right, across) = cell_at(x, levels.len());
                mix(levels[left], levels[right], across)
            })
            .collect()
    }
}

/// Returns a high quantile of the pixels of each cell.
fn cell_brightness(grey: &Grid<u8>, cell: usize) -> Grid<f32> {
    let (columns, rows) = (grey.width().div_ceil(cell), grey.height().div_ceil(cell));
    let step = cell.div_ceil(SAMPLES);
    let mut pixels = Vec::new();
    Grid::from_fn(columns, rows, |x, y| {
        pixels.clear();
        for row in (y * cell..((y + 1) * cell).min(grey.height())).step_by(step) {
            let last = ((x + 1) * cell).min(grey.width());
            pixels.extend(
                (x * cell..last)
                    .step_by(step)
                    .map(|column| grey.at(column, row)),
            );
        }
        let rank = (SHEET_QUANTILE * (pixels.len() - 1) as f64).round() as usize;
        f32::from(*pixels.select_nth_unstable(rank).1)
    })
}

/// Returns the closing of brightness: dark parts narrower than twice `reach` become as bright as their surroundings.
fn closed(cells: &Grid<f32>, reach: usize) -> Grid<f32> {
    filtered(&filtered(cells, reach, f32::max), reach, f32::min)
}

/// Combines the values within `reach` columns and rows of each cell.
fn filtered(cells: &Grid<f32>, reach: usize, combine: fn(f32, f32) -> f32) -> Grid<f32> {
    let along_rows = |cells: &Grid<f32>| {
        Grid::from_fn(cells.width(), cells.height(), |x, y| {
            let row = &cells.row(y)[x.saturating_sub(reach)..(x + reach + 1).min(cells.width())];
            row.iter().copied().fold(cells.at(x, y), combine)
        })
    };
    along_rows(&along_rows(cells).transposed()).transposed()
}

/// Returns the threshold between sheet and ink, and the difference between the two, as fractions of the light.
fn threshold(darkness: &Grid<u8>) -> Result<(f64, f64), BlockError> {
    let step = (darkness.data().len() / 200_000).max(1);
    let samples = darkness.data().iter().step_by(step);
    let mut values: Vec<f32> = samples.map(|dark| f32::from(*dark) / 255.0).collect();
    let split = otsu::split(&mut values);
    let contrast = split.map_or(0.0, |split| split.high - split.low);
    match split {
        Some(split) if contrast >= MIN_CONTRAST => Ok((split.threshold, contrast)),
        _ => Err(BlockError::NoInk {
            found: format!(
                "its darkest parts take {:.0} % of the light",
                100.0 * contrast
            ),
        }),
    }
}

/// Returns the means of 2 x 2 pixels; an odd last row or column is left out.
fn halved(ink: &Grid<u8>) -> Grid<u8> {
    let (width, height) = (ink.width() / 2, ink.height() / 2);
    let mut half = vec![0_u8; width * height];
    let token = ThreadToken::current();
    let halve = |y: usize, row: &mut [u8]| {
        let (upper, lower) = (ink.row(2 * y), ink.row(2 * y + 1));
        for (x, out) in row.iter_mut().enumerate() {
            let sum = |row: &[u8]| u16::from(row[2 * x]) + u16::from(row[2 * x + 1]);
            *out = ((sum(upper) + sum(lower) + 2) / 4) as u8;
        }
    };
    half.par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| token.scope(|| halve(y, row)));
    Grid::from_vec(width, height, half).expect("one value for each pixel")
}

#[cfg(test)]
mod tests {
    use super::PageInk;
    use crate::block::BlockError;
    use mocban_core::raster::{Grid, PrintImage};

    /// Strokes every 20 pixels on a sheet that is darker at the right, on a scanner's bed of 60 pixels.
    fn page(ink: u16, bed: u16) -> PrintImage {
        let rgb = Grid::from_fn(800, 600, |x, y| {
            let is_bed = x < 60 || y < 60;
            let sheet = 220 - (x / 20) as u16;
            let is_stroke = is_ink(x, y);
            let grey = if is_bed {
                bed
            } else if is_stroke {
                sheet * ink / 100
            } else {
                sheet
            };
            [grey * 257; 3]
        });
        rgb.into()
    }

    fn is_ink(x: usize, y: usize) -> bool {
        x > 100 && y > 100 && x % 20 < 5 && y % 50 < 40
    }

    #[test]
    fn ink_is_found_on_uneven_sheets_and_not_on_the_bed() {
        for bed in [10, 230] {
            let ink = PageInk::of(&page(30, bed)).unwrap();
            for (x, y) in [
                (30, 300),
                (400, 30),
                (110, 300),
                (700, 500),
                (123, 310),
                (763, 510),
            ] {
                let soft = ink.soft().at(x, y);
                let expected = is_ink(x, y);
                assert_eq!(soft > 127, expected, "{x} {y}: {soft}, bed {bed}");
            }
        }
    }

    #[test]
    fn an_empty_page_has_no_ink() {
        let empty = PageInk::of(&page(100, 215));
        assert!(matches!(empty, Err(BlockError::NoInk { .. })));
    }

    #[test]
    fn samples_are_means_over_the_footprint() {
        let ink = PageInk::of_soft(Grid::from_fn(
            256,
            256,
            |x, _| if x < 128 { 255 } else { 0 },
        ));
        for footprint in [1.0, 4.0] {
            let sampler = ink.sampler(footprint);
            assert_eq!(sampler.at([60.0, 60.0]), Some(1.0));
            assert_eq!(sampler.at([127.5, 60.0]), Some(0.5));
            assert_eq!(sampler.at([-3.0, 60.0]), None);
        }
    }
}
