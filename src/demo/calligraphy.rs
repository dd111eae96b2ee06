//! The `real` tier: photographed characters as prints, with reliefs carved from their clean masks.
//!
//! The images are cells of a figure of the `DiffACR` project (Apache-2.0; see `assets/calligraphy/LICENSE`). A crop
//! and its clean mask show the same cell; the crop has one extra row at the top. Over all twenty images the best
//! shift is [0, 1] px within half a pixel and the best scale is 1 within 1 %. The ground truth of this tier is
//! therefore accurate to about one pixel; the other tiers are exact.

use image::{GrayImage, ImageError};
use rand::RngExt;

use super::artwork::Artwork;
use super::damage::Damage;
use super::pair::{DemoPair, Printed, Scene, pair_id, pair_rng};
use super::rendered_print::PrintFrame;
use super::tier::{REAL_PAIRS, Tier};
use crate::domain::Affine2;

/// Maps pixels of the clean mask to pixels of the crop.
const CROP_FROM_CLEAN: Affine2 = Affine2([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]]);

/// A photographed character.
struct PhotographedCharacter {
    character: char,
    photograph: &'static [u8],
    clean: &'static [u8],
}

macro_rules! cell {
    ($character:literal, $number:literal) => {
        PhotographedCharacter {
            character: $character,
            photograph: include_bytes!(concat!("../../assets/calligraphy/", $number, "_real.png")),
            clean: include_bytes!(concat!("../../assets/calligraphy/", $number, "_clean.png")),
        }
    };
}

static CELLS: [PhotographedCharacter; REAL_PAIRS as usize] = [
    cell!('後', "00"),
    cell!('二', "01"),
    cell!('成', "02"),
    cell!('而', "03"),
    cell!('有', "04"),
    cell!('文', "05"),
    cell!('非', "06"),
    cell!('并', "07"),
    cell!('則', "08"),
    cell!('訓', "09"),
    cell!('尺', "10"),
    cell!('不', "11"),
    cell!('善', "12"),
    cell!('迴', "13"),
    cell!('用', "14"),
    cell!('造', "15"),
    cell!('王', "16"),
    cell!('庫', "17"),
    cell!('普', "18"),
    cell!('同', "19"),
];

/// Makes a pair from the unchanged photograph and a relief of its clean mask in a random pose.
///
/// # Errors
/// Fails when an embedded image cannot be decoded.
pub(super) fn pair(seed: u64, index: u64, vertices: Option<u32>) -> Result<DemoPair, ImageError> {
    let photographed = &CELLS[(index % REAL_PAIRS) as usize];
    let mut rng = pair_rng(seed, Tier::Real, index);
    let clean = image::load_from_memory(photographed.clean)?.to_luma8();
    let photograph = image::load_from_memory(photographed.photograph)?;
    let size_mm = rng.random_range(8.0..10.2);
    let clean_from_uv = clean_from_mm(&clean, size_mm);
    let artwork = Artwork::of_mask(size_mm, |point| {
        ink_coverage(&clean, clean_from_uv.apply(point))
    });
    let (width, height) = (photograph.width() as usize, photograph.height() as usize);
    let printed = Printed {
        frame: PrintFrame::new(width, height, CROP_FROM_CLEAN.after(&clean_from_uv)),
        bytes: photographed.photograph.to_vec(),
        extension: "png",
    };
    let no_neighbours = artwork.empty_neighbours();
    let scene = Scene {
        id: pair_id(Tier::Real, index),
        tier: Tier::Real,
        character: photographed.character,
        artwork,
        block_neighbours: no_neighbours.clone(),
        print_neighbours: no_neighbours,
        damage: Damage::default(),
    };
    Ok(scene.into_pair(printed, vertices, &mut rng))
}

/// Returns the map from mm to mask pixels that centres the ink and scales its longest side to `size_mm`.
fn clean_from_mm(clean: &GrayImage, size_mm: f64) -> Affine2 {
    let ink =
        crate::raster::Mask::from_fn(clean.width() as usize, clean.height() as usize, |x, y| {
            clean.get_pixel(x as u32, y as u32).0[0] < 128
        });
    let Some(found) = ink.bounding_box() else {
        return Affine2::IDENTITY;
    };
    let scale = found.width().max(found.height()) as f64 / size_mm;
    let centre = [found.x0 + found.x1, found.y0 + found.y1].map(|sum| sum as f64 / 2.0);
    Affine2::scale_shift(scale, centre)
}

/// Returns the ink coverage, 0..=1, at a pixel position by bilinear interpolation; 0 outside the image.
fn ink_coverage(clean: &GrayImage, [x, y]: [f64; 2]) -> f64 {
    let at = |x: f64, y: f64| {
        let (x, y) = (x as i64, y as i64);
        let inside =
            x >= 0 && y >= 0 && x < i64::from(clean.width()) && y < i64::from(clean.height());
        if inside {
            f64::from(255 - clean.get_pixel(x as u32, y as u32).0[0]) / 255.0
        } else {
            0.0
        }
    };
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let top = at(x0, y0) * (1.0 - fx) + at(x0 + 1.0, y0) * fx;
    let bottom = at(x0, y0 + 1.0) * (1.0 - fx) + at(x0 + 1.0, y0 + 1.0) * fx;
    top * (1.0 - fy) + bottom * fy
}
