//! The images that windows compare: a shrunk relief, and the ink of the page in its pixels.

use rayon::prelude::*;

use super::face_layer::FACE_CELL;
use super::height_map::{HEIGHT_STEP_MM, HeightMap};
use super::page_ink::PageInk;
use super::page_map::PageMap;
use super::relief::Relief;
use mocban_core::domain::Affine2;
use mocban_core::domain::cancel::ThreadToken;
use mocban_core::raster::Grid;

/// Shifts that are correlated together, one per lane.
pub(super) const LANES: usize = 8;

/// A face shrunk for a round of windows.
#[derive(Debug, Clone)]
pub(super) struct ShrunkRelief {
    /// Soft strokes, 0..=1.
    pub(super) soft: Grid<f32>,
    /// Whether a pixel belongs to the face.
    pub(super) face: Grid<bool>,
    /// Middle of the top-left pixel, mm.
    pub(super) origin_mm: [f64; 2],
    /// Size of a pixel, mm.
    pub(super) pixel_mm: f64,
}

impl ShrunkRelief {
    /// Returns the means of `shrink` x `shrink` pixels of the relief.
    pub(super) fn of(map: &HeightMap, relief: &Relief, shrink: usize) -> Self {
        let soft = &relief.soft;
        let (width, height) = (soft.width() / shrink, soft.height() / shrink);
        let mut means = vec![0.0_f32; width * height];
        let scale = 1.0 / (255 * shrink * shrink) as f32;
        let token = ThreadToken::current();
        let add_rows = |y: usize, row: &mut [f32]| {
            for dy in 0..shrink {
                let pixels = soft.row(y * shrink + dy).chunks_exact(shrink);
                for (out, pixels) in row.iter_mut().zip(pixels) {
                    let sum: u32 = pixels.iter().map(|p| u32::from(*p)).sum();
                    *out += sum as f32 * scale;
                }
            }
        };
        means
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| token.scope(|| add_rows(y, row)));
        let cell = |at: usize| (at * shrink + shrink / 2) / FACE_CELL;
        let face =
            |x: usize, y: usize| relief.face.get(cell(x) as i64, cell(y) as i64) == Some(true);
        let middle = (shrink as f64 - 1.0) / 2.0 * HEIGHT_STEP_MM;
        Self {
            soft: Grid::from_vec(width, height, means).expect("one mean for each pixel"),
            face: Grid::from_fn(width, height, face),
            origin_mm: map.origin_mm.map(|origin| origin + middle),
            pixel_mm: shrink as f64 * HEIGHT_STEP_MM,
        }
    }

    /// Returns the first and last column and row of the face; `None` if it is empty.
    pub(super) fn face_bounds(&self) -> Option<[usize; 4]> {
        let bounds = self.face.bounding_box()?;
        Some([bounds.x0, bounds.y0, bounds.x1, bounds.y1])
    }

    /// Returns an affine map to the page (from mm to pixels) as a map over the face; `None` if there is no face.
    pub(super) fn page_map(&self, page_from_face: &Affine2) -> Option<PageMap> {
        let [left, top, right, bottom] = self.face_bounds()?;
        let place = |pixel: [usize; 2]| {
            [0, 1].map(|k: usize| self.origin_mm[k] + pixel[k] as f64 * self.pixel_mm)
        };
        let (low, high) = (place([left, top]), place([right, bottom]));
        Some(PageMap::affine(page_from_face, low, high))
    }
}

/// The ink of a page in the pixels of a shrunk relief, with a border of `border` pixels.
#[derive(Debug, Clone)]
pub(super) struct WarpedInk {
    /// Width of the border, pixels.
    pub(super) border: usize,
    /// Ink, 0..=1; 0 outside the page.
    pub(super) ink: Grid<f32>,
    /// Whether a pixel lies on the page.
    pub(super) on_page: Grid<bool>,
}

impl WarpedInk {
    /// Returns the border that shifts of up to `reach` pixels need.
    pub(super) const fn border_for(reach: usize) -> usize {
        reach + 1 + LANES
    }

    /// Samples the ink of the page at each pixel of the relief.
    pub(super) fn of(relief: &ShrunkRelief, page: &PageInk, map: &PageMap, border: usize) -> Self {
        let (width, height) = (
            relief.soft.width() + 2 * border,
            relief.soft.height() + 2 * border,
        );
        let sampler = page.sampler(map.scale() * relief.pixel_mm);
        let mut ink = vec![0.0_f32; width * height];
        let mut on_page = vec![false; width * height];
        let first = |k: usize| relief.origin_mm[k] - border as f64 * relief.pixel_mm;
        let token = ThreadToken::current();
        let warp_row = |y: usize, ink: &mut [f32], on_page: &mut [bool]| {
            let v = first(1) + y as f64 * relief.pixel_mm;
            let points = map.row([first(0), v], relief.pixel_mm, width);
            for ((ink, on_page), point) in ink.iter_mut().zip(on_page).zip(points) {
                if let Some(value) = sampler.at(point) {
                    (*ink, *on_page) = (value, true);
                }
            }
        };
        ink.par_chunks_mut(width)
            .zip(on_page.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (ink, on_page))| token.scope(|| warp_row(y, ink, on_page)));
        Self {
            border,
            ink: Grid::from_vec(width, height, ink).expect("one value for each pixel"),
            on_page: Grid::from_vec(width, height, on_page).expect("one value for each pixel"),
        }
    }
}

/// A rectangle of pixels of a shrunk relief: first column and row, number of columns and rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    /// First column and row.
    pub(super) first: [usize; 2],
    /// Columns and rows.
    pub(super) size: [usize; 2],
}
