//! Renders the print as a cut-out photograph with a known print frame.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::artwork::WIDE_MARGIN;
use super::inking::Inking;
use super::kind::Crop;
use super::noise::{Noise, lerp};
use super::paper_geometry::PaperGeometry;
use super::polygon::Polygon;
use super::print_sheet::{ColouredPrint, PrintSheet};
use super::scalar_field::ScalarField;
use super::scene::Scene;
use super::tear::SheetTear;
use mocban_core::domain::Affine2;
use mocban_core::raster::Grid;

/// Size of a print image and the true map between its pixels and mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct PrintFrame {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Maps (u, v) in mm to pixels. If the sheet is deformed or photographed, this is the affine least-squares fit over
    /// the strokes.
    pub print_from_uv: Affine2,
    /// Maps pixels to (u, v) in mm.
    pub uv_from_print: Affine2,
    /// The geometry of a deformed or photographed sheet, and the map from its image plane in mm to pixels.
    deformed: Option<(PaperGeometry, Affine2)>,
}

impl PrintFrame {
    /// Creates a frame without deformation from an invertible map of (u, v) in mm to pixels.
    pub(super) fn new(width: usize, height: usize, print_from_uv: Affine2) -> Self {
        let uv_from_print = print_from_uv.inverse();
        Self {
            width,
            height,
            print_from_uv,
            uv_from_print: uv_from_print.expect("a similarity of positive scale has an inverse"),
            deformed: None,
        }
    }

    /// Draws the size, scale and rotation (up to 4 degrees) of a print of the outline. Its longest side is 100-400 px,
    /// or more if the print shows 3 x 3 characters.
    pub(super) fn draw(
        outline: &Polygon,
        scene: &Scene,
        tear: Option<&SheetTear>,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let paper = scene.conditions.paper;
        let angle = rng.random_range(-4.0..4.0_f64).to_radians();
        let rotation = Affine2::similarity(1.0, angle, [0.0, 0.0]);
        let rotated = Polygon {
            corners: outline
                .corners
                .iter()
                .flat_map(|corner| [*corner, tear.map_or(*corner, |tear| tear.place(*corner))])
                .map(|corner| paper.map_or(corner, |paper| paper.image_from_uv(corner)))
                .map(|corner| rotation.apply(corner))
                .collect(),
        };
        let bounds = rotated.bounds();
        let size_mm = bounds.size();
        // Most published prints are crops of 300 dpi scans, about 135 px on the longest side. Some are larger.
        let longest_px: f64 = if rng.random_bool(0.5) {
            rng.random_range(112.0..170.0)
        } else {
            100.0 * 4.0_f64.powf(rng.random())
        };
        let longest_px = match scene.conditions.crop {
            Crop::Character | Crop::WideMesh | Crop::WideRim => longest_px,
            Crop::WidePrint => longest_px * (1.0 + 2.0 * WIDE_MARGIN),
        };
        let border = [0; 4].map(|_: i32| rng.random_range(0.0..0.02) * longest_px);
        let scale = (longest_px - 1.0 - border[0].max(border[1]) - border[2].max(border[3]))
            / size_mm[0].max(size_mm[1]);
        let shift = [0, 1].map(|i| border[i] - scale * bounds.min[i]);
        let [width, height] =
            [0, 1].map(|i| (border[i] + border[i + 2] + scale * size_mm[i]).ceil() as usize + 1);
        let print_from_image = Affine2::similarity(scale, angle, shift);
        let Some(paper) = paper else {
            return Self::new(width, height, print_from_image);
        };
        let strokes = &scene.artwork.strokes;
        let print = |uv| print_from_image.apply(paper.image_from_uv(uv));
        Self {
            deformed: Some((paper, print_from_image)),
            ..Self::new(width, height, best_affine(strokes, print))
        }
    }

    /// Returns the side of a pixel, mm. For a deformed or photographed sheet, this is an average.
    pub(super) fn px_mm(&self) -> f64 {
        self.uv_from_print.scale()
    }

    /// Returns the position of a pixel centre, mm.
    pub(super) fn uv(&self, x: usize, y: usize) -> [f64; 2] {
        let pixel = [x as f64, y as f64];
        let Some((paper, print_from_image)) = self.deformed else {
            return self.uv_from_print.apply(pixel);
        };
        let image_from_print = print_from_image.inverse();
        let image_from_print =
            image_from_print.expect("a similarity of positive scale has an inverse");
        paper.uv_from_image(image_from_print.apply(pixel))
    }
}

/// Fits an affine map to a map from (u, v) in mm to pixels by least squares over the strokes.
fn best_affine(strokes: &ScalarField, print: impl Fn([f64; 2]) -> [f64; 2]) -> Affine2 {
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Matrix3x2::<f64>::zeros();
    let side = strokes.frame.side;
    for (y, x) in (0..side)
        .step_by(4)
        .flat_map(|y| (0..side).step_by(4).map(move |x| (y, x)))
    {
        if strokes.at(x, y) > 0.0 {
            let [u, v] = strokes.frame.position(x, y);
            let row = nalgebra::Vector3::new(u, v, 1.0);
            normal += row * row.transpose();
            right += row * nalgebra::RowVector2::from(print([u, v]));
        }
    }
    let factor = normal.cholesky();
    let solved = factor
        .expect("the strokes do not lie on a line")
        .solve(&right);
    Affine2([0, 1].map(|i| [0, 1, 2].map(|k| solved[(k, i)])))
}

/// A rendered print.
pub(super) struct RenderedPrint {
    /// Red, green and blue, 0..=255.
    pub rgb: Grid<[f64; 3]>,
    /// Whether each pixel lies inside the cut outline. Pixels outside are white.
    pub inside_cut: Grid<bool>,
    /// Direction of the colours from the sheet to the ink.
    pub to_ink: [f64; 3],
}

/// Prints the scene and cuts the print along an outline.
pub(super) fn render_print(
    scene: &Scene,
    outline: &Polygon,
    frame: &PrintFrame,
    tear: Option<&SheetTear>,
    rng: &mut ChaCha8Rng,
) -> RenderedPrint {
    let inking = Inking::draw(scene, rng);
    let stains = if scene.tier.is_damaged() {
        rng.random_range(0..4)
    } else {
        0
    };
    let mut sheet = PrintSheet::draw(stains, 6.0, rng);
    let ink_grey = rng.random_range(20.0..44.0);
    let mut ink_colour = [0; 3].map(|_: i32| ink_grey + rng.random_range(-4.0..4.0));
    // Cracks may be older than the print.
    let cracks_print = rng.random_bool(0.5);
    let stretch = [Noise::draw(rng), Noise::draw(rng)];
    let mut to_ink = [-1.0; 3];
    if let Some(colours) = ColouredPrint::draw(scene.tier.kind(), rng) {
        sheet = sheet.coloured(colours.sheet, 6.0, rng);
        ink_colour = colours.ink;
        to_ink = [0, 1, 2].map(|i| colours.ink[i] - colours.sheet[i]);
    }
    let source = |x, y| {
        let uv = frame.uv(x, y);
        let source = tear.map_or(Some(uv), |tear| tear.source(uv));
        source.filter(|source| outline.contains(*source))
    };
    let is_ground =
        |x, y| tear.is_some_and(|tear| tear.is_half() || outline.contains(frame.uv(x, y)));
    let inside_cut = Grid::from_fn(frame.width, frame.height, |x, y| {
        source(x, y).is_some() || is_ground(x, y)
    });
    let rgb = Grid::from_fn(frame.width, frame.height, |x, y| {
        let Some([u, v]) = source(x, y) else {
            let ground = tear.filter(|_| inside_cut.at(x, y));
            return [ground.map_or(255.0, |tear| tear.ground_at(frame.uv(x, y))); 3];
        };
        // A damp sheet stretches unevenly by a few hundredths of a millimetre.
        let [su, sv] = stretch.map(|noise| 0.035 * noise.at(u / 4.0, v / 4.0));
        let point = [u + su, v + sv];
        let mut ink = inking.at(point, frame.px_mm());
        if cracks_print && scene.damage.is_cracked(point, 0.0) {
            ink *= 0.15;
        }
        let sheet_colour = sheet.at([u, v]);
        [0, 1, 2].map(|i| lerp(sheet_colour[i], ink_colour[i], ink).clamp(0.0, 255.0))
    });
    RenderedPrint {
        rgb,
        inside_cut,
        to_ink,
    }
}
