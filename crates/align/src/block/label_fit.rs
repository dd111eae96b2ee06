//! Whether the boxes of labels belong to the image of a page: outlines of characters run between the strokes.

use super::characters::CharacterBox;
use super::page_ink::PageInk;

/// If a larger fraction of all outlines crosses ink, the labels do not fit. Right labels have 1 to 5 %, those of another
/// page or of the mirrored page about 20 %.
const MAX_ON_INK: f64 = 0.1;
/// The labels belong to the mirrored or turned page if their fraction there is at most this part of the fraction on the
/// page.
const MAX_CHANGED: f64 = 0.5;
/// Points along each side of a box.
const POINTS: usize = 24;

/// Why labels do not fit a page.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LabelMisfit {
    /// The labels were drawn on a mirrored image.
    #[error(
        "the labels were drawn on the mirrored image: {on_page:.0} % of the outlines cross ink, mirrored {changed:.0} %; \
         mirror the image or the labels"
    )]
    Mirrored {
        /// Percentage of the outlines on ink.
        on_page: f64,
        /// The same on the mirrored page.
        changed: f64,
    },
    /// The labels were drawn on the image turned by 180 degrees.
    #[error(
        "the labels were drawn on the image turned by 180 degrees: {on_page:.0} % of the outlines cross ink, turned \
         {changed:.0} %; turn the image or the labels"
    )]
    Turned {
        /// Percentage of the outlines on ink.
        on_page: f64,
        /// The same on the turned page.
        changed: f64,
    },
    /// The labels belong to another page.
    #[error(
        "the labels seem to be those of another page: {on_page:.0} % of the outlines cross ink (usually less than 5 %)"
    )]
    OtherPage {
        /// Percentage of the outlines on ink.
        on_page: f64,
    },
}

/// Checks that the outlines of boxes run between the strokes.
///
/// # Errors
/// Returns an error if too many points of the outlines lie on ink.
pub fn check_label_fit(page: &PageInk, boxes: &[CharacterBox]) -> Result<(), LabelMisfit> {
    let [width, height] = page.size().map(|side| side as f64 - 1.0);
    let share = |change: &dyn Fn([f64; 2]) -> [f64; 2]| share_on_ink(page, boxes, change);
    let on_page = share(&|at| at);
    if on_page <= MAX_ON_INK {
        return Ok(());
    }
    let percent = |share: f64| 100.0 * share;
    let mirrored = share(&|[x, y]| [width - x, y]);
    let turned = share(&|[x, y]| [width - x, height - y]);
    let changed = mirrored.min(turned);
    if changed > MAX_CHANGED * on_page {
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

/// Returns the fraction of the points of all outlines that lie on ink, after a change of the points.
fn share_on_ink(
    page: &PageInk,
    boxes: &[CharacterBox],
    change: &dyn Fn([f64; 2]) -> [f64; 2],
) -> f64 {
    let sampler = page.sampler(1.0);
    let (mut ink, mut count) = (0.0, 0_usize);
    for label in boxes {
        let [left, top, right, bottom] = label.page_box;
        for k in 0..POINTS {
            let share = (k as f64 + 0.5) / POINTS as f64;
            let (x, y) = (left + share * (right - left), top + share * (bottom - top));
            for point in [[x, top], [x, bottom], [left, y], [right, y]] {
                if let Some(value) = sampler.at(change(point)) {
                    ink += f64::from(value);
                    count += 1;
                }
            }
        }
    }
    ink / count.max(1) as f64
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
        let soft = Grid::from_fn(700, 500, |x, y| {
            let inside = |at: usize, first: usize| at >= first && (at - first) % 50 < 38;
            if inside(x, 67) && inside(y, 71) && x < 640 && y < 470 {
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
