//! Whether the boxes of labels belong to the image of a page: outlines of characters run between the strokes.

use super::characters::CharacterBox;
use super::page_ink::PageInk;

/// Largest share of the outlines on ink of labels that fit. Right labels have 1 to 5 %, those of another page or of the
/// mirrored page about 20 %.
const MAX_ON_INK: f64 = 0.1;
/// Labels that fit a mirrored or turned page have at most this share of the one that they have on the page.
const MIN_GAIN: f64 = 0.5;
/// Points along each side of a box.
const POINTS: usize = 24;

/// Why labels do not fit a page.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LabelFit {
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
pub fn check_label_fit(page: &PageInk, boxes: &[CharacterBox]) -> Result<(), LabelFit> {
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
    if changed > MIN_GAIN * on_page {
        let on_page = percent(on_page);
        return Err(LabelFit::OtherPage { on_page });
    }
    let (on_page, changed) = (percent(on_page), percent(changed));
    Err(if mirrored <= turned {
        LabelFit::Mirrored { on_page, changed }
    } else {
        LabelFit::Turned { on_page, changed }
    })
}

/// Returns the share of the points of all outlines that lie on ink, after a change of the points.
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
