//! Our fit: look at the surface from both sides, lay a one-sided robust surface over what stands out, take the side
//! whose extreme layer is worn wood.

use nalgebra::Vector3;

use super::carved_side::{self, Face, Witness, layer_width};
use super::params::{FitError, FitParams};
use super::pca::{Axes, frame, frame_along};
use super::surface::{Samples, Surface};
use crate::domain::{Bow, FitOutcome, Rigid3};
use crate::raster::Grid;
use crate::stages::binarize;
use crate::stages::print::Print;
use crate::stages::scan::Scan;
use crate::stages::zbuffer::{IndexedSurface, Viewport};

/// Longest side of the rendering that tells the sides apart, and of the one that the surface is fitted to.
const GLANCE_PX: usize = 96;
const LOOK_PX: usize = 144;
/// The view is turned to the tops' plane until it turns by less than this slope.
const GLANCE_SLOPE: f64 = 0.05;
const LOOK_SLOPE: f64 = 0.01;
/// Up to this slope what was seen is turned; beyond it walls hide too much, and the surface is rendered again.
const GLANCE_TURNED: f64 = 0.15;
const LOOK_TURNED: f64 = 0.05;
/// Most turns of one rendering.
const MOST_TURNS: usize = 3;
/// Most renderings of each kind.
const MOST_GLANCES: usize = 4;
const MOST_LOOKS: usize = 3;
/// Where more than this share of what is seen is one smooth surface, nothing is carved: strokes never cover so much.
const PLAIN: f64 = 0.85;
/// Where less than this share lies on the surface it stands on a rim of walls or on flecks, not on strokes.
const SCANT: f64 = 0.05;
/// One in so many pixels, highest and lowest each, says nothing of the depth of the carving.
const FARTHEST: usize = 100;

pub(super) fn fit(
    scan: &Scan,
    print: Option<&Print>,
    scanned_face_down: Option<bool>,
    params: &FitParams,
) -> Result<FitOutcome, FitError> {
    let (mesh, shell) = (scan.mesh(), scan.shell());
    let axes = Axes::of_surface(mesh, shell);
    axes.require_surface(mesh)?;
    let faces = glances(
        shell,
        &frame(axes.normal(), axes.centre),
        params.curved_blocks,
    );
    let witness = Witness {
        shell,
        print,
        scanned_face_down,
    };
    let no_surface = || FitError::NoSurface(mesh.vertices.len());
    let (face, side) = carved_side::choose(faces, witness).ok_or_else(no_surface)?;
    let face =
        look(shell, face.plane_from_mesh, params.curved_blocks, LOOK).ok_or_else(no_surface)?;
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

/// How closely the surface is looked at.
#[derive(Debug, Clone, Copy)]
struct Care {
    px: usize,
    slope: f64,
    turned: f64,
    most: usize,
}

const GLANCE: Care = Care {
    px: GLANCE_PX,
    slope: GLANCE_SLOPE,
    turned: GLANCE_TURNED,
    most: MOST_GLANCES,
};
const LOOK: Care = Care {
    px: LOOK_PX,
    slope: LOOK_SLOPE,
    turned: LOOK_TURNED,
    most: MOST_LOOKS,
};

/// Glances at both sides of a frame's plane.
fn glances(shell: &IndexedSurface, front: &Rigid3, bow: bool) -> [Option<Face>; 2] {
    let view = Viewport::around(shell.bounds(front), GLANCE.px, false);
    let frames = [*front, turned_about_x(front)];
    let [front, back] = shell.render_both_sides(front, &view);
    let again = Care {
        most: GLANCE.most - 1,
        ..GLANCE
    };
    let glance = |heights: Grid<f32>, frame: &Rigid3| {
        let seen = Seen::new(frame, &heights, view, bow)?.settled(bow, GLANCE);
        if seen.slope() < GLANCE.slope {
            Some(seen.face())
        } else {
            look(shell, seen.plane_from_mesh(), bow, again)
        }
    };
    [glance(front, &frames[0]), glance(back, &frames[1])]
}

/// The frame of the other side: x stays, y and z look the other way.
fn turned_about_x(frame: &Rigid3) -> Rigid3 {
    let [x, y, z, last] = frame.0;
    Rigid3([x, y.map(|v| -v), z.map(|v| -v), last])
}

/// Fits the tops as seen along a frame's z, turning the view until it stands square on them.
fn look(shell: &IndexedSurface, start: Rigid3, bow: bool, care: Care) -> Option<Face> {
    let mut frame = start;
    for round in 1.. {
        let view = Viewport::around(shell.bounds(&frame), care.px, false);
        let seen = Seen::new(&frame, &shell.render(&frame, &view), view, bow)?;
        let seen = seen.settled(bow, care);
        if seen.slope() < care.slope || round >= care.most {
            return Some(seen.face());
        }
        frame = seen.plane_from_mesh();
    }
    None
}

/// What a rendering shows.
struct Seen {
    frame: Rigid3,
    view: Viewport,
    samples: Samples,
    surface: Surface,
    /// The tops' plane in the frame, `z = a + b x + c y`.
    plane: [f64; 3],
}

impl Seen {
    fn new(frame: &Rigid3, heights: &Grid<f32>, view: Viewport, bow: bool) -> Option<Self> {
        Some(Self::of(*frame, Samples::new(heights, &view)?, view, bow))
    }

    fn of(frame: Rigid3, samples: Samples, view: Viewport, bow: bool) -> Self {
        let surface = samples.fit(bow);
        Self {
            frame,
            view,
            plane: samples.plane_of_tops(&surface),
            samples,
            surface,
        }
    }

    /// Turned until it stands square on the tops, or as far as it may be turned.
    fn settled(mut self, bow: bool, care: Care) -> Self {
        let seen_from = self.frame.inverse();
        for _ in 0..MOST_TURNS {
            let frame = self.plane_from_mesh();
            let lean = frame.after(&seen_from).0[2][2].clamp(-1.0, 1.0).acos();
            if self.slope() < care.slope || lean > care.turned {
                break;
            }
            let other_from_this = frame.after(&self.frame.inverse());
            let samples = self.samples.turned(&other_from_this);
            self = Self::of(frame, samples, self.view, bow);
        }
        self
    }

    /// How far the tops' plane leans in the view.
    fn slope(&self) -> f64 {
        self.plane[1].hypot(self.plane[2])
    }

    /// The frame laid on the tops' plane.
    fn plane_from_mesh(&self) -> Rigid3 {
        lay_on(&self.frame, self.plane)
    }

    /// Gathers what there is to say of this side.
    fn face(&self) -> Face {
        let (samples, surface) = (&self.samples, &self.surface);
        let mut over_plane = samples.in_plane_units(surface);
        for (coefficient, flat) in over_plane.iter_mut().zip(self.plane) {
            *coefficient -= flat;
        }
        let bent = over_plane[3..].iter().any(|c| *c != 0.0);
        let bow = bent.then_some(Bow(over_plane));
        let relief = if (SCANT..=PLAIN).contains(&surface.tops) {
            relief(&samples.inner_residuals(surface))
        } else {
            0.0
        };
        let view = &self.view;
        Face {
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

/// The frame turned and raised so that `z = a + b x + c y` becomes its plane. Its x axis turns along, so that what
/// was said in the old frame's x and y holds in the new one's.
fn lay_on(plane_from_mesh: &Rigid3, [a, b, c]: [f64; 3]) -> Rigid3 {
    let mesh_from_plane = plane_from_mesh.inverse();
    let at = |p: [f64; 3]| Vector3::from(mesh_from_plane.apply(p));
    let origin = at([0.0, 0.0, a]);
    let normal = at([-b, -c, 1.0]) - at([0.0; 3]);
    let along = at([1.0, 0.0, 0.0]) - at([0.0; 3]);
    frame_along(normal, along, origin)
}

/// Largest less smallest height of the bow over the view.
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

/// Depth of the carving: between the medians of tops and ground, what lies farthest from the surface left out.
fn relief(residuals: &[f64]) -> f64 {
    let mut residuals: Vec<f32> = residuals.iter().map(|r| *r as f32).collect();
    binarize::split_inner(&mut residuals, FARTHEST).map_or(0.0, |split| split.high - split.low)
}
