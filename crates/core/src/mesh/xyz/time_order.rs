//! A first column that grows from point to point: a time, or x of points that are sorted.

use crate::domain::cancel::polled;

/// Fewest points of which parts are compared with a surface.
const FEWEST_POINTS: usize = 4096;
/// Parts of points that are compared.
const PARTS: usize = 64;
/// Least lower quartile of the steps between heights that are no surface, as a multiple of their standard deviation. Heights in
/// no order have 0.45. Those of a relief in thin parts have less than half of that, also if the points have a flat back: then,
/// half of the steps lead from one side to the other.
const LEAST_ROUGHNESS: f64 = 0.3;
/// Least correlation of a time with a coordinate along which a scanner moves.
const LEAST_CORRELATION: f64 = 0.998;

/// Returns whether the first column, read as x, grows as a clock does: never less than before, and mostly by about the same, or
/// such that the points would be no surface.
pub(super) fn is_time_order(points: &[[f64; 3]]) -> bool {
    let mut pairs = polled(points.windows(2));
    if !pairs.all(|pair| pair[0][0] <= pair[1][0]) {
        return false;
    }
    has_regular_steps(points)
        || (points.len() >= FEWEST_POINTS && (is_rough(points) || is_sweep(points)))
}

/// Returns whether most numbers are larger than the one before, and mostly by about the same.
fn has_regular_steps(points: &[[f64; 3]]) -> bool {
    let steps = polled(points.windows(2)).map(|pair| pair[1][0] - pair[0][0]);
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    if 2 * steps.len() < points.len() || steps.is_empty() {
        return false;
    }
    let middle = steps.len() / 2;
    let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let is_usual = |step: &&f64| (0.5 * usual..=1.5 * usual).contains(*step);
    let regular = polled(&steps).filter(is_usual).count();
    10 * regular >= 8 * steps.len()
}

/// Returns whether heights change without order across most thin parts along x.
fn is_rough(points: &[[f64; 3]]) -> bool {
    let parts = points.chunks_exact(points.len() / PARTS);
    let rough = parts.filter(|part| roughness(part) > LEAST_ROUGHNESS);
    rough.count() > PARTS / 2
}

/// Returns the lower quartile of the steps between the heights of points in the order of y, as a multiple of the standard
/// deviation of the heights.
fn roughness(part: &[[f64; 3]]) -> f64 {
    let mut sorted: Vec<[f64; 3]> = polled(part).copied().collect();
    sorted.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let steps = polled(sorted.windows(2)).map(|pair| (pair[1][2] - pair[0][2]).abs());
    let mut steps: Vec<f64> = steps.collect();
    let quarter = steps.len() / 4;
    let step = *steps.select_nth_unstable_by(quarter, f64::total_cmp).1;
    let deviation = covariance(&sorted, 2, 2).sqrt();
    if deviation > 0.0 {
        step / deviation
    } else {
        0.0
    }
}

/// Returns whether y or z grows along with x, as along the rows of a scanner.
fn is_sweep(points: &[[f64; 3]]) -> bool {
    let along_x = covariance(points, 0, 0);
    [1, 2].into_iter().any(|axis| {
        let product = along_x * covariance(points, axis, axis);
        product > 0.0 && covariance(points, 0, axis).abs() > LEAST_CORRELATION * product.sqrt()
    })
}

fn covariance(points: &[[f64; 3]], a: usize, b: usize) -> f64 {
    let count = points.len() as f64;
    let mean = |axis: usize| polled(points).map(|point| point[axis]).sum::<f64>() / count;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let products = polled(points).map(|point| (point[a] - mean_a) * (point[b] - mean_b));
    products.sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use super::is_time_order;

    const SIDE: usize = 80;

    /// Returns a place of a relief of 40 by 40 by 2.
    fn place(k: usize) -> [f64; 3] {
        let [x, y] = [k / SIDE, k % SIDE].map(|at| 0.5 * at as f64 + 0.125);
        [x, y, (0.4 * x).sin() * (0.5 * y).cos() + 1.0]
    }

    /// Returns numbers that grow by unequal steps, each of them several times.
    fn time(k: usize, repeats: usize) -> f64 {
        let step = k / repeats;
        1.7e9 + 0.02 * (step * step) as f64
    }

    #[test]
    fn times_with_unequal_or_repeated_steps_are_found() {
        for repeats in [1, 7, 50] {
            let row = |k: usize, other: usize| {
                let [x, y, _] = place(other);
                [time(k, repeats), x, y]
            };
            let mixed = |k: usize| row(k, k * 2749 % (SIDE * SIDE));
            let along = |k: usize| row(k, k);
            let mixed: Vec<[f64; 3]> = (0..SIDE * SIDE).map(mixed).collect();
            assert!(is_time_order(&mixed), "{repeats}");
            let linear = |k: usize| {
                let [_, x, y] = along(k);
                [1e5 + 0.25 * (k / repeats) as f64, y, x]
            };
            let linear: Vec<[f64; 3]> = (0..SIDE * SIDE).map(linear).collect();
            assert!(is_time_order(&linear), "{repeats}");
        }
    }

    #[test]
    fn sorted_points_of_a_relief_are_no_times() {
        let profiles: Vec<[f64; 3]> = (0..SIDE * SIDE).map(place).collect();
        assert!(!is_time_order(&profiles));
        let mut mixed: Vec<[f64; 3]> = (0..SIDE * SIDE)
            .map(|k| {
                let [x, y, z] = place(k * 2749 % (SIDE * SIDE));
                [x + 0.01 * (k % 31) as f64, y + 0.01 * (k % 17) as f64, z]
            })
            .collect();
        mixed.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let shifted: Vec<[f64; 3]> = mixed
            .iter()
            .enumerate()
            .map(|(k, [x, y, z])| [*x + (k * k) as f64 * 1e-7, *y, *z])
            .collect();
        assert!(!is_time_order(&shifted));
    }

    #[test]
    fn sorted_points_with_a_flat_back_are_no_times() {
        let mut points: Vec<[f64; 3]> = (0..SIDE * SIDE)
            .flat_map(|k| {
                let [x, y, z] = place(k * 2749 % (SIDE * SIDE));
                let (x, y) = (x + 0.013 * (k % 31) as f64, y + 0.011 * (k % 17) as f64);
                [[x, y, z], [x + 0.004, y + 0.1, -6.0]]
            })
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let uneven = points.iter().enumerate();
        let uneven: Vec<[f64; 3]> = uneven
            .map(|(k, [x, y, z])| [*x + (k * k) as f64 * 1e-7, *y, *z])
            .collect();
        assert!(!is_time_order(&uneven));
    }
}
