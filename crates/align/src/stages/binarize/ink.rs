//! Finds the ink of a print: which pixels the print covers, whether ink is dark or light, and which pixels are ink.

use super::background::{self, NARROW, STROKE};
use super::colour;
use super::polarity::polarity;
use super::samples::held;
use crate::stages::pose::SoftMask;
use mocban_core::raster::components::{ConnectedComponents, remove_specks};
use mocban_core::raster::otsu::{self, Split};
use mocban_core::raster::{Grid, Mask, PrintImage};

/// A pixel is white if its darkest channel is above this fraction of full white.
const WHITE: f32 = 0.965;
/// A background darker than this fraction of full white can be distinguished from the white around the print.
const DISTINCT_BACKGROUND: f64 = 0.945;
/// Light pixels inside the white border are a coloured background if they cover at least this fraction of the image. A
/// smaller area is only the soft edges of ink on white.
const LEAST_BACKGROUND: f64 = 0.2;
/// Least fraction of the image covered by ink and background of other colours than white. Ink on white covers less.
const LEAST_COLOURED: f64 = 0.6;
/// Least fraction of the image covered by the white around the print.
const LEAST_WHITE: f64 = 0.004;
/// A dark pixel is pale if its grey lies beyond this fraction of the way from the 10th percentile of the dark pixels to
/// the median of the background.
const PALE: f64 = 0.35;
/// A print may have stains if more than this fraction of its dark pixels are pale (see [`PALE`]).
const LEAST_PALE: f64 = 0.15;
/// Least difference between the greys of ink and background, as a fraction of the lighter grey. It is relative, because
/// a scan that uses only part of the 16-bit range is dark.
const LEAST_CONTRAST: f64 = 0.08;
/// Least difference between the greys of ink and background, as a fraction of full white. A smaller difference is
/// noise.
const NOISE: f64 = 0.012;
/// Least fraction of ink in a print.
const LEAST_INK: f64 = 0.002;

/// Least longest side of the ink of a small print, in pixels of the print.
const LEAST_CHARACTER_PX: f64 = 6.0;
/// An image is small if its shorter side has fewer pixels. Small prints are enlarged to about half of it.
const SMALL_PX: usize = 128;

/// Why a print shows no ink. A retry does not help.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BinarizeError {
    /// Ink and background differ too little in grey.
    #[error(
        "print has no ink to tell from paper: their greys differ by {contrast:.3} of full white; if you see ink, raise the contrast of the image"
    )]
    NoContrast {
        /// Difference between the two classes of grey, 0..=1.
        contrast: f64,
    },
    /// Too few pixels are darker than the threshold.
    #[error("print has no ink: {share:.4} of it is beyond the grey threshold {threshold:.3}")]
    NoInk {
        /// Fraction of ink, 0..=1.
        share: f64,
        /// Threshold, 0..=1.
        threshold: f64,
    },
    /// The character has too few pixels to show its strokes.
    #[error(
        "print shows the character with {character_px:.0} px, too few to tell its strokes, needs {LEAST_CHARACTER_PX} px; scan or photograph it at a higher resolution"
    )]
    TooCoarse {
        /// Longest side of the ink, pixels of the print.
        character_px: f64,
    },
    /// Almost all pixels are darker than the threshold.
    #[error("print is ink all over: its lightest grey is {lightest:.3} of full white")]
    AllInk {
        /// Lightest grey, 0..=1.
        lightest: f64,
    },
}

/// Refuses a print whose ink is too small in its own pixels to show strokes. The masks are `times` times as large as the
/// print.
pub(crate) fn require_strokes(inks: &[InkMask], times: u32) -> Result<(), BinarizeError> {
    let longest = |ink: &InkMask| ink.mask.bounding_box().map_or(0, |b| b.longest_side());
    let longest = inks.iter().map(longest).max().unwrap_or(0);
    let character_px = longest as f64 / f64::from(times);
    if character_px < LEAST_CHARACTER_PX {
        return Err(BinarizeError::TooCoarse { character_px });
    }
    Ok(())
}

/// One interpretation of a print as ink and background.
#[derive(Debug, Clone)]
pub(crate) struct InkMask {
    /// Pixels that are ink.
    pub(crate) mask: Mask,
    /// Pixels as dark as ink, in pieces that are too small to count as ink.
    pub(crate) specks: Mask,
    /// Amount of ink, 0..=1, and where the image is ink or background at all.
    pub(crate) soft: SoftMask,
    /// Grey between ink and background, 0..=1.
    pub(crate) threshold: f64,
    /// Whether ink is lighter than the background, as in a rubbing.
    pub(crate) light_on_dark: bool,
    /// Grey divided by the background. `None` if the image is not small.
    pub(super) even: Option<Grid<f32>>,
}

/// Returns the Rec. 601 luma, 0..=1.
pub(super) fn grey_of(picture: &PrintImage) -> Grid<f32> {
    picture.rgb.map(|[r, g, b]| {
        (0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)) / 65_535.0
    })
}

/// Binarizes as the paper does: pixels darker than `grey` are ink, without specks. The whole image is known.
pub(crate) fn fixed(picture: &PrintImage, grey: u8) -> Result<InkMask, BinarizeError> {
    let threshold = f64::from(grey) / 255.0;
    let grey = &grey_of(picture);
    let raw = grey.map(|g| f64::from(*g) < threshold);
    let ink = remove_specks(&raw, raw.data().len());
    require_ink(&ink, ink.data().len(), grey, threshold)?;
    Ok(InkMask {
        soft: SoftMask {
            amount: ink.to_weights(),
            known: Mask::new(ink.width(), ink.height(), true),
        },
        specks: raw.zip_map(&ink, |raw, ink| raw && !ink),
        mask: ink,
        threshold,
        light_on_dark: false,
        even: None,
    })
}

/// Binarizes the grey of the known pixels adaptively: divides by the background, and applies Otsu's threshold. Returns one
/// interpretation for each possible polarity, the likelier first. If the print may be stained, adds an interpretation that
/// treats wide dark areas as stains.
pub(super) fn by_brightness(grey: &Grid<f32>, known: &Mask) -> Result<Vec<InkMask>, BinarizeError> {
    let mut values = held(grey, known);
    let split = otsu::split(&mut values).ok_or(BinarizeError::NoContrast { contrast: 0.0 })?;
    if split.high - split.low < (LEAST_CONTRAST * split.high).max(NOISE) {
        return Err(BinarizeError::NoContrast {
            contrast: split.high - split.low,
        });
    }
    let dark = grey.map(|g| f64::from(*g) < split.threshold);
    let even = evened(grey, known, NARROW);
    let mut values = held(&even, known);
    let levelled = otsu::split(&mut values);
    let (likelier, clear) = polarity(&even, levelled, &dark, known);
    let of = |light_on_dark| {
        if light_on_dark {
            binarize_narrow(grey, &grey.map(|g| 1.0 - *g), known, NARROW, true)
        } else {
            binarize_even(grey, &even, levelled, known, false)
        }
    };
    let polarities: &[bool] = if clear {
        &[likelier]
    } else {
        &[likelier, !likelier]
    };
    let mut inks: Vec<Result<InkMask, BinarizeError>> =
        polarities.iter().map(|light| of(*light)).collect();
    if polarities.contains(&false) && may_be_stained(&values, levelled) {
        // Dark areas wider than most strokes count as stains.
        inks.push(binarize_narrow(grey, grey, known, STROKE, false));
    }
    // If none has ink, the error of the likeliest is reported.
    if inks.iter().all(Result::is_err) {
        inks.truncate(1);
        return inks.into_iter().collect();
    }
    Ok(inks.into_iter().flatten().collect())
}

/// Returns whether enough of the dark values are pale to suggest stains. `sorted` is in ascending order.
pub(super) fn may_be_stained(sorted: &[f32], split: Option<Split>) -> bool {
    let Some(split) = split else { return false };
    let below = |limit: f64| sorted.partition_point(|v| f64::from(*v) < limit);
    let dark = below(split.threshold);
    let darkest = f64::from(sorted[dark / 10]);
    let pale = dark.saturating_sub(below(darkest + PALE * (split.high - darkest)));
    pale as f64 > LEAST_PALE * dark as f64
}

/// Binarizes `dark_ink`, which is the grey, or its inverse if ink is light. `narrow` is half the largest width of ink,
/// as a fraction of the longest side.
pub(super) fn binarize_narrow(
    grey: &Grid<f32>,
    dark_ink: &Grid<f32>,
    known: &Mask,
    narrow: f64,
    light_on_dark: bool,
) -> Result<InkMask, BinarizeError> {
    let even = evened(dark_ink, known, narrow);
    let split = otsu::split(&mut held(&even, known));
    binarize_even(grey, &even, split, known, light_on_dark)
}

/// Binarizes one polarity from the grey divided by the background.
pub(super) fn binarize_even(
    grey: &Grid<f32>,
    even: &Grid<f32>,
    split: Option<Split>,
    known: &Mask,
    light_on_dark: bool,
) -> Result<InkMask, BinarizeError> {
    let split = split.ok_or(BinarizeError::NoContrast { contrast: 0.0 })?;
    let raw = even.zip_map(known, |even, known| {
        known && f64::from(even) < split.threshold
    });
    let area = known.count();
    let ink = remove_specks(&raw, area).zip_map(known, |ink, known| ink && known);
    require_ink(&ink, area, grey, split.threshold)?;
    Ok(InkMask {
        soft: SoftMask {
            amount: amount(even, &ink, split),
            known: known.clone(),
        },
        specks: raw.zip_map(&ink, |raw, ink| raw && !ink),
        mask: ink,
        threshold: split.threshold,
        light_on_dark,
        even: (even.width().min(even.height()) < SMALL_PX).then(|| even.clone()),
    })
}

/// Returns the mask of ink and background. White areas at the border are left out, unless the background is white too.
pub(super) fn known(picture: &PrintImage, grey: &Grid<f32>) -> Mask {
    let white = picture
        .rgb
        .map(|[r, g, b]| f32::from(r.min(g).min(b)) / 65_535.0 > WHITE);
    let beyond = ConnectedComponents::label(&white).touching_border();
    let all = Mask::new(grey.width(), grey.height(), true);
    if beyond.density() < LEAST_WHITE {
        return all;
    }
    // Pixels beside the white area mix background and white.
    let inside = beyond.dilate().map(|b| !b);
    let mut values = held(grey, &inside);
    let Some(split) = otsu::split(&mut values) else {
        return all;
    };
    let is_light = |value: &&f32| f64::from(**value) > split.threshold;
    let light = values.iter().filter(is_light).count() as f64 / values.len() as f64;
    let is_enough = light * inside.density() >= LEAST_BACKGROUND;
    if is_enough && split.high < DISTINCT_BACKGROUND {
        return inside;
    }
    // If ink and background are equally bright, the brightness separates only rests of white and its soft edges from both.
    let is_coloured = !is_enough
        && inside.density() >= LEAST_COLOURED
        && f64::from(values[values.len() / 2]) < DISTINCT_BACKGROUND
        && colour::is_coloured(picture, &inside);
    if is_coloured {
        let is_rest =
            |grey: f32| split.high >= DISTINCT_BACKGROUND && f64::from(grey) > split.threshold;
        let white = grey.zip_map(&beyond, |grey, beyond| beyond || is_rest(grey));
        white.dilate().dilate().map(|white| !white)
    } else {
        all
    }
}

/// Divides the grey by the background.
fn evened(grey: &Grid<f32>, known: &Mask, narrow: f64) -> Grid<f32> {
    let level = background::level(grey, known, narrow);
    grey.zip_map(&level, |grey, level| (grey / level.max(0.01)).min(1.5))
}

/// Returns the amount of ink, which rises linearly from 0 at the background's median to 1 at the ink's median. Pixels
/// more than one pixel away from the ink mask get 0.
fn amount(even: &Grid<f32>, ink: &Mask, split: Split) -> Grid<f32> {
    let span = (split.high - split.low).max(1e-6);
    let share = |even: f32| ((split.high - f64::from(even)) / span).clamp(0.0, 1.0) as f32;
    even.zip_map(
        &ink.dilate(),
        |even, is_near| if is_near { share(even) } else { 0.0 },
    )
}

fn require_ink(
    ink: &Mask,
    area: usize,
    grey: &Grid<f32>,
    threshold: f64,
) -> Result<(), BinarizeError> {
    let share = ink.count() as f64 / area.max(1) as f64;
    if share < LEAST_INK {
        return Err(BinarizeError::NoInk { share, threshold });
    }
    let lightest = grey.data().iter().copied().fold(0.0, f32::max);
    if share > 1.0 - LEAST_INK {
        return Err(BinarizeError::AllInk {
            lightest: f64::from(lightest),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{BinarizeError, InkMask};
    use crate::stages::binarize::hypotheses;
    use mocban_core::raster::{Grid, PrintImage};

    fn picture(grey: impl Fn(usize, usize) -> u16) -> PrintImage {
        PrintImage::from(Grid::from_fn(60, 50, |x, y| [grey(x, y) * 257; 3]))
    }

    fn read(picture: &PrintImage) -> Result<InkMask, BinarizeError> {
        hypotheses(picture).map(|mut all| all.swap_remove(0))
    }

    fn cross(x: usize, y: usize) -> bool {
        (26..34).contains(&x) && (8..42).contains(&y)
            || (10..50).contains(&x) && (20..28).contains(&y)
    }

    #[test]
    fn dark_on_light_and_light_on_dark_give_the_same_ink() {
        let shade = |x: usize| 170 + x as u16 / 2;
        let printed = picture(|x, y| if cross(x, y) { 40 } else { shade(x) });
        let rubbed = picture(|x, y| 255 - if cross(x, y) { 40 } else { shade(x) });
        let (a, b) = (read(&printed).expect("ink"), read(&rubbed).expect("ink"));
        assert!(!a.light_on_dark && b.light_on_dark);
        assert_eq!(a.mask, b.mask);
        assert!(
            a.mask
                .data()
                .iter()
                .enumerate()
                .all(|(i, ink)| *ink == cross(i % 60, i / 60))
        );
    }

    #[test]
    fn border_lines_do_not_invert_the_polarity() {
        let framed = picture(|x, y| {
            let at_rim = !(4..56).contains(&x) || y < 3;
            if cross(x, y) || (at_rim && (x + y) % 9 != 0) {
                45
            } else {
                200
            }
        });
        assert!(!read(&framed).expect("ink").light_on_dark);
    }

    #[test]
    fn one_interpretation_ignores_a_stain() {
        let near = |at: usize, middle: i64| (at as i64 - middle).abs() < 6;
        let thin = |x, y| near(x, 100) || near(y, 90);
        let stain = |x: usize, y: usize| (x as f64 - 130.0).hypot(y as f64 - 120.0) < 22.0;
        let print = |stain: &dyn Fn(usize, usize) -> bool| {
            PrintImage::from(Grid::from_fn(200, 200, |x, y| {
                let plain = if thin(x, y) { 90.0 } else { 215.0 };
                let grey = plain * if stain(x, y) { 0.7 } else { 1.0 };
                [grey as u16 * 257; 3]
            }))
        };
        let wrong = |ink: &InkMask| {
            let pixels = ink.mask.data().iter().enumerate();
            pixels
                .filter(|(i, ink)| **ink != thin(i % 200, i / 200))
                .count()
        };
        let found: Vec<usize> = hypotheses(&print(&stain))
            .expect("ink")
            .iter()
            .map(wrong)
            .collect();
        assert!(
            found.len() == 2 && found[0] > 1000 && found[1] < 150,
            "{found:?}"
        );
        assert_eq!(hypotheses(&print(&|_, _| false)).expect("ink").len(), 1);
    }

    #[test]
    fn white_outside_the_cut_is_unknown() {
        let cut = picture(|x, y| match (x + y < 30, cross(x, y)) {
            (true, _) => 255,
            (_, true) => 50,
            _ => 205,
        });
        let print = read(&cut).expect("ink");
        assert!(!print.soft.known.at(2, 2) && print.soft.known.at(50, 40));
        let plain = picture(|x, y| if cross(x, y) { 50 } else { 255 });
        assert_eq!(read(&plain).expect("ink").soft.known.density(), 1.0);
    }

    #[test]
    fn prints_without_ink_are_refused() {
        for grey in [255, 0, 128] {
            let refused = read(&picture(|_, _| grey));
            assert!(
                matches!(refused, Err(BinarizeError::NoContrast { .. })),
                "{grey}"
            );
        }
        let one = PrintImage::from(Grid::new(1, 1, [0; 3]));
        assert!(matches!(read(&one), Err(BinarizeError::NoContrast { .. })));
    }
}
