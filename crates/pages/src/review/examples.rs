//! Example pictures of the guide: results to pass, and one spoilt result for each reason to fail. Some are the practice
//! round.
//!
//! `examples/judging_examples.rs` draws the pictures from demo pairs.

use serde::Serialize;

use super::item_images::ImageLayer;
use mocban_core::domain::{Reason, Verdict};

/// Prefix of the ids of examples in image addresses. Ids of items are hexadecimal.
const ID_PREFIX: &str = "example-";
const JPEG: &str = "image/jpeg";
const PNG: &str = "image/png";

/// An example as the page lists it.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Example {
    /// Name, which selects the explanation `why_NAME`.
    pub(super) name: &'static str,
    /// The right verdict.
    pub(super) verdict: Verdict,
    /// The reason to fail it.
    pub(super) reason: Option<Reason>,
    /// Position in the practice round, if it is part of it.
    pub(super) practice: Option<u8>,
    #[serde(skip)]
    layers: [&'static [u8]; 5],
}

/// Returns an example with its pictures, in the order of `layer`.
macro_rules! example {
    ($name:literal, $verdict:ident, $reason:expr, $practice:expr) => {
        Example {
            name: $name,
            verdict: Verdict::$verdict,
            reason: $reason,
            practice: $practice,
            layers: [
                include_bytes!(concat!(
                    "../../../../assets/review/examples/",
                    $name,
                    "/print.jpg"
                )),
                include_bytes!(concat!(
                    "../../../../assets/review/examples/",
                    $name,
                    "/print-mask.png"
                )),
                include_bytes!(concat!(
                    "../../../../assets/review/examples/",
                    $name,
                    "/relief.jpg"
                )),
                include_bytes!(concat!(
                    "../../../../assets/review/examples/",
                    $name,
                    "/depth-mask.png"
                )),
                include_bytes!(concat!(
                    "../../../../assets/review/examples/",
                    $name,
                    "/stroke-map.png"
                )),
            ],
        }
    };
}

/// All examples, in the order of the guide.
pub(super) static EXAMPLES: [Example; 9] = [
    example!("complete", Pass, None, Some(1)),
    example!("worn", Pass, None, Some(4)),
    example!("frame_line", Pass, None, Some(6)),
    example!("angle", Fail, Some(Reason::Angle), Some(2)),
    example!("strokes_lost", Fail, Some(Reason::StrokesLost), Some(3)),
    example!("background_in", Fail, Some(Reason::BackgroundIn), Some(5)),
    example!("shift_or_scale", Fail, Some(Reason::ShiftOrScale), None),
    example!("mirrored", Fail, Some(Reason::Mirrored), None),
    example!("wrong_pair", Fail, Some(Reason::WrongPair), None),
];

/// Returns the content type and the bytes of a picture of an example, by the id in its address.
pub(super) fn layer(id: &str, layer: ImageLayer) -> Option<(&'static str, &'static [u8])> {
    let name = id.strip_prefix(ID_PREFIX)?;
    let example = EXAMPLES.iter().find(|example| example.name == name)?;
    let (kind, place) = match layer {
        ImageLayer::Print => (JPEG, 0),
        ImageLayer::PrintMask => (PNG, 1),
        ImageLayer::Relief => (JPEG, 2),
        ImageLayer::DepthMask => (PNG, 3),
        ImageLayer::StrokeMap => (PNG, 4),
        ImageLayer::DepthFrameRelief | ImageLayer::DepthFrameMask | ImageLayer::CanvasMask => {
            return None;
        }
    };
    Some((kind, example.layers[place]))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{EXAMPLES, layer};
    use crate::review::Language;
    use crate::review::item_images::ImageLayer;
    use mocban_core::domain::{Reason, Verdict};
    use mocban_core::raster::{ImageLimits, decode, decode_grey8};

    #[test]
    fn every_reason_has_an_example() {
        let reasons: BTreeSet<Reason> = EXAMPLES.iter().filter_map(|found| found.reason).collect();
        assert_eq!(reasons, BTreeSet::from(Reason::ALL));
        for language in Language::ALL {
            let messages = language.messages();
            for example in &EXAMPLES {
                let key = format!("why_{}", example.name);
                assert!(messages.contains_key(key.as_str()), "{key}");
            }
        }
    }

    #[test]
    fn the_practice_round_has_three_of_each_verdict() {
        let mut practice: Vec<_> = EXAMPLES
            .iter()
            .filter_map(|example| Some((example.practice?, example.verdict)))
            .collect();
        practice.sort_unstable_by_key(|(place, _)| *place);
        let places: Vec<u8> = practice.iter().map(|(place, _)| *place).collect();
        assert_eq!(places, [1, 2, 3, 4, 5, 6]);
        let passed = practice
            .iter()
            .filter(|(_, verdict)| *verdict == Verdict::Pass);
        assert_eq!(passed.count(), 3);
    }

    #[test]
    fn pictures_of_an_example_have_one_size() {
        for example in &EXAMPLES {
            let id = format!("example-{}", example.name);
            let bytes = |kind| layer(&id, kind).expect("a picture").1;
            let print = decode(bytes(ImageLayer::Print), &ImageLimits::SUGGESTED).expect("JPEG");
            let size = (print.rgb.width(), print.rgb.height());
            for kind in [ImageLayer::PrintMask, ImageLayer::DepthMask] {
                let mask = decode_grey8(bytes(kind)).expect("a mask");
                assert_eq!((mask.width(), mask.height()), size, "{id}");
                let values: BTreeSet<u8> = mask.data().iter().copied().collect();
                assert_eq!(values, BTreeSet::from([0, 255]), "{id}");
            }
            assert!(layer(&id, ImageLayer::CanvasMask).is_none());
        }
        assert!(layer("example-none", ImageLayer::Print).is_none());
        assert!(layer("angle", ImageLayer::Print).is_none());
    }
}
