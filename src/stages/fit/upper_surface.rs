//! Fits the upper surface: renders the mesh from both sides, fits a one-sided robust surface to the tops of each, and
//! refines the surface of the carved side.

use nalgebra::Vector3;

use super::carved_side::{self, FittedSide, SideInputs, layer_width};
use super::params::{FitError, FitParams};
use super::pca::{Axes, frame, frame_along};
use super::surface::{HeightSamples, Surface};
use crate::domain::{Bow, FitOutcome, Rigid3};
use crate::raster::Grid;
use crate::stages::binarize;
use crate::stages::print::Print;
use crate::stages::scan::Scan;
use crate::stages::zbuffer::{IndexedSurface, Viewport};

/// Longest side in pixels of the rendering that decides the side, and of the one that the surface is fitted to.
const COARSE_PX: usize = 96;
const FINE_PX: usize = 144;
/// The view is aligned with the plane of the tops until the plane's slope in the view is below this.
const COARSE_SLOPE: f64 = 0.05;
const FINE_SLOPE: f64 = 0.01;
/// Up to this slope the rendered heights are rotated; beyond it walls hide too much, and the mesh is rendered again.
const COARSE_ROTATION: f64 = 0.15;
const FINE_ROTATION: f64 = 0.05;
/// Maximum number of rotations of one rendering.
const MAX_ROTATIONS: usize = 3;
/// Maximum number of renderings of each kind.
const MAX_COARSE_RENDERINGS: usize = 4;
const MAX_FINE_RENDERINGS: usize = 3;
/// Where more than this share of the visible area is one smooth surface, nothing is carved: strokes never cover so
/// much.
const MAX_TOPS: f64 = 0.85;
/// Where less than this share lies on the surface, it rests on a rim of walls or on specks, not on strokes.
const MIN_TOPS: f64 = 0.05;
/// One in this many pixels is left out at either end when the depth of the carving is measured.
const TRIMMED_ONE_IN: usize = 100;

pub(super) fn fit(
    scan: &Scan,
    print: Option<&Print>,
    scanned_face_down: Option<bool>,
    params: &FitParams,
) -> Result<FitOutcome, FitError> {
    let mesh = scan.mesh();
    if mesh.vertices.len() < 3 {
        return Err(FitError::TooFewPoints(mesh.vertices.len()));
    }
    let shell = scan.shell();
    let axes = Axes::of_surface(mesh, shell);
    axes.require_surface(mesh)?;
    let faces = coarse_sides(
        shell,
        &frame(axes.normal(), axes.centre),
        params.curved_blocks,
    );
    let inputs = SideInputs {
        shell,
        print,
        scanned_face_down,
    };
    let no_surface = || FitError::NoSurface(mesh.vertices.len());
    let (face, side) = carved_side::choose(faces, inputs).ok_or_else(no_surface)?;
    let face =
        fit_view(shell, face.plane_from_mesh, params.curved_blocks, FINE).ok_or_else(no_surface)?;
    if face.relief < params.min_relief * face.extent {
        return Err(FitError::NoRelief {
            relief: face.relief,
            extent: face.extent,
            min_relief: params.min_relief,
        });
    }
    Ok(FitOutcome {
        plane_from_mesh: face.plane_from_mesh,
        bow: face.bow,
        bow_height: face.bow_height,
        inlier_ratio: face.surface.tops,
        rms: face.surface.rms,
        relief: face.relief,
        side,
        vertices: mesh.vertices.len() as u64,
        triangles: mesh.triangles.len() as u64,
    })
}

/// Resolution and limits of one search for the upper surface.
#[derive(Debug, Clone, Copy)]
struct FitEffort {
    px: usize,
    slope: f64,
    max_rotation: f64,
    max_renderings: usize,
}

const COARSE: FitEffort = FitEffort {
    px: COARSE_PX,
    slope: COARSE_SLOPE,
    max_rotation: COARSE_ROTATION,
    max_renderings: MAX_COARSE_RENDERINGS,
};
const FINE: FitEffort = FitEffort {
    px: FINE_PX,
    slope: FINE_SLOPE,
    max_rotation: FINE_ROTATION,
    max_renderings: MAX_FINE_RENDERINGS,
};

/// Fits a coarse surface to both sides of a frame's plane.
fn coarse_sides(shell: &IndexedSurface, front: &Rigid3, bow: bool) -> [Option<FittedSide>; 2] {
    let view = Viewport::around(shell.bounds(front), COARSE.px, false);
    let frames = [*front, opposite_side(front)];
    let [front, back] = shell.render_both_sides(front, &view);
    let refined = FitEffort {
        max_renderings: COARSE.max_renderings - 1,
        ..COARSE
    };
    let fit_side = |heights: Grid<f32>, frame: &Rigid3| {
        let seen = FittedView::new(frame, &heights, view, bow)?.leveled(bow, COARSE);
        if seen.slope() < COARSE.slope {
            Some(seen.face())
        } else {
            fit_view(shell, seen.plane_from_mesh(), bow, refined)
        }
    };
    [fit_side(front, &frames[0]), fit_side(back, &frames[1])]
}

/// Returns the frame of the other side: x stays, y and z are reversed.
fn opposite_side(frame: &Rigid3) -> Rigid3 {
    let [x, y, z, last] = frame.0;
    Rigid3([x, y.map(|v| -v), z.map(|v| -v), last])
}

/// Fits the tops seen along a frame's z, and rotates the view until it is perpendicular to them.
fn fit_view(
    shell: &IndexedSurface,
    start: Rigid3,
    bow: bool,
    effort: FitEffort,
) -> Option<FittedSide> {
    let mut frame = start;
    for round in 1.. {
        let view = Viewport::around(shell.bounds(&frame), effort.px, false);
        let seen = FittedView::new(&frame, &shell.render(&frame, &view), view, bow)?;
        let seen = seen.leveled(bow, effort);
        if seen.slope() < effort.slope || round >= effort.max_renderings {
            return Some(seen.face());
        }
        frame = seen.plane_from_mesh();
    }
    None
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
    fn new(frame: &Rigid3, heights: &Grid<f32>, view: Viewport, bow: bool) -> Option<Self> {
        Some(Self::of(
            *frame,
            HeightSamples::new(heights, &view)?,
            view,
            bow,
        ))
    }

    fn of(frame: Rigid3, samples: HeightSamples, view: Viewport, bow: bool) -> Self {
        let surface = samples.fit(bow);
        Self {
            frame,
            view,
            plane: samples.plane_of_tops(&surface),
            samples,
            surface,
        }
    }

    /// Rotates the heights until the view is perpendicular to the tops, or as far as allowed.
    fn leveled(mut self, bow: bool, effort: FitEffort) -> Self {
        let seen_from = self.frame.inverse();
        for _ in 0..MAX_ROTATIONS {
            let frame = self.plane_from_mesh();
            let lean = frame.after(&seen_from).0[2][2].clamp(-1.0, 1.0).acos();
            if self.slope() < effort.slope || lean > effort.max_rotation {
                break;
            }
            let other_from_this = frame.after(&self.frame.inverse());
            let samples = self.samples.turned(&other_from_this);
            self = Self::of(frame, samples, self.view, bow);
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
    fn face(&self) -> FittedSide {
        let (samples, surface) = (&self.samples, &self.surface);
        let mut over_plane = samples.in_plane_units(surface);
        for (coefficient, flat) in over_plane.iter_mut().zip(self.plane) {
            *coefficient -= flat;
        }
        let bent = over_plane[3..].iter().any(|c| *c != 0.0);
        let bow = bent.then_some(Bow(over_plane));
        let relief = if (MIN_TOPS..=MAX_TOPS).contains(&surface.tops) {
            relief(&samples.inner_residuals(surface))
        } else {
            0.0
        };
        let view = &self.view;
        FittedSide {
            plane_from_mesh: self.plane_from_mesh(),
            bow,
            bow_height: bow.map_or(0.0, |b| bow_height(&b, view)),
            relief,
            layer_width: layer_width(samples, surface, relief),
            tops: samples.soft_tops(surface, relief),
            extent: view.unit_per_px * view.width.max(view.height) as f64,
            surface: *surface,
        }
    }
}

/// Returns the frame rotated and translated so that `z = a + b x + c y` becomes its plane. The x axis follows the
/// rotation, so coefficients in the old frame's x and y hold in the new frame to first order.
fn frame_on_plane(plane_from_mesh: &Rigid3, [a, b, c]: [f64; 3]) -> Rigid3 {
    let mesh_from_plane = plane_from_mesh.inverse();
    let at = |p: [f64; 3]| Vector3::from(mesh_from_plane.apply(p));
    let origin = at([0.0, 0.0, a]);
    let normal = at([-b, -c, 1.0]) - at([0.0; 3]);
    let along = at([1.0, 0.0, 0.0]) - at([0.0; 3]);
    frame_along(normal, along, origin)
}

/// Returns the largest minus the smallest height of the bow over the view, mesh units.
fn bow_height(bow: &Bow, view: &Viewport) -> f64 {
    let Some(back) = view.px_from_plane.inverse() else {
        return 0.0;
    };
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for j in 0..=8 {
        for i in 0..=8 {
            let px = (view.width - 1) as f64 * f64::from(i) / 8.0;
            let py = (view.height - 1) as f64 * f64::from(j) / 8.0;
            let [x, y] = back.apply([px, py]);
            let z = bow.height(x, y);
            low = low.min(z);
            high = high.max(z);
        }
    }
    high - low
}

/// Returns the depth of the carving: the distance between the medians of tops and ground without the extreme values.
fn relief(residuals: &[f64]) -> f64 {
    let mut residuals: Vec<f32> = residuals.iter().map(|r| *r as f32).collect();
    binarize::split_inner(&mut residuals, TRIMMED_ONE_IN)
        .map_or(0.0, |split| split.high - split.low)
}
