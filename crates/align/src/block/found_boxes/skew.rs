//! The angle of the text on the face.

use crate::block::align::CarvedFace;
use crate::block::window_images::ShrunkRelief;
use mocban_core::raster::Grid;

/// Angles on both sides of that of the page that are searched, degrees.
const REACH_DEG: f64 = 9.0;
/// Pixels of the height map per pixel, and step of the angle in degrees, of each round.
const ROUNDS: [(usize, f64); 3] = [(8, 0.5), (4, 0.1), (2, 0.03)];
/// Steps of a round on both sides of the best angle of the round before.
const REFINED: i32 = 6;
/// Relief below this does not count.
const STROKE: f32 = 0.25;

/// Returns the angle near that of the page at which the projections of the relief on both axes are sharpest, rad.
pub(super) fn text_angle(side: &CarvedFace, page_angle: f64) -> f64 {
    let mut best = page_angle;
    for (round, (shrink, step)) in ROUNDS.into_iter().enumerate() {
        let relief = ShrunkRelief::of(&side.map, &side.relief, shrink);
        let points = strokes(&relief.soft);
        let steps = if round == 0 {
            (REACH_DEG / step) as i32
        } else {
            REFINED
        };
        let angles = (-steps..=steps).map(|k| best + (f64::from(k) * step).to_radians());
        let sharpest = angles
            .map(|angle| {
                (
                    sharpness(&points, relief.soft.width(), relief.soft.height(), angle),
                    angle,
                )
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        best = sharpest.map_or(best, |(_, angle)| angle);
    }
    best
}

/// Returns position and value of the pixels with strokes.
fn strokes(soft: &Grid<f32>) -> Vec<[f32; 3]> {
    let mut points = Vec::new();
    for y in 0..soft.height() {
        for (x, value) in soft.row(y).iter().enumerate() {
            if *value > STROKE {
                points.push([x as f32, y as f32, *value]);
            }
        }
    }
    points
}

/// Returns the sum of the squares of the projections on both axes.
fn sharpness(points: &[[f32; 3]], width: usize, height: usize, angle: f64) -> f64 {
    let (sin, cos) = (angle.sin() as f32, angle.cos() as f32);
    let reach = width + height;
    let mut across = vec![0.0_f32; 2 * reach + 2];
    let mut down = across.clone();
    for [x, y, value] in points {
        across[(cos * x + sin * y + reach as f32) as usize] += value;
        down[(cos * y - sin * x + reach as f32) as usize] += value;
    }
    let squares = |profile: &[f32]| profile.iter().map(|p| f64::from(p * p)).sum::<f64>();
    squares(&across) + squares(&down)
}
