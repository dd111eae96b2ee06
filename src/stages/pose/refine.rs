//! Sub-pixel refinement of one pose: robust Gauss-Newton on what both layers know.

use nalgebra::{Matrix6, Vector6};

use super::search::Found;
use super::{Layer, Overlap};
use crate::domain::Affine2;

/// Most steps; a pose that has not settled by then is judged where it is.
const MOST_STEPS: usize = 15;
/// A step that moves the layer's rim by less than this many pixels ends the refinement.
const SETTLED_PX: f64 = 0.01;
/// Residuals beyond this many of their median count less: what stands on one side only must not decide.
const ROBUST: f32 = 2.5;
/// Residuals beyond this share of full ink belong to what is lost or was added: they do not count at all.
const FAR: f32 = 0.5;
/// Pixels whose sums are kept apart, so that they are added side by side.
const LANES: usize = 8;
/// Products of a row of the normal equations with itself, lower triangle, then with the residual.
const SUMS: usize = 21 + 6;

/// What a residual costs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::stages) enum Loss {
    /// Large residuals count less: from afar.
    Huber,
    /// Large residuals do not count: once the pose is nearly right.
    Tukey,
}

/// Two layers ready to be laid on each other many times.
pub(in crate::stages) struct Refiner<'a> {
    fixed: &'a Layer,
    moving: &'a Layer,
    /// Known pixels of the fixed layer: place relative to its middle, and value.
    places: Vec<[f32; 2]>,
    values: Vec<f32>,
    /// The moving layer's value, slope in x and y, and weight, pixel by pixel.
    cells: Vec<[f32; 4]>,
    size: [usize; 2],
    centre: [f64; 2],
    rim: f64,
    energies: [f64; 2],
}

impl<'a> Refiner<'a> {
    /// Prepares the two layers.
    pub(in crate::stages) fn new(fixed: &'a Layer, moving: &'a Layer) -> Self {
        let centre = fixed.centre();
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for y in 0..fixed.value.height() {
            for x in 0..fixed.value.width() {
                if fixed.weight.at(x, y) > 0.0 {
                    places.push([x as f32 - centre[0] as f32, y as f32 - centre[1] as f32]);
                    values.push(fixed.value.at(x, y));
                }
            }
        }
        Self {
            places,
            values,
            cells: cells(moving),
            size: [moving.value.width(), moving.value.height()],
            centre,
            rim: centre[0].max(centre[1]).max(1.0),
            energies: [fixed.energy(), moving.energy()],
            fixed,
            moving,
        }
    }

    /// Refines a pose so that the moving layer explains the fixed one, and scores it.
    ///
    /// The moving values may be scaled and offset freely; residuals are weighed down where only one side has
    /// something. The score is the correlation over what both know, over what each holds.
    pub(in crate::stages) fn refine(&self, start: &Found, most_steps: usize, loss: Loss) -> Found {
        let Some(mut from_fixed) = self.moving_from_fixed(&start.fixed_from_moving) else {
            return *start;
        };
        let mut room = Room::default();
        let mut damping = 1e-3;
        let mut best: Option<(Step, Affine2)> = None;
        for _ in 0..most_steps.min(MOST_STEPS) {
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
        let Some((_, at)) = best else { return *start };
        let score = self.score(&at);
        match self.to_images(&at) {
            Some(fixed_from_moving) => Found {
                fixed_from_moving,
                score,
                mirrored: start.mirrored,
            },
            None => *start,
        }
    }

    /// The score of a pose as it is.
    pub(in crate::stages) fn judged(&self, pose: &Found) -> Found {
        let score = self
            .moving_from_fixed(&pose.fixed_from_moving)
            .map_or(0.0, |at| self.score(&at));
        Found { score, ..*pose }
    }

    /// How much of each layer the other explains at a pose.
    pub(in crate::stages) fn overlap(&self, pose: &Found) -> Overlap {
        let to_middle = Affine2::scale_shift(1.0, self.centre.map(|c| -c));
        self.moving_from_fixed(&pose.fixed_from_moving)
            .map(|into| Overlap::of(self.fixed, self.moving, &into.after(&to_middle)))
            .unwrap_or_default()
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
        room.clear();
        let [a, b] = from_fixed.0.map(|row| row.map(|v| v as f32));
        for (place, value) in self.places.iter().zip(&self.values) {
            let [x, y] = *place;
            let u = a[0] * x + a[1] * y + a[2];
            let v = b[0] * x + b[1] * y + b[2];
            let Some([m, gx, gy, w]) = self.cell(u, v) else {
                continue;
            };
            if w < 0.5 {
                continue;
            }
            room.push([*value, m, gx, gy, x, y]);
        }
    }

    /// Bilinear look into the moving layer; `None` outside.
    #[inline]
    fn cell(&self, u: f32, v: f32) -> Option<[f32; 4]> {
        let ([p, q, r, s], [fx, fy]) = self.corners(u, v)?;
        Some(std::array::from_fn(|k| {
            let top = p[k] + (q[k] - p[k]) * fx;
            let bottom = r[k] + (s[k] - r[k]) * fx;
            top + (bottom - top) * fy
        }))
    }

    /// The value alone.
    #[inline]
    fn value(&self, u: f32, v: f32) -> f32 {
        let Some(([p, q, r, s], [fx, fy])) = self.corners(u, v) else {
            return 0.0;
        };
        let top = p[0] + (q[0] - p[0]) * fx;
        let bottom = r[0] + (s[0] - r[0]) * fx;
        top + (bottom - top) * fy
    }

    /// The four cells around a place of the moving layer, and where between them it lies; `None` outside.
    #[inline]
    fn corners(&self, u: f32, v: f32) -> Option<([[f32; 4]; 4], [f32; 2])> {
        let [width, height] = self.size;
        if !(u >= 0.0 && v >= 0.0 && u < (width - 1) as f32 && v < (height - 1) as f32) {
            return None;
        }
        // Narrow integers: casts between them and floats are single instructions.
        let (column, row) = (u as i32, v as i32);
        let within = [u - column as f32, v - row as f32];
        let from = row as usize * width + column as usize;
        let (above, below) = (
            &self.cells[from..from + 2],
            &self.cells[from + width..][..2],
        );
        Some(([above[0], above[1], below[0], below[1]], within))
    }

    fn step(&self, from_fixed: &Affine2, mirrored: bool, loss: Loss, room: &mut Room) -> Step {
        self.look(from_fixed, room);
        let (gain, offset) = room.gain_and_offset();
        let limit = match loss {
            Loss::Huber => ROBUST * room.median_residual(gain, offset).max(1e-4),
            Loss::Tukey => FAR,
        };
        let mut sums = [[0.0_f32; LANES]; SUMS + 1];
        let mut totals = [0.0_f64; SUMS + 1];
        for (k, looks) in room.looks.iter().enumerate() {
            let held = LANES.min(room.count - k * LANES);
            add(
                &mut sums,
                looks,
                held,
                mirrored,
                [gain, offset, limit],
                loss,
            );
            if k % 128 == 127 {
                drain(&mut sums, &mut totals);
            }
        }
        drain(&mut sums, &mut totals);
        Step {
            cost: if room.count == 0 {
                f64::INFINITY
            } else {
                totals[SUMS] / room.count as f64
            },
            sums: totals,
        }
    }

    /// Correlation over what both know, over the whole of what each holds.
    fn score(&self, from_fixed: &Affine2) -> f64 {
        let [a, b] = from_fixed.0.map(|row| row.map(|v| v as f32));
        let mut both = 0.0_f64;
        for (places, values) in self.places.chunks(256).zip(self.values.chunks(256)) {
            let mut part = 0.0_f32;
            for ([x, y], value) in places.iter().zip(values) {
                let u = a[0] * x + a[1] * y + a[2];
                let v = b[0] * x + b[1] * y + b[2];
                part += self.value(u, v) * value;
            }
            both += f64::from(part);
        }
        // A moving pixel covers this many fixed ones.
        let area = from_fixed.determinant().abs().max(1e-12);
        both / (self.energies[0] * self.energies[1] / area)
            .sqrt()
            .max(1e-12)
    }
}

/// Adds the products of a few looks, side by side, to the sums of the normal equations and of the cost.
fn add(
    sums: &mut [[f32; LANES]; SUMS + 1],
    [f, m, gx, gy, x, y]: &Looks,
    held: usize,
    mirrored: bool,
    [gain, offset, limit]: [f32; 3],
    loss: Loss,
) {
    let s = if mirrored { -1.0 } else { 1.0 };
    let residual: [f32; LANES] = std::array::from_fn(|k| f[k] - gain * m[k] - offset);
    let (mut weight, mut cost) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..held {
        (weight[k], cost[k]) = loss.at(residual[k].abs(), limit);
    }
    let row: [[f32; LANES]; 6] = [
        std::array::from_fn(|k| gain * (gx[k] * x[k] + gy[k] * y[k] * s)),
        std::array::from_fn(|k| gain * (gy[k] * x[k] - gx[k] * y[k] * s)),
        gx.map(|v| gain * v),
        gy.map(|v| gain * v),
        *m,
        [1.0; LANES],
    ];
    let mut at = 0;
    for i in 0..6 {
        let weighed: [f32; LANES] = std::array::from_fn(|k| weight[k] * row[i][k]);
        for other in &row[..=i] {
            for k in 0..LANES {
                sums[at][k] += weighed[k] * other[k];
            }
            at += 1;
        }
        for k in 0..LANES {
            sums[21 + i][k] += weighed[k] * residual[k];
        }
    }
    for k in 0..LANES {
        sums[SUMS][k] += cost[k];
    }
}

fn drain(sums: &mut [[f32; LANES]; SUMS + 1], totals: &mut [f64; SUMS + 1]) {
    for (lanes, total) in sums.iter_mut().zip(totals) {
        *total += lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
        *lanes = [0.0; LANES];
    }
}

impl Loss {
    /// Weight of a residual and its cost, so that steps are judged by what they minimise.
    #[inline]
    fn at(self, size: f32, limit: f32) -> (f32, f32) {
        match self {
            Self::Huber if size > limit => (limit / size, limit * (2.0 * size - limit)),
            Self::Huber => (1.0, size * size),
            Self::Tukey => {
                let near = (1.0 - (size / limit).powi(2)).max(0.0);
                let cost = limit * limit / 3.0 * (1.0 - near * near * near);
                (near * near, cost)
            }
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

/// A few looks side by side: the fixed value, the moving one, its slopes in x and y, and the place.
type Looks = [[f32; LANES]; 6];

/// Buffers of one refinement.
#[derive(Default)]
struct Room {
    /// The last one may be filled only in part, with zeros after.
    looks: Vec<Looks>,
    count: usize,
    sizes: Vec<f32>,
}

impl Room {
    fn clear(&mut self) {
        self.looks.clear();
        self.count = 0;
    }

    #[inline]
    fn push(&mut self, look: [f32; 6]) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.looks.push([[0.0; LANES]; 6]);
        }
        if let Some(last) = self.looks.last_mut() {
            for (lanes, value) in last.iter_mut().zip(look) {
                lanes[lane] = value;
            }
        }
        self.count += 1;
    }

    /// Least-squares gain and offset of the fixed values over the moving ones; the gain never below a trifle.
    fn gain_and_offset(&self) -> (f32, f32) {
        let mut sums = [[0.0_f64; LANES]; 4];
        for [f, m, ..] in &self.looks {
            for k in 0..LANES {
                let (a, b) = (f64::from(f[k]), f64::from(m[k]));
                for (sum, value) in sums.iter_mut().zip([a, b, a * b, b * b]) {
                    sum[k] += value;
                }
            }
        }
        let n = self.count.max(1) as f64;
        let [f, m, fm, mm] = sums.map(|lanes| lanes.iter().sum::<f64>() / n);
        let gain = ((fm - f * m) / (mm - m * m).max(1e-9)).max(0.05);
        (gain as f32, (f - gain * m) as f32)
    }

    /// Median size of the residuals at a gain and offset.
    fn median_residual(&mut self, gain: f32, offset: f32) -> f32 {
        self.sizes.clear();
        for [f, m, ..] in &self.looks {
            let sizes: [f32; LANES] = std::array::from_fn(|k| (f[k] - gain * m[k] - offset).abs());
            self.sizes.extend(sizes);
        }
        self.sizes.truncate(self.count);
        median(&mut self.sizes)
    }
}

/// Normal equations at one pose: four of the pose, gain and offset of the values.
struct Step {
    /// The last is the cost before it was shared out.
    sums: [f64; SUMS + 1],
    cost: f64,
}

impl Step {
    fn solve(&self, damping: f64) -> Option<[f64; 6]> {
        let mut normal = Matrix6::zeros();
        let mut at = 0;
        for i in 0..6 {
            for j in 0..=i {
                normal[(i, j)] = self.sums[at];
                normal[(j, i)] = self.sums[at];
                at += 1;
            }
        }
        for i in 0..6 {
            normal[(i, i)] = normal[(i, i)] * (1.0 + damping) + 1e-12;
        }
        let right = Vector6::from_fn(|i, _| self.sums[21 + i]);
        Some(normal.cholesky()?.solve(&right).into())
    }
}

fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let k = values.len() / 2;
    *values.select_nth_unstable_by(k, f32::total_cmp).1
}

/// Value, central differences and weight of each pixel of a layer.
fn cells(layer: &Layer) -> Vec<[f32; 4]> {
    let (width, height) = (layer.value.width(), layer.value.height());
    let mut cells = Vec::with_capacity(width * height);
    for y in 0..height {
        let row = layer.value.row(y);
        let above = layer.value.row(y.saturating_sub(1));
        let below = layer.value.row((y + 1).min(height - 1));
        for x in 0..width {
            let slope_x = (row[(x + 1).min(width - 1)] - row[x.saturating_sub(1)]) * 0.5;
            let slope_y = (below[x] - above[x]) * 0.5;
            cells.push([row[x], slope_x, slope_y, layer.weight.at(x, y)]);
        }
    }
    cells
}
