//! Renders one side of a mesh and fits the surface of the stroke tops to the heights.

use nalgebra::Vector3;

use super::height_samples::HeightSamples;
use super::pca::frame_along;
use super::surface::Surface;
use crate::stages::binarize;
use crate::stages::zbuffer::{IndexedSurface, Viewport};
use mocban_core::domain::{Curvature, Rigid3};
use mocban_core::raster::Grid;

/// Maximum number of rotations of one rendering.
const MAX_ROTATIONS: usize = 3;
/// If more than this fraction of the visible area lies on the fitted surface, the side counts as uncarved.
const MAX_TOPS: f64 = 0.85;
/// If less than this fraction of the visible area lies on the fitted surface, the side counts as uncarved. The surface
/// then rests on walls or specks, not on strokes.
const MIN_TOPS: f64 = 0.02;
/// When the depth of the carving is measured, one height in this many is ignored at either end.
const TRIMMED_ONE_IN: usize = 100;

/// Largest fraction of the visible area that is debris.
const DEBRIS: f64 = 0.04;

/// Surface and measurements of one side.
#[derive(Debug)]
pub(super) struct FittedSide {
    pub(super) plane_from_mesh: Rigid3,
    pub(super) curvature: Option<Curvature>,
    pub(super) curvature_height: f64,
    pub(super) relief: f64,
    pub(super) extent: f64,
    pub(super) surface: Surface,
    pub(super) samples: HeightSamples,
}

/// Resolution and limits of one search for the upper surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct FitEffort {
    /// Longest side of a rendering, in pixels.
    px: usize,
    /// The view is not rotated further once the stroke tops slope less than this.
    slope: f64,
    /// Largest angle, in radians, by which rendered heights are rotated. Beyond this angle, walls hide too much of the
    /// surface, and the mesh is rendered again.
    max_rotation: f64,
    max_renderings: usize,
}

/// For the renderings that decide the side.
pub(super) const COARSE: FitEffort = FitEffort {
    px: 96,
    slope: 0.05,
    max_rotation: 0.15,
    max_renderings: 4,
};
/// For the renderings of the carved side that the surface is fitted to.
pub(super) const FINE: FitEffort = FitEffort {
    px: 144,
    slope: 0.01,
    max_rotation: 0.05,
    max_renderings: 3,
};

/// Fits a coarse surface to both sides of a frame's plane.
pub(super) fn coarse_sides(
    indexed: &IndexedSurface,
    front: &Rigid3,
    may_curve: bool,
) -> [Option<FittedSide>; 2] {
    let view = Viewport::around(indexed.bounds(front), COARSE.px, false);
    let [seen, seen_from_back] = indexed.render_both_sides(front, &view);
    [(seen, *front), (seen_from_back, opposite_side(front))]
        .map(|(heights, frame)| fit_heights(indexed, &frame, &heights, view, may_curve, COARSE))
}

/// Returns the frame of the other side: x stays, y and z are reversed.
fn opposite_side(frame: &Rigid3) -> Rigid3 {
    let [x, y, z, last] = frame.0;
    Rigid3([x, y.map(|v| -v), z.map(|v| -v), last])
}

/// Renders the mesh along a frame's z and fits the tops. Returns `None` if the mesh is empty, overlaps too often or covers
/// fewer than 16 pixels.
pub(super) fn fit_view(
    indexed: &IndexedSurface,
    frame: &Rigid3,
    may_curve: bool,
    effort: FitEffort,
) -> Option<FittedSide> {
    let (heights, view) = rendered(indexed, frame, effort)?;
    fit_heights(indexed, frame, &heights, view, may_curve, effort)
}

/// Fits the height of the stroke tops of one side, whose normal is known: the z axis of the frame. Returns `None` in the
/// same cases as [`fit_view`].
pub(super) fn fit_known_normal(indexed: &IndexedSurface, frame: &Rigid3) -> Option<FittedSide> {
    let (heights, view) = rendered(indexed, frame, FINE)?;
    let samples = HeightSamples::new(&heights, &view)?;
    let surface = samples.fit_height();
    Some(FittedView::with_surface(*frame, samples, view, surface).into_side())
}

/// Renders one side. Returns `None` if the mesh is empty or overlaps too often.
fn rendered(
    indexed: &IndexedSurface,
    frame: &Rigid3,
    effort: FitEffort,
) -> Option<(Grid<f32>, Viewport)> {
    if indexed.is_empty() {
        return None;
    }
    let view = Viewport::around(indexed.bounds(frame), effort.px, false);
    let heights = indexed.render(frame, &view);
    (!indexed.overlaps_too_often()).then_some((heights, view))
}

/// Fits the stroke tops of a rendering. Rotates the view and fits again until the view is perpendicular to the tops, or
/// until a limit of `effort` is reached.
fn fit_heights(
    indexed: &IndexedSurface,
    frame: &Rigid3,
    heights: &Grid<f32>,
    view: Viewport,
    may_curve: bool,
    effort: FitEffort,
) -> Option<FittedSide> {
    let samples = HeightSamples::new(heights, &view)?;
    let seen = FittedView::of(*frame, samples, view, may_curve).leveled(may_curve, effort);
    if seen.slope() < effort.slope || effort.max_renderings <= 1 {
        return Some(seen.into_side());
    }
    let fewer = FitEffort {
        max_renderings: effort.max_renderings - 1,
        ..effort
    };
    fit_view(indexed, &seen.plane_from_mesh(), may_curve, fewer)
}

/// A rendering with the surface fitted to it.
struct FittedView {
    frame: Rigid3,
    view: Viewport,
    samples: HeightSamples,
    surface: Surface,
    /// The tops' plane in the frame, `z = a + b x + c y`.
    plane: [f64; 3],
}

impl FittedView {
    fn of(frame: Rigid3, samples: HeightSamples, view: Viewport, may_curve: bool) -> Self {
        let surface = samples.fit(may_curve);
        Self::with_surface(frame, samples, view, surface)
    }

    fn with_surface(
        frame: Rigid3,
        samples: HeightSamples,
        view: Viewport,
        surface: Surface,
    ) -> Self {
        Self {
            frame,
            view,
            plane: samples.plane_of_tops(&surface),
            samples,
            surface,
        }
    }

    /// Rotates the heights until the view is perpendicular to the stroke tops, or until a limit is reached.
    fn leveled(mut self, may_curve: bool, effort: FitEffort) -> Self {
        let seen_from = self.frame.inverse();
        for _ in 0..MAX_ROTATIONS {
            let frame = self.plane_from_mesh();
            let lean = frame.after(&seen_from).0[2][2].clamp(-1.0, 1.0).acos();
            if self.slope() < effort.slope || lean > effort.max_rotation {
                break;
            }
            let other_from_this = frame.after(&self.frame.inverse());
            let samples = self.samples.turned(&other_from_this);
            self = Self::of(frame, samples, self.view, may_curve);
        }
        self
    }

    /// Returns the slope of the tops' plane in the view.
    fn slope(&self) -> f64 {
        self.plane[1].hypot(self.plane[2])
    }

    /// Returns the frame whose plane is the tops' plane.
    fn plane_from_mesh(&self) -> Rigid3 {
        frame_on_plane(&self.frame, self.plane)
    }

    /// Returns the surface of this side with its measurements.
    fn into_side(self) -> FittedSide {
        let plane_from_mesh = self.plane_from_mesh();
        let Self {
            view,
            samples,
            surface,
            plane,
            ..
        } = self;
        let mut over_plane = samples.in_plane_units(surface.coefficients);
        for (coefficient, flat) in over_plane.iter_mut().zip(plane) {
            *coefficient -= flat;
        }
        let is_bent = over_plane[3..].iter().any(|c| *c != 0.0);
        let curvature = is_bent.then_some(Curvature(over_plane));
        let relief = if (MIN_TOPS..=MAX_TOPS).contains(&surface.tops) {
            relief(&mut samples.face_residuals(&surface))
        } else {
            0.0
        };
        FittedSide {
            plane_from_mesh,
            curvature,
            curvature_height: curvature
                .map_or(0.0, |curvature| curvature_height(&curvature, &view)),
            relief,
            extent: view.unit_per_px * view.width.max(view.height) as f64,
            surface,
            samples,
        }
    }
}

/// Returns a frame in which the plane `z = a + b x + c y` of the old frame is `z = 0`. The new x axis is as close as
/// possible to the old one. To first order in the slope, a curved surface therefore has the same coefficients in both frames.
fn frame_on_plane(plane_from_mesh: &Rigid3, [a, b, c]: [f64; 3]) -> Rigid3 {
    let mesh_from_plane = plane_from_mesh.inverse();
    let at = |p: [f64; 3]| Vector3::from(mesh_from_plane.apply(p));
    let origin = at([0.0, 0.0, a]);
    let normal = at([-b, -c, 1.0]) - at([0.0; 3]);
    let along = at([1.0, 0.0, 0.0]) - at([0.0; 3]);
    frame_along(normal, along, origin)
}

/// Returns the height difference between the highest and the lowest point of the curved surface in the view, in mesh units.
fn curvature_height(curvature: &Curvature, view: &Viewport) -> f64 {
    let Some(back) = view.px_from_plane.inverse() else {
        return 0.0;
    };
    let along = |side: usize, step: i32| (side - 1) as f64 * f64::from(step) / 8.0;
    let heights = (0..81).map(|k| {
        let [x, y] = back.apply([along(view.width, k % 9), along(view.height, k / 9)]);
        curvature.height(x, y)
    });
    let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| {
        [low.min(z), high.max(z)]
    });
    high - low
}

/// Returns the depth of the carving: the median of the tops minus the median of the ground, without extreme heights.
/// Leaves out debris, which is a small area far above the surface of the tops.
fn relief(residuals: &mut [f32]) -> f64 {
    let Some(split) = binarize::split_inner(residuals, TRIMMED_ONE_IN) else {
        return 0.0;
    };
    let relief = split.high - split.low;
    // The heights are sorted now.
    let below = residuals.partition_point(|height| f64::from(*height) < split.threshold);
    let above = residuals.len() - below;
    if split.high < relief / 2.0 || above as f64 > DEBRIS * residuals.len() as f64 {
        return relief;
    }
    self::relief(&mut residuals[..below])
}

#[cfg(test)]
mod tests {
    use super::relief;

    /// Returns heights over the surface of the tops: `tops` at 0, 60 at -1, and `debris` at 7.
    fn heights(tops: usize, debris: usize) -> Vec<f32> {
        let noise = |k: usize| (k % 7) as f32 * 0.005;
        let of = |count: usize, height: f32| (0..count).map(move |k| height + noise(k));
        of(60, -1.0)
            .chain(of(tops, 0.0))
            .chain(of(debris, 7.0))
            .collect()
    }

    #[test]
    fn a_small_area_far_above_the_tops_does_not_change_the_relief() {
        let measured = [0, 1, 3].map(|debris| relief(&mut heights(40, debris)));
        assert!(
            measured.iter().all(|relief| (relief - 1.0).abs() < 0.02),
            "{measured:?}"
        );
    }

    #[test]
    fn a_larger_area_above_the_surface_is_a_carving() {
        assert!(relief(&mut heights(0, 10)) > 7.0);
    }
}
