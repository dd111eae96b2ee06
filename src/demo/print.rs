//! The print as photographed and cut out: a picture and the true frame it lies in.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::damage::Damage;
use super::ink::Inking;
use super::noise::{Noise, mix};
use super::paper::Paper;
use super::polygon::Polygon;
use super::tier::Tier;
use crate::domain::Affine2;
use crate::raster::Grid;

/// Size of a print image and the true map onto it.
#[derive(Debug, Clone, Copy)]
pub(super) struct PrintFrame {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels from millimetres as the print reads.
    pub print_from_uv: Affine2,
    /// Millimetres as the print reads from pixels.
    pub uv_from_print: Affine2,
}

impl PrintFrame {
    /// A frame from its map, a similarity.
    pub(super) fn new(width: usize, height: usize, print_from_uv: Affine2) -> Self {
        let uv_from_print = print_from_uv.inverse();
        Self {
            width,
            height,
            print_from_uv,
            uv_from_print: uv_from_print.expect("a similarity of positive scale has an inverse"),
        }
    }

    /// A frame that holds a polygon, its longest side 100-400 px, turned by a few degrees.
    pub(super) fn draw(outline: &Polygon, rng: &mut ChaCha8Rng) -> Self {
        let angle = rng.random_range(-4.0..4.0_f64).to_radians();
        let turn = Affine2::similarity(1.0, angle, [0.0, 0.0]);
        let turned = Polygon {
            corners: outline
                .corners
                .iter()
                .map(|corner| turn.apply(*corner))
                .collect(),
        };
        let bounds = turned.bounds();
        let size_mm = [0, 1].map(|i| bounds.max[i] - bounds.min[i]);
        // Most crops of the field are about 135 px, from 300 dpi; some are finer.
        let longest_px: f64 = if rng.random_bool(0.5) {
            rng.random_range(112.0..170.0)
        } else {
            100.0 * 4.0_f64.powf(rng.random())
        };
        let border = [0; 4].map(|_: i32| rng.random_range(0.0..0.02) * longest_px);
        let scale = (longest_px - 1.0 - border[0].max(border[1]) - border[2].max(border[3]))
            / size_mm[0].max(size_mm[1]);
        let shift = [0, 1].map(|i| border[i] - scale * bounds.min[i]);
        let [width, height] =
            [0, 1].map(|i| (border[i] + border[i + 2] + scale * size_mm[i]).ceil() as usize + 1);
        Self::new(width, height, Affine2::similarity(scale, angle, shift))
    }

    /// Side of a pixel, mm.
    pub(super) fn px_mm(&self) -> f64 {
        self.uv_from_print.scale()
    }

    /// Where a pixel's centre lies, mm.
    pub(super) fn uv(&self, x: usize, y: usize) -> [f64; 2] {
        self.uv_from_print.apply([x as f64, y as f64])
    }
}

/// What goes on the paper.
pub(super) struct Impression<'a> {
    /// The ink.
    pub inking: &'a Inking,
    /// Damage of the block; its cracks may be older than the print.
    pub damage: &'a Damage,
    /// Where the print is cut.
    pub outline: &'a Polygon,
    /// How hard it is to read.
    pub tier: Tier,
}

/// A print: red, green, blue of 0..=255, and whether each pixel lies inside the cut.
pub(super) struct Print {
    /// Colours.
    pub rgb: Grid<[f64; 3]>,
    /// Inside the polygon; the rest is white.
    pub is_paper: Grid<bool>,
}

/// Prints.
pub(super) fn print(impression: &Impression, frame: &PrintFrame, rng: &mut ChaCha8Rng) -> Print {
    let stains = if impression.tier.is_damaged() {
        rng.random_range(0..4)
    } else {
        0
    };
    let paper = Paper::draw(stains, 6.0, rng);
    let ink_grey = rng.random_range(20.0..44.0);
    let ink_colour = [0; 3].map(|_: i32| ink_grey + rng.random_range(-4.0..4.0));
    let cracks_print = rng.random_bool(0.5);
    let stretch = [Noise::draw(rng), Noise::draw(rng)];
    let is_paper = Grid::from_fn(frame.width, frame.height, |x, y| {
        impression.outline.contains(frame.uv(x, y))
    });
    let rgb = Grid::from_fn(frame.width, frame.height, |x, y| {
        let [u, v] = frame.uv(x, y);
        if !is_paper.at(x, y) {
            return [255.0; 3];
        }
        // Damp paper stretches unevenly: a few hundredths of a millimetre.
        let [su, sv] = stretch.map(|noise| 0.035 * noise.at(u / 4.0, v / 4.0));
        let point = [u + su, v + sv];
        let mut ink = impression.inking.at(point, frame.px_mm());
        if cracks_print && impression.damage.is_cracked(point, 0.0) {
            ink *= 0.15;
        }
        let sheet = paper.at([u, v]);
        [0, 1, 2].map(|i| mix(sheet[i], ink_colour[i], ink).clamp(0.0, 255.0))
    });
    Print { rgb, is_paper }
}
