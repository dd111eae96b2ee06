//! The direction in which a page is read.

use super::layout::Layout;
use super::places::{Place, Strokes};
use super::skew::{page_angle, text_angle};
use super::text_image::{TextFrame, TextImage};
use crate::block::align::Face;
use crate::block::page_ink::PageInk;
use crate::block::page_map::PageMap;

/// Returns the image of the text with columns along y, and its strokes. It may still be upside down.
pub(super) fn upright_image(side: &Face, page: &PageInk, map: &PageMap) -> (TextImage, Layout) {
    let middle = [0.0, 0.0];
    let angle = text_angle(side, page_angle(map, middle));
    let image = TextImage::sample(side, page, map, TextFrame::around(side, angle));
    let layout = Layout::of(&image);
    (image, layout)
}

pub(super) fn is_upside_down(
    _layout: &Layout,
    _places: &[Place],
    _strokes: &[Strokes],
    _image: &TextImage,
    _map: &PageMap,
) -> bool {
    false
}
