//! The heights of a rendering as points, without the side walls, the foot and the table below the carved face.

use super::least_squares::{Coefficients, OPEN, Points};
use crate::stages::binarize;
use crate::stages::face::{Face, PositionedHeight};
use crate::stages::zbuffer::{NO_HIT, Viewport};
use mocban_core::domain::Rigid3;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Grid, Mask};

/// Fewer points do not determine a surface.
const LEAST_POINTS: usize = 16;
/// A carving is at most about this many times as deep as the median of its ground. Lower points are side walls of the
/// block, its foot, or a table.
pub(super) const DEEPEST: f64 = 1.8;
/// A carving is not deeper than this fraction of the extent of its side.
pub(super) const DEEPEST_CARVING: f64 = 0.2;
/// Least fraction of the points below the carving at which they are left out.
const DEEP_SHARE: f64 = 0.01;

/// A separate piece has at least this fraction of the visible area.
const LEAST_SEEN_PIECE: f64 = 0.12;

/// Heights of a view as points. Coordinates are divided by the view's longest side: u and v are about -0.5..=0.5.
#[derive(Debug)]
pub(super) struct HeightSamples {
    pub(super) points: Points,
    /// Every other row and column: enough for the first, wide windows.
    pub(super) few: Points,
    /// Least-squares plane of all heights.
    pub(super) mean_plane: Coefficients,
    /// Index of each point in the rendering, and the rendering's size.
    pub(super) places: Vec<usize>,
    pub(super) size: [usize; 2],
    /// Middle of the rendering, in plane coordinates.
    pub(super) centre: [f64; 2],
    /// Longest side of the view, in mesh units.
    pub(super) extent: f64,
    /// Range of the heights over the mean plane, without the lowest and the highest 3 %.
    pub(super) range: f64,
    /// Whether points below the carving were left out.
    pub(super) is_cropped: bool,
}

impl HeightSamples {
    /// Collects the visible pixels of a rendering, leaving out pixels deeper than any carving. Returns `None` if
    /// fewer than [`LEAST_POINTS`] are visible.
    pub(super) fn new(heights: &Grid<f32>, view: &Viewport) -> Option<Self> {
        let back = view.px_from_plane.inverse()?;
        let size = [heights.width(), heights.height()];
        let extent = view.unit_per_px * size[0].max(size[1]) as f64;
        let centre = back.apply(size.map(|side| (side - 1) as f64 / 2.0));
        let most = size[0] * size[1];
        let (mut points, mut places) = (Points::with_capacity(most), Vec::with_capacity(most));
        for y in 0..size[1] {
            for (x, z) in heights.row(y).iter().enumerate() {
                if *z != NO_HIT {
                    let [u, v] = back.apply([x as f64, y as f64]);
                    places.push(y * size[0] + x);
                    let offset = [u - centre[0], v - centre[1], f64::from(*z)];
                    points.push(offset.map(|length| length / extent));
                }
            }
        }
        (points.len() >= LEAST_POINTS)
            .then(|| Self::of(points, places, size, centre, extent).without_depths())
    }

    fn of(
        points: Points,
        places: Vec<usize>,
        size: [usize; 2],
        centre: [f64; 2],
        extent: f64,
    ) -> Self {
        let mut few = Points::with_capacity(points.len() / 3);
        for (point, place) in points.iter().zip(&places) {
            if (place % size[0]).is_multiple_of(2) && (place / size[0]).is_multiple_of(2) {
                few.push(point);
            }
        }
        let mean_plane = points.solve::<3>(&[0.0; 6], |_| 1.0, &OPEN);
        let mut residuals = points.residuals(&mean_plane);
        let mut bound = |share| quantile(&mut residuals, share);
        Self {
            range: (bound(0.97) - bound(0.03)).max(1e-9),
            points,
            few,
            mean_plane,
            places,
            size,
            centre,
            extent,
            is_cropped: false,
        }
    }

    /// Returns whether the rendering shows several separate pieces of similar area.
    pub(super) fn shows_pieces(&self) -> bool {
        let [width, height] = self.size;
        let mut seen = Mask::new(width, height, false);
        for place in &self.places {
            seen.data_mut()[*place] = true;
        }
        let parts = ConnectedComponents::label(&seen).parts_of(&seen);
        let least = LEAST_SEEN_PIECE * self.places.len() as f64;
        parts
            .iter()
            .filter(|(_, area)| *area as f64 >= least)
            .count()
            > 1
    }

    /// Transforms the points to a frame that is only slightly rotated.
    pub(super) fn turned(&self, other_from_this: &Rigid3) -> Self {
        let at = |[u, v, z]: [f64; 3]| {
            let [u, v, z] = [u, v, z].map(|share| share * self.extent);
            other_from_this.apply([self.centre[0] + u, self.centre[1] + v, z])
        };
        let [x, y, _] = at([0.0; 3]);
        let mut points = Points::with_capacity(self.points.len());
        for point in self.points.iter() {
            let [u, v, z] = at(point);
            points.push([u - x, v - y, z].map(|length| length / self.extent));
        }
        let turned = Self::of(points, self.places.clone(), self.size, [x, y], self.extent);
        Self {
            is_cropped: self.is_cropped,
            ..turned
        }
    }

    /// Returns the position and the height over a surface of every point, in mesh units.
    pub(super) fn positioned_heights(&self, surface: &Coefficients) -> Vec<PositionedHeight> {
        let [width, height] = self.size;
        let residuals = self.points.residuals(surface);
        let sample = |(residual, place): (&f64, &usize)| {
            let x = (place % width) as f32 / width as f32;
            let y = (place / width) as f32 / height as f32;
            PositionedHeight::new([x, y], (residual * self.extent) as f32)
        };
        residuals.iter().zip(&self.places).map(sample).collect()
    }

    /// Returns the heights of the carved face. Side walls and a protruding foot of the block may be visible around the
    /// face, and debris higher above the surface than any carving; they are neither tops nor ground.
    pub(super) fn face_heights(&self, samples: &[PositionedHeight]) -> Vec<f32> {
        let highest = (DEEPEST_CARVING * self.extent) as f32;
        let low = samples.iter().filter(|sample| sample.height < highest);
        let low: Vec<PositionedHeight> = low.copied().collect();
        Face::of(&low).heights(&low)
    }

    /// Leaves out the points that are deeper below the mean plane than any carving. Does nothing if there are few.
    fn without_depths(self) -> Self {
        let samples = self.positioned_heights(&self.mean_plane);
        let Some(split) = binarize::split(&mut self.face_heights(&samples)) else {
            return self;
        };
        let lowest = split.high - DEEPEST * (split.high - split.low);
        let is_near = |sample: &PositionedHeight| f64::from(sample.height) > lowest;
        let near = samples.iter().filter(|sample| is_near(sample)).count();
        let deep = samples.len() - near;
        if near < LEAST_POINTS || (deep as f64) < DEEP_SHARE * samples.len() as f64 {
            return self;
        }
        let (mut points, mut places) = (Points::default(), Vec::new());
        for ((point, place), sample) in self.points.iter().zip(&self.places).zip(&samples) {
            if is_near(sample) {
                points.push(point);
                places.push(*place);
            }
        }
        let kept = Self::of(points, places, self.size, self.centre, self.extent);
        Self {
            is_cropped: true,
            ..kept
        }
    }
}

/// Returns the quantile `share` (0..=1) of the values. Reorders the values.
pub(crate) fn quantile(values: &mut [f64], share: f64) -> f64 {
    let k = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}
