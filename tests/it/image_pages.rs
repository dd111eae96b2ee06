//! Prints with an EXIF orientation, and TIFF prints with several pages.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat};
use mocban::domain::JobStatus;
use mocban::raster::{ImageLimits, PrintImage, decode};
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray8;
use tiff::tags::Tag;

use crate::cli::{call, mocban};
use crate::resume::{pairs, project, run};

const LIMITS: ImageLimits = ImageLimits::SUGGESTED;

/// `NewSubfileType` of a reduced copy and of a mask.
const REDUCED: u32 = 1;
const MASK: u32 = 4;

/// Returns an image with a dark block at the upper left, so that its eight orientations differ.
fn stored(width: u32, height: u32) -> image::GrayImage {
    image::GrayImage::from_fn(width, height, |x, y| {
        let is_dark = y < 8 && x < width / 2;
        image::Luma([if is_dark { 0 } else { 255 }])
    })
}

/// Returns an EXIF block with an orientation and nothing else.
fn exif(orientation: u8) -> Vec<u8> {
    let mut block = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    block.extend([orientation, 0, 0, 0, 0, 0, 0]);
    block
}

fn encode(format: ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let image = DynamicImage::ImageLuma8(stored(32, 16));
    image.write_to(&mut out, format).expect("encodes");
    out.into_inner()
}

fn jpeg(orientation: u8) -> Vec<u8> {
    let block = exif(orientation);
    let mut segment = vec![0xff, 0xe1];
    segment.extend((block.len() as u16 + 8).to_be_bytes());
    segment.extend(b"Exif\0\0");
    segment.extend(block);
    let mut file = encode(ImageFormat::Jpeg);
    file.splice(2..2, segment);
    file
}

/// Returns a PNG with an `eXIf` chunk before or after its pixels.
fn png(orientation: u8, is_before: bool) -> Vec<u8> {
    with_exif(encode(ImageFormat::Png), orientation, is_before)
}

fn with_exif(mut file: Vec<u8>, orientation: u8, is_before: bool) -> Vec<u8> {
    let block = exif(orientation);
    let mut chunk = (block.len() as u32).to_be_bytes().to_vec();
    let mut body = b"eXIf".to_vec();
    body.extend(block);
    chunk.extend(&body);
    chunk.extend(crc32(&body).to_be_bytes());
    let at = if is_before { 33 } else { file.len() - 12 };
    file.splice(at..at, chunk);
    file
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| {
            (c >> 1) ^ (0xedb8_8320 & (c & 1).wrapping_neg())
        })
    })
}

/// A page: its size, its `NewSubfileType` and its orientation.
type Page = ([u32; 2], Option<u32>, Option<u16>);

fn tiff_of(pages: &[Page]) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out).expect("a header");
    for ([width, height], kind, orientation) in pages {
        let mut page = encoder.new_image::<Gray8>(*width, *height).expect("a page");
        let tags = page.encoder();
        if let Some(kind) = kind {
            tags.write_tag(Tag::NewSubfileType, *kind).expect("a tag");
        }
        if let Some(orientation) = orientation {
            tags.write_tag(Tag::Orientation, *orientation)
                .expect("a tag");
        }
        let pixels = stored(*width, *height);
        page.write_data(pixels.as_raw()).expect("pixels");
    }
    out.into_inner()
}

fn size(picture: &PrintImage) -> [usize; 2] {
    [picture.rgb.width(), picture.rgb.height()]
}

#[test]
fn every_orientation_is_applied_in_every_format() {
    for number in 1..=8 {
        let orientation = image::metadata::Orientation::from_exif(number).expect("an orientation");
        let mut upright = DynamicImage::ImageLuma8(stored(32, 16));
        upright.apply_orientation(orientation);
        let upright = upright.into_luma8();
        let files = [
            ("JPEG", jpeg(number)),
            ("PNG", png(number, true)),
            ("PNG, after the pixels", png(number, false)),
            (
                "TIFF",
                tiff_of(&[([32, 16], None, Some(u16::from(number)))]),
            ),
        ];
        for (format, bytes) in files {
            let picture = decode(&bytes, &LIMITS).expect("decodes");
            let wanted = [upright.width() as usize, upright.height() as usize];
            assert_eq!(size(&picture), wanted, "{format} {number}");
            for (x, y, pixel) in upright.enumerate_pixels() {
                let [found, ..] = picture.rgb.at(x as usize, y as usize);
                assert_eq!(found > 32768, pixel[0] > 128, "{format} {number}: {x}, {y}");
            }
            let turned = Some(number).filter(|number| *number != 1);
            assert_eq!(picture.turned, turned, "{format} {number}");
        }
    }
}

#[test]
fn a_thumbnail_or_a_mask_beside_a_full_page_is_skipped_wherever_it_is() {
    let (full, thumbnail) = (([40, 20], None, Some(6)), ([8, 4], Some(REDUCED), None));
    let mask = ([40, 20], Some(MASK), None);
    for pages in [
        vec![full, thumbnail, mask],
        vec![thumbnail, full],
        vec![mask, thumbnail, full],
        vec![([40, 20], Some(REDUCED), Some(6))],
        // Many programs do not mark thumbnails.
        vec![full, ([20, 10], None, None)],
    ] {
        let picture = decode(&tiff_of(&pages), &LIMITS).expect("decodes");
        assert_eq!((size(&picture), picture.turned), ([20, 40], Some(6)));
    }
}

#[test]
fn several_full_pages_are_refused_with_their_number() {
    // More than half as wide as the other page, so no preview.
    let (full, small) = (([40, 20], None, None), ([21, 4], None, None));
    let thumbnail = ([8, 4], Some(REDUCED), None);
    for (pages, count, full) in [
        (vec![small, full], 2, 2),
        (vec![full, thumbnail, full], 3, 2),
        (vec![thumbnail, thumbnail], 2, 0),
    ] {
        let refused = decode(&tiff_of(&pages), &LIMITS).expect_err("refused");
        let wanted = format!(
            "the TIFF image has {count} pages, {full} of them of full size; a print is one page: \
             save it as its own file"
        );
        assert_eq!(refused.to_string(), wanted);
    }
}

/// The stored pixels differ, the upright images are equal.
#[test]
fn a_turned_print_has_the_results_of_the_upright_one() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = project(dir.path(), "p", "1");
    let data = project.dir().join("data");
    let upright = image::open(data.join("prints/upright-0000.jpg")).expect("a print");
    let save = |image: &DynamicImage| {
        let mut out = Cursor::new(Vec::new());
        image.write_to(&mut out, ImageFormat::Png).expect("encodes");
        out.into_inner()
    };
    std::fs::write(data.join("a.png"), save(&upright)).expect("written");
    let turned = with_exif(save(&upright.rotate270()), 6, true);
    std::fs::write(data.join("b.png"), turned).expect("written");
    let mesh = "meshes/upright-0000.ply";
    let list = format!("id,mesh,print\na,{mesh},a.png\nb,{mesh},b.png\n");
    std::fs::write(data.join("both.csv"), list).expect("written");
    mocban(project.dir(), &["import", "data/both.csv"]).expect(0);
    call(&mut run(&project, &["a", "b"])).expect(0);
    let outcomes = |name: &str| {
        let all = pairs(&project);
        let mut named = all.into_iter().map(|pair| pair.results);
        let found = named.find(|pair| pair.attributes.name.as_str() == name);
        let found = found.expect("the pair");
        assert_eq!(found.status, JobStatus::Done);
        let metrics = found.metrics.into_iter();
        metrics.map(|record| record.outcome).collect::<Vec<_>>()
    };
    assert_eq!(outcomes("a"), outcomes("b"));
    let shown = |name| mocban(project.dir(), &["show", name]).expect(0).out;
    let said = "turned upright by its EXIF orientation 6";
    assert!(shown("b").contains(said) && !shown("a").contains(said));
    mocban(project.dir(), &["export", "-o", "exported"]).expect(0);
    for name in ["a", "b"] {
        let print = project
            .dir()
            .join("exported/pairs")
            .join(name)
            .join("print.png");
        let print = image::open(print).expect("an exported print");
        assert_eq!(print.into_rgb8(), upright.to_rgb8(), "{name}");
    }
}
