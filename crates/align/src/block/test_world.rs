//! A small block with a page in tests: characters of random bars.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::align::CarvedFace;
use super::height_map::HEIGHT_STEP_MM;
use super::orientation::Orientation;
use super::page_ink::PageInk;
use super::page_map::PageMap;
use super::stored_heights::{HeightHeader, StoredHeights};
use super::window_images::ShrunkRelief;
use mocban_core::domain::Affine2;
use mocban_core::raster::Grid;

/// Sides of the face, mm.
pub(super) const SIDES_MM: [f64; 2] = [150.0, 100.0];
/// Distance between characters, mm.
const PITCH_MM: f64 = 12.5;
/// Depth of the ground, in steps of stored heights: 2 mm.
const DEPTH_STEPS: f64 = 4_000.0;

/// A bar: middle, half length, half width, and direction.
type Bar = ([f64; 2], f64, f64, f64);

/// Bars on a face whose coordinates start at (0, 0).
pub(super) struct TestWorld {
    bars: Vec<Bar>,
}

impl TestWorld {
    /// Draws a page of characters.
    pub(super) fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut bars = Vec::new();
        let count = SIDES_MM.map(|side| (side / PITCH_MM) as usize);
        for column in 0..count[0] {
            for row in 0..count[1] {
                let middle = [column, row].map(|k| (k as f64 + 0.5) * PITCH_MM);
                for _ in 0..6 {
                    let place = middle.map(|m| m + rng.random_range(-3.2..3.2));
                    let is_level = rng.random_range(0..2) == 0;
                    let angle = if is_level { 0.0 } else { 1.57 } + rng.random_range(-0.3..0.3);
                    let length = rng.random_range(1.0..2.6);
                    bars.push((place, length, rng.random_range(0.3..0.5), angle));
                }
            }
        }
        Self { bars }
    }

    /// Removes the bars whose middle lies in a part of the face.
    pub(super) fn clear(&mut self, is_in: impl Fn([f64; 2]) -> bool) {
        self.bars.retain(|(middle, ..)| !is_in(*middle));
    }

    /// Returns whether a point of the face lies on a stroke.
    pub(super) fn is_stroke(&self, [u, v]: [f64; 2]) -> bool {
        self.bars.iter().any(|([x, y], length, width, angle)| {
            let (sin, cos) = angle.sin_cos();
            let (dx, dy) = (u - x, v - y);
            (cos * dx + sin * dy).abs() < *length && (cos * dy - sin * dx).abs() < *width
        })
    }

    /// Returns strokes at a spacing in mm.
    fn strokes(&self, step_mm: f64) -> Grid<bool> {
        let size = SIDES_MM.map(|side| (side / step_mm) as usize);
        let mut strokes = Grid::new(size[0], size[1], false);
        for ([x, y], length, width, angle) in &self.bars {
            let (sin, cos) = angle.sin_cos();
            let reach = length + width;
            let range = |at: f64, count: usize| {
                let first = ((at - reach) / step_mm).max(0.0) as usize;
                first..(((at + reach) / step_mm) as usize + 1).min(count)
            };
            for row in range(*y, size[1]) {
                for column in range(*x, size[0]) {
                    let (dx, dy) = (column as f64 * step_mm - x, row as f64 * step_mm - y);
                    if (cos * dx + sin * dy).abs() < *length && (cos * dy - sin * dx).abs() < *width
                    {
                        strokes.set(column, row, true);
                    }
                }
            }
        }
        strokes
    }

    /// Returns the face, bowed by 0.8 mm.
    pub(super) fn face(&self) -> CarvedFace {
        let strokes = self.strokes(HEIGHT_STEP_MM);
        let middle = strokes.width() as f64 / 2.0;
        let values = Grid::from_fn(strokes.width(), strokes.height(), |x, y| {
            let bow = 1_600.0 * ((x as f64 - middle) / middle).powi(2);
            let ground = if strokes.at(x, y) { 0.0 } else { DEPTH_STEPS };
            (30_000.0 + bow - ground) as u16
        });
        let header = HeightHeader {
            frame: frame(),
            origin_mm: [0.0; 2],
            low_mm: -15.0,
        };
        CarvedFace::of(&StoredHeights { header, values }).expect("a face")
    }

    /// Returns a page whose pixels show the face through a map.
    pub(super) fn page(
        &self,
        size: [usize; 2],
        face_from_page: impl Fn([f64; 2]) -> [f64; 2],
    ) -> PageInk {
        let step_mm = 0.05;
        let strokes = self.strokes(step_mm);
        PageInk::of_soft(Grid::from_fn(size[0], size[1], |x, y| {
            let [u, v] = face_from_page([x as f64, y as f64]);
            let at = [u, v].map(|at| (at / step_mm).round() as i64);
            if strokes.get(at[0], at[1]) == Some(true) {
                255
            } else {
                0
            }
        }))
    }

    /// Returns a page through an affine map of the face to the page.
    pub(super) fn affine_page(&self, size: [usize; 2], page_from_face: &Affine2) -> PageInk {
        let face_from_page = page_from_face.inverse().expect("an invertible map");
        self.page(size, |page| face_from_page.apply(page))
    }
}

/// Returns a relief and its page, and a map that is wrong by 0.62 mm and -0.47 mm.
pub(super) fn shifted_world(shrink: usize) -> (ShrunkRelief, PageInk, PageMap) {
    let world = TestWorld::new(8);
    let face = world.face();
    let truth = Affine2::scale_shift(8.0, [40.0, 40.0]);
    let page = world.affine_page([1280, 880], &truth);
    let wrong = Affine2::scale_shift(8.0, [40.0 - 8.0 * 0.62, 40.0 + 8.0 * 0.47]);
    let map = PageMap::affine(&wrong, [0.0; 2], SIDES_MM);
    (ShrunkRelief::of(&face.map, &face.relief, shrink), page, map)
}

/// Returns the frame of a mesh whose coordinates are u, v and n in mm.
pub(super) fn frame() -> Orientation {
    Orientation {
        mm: 1.0,
        centre: [0.0; 3],
        axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        half_extent_mm: [SIDES_MM[0], SIDES_MM[1], 20.0],
        triangles: 0,
    }
}
