//! The `real` tier: the prints are photographs of characters, and the reliefs are carved from clean masks of them.
//!
//! Photographs and masks come from a figure of the `DiffACR` project (Apache-2.0; see `assets/calligraphy/LICENSE`).
//! Each photograph has one row more at the top than its mask. Over all twenty characters, mask and photograph match
//! best with a shift of [0, 1] px (within half a pixel) and a scale of 1 (within 1 %). The ground truth of this tier is
//! therefore accurate to about one pixel. In the other tiers, the ground truth ignores only the uneven stretch of the
//! damp sheet, 0.035 mm or less along each axis. For a deformed or photographed sheet, its map is the closest affine
//! map.

use image::{GrayImage, ImageError};
use rand::RngExt;

use super::artwork::Artwork;
use super::carved_block::CarvedBlock;
use super::conditions::Conditions;
use super::damage::Damage;
use super::glyph::Glyphs;
use super::pair::{DemoPair, Printed, finish_pair};
use super::rendered_print::PrintFrame;
use super::scalar_field::bilinear;
use super::scene::{Scene, pair_id, pair_rng};
use super::tier::{REAL_PAIRS, Tier};
use mocban_core::domain::Affine2;
use mocban_core::raster::Mask;

/// Maps pixels of the clean mask to pixels of the photograph.
const CROP_FROM_CLEAN: Affine2 = Affine2([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]]);

/// A photographed character.
struct PhotographedCharacter {
    character: char,
    photograph: &'static [u8],
    clean: &'static [u8],
}

macro_rules! cells {
    ($($number:literal $character:literal),+) => {
        [$(PhotographedCharacter {
            character: $character,
            photograph: include_bytes!(concat!("../../../assets/calligraphy/", $number, "_real.png")),
            clean: include_bytes!(concat!("../../../assets/calligraphy/", $number, "_clean.png")),
        }),+]
    };
}

static CELLS: [PhotographedCharacter; REAL_PAIRS as usize] = cells! {
    "00" '後', "01" '二', "02" '成', "03" '而', "04" '有', "05" '文', "06" '非', "07" '并', "08" '則', "09" '訓',
    "10" '尺', "11" '不', "12" '善', "13" '迴', "14" '用', "15" '造', "16" '王', "17" '庫', "18" '普', "19" '同'
};

/// Makes a pair. The print is the unchanged photograph. The relief is carved from the clean mask, in a random pose.
pub(super) fn pair(
    glyphs: &Glyphs,
    seed: u64,
    index: u64,
    vertices: Option<u32>,
) -> Result<DemoPair, ImageError> {
    let photographed = &CELLS[(index % REAL_PAIRS) as usize];
    let mut rng = pair_rng(seed, Tier::Real, index, 0);
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
        conditions: Conditions::default(),
    };
    let block = CarvedBlock::draw(&scene, &mut rng);
    Ok(finish_pair(
        glyphs, &scene, &block, printed, vertices, &mut rng,
    ))
}

/// Returns a map from mm to mask pixels. The origin maps to the ink's centre, `size_mm` to the ink's longest side.
fn clean_from_mm(clean: &GrayImage, size_mm: f64) -> Affine2 {
    let ink = Mask::from_fn(clean.width() as usize, clean.height() as usize, |x, y| {
        clean.get_pixel(x as u32, y as u32).0[0] < 128
    });
    let Some(found) = ink.bounding_box() else {
        return Affine2::IDENTITY;
    };
    let scale = found.width().max(found.height()) as f64 / size_mm;
    let centre = [found.x0 + found.x1, found.y0 + found.y1].map(|sum| sum as f64 / 2.0);
    Affine2::scale_shift(scale, centre)
}

/// Returns the ink coverage, 0..=1, at a pixel position by bilinear interpolation. The coverage is 0 outside the image.
fn ink_coverage(clean: &GrayImage, [x, y]: [f64; 2]) -> f64 {
    let at = |x: f64, y: f64| {
        let pixel = (x >= 0.0 && y >= 0.0).then(|| clean.get_pixel_checked(x as u32, y as u32));
        let grey = pixel.flatten().map_or(255, |pixel| pixel.0[0]);
        f64::from(255 - grey) / 255.0
    };
    let (x0, y0) = (x.floor(), y.floor());
    let corners = [y0, y0 + 1.0].map(|y| [x0, x0 + 1.0].map(|x| at(x, y)));
    bilinear(corners, x - x0, y - y0)
}
