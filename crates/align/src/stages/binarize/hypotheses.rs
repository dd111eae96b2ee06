//! Interpretations of a print as ink and background, by its brightness and by its colours.

use super::background::STROKE;
use super::colour::{self, ColourContrast};
use super::ground::dark_ground;
use super::ink::{
    BinarizeError, InkMask, binarize_even, binarize_narrow, by_brightness, grey_of, known,
    may_be_stained,
};
use super::samples::held;
use mocban_core::raster::otsu;
use mocban_core::raster::{Grid, Mask, PrintImage};

/// Binarizes adaptively: leaves out the white around the print, and returns the interpretations by brightness, see
/// [`by_brightness`]. If a sheet lies on a dark ground, dark ink is that of the sheet alone. If the colours differ more than
/// the brightness, adds interpretations by colour.
///
/// # Errors
/// Returns the error of the brightness if no interpretation has ink.
pub(crate) fn hypotheses(picture: &PrintImage) -> Result<Vec<InkMask>, BinarizeError> {
    let grey = &grey_of(picture);
    let mut known = known(picture, grey);
    let mut inks = by_brightness(grey, &known);
    if let Some(ground) = dark_ground(grey, &known) {
        known = known.zip_map(&ground, |known, ground| known && !ground);
        add_sheet(&mut inks, by_brightness(grey, &known));
    }
    if let Some(found) = colour::contrast(picture, &known) {
        add(&mut inks, by_colour(grey, &found, &known), found.is_clearer);
    }
    inks
}

/// Adds interpretations of a sheet on a dark ground. Its ink is dark, and the ground no longer counts as ink; but the ground
/// may be that of a rubbing, whose ink is light.
fn add_sheet(
    inks: &mut Result<Vec<InkMask>, BinarizeError>,
    of_sheet: Result<Vec<InkMask>, BinarizeError>,
) {
    let mut sheet = of_sheet.unwrap_or_default();
    sheet.retain(|ink| !ink.light_on_dark);
    if sheet.is_empty() {
        return;
    }
    let before = inks.as_ref().is_ok_and(|inks| !inks[0].light_on_dark);
    if let Ok(inks) = inks {
        inks.retain(|ink| ink.light_on_dark);
    }
    add(inks, Ok(sheet), before);
}

/// Adds interpretations behind others, or before them.
fn add(
    inks: &mut Result<Vec<InkMask>, BinarizeError>,
    more: Result<Vec<InkMask>, BinarizeError>,
    before: bool,
) {
    match (&mut *inks, more) {
        (Ok(inks), Ok(more)) => {
            let at = if before { 0 } else { inks.len() };
            inks.splice(at..at, more);
        }
        (Err(_), Ok(more)) => *inks = Ok(more),
        (_, Err(_)) => {}
    }
}

/// Binarizes by colour. Adds an interpretation that treats wide areas as stains.
fn by_colour(
    grey: &Grid<f32>,
    found: &ColourContrast,
    known: &Mask,
) -> Result<Vec<InkMask>, BinarizeError> {
    let mut values = held(&found.even, known);
    let split = otsu::split(&mut values);
    let mut inks = vec![binarize_even(grey, &found.even, split, known, false)?];
    if may_be_stained(&values, split) {
        inks.extend(binarize_narrow(grey, &found.even, known, STROKE, false));
    }
    Ok(inks)
}

#[cfg(test)]
mod tests {
    use super::hypotheses;
    use crate::stages::binarize::test_strokes::{SIDE, is_stroke};
    use mocban_core::raster::{Grid, PrintImage};

    fn print(colour: impl Fn(usize, usize) -> [u16; 3]) -> PrintImage {
        PrintImage::from(Grid::from_fn(SIDE, SIDE, |x, y| {
            colour(x, y).map(|c| c * 257)
        }))
    }

    #[test]
    fn dark_ground_beside_a_torn_sheet_is_neither_ink_nor_background() {
        let is_torn = |x: usize, y: usize| x + 2 * y > 260;
        let torn = print(|x, y| match (is_torn(x, y), is_stroke(x, y)) {
            (true, _) => [25; 3],
            (false, true) => [40; 3],
            (false, false) => [205, 198, 180],
        });
        let inks = hypotheses(&torn).expect("ink");
        let ink = &inks[0];
        assert!(!ink.light_on_dark);
        assert!(!ink.soft.known.at(140, 140) && ink.soft.known.at(30, 30));
        assert!(ink.mask.at(66, 25) && !ink.mask.at(140, 140) && !ink.mask.at(30, 30));
    }

    #[test]
    fn ink_as_bright_as_the_sheet_is_read_by_its_colour() {
        // Both have a luma of 129.
        let coloured = print(|x, y| {
            if is_stroke(x, y) {
                [190, 108, 79]
            } else {
                [125, 137, 98]
            }
        });
        let inks = hypotheses(&coloured).expect("ink");
        let wrong = |(at, ink): &(usize, &bool)| **ink != is_stroke(at % SIDE, at / SIDE);
        let wrong = inks[0].mask.data().iter().enumerate().filter(wrong).count();
        assert!(wrong < 100, "{wrong}");
    }

    #[test]
    fn white_around_a_sheet_is_left_out_although_its_ink_is_as_bright() {
        let from_middle = |x: usize, y: usize| (x as f64 - 75.0).hypot(y as f64 - 75.0);
        // Soft edges are the only pixels that the brightness separates from the others.
        let round = print(|x, y| match from_middle(x, y) {
            73.0.. => [255; 3],
            71.0.. => [242, 245, 238],
            _ if is_stroke(x, y) => [190, 108, 79],
            _ => [125, 137, 98],
        });
        let inks = hypotheses(&round).expect("ink");
        let ink = &inks[0];
        assert!(!ink.soft.known.at(4, 4) && ink.soft.known.at(75, 110));
        let wrong = |(at, ink): &(usize, &bool)| {
            let (x, y) = (at % SIDE, at / SIDE);
            from_middle(x, y) < 68.0 && **ink != is_stroke(x, y)
        };
        let wrong = ink.mask.data().iter().enumerate().filter(wrong).count();
        assert!(wrong < 100, "{wrong}");
    }

    #[test]
    fn a_sheet_on_a_coloured_board_is_no_rest_of_the_white_around_it() {
        let board = print(|x, y| match (x.min(SIDE - 1 - x), y.min(SIDE - 1 - y)) {
            (..10, _) | (_, ..10) => [255; 3],
            (10..35, _) | (_, 10..25) => [120, 75, 40],
            _ if is_stroke(x, y) => [30; 3],
            _ => [250, 249, 245],
        });
        let inks = hypotheses(&board).expect("ink");
        assert!(inks[0].soft.known.at(100, 100) && inks[0].soft.known.at(66, 80));
    }
}
