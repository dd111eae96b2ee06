//! The sentences for pages that are not read.

use super::{picture, plain_page, refusal};
use crate::raster::test_images::TestValues;

#[test]
fn what_is_not_read_is_refused_with_what_to_do() {
    let page = || plain_page(&picture());
    let refused = [
        page().short(259, 6),
        page().short(259, 50000),
        page().short(259, 12345),
        page().short(262, 8),
        page().short(262, 32803).short(277, 1),
        page().short(262, 4),
        page().with(258, TestValues::Shorts(vec![5, 6, 5])),
        page().with(258, TestValues::Shorts(vec![40; 3])),
        page().short(339, 2),
        page().short(277, 5000),
        page().short(277, 2),
        page().short(259, 5).short(317, 9),
        page().strips(3, vec![vec![0; 100]; 2]),
        page().tiles([60000, 60000], vec![vec![0; 100]]),
    ];
    let said: Vec<String> = refused.iter().map(refusal).collect();
    let wanted = [
        "it is compressed by old-style JPEG; save it again with LZW or without compression",
        "it is compressed by ZSTD; save it again with LZW or without compression",
        "it is compressed by method 12345; save it again with LZW or without compression",
        "its colours are L*a*b*; save it as RGB or grey",
        "it is the raw image of a camera; develop it and save it as TIFF, PNG or JPEG",
        "its colours are of the kind 4 (tag 262); save it as RGB or grey",
        "its samples have different sizes (5, 6, 5); save it with 8 or 16 bits per sample",
        "its samples have 40 bits; save it with 8 or 16 bits per sample",
        "its samples are signed or of an unknown kind; unsigned numbers and floats are read; save it with 8 or 16 unsigned bits",
        "it has 5000 samples per pixel; at most 64 are read",
        "it has 2 samples per pixel; its colours need 3",
        "its samples of 8 bits are stored by the predictor 9; save it without a predictor",
        "it has 2 of 5 strips or tiles",
        "its strips or tiles of 60000 x 60000 pixels need more than 547108864 bytes of memory",
    ];
    let wanted = wanted.map(|reason| format!("the TIFF image cannot be decoded: {reason}"));
    assert_eq!(said, wanted);
}
