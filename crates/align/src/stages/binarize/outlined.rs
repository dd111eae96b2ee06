//! Binarizes the part of a print inside an outline.

use super::hypotheses::hypotheses;
use super::ink::{BinarizeError, InkMask};
use crate::stages::pose::SoftMask;
use mocban_core::domain::PrintOutline;
use mocban_core::raster::{Grid, Mask, PrintImage};

/// Binarizes the smallest box around the outline like a print of its own, because a part of a print has smaller specks
/// and may be shaded differently. Returns masks of the whole print, in which pixels outside the outline are unknown. If
/// the outline contains no pixel, binarizes the whole print.
pub(crate) fn hypotheses_within(
    picture: &PrintImage,
    outline: &PrintOutline,
) -> Result<Vec<InkMask>, BinarizeError> {
    let size = [picture.rgb.width(), picture.rgb.height()];
    let inside = inside(outline, size);
    let Some(bounds) = inside.bounding_box() else {
        return hypotheses(picture);
    };
    let part = PrintImage {
        rgb: picture.rgb.part(bounds),
        turned: picture.turned,
        ignored_profile: None,
    };
    let whole = |ink: InkMask| {
        let from_part =
            |x: usize, y: usize| inside.at(x, y).then(|| [x - bounds.x0, y - bounds.y0]);
        let mask = |of: &Mask| {
            Mask::from_fn(size[0], size[1], |x, y| {
                from_part(x, y).is_some_and(|[x, y]| of.at(x, y))
            })
        };
        let amount = Grid::from_fn(size[0], size[1], |x, y| {
            from_part(x, y).map_or(0.0, |[x, y]| ink.soft.amount.at(x, y))
        });
        InkMask {
            mask: mask(&ink.mask),
            specks: mask(&ink.specks),
            soft: SoftMask {
                amount,
                known: mask(&ink.soft.known),
            },
            even: None,
            ..ink
        }
    };
    Ok(hypotheses(&part)?.into_iter().map(whole).collect())
}

/// Returns the pixels inside an outline.
pub(crate) fn inside(outline: &PrintOutline, [width, height]: [usize; 2]) -> Mask {
    let mut inside = Mask::new(width, height, false);
    for (y, row) in inside.data_mut().chunks_exact_mut(width.max(1)).enumerate() {
        if let Some([first, last]) = outline.columns_in_row(y as f64) {
            let first = first.ceil().max(0.0) as usize;
            let end = ((last.floor() + 1.0).max(0.0) as usize).min(width);
            if first < end {
                row[first..end].fill(true);
            }
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::{hypotheses_within, inside};
    use mocban_core::domain::PrintOutline;
    use mocban_core::raster::{Grid, PrintImage};

    fn outline() -> PrintOutline {
        PrintOutline::around(&[[30.0, 10.0], [80.0, 20.0], [70.0, 70.0], [25.0, 60.0]])
            .expect("an area")
    }

    #[test]
    fn pixels_outside_the_outline_are_unknown() {
        // Bars of 6 pixels, on a background that is darker at the right.
        let bar = |x: usize| x % 15 < 6;
        let grey = |x: usize, y: usize| {
            let paper = 230 - x - y % 3;
            if bar(x) { paper / 4 } else { paper }
        };
        let picture = PrintImage::from(Grid::from_fn(120, 90, |x, y| [grey(x, y) as u16 * 257; 3]));
        let inks = hypotheses_within(&picture, &outline()).expect("ink");
        let inside = inside(&outline(), [120, 90]);
        assert!((2000..3000).contains(&inside.count()));
        let [ink, ..] = &inks[..] else {
            panic!("an interpretation")
        };
        assert_eq!(ink.soft.known, inside);
        for y in 0..90 {
            for x in 0..120 {
                assert_eq!(ink.mask.at(x, y), inside.at(x, y) && bar(x), "{x}, {y}");
            }
        }
    }
}
