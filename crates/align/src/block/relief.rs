//! The soft relief of a face: 1 on the tops of strokes, 0 on carved ground.
//!
//! Tops lie on a smooth surface: the block is bowed and twisted by up to 2 mm over its length, and worn locally. A surface
//! of second degree is fitted under the tops, then corrected by what the highest points around each place show.

use nalgebra::{SMatrix, SVector};

use super::face_layer::{FACE_CELL, cells_of_face, face_angle};
use super::height_map::{HEIGHT_STEP_MM, HeightMap, NO_HEIGHT};
use mocban_core::domain::cancel::poll;
use mocban_core::raster::{Grid, Mask};

/// Side of the cells whose tops are fitted, in pixels of the height map: 4.05 mm. Each contains tops where there is text.
const CELL: usize = 27;
/// The height of a cell is this quantile of its heights, which spikes do not reach.
const TOP_QUANTILE: f64 = 0.95;
/// Residuals of the fit count a quarter at this scale, mm. Starts wide, so that the ground does not hold the surface down.
const SCALES_MM: [f64; 8] = [2.0, 1.2, 0.8, 0.5, 0.3, 0.2, 0.15, 0.12];
/// Cells this far below the surface are ground without tops, mm, and their weight in the fit.
const GROUND_MM: f64 = 1.0;
const GROUND_WEIGHT: f64 = 0.02;
/// Tops within this many cells around a cell are its tops: 20 mm across.
const DILATION: usize = 2;
/// Local correction of the surface, at most, mm.
const MAX_LOCAL_MM: f64 = 0.6;
/// Depth below the surface at which the soft relief is 0.5, and its softness, mm.
const EDGE_MM: f32 = 0.30;
const SOFTNESS_MM: f32 = 0.08;
/// Cells need heights in at least this fraction of their pixels.
const MIN_CELL_SHARE: f64 = 0.3;

/// One side of a block as an image of its strokes.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    /// Soft strokes, 0..=255, in the pixels of the height map, and 0 outside the face.
    pub soft: Grid<u8>,
    /// Cells of 4 x 4 pixels that belong to the face.
    pub face: Mask,
    /// Height of the surface under the tops, mm, at cells of 27 x 27 pixels.
    pub surface: Grid<f32>,
    /// Rotation of the face's outline in the frame of the height map, from u to v, radians.
    pub angle_rad: f64,
}

impl Relief {
    /// Computes the soft relief of a map that contains only a face; `None` if no surface fits it.
    pub fn of(map: &HeightMap) -> Option<Self> {
        let face = cells_of_face(map);
        let surface = top_surface(map, &face)?;
        let soft = soften(map, &face, &surface);
        Some(Self {
            soft,
            angle_rad: face_angle(&face),
            face,
            surface,
        })
    }

    /// Returns the fraction of the face that is carved ground, 0..=1: about 0 on a planed back, more than a half under text.
    pub fn carved_fraction(&self) -> f64 {
        let (mut ground, mut all) = (0_u64, 0_u64);
        for y in 0..self.soft.height() {
            for (x, soft) in self.soft.row(y).iter().enumerate() {
                if is_face(&self.face, x, y) {
                    all += 1;
                    ground += u64::from(*soft < 128);
                }
            }
        }
        ground as f64 / all.max(1) as f64
    }
}

/// Returns whether a pixel of the height map belongs to the face.
#[inline]
fn is_face(face: &Mask, x: usize, y: usize) -> bool {
    face.get((x / FACE_CELL) as i64, (y / FACE_CELL) as i64) == Some(true)
}

/// Fits the surface under the tops; returns its height at the middle of each cell.
fn top_surface(map: &HeightMap, face: &Mask) -> Option<Grid<f32>> {
    let tops = cell_tops(map, face);
    let fitted = fit_quadric(&tops)?;
    let columns = tops.width();
    let residuals = Grid::from_fn(columns, tops.height(), |x, y| {
        tops.at(x, y)
            .map(|top| f64::from(top) - fitted.dot(&terms(&tops, x, y)))
    });
    let local = highest_around(&residuals);
    let smooth = smoothed(&local);
    Some(Grid::from_fn(columns, tops.height(), |x, y| {
        (fitted.dot(&terms(&tops, x, y)) + smooth.at(x, y)) as f32
    }))
}

/// Returns a high quantile of the heights in each cell; `None` for cells with few heights on the face.
fn cell_tops(map: &HeightMap, face: &Mask) -> Grid<Option<f32>> {
    let heights = &map.heights;
    let (columns, rows) = (
        heights.width().div_ceil(CELL),
        heights.height().div_ceil(CELL),
    );
    let mut inside = Vec::with_capacity(CELL * CELL);
    Grid::from_fn(columns, rows, |cell_x, cell_y| {
        inside.clear();
        for y in cell_y * CELL..((cell_y + 1) * CELL).min(heights.height()) {
            for x in cell_x * CELL..((cell_x + 1) * CELL).min(heights.width()) {
                let height = heights.at(x, y);
                if height != NO_HEIGHT && is_face(face, x, y) {
                    inside.push(height);
                }
            }
        }
        if (inside.len() as f64) < MIN_CELL_SHARE * (CELL * CELL) as f64 {
            return None;
        }
        let rank = (TOP_QUANTILE * (inside.len() - 1) as f64) as usize;
        Some(*inside.select_nth_unstable_by(rank, f32::total_cmp).1)
    })
}

/// Returns the terms 1, x, y, x^2, x y and y^2 of a cell, with x and y in -1..=1.
fn terms<T: Copy>(cells: &Grid<T>, x: usize, y: usize) -> SVector<f64, 6> {
    let scaled = |at: usize, count: usize| 2.0 * (at as f64 + 0.5) / count as f64 - 1.0;
    let (x, y) = (scaled(x, cells.width()), scaled(y, cells.height()));
    SVector::from([1.0, x, y, x * x, x * y, y * y])
}

/// Fits a surface of second degree to the tops by reweighted least squares.
fn fit_quadric(tops: &Grid<Option<f32>>) -> Option<SVector<f64, 6>> {
    let mut samples = Vec::new();
    for y in 0..tops.height() {
        for x in 0..tops.width() {
            if let Some(top) = tops.at(x, y) {
                samples.push((terms(tops, x, y), f64::from(top)));
            }
        }
    }
    let mut sorted: Vec<f64> = samples.iter().map(|(_, top)| *top).collect();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() * 9 / 10)?;
    let mut fitted = SVector::from([upper, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for scale in SCALES_MM {
        let mut normal = SMatrix::<f64, 6, 6>::identity() * 1e-6;
        let mut right = normal * fitted;
        for (terms, top) in &samples {
            let above = top - fitted.dot(terms);
            let residual = above / scale;
            // Cells without tops do not hold the surface down, even where most cells have none.
            let ground = if above < -GROUND_MM {
                GROUND_WEIGHT
            } else {
                1.0
            };
            let weight = ground * (1.0 + residual * residual).powi(-2);
            normal += terms * terms.transpose() * weight;
            right += terms * (top * weight);
        }
        fitted = normal.cholesky()?.solve(&right);
    }
    Some(fitted)
}

/// Returns the highest residual around each cell, within the limits of a local correction; 0 where there is none.
fn highest_around(residuals: &Grid<Option<f64>>) -> Grid<f64> {
    Grid::from_fn(residuals.width(), residuals.height(), |x, y| {
        let reach =
            |at: usize, count: usize| at.saturating_sub(DILATION)..(at + DILATION + 1).min(count);
        let mut highest = None::<f64>;
        for row in reach(y, residuals.height()) {
            for column in reach(x, residuals.width()) {
                // A clamp or a lump is no top.
                if let Some(value) = residuals
                    .at(column, row)
                    .filter(|r| *r < 2.0 * MAX_LOCAL_MM)
                {
                    highest = Some(highest.map_or(value, |h| h.max(value)));
                }
            }
        }
        // Where there is only ground, the fitted surface alone says where tops would be.
        let of_tops = highest.filter(|highest| *highest > -GROUND_MM);
        of_tops.unwrap_or(0.0).clamp(-MAX_LOCAL_MM, MAX_LOCAL_MM)
    })
}

/// Blurs cells with the weights 1, 2, 1 along both axes.
fn smoothed(cells: &Grid<f64>) -> Grid<f64> {
    let along_rows = |cells: &Grid<f64>| {
        Grid::from_fn(cells.width(), cells.height(), |x, y| {
            let row = cells.row(y);
            let (before, after) = (row[x.saturating_sub(1)], row[(x + 1).min(row.len() - 1)]);
            (before + 2.0 * row[x] + after) / 4.0
        })
    };
    along_rows(&along_rows(cells).transposed()).transposed()
}

/// Returns the soft relief: a logistic function of the depth below the surface.
fn soften(map: &HeightMap, face: &Mask, surface: &Grid<f32>) -> Grid<u8> {
    let heights = &map.heights;
    let mut soft = Grid::new(heights.width(), heights.height(), 0_u8);
    let columns: Vec<(usize, f32)> = (0..heights.width())
        .map(|x| cell_at(x, surface.width()))
        .collect();
    for y in 0..heights.height() {
        poll();
        let (row, down) = cell_at(y, surface.height());
        let next = (row + 1).min(surface.height() - 1);
        let levels: Vec<f32> = (surface.row(row).iter().zip(surface.row(next)))
            .map(|(upper, lower)| upper + down * (lower - upper))
            .collect();
        let width = heights.width();
        let out = &mut soft.data_mut()[y * width..][..width];
        for (x, (out, height)) in out.iter_mut().zip(heights.row(y)).enumerate() {
            if *height == NO_HEIGHT || !is_face(face, x, y) {
                continue;
            }
            let (column, right) = columns[x];
            let next = levels[(column + 1).min(levels.len() - 1)];
            let level = levels[column] + right * (next - levels[column]);
            let depth = (height - level + EDGE_MM) / SOFTNESS_MM;
            *out = (255.0 / (1.0 + (-depth).exp())).round() as u8;
        }
    }
    soft
}

/// Returns the cell whose middle lies before a pixel, and the pixel's fraction of the way to the next middle.
fn cell_at(pixel: usize, cells: usize) -> (usize, f32) {
    let at = ((pixel as f32 + 0.5) / CELL as f32 - 0.5).clamp(0.0, cells as f32 - 1.0);
    (at as usize, at.fract())
}

/// Returns the height of the surface under the tops at a point of the face, mm.
pub(super) fn surface_height(map: &HeightMap, surface: &Grid<f32>, [u, v]: [f64; 2]) -> f32 {
    let pixel = |at: f64, origin: f64, count: usize| {
        let cell = ((at - origin) / HEIGHT_STEP_MM + 0.5) / CELL as f64 - 0.5;
        cell.clamp(0.0, count as f64 - 1.0) as f32
    };
    let x = pixel(u, map.origin_mm[0], surface.width());
    let y = pixel(v, map.origin_mm[1], surface.height());
    let value = |dx: usize, dy: usize| {
        let column = (x as usize + dx).min(surface.width() - 1);
        surface.at(column, (y as usize + dy).min(surface.height() - 1))
    };
    let along = |dy| value(0, dy) + x.fract() * (value(1, dy) - value(0, dy));
    along(0) + y.fract() * (along(1) - along(0))
}

#[cfg(test)]
mod tests {
    use super::super::test_world::TestWorld;
    use super::surface_height;

    #[test]
    fn strokes_of_a_bowed_face_are_white_and_ground_is_black() {
        let world = TestWorld::new(11);
        let face = world.face();
        let soft = &face.relief.soft;
        let (mut right, mut all) = (0, 0);
        for y in (20..soft.height() - 20).step_by(3) {
            for x in (20..soft.width() - 20).step_by(3) {
                let at = [x, y].map(|k| k as f64 * super::HEIGHT_STEP_MM);
                all += 1;
                right += usize::from((soft.at(x, y) > 127) == world.is_stroke(at));
            }
        }
        assert!(right as f64 > 0.98 * f64::from(all), "{right} of {all}");
    }

    #[test]
    fn ground_is_carved_and_a_planed_face_is_not() {
        let mut face = TestWorld::new(11).face();
        let carved = face.relief.carved_fraction();
        assert!((0.4..0.95).contains(&carved), "{carved}");
        face.relief.soft.data_mut().fill(255);
        assert!(face.relief.carved_fraction() < 1e-9);
    }

    /// Only one row of characters along the edges has tops.
    #[test]
    fn ground_without_tops_is_black() {
        let mut world = TestWorld::new(13);
        world.clear(|[u, v]| (13.0..137.0).contains(&u) && (13.0..87.0).contains(&v));
        let face = world.face();
        let soft = &face.relief.soft;
        let stroke = (0..soft.height())
            .flat_map(|y| (0..soft.width()).map(move |x| [x, y]))
            .filter(|[x, y]| soft.at(*x, *y) > 127)
            .map(|at| at.map(|k| k as f64 * super::HEIGHT_STEP_MM));
        let (right, wrong): (Vec<_>, Vec<_>) = stroke.partition(|at| world.is_stroke(*at));
        assert!(
            wrong.len() * 20 < right.len(),
            "{} of {}",
            wrong.len(),
            right.len()
        );
    }

    #[test]
    fn the_surface_follows_the_bow() {
        let face = TestWorld::new(12).face();
        let height = |u: f64| surface_height(&face.map, &face.relief.surface, [u, 50.0]);
        // 0.8 mm higher at the ends; the grid of cells shows 0.75 mm of it.
        let bow = height(4.0) - height(75.0);
        assert!((0.55..0.85).contains(&bow), "{bow}");
    }
}
