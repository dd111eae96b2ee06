//! The real tier: photographed characters as prints, reliefs carved from their clean masks.
//!
//! The pictures are cells of a figure of the `DiffACR` project (Apache-2.0, the licence lies beside them). A crop
//! and its clean mask show the same cell, the crop with one row more at the top: over all twenty, the shift at which
//! both agree best is [0, 1] px, to half a pixel, and the scale 1 to one part in a hundred. So the truth of this tier
//! is good to about a pixel, that of the others exact.

use image::{GrayImage, ImageError};
use rand::RngExt;

use super::artwork::Artwork;
use super::damage::Damage;
use super::pair::{Pair, Printed, Scene, id_of, rng_of};
use super::print::PrintFrame;
use super::tier::Tier;
use crate::domain::Affine2;

/// Where a pixel of the clean mask lies in the crop.
const CROP_FROM_CLEAN: Affine2 = Affine2([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]]);

/// How many there are.
pub(super) const COUNT: u64 = 20;

/// A photographed character.
struct Cell {
    character: char,
    photograph: &'static [u8],
    clean: &'static [u8],
}

macro_rules! cell {
    ($character:literal, $number:literal) => {
        Cell {
            character: $character,
            photograph: include_bytes!(concat!("../../assets/calligraphy/", $number, "_real.png")),
            clean: include_bytes!(concat!("../../assets/calligraphy/", $number, "_clean.png")),
        }
    };
}

static CELLS: [Cell; COUNT as usize] = [
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

/// Makes a pair: the photograph as it is, and a relief of its clean mask in any pose.
///
/// # Errors
/// When a picture cannot be read or encoded.
pub(super) fn pair(seed: u64, index: u64, vertices: Option<u32>) -> Result<Pair, ImageError> {
    let cell = &CELLS[(index % COUNT) as usize];
    let mut rng = rng_of(seed, Tier::Real, index);
    let clean = image::load_from_memory(cell.clean)?.to_luma8();
    let photograph = image::load_from_memory(cell.photograph)?;
    let size_mm = rng.random_range(8.0..10.2);
    let clean_from_uv = place(&clean, size_mm);
    let artwork = Artwork::of_mask(size_mm, |point| {
        ink_share(&clean, clean_from_uv.apply(point))
    });
    let (width, height) = (photograph.width() as usize, photograph.height() as usize);
    let printed = Printed {
        frame: PrintFrame::new(width, height, CROP_FROM_CLEAN.after(&clean_from_uv)),
        bytes: cell.photograph.to_vec(),
        extension: "png",
    };
    let bare = artwork.no_surroundings();
    let scene = Scene {
        id: id_of(Tier::Real, index),
        tier: Tier::Real,
        character: cell.character,
        artwork,
        block_around: bare.clone(),
        print_around: bare,
        damage: Damage::default(),
    };
    Ok(scene.carved(printed, vertices, &mut rng))
}

/// Pixels from mm such that the ink box is centred and its longest side is `size_mm`.
fn place(clean: &GrayImage, size_mm: f64) -> Affine2 {
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

/// Share of ink at a pixel position, bilinear; none outside.
fn ink_share(clean: &GrayImage, [x, y]: [f64; 2]) -> f64 {
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
