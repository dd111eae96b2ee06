//! Whether the boxes of labels belong to the image of a page: outlines of characters run between the strokes.

use super::characters::CharacterBox;
use super::page_ink::PageInk;

/// If the outlines have more ink than this part of what the insides have, the labels do not fit. Right labels, also those
/// drawn carelessly, have at most 35 %, those of another page or of the mirrored page about as much ink on the outlines.
const MAX_ON_OUTLINE: f64 = 0.35;
/// The labels belong to the mirrored or turned page if the part is smaller there: at most this fraction, and by this
/// difference, which right labels of a page that is nearly symmetric do not reach.
const MAX_CHANGED: f64 = 0.65;
const MIN_DIFFERENCE: f64 = 0.05;
/// Points along each side of a box, and along each side of the grid inside it.
const POINTS: usize = 24;
const INNER_POINTS: usize = 16;

/// Why labels do not fit a page.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LabelMisfit {
    /// The labels were drawn on a mirrored image.
    #[error(
        "the labels were drawn on the mirrored image: the outlines have {on_page:.0} % of the ink inside them, mirrored \
         {changed:.0} %; mirror the image or the labels"
    )]
    Mirrored {
        /// Ink on the outlines, as a percentage of that inside them.
        on_page: f64,
        /// The same on the mirrored page.
        changed: f64,
    },
    /// The labels were drawn on the image turned by 180 degrees.
    #[error(
        "the labels were drawn on the image turned by 180 degrees: the outlines have {on_page:.0} % of the ink inside \
         them, turned {changed:.0} %; turn the image or the labels"
    )]
    Turned {
        /// Ink on the outlines, as a percentage of that inside them.
        on_page: f64,
        /// The same on the turned page.
        changed: f64,
    },
    /// The labels belong to another page.
    #[error(
        "the labels seem to be those of another page: the outlines have {on_page:.0} % of the ink inside them (usually less \
         than 35 %)"
    )]
    OtherPage {
        /// Ink on the outlines, as a percentage of that inside them.
        on_page: f64,
    },
}

/// Checks that the outlines of boxes run between the strokes.
///
/// # Errors
/// Returns an error if the outlines have much ink in relation to the insides, or less on the mirrored or turned page.
pub fn check_label_fit(page: &PageInk, boxes: &[CharacterBox]) -> Result<(), LabelMisfit> {
    let [width, height] = page.size().map(|side| side as f64 - 1.0);
    let [outline, inside] = mean_ink(page, boxes, &|at| at);
    let on_page = ratio(outline, inside);
    // On paper without text, all outlines are free of ink.
    let changed_part = |change: &dyn Fn([f64; 2]) -> [f64; 2]| {
        let [outline, changed_inside] = mean_ink(page, boxes, change);
        if changed_inside < LEAST_INSIDE * inside {
            return MOST_RATIO;
        }
        ratio(outline, changed_inside)
    };
    let mirrored = changed_part(&|[x, y]| [width - x, y]);
    let turned = changed_part(&|[x, y]| [width - x, height - y]);
    let changed = mirrored.min(turned);
    let is_changed = changed <= MAX_CHANGED * on_page
        && changed <= MAX_ON_OUTLINE
        && changed + MIN_DIFFERENCE <= on_page;
    if !is_changed && on_page <= MAX_ON_OUTLINE {
        return Ok(());
    }
    let percent = |part: f64| 100.0 * part;
    if !is_changed {
        let on_page = percent(on_page);
        return Err(LabelMisfit::OtherPage { on_page });
    }
    let (on_page, changed) = (percent(on_page), percent(changed));
    Err(if mirrored <= turned {
        LabelMisfit::Mirrored { on_page, changed }
    } else {
        LabelMisfit::Turned { on_page, changed }
    })
}

/// The ink of boxes on the changed page that counts as text, as a part of that on the page.
const LEAST_INSIDE: f64 = 0.5;
const MOST_RATIO: f64 = 10.0;

fn ratio(outline: f64, inside: f64) -> f64 {
    (outline / inside.max(1e-9)).min(MOST_RATIO)
}

/// Returns the mean ink on the outlines of the boxes and inside them, after a change of the points.
fn mean_ink(
    page: &PageInk,
    boxes: &[CharacterBox],
    change: &dyn Fn([f64; 2]) -> [f64; 2],
) -> [f64; 2] {
    let sampler = page.sampler(1.0);
    let (mut outline, mut inside) = (MeanInk::default(), MeanInk::default());
    for label in boxes {
        let [left, top, right, bottom] = label.page_box;
        let at = |k: usize, count: usize| {
            let share = (k as f64 + 0.5) / count as f64;
            [left + share * (right - left), top + share * (bottom - top)]
        };
        for [x, y] in (0..POINTS).map(|k| at(k, POINTS)) {
            for point in [[x, top], [x, bottom], [left, y], [right, y]] {
                outline.add(sampler.at(change(point)));
            }
        }
        for [_, y] in (0..INNER_POINTS).map(|k| at(k, INNER_POINTS)) {
            for [x, _] in (0..INNER_POINTS).map(|k| at(k, INNER_POINTS)) {
                inside.add(sampler.at(change([x, y])));
            }
        }
    }
    [outline.mean(), inside.mean()]
}

/// The mean ink of points on the page.
#[derive(Default)]
struct MeanInk {
    sum: f64,
    count: usize,
}

impl MeanInk {
    fn add(&mut self, ink: Option<f32>) {
        if let Some(ink) = ink {
            self.sum += f64::from(ink);
            self.count += 1;
        }
    }

    fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::{LabelMisfit, check_label_fit};
    use crate::block::{CharacterBox, PageInk};
    use mocban_core::raster::Grid;

    const WIDTH: f64 = 700.0;
    const HEIGHT: f64 = 500.0;

    /// A character every 50 pixels in both directions, with wider gaps at the left and at the top.
    fn page() -> PageInk {
        page_from(0)
    }

    /// The same page, blank to the left of a column of pixels.
    fn page_from(least: usize) -> PageInk {
        let soft = Grid::from_fn(700, 500, |x, y| {
            let inside = |at: usize, first: usize| at >= first && (at - first) % 50 < 38;
            if inside(x, 67) && inside(y, 71) && (least..640).contains(&x) && y < 470 {
                255
            } else {
                0
            }
        });
        PageInk::of_soft(soft)
    }

    fn boxes(change: impl Fn([f64; 4]) -> [f64; 4]) -> Vec<CharacterBox> {
        let places = (0..11).flat_map(|x| (0..8).map(move |y| [x, y]));
        places
            .map(|[x, y]| {
                let (left, top) = (64.0 + 50.0 * f64::from(x), 68.0 + 50.0 * f64::from(y));
                CharacterBox {
                    name: format!("{x}-{y}"),
                    text: None,
                    page_box: change([left, top, left + 43.0, top + 43.0]),
                }
            })
            .collect()
    }

    #[test]
    fn labels_between_the_strokes_fit() {
        assert_eq!(check_label_fit(&page(), &boxes(|b| b)), Ok(()));
    }

    /// One side of each box runs through the strokes.
    #[test]
    fn labels_drawn_carelessly_fit() {
        let careless = boxes(|[l, t, r, b]| [l + 5.0, t, r, b]);
        assert_eq!(check_label_fit(&page(), &careless), Ok(()));
    }

    #[test]
    fn a_page_that_is_blank_on_one_side_is_not_mirrored() {
        let careless = boxes(|[l, t, r, b]| [l + 5.0, t, r, b]);
        let (_, right): (Vec<_>, Vec<_>) =
            (careless.into_iter()).partition(|label| label.page_box[0] < 400.0);
        assert_eq!(check_label_fit(&page_from(400), &right), Ok(()));
    }

    #[test]
    fn mirrored_turned_and_other_labels_are_told_apart() {
        let (w, h) = (WIDTH - 1.0, HEIGHT - 1.0);
        let mirrored = boxes(|[l, t, r, b]| [w - r, t, w - l, b]);
        assert!(matches!(
            check_label_fit(&page(), &mirrored),
            Err(LabelMisfit::Mirrored { .. })
        ));
        let turned = boxes(|[l, t, r, b]| [w - r, h - b, w - l, h - t]);
        assert!(matches!(
            check_label_fit(&page(), &turned),
            Err(LabelMisfit::Turned { .. })
        ));
        let other = boxes(|[l, t, r, b]| [l + 22.0, t + 24.0, r + 22.0, b + 24.0]);
        assert!(matches!(
            check_label_fit(&page(), &other),
            Err(LabelMisfit::OtherPage { .. })
        ));
    }
}
