//! Which page of a file is the print.

use proptest::prelude::*;

use super::{colours, picture, plain_page, refusal, widened};
use crate::raster::Grid;
use crate::raster::decode::{ImageLimits, decode, header_pixel_count, header_size};
use crate::raster::test_images::{TestPage, TestTiff, TestValues};

/// Returns a preview whose picture is in a subdirectory, as cameras and Photoshop write it.
fn preview(pictures: Vec<TestPage>) -> TestPage {
    let small = Grid::from_fn(5, 4, |x, y| picture().at(x, y));
    TestPage {
        pictures,
        ..plain_page(&small).with(254, TestValues::Longs(vec![1]))
    }
}

#[test]
fn the_picture_of_a_preview_is_read_from_its_subdirectory() {
    let full = plain_page(&picture());
    let reduced = preview(Vec::new());
    for kind in TestTiff::ALL {
        for pictures in [vec![full.clone()], vec![reduced.clone(), full.clone()]] {
            let file = kind.encode(&[preview(pictures)]);
            assert_eq!(
                colours(&file).expect("reads"),
                widened(&picture()),
                "{kind:?}"
            );
            let pixels = header_pixel_count(std::io::Cursor::new(&file));
            assert_eq!(pixels, Some(20 * 14), "{kind:?}");
        }
    }
}

#[test]
fn the_picture_of_a_preview_of_a_preview_is_read_with_the_tags_at_the_top() {
    let nested = |picture: TestPage| preview(vec![preview(vec![picture])]);
    for kind in TestTiff::ALL {
        let file = kind.encode(&[nested(plain_page(&picture())).short(274, 3)]);
        let image = decode(&file, &ImageLimits::SUGGESTED).expect("reads");
        assert_eq!(image.turned, Some(3), "{kind:?}");
        let wanted = widened(&picture());
        let turned = Grid::from_fn(20, 14, |x, y| wanted.at(19 - x, 13 - y));
        assert_eq!(image.rgb, turned.into(), "{kind:?}");
    }
}

#[test]
fn the_orientation_of_a_preview_holds_for_its_picture() {
    let parent = preview(vec![plain_page(&picture())]).short(274, 6);
    let image = decode(
        &TestTiff::default().encode(&[parent]),
        &ImageLimits::SUGGESTED,
    );
    let image = image.expect("reads");
    assert_eq!((image.rgb.width(), image.turned), (14, Some(6)));
}

#[test]
fn an_orientation_in_xmp_counts_without_that_of_the_tag() {
    // The packet is longer than what is read of a file at once.
    let packet = format!(
        "<x:xmpmeta>{}<rdf:Description tiff:Orientation=\"6\"/></x:xmpmeta>",
        " ".repeat(9000)
    );
    let limits = ImageLimits::SUGGESTED;
    let read = |kind: TestTiff, page: TestPage| {
        let file = kind.encode(&[page]);
        let turned = decode(&file, &limits).expect("reads").turned;
        let size = header_size(std::io::Cursor::new(&file), file.len() as u64, &limits);
        (turned, size.expect("a size"))
    };
    let with_xmp = |page: TestPage| page.with(700, TestValues::Bytes(packet.clone().into_bytes()));
    let page = with_xmp(plain_page(&picture()));
    for kind in TestTiff::ALL {
        let turned = (Some(6), [14, 20]);
        assert_eq!(read(kind, page.clone()), turned, "{kind:?}");
        assert_eq!(read(kind, page.clone().short(274, 0)), turned, "{kind:?}");
        let parent = with_xmp(preview(vec![plain_page(&picture())]));
        assert_eq!(read(kind, parent), turned, "{kind:?}");
        let upright = read(kind, page.clone().short(274, 1));
        assert_eq!(upright, (None, [20, 14]), "{kind:?}");
    }
}

#[test]
fn smaller_copies_in_subdirectories_are_skipped_and_a_larger_picture_is_not() {
    let small = TestPage {
        tags: preview(Vec::new()).tags,
        ..preview(Vec::new())
    };
    let unmarked = small.clone().with(254, TestValues::Longs(vec![0]));
    // The levels of a pyramid, whether they are marked as reduced or not.
    for level in [small, unmarked.clone()] {
        let page = TestPage {
            pictures: vec![level],
            ..plain_page(&picture())
        };
        let file = TestTiff::default().encode(&[page]);
        assert_eq!(colours(&file).expect("reads"), widened(&picture()));
    }
    let page = TestPage {
        pictures: vec![plain_page(&picture())],
        ..unmarked
    };
    let file = TestTiff::default().encode(&[page]);
    assert_eq!(colours(&file).expect("reads"), widened(&picture()));
}

#[test]
fn a_small_page_that_is_not_marked_is_a_preview() {
    let page = |width, height| plain_page(&Grid::from_fn(width, height, |x, y| picture().at(x, y)));
    let full = plain_page(&picture());
    for pages in [[full.clone(), page(10, 7)], [page(10, 7), full.clone()]] {
        let file = TestTiff::default().encode(&pages);
        assert_eq!(colours(&file).expect("reads"), widened(&picture()));
    }
    let file = TestTiff::default().encode(&[full, page(11, 7)]);
    assert!(colours(&file).is_err());
}

#[test]
fn several_pictures_of_a_preview_are_refused_with_their_number() {
    let full = plain_page(&picture());
    assert_eq!(
        refusal(&preview(vec![full.clone(), full])),
        "the TIFF image has 3 pages, 2 of them of full size; a print is one page: save it as its own file"
    );
}

#[test]
fn directories_that_refer_to_each_other_end() {
    let file = TestTiff::default().encode(&[plain_page(&picture())]);
    let first = u32::from_le_bytes(file[4..8].try_into().expect("four bytes"));
    // The next page is the first one.
    let mut endless = file.clone();
    let last = endless.len() - 4;
    endless[last..].copy_from_slice(&first.to_le_bytes());
    let refused = colours(&endless).expect_err("refused").to_string();
    assert!(refused.contains("more than 1000 pages"), "{refused}");
    // The subdirectory of a page is the page.
    let own = |page: TestPage| page.with(330, TestValues::Longs(vec![first + 12; 2000]));
    let refused = refusal(&own(preview(Vec::new())));
    assert!(refused.contains("more than 1000 pages"), "{refused}");
}

#[test]
fn a_tag_of_many_values_needs_no_memory() {
    let page = plain_page(&picture());
    for tag in [258, 273, 279, 320, 330, 338, 347] {
        let mut file = TestTiff::default().encode(&[page.clone().short(tag, 8)]);
        let is_tag = |at: &usize| {
            file[*at..at + 2] == u16::to_le_bytes(tag) && matches!(file[at + 2..at + 4], [3 | 4, 0])
        };
        let at = (0..file.len() - 4).rev().find(is_tag).expect("the tag");
        file[at + 4..at + 8].copy_from_slice(&u32::MAX.to_le_bytes());
        if let Ok(read) = colours(&file) {
            assert_eq!(read, widened(&picture()), "{tag}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn changed_bytes_never_panic(
        kind in prop::sample::select(TestTiff::ALL.to_vec()),
        compression in prop::sample::select(vec![1_u16, 2, 3, 4, 5, 7, 8, 32773]),
        tags in prop::collection::vec((prop::sample::select(
            vec![256_u16, 257, 258, 262, 266, 277, 278, 284, 317, 322, 323, 338, 339, 530]
        ), any::<u16>()), 0..4),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let limits = ImageLimits { max_bytes: 1 << 20, max_pixels: 10_000 };
        let mut page = plain_page(&picture()).short(259, compression);
        for (tag, value) in tags {
            page = page.short(tag, value % 70);
        }
        let mut file = kind.encode(&[preview(vec![page])]);
        for (at, value) in flips {
            let at = at.index(file.len());
            file[at] = value;
        }
        if let Ok(image) = decode(&file, &limits) {
            prop_assert!((image.rgb.width() * image.rgb.height()) as u64 <= limits.max_pixels);
        }
    }
}
