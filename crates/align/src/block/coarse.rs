//! First positions of a page on a face: cross-correlation over rotations, scales and shifts by FFT.

use std::f64::consts::FRAC_PI_2;

use mocban_fft::Complex32;
use rayon::prelude::*;

use super::page_ink::PageInk;
use super::square_fft::{SIZE, SquareFft, quarter_turned};
use super::window_images::ShrunkRelief;
use mocban_core::domain::Affine2;
use mocban_core::domain::cancel::{ThreadToken, poll};
use mocban_core::raster::Grid;
use mocban_core::raster::blur::gaussian_blur;

/// Blurs whose difference keeps characters and their parts, mm.
const FINE_BLUR_MM: f64 = 0.9;
const WIDE_BLUR_MM: f64 = 12.0;

/// A position of a page on a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CoarsePosition {
    /// Maps points of the face in mm to pixels of the page.
    pub(super) page_from_face: Affine2,
    /// Normalized cross-correlation where page and face overlap.
    pub(super) score: f32,
}

/// The rotations and scales to search.
#[derive(Debug, Clone)]
pub(super) struct CoarseRange {
    /// Rotation of the outline of the face, from u to v, radians.
    pub(super) angle_rad: f64,
    /// Rotations apart from quarter turns, radians.
    pub(super) angles: Vec<f64>,
    /// Scales, page pixels per mm.
    pub(super) scales: Vec<f64>,
    /// Least fraction of the face's area that must lie on the page.
    pub(super) min_overlap: f32,
    /// Number of positions to return.
    pub(super) count: usize,
}

/// Returns the best positions of a page on a face, best first; of positions with neighbouring rotation and scale, only
/// the best.
pub(super) fn search(
    face: &ShrunkRelief,
    page: &PageInk,
    range: &CoarseRange,
) -> Vec<CoarsePosition> {
    let Some(template) = FaceTemplate::of(face, range.angle_rad) else {
        return Vec::new();
    };
    let fft = SquareFft::new();
    // All scales use the same pixel size, so the spectra of the face are computed once.
    let pixel_mm = pixel_size(face, page, range);
    let token = ThreadToken::current();
    let spectra: Vec<FaceSpectra> = range
        .angles
        .par_iter()
        .map(|angle| token.scope(|| template.spectra(*angle, pixel_mm, &fft)))
        .collect();
    let at_scale = |scale_at: usize, scale: &f64| {
        let target = PageTarget::of(page, *scale, pixel_mm, &fft);
        let mut found = Vec::with_capacity(4 * range.angles.len());
        for (angle_at, (angle, spectra)) in range.angles.iter().zip(&spectra).enumerate() {
            for turns in 0..4 {
                poll();
                let (score, shift) = target.best(spectra, turns, range.min_overlap, &fft);
                let rotation = angle + turns as f64 * FRAC_PI_2;
                let page_from_face = template.affine(rotation, shift, *scale, pixel_mm, &target);
                let position = CoarsePosition {
                    page_from_face,
                    score,
                };
                found.push((position, [scale_at, angle_at, turns]));
            }
        }
        found
    };
    let results: Vec<Vec<(CoarsePosition, [usize; 3])>> = (range.scales.par_iter())
        .enumerate()
        .map(|(scale_at, scale)| token.scope(|| at_scale(scale_at, scale)))
        .collect();
    let mut found: Vec<_> = results.into_iter().flatten().collect();
    found.sort_by(|a, b| b.0.score.total_cmp(&a.0.score));
    let mut kept: Vec<(CoarsePosition, [usize; 3])> = Vec::new();
    for candidate in found {
        let is_near = |other: &[usize; 3]| {
            let near = |k: usize| other[k].abs_diff(candidate.1[k]) <= 1;
            other[2] == candidate.1[2] && near(0) && near(1)
        };
        if !kept.iter().any(|(_, at)| is_near(at)) {
            kept.push(candidate);
        }
        if kept.len() == range.count {
            break;
        }
    }
    kept.into_iter().map(|(position, _)| position).collect()
}

/// Returns the pixel size at which face and page fit into the square next to each other, mm.
fn pixel_size(face: &ShrunkRelief, page: &PageInk, range: &CoarseRange) -> f64 {
    let bounds = face.face_bounds().unwrap_or_default();
    let side = (bounds[2] - bounds[0]).max(bounds[3] - bounds[1]) as f64 * face.pixel_mm;
    let smallest = range.scales.iter().copied().fold(f64::INFINITY, f64::min);
    let page_mm = page.size().map(|side| side as f64 / smallest);
    // Circular correlation: the sum of both extents must fit, less what need not be reached.
    let page_side = page_mm[0].max(page_mm[1]);
    (side.max(page_side) * 1.25).max((side + page_side) * 0.75) / SIZE as f64
}

/// The difference of Gaussians of a face, and its mask.
struct FaceTemplate {
    values: Grid<f32>,
    face: Grid<bool>,
    origin_mm: [f64; 2],
    pixel_mm: f64,
    /// Middle of the face and half of its width and height along its outline, mm.
    middle_mm: [f64; 2],
    half_extent_mm: [f64; 2],
}

/// Spectra of a rotated face, of its mask, and the area of the mask.
struct FaceSpectra {
    values: Vec<Complex32>,
    mask: Vec<Complex32>,
    /// Pixels of the face, and the sum of their squares.
    area: f32,
    energy: f32,
    /// Half of its width and height, pixels.
    half_extent: [f64; 2],
}

impl FaceTemplate {
    fn of(face: &ShrunkRelief, angle_rad: f64) -> Option<Self> {
        let [left, top, right, bottom] = face.face_bounds()?;
        let weights = face.face.map(|inside| f32::from(u8::from(*inside)));
        let values = difference_of_gaussians(&face.soft, &weights, face.pixel_mm);
        let middle = |first: usize, last: usize| (first + last) as f64 / 2.0 * face.pixel_mm;
        Some(Self {
            values,
            face: face.face.clone(),
            origin_mm: face.origin_mm,
            pixel_mm: face.pixel_mm,
            middle_mm: [
                face.origin_mm[0] + middle(left, right),
                face.origin_mm[1] + middle(top, bottom),
            ],
            half_extent_mm: half_extent(face, angle_rad),
        })
    }

    /// Rotates the face about its middle, which is placed at pixel (0, 0), and transforms it.
    fn spectra(&self, angle: f64, pixel_mm: f64, fft: &SquareFft) -> FaceSpectra {
        let (sin, cos) = angle.sin_cos();
        let mut square = vec![Complex32::default(); SIZE * SIZE];
        let (mut area, mut energy) = (0.0, 0.0);
        let half = SIZE as i64 / 2;
        for y in -half..half {
            let row = y.rem_euclid(SIZE as i64) as usize * SIZE;
            for x in -half..half {
                let (dx, dy) = (x as f64 * pixel_mm, y as f64 * pixel_mm);
                // The face is rotated by the angle, so a pixel shows the point rotated back.
                let u = self.middle_mm[0] + cos * dx + sin * dy;
                let v = self.middle_mm[1] - sin * dx + cos * dy;
                let column = ((u - self.origin_mm[0]) / self.pixel_mm).round();
                let line = ((v - self.origin_mm[1]) / self.pixel_mm).round();
                let (column, line) = (column as i64, line as i64);
                if self.face.get(column, line) == Some(true) {
                    let value = self.values.at(column as usize, line as usize);
                    square[row + x.rem_euclid(SIZE as i64) as usize] = Complex32::new(value, 1.0);
                    area += 1.0;
                    energy += value * value;
                }
            }
        }
        fft.forward(&mut square);
        // One transform of two real images: the even part of the spectrum belongs to the first one.
        let mut values = vec![Complex32::default(); SIZE * SIZE];
        let mut mask = vec![Complex32::default(); SIZE * SIZE];
        for u in 0..SIZE {
            for v in 0..SIZE {
                let here = square[u * SIZE + v];
                let there = square[(SIZE - u) % SIZE * SIZE + (SIZE - v) % SIZE].conj();
                values[u * SIZE + v] = (here + there) * 0.5;
                let odd = (here - there) * 0.5;
                mask[u * SIZE + v] = Complex32::new(odd.im, -odd.re);
            }
        }
        FaceSpectra {
            values,
            mask,
            area,
            energy,
            half_extent: self.half_extent_mm.map(|half| half / pixel_mm),
        }
    }

    /// Returns the map of a position to the page.
    fn affine(
        &self,
        rotation: f64,
        shift: [f64; 2],
        scale: f64,
        pixel_mm: f64,
        target: &PageTarget,
    ) -> Affine2 {
        let back = Affine2([
            [1.0, 0.0, -self.middle_mm[0]],
            [0.0, 1.0, -self.middle_mm[1]],
        ]);
        let pixels = pixel_mm * scale;
        let place = [0, 1].map(|k: usize| (shift[k] - target.offset[k]) * pixels);
        Affine2::similarity(scale, rotation, place).after(&back)
    }
}

/// The ink of a page at one scale, transformed.
struct PageTarget {
    /// Spectra of the ink and of its squares.
    ink: Vec<Complex32>,
    squares: Vec<Complex32>,
    /// First and last column, and first and last row of the page.
    bounds: [[f64; 2]; 2],
    /// Pixel of the square at which the page's pixel (0, 0) lies.
    offset: [f64; 2],
}

impl PageTarget {
    fn of(page: &PageInk, scale: f64, pixel_mm: f64, fft: &SquareFft) -> Self {
        let step = scale * pixel_mm;
        let sampler = page.sampler(step * 0.7);
        let size = page
            .size()
            .map(|side| ((side as f64 / step) as usize).min(SIZE - 1));
        let middle_px = page.size().map(|side| (side as f64 - 1.0) / 2.0);
        let offset = [0, 1].map(|k: usize| (SIZE / 2) as f64 - middle_px[k] / step);
        let mut ink = Grid::new(SIZE, SIZE, 0.0_f32);
        let mut weights = Grid::new(SIZE, SIZE, 0.0_f32);
        let begin = size.map(|side| SIZE / 2 - side / 2);
        for y in begin[1]..(begin[1] + size[1] + 1).min(SIZE) {
            for x in begin[0]..(begin[0] + size[0] + 1).min(SIZE) {
                let point = [(x as f64 - offset[0]) * step, (y as f64 - offset[1]) * step];
                if let Some(value) = sampler.at(point) {
                    ink.set(x, y, value);
                    weights.set(x, y, 1.0);
                }
            }
        }
        let values = difference_of_gaussians(&ink, &weights, pixel_mm);
        let spectrum = |values: &mut dyn Iterator<Item = f32>| {
            let mut square: Vec<Complex32> = values.map(|v| Complex32::new(v, 0.0)).collect();
            fft.forward(&mut square);
            square
        };
        Self {
            ink: spectrum(&mut values.data().iter().copied()),
            squares: spectrum(&mut values.data().iter().map(|v| v * v)),
            bounds: [0, 1].map(|k: usize| {
                let half = size[k] as f64 / 2.0;
                [(SIZE / 2) as f64 - half, (SIZE / 2) as f64 + half]
            }),
            offset,
        }
    }

    /// Returns the fraction of a face on the page along an axis, for each position of its middle.
    fn overlaps(&self, axis: usize, half: f64) -> Vec<f32> {
        let [first, last] = self.bounds[axis];
        let share = |at: usize| {
            let at = at as f64;
            let common = (at + half).min(last) - (at - half).max(first);
            (common / (2.0 * half)).clamp(0.0, 1.0) as f32
        };
        (0..SIZE).map(share).collect()
    }

    /// Returns the highest normalized correlation of a face, turned by quarter turns, and the pixel of its middle.
    fn best(
        &self,
        face: &FaceSpectra,
        turns: usize,
        min_overlap: f32,
        fft: &SquareFft,
    ) -> (f32, [f64; 2]) {
        let mut square = vec![Complex32::default(); SIZE * SIZE];
        let i = Complex32::new(0.0, 1.0);
        for u in 0..SIZE {
            for v in 0..SIZE {
                let from = quarter_turned(u, v, turns);
                let (values, mask) = (face.values[from].conj(), face.mask[from].conj());
                let at = u * SIZE + v;
                // Two real correlations in one inverse transform.
                square[at] = values * self.ink[at] + i * mask * self.squares[at];
            }
        }
        fft.inverse(&mut square);
        let scale = 1.0 / (SIZE * SIZE) as f32;
        let [half_x, half_y] = face.half_extent;
        let half = if turns.is_multiple_of(2) {
            [half_x, half_y]
        } else {
            [half_y, half_x]
        };
        let overlaps = [0, 1].map(|k: usize| self.overlaps(k, half[k]));
        // Ink below this mean square is noise.
        let floor = 1e-3 / 255.0 * face.area;
        let (mut best, mut best_at) = (f32::NEG_INFINITY, 0);
        let mut scores = [0.0_f32; SIZE];
        for (y, row) in square.chunks_exact(SIZE).enumerate() {
            // The overlap rises and falls along a row, so the places with enough of it follow each other.
            let is_enough = |overlap: &f32| overlap * overlaps[1][y] >= min_overlap;
            let Some(first) = overlaps[0].iter().position(is_enough) else {
                continue;
            };
            let row = &row[first..];
            let count = overlaps[0][first..].iter().take_while(|o| is_enough(o));
            let scores = &mut scores[..count.count()];
            for (score, both) in scores.iter_mut().zip(row) {
                let energy = (both.im * scale).max(floor) * face.energy;
                *score = both.re * scale / energy.sqrt();
            }
            for (x, score) in scores.iter().enumerate() {
                if *score > best {
                    (best, best_at) = (*score, y * SIZE + first + x);
                }
            }
        }
        // Spectra are transposed twice, so the result is in row-major order.
        let place = [best_at % SIZE, best_at / SIZE].map(|at| at as f64);
        (best, place)
    }
}

/// Returns half of the width and height of a face, whose outline is rotated by an angle, mm.
fn half_extent(face: &ShrunkRelief, angle_rad: f64) -> [f64; 2] {
    let (sin, cos) = angle_rad.sin_cos();
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for end in face.face.row_ends() {
        let [x, y] = end.map(|at| at as f64);
        for (bounds, at) in bounds
            .iter_mut()
            .zip([cos * x + sin * y, cos * y - sin * x])
        {
            *bounds = [bounds[0].min(at), bounds[1].max(at)];
        }
    }
    bounds.map(|[low, high]| (high - low + 1.0).max(1.0) / 2.0 * face.pixel_mm)
}

/// Returns the difference of two blurs of the values, where `weights` are set; 0 elsewhere.
fn difference_of_gaussians(values: &Grid<f32>, weights: &Grid<f32>, pixel_mm: f64) -> Grid<f32> {
    let blurred = |sigma_mm: f64| {
        let sums = gaussian_blur(&values.zip_map(weights, |v, w| v * w), sigma_mm / pixel_mm);
        let weights = gaussian_blur(weights, sigma_mm / pixel_mm);
        sums.zip_map(&weights, |sum, weight| sum / weight.max(1e-3))
    };
    let (fine, wide) = (blurred(FINE_BLUR_MM), blurred(WIDE_BLUR_MM));
    let difference = fine.zip_map(&wide, |fine, wide| fine - wide);
    difference.zip_map(weights, |value, weight| value * weight)
}
