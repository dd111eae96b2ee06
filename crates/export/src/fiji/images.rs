//! The images of a pair for `ImageJ`: heights, a stack in the print's frame, and numbered strokes.

use super::imagej_tags::{ImageDisplay, PixelSize};
use super::tiff_stack::{float_stack, integer_image};
use crate::pictures::Rgb;
use mocban_core::domain::{Affine2, DepthScale, LengthUnit};
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Grid, Mask};

/// Name of the unit of lengths if the unit of the mesh is unknown.
const UNKNOWN_UNIT: &str = "mesh unit";

/// Pictures of equal size: the print, and what is aligned with it.
#[derive(Debug)]
pub(crate) struct AlignedPictures {
    /// The print.
    pub(crate) print: Rgb,
    /// Levels of the depth map; 0 is no data.
    pub(crate) levels: Grid<u16>,
    /// The strokes.
    pub(crate) mask: Mask,
    /// Maps depth-map pixels to pixels of the pictures.
    pub(crate) from_depth: Affine2,
}

/// The images of one pair and metric as TIFF files. Lengths are millimetres, or mesh units if the unit is unknown.
#[derive(Debug)]
pub(crate) struct FijiImages {
    /// Heights over the fitted surface, in the depth map's frame.
    pub(crate) heights: Vec<u8>,
    /// Print, heights and stroke mask as channels, in the frame of the pictures.
    pub(crate) stack: Vec<u8>,
    /// The connected strokes, numbered from 1, in the frame of the pictures.
    pub(crate) strokes: Vec<u8>,
}

impl FijiImages {
    /// Encodes the images of a result. `scale` is that of the depth map with the given levels.
    pub(crate) fn new(depth: &Grid<u16>, scale: &DepthScale, pictures: &AlignedPictures) -> Self {
        let on_pictures = pixel_size(scale, &pictures.from_depth);
        let on_depth = pixel_size(scale, &Affine2::IDENTITY);
        let print = pictures.print.map(|colour| luminance(*colour));
        let mask = pictures.mask.map(|set| if *set { 255.0 } else { 0.0 });
        let channels = [
            grey_channel("print", print),
            height_channel(&pictures.levels, scale),
            grey_channel("mask", mask),
        ];
        let (numbers, highest) = numbered(&pictures.mask);
        let strokes = ImageDisplay {
            label: "strokes",
            range: [0.0, f64::from(highest.max(1))],
        };
        Self {
            heights: float_stack(&on_depth, &[height_channel(depth, scale)]),
            stack: float_stack(&on_pictures, &channels),
            strokes: integer_image(&on_pictures, strokes, numbers),
        }
    }
}

/// Returns the size of a pixel of the frame into which `from_depth` maps depth-map pixels.
fn pixel_size(scale: &DepthScale, from_depth: &Affine2) -> PixelSize {
    let per_unit = from_depth.scale() / scale.mesh_unit_per_px;
    PixelSize {
        px_per_unit: per_unit / scale.unit.map_or(1.0, LengthUnit::mm),
        unit: scale.unit.map_or(UNKNOWN_UNIT, |_| "mm"),
    }
}

/// Returns the heights of levels, NaN where there is no data, with the range of all levels.
fn height_channel(levels: &Grid<u16>, scale: &DepthScale) -> (ImageDisplay, Grid<f32>) {
    let mm = scale.unit.map_or(1.0, LengthUnit::mm);
    let heights = levels.map(|level| match level {
        0 => f32::NAN,
        level => (scale.height(*level) * mm) as f32,
    });
    let display = ImageDisplay {
        label: "height",
        range: [1, u16::MAX].map(|level| scale.height(level) * mm),
    };
    (display, heights)
}

/// Returns a channel of grey values 0 to 255.
const fn grey_channel(label: &'static str, values: Grid<f32>) -> (ImageDisplay, Grid<f32>) {
    let display = ImageDisplay {
        label,
        range: [0.0, 255.0],
    };
    (display, values)
}

/// Returns the luminance of a colour by Rec. 601, 0 to 255.
fn luminance([red, green, blue]: [u8; 3]) -> f32 {
    0.299 * f32::from(red) + 0.587 * f32::from(green) + 0.114 * f32::from(blue)
}

/// Numbers the components of a mask from 1 in the order of their first pixels; 0 is the background. Components after
/// the 65535th share its number. Returns also the highest number.
fn numbered(mask: &Mask) -> (Grid<u16>, u16) {
    let components = ConnectedComponents::label(mask);
    let number = |label: usize| u16::try_from(label + 1).unwrap_or(u16::MAX);
    let numbers = Grid::from_fn(mask.width(), mask.height(), |x, y| {
        components.label_at(x, y).map_or(0, number)
    });
    let highest = numbers.data().iter().copied().max().unwrap_or(0);
    (numbers, highest)
}

#[cfg(test)]
mod tests {
    use super::{height_channel, luminance, numbered, pixel_size};
    use mocban_core::domain::{Affine2, LengthUnit};
    use mocban_core::raster::{DepthMap, Grid, Mask};

    #[test]
    fn heights_are_millimetres_and_nan_without_data() {
        let mut depth =
            DepthMap::of_levels(Grid::from_vec(3, 1, vec![0, 1, 50_001]).expect("a row"));
        depth.scale.unit = Some(LengthUnit::Cm);
        let (display, heights) = height_channel(&depth.levels, &depth.scale);
        assert!(heights.at(0, 0).is_nan());
        assert_eq!([heights.at(1, 0), heights.at(2, 0)], [-10.0, 0.0]);
        assert!((display.range[1] - 3.106_8).abs() < 1e-9);
    }

    #[test]
    fn pixels_per_millimetre_follow_unit_and_alignment() {
        let mut scale = DepthMap::of_levels(Grid::new(1, 1, 1)).scale;
        let alignment = Affine2::similarity(0.5, 1.0, [3.0, 4.0]);
        let found = pixel_size(&scale, &alignment);
        assert!((found.px_per_unit - 5.0).abs() < 1e-12);
        assert_eq!(found.unit, "mesh unit");
        scale.unit = Some(LengthUnit::Cm);
        let found = pixel_size(&scale, &Affine2::IDENTITY);
        assert!((found.px_per_unit - 1.0).abs() < 1e-12);
        assert_eq!(found.unit, "mm");
    }

    #[test]
    fn strokes_are_numbered_from_one() {
        let rows = ["#..#", "#..#", "..#."];
        let mask = Mask::from_fn(4, 3, |x, y| rows[y].as_bytes()[x] == b'#');
        let (numbers, highest) = numbered(&mask);
        assert_eq!(numbers.data(), [1, 0, 0, 2, 1, 0, 0, 2, 0, 0, 3, 0]);
        assert_eq!(highest, 3);
        let dots = Mask::from_fn(600, 600, |x, y| x % 2 == 0 && y % 2 == 0);
        assert_eq!(numbered(&dots).1, u16::MAX);
    }

    #[test]
    fn white_has_full_luminance() {
        assert!((luminance([255; 3]) - 255.0).abs() < 1e-3);
        assert!(luminance([0, 255, 0]) > luminance([255, 0, 0]));
    }
}
