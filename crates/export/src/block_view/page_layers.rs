//! Draws parts of a page: its image, the relief of the block in the frame of the page, or both over each other.

use std::sync::Arc;

use rayon::prelude::*;

use crate::pictures::{BLUE, Rgb, VERMILLION, resized, shaded};
use mocban_align::block::{CarvedFace, PageInk, PageMap};
use mocban_core::domain::cancel::ThreadToken;
use mocban_core::domain::enum_names;
use mocban_core::raster::{Grid, jpeg_rgb8};

/// Pixels of a picture between points whose place on the face is computed; those between are interpolated linearly.
const NODE_STEP: usize = 16;
/// Heights over the surface of the tops that are shaded, mm. Deeper ground is as dark as the lowest height.
const SHADED_MM: [f32; 2] = [-2.5, 0.5];
/// Levels between these heights.
const LEVELS: f32 = 60_000.0;
/// Colour of ink under a stroke of the relief.
pub(super) const BOTH: [u8; 3] = [40, 40, 40];
/// Colours beside the face: of the sheet, and of ink.
const BESIDE: [u8; 3] = [240, 240, 240];
pub(super) const INK_BESIDE: [u8; 3] = [165, 165, 165];

/// Quality of JPEG images, 1 to 100.
const QUALITY: u8 = 85;

/// What is drawn of a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PageLayer {
    /// The image of the page.
    Page,
    /// The relief of the block in the frame of the page, lit from the upper left.
    Relief,
    /// Ink and strokes of the relief over each other.
    Overlay,
}

enum_names! { pub PageLayer, "a layer":
    Page = "page", Relief = "relief", Overlay = "overlay",
}

/// A rectangle of the page in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageRegion {
    /// Column and row of the upper left pixel.
    pub corner: [usize; 2],
    /// Width and height.
    pub size: [usize; 2],
}

impl PageRegion {
    /// Returns a whole page of this width and height.
    pub(super) const fn whole(size: [usize; 2]) -> Self {
        let corner = [0, 0];
        Self { corner, size }
    }

    /// Returns the part of the region within a page; `None` if there is none.
    #[must_use]
    pub fn within(self, page: [usize; 2]) -> Option<Self> {
        let size = [0, 1].map(|k: usize| self.size[k].min(page[k].saturating_sub(self.corner[k])));
        let corner = self.corner;
        (size[0] > 0 && size[1] > 0).then_some(Self { corner, size })
    }

    /// Returns the size of its picture: that of the region, or smaller with a longer side of `longest` pixels.
    #[must_use]
    pub fn picture_size(self, longest: usize) -> [usize; 2] {
        let side = self.size[0].max(self.size[1]).max(1);
        let scale = (longest as f64 / side as f64).min(1.0);
        self.scaled(scale)
    }

    /// Returns the size of its picture with `scale` pixels per pixel of the page.
    #[must_use]
    pub fn scaled(self, scale: f64) -> [usize; 2] {
        self.size
            .map(|side| ((side as f64 * scale).round() as usize).max(1))
    }
}

/// The image of a page, its ink, and the face that was registered with it.
#[derive(Debug)]
pub struct PageLayers {
    pub(super) page: Arc<Rgb>,
    pub(super) ink: PageInk,
    pub(super) face: CarvedFace,
    pub(super) map: PageMap,
}

impl PageLayers {
    /// Returns the width and height of the page, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.page.width(), self.page.height()]
    }

    /// Returns the whole page.
    pub fn whole(&self) -> PageRegion {
        PageRegion::whole(self.size())
    }

    /// Returns the pixels of the page per mm.
    pub fn px_per_mm(&self) -> f64 {
        self.map.scale()
    }

    /// Draws a layer of a region, which must lie within the page, as a picture of `size` pixels.
    pub fn draw(&self, layer: PageLayer, region: PageRegion, size: [usize; 2]) -> Rgb {
        match layer {
            PageLayer::Page => page_part(&self.page, region, size),
            PageLayer::Relief => relief(&self.face, &self.map, region, size),
            PageLayer::Overlay => overlay(&self.ink, &self.face, &self.map, region, size),
        }
    }

    /// Draws a layer of a region, which must lie within the page, as JPEG. The picture has the pixels of the page, or fewer,
    /// so that its longer side has at most `longest` pixels.
    pub fn jpeg(&self, layer: PageLayer, region: PageRegion, longest: usize) -> Vec<u8> {
        let picture = self.draw(layer, region, region.picture_size(longest));
        jpeg(&picture)
    }
}

/// Draws a region of the image of a page, in which it must lie, as a picture of `width` x `height` pixels.
pub(super) fn page_part(page: &Rgb, region: PageRegion, [width, height]: [usize; 2]) -> Rgb {
    if region == PageRegion::whole([page.width(), page.height()]) {
        return resized(page, width, height);
    }
    let [x, y] = region.corner;
    let part = Rgb::from_fn(region.size[0], region.size[1], |column, row| {
        page.at(x + column, y + row)
    });
    resized(&part, width, height)
}

/// Encodes a picture as JPEG.
pub(super) fn jpeg(picture: &Rgb) -> Vec<u8> {
    jpeg_rgb8(picture, QUALITY)
}

/// Encodes a whole page as JPEG, so that its longer side has at most `longest` pixels.
pub(super) fn whole_jpeg(page: &Rgb, longest: usize) -> Vec<u8> {
    let whole = PageRegion::whole([page.width(), page.height()]);
    let [width, height] = whole.picture_size(longest);
    jpeg(&resized(page, width, height))
}

/// Draws the relief of a face as it lies on a region of a page, lit from the upper left.
pub(super) fn relief(
    face: &CarvedFace,
    map: &PageMap,
    region: PageRegion,
    size: [usize; 2],
) -> Rgb {
    let view = FacePlaces::new(map, region, size);
    let [low, high] = SHADED_MM;
    let levels = view.picture(|at, _| match face.height_at(at) {
        Some(height) => {
            let share = (height.clamp(low, high) - low) / (high - low);
            1 + (share * LEVELS) as u16
        }
        None => 0,
    });
    let mm_per_level = f64::from((high - low) / LEVELS);
    shaded(&levels, mm_per_level * map.scale() / view.step)
}

/// Draws the ink of a region of a page and the strokes of a face over each other.
pub(super) fn overlay(
    ink: &PageInk,
    face: &CarvedFace,
    map: &PageMap,
    region: PageRegion,
    size: [usize; 2],
) -> Rgb {
    let view = FacePlaces::new(map, region, size);
    let ink = ink.sampler(view.step);
    view.picture(|at, page| {
        let ink = ink.at(page).unwrap_or(0.0);
        match face.strokes_at(at) {
            Some(strokes) => mixed(ink, strokes),
            None => blend(BESIDE, INK_BESIDE, ink),
        }
    })
}

/// Returns the colour of ink and strokes over each other: of the sheet, of one of them, or of both.
fn mixed(ink: f32, strokes: f32) -> [u8; 3] {
    let without_ink = blend([255; 3], VERMILLION, strokes);
    let with_ink = blend(BLUE, BOTH, strokes);
    blend(without_ink, with_ink, ink)
}

fn blend(from: [u8; 3], to: [u8; 3], share: f32) -> [u8; 3] {
    [0, 1, 2].map(|k: usize| {
        let (from, to) = (f32::from(from[k]), f32::from(to[k]));
        (from + share * (to - from)).round() as u8
    })
}

/// The places on the face and on the page of the pixels of a picture.
struct FacePlaces {
    size: [usize; 2],
    /// Page pixel of the middle of the first pixel.
    first: [f64; 2],
    /// Page pixels per pixel of the picture.
    step: f64,
    /// Places on the face of every 16th pixel, mm.
    nodes: Grid<[f64; 2]>,
}

impl FacePlaces {
    fn new(map: &PageMap, region: PageRegion, size: [usize; 2]) -> Self {
        let step = region.size[0] as f64 / size[0] as f64;
        let first = region.corner.map(|at| at as f64 + step / 2.0 - 0.5);
        let [columns, rows] = size.map(|side| side / NODE_STEP + 2);
        let token = ThreadToken::current();
        let places: Vec<[f64; 2]> = (0..columns * rows)
            .into_par_iter()
            .map(|k| {
                token.scope(|| {
                    let pixel = [k % columns, k / columns].map(|at| (at * NODE_STEP) as f64 * step);
                    map.face_from_page([first[0] + pixel[0], first[1] + pixel[1]])
                })
            })
            .collect();
        Self {
            size,
            first,
            step,
            nodes: Grid::from_vec(columns, rows, places).expect("one place for each node"),
        }
    }

    /// Computes each pixel from its place on the face in mm and its place on the page in pixels.
    fn picture<T: Copy + Send>(&self, pixel: impl Fn([f64; 2], [f64; 2]) -> T + Sync) -> Grid<T> {
        let [width, height] = self.size;
        let token = ThreadToken::current();
        let (row, pixel) = (|y: usize| token.scope(|| self.row(y)), &pixel);
        let data: Vec<T> = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| {
                row(y)
                    .into_iter()
                    .map(move |(face, page)| pixel(face, page))
            })
            .collect();
        Grid::from_vec(width, height, data).expect("one value for each pixel")
    }

    fn row(&self, y: usize) -> Vec<([f64; 2], [f64; 2])> {
        let (upper, down) = (y / NODE_STEP, (y % NODE_STEP) as f64 / NODE_STEP as f64);
        let between = |a: [f64; 2], b: [f64; 2], share: f64| {
            [0, 1].map(|k: usize| a[k] + share * (b[k] - a[k]))
        };
        let nodes: Vec<[f64; 2]> = (self.nodes.row(upper).iter().zip(self.nodes.row(upper + 1)))
            .map(|(upper, lower)| between(*upper, *lower, down))
            .collect();
        let page_y = self.first[1] + y as f64 * self.step;
        (0..self.size[0])
            .map(|x| {
                let (left, across) = (x / NODE_STEP, (x % NODE_STEP) as f64 / NODE_STEP as f64);
                let face = between(nodes[left], nodes[left + 1], across);
                (face, [self.first[0] + x as f64 * self.step, page_y])
            })
            .collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::sync::Arc;

    use super::{BOTH, INK_BESIDE, PageLayer, PageLayers, PageRegion};
    use crate::pictures::{BLUE, Rgb, VERMILLION};
    use mocban_align::block::{
        CarvedFace, HeightHeader, Orientation, PageInk, PageMap, StoredHeights,
    };
    use mocban_core::domain::Affine2;
    use mocban_core::raster::Grid;

    /// Columns of the page with ink.
    const INK: std::ops::Range<usize> = 300..340;

    /// A face of 90 x 60 mm with a ridge at every 9 mm, 1.5 mm high and 3 mm wide, on a page of 10 px/mm.
    pub(in crate::block_view) fn ridges() -> PageLayers {
        let values = Grid::from_fn(600, 400, |x, _| if x % 60 < 20 { 33_000 } else { 30_000 });
        let header = HeightHeader {
            frame: Orientation {
                mm: 1.0,
                centre: [0.0; 3],
                axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                half_extent_mm: [45.0, 30.0, 10.0],
                triangles: 2,
            },
            origin_mm: [0.0, 0.0],
            low_mm: -16.0,
        };
        let face = CarvedFace::of(&StoredHeights { header, values }).expect("a face");
        let page_from_face = Affine2::scale_shift(10.0, [0.0, 0.0]);
        let soft = Grid::from_fn(1000, 600, |x, _| if INK.contains(&x) { 255 } else { 0 });
        PageLayers {
            page: Arc::new(Rgb::from_fn(1000, 600, |x, y| {
                [(x % 250) as u8, (y % 250) as u8, 7]
            })),
            ink: PageInk::of_soft(soft),
            face,
            map: PageMap::affine(&page_from_face, [0.0, 0.0], [90.0, 60.0]),
        }
    }

    #[test]
    fn ink_and_strokes_have_the_colours_of_the_legend() {
        let layers = ridges();
        let picture = layers.draw(PageLayer::Overlay, layers.whole(), [1000, 600]);
        let near = |at: [u8; 3], colour: [u8; 3]| {
            let far = at.iter().zip(colour).map(|(a, b)| a.abs_diff(b)).max();
            assert!(far < Some(30), "{at:?} {colour:?}");
        };
        // A ridge without ink, ink on ground, sheet without both, and the page beside the face.
        near(picture.at(105, 300), VERMILLION);
        near(picture.at(335, 300), BLUE);
        near(picture.at(160, 300), [255; 3]);
        near(picture.at(960, 300), [240; 3]);
        // The ridge from 270 to 300 px and the ink have one pixel in common at most.
        let mut moved = ridges();
        moved.map = PageMap::affine(
            &Affine2::scale_shift(10.0, [40.0, 0.0]),
            [0.0; 2],
            [90.0, 60.0],
        );
        let picture = moved.draw(PageLayer::Overlay, moved.whole(), [1000, 600]);
        near(picture.at(325, 300), BOTH);
        moved.map = PageMap::affine(
            &Affine2::scale_shift(10.0, [400.0, 0.0]),
            [0.0; 2],
            [90.0, 60.0],
        );
        let picture = moved.draw(PageLayer::Overlay, moved.whole(), [1000, 600]);
        near(picture.at(320, 300), INK_BESIDE);
    }

    #[test]
    fn a_region_is_the_same_part_of_the_whole() {
        let layers = ridges();
        let region = PageRegion {
            corner: [200, 100],
            size: [300, 200],
        };
        for layer in [PageLayer::Page, PageLayer::Overlay] {
            let whole = layers.draw(layer, layers.whole(), [1000, 600]);
            let part = layers.draw(layer, region, [300, 200]);
            for (x, y) in [(0, 0), (150, 100), (299, 199)] {
                let (a, b) = (part.at(x, y), whole.at(200 + x, 100 + y));
                assert!(
                    (0..3).all(|k| a[k].abs_diff(b[k]) < 3),
                    "{layer} {a:?} {b:?}"
                );
            }
        }
    }

    #[test]
    fn the_relief_is_lit_from_the_left_and_missing_beside_the_face() {
        let layers = ridges();
        let picture = layers.draw(PageLayer::Relief, layers.whole(), [1000, 600]);
        // Rising and falling side of the ridge from 180 to 210 px.
        let (rising, falling) = (picture.at(178, 300)[0], picture.at(208, 300)[0]);
        assert!(rising > falling + 40, "{rising} {falling}");
        assert_eq!(picture.at(980, 300), [226, 232, 240]);
    }

    #[test]
    fn regions_are_clipped_to_the_page() {
        let region = PageRegion {
            corner: [900, 590],
            size: [300, 200],
        };
        let within = region.within([1000, 600]).expect("a part");
        assert_eq!(within.size, [100, 10]);
        assert_eq!(within.picture_size(50), [50, 5]);
        assert_eq!(within.picture_size(4000), [100, 10]);
        assert_eq!(region.within([900, 600]), None);
    }
}
