//! Hill shading of depth maps.

use super::paint::Rgb;
use mocban_core::raster::Grid;

/// Altitude of the light above the horizon, in radians. A low light shows shallow relief.
const LIGHT_ALTITUDE_RAD: f64 = 35.0 * std::f64::consts::PI / 180.0;
/// Fraction of the grey value that depends on height. Without this fraction, flat tops and flat background would look
/// alike.
const HEIGHT_SHARE: f64 = 0.3;
/// Red, green and blue in full light, 0..=1: the colour of wood.
const WOOD: [f64; 3] = [1.0, 0.95, 0.86];
/// Colour of pixels without data.
const NO_DATA: [u8; 3] = [226, 232, 240];

/// Returns a hill-shaded image of depth levels, lit from the upper left. Level 0 marks missing data.
///
/// `slope_per_level` is the height of one level divided by the side of a pixel, both in mesh units.
pub fn shaded(levels: &Grid<u16>, slope_per_level: f64) -> Rgb {
    let smooth = smoothed(levels);
    let range = range(levels);
    Rgb::from_fn(levels.width(), levels.height(), |x, y| {
        match smooth.at(x, y) {
            None => NO_DATA,
            Some(level) => {
                let across = slope(&smooth, [x, y], [1, 0]) * slope_per_level;
                let down = slope(&smooth, [x, y], [0, 1]) * slope_per_level;
                let height = (level - range[0]) / (range[1] - range[0]).max(1.0);
                let grey = HEIGHT_SHARE * height + (1.0 - HEIGHT_SHARE) * light(across, down);
                WOOD.map(|share| (255.0 * share * grey.clamp(0.0, 1.0)).round() as u8)
            }
        }
    })
}

/// Returns the brightness, 0..=1, of a slope lit from the upper left (Lambert's cosine law).
fn light(across: f64, down: f64) -> f64 {
    let (sin, cos) = LIGHT_ALTITUDE_RAD.sin_cos();
    let toward = cos * std::f64::consts::FRAC_1_SQRT_2;
    let normal = (across * across + down * down + 1.0).sqrt();
    ((toward * (across + down) + sin) / normal).max(0.0)
}

/// Returns the 3 x 3 mean around each valid pixel, over valid pixels only. Scanner noise would otherwise hide strokes.
fn smoothed(levels: &Grid<u16>) -> Grid<Option<f64>> {
    Grid::from_fn(levels.width(), levels.height(), |x, y| {
        if levels.at(x, y) == 0 {
            return None;
        }
        let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x as i64 + dx, y as i64 + dy)));
        let (sum, n) = near
            .filter_map(|(x, y)| levels.get(x, y).filter(|level| *level > 0))
            .fold((0.0, 0.0), |(sum, n), level| {
                (sum + f64::from(level), n + 1.0)
            });
        Some(sum / n)
    })
}

/// Returns the slope in direction `[dx, dy]`, in levels per pixel. It is a central difference, or a one-sided
/// difference next to missing data.
fn slope(heights: &Grid<Option<f64>>, [x, y]: [usize; 2], [dx, dy]: [i64; 2]) -> f64 {
    let at = |step: i64| {
        heights
            .get(x as i64 + step * dx, y as i64 + step * dy)
            .flatten()
    };
    match (at(-1), at(0), at(1)) {
        (Some(before), _, Some(after)) => (after - before) / 2.0,
        (Some(before), Some(here), None) => here - before,
        (None, Some(here), Some(after)) => after - here,
        (None, _, None) | (_, None, _) => 0.0,
    }
}

/// Returns the lowest and the highest level with data, or zeros if there are no data.
fn range(levels: &Grid<u16>) -> [f64; 2] {
    let held = levels.data().iter().copied().filter(|level| *level > 0);
    let low = held.clone().min().unwrap_or(0);
    let high = held.max().unwrap_or(0);
    [f64::from(low), f64::from(high)]
}

#[cfg(test)]
mod tests {
    use super::{NO_DATA, shaded};
    use mocban_core::raster::Grid;

    #[test]
    fn walls_facing_the_light_are_bright_and_others_dark() {
        // A ridge along y: up to the right from x = 4, down from x = 12.
        let ridge = Grid::from_fn(20, 9, |x, _| match x {
            0..4 | 17.. => 1000,
            4..12 => 1000 + (x as u16 - 3) * 100,
            _ => 1800 - (x as u16 - 12) * 160,
        });
        let picture = shaded(&ridge, 0.01);
        let (lit, flat, dark) = (
            picture.at(6, 4)[0],
            picture.at(1, 4)[0],
            picture.at(14, 4)[0],
        );
        assert!(lit > flat && flat > dark, "{lit} {flat} {dark}");
    }

    #[test]
    fn missing_data_has_its_own_colour() {
        let picture = shaded(
            &Grid::from_fn(5, 5, |x, _| if x < 2 { 0 } else { 500 }),
            0.01,
        );
        assert_eq!(picture.at(1, 1), NO_DATA);
        assert_ne!(picture.at(3, 1), NO_DATA);
        assert_eq!(shaded(&Grid::new(2, 2, 0), 0.01).data(), [NO_DATA; 4]);
    }
}
