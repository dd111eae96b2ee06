//! Finds the ink of a print by its colour, where ink and sheet differ more in colour than in brightness.
//!
//! Colours are logarithms of red, green and blue: a shadow shifts all three by the same amount. The direction in which two
//! classes of colours lie farthest apart, in standard deviations of the classes, is found by linear discriminant analysis
//! (Fisher 1936, doi:10.1111/j.1469-1809.1936.tb02137.x) from several first guesses. Stains have another colour than ink,
//! and are wide, so the background that is subtracted contains them.

use nalgebra::{Matrix3, Vector3};

use super::background::{self, NARROW};
use super::polarity::background_darkness;
use super::samples::sampled;
use mocban_core::raster::otsu;
use mocban_core::raster::{Grid, Mask, PrintImage};

/// Largest number of pixels from which the directions are found.
const SAMPLES: usize = 2_500;
/// Added to red, green and blue, as fractions of full white, before their logarithms are taken: dark pixels are noisy.
const DARK: f64 = 0.04;
/// Colours that deviate less from their mean, in natural logarithms, are those of one sheet.
const LEAST_COLOUR: f64 = 0.04;
/// Colours that deviate at least this much are those of a sheet and of another ink than black.
const TWO_COLOURS: f64 = 0.1;
/// If the brightness of the two classes differs by at least this, in natural logarithms, coloured ink is sought in the
/// lighter class only: the darker one is black ink, or a dark stain.
const HIGH_CONTRAST: f64 = 0.45;
/// Least fraction of the pixels in the lighter class.
const LEAST_LIGHT: f64 = 0.25;
/// The colours are clearer if their classes lie at least this many times as far apart as those of the brightness.
const CLEARER: f64 = 1.6;
/// Least distance between the classes, in standard deviations. One class that is cut in two has 2.7.
const LEAST_APART: f64 = 4.0;
/// Number of times that classes and direction are improved.
const ROUNDS: usize = 4;
/// Directions with a larger cosine between them are the same.
const SAME: f64 = 0.9;
/// Least variance of a class, in squares of natural logarithms.
const LEAST_VARIANCE: f64 = 1e-5;

/// Colours of a print along the direction that separates ink from the sheet.
pub(super) struct ColourContrast {
    /// Colours minus those of the background, plus 1. Ink is lower than the background, which is about 1.
    pub(super) even: Grid<f32>,
    /// Whether the colours separate ink from the sheet much better than the brightness does.
    pub(super) is_clearer: bool,
}

/// Returns the colours along the direction that separates ink from the sheet best, if the brightness separates them
/// badly.
pub(super) fn contrast(picture: &PrintImage, known: &Mask) -> Option<ColourContrast> {
    let mut samples = samples(picture, known);
    let brightness = brightness();
    let plain = classes(&samples, &brightness)?;
    let has_contrast = plain.gap / f64::sqrt(3.0) >= HIGH_CONTRAST;
    if has_contrast {
        let least = LEAST_LIGHT * samples.len() as f64;
        samples.retain(|sample| brightness.dot(sample) >= plain.threshold);
        if (samples.len() as f64) < least {
            return None;
        }
    }
    if colour_deviation(&samples, &brightness) < LEAST_COLOUR {
        return None;
    }
    let mut found: Vec<(Vector3<f64>, f64)> = Vec::new();
    for start in starts() {
        let Some((axis, apart)) = discriminant(&samples, start) else {
            continue;
        };
        let is_new = |other: &(Vector3<f64>, f64)| other.0.dot(&axis).abs() < SAME;
        if apart > LEAST_APART && found.iter().all(is_new) {
            found.push((axis, apart));
        }
    }
    let evened = found.into_iter().filter_map(|(axis, _)| {
        let even = evened(picture, known, &axis)?;
        let values = held_sample(&even, known);
        let apart = split_classes(values)?.apart;
        Some((even, apart))
    });
    let (even, apart) = evened.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(ColourContrast {
        even,
        is_clearer: !has_contrast && apart > CLEARER * plain.apart,
    })
}

/// Returns whether the known pixels have two colours, apart from their brightness.
pub(super) fn is_coloured(picture: &PrintImage, known: &Mask) -> bool {
    colour_deviation(&samples(picture, known), &brightness()) >= TWO_COLOURS
}

/// Returns the direction of the brightness.
fn brightness() -> Vector3<f64> {
    Vector3::repeat(1.0 / f64::sqrt(3.0))
}

/// Returns the colours along an axis, which points to or from the ink, minus those of the background.
fn evened(picture: &PrintImage, known: &Mask, axis: &Vector3<f64>) -> Option<Grid<f32>> {
    let along = picture.rgb.map(|rgb| axis.dot(&colour(rgb)) as f32);
    let threshold = otsu::split(&mut held_sample(&along, known))?.threshold;
    let low = along.map(|value| f64::from(*value) < threshold);
    // Ink is the smaller class.
    let sign = if background_darkness(&low, known) > 0.0 {
        -1.0
    } else {
        1.0
    };
    let signed = along.map(|value| sign * value);
    let level = background::level(&signed, known, NARROW);
    Some(signed.zip_map(&level, |value, level| (1.0 + value - level).clamp(0.0, 1.5)))
}

/// Returns the logarithms of red, green and blue.
fn colour(rgb: [u16; 3]) -> Vector3<f64> {
    Vector3::from(rgb.map(|c| (f64::from(c) / 65_535.0 + DARK).ln()))
}

fn samples(picture: &PrintImage, known: &Mask) -> Vec<Vector3<f64>> {
    sampled(known, SAMPLES, |x, y| colour(picture.rgb.at(x, y)))
}

fn held_sample(grid: &Grid<f32>, known: &Mask) -> Vec<f32> {
    sampled(known, SAMPLES, |x, y| grid.at(x, y))
}

/// Returns the standard deviation of the colours across the axis of the brightness.
fn colour_deviation(samples: &[Vector3<f64>], brightness: &Vector3<f64>) -> f64 {
    let count = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<Vector3<f64>>() / count;
    let across = |sample: &Vector3<f64>| {
        let from_mean = sample - mean;
        (from_mean - brightness * brightness.dot(&from_mean)).norm_squared()
    };
    (samples.iter().map(across).sum::<f64>() / count).sqrt()
}

/// Returns the first guesses: directions across that of the brightness.
fn starts() -> [Vector3<f64>; 4] {
    let red_blue = Vector3::new(1.0, 0.0, -1.0).normalize();
    let green = Vector3::new(1.0, -2.0, 1.0).normalize();
    [0.0, 45.0, 90.0, 135.0].map(|degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        red_blue * cos + green * sin
    })
}

/// Two classes of values.
struct Classes {
    threshold: f64,
    /// Distance between their means.
    gap: f64,
    /// Distance between their means in standard deviations.
    apart: f64,
}

/// Splits values into two classes. Returns `None` for fewer than two values.
fn split_classes(values: Vec<f32>) -> Option<Classes> {
    let mut sorted = values;
    let threshold = otsu::split(&mut sorted)?.threshold;
    let cut = sorted.partition_point(|value| f64::from(*value) < threshold);
    let mean = |of: &[f32]| of.iter().map(|v| f64::from(*v)).sum::<f64>() / of.len().max(1) as f64;
    let (below, above) = sorted.split_at(cut);
    let means = [mean(below), mean(above)];
    let squares =
        |of: &[f32], mean: f64| -> f64 { of.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum() };
    let within = (squares(below, means[0]) + squares(above, means[1])) / sorted.len() as f64;
    let gap = means[1] - means[0];
    Some(Classes {
        threshold,
        gap,
        apart: gap / within.max(LEAST_VARIANCE).sqrt(),
    })
}

fn classes(samples: &[Vector3<f64>], axis: &Vector3<f64>) -> Option<Classes> {
    split_classes(
        samples
            .iter()
            .map(|sample| axis.dot(sample) as f32)
            .collect(),
    )
}

/// Improves a direction: splits the samples along it and takes the direction in which the two classes lie farthest apart,
/// some times. Returns the direction with the distance of the classes.
fn discriminant(samples: &[Vector3<f64>], start: Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let mut axis = start;
    for _ in 0..ROUNDS {
        let threshold = classes(samples, &axis)?.threshold;
        let (low, high): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = samples
            .iter()
            .partition(|sample| axis.dot(sample) < threshold);
        let mut within = Matrix3::identity() * LEAST_VARIANCE * samples.len() as f64;
        let mut means = [Vector3::zeros(); 2];
        for (class, mean) in [low, high].iter().zip(&mut means) {
            *mean = class.iter().sum::<Vector3<f64>>() / class.len().max(1) as f64;
            for sample in class {
                let from_mean = sample - *mean;
                within += from_mean * from_mean.transpose();
            }
        }
        axis = within.try_inverse()? * (means[1] - means[0]);
        axis = axis.try_normalize(1e-12)?;
    }
    Some((axis, classes(samples, &axis)?.apart))
}

#[cfg(test)]
mod tests {
    use super::contrast;
    use mocban_core::raster::{Grid, Mask, PrintImage};

    const SIDE: usize = 120;

    fn is_stroke(x: usize, y: usize) -> bool {
        (50..62).contains(&x) && (15..105).contains(&y)
            || (20..100).contains(&x) && (40..50).contains(&y)
    }

    /// Returns a print whose pixels have a shade and grain.
    fn print(colour: impl Fn(usize, usize) -> [f64; 3]) -> PrintImage {
        let value = |x: usize, y: usize, c: f64| {
            let grain = ((x * 7 + y * 13) % 11) as f64 - 5.0;
            ((c + grain) * (0.85 + 0.25 * x as f64 / SIDE as f64)).clamp(0.0, 255.0) as u16 * 257
        };
        PrintImage::from(Grid::from_fn(SIDE, SIDE, |x, y| {
            colour(x, y).map(|c| value(x, y, c))
        }))
    }

    #[test]
    fn ink_as_bright_as_the_sheet_is_found_by_its_colour_in_spite_of_a_stain() {
        let is_stain = |x: usize, y: usize| (x as f64 - 90.0).hypot(y as f64 - 90.0) < 24.0;
        let coloured = print(|x, y| {
            let colour = if is_stroke(x, y) {
                [190.0, 104.0, 84.0]
            } else {
                [125.0, 136.0, 106.0]
            };
            let stain = if is_stain(x, y) {
                [0.8, 0.7, 0.6]
            } else {
                [1.0; 3]
            };
            [0, 1, 2].map(|i| colour[i] * stain[i])
        });
        let found = contrast(&coloured, &Mask::new(SIDE, SIDE, true)).expect("colours differ");
        assert!(found.is_clearer);
        let wrong = |(x, y): &(usize, usize)| (found.even.at(*x, *y) < 0.8) != is_stroke(*x, *y);
        let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        let wrong = pixels.filter(wrong).count();
        assert!(wrong < 150, "{wrong}");
    }

    #[test]
    fn black_ink_and_grey_pictures_need_no_colour() {
        let all = Mask::new(SIDE, SIDE, true);
        let black = print(|x, y| {
            if is_stroke(x, y) {
                [40.0, 38.0, 36.0]
            } else {
                [228.0, 210.0, 172.0]
            }
        });
        assert!(contrast(&black, &all).is_none());
        let faint = print(|x, y| [if is_stroke(x, y) { 150.0 } else { 190.0 }; 3]);
        assert!(contrast(&faint, &all).is_none());
    }
}
