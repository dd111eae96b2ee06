//! Sub-pixel refinement of one pose: robust Gauss-Newton on what both layers know.

use std::cell::OnceCell;
use std::rc::Rc;

use super::border_mask::own_ground;
use super::gauss_newton::{Loss, Room, Step};
use super::search::PoseCandidate;
use super::tiebreak::{Side, duel};
use super::{PoseOverlap, PyramidLevel};
use crate::domain::Affine2;
use crate::raster::Grid;
use crate::simd::dispatch;

/// A step that moves the layer's rim by less than this many pixels ends the refinement.
const SETTLED_PX: f64 = 0.03;
/// Products summed in single precision before their sum goes to the others.
const RUN: usize = 256;

/// Two layers ready to be laid on each other many times.
pub(in crate::stages) struct Refiner<'a> {
    fixed: &'a PyramidLevel,
    moving: &'a PyramidLevel,
    looked_at: Rc<LookedAt>,
    /// The moving layer's value, slope in x and y, and weight, pixel by pixel.
    cells: Vec<[f32; 4]>,
    size: [usize; 2],
    centre: [f64; 2],
    rim: f64,
    energies: [f64; 2],
    /// Where either layer can be judged, once somebody has asked.
    grounds: [OnceCell<Grid<f32>>; 2],
}

impl<'a> Refiner<'a> {
    /// Prepares the two layers.
    pub(in crate::stages) fn new(fixed: &'a PyramidLevel, moving: &'a PyramidLevel) -> Self {
        Self::with(Rc::new(LookedAt::of(fixed)), fixed, moving)
    }

    /// Prepares several layers to be laid on one.
    pub(in crate::stages) fn for_levels(
        fixed: &'a PyramidLevel,
        moving: &'a [PyramidLevel],
    ) -> Vec<Self> {
        let looked_at = Rc::new(LookedAt::of(fixed));
        let with = |moving| Self::with(Rc::clone(&looked_at), fixed, moving);
        moving.iter().map(with).collect()
    }

    fn with(looked_at: Rc<LookedAt>, fixed: &'a PyramidLevel, moving: &'a PyramidLevel) -> Self {
        let centre = fixed.centre();
        Self {
            cells: cells(moving),
            size: [moving.value.width(), moving.value.height()],
            centre,
            rim: centre[0].max(centre[1]).max(1.0),
            energies: [looked_at.energy, moving.energy()],
            looked_at,
            grounds: Default::default(),
            fixed,
            moving,
        }
    }

    /// Refines a pose so that the moving layer explains the fixed one, and scores it.
    ///
    /// The moving values may be scaled and offset freely; residuals are weighed down where only one side has
    /// something. A pose that has not settled after `most_steps` is judged where it is. The score is the correlation
    /// over what both know, over what each holds.
    pub(in crate::stages) fn refine(
        &self,
        start: &PoseCandidate,
        most_steps: usize,
        loss: Loss,
    ) -> PoseCandidate {
        let Some(mut from_fixed) = self.moving_from_fixed(&start.fixed_from_moving) else {
            return *start;
        };
        let mut room = Room::default();
        let mut damping = 1e-3;
        let mut best: Option<(Step, Affine2)> = None;
        for _ in 0..most_steps {
            let step = self.step(&from_fixed, start.mirrored, loss, &mut room);
            let better = best.as_ref().is_none_or(|(kept, _)| step.cost < kept.cost);
            if better {
                best = Some((step, from_fixed));
                damping = (damping * 0.3_f64).max(1e-6);
            } else {
                damping = (damping * 8.0).max(1e-2);
            }
            let Some((kept, at)) = &best else { break };
            let Some(change) = kept.solve(damping) else {
                break;
            };
            let reach = change[0].hypot(change[1]) * self.rim + change[2].hypot(change[3]);
            from_fixed = moved(at, &change, start.mirrored);
            if reach < SETTLED_PX || damping > 1e3 {
                break;
            }
        }
        let Some((kept, at)) = best else {
            return *start;
        };
        let score = self.share(kept.explained, &at);
        match self.to_images(&at) {
            Some(fixed_from_moving) => PoseCandidate {
                fixed_from_moving,
                score,
                mirrored: start.mirrored,
            },
            None => *start,
        }
    }

    /// The score of a pose as it is.
    pub(in crate::stages) fn evaluate(&self, pose: &PoseCandidate) -> PoseCandidate {
        let score = self
            .moving_from_fixed(&pose.fixed_from_moving)
            .map_or(0.0, |at| self.score(&at));
        PoseCandidate { score, ..*pose }
    }

    /// How much of each layer the other explains at a pose.
    pub(in crate::stages) fn overlap(&self, pose: &PoseCandidate) -> PoseOverlap {
        self.moving_from_pixels(pose)
            .map(|into| {
                PoseOverlap::of(
                    [self.fixed, self.moving],
                    [self.paper(), self.ground()],
                    &into,
                )
            })
            .unwrap_or_default()
    }

    /// The scores of a pose and of a rival, which may have other strokes, on the ground they share; zeros where a pose
    /// cannot be turned round.
    pub(in crate::stages) fn duel(
        &self,
        pose: &PoseCandidate,
        other: &Self,
        rival: &PoseCandidate,
    ) -> [f64; 2] {
        match (self.side(pose), other.side(rival)) {
            (Some(one), Some(two)) => duel(self.fixed, self.paper(), &[one, two]),
            _ => [0.0; 2],
        }
    }

    fn side(&self, pose: &PoseCandidate) -> Option<Side<'_>> {
        Some(Side {
            moving: self.moving,
            ground: self.ground(),
            moving_from_fixed: self.moving_from_pixels(pose)?,
        })
    }

    /// Where the fixed layer can be judged.
    fn paper(&self) -> &Grid<f32> {
        self.grounds[0].get_or_init(|| own_ground(self.fixed))
    }

    /// Where the moving layer can be judged.
    fn ground(&self) -> &Grid<f32> {
        self.grounds[1].get_or_init(|| own_ground(self.moving))
    }

    /// From the fixed layer's pixels into the moving one at a pose.
    fn moving_from_pixels(&self, pose: &PoseCandidate) -> Option<Affine2> {
        let to_middle = Affine2::scale_shift(1.0, self.centre.map(|c| -c));
        let into = self.moving_from_fixed(&pose.fixed_from_moving)?;
        Some(into.after(&to_middle))
    }

    /// The pose between layers, from the fixed one's pixels relative to its middle into the moving one.
    fn moving_from_fixed(&self, fixed_from_moving: &Affine2) -> Option<Affine2> {
        let image = fixed_from_moving.inverse()?;
        let from_work = self.fixed.work_from_image.inverse()?;
        let from_middle = Affine2::scale_shift(1.0, self.centre);
        let into = self.moving.work_from_image.after(&image).after(&from_work);
        Some(into.after(&from_middle))
    }

    /// Back from layers to images.
    fn to_images(&self, from_fixed: &Affine2) -> Option<Affine2> {
        let to_image = self.moving.work_from_image.inverse()?;
        let to_middle = Affine2::scale_shift(1.0, self.centre.map(|c| -c));
        to_image
            .after(from_fixed)
            .after(&to_middle)
            .after(&self.fixed.work_from_image)
            .inverse()
    }

    /// What each known pixel of the fixed layer meets in the moving one.
    fn look(&self, from_fixed: &Affine2, room: &mut Room) {
        room.clear(self.looked_at.places.len());
        let explained = self.explained(
            from_fixed,
            #[inline(always)]
            |[u, v], place, value| {
                self.cell(u, v).map_or(0.0, |cell| {
                    room.put(value, cell, place);
                    cell[0]
                })
            },
        );
        room.close(explained);
    }

    /// Sum of the products of the fixed values with those that `meet` finds, given where in the moving layer, the pixel's
    /// place in the fixed one, and its value.
    #[inline(always)]
    fn explained(
        &self,
        from_fixed: &Affine2,
        mut meet: impl FnMut([f32; 2], [f32; 2], f32) -> f32,
    ) -> f64 {
        let LookedAt { places, values, .. } = &*self.looked_at;
        let [a, b] = from_fixed.0.map(|row| row.map(|v| v as f32));
        let runs = places.chunks(RUN).zip(values.chunks(RUN));
        let mut explained = 0.0_f64;
        dispatch(
            #[inline(always)]
            || {
                for (places, values) in runs {
                    let mut part = 0.0_f32;
                    for ([x, y], value) in places.iter().zip(values) {
                        let u = a[0] * x + a[1] * y + a[2];
                        let v = b[0] * x + b[1] * y + b[2];
                        part += meet([u, v], [*x, *y], *value) * value;
                    }
                    explained += f64::from(part);
                }
            },
        );
        explained
    }

    /// Bilinear look into the moving layer; `None` outside.
    #[inline(always)]
    fn cell(&self, u: f32, v: f32) -> Option<[f32; 4]> {
        let (from, [fx, fy]) = self.corner(u, v)?;
        let (above, below) = (
            &self.cells[from..from + 2],
            &self.cells[from + self.size[0]..][..2],
        );
        let (top, bottom) = (mix(above[0], above[1], fx), mix(below[0], below[1], fx));
        Some(mix(top, bottom, fy))
    }

    /// The value alone.
    #[inline(always)]
    fn value(&self, u: f32, v: f32) -> f32 {
        let Some((from, [fx, fy])) = self.corner(u, v) else {
            return 0.0;
        };
        let width = self.size[0];
        let near = &self.moving.value.data()[from..from + width + 2];
        let top = near[0] + (near[1] - near[0]) * fx;
        let bottom = near[width] + (near[width + 1] - near[width]) * fx;
        top + (bottom - top) * fy
    }

    /// The cell of the moving layer up and left of a place, and where beyond it the place lies; `None` outside.
    #[inline(always)]
    fn corner(&self, u: f32, v: f32) -> Option<(usize, [f32; 2])> {
        let [width, height] = self.size;
        if !(u >= 0.0 && v >= 0.0 && u < (width - 1) as f32 && v < (height - 1) as f32) {
            return None;
        }
        // Narrow integers: casts between them and floats are single instructions.
        let (column, row) = (u as i32, v as i32);
        let within = [u - column as f32, v - row as f32];
        Some((row as usize * width + column as usize, within))
    }

    fn step(&self, from_fixed: &Affine2, mirrored: bool, loss: Loss, room: &mut Room) -> Step {
        self.look(from_fixed, room);
        Step::of(room, mirrored, loss)
    }

    /// Correlation over what both know, over the whole of what each holds.
    fn score(&self, from_fixed: &Affine2) -> f64 {
        let explained = self.explained(
            from_fixed,
            #[inline(always)]
            |[u, v], _, _| self.value(u, v),
        );
        self.share(explained, from_fixed)
    }

    /// That score, given the sum of the products of the values that meet.
    fn share(&self, explained: f64, from_fixed: &Affine2) -> f64 {
        // A moving pixel covers this many fixed ones.
        let area = from_fixed.determinant().abs().max(1e-12);
        explained
            / self.looked_at.share
            / (self.energies[0] * self.energies[1] / area)
                .sqrt()
                .max(1e-12)
    }
}

/// From one to the other by a share; a loop, since what is not inlined gains nothing by wide instructions.
#[inline(always)]
fn mix(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    let mut mixed = a;
    for k in 0..4 {
        mixed[k] += (b[k] - a[k]) * share;
    }
    mixed
}

/// What is looked at of a fixed layer.
struct LookedAt {
    /// Known pixels: place relative to its middle, and value. One colour of a chessboard is enough: layers are smooth,
    /// neighbours say nearly the same.
    places: Vec<[f32; 2]>,
    values: Vec<f32>,
    /// Share of the known pixels that are in these lists.
    share: f64,
    /// That of the whole layer.
    energy: f64,
}

impl LookedAt {
    fn of(layer: &PyramidLevel) -> Self {
        let centre = layer.centre().map(|c| c as f32);
        let (width, height) = (layer.value.width(), layer.value.height());
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for y in 0..height {
            for x in (y % 2..width).step_by(2) {
                if layer.weight.at(x, y) > 0.0 {
                    places.push([x as f32 - centre[0], y as f32 - centre[1]]);
                    values.push(layer.value.at(x, y));
                }
            }
        }
        let known = layer.weight.data().iter().filter(|w| **w > 0.0).count();
        Self {
            share: places.len().max(1) as f64 / known.max(1) as f64,
            places,
            values,
            energy: layer.energy(),
        }
    }
}

/// Changes the map by a small similarity about the fixed layer's middle.
fn moved(map: &Affine2, change: &[f64; 6], mirrored: bool) -> Affine2 {
    let [a, b, tx, ty, _, _] = *change;
    let s = if mirrored { -1.0 } else { 1.0 };
    let [p, q] = map.0;
    Affine2([
        [p[0] + a, p[1] - b * s, p[2] + tx],
        [q[0] + b, q[1] + a * s, q[2] + ty],
    ])
}

/// Value, central differences and weight of each pixel of a layer.
fn cells(layer: &PyramidLevel) -> Vec<[f32; 4]> {
    let (width, height) = (layer.value.width(), layer.value.height());
    let mut cells = Vec::with_capacity(width * height);
    for y in 0..height {
        let [above, row, below] =
            [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| layer.value.row(y));
        let sides = (0..width).map(|x| {
            let slope_x = (row[(x + 1).min(width - 1)] - row[x.saturating_sub(1)]) * 0.5;
            let slope_y = (below[x] - above[x]) * 0.5;
            [row[x], slope_x, slope_y, layer.weight.at(x, y)]
        });
        cells.extend(sides);
    }
    cells
}
