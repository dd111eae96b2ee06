//! The outlines of all strokes of a page, as signed distances on a large grid in the face frame.

use crate::polygon::BoundsMm;
use mocban_core::raster::Grid;

/// Sample spacing, mm.
const STEP_MM: f64 = 0.08;
/// Value of samples far from all strokes, mm.
pub(super) const FAR_MM: f64 = -3.0;
/// Owner of samples whose nearest stroke belongs to no character.
const NOBODY: u16 = u16::MAX;

/// Signed distances in mm to the stroke outlines, positive inside, at least [`FAR_MM`].
#[derive(Debug, Clone)]
pub(super) struct FaceField {
    /// Position of the first sample, mm.
    origin: [f64; 2],
    values: Grid<f32>,
    /// Index of the character whose stroke is nearest.
    owners: Grid<u16>,
    /// Bounding box of the strokes of each character of the layout.
    bounds: Vec<BoundsMm>,
}

impl FaceField {
    /// Creates a field without strokes for a page with the given outer edges.
    pub(super) fn empty(outer: BoundsMm) -> Self {
        let margin = FAR_MM.abs() + 0.5;
        let length = outer.size().map(|length| length + 2.0 * margin);
        let size = length.map(|length| (length / STEP_MM).ceil() as usize + 1);
        Self {
            origin: outer.min.map(|c| c - margin),
            values: Grid::new(size[0], size[1], FAR_MM as f32),
            owners: Grid::new(size[0], size[1], NOBODY),
            bounds: Vec::new(),
        }
    }

    /// Adds the strokes of the next character. `inside` returns the signed distance at a point, mm; `bounds` is the box
    /// of the strokes, and `reach` the box within which they change the field.
    pub(super) fn add_character(
        &mut self,
        bounds: BoundsMm,
        reach: BoundsMm,
        inside: impl Fn([f64; 2]) -> f64,
    ) {
        let owner = self.bounds.len() as u16;
        self.bounds.push(bounds);
        self.raise(reach, owner, inside);
    }

    /// Adds strokes that belong to no character. `inside` returns the signed distance at a point, mm.
    pub(super) fn add_line(&mut self, reach: BoundsMm, inside: impl Fn([f64; 2]) -> f64) {
        self.raise(reach, NOBODY, inside);
    }

    /// Raises the samples within a box to the values of a function of the position.
    fn raise(&mut self, reach: BoundsMm, owner: u16, inside: impl Fn([f64; 2]) -> f64) {
        let last = [self.values.width() - 1, self.values.height() - 1].map(|c| c as f64);
        let limit = |point: [f64; 2]| {
            let sample = self.sample(point);
            [0, 1].map(|i| sample[i].clamp(0.0, last[i]) as usize)
        };
        let ([x0, y0], [x1, y1]) = (limit(reach.min), limit(reach.max));
        for y in y0..=y1 {
            for x in x0..=x1 {
                let point = [
                    self.origin[0] + x as f64 * STEP_MM,
                    self.origin[1] + y as f64 * STEP_MM,
                ];
                let value = inside(point) as f32;
                if value > self.values.at(x, y) {
                    self.values.set(x, y, value);
                    self.owners.set(x, y, owner);
                }
            }
        }
    }

    /// Converts a position in mm to fractional sample coordinates.
    fn sample(&self, point: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| (point[i] - self.origin[i]) / STEP_MM)
    }

    /// Returns the interpolated signed distance at a point, mm.
    pub(super) fn value(&self, point: [f64; 2]) -> f64 {
        let [x, y] = self.sample(point);
        let (width, height) = (self.values.width(), self.values.height());
        if !(x >= 0.0 && y >= 0.0 && x < (width - 1) as f64 && y < (height - 1) as f64) {
            return FAR_MM;
        }
        let (x0, y0) = (x as usize, y as usize);
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let at = y0 * width + x0;
        let data = self.values.data();
        let row = |at: usize| data[at] + (data[at + 1] - data[at]) * fx;
        let (top, bottom) = (row(at), row(at + width));
        f64::from(top + (bottom - top) * fy)
    }

    /// Returns the index of the character whose stroke is nearest to a point, or `None` if the nearest stroke belongs
    /// to no character.
    pub(super) fn owner(&self, point: [f64; 2]) -> Option<usize> {
        let [x, y] = self.sample(point).map(|c| c.round() as i64);
        let owner = self.owners.get(x, y)?;
        (owner != NOBODY).then_some(usize::from(owner))
    }

    /// Returns the bounding box of the strokes of a character.
    pub(super) fn bounds(&self, index: usize) -> BoundsMm {
        self.bounds[index]
    }
}
