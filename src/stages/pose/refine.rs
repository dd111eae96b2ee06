//! Sub-pixel refinement of one pose: robust Gauss-Newton on what both layers know.

use nalgebra::{Matrix6, Vector6};

use super::Layer;
use super::layer::sample;
use super::search::Found;
use crate::domain::Affine2;
use crate::raster::Grid;

/// Most steps; a pose that has not settled by then is judged where it is.
const MOST_STEPS: usize = 15;
/// A step that moves the layer's rim by less than this many pixels ends the refinement.
const SETTLED_PX: f64 = 0.02;
/// Residuals beyond this many of their median count less: what stands on one side only must not decide.
const ROBUST: f64 = 2.5;

/// Refines a pose so that the moving layer explains the fixed one, and scores it.
///
/// The moving values may be scaled and offset freely; residuals are weighed down where only one side has something.
/// The score is the correlation over what both know, over what each holds.
pub(in crate::stages) fn refine(fixed: &Layer, moving: &Layer, start: &Found) -> Found {
    let Some(mut from_fixed) = moving_from_fixed(fixed, moving, &start.fixed_from_moving) else {
        return *start;
    };
    let at_start = from_fixed;
    let slopes = Slopes::of(&moving.value);
    let centre = fixed.centre();
    let rim = centre[0].max(centre[1]).max(1.0);
    let mut damping = 1e-3;
    let mut cost = f64::INFINITY;
    let mut last = from_fixed;
    for _ in 0..MOST_STEPS {
        let step = Step::at(fixed, moving, &slopes, &from_fixed, centre, start.mirrored);
        if step.cost > cost {
            from_fixed = last;
            damping *= 8.0;
            if damping > 1e3 {
                break;
            }
            cost = f64::INFINITY;
            continue;
        }
        cost = step.cost;
        last = from_fixed;
        let Some(change) = step.solve(damping) else {
            break;
        };
        damping = (damping * 0.5).max(1e-6);
        from_fixed = moved(&from_fixed, &change, centre, start.mirrored);
        let reach = change[0].hypot(change[1]) * rim + change[2].hypot(change[3]);
        if reach < SETTLED_PX {
            break;
        }
    }
    // The last step was never judged; it must not leave the pose worse than it came.
    let (before, after) = (
        score(fixed, moving, &at_start),
        score(fixed, moving, &from_fixed),
    );
    match to_images(fixed, moving, &from_fixed) {
        Some(fixed_from_moving) if after >= before => Found {
            fixed_from_moving,
            score: after,
            mirrored: start.mirrored,
        },
        _ => Found {
            score: before,
            ..*start
        },
    }
}

/// The pose between layers, looking from the fixed one into the moving one.
fn moving_from_fixed(
    fixed: &Layer,
    moving: &Layer,
    fixed_from_moving: &Affine2,
) -> Option<Affine2> {
    let image = fixed_from_moving.inverse()?;
    let from_work = fixed.work_from_image.inverse()?;
    Some(moving.work_from_image.after(&image).after(&from_work))
}

/// Back from layers to images.
fn to_images(fixed: &Layer, moving: &Layer, from_fixed: &Affine2) -> Option<Affine2> {
    let to_image = moving.work_from_image.inverse()?;
    to_image
        .after(from_fixed)
        .after(&fixed.work_from_image)
        .inverse()
}

/// Changes the map by a small similarity: `[a, b]` of the linear part about `centre`, and the shift.
fn moved(map: &Affine2, change: &[f64; 6], centre: [f64; 2], mirrored: bool) -> Affine2 {
    let [a, b, tx, ty, _, _] = *change;
    let s = if mirrored { -1.0 } else { 1.0 };
    let linear = [[a, -b * s], [b, a * s]];
    let mut out = map.0;
    for (row, add) in out.iter_mut().zip(linear) {
        row[2] -= add[0] * centre[0] + add[1] * centre[1];
        row[0] += add[0];
        row[1] += add[1];
    }
    out[0][2] += tx;
    out[1][2] += ty;
    Affine2(out)
}

/// Normal equations at one pose: four of the pose, gain and offset of the values.
struct Step {
    normal: Matrix6<f64>,
    right: Vector6<f64>,
    cost: f64,
}

/// One pixel's part: fixed value, moving value, slopes of the moving value, place relative to the middle.
struct Look {
    fixed: f64,
    moving: f64,
    slope: [f64; 2],
    place: [f64; 2],
}

impl Step {
    fn at(
        fixed: &Layer,
        moving: &Layer,
        slopes: &Slopes,
        from_fixed: &Affine2,
        centre: [f64; 2],
        mirrored: bool,
    ) -> Self {
        let looks = looks(fixed, moving, slopes, from_fixed, centre);
        let (gain, offset) = gain_and_offset(&looks);
        let mut sizes: Vec<f64> = looks
            .iter()
            .map(|l| (l.fixed - gain * l.moving - offset).abs())
            .collect();
        let limit = ROBUST * median(&mut sizes).max(1e-4);
        let s = if mirrored { -1.0 } else { 1.0 };
        let mut step = Self {
            normal: Matrix6::zeros(),
            right: Vector6::zeros(),
            cost: 0.0,
        };
        let mut total = 0.0;
        for l in &looks {
            let residual = l.fixed - gain * l.moving - offset;
            let weight = if residual.abs() > limit {
                limit / residual.abs()
            } else {
                1.0
            };
            let [gx, gy] = l.slope;
            let [x, y] = l.place;
            let row = [
                gain * (gx * x + gy * y * s),
                gain * (gy * x - gx * y * s),
                gain * gx,
                gain * gy,
                l.moving,
                1.0,
            ];
            step.add(&row, residual, weight);
            // Huber's cost, so that steps are judged by what they minimise.
            let size = residual.abs();
            step.cost += if size > limit {
                limit * (2.0 * size - limit)
            } else {
                size * size
            };
            total += 1.0;
        }
        step.cost = if total > 0.0 {
            step.cost / total
        } else {
            f64::INFINITY
        };
        step
    }

    fn add(&mut self, row: &[f64; 6], residual: f64, weight: f64) {
        for i in 0..6 {
            self.right[i] += weight * row[i] * residual;
            for j in 0..=i {
                self.normal[(i, j)] += weight * row[i] * row[j];
            }
        }
    }

    fn solve(&self, damping: f64) -> Option<[f64; 6]> {
        let mut normal = self.normal;
        for i in 0..6 {
            normal[(i, i)] = normal[(i, i)] * (1.0 + damping) + 1e-12;
            for j in 0..i {
                normal[(j, i)] = normal[(i, j)];
            }
        }
        Some(normal.cholesky()?.solve(&self.right).into())
    }
}

/// What each known pixel of the fixed layer meets in the moving one.
fn looks(
    fixed: &Layer,
    moving: &Layer,
    slopes: &Slopes,
    from_fixed: &Affine2,
    centre: [f64; 2],
) -> Vec<Look> {
    let mut looks = Vec::new();
    for y in 0..fixed.value.height() {
        for x in 0..fixed.value.width() {
            let p = [x as f64, y as f64];
            let there = from_fixed.apply(p);
            if fixed.weight.at(x, y) == 0.0 || !held(&moving.weight, there) {
                continue;
            }
            looks.push(Look {
                fixed: f64::from(fixed.value.at(x, y)),
                moving: sample(&moving.value, there),
                slope: [sample(&slopes.x, there), sample(&slopes.y, there)],
                place: [p[0] - centre[0], p[1] - centre[1]],
            });
        }
    }
    looks
}

/// Least-squares gain and offset of the fixed values over the moving ones; the gain never below a trifle.
fn gain_and_offset(looks: &[Look]) -> (f64, f64) {
    let n = looks.len().max(1) as f64;
    let mean = |value: &dyn Fn(&Look) -> f64| looks.iter().map(value).sum::<f64>() / n;
    let (f, m) = (mean(&|l| l.fixed), mean(&|l| l.moving));
    let both = mean(&|l| (l.fixed - f) * (l.moving - m));
    let own = mean(&|l| (l.moving - m).powi(2));
    let gain = (both / own.max(1e-9)).max(0.05);
    (gain, f - gain * m)
}

/// Correlation over what both know, over the whole of what each holds.
fn score(fixed: &Layer, moving: &Layer, from_fixed: &Affine2) -> f64 {
    let mut both = 0.0;
    for y in 0..fixed.value.height() {
        for x in 0..fixed.value.width() {
            let there = from_fixed.apply([x as f64, y as f64]);
            both += f64::from(fixed.value.at(x, y)) * sample(&moving.value, there);
        }
    }
    // A moving pixel covers this many fixed ones.
    let area = from_fixed.determinant().abs().max(1e-12);
    both / (fixed.energy() * moving.energy() / area).sqrt().max(1e-12)
}

fn held(weight: &Grid<f32>, [x, y]: [f64; 2]) -> bool {
    weight
        .get(x.round() as i64, y.round() as i64)
        .is_some_and(|w| w > 0.0)
}

fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let k = values.len() / 2;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}

/// Central differences of a grid.
struct Slopes {
    x: Grid<f32>,
    y: Grid<f32>,
}

impl Slopes {
    fn of(values: &Grid<f32>) -> Self {
        let at = |x: i64, y: i64| {
            let column = x.clamp(0, values.width() as i64 - 1) as usize;
            let row = y.clamp(0, values.height() as i64 - 1) as usize;
            values.at(column, row)
        };
        let slope = |dx: i64, dy: i64| {
            Grid::from_fn(values.width(), values.height(), |x, y| {
                let (x, y) = (x as i64, y as i64);
                (at(x + dx, y + dy) - at(x - dx, y - dy)) * 0.5
            })
        };
        Self {
            x: slope(1, 0),
            y: slope(0, 1),
        }
    }
}
