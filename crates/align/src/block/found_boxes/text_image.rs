//! Relief and ink of a face in a frame in which the text is upright.

use rayon::prelude::*;

use crate::block::align::CarvedFace;
use crate::block::face_layer::FACE_CELL;
use crate::block::height_map::HEIGHT_STEP_MM;
use crate::block::page_ink::PageInk;
use crate::block::page_map::{PageMap, points_of_row};
use mocban_core::domain::cancel::ThreadToken;
use mocban_core::raster::Grid;

/// Size of a pixel, mm: that of height maps.
pub(super) const PIXEL_MM: f64 = HEIGHT_STEP_MM;
/// Points of a row that are mapped exactly; those between are interpolated linearly.
const ROW_STEP: usize = 16;
/// Side of the cells in which relief and ink are compared, pixels.
const TRUST_CELL: usize = 16;
/// Cells around a cell that are compared with it: 17 mm across.
const TRUST_REACH: usize = 3;
/// Least correlation of relief and ink where the page is believed to show the relief.
const TRUST_NCC: f64 = 0.35;
/// Fraction of strokes below which a surrounding has no relief.
const NO_RELIEF: f64 = 0.02;

/// A frame on the face in which text is upright: x to the right and y down, in pixels of 0.15 mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TextFrame {
    /// The point of the face at pixel (0, 0), mm.
    pub(super) origin_mm: [f64; 2],
    /// Direction of x on the face, a unit vector.
    pub(super) right: [f64; 2],
    /// Number of columns and rows.
    pub(super) size: [usize; 2],
}

impl TextFrame {
    /// Returns the frame around the face whose x axis is turned from u to v by an angle in rad.
    pub(super) fn around(side: &CarvedFace, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        let face = &side.relief.face;
        let step = FACE_CELL as f64 * HEIGHT_STEP_MM;
        for [x, y] in face.row_ends() {
            for (right, down) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let u = side.map.origin_mm[0] + (x + right) as f64 * step;
                let v = side.map.origin_mm[1] + (y + down) as f64 * step;
                for (k, at) in [cos * u + sin * v, cos * v - sin * u]
                    .into_iter()
                    .enumerate()
                {
                    low[k] = low[k].min(at);
                    high[k] = high[k].max(at);
                }
            }
        }
        let size = [0, 1].map(|k: usize| (((high[k] - low[k]) / PIXEL_MM).max(0.0)) as usize + 1);
        Self {
            origin_mm: [cos * low[0] - sin * low[1], sin * low[0] + cos * low[1]],
            right: [cos, sin],
            size,
        }
    }

    /// Returns the point of the face at a pixel, mm.
    pub(super) fn face_from_pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [cos, sin] = self.right;
        let (x, y) = (x * PIXEL_MM, y * PIXEL_MM);
        [
            self.origin_mm[0] + cos * x - sin * y,
            self.origin_mm[1] + sin * x + cos * y,
        ]
    }
}

/// Images of the same strokes from the block and from the page.
#[derive(Debug, Clone)]
pub(super) struct TextImage {
    pub(super) frame: TextFrame,
    /// Soft relief, 0..=255; 0 outside the face.
    pub(super) relief: Grid<u8>,
    /// Soft ink, 0..=255; 0 outside the page.
    pub(super) ink: Grid<u8>,
    /// Which of the two images shows the text, in cells of [`TRUST_CELL`] pixels.
    pub(super) trust: Grid<Trust>,
}

/// Which image shows the text of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Trust {
    /// Relief and ink agree.
    Both,
    /// Only the relief: the page ends here or shows something else.
    Relief,
    /// Only the ink: the block is broken or not carved here.
    Ink,
}

impl TextImage {
    /// Samples relief and ink in a frame.
    pub(super) fn sample(
        side: &CarvedFace,
        page: &PageInk,
        map: &PageMap,
        frame: TextFrame,
    ) -> Self {
        let [width, height] = frame.size;
        let mut relief = vec![0_u8; width * height];
        let mut ink = vec![0_u8; width * height];
        let sampler = page.sampler(map.scale() * PIXEL_MM);
        let sample_row = |y: usize, relief: &mut [u8], ink: &mut [u8]| {
            sample_relief(side, &frame, y, relief);
            let points = page_points(map, &frame, y);
            for (ink, point) in ink.iter_mut().zip(points) {
                *ink = (sampler.at(point).unwrap_or(0.0) * 255.0 + 0.5) as u8;
            }
        };
        let token = ThreadToken::current();
        relief
            .par_chunks_mut(width)
            .zip(ink.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (relief, ink))| token.scope(|| sample_row(y, relief, ink)));
        let relief = Grid::from_vec(width, height, relief).expect("one value for each pixel");
        let ink = Grid::from_vec(width, height, ink).expect("one value for each pixel");
        let (columns, rows) = (width.div_ceil(TRUST_CELL), height.div_ceil(TRUST_CELL));
        let middle = |cell: usize| (cell * TRUST_CELL + TRUST_CELL / 2) as f64;
        let on_page = Grid::from_fn(columns, rows, |x, y| {
            let face = frame.face_from_pixel([middle(x), middle(y)]);
            sampler.at(map.page_from_face(face)).is_some()
        });
        let trust = compare(&relief, &ink, &on_page);
        Self {
            frame,
            relief,
            ink,
            trust,
        }
    }

    /// Returns which image shows the text at a pixel.
    pub(super) fn trust_at(&self, x: usize, y: usize) -> Trust {
        self.trust.at(x / TRUST_CELL, y / TRUST_CELL)
    }

    /// Returns the strokes of the image that shows the text, 0..=255.
    pub(super) fn strokes(&self) -> Grid<u8> {
        let width = self.relief.width();
        let mut strokes = self.ink.clone();
        for y in 0..self.relief.height() {
            let trust = self.trust.row(y / TRUST_CELL);
            let out = &mut strokes.data_mut()[y * width..][..width];
            for (cell, out) in out.chunks_mut(TRUST_CELL).enumerate() {
                if trust[cell] == Trust::Relief {
                    out.copy_from_slice(&self.relief.row(y)[cell * TRUST_CELL..][..out.len()]);
                }
            }
        }
        strokes
    }
}

/// Interpolates the relief along a row of the frame.
fn sample_relief(side: &CarvedFace, frame: &TextFrame, y: usize, out: &mut [u8]) {
    let soft = &side.relief.soft;
    let first = frame.face_from_pixel([0.0, y as f64]);
    let start =
        [0, 1].map(|k: usize| ((first[k] - side.map.origin_mm[k]) / HEIGHT_STEP_MM) as f32 * 256.0);
    let step = frame.right.map(|part| part as f32 * 256.0);
    let (width, height) = (soft.width() as i32, soft.height() as i32);
    let data = soft.data();
    for (x, out) in out.iter_mut().enumerate() {
        let at = [0, 1].map(|k: usize| (start[k] + x as f32 * step[k]) as i32);
        let [column, row] = at.map(|at| at >> 8);
        if column < 0 || row < 0 || column + 1 >= width || row + 1 >= height {
            continue;
        }
        let [right, down] = at.map(|at| at & 255);
        let place = (row * width + column) as usize;
        let value = |place: usize| i32::from(data[place]);
        let below = place + width as usize;
        let upper = value(place) * (256 - right) + value(place + 1) * right;
        let lower = value(below) * (256 - right) + value(below + 1) * right;
        *out = ((upper * (256 - down) + lower * down + (1 << 15)) >> 16) as u8;
    }
}

/// Returns the pixels of the page at a row of the frame.
fn page_points(map: &PageMap, frame: &TextFrame, y: usize) -> Vec<[f64; 2]> {
    points_of_row(frame.size[0], ROW_STEP, |x| {
        map.page_from_face(frame.face_from_pixel([x as f64, y as f64]))
    })
}

/// Sums of relief r, ink i, r r, i i, r i and the number of pixels.
pub(super) type Sums = [f64; 6];

/// Compares relief and ink around each cell.
fn compare(relief: &Grid<u8>, ink: &Grid<u8>, on_page: &Grid<bool>) -> Grid<Trust> {
    let (columns, rows) = (on_page.width(), on_page.height());
    let mut cells = vec![[0.0; 6]; columns * rows];
    let token = ThreadToken::current();
    let add_rows = |cell_y: usize, cells: &mut [Sums]| {
        for y in cell_y * TRUST_CELL..((cell_y + 1) * TRUST_CELL).min(relief.height()) {
            let relief = relief.row(y).chunks(TRUST_CELL);
            let ink = ink.row(y).chunks(TRUST_CELL);
            for ((sums, relief), ink) in cells.iter_mut().zip(relief).zip(ink) {
                add(sums, relief, ink);
            }
        }
    };
    cells
        .par_chunks_mut(columns)
        .enumerate()
        .for_each(|(cell_y, cells)| token.scope(|| add_rows(cell_y, cells)));
    let cells = Grid::from_vec(columns, rows, cells).expect("sums of each cell");
    Grid::from_fn(columns, rows, |x, y| {
        let mut around = [0.0; 6];
        let reach = |at: usize, count: usize| {
            at.saturating_sub(TRUST_REACH)..(at + TRUST_REACH + 1).min(count)
        };
        for row in reach(y, rows) {
            for column in reach(x, columns).filter(|column| on_page.at(*column, row)) {
                let cell = cells.at(column, row);
                (0..6).for_each(|k| around[k] += cell[k]);
            }
        }
        let has_relief = around[0] > NO_RELIEF * 255.0 * around[5];
        let is_on_page = on_page.at(x, y);
        if is_on_page && !has_relief {
            Trust::Ink
        } else if is_on_page && correlation(&around) >= TRUST_NCC {
            Trust::Both
        } else {
            Trust::Relief
        }
    })
}

/// Adds a run of pixels to the sums of a cell.
pub(super) fn add(sums: &mut Sums, relief: &[u8], ink: &[u8]) {
    let mut whole = [0_u32; 5];
    for (r, i) in relief.iter().zip(ink) {
        let (r, i) = (u32::from(*r), u32::from(*i));
        whole[0] += r;
        whole[1] += i;
        whole[2] += r * r;
        whole[3] += i * i;
        whole[4] += r * i;
    }
    for (sum, whole) in sums.iter_mut().zip(whole) {
        *sum += f64::from(whole);
    }
    sums[5] += relief.len() as f64;
}

/// Returns the correlation of relief and ink; 0 if one of them is even.
pub(super) fn correlation([r, i, rr, ii, ri, count]: &Sums) -> f64 {
    let energy = (rr - r * r / count) * (ii - i * i / count);
    if energy > 0.0 {
        (ri - r * i / count) / energy.sqrt()
    } else {
        0.0
    }
}
