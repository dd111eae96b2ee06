//! Local shifts between the relief of a face and the ink of its page: normalized cross-correlation of windows.

use rayon::prelude::*;

use super::face_layer::FACE_CELL;
use super::height_map::{HEIGHT_STEP_MM, HeightMap};
use super::page_ink::PageInk;
use super::page_map::PageMap;
use super::relief::Relief;
use crate::raster::Grid;
use crate::simd::dispatch;

/// Shifts that are correlated together, one per lane.
const LANES: usize = 8;
/// Windows need this share of their pixels on the face and on the page.
const MIN_SHARE: f32 = 0.35;
/// Windows need this variance of the relief: about one stroke.
const MIN_VARIANCE: f32 = 0.01;

/// Sizes of one round of windows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WindowSizes {
    /// Pixels of the height map per pixel of the windows.
    pub(super) shrink: usize,
    /// Side of a window, mm.
    pub(super) side_mm: f64,
    /// Distance between the middles of windows, mm.
    pub(super) step_mm: f64,
    /// Largest shift, mm.
    pub(super) reach_mm: f64,
}

/// The best shift of one window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowMatch {
    /// Middle of the window on the face, mm.
    pub at: [f64; 2],
    /// Shift of the ink against the relief, mm: the relief at `at` is printed where the map has `at + shift`.
    pub shift: [f64; 2],
    /// Normalized cross-correlation at this shift, at most 1.
    pub ncc: f64,
    /// How sharply the correlation falls along x and y, and its mixed derivative, per pixel squared.
    pub curvature: [f64; 3],
}

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
        means
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| {
                for dy in 0..shrink {
                    let pixels = soft.row(y * shrink + dy).chunks_exact(shrink);
                    for (out, pixels) in row.iter_mut().zip(pixels) {
                        let sum: u32 = pixels.iter().map(|p| u32::from(*p)).sum();
                        *out += sum as f32 * scale;
                    }
                }
            });
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
}

/// The ink of a page in the pixels of a shrunk relief, with a border of `border` pixels.
#[derive(Debug, Clone)]
pub(super) struct WarpedInk {
    border: usize,
    /// Ink, 0..=1; 0 outside the page.
    ink: Grid<f32>,
    /// Whether a pixel lies on the page.
    on_page: Grid<bool>,
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
        ink.par_chunks_mut(width)
            .zip(on_page.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (ink, on_page))| {
                let v = first(1) + y as f64 * relief.pixel_mm;
                let points = map.row([first(0), v], relief.pixel_mm, width);
                for ((ink, on_page), point) in ink.iter_mut().zip(on_page).zip(points) {
                    if let Some(value) = sampler.at(point) {
                        (*ink, *on_page) = (value, true);
                    }
                }
            });
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

/// Finds the best shifts of windows on a regular grid over the face. Windows with too little face, page or relief are
/// left out.
pub(super) fn match_windows(
    relief: &ShrunkRelief,
    page: &PageInk,
    map: &PageMap,
    sizes: &WindowSizes,
) -> Vec<WindowMatch> {
    let Some([left, top, right, bottom]) = relief.face_bounds() else {
        return Vec::new();
    };
    let reach = (sizes.reach_mm / relief.pixel_mm).ceil() as usize;
    let warped = WarpedInk::of(relief, page, map, WarpedInk::border_for(reach));
    let half = (sizes.side_mm / relief.pixel_mm / 2.0).round() as usize;
    // Windows hang over the edges of the face by half of their size at most.
    let middles = |first: usize, last: usize| {
        let step = sizes.step_mm / relief.pixel_mm;
        let count = ((last - first) as f64 / step).round().max(1.0);
        (0..=count as usize)
            .map(move |k| first + (k as f64 * (last - first) as f64 / count).round() as usize)
    };
    let windows: Vec<Window> = middles(top, bottom - 1)
        .flat_map(|y| middles(left, right - 1).map(move |x| [x, y]))
        .map(|[x, y]| {
            let clip =
                |at: usize, count: usize| (at.saturating_sub(half), (at + half + 1).min(count));
            let (x0, x1) = clip(x, relief.soft.width());
            let (y0, y1) = clip(y, relief.soft.height());
            Window {
                first: [x0, y0],
                size: [x1 - x0, y1 - y0],
            }
        })
        .collect();
    windows
        .par_iter()
        .filter_map(|window| match_window(relief, &warped, *window, reach))
        .collect()
}

/// Finds the best shift of one window, at most `reach` pixels along each axis.
pub(super) fn match_window(
    relief: &ShrunkRelief,
    warped: &WarpedInk,
    window: Window,
    reach: usize,
) -> Option<WindowMatch> {
    let template = Template::of(relief, warped, window)?;
    let side = 2 * reach + 1;
    let scores = template.scores(warped, window, reach);
    let best = (0..side * side).max_by(|a, b| scores[*a].total_cmp(&scores[*b]))?;
    let (x, y) = (best % side, best / side);
    let at = |dx: i64, dy: i64| {
        let x = (x as i64 + dx).clamp(0, side as i64 - 1) as usize;
        let y = (y as i64 + dy).clamp(0, side as i64 - 1) as usize;
        f64::from(scores[y * side + x])
    };
    let ncc = at(0, 0);
    let xx = 2.0 * ncc - at(-1, 0) - at(1, 0);
    let yy = 2.0 * ncc - at(0, -1) - at(0, 1);
    let xy = (at(1, -1) + at(-1, 1) - at(1, 1) - at(-1, -1)) / 4.0;
    let parabola = |before: f64, after: f64, curvature: f64| {
        if curvature > 1e-9 {
            ((after - before) / (2.0 * curvature)).clamp(-0.5, 0.5)
        } else {
            0.0
        }
    };
    let offset = [
        x as f64 - reach as f64 + parabola(at(-1, 0), at(1, 0), xx),
        y as f64 - reach as f64 + parabola(at(0, -1), at(0, 1), yy),
    ];
    Some(WindowMatch {
        at: template.centre,
        shift: offset.map(|pixels| pixels * relief.pixel_mm),
        ncc,
        curvature: [xx, yy, xy],
    })
}

/// The relief of a window minus its mean; 0 outside the face and the page.
struct Template {
    values: Vec<f32>,
    norm: f32,
    /// Middle of the pixels that count, mm.
    centre: [f64; 2],
    /// Number of pixels that count, and those that are on the face.
    all: f32,
    weights: Option<Vec<f32>>,
}

impl Template {
    fn of(relief: &ShrunkRelief, warped: &WarpedInk, window: Window) -> Option<Self> {
        let [columns, rows] = window.size;
        let mut values = Vec::with_capacity(columns * rows);
        let mut weights = Vec::with_capacity(columns * rows);
        let (mut sum, mut squares, mut count) = (0.0_f64, 0.0_f64, 0_usize);
        let mut middle = [0.0_f64; 2];
        for y in window.first[1]..window.first[1] + rows {
            for x in window.first[0]..window.first[0] + columns {
                let border = warped.border;
                let counts = relief.face.at(x, y) && warped.on_page.at(x + border, y + border);
                let value = if counts { relief.soft.at(x, y) } else { 0.0 };
                if counts {
                    sum += f64::from(value);
                    squares += f64::from(value * value);
                    count += 1;
                    middle[0] += x as f64;
                    middle[1] += y as f64;
                }
                values.push(value);
                weights.push(f32::from(u8::from(counts)));
            }
        }
        let all = count as f64;
        if (count as f32) < MIN_SHARE * (columns * rows) as f32 {
            return None;
        }
        let mean = sum / all;
        let variance = squares / all - mean * mean;
        if variance < f64::from(MIN_VARIANCE) {
            return None;
        }
        for (value, weight) in values.iter_mut().zip(&weights) {
            *value = (*value - mean as f32) * weight;
        }
        let position = |k: usize| relief.origin_mm[k] + middle[k] / all * relief.pixel_mm;
        Some(Self {
            values,
            norm: (variance * all).sqrt() as f32,
            centre: [position(0), position(1)],
            all: count as f32,
            weights: (count < columns * rows).then_some(weights),
        })
    }

    /// Returns the normalized cross-correlation at each shift, row by row.
    fn scores(&self, warped: &WarpedInk, window: Window, reach: usize) -> Vec<f32> {
        let side = 2 * reach + 1;
        let mut scores = vec![-1.0_f32; side * side];
        let width = warped.ink.width();
        let [left, top] = window.first.map(|first| first + warped.border - reach);
        let ink = &warped.ink.data()[top * width + left..];
        // Without weights, the sums of all shifts come from one table.
        let table = self
            .weights
            .is_none()
            .then(|| SumTable::of(ink, width, window.size, side));
        for dy in 0..side {
            for shift in (0..side).step_by(LANES) {
                let ink = &ink[dy * width + shift..];
                let (products, sums, squares) = match (&self.weights, &table) {
                    (Some(weights), _) => {
                        let [products, sums, squares] = dispatch!(weighted_sums(
                            &self.values,
                            weights,
                            window.size,
                            ink,
                            width
                        ));
                        (products, sums, squares)
                    }
                    (None, table) => {
                        let products =
                            dispatch!(sums_of_products(&self.values, window.size, ink, width));
                        let last = side - 1;
                        let at = |k: usize| {
                            table
                                .as_ref()
                                .map_or([0.0; 2], |t| t.sums((shift + k).min(last), dy))
                        };
                        let sums: [[f32; 2]; LANES] = std::array::from_fn(at);
                        (
                            products,
                            sums.map(|[sum, _]| sum),
                            sums.map(|[_, squares]| squares),
                        )
                    }
                };
                for k in 0..LANES.min(side - shift) {
                    let energy = squares[k] - sums[k] * sums[k] / self.all;
                    if energy > 1e-3 * self.all {
                        scores[dy * side + shift + k] = products[k] / (self.norm * energy.sqrt());
                    }
                }
            }
        }
        scores
    }
}

/// Sums of ink and of its squares over rectangles: a summed-area table of the reach of one window.
struct SumTable {
    width: usize,
    size: [usize; 2],
    /// Sums over all pixels above and to the left.
    sums: Vec<[f64; 2]>,
}

impl SumTable {
    fn of(ink: &[f32], ink_width: usize, size: [usize; 2], side: usize) -> Self {
        let width = size[0] + side;
        let height = size[1] + side;
        let mut sums = vec![[0.0; 2]; width * height];
        for y in 1..height {
            let mut along = [0.0_f64; 2];
            for x in 1..width {
                let value = f64::from(ink[(y - 1) * ink_width + x - 1]);
                along = [along[0] + value, along[1] + value * value];
                let above = sums[(y - 1) * width + x];
                sums[y * width + x] = [above[0] + along[0], above[1] + along[1]];
            }
        }
        Self { width, size, sums }
    }

    /// Returns the sums of the window shifted by (x, y).
    fn sums(&self, x: usize, y: usize) -> [f32; 2] {
        let at = |x: usize, y: usize| self.sums[y * self.width + x];
        let (right, bottom) = (x + self.size[0], y + self.size[1]);
        let corners = [at(right, bottom), at(x, y), at(x, bottom), at(right, y)];
        [0, 1]
            .map(|k: usize| (corners[0][k] + corners[1][k] - corners[2][k] - corners[3][k]) as f32)
    }
}

/// Returns the sums of template times ink for [`LANES`] shifts to the right.
#[inline(always)]
fn sums_of_products(
    template: &[f32],
    [columns, _]: [usize; 2],
    ink: &[f32],
    ink_width: usize,
) -> [f32; LANES] {
    let mut products = [0.0; LANES];
    for (y, template) in template.chunks_exact(columns).enumerate() {
        let row = &ink[y * ink_width..][..columns + LANES];
        for (x, value) in template.iter().enumerate() {
            let pixels: &[f32; LANES] = row[x..x + LANES].try_into().expect("a run of pixels");
            for k in 0..LANES {
                products[k] += value * pixels[k];
            }
        }
    }
    products
}

/// Returns the sums of template times ink, of the ink, and of its squares, for [`LANES`] shifts to the right. Only pixels
/// with a weight count.
#[inline(always)]
fn weighted_sums(
    template: &[f32],
    weights: &[f32],
    [columns, _]: [usize; 2],
    ink: &[f32],
    ink_width: usize,
) -> [[f32; LANES]; 3] {
    let (mut products, mut sums, mut squares) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let rows = template
        .chunks_exact(columns)
        .zip(weights.chunks_exact(columns));
    for (y, (template, weights)) in rows.enumerate() {
        let row = &ink[y * ink_width..][..columns + LANES];
        for (x, (value, weight)) in template.iter().zip(weights).enumerate() {
            let pixels: &[f32; LANES] = row[x..x + LANES].try_into().expect("a run of pixels");
            for k in 0..LANES {
                let counted = weight * pixels[k];
                products[k] += value * pixels[k];
                sums[k] += counted;
                squares[k] += counted * pixels[k];
            }
        }
    }
    [products, sums, squares]
}

#[cfg(test)]
mod tests {
    use super::super::test_world::{SIDES_MM, TestWorld};
    use super::{
        ShrunkRelief, SumTable, Template, WarpedInk, Window, WindowSizes, match_window,
        match_windows,
    };
    use crate::block::PageMap;
    use crate::domain::Affine2;

    const SIZES: WindowSizes = WindowSizes {
        shrink: 2,
        side_mm: 18.0,
        step_mm: 20.0,
        reach_mm: 1.5,
    };

    /// A world and its page, and a map that is wrong by 0.62 mm and -0.47 mm.
    fn shifted() -> (ShrunkRelief, super::PageInk, PageMap) {
        let world = TestWorld::new(8);
        let face = world.face();
        let truth = Affine2::scale_shift(8.0, [40.0, 40.0]);
        let page = world.affine_page([1280, 880], &truth);
        let wrong = Affine2::scale_shift(8.0, [40.0 - 8.0 * 0.62, 40.0 + 8.0 * 0.47]);
        let map = PageMap::affine(&wrong, [0.0; 2], SIDES_MM);
        (
            ShrunkRelief::of(&face.map, &face.relief, SIZES.shrink),
            page,
            map,
        )
    }

    #[test]
    fn windows_find_the_shift_to_a_tenth_of_a_pixel() {
        let (relief, page, map) = shifted();
        let windows = match_windows(&relief, &page, &map, &SIZES);
        assert!(windows.len() > 30);
        for window in windows {
            let [dx, dy] = [window.shift[0] - 0.62, window.shift[1] + 0.47];
            assert!(dx.hypot(dy) < 0.06, "{window:?}");
            assert!(window.ncc > 0.8, "{window:?}");
        }
    }

    #[test]
    fn scores_are_those_of_the_definition() {
        let (relief, page, map) = shifted();
        let reach = 5;
        let warped = WarpedInk::of(&relief, &page, &map, WarpedInk::border_for(reach));
        // The second window hangs over the edge of the face.
        for first in [[100, 80], [0, 0]] {
            let window = Window {
                first,
                size: [41, 37],
            };
            let template = Template::of(&relief, &warped, window).unwrap();
            let scores = template.scores(&warped, window, reach);
            for (dx, dy) in [(0, 0), (5, 5), (10, 3), (7, 10)] {
                let mut sums = [0.0_f64; 6];
                for y in 0..37 {
                    for x in 0..41 {
                        let (column, row) = (first[0] + x, first[1] + y);
                        let border = warped.border;
                        if !relief.face.at(column, row)
                            || !warped.on_page.at(column + border, row + border)
                        {
                            continue;
                        }
                        let t = f64::from(relief.soft.at(column, row));
                        let i = f64::from(
                            warped
                                .ink
                                .at(column + border + dx - reach, row + border + dy - reach),
                        );
                        for (sum, value) in sums.iter_mut().zip([1.0, t, i, t * t, i * i, t * i]) {
                            *sum += value;
                        }
                    }
                }
                let [n, t, i, tt, ii, ti] = sums;
                let expected = (ti - t * i / n) / ((tt - t * t / n) * (ii - i * i / n)).sqrt();
                let found = f64::from(scores[dy * 11 + dx]);
                assert!((found - expected).abs() < 1e-3, "{found} {expected}");
            }
        }
    }

    #[test]
    fn a_window_without_relief_has_no_match() {
        let (relief, page, map) = shifted();
        let empty = ShrunkRelief {
            soft: relief.soft.map(|_| 0.0),
            ..relief
        };
        let warped = WarpedInk::of(&empty, &page, &map, WarpedInk::border_for(3));
        let window = Window {
            first: [50, 50],
            size: [40, 40],
        };
        assert!(match_window(&empty, &warped, window, 3).is_none());
    }

    #[test]
    fn sums_of_rectangles_come_from_the_table() {
        let ink: Vec<f32> = (0..400).map(|k| (k % 7) as f32 / 7.0).collect();
        let table = SumTable::of(&ink, 20, [6, 5], 8);
        let mut expected = [0.0; 2];
        for y in 3..8 {
            for x in 2..8 {
                let value = ink[y * 20 + x];
                expected = [expected[0] + value, expected[1] + value * value];
            }
        }
        let found = table.sums(2, 3);
        assert!((found[0] - expected[0]).abs() < 1e-4 && (found[1] - expected[1]).abs() < 1e-4);
    }
}
