//! The carved surface, as heights in mm above the plane of the stroke tops.

use std::ops::Range;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::damage::Damage;
use super::ellipse::Axis;
use super::noise::{Noise, smoothstep};
use super::scalar_field::{SampleFrame, ScalarField};
use super::scene::Scene;

/// Computes the surface of a carved, worn and bent block. `strokes` is the signed distance in mm to the remaining
/// strokes. Height zero is the least-squares plane of the stroke tops.
pub(super) fn carve(scene: &Scene, strokes: &ScalarField, rng: &mut ChaCha8Rng) -> ScalarField {
    let frame = strokes.frame;
    let knife = Knife::draw(scene.conditions.depth, frame, rng);
    // Wear is scaled down on a shallow block, so that its tops stay above its floor.
    let worn_share = scene.conditions.depth.clamp(0.5, 1.0);
    let wear = Wear::draw(rng);
    let all = strokes.union(&scene.block_neighbours);
    let cut = ScalarField::from_fn(frame, |point, x, y| {
        let inside = all.at(x, y);
        if inside > 0.0 {
            let raised_mm = if scene.block_neighbours.at(x, y) > 0.0 {
                scene.conditions.raised_mm
            } else {
                0.0
            };
            raised_mm - worn_share * wear.at(point, inside)
        } else {
            -worn_share * wear.at(point, 0.0) - knife.depth_mm(point, -inside, x, y)
        }
    });
    let rounded = cut.blurred(rng.random_range(0.03..0.05));
    let rounded = match &scene.conditions.weathering {
        None => rounded,
        Some(weathering) => weathering.applied(&rounded, &all, knife.scale * knife.depth_mm),
    };
    let bend = Bend::draw(scene.tier.bend_mm(), strokes, rng);
    let bent = ScalarField::from_fn(frame, |point, x, y| {
        rounded.at(x, y) + bend.at(point) - crack_depth(&scene.damage, point)
    });
    subtract_fitted_plane(&bent, strokes)
}

/// Shape of the carved background.
struct Knife {
    /// Factor of all depths. The walls keep their slope.
    scale: f64,
    slope: f64,
    lean: Noise,
    depth_mm: f64,
    unevenness: Noise,
    tool_marks: Noise,
    gouges: ScalarField,
}

impl Knife {
    fn draw(scale: f64, frame: SampleFrame, rng: &mut ChaCha8Rng) -> Self {
        Self {
            scale,
            slope: rng.random_range(1.3..2.6),
            lean: Noise::draw(rng),
            depth_mm: rng.random_range(1.0..1.4),
            unevenness: Noise::draw(rng),
            tool_marks: Noise::draw(rng),
            gouges: gouges(frame, rng),
        }
    }

    /// Returns the depth below the stroke tops, in mm. `outside` is the distance to the nearest stroke, in mm. The
    /// walls slope down to a rough floor. Two walls that meet above the floor form a V.
    fn depth_mm(&self, [u, v]: [f64; 2], outside: f64, x: usize, y: usize) -> f64 {
        let wall = outside / self.scale * self.slope * (1.0 + 0.3 * self.lean.at(u / 1.6, v / 1.6));
        let floor = self.depth_mm
            + 0.12 * self.unevenness.at(u / 2.0, v / 2.0)
            + 0.04 * self.tool_marks.two_octaves(u / 0.3, v / 0.3)
            + self.gouges.at(x, y);
        // Smooth minimum of wall and floor with a rounding of 0.2 mm.
        let gap = ((wall - floor) / 0.2).clamp(-1.0, 1.0);
        let depth = if wall <= floor {
            wall - 0.05 * (1.0 + gap).powi(2)
        } else {
            floor - 0.05 * (1.0 - gap).powi(2)
        };
        self.scale * depth.max(0.0)
    }
}

/// Draws gouge marks in the floor, as depths in mm.
fn gouges(frame: SampleFrame, rng: &mut ChaCha8Rng) -> ScalarField {
    let mut field = ScalarField::from_fn(frame, |_, _, _| 0.0);
    let main = rng.random_range(0.0..std::f64::consts::PI);
    for _ in 0..rng.random_range(60..120_u32) {
        let axis = Axis::at(main + rng.random_range(-0.5..0.5));
        let centre = frame.random_position(rng);
        let (length, width) = (rng.random_range(0.5..1.6), rng.random_range(0.12..0.35));
        let depth = rng.random_range(0.05..0.22);
        field.change(frame.box_around(centre, length), |[u, v], before| {
            let [along, across] = axis.along_across([u - centre[0], v - centre[1]]);
            let (along, across) = (along / length, across / width);
            before.max(depth * (1.0 - along * along - across * across).max(0.0))
        });
    }
    field
}

/// Wear of the stroke tops.
struct Wear {
    patches: Noise,
    patch_mm: f64,
    grain: Noise,
    grain_axis: Axis,
    pits: Noise,
    rim_mm: f64,
}

impl Wear {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        let grain_axis = Axis::at(rng.random_range(-0.2..0.2));
        Self {
            patches: Noise::draw(rng),
            patch_mm: rng.random_range(0.02..0.07),
            grain: Noise::draw(rng),
            grain_axis,
            pits: Noise::draw(rng),
            rim_mm: rng.random_range(0.02..0.06),
        }
    }

    /// Returns the height in mm that wear removes. `inside` is the distance to the stroke edge in mm. Wear consists of
    /// patches, open grain, small pits and rounded edges.
    fn at(&self, [u, v]: [f64; 2], inside: f64) -> f64 {
        let [along, across] = self.grain_axis.along_across([u, v]);
        let patches = self.patch_mm * (1.0 + self.patches.two_octaves(u / 2.2, v / 2.2));
        let grain = 0.008 * (1.0 + self.grain.at(along / 2.5, across / 0.12));
        let pits = 0.06 * smoothstep(0.72, 0.95, self.pits.at(u / 0.25, v / 0.25));
        let rim = self.rim_mm * (1.0 - smoothstep(0.0, 0.18, inside));
        patches + grain + pits + rim
    }
}

/// A quadratic bend.
struct Bend {
    axis: Axis,
    along: f64,
    across: f64,
}

impl Bend {
    /// Draws a bend whose sagitta over the strokes lies in the range, mm.
    fn draw(sagitta_mm: Range<f64>, strokes: &ScalarField, rng: &mut ChaCha8Rng) -> Self {
        let sagitta = rng.random_range(sagitta_mm);
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let axis = Axis::draw_any(rng);
        let half_extent_mm = super::artwork::half_extent_mm(strokes);
        let along = sign * sagitta / (half_extent_mm * half_extent_mm);
        Self {
            axis,
            along,
            across: along * rng.random_range(-0.2..0.3),
        }
    }

    fn at(&self, point: [f64; 2]) -> f64 {
        let [along, across] = self.axis.along_across(point);
        self.along * along * along + self.across * across * across
    }
}

fn crack_depth(damage: &Damage, point: [f64; 2]) -> f64 {
    let depths = damage.cracks.iter().map(|crack| {
        let share = crack.distance_mm(point) / crack.half_width_mm;
        crack.depth_mm * (1.0 - share).max(0.0)
    });
    depths.fold(0.0, f64::max)
}

/// Subtracts the least-squares plane of the stroke tops.
fn subtract_fitted_plane(surface: &ScalarField, strokes: &ScalarField) -> ScalarField {
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    let frame = surface.frame;
    for y in (0..frame.side).step_by(2) {
        for x in (0..frame.side).step_by(2) {
            if strokes.at(x, y) > 0.05 {
                let [u, v] = frame.position(x, y);
                let row = nalgebra::Vector3::new(1.0, u, v);
                normal += row * row.transpose();
                right += row * surface.at(x, y);
            }
        }
    }
    let plane = normal
        .cholesky()
        .map(|factor| factor.solve(&right))
        .unwrap_or_default();
    ScalarField::from_fn(frame, |[u, v], x, y| {
        surface.at(x, y) - plane[0] - plane[1] * u - plane[2] * v
    })
}
