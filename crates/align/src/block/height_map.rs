//! Height maps of both sides of a block, from one pass over its triangles.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use rayon::prelude::*;

use super::error::BlockError;
use super::orientation::Orientation;
use super::scan_sums::ScanPart;
use mocban_core::domain::cancel::{ThreadToken, poll};
use mocban_core::mesh::{Triangle, TriangleStream};
use mocban_core::raster::Grid;

/// Spacing of height maps, mm. Strokes are about 1 mm wide; scans have points every 0.1 to 0.3 mm.
pub const HEIGHT_STEP_MM: f64 = 0.15;
/// Largest height map, in pixels: 0.75 square metres. Drawing both sides takes 8 bytes a pixel, and their faces later less
/// than twice as much.
pub const MAX_MAP_PIXELS: usize = 1 << 25;
/// Wide triangles may be tested at this many pixels for each pixel of a map, for each triangle, and in any case.
const TESTS_PER_PIXEL: u64 = 64;
const TESTS_PER_TRIANGLE: u64 = 8;
const FREE_TESTS: u64 = 1 << 26;
/// If a triangle spans more columns than this, its rows are clipped before their pixels are tested.
const MAX_UNCLIPPED_COLUMNS: f32 = 32.0;
/// Columns that are tested beyond the edges of a clipped triangle.
const COLUMN_MARGIN: f32 = 3.0;
/// Triangles that one task draws.
const TASK: usize = 8192;
/// The height of a pixel that no triangle covers.
pub(super) const NO_HEIGHT: f32 = f32::NEG_INFINITY;

/// Heights of one side over the plane through the centre of the block, mm; negative infinity where nothing was scanned.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// The frame of the side: n points away from the block.
    pub frame: Orientation,
    /// Coordinates u and v of the centre of the top-left pixel, mm.
    pub origin_mm: [f64; 2],
    /// Heights along n, mm, drawn with u to the right and v down.
    pub heights: Grid<f32>,
}

/// Heights that many threads raise at the same time.
struct SharedHeights {
    width: usize,
    height: usize,
    /// Keys of the heights, in the order of the heights.
    keys: Vec<AtomicU32>,
}

/// Key of [`NO_HEIGHT`].
const NO_KEY: u32 = 0;

/// Returns an integer that orders like the float. No finite float has the key 0.
const fn key_of(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 {
        !bits
    } else {
        bits | 1 << 31
    }
}

const fn height_of(key: u32) -> f32 {
    if key == NO_KEY {
        NO_HEIGHT
    } else if key >> 31 == 1 {
        f32::from_bits(key & !(1 << 31))
    } else {
        f32::from_bits(!key)
    }
}

impl SharedHeights {
    fn new(width: usize, height: usize) -> Self {
        let keys = (0..width * height)
            .map(|_| AtomicU32::new(NO_KEY))
            .collect();
        Self {
            width,
            height,
            keys,
        }
    }

    #[inline]
    fn raise(&self, place: usize, value: f32) {
        let key = key_of(value);
        let at = &self.keys[place];
        if at.load(Ordering::Relaxed) < key {
            at.fetch_max(key, Ordering::Relaxed);
        }
    }

    fn into_grid(self) -> Grid<f32> {
        let heights = self.keys.into_iter().map(|key| height_of(key.into_inner()));
        let heights: Vec<f32> = heights.collect();
        Grid::from_vec(self.width, self.height, heights).expect("one height for each pixel")
    }
}

/// The two sides of a block while they are drawn. Both are drawn in the pixels of the front.
struct BothSides {
    front: SharedHeights,
    back: SharedHeights,
}

impl BothSides {
    /// Draws a triangle with corners in pixels and mm: on the front its heights, on the back their negatives. Returns the
    /// number of pixels that were tested, or 0 for a small triangle.
    #[inline]
    fn draw(&self, [a, b, c]: [[f32; 3]; 3]) -> u64 {
        let low = |k: usize| a[k].min(b[k]).min(c[k]).ceil().max(0.0);
        let high = |k: usize| a[k].max(b[k]).max(c[k]).floor();
        let (left, top) = (low(0), low(1));
        let right = high(0).min(self.front.width as f32 - 1.0);
        let bottom = high(1).min(self.front.height as f32 - 1.0);
        // Most triangles of a fine scan contain no pixel centre.
        if left > right || top > bottom {
            return 0;
        }
        let [ab, ac] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        let area = ab[0] * ac[1] - ab[1] * ac[0];
        if area == 0.0 {
            return 0;
        }
        let (ux, uy) = (ac[1] / area, -ac[0] / area);
        let (vx, vy) = (-ab[1] / area, ab[0] / area);
        // Pixels on an edge belong to both triangles; a rounding error must leave no gap.
        let inside = -1e-4_f32;
        let is_wide = right - left > MAX_UNCLIPPED_COLUMNS;
        let mut tests = 0;
        let mut y = top;
        while y <= bottom {
            let [mut x, mut right] = [left, right];
            if is_wide {
                poll();
                [x, right] = clipped_columns([a, b, c], y, [left, right]);
                tests += (right - x + 1.0).max(0.0) as u64;
            }
            while x <= right {
                let (dx, dy) = (x - a[0], y - a[1]);
                let (s, t) = (ux * dx + uy * dy, vx * dx + vy * dy);
                if s >= inside && t >= inside && s + t <= 1.0 - inside {
                    let height = a[2] + s * ab[2] + t * ac[2];
                    let place = y as usize * self.front.width + x as usize;
                    self.front.raise(place, height);
                    self.back.raise(place, -height);
                }
                x += 1.0;
            }
            y += 1.0;
        }
        tests
    }
}

/// Returns the first and the last column to test in a row of a wide triangle, between `left` and `right`. Because pixels
/// up to a rounding error outside the triangle count, the columns between the rows above and below are tested.
fn clipped_columns(corners: [[f32; 3]; 3], y: f32, [left, right]: [f32; 2]) -> [f32; 2] {
    let [a, b, c] = corners;
    let (mut first, mut last) = (f32::INFINITY, f32::NEG_INFINITY);
    let mut reach = |x: f32| (first, last) = (first.min(x), last.max(x));
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let [low, high] = [p[1].min(q[1]), p[1].max(q[1])];
        let [from, to] = [low.max(y - 1.0), high.min(y + 1.0)];
        if from > to {
            continue;
        }
        if low == high {
            reach(p[0]);
            reach(q[0]);
            continue;
        }
        for at in [from, to] {
            reach(p[0] + (at - p[1]) / (q[1] - p[1]) * (q[0] - p[0]));
        }
    }
    [
        (first - COLUMN_MARGIN).ceil().max(left),
        (last + COLUMN_MARGIN).floor().min(right),
    ]
}

/// Returns the pixels from the centre of the maps to their edges along u and v.
fn map_cells(frame: &Orientation, max_pixels: usize) -> Result<[usize; 2], BlockError> {
    let [half_u, half_v, _] = frame.half_extent_mm;
    let cells = [half_u, half_v].map(|half| (half / HEIGHT_STEP_MM).ceil());
    let max_pixels = max_pixels.min(MAX_MAP_PIXELS);
    let pixels = cells.map(|cells| 2.0 * cells + 1.0);
    if pixels[0] * pixels[1] <= max_pixels as f64 {
        return Ok(cells.map(|cells| cells as usize));
    }
    Err(BlockError::TooLarge {
        size_mm: [2.0 * half_u, 2.0 * half_v],
        mm: frame.mm,
        limit_mm2: max_pixels as f64 * HEIGHT_STEP_MM * HEIGHT_STEP_MM,
        is_of_memory: max_pixels < MAX_MAP_PIXELS,
    })
}

/// Draws the height maps of the front (along n) and of the back of a part of a scan. `max_pixels` limits their size.
///
/// # Errors
/// Returns an error if the mesh cannot be read, the maps would be too large, or large triangles overlap too often.
pub fn draw_height_maps(
    mesh: &mut dyn TriangleStream,
    (frame, scan): (&Orientation, &ScanPart),
    max_pixels: usize,
) -> Result<[HeightMap; 2], BlockError> {
    let [cells_u, cells_v] = map_cells(frame, max_pixels)?;
    let (width, height) = (2 * cells_u + 1, 2 * cells_v + 1);
    let pixels = (width * height) as u64;
    let allowed = pixels * TESTS_PER_PIXEL + frame.triangles * TESTS_PER_TRIANGLE + FREE_TESTS;
    let tests = AtomicU64::new(0);
    let sides = BothSides {
        front: SharedHeights::new(width, height),
        back: SharedHeights::new(width, height),
    };
    let to_pixels = |triangle: &Triangle| {
        triangle.map(|corner| {
            let [u, v, n] = frame.face_from_mesh(corner);
            let x = u / HEIGHT_STEP_MM + cells_u as f64;
            let y = v / HEIGHT_STEP_MM + cells_v as f64;
            [x as f32, y as f32, n as f32]
        })
    };
    let token = ThreadToken::current();
    let draw = |part: &[Triangle]| {
        for triangle in part.iter().filter(|triangle| scan.has(triangle)) {
            let tested = sides.draw(to_pixels(triangle));
            if tested > 0 && tests.fetch_add(tested, Ordering::Relaxed) > allowed {
                return;
            }
        }
    };
    mesh.pass(&mut |triangles| {
        triangles
            .par_chunks(TASK)
            .for_each(|part| token.scope(|| draw(part)));
        Ok(())
    })?;
    if tests.into_inner() > allowed {
        return Err(BlockError::Overlap {
            triangles: frame.triangles,
            limit: TESTS_PER_PIXEL,
        });
    }
    let origin_mm = [cells_u, cells_v].map(|cells| -(cells as f64) * HEIGHT_STEP_MM);
    let front = HeightMap {
        frame: *frame,
        origin_mm,
        heights: sides.front.into_grid(),
    };
    // The other side has the opposite v axis, so its rows are in reverse order.
    let mut back = HeightMap {
        frame: frame.other_side(),
        origin_mm,
        heights: sides.back.into_grid(),
    };
    let rows = back.heights.height();
    let columns = back.heights.width();
    for y in 0..rows / 2 {
        let (upper, lower) = back
            .heights
            .data_mut()
            .split_at_mut((rows - 1 - y) * columns);
        upper[y * columns..][..columns].swap_with_slice(&mut lower[..columns]);
    }
    Ok([front, back])
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::test_world::frame;
    use super::{HEIGHT_STEP_MM, HeightMap, MAX_MAP_PIXELS, NO_HEIGHT, draw_height_maps};
    use crate::block::{BlockError, Orientation, ScanPart};
    use mocban_core::mesh::{Mesh, Triangle};

    /// Triangles of any size and direction within 24 x 16 x 6 mm.
    fn triangles(seed: u64) -> Vec<Triangle> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..400)
            .map(|_| {
                let size = rng.random_range(0.05..4.0);
                let middle = [12.0, 8.0, 3.0].map(|half: f64| rng.random_range(-half..half));
                let mut corner = || middle.map(|m| m + rng.random_range(-size..size));
                [corner(), corner(), corner()]
            })
            .collect()
    }

    fn maps(triangles: &[Triangle]) -> [HeightMap; 2] {
        let frame = Orientation {
            half_extent_mm: [12.0, 8.0, 5.0],
            ..frame()
        };
        let mesh = Mesh {
            vertices: triangles.iter().flatten().copied().collect(),
            triangles: (0..triangles.len() as u32)
                .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
                .collect(),
        };
        let scan = (&frame, &ScanPart::whole());
        draw_height_maps(&mut &mesh, scan, MAX_MAP_PIXELS).unwrap()
    }

    /// Returns the height of a triangle at a point, and how far inside the point is.
    fn height_at([a, b, c]: &Triangle, [u, v]: [f64; 2]) -> (f64, f64) {
        let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
        let minus = |p: &[f64; 3], q: &[f64; 3]| [p[0] - q[0], p[1] - q[1]];
        let (ab, ac, ap) = (minus(b, a), minus(c, a), [u - a[0], v - a[1]]);
        let area = cross(ab, ac);
        let (s, t) = (cross(ap, ac) / area, cross(ab, ap) / area);
        (
            a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]),
            s.min(t).min(1.0 - s - t),
        )
    }

    #[test]
    fn each_pixel_has_the_height_of_the_highest_triangle() {
        let triangles = triangles(1);
        let [front, _] = maps(&triangles);
        let mut covered = 0;
        for y in 0..front.heights.height() {
            for x in 0..front.heights.width() {
                let at = [x, y].map(|k| k as f64 * HEIGHT_STEP_MM);
                let at = [0, 1].map(|k: usize| at[k] + front.origin_mm[k]);
                // Points on an edge may count or not.
                let hits = triangles.iter().map(|t| height_at(t, at));
                let (mut surely, mut maybe) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
                for (height, inside) in hits.filter(|(_, inside)| *inside > -2e-3) {
                    maybe = maybe.max(height);
                    if inside > 2e-3 {
                        surely = surely.max(height);
                    }
                }
                let found = front.heights.at(x, y);
                if found == NO_HEIGHT {
                    assert_eq!(surely, f64::NEG_INFINITY);
                } else {
                    covered += 1;
                    let found = f64::from(found);
                    assert!(
                        found > surely - 0.01 && found < maybe + 0.01,
                        "{found} {surely} {maybe}"
                    );
                }
            }
        }
        assert!(covered > 5_000);
    }

    fn refused(triangles: &[Triangle], half_extent_mm: [f64; 3], max_pixels: usize) -> BlockError {
        let frame = Orientation {
            half_extent_mm,
            ..frame()
        };
        let mesh = Mesh {
            vertices: triangles.iter().flatten().copied().collect(),
            triangles: (0..triangles.len() as u32)
                .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
                .collect(),
        };
        let scan = (&frame, &ScanPart::whole());
        draw_height_maps(&mut &mesh, scan, max_pixels).expect_err("a refusal")
    }

    #[test]
    fn maps_beyond_a_limit_are_refused_before_they_take_memory() {
        for half in [1_000.0, 1e6, 1e30, f64::INFINITY, f64::NAN] {
            let error = refused(&triangles(1), [half, 2e3, 5.0], usize::MAX).to_string();
            assert!(
                error.contains("square metres") && !error.contains("--memory"),
                "{error}"
            );
        }
        let error = refused(&triangles(1), [12.0, 8.0, 5.0], 10_000).to_string();
        assert!(error.contains("with this --memory"), "{error}");
    }

    #[test]
    fn a_face_that_is_repeated_thousands_of_times_is_refused() {
        let face = [[-11.0, -7.0, 0.0], [11.0, -7.0, 0.0], [0.0, 7.0, 1.0]];
        let error = refused(&vec![face; 20_000], [12.0, 8.0, 5.0], MAX_MAP_PIXELS);
        assert!(
            matches!(error, BlockError::Overlap { triangles: 0, .. }),
            "{error}"
        );
    }

    #[test]
    fn the_back_shows_the_lowest_triangles_with_v_reversed() {
        let triangles = triangles(2);
        let reversed: Vec<Triangle> = triangles
            .iter()
            .map(|t| t.map(|[x, y, z]| [x, -y, -z]))
            .collect();
        let ([_, back], [front, _]) = (maps(&triangles), maps(&reversed));
        assert_eq!(back.heights.width(), front.heights.width());
        let same = back.heights.data().iter().zip(front.heights.data());
        let different = same
            .filter(|(a, b)| a != b && (*a - *b).abs() > 1e-3)
            .count();
        // Rounding of a point on an edge.
        assert!(different < 20, "{different}");
        let point = [3.0, -4.0, 1.0];
        assert_eq!(back.frame.face_from_mesh(point), [3.0, 4.0, -1.0]);
    }
}
