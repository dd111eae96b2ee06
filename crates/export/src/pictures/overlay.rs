//! The images of a result in one frame: the print, the aligned relief, and the print with the relief's stroke edges.

use super::paint::{BLUE, Rgb, VERMILLION, resized};
use super::relief::shaded;
use mocban_core::domain::{Affine2, DisplacedPart, MetricOutcome};
use mocban_core::raster::{DepthMap, Grid, Mask, PrintImage, warp_depth, warp_mask};

/// Colour of the edges of stroke masks.
const EDGE: [u8; 3] = VERMILLION;
/// Colour of the edges of the true stroke tops.
const TRUE_EDGE: [u8; 3] = BLUE;
/// Colour of the line beside a displaced part of the print, and of the edges of the strokes on it.
const DISPLACED_EDGE: [u8; 3] = BLUE;
/// Pixels of the longest side per pixel of edge width.
const SIDE_PER_EDGE_PX: usize = 240;
/// Minimal longest side of a saved overlay, pixels. An edge of one pixel then hides little of a stroke.
const OVERLAY_SIDE: usize = 240;

/// The frame of the print image, scaled for viewing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintView {
    width: usize,
    height: usize,
    from_print: Affine2,
}

impl PrintView {
    /// Returns the view whose longest side is `side` pixels.
    pub fn of_side(print: &PrintImage, side: usize) -> Self {
        let size = [print.rgb.width().max(1), print.rgb.height().max(1)];
        let scale = side as f64 / size[0].max(size[1]) as f64;
        let [width, height] = size.map(|n| ((n as f64 * scale).round() as usize).max(1));
        Self::new(scale, width, height)
    }

    /// Returns a view enlarged by the smallest integer factor that makes its longest side at least `OVERLAY_SIDE`.
    pub fn enlarged(print: &PrintImage) -> Self {
        let size = [print.rgb.width().max(1), print.rgb.height().max(1)];
        let factor = OVERLAY_SIDE.div_ceil(size[0].max(size[1]));
        Self::new(factor as f64, size[0] * factor, size[1] * factor)
    }

    /// Creates a view.
    fn new(scale: f64, width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            from_print: Affine2::resize(scale),
        }
    }

    /// Draws the print.
    pub fn print(&self, print: &PrintImage) -> Rgb {
        resized(&print.rgb.to_rgb8(), self.width, self.height)
    }

    /// Draws the depth map aligned to the print, lit from the upper left.
    pub fn relief(&self, depth: &DepthMap, print_from_depth: &Affine2) -> Rgb {
        let view_from_depth = self.from_print.after(print_from_depth);
        let levels = warp_depth(depth, &view_from_depth, self.width, self.height);
        let side = depth.scale.mesh_unit_per_px / view_from_depth.scale();
        shaded(&levels, depth.scale.height_per_level / side)
    }

    /// Draws the print with the edges of the aligned depth mask. On a displaced part of the print, its own pose counts.
    pub fn overlay(
        &self,
        print: &PrintImage,
        depth: &DepthMap,
        outcome: &MetricOutcome,
        displaced: Option<&DisplacedPart>,
    ) -> Rgb {
        let strokes = depth.stroke_mask(outcome.threshold_level);
        let aligned = self.mask(&strokes, &outcome.print_from_depth);
        let displaced = displaced.map(|part| (part, &strokes));
        self.draw_strokes(self.print(print), &aligned, displaced)
    }

    /// Draws the edges of a mask on a picture of the view, which is the print or the print enlarged. `strokes` is in the
    /// print's frame. `displaced` is a displaced part of the print, with the mask in the frame of the depth map.
    pub fn overlay_on(
        &self,
        picture: Rgb,
        strokes: &Mask,
        displaced: Option<(&DisplacedPart, &Mask)>,
    ) -> Rgb {
        // The pixels of the print are repeated too.
        let factor = (self.width / strokes.width()).max(1);
        let repeated = |x, y| strokes.at(x / factor, y / factor);
        let repeated = Mask::from_fn(self.width, self.height, repeated);
        self.draw_strokes(picture, &repeated, displaced)
    }

    /// Draws the edges of the strokes, which are in the frame of the view.
    fn draw_strokes(
        &self,
        mut picture: Rgb,
        strokes: &Mask,
        displaced: Option<(&DisplacedPart, &Mask)>,
    ) -> Rgb {
        let place = displaced.zip(self.from_print.inverse());
        let Some(((part, of_depth), print_from_view)) = place else {
            self.draw_edges(&mut picture, strokes, EDGE);
            return picture;
        };
        let on_part = Mask::from_fn(self.width, self.height, |x, y| {
            part.contains(print_from_view.apply([x as f64, y as f64]))
        });
        let of_rest = strokes.zip_map(&on_part, |stroke, on_part| stroke && !on_part);
        let displaced = self.mask(of_depth, &part.print_from_depth);
        let displaced = displaced.zip_map(&on_part, |stroke, on_part| stroke && on_part);
        self.draw_edges(&mut picture, &of_rest, EDGE);
        self.draw_edges(&mut picture, &displaced, DISPLACED_EDGE);
        self.draw_edges(&mut picture, &on_part, DISPLACED_EDGE);
        picture
    }

    /// Draws the print, then the edges of the true stroke tops, and last the edges of the depth mask. `tops` is in the
    /// print's frame.
    pub fn overlay_on_truth(
        &self,
        print: &PrintImage,
        tops: &Mask,
        depth: &DepthMap,
        outcome: &MetricOutcome,
    ) -> Rgb {
        let tops = self.mask(tops, &Affine2::IDENTITY);
        let strokes = depth.stroke_mask(outcome.threshold_level);
        let strokes = self.mask(&strokes, &outcome.print_from_depth);
        let mut picture = self.print(print);
        self.draw_edges(&mut picture, &tops, TRUE_EDGE);
        self.draw_edges(&mut picture, &strokes, EDGE);
        picture
    }

    /// Warps a mask to the view. `print_from_mask` maps pixels of the mask to print pixels.
    pub fn mask(&self, mask: &Mask, print_from_mask: &Affine2) -> Mask {
        let view_from_mask = self.from_print.after(print_from_mask);
        warp_mask(mask, &view_from_mask, self.width, self.height)
    }

    /// Warps two labels of a map to the view; other pixels are 0. Where both labels reach a pixel, the first one counts.
    /// `print_from_map` maps pixels of the map to print pixels.
    pub fn labels(&self, map: &Grid<u8>, labels: [u8; 2], print_from_map: &Affine2) -> Grid<u8> {
        let warped = |label: u8| self.mask(&map.map(|value| *value == label), print_from_map);
        let [first, second] = labels.map(warped);
        first.zip_map(&second, |first, second| match (first, second) {
            (true, _) => labels[0],
            (false, true) => labels[1],
            (false, false) => 0,
        })
    }

    /// Returns the map from print pixels to pixels of the view.
    pub const fn from_print(&self) -> &Affine2 {
        &self.from_print
    }

    fn draw_edges(&self, onto: &mut Rgb, mask: &Mask, colour: [u8; 3]) {
        let width = (self.width.max(self.height) / SIDE_PER_EDGE_PX).max(1);
        let edges = edges(mask, width);
        for (pixel, edge) in onto.data_mut().iter_mut().zip(edges.data()) {
            if *edge {
                *pixel = colour;
            }
        }
    }
}

/// Returns the set pixels with an unset pixel at most `width` away in their row or column. Pixels outside the image do
/// not count as unset.
fn edges(mask: &Mask, width: usize) -> Grid<bool> {
    let width = width as i64;
    Grid::from_fn(mask.width(), mask.height(), |x, y| {
        let (x, y) = (x as i64, y as i64);
        let unset = |dx, dy| mask.get(x + dx, y + dy) == Some(false);
        mask.get(x, y) == Some(true)
            && (1..=width).any(|r| unset(r, 0) || unset(-r, 0) || unset(0, r) || unset(0, -r))
    })
}

#[cfg(test)]
mod tests {
    use super::{DISPLACED_EDGE, EDGE, PrintView, TRUE_EDGE, edges};
    use mocban_core::domain::{Affine2, DisplacedPart, ThresholdMetric};
    use mocban_core::raster::{DepthMap, Grid, Mask, PrintImage};
    use mocban_results::test_fixtures;

    /// A bar of 4 x 20 px at (8, 5) on a lower level in a map of 30 x 30 px.
    fn depth() -> DepthMap {
        DepthMap::of_levels(Grid::from_fn(30, 30, |x, y| {
            if (8..12).contains(&x) && (5..25).contains(&y) {
                60_000
            } else {
                10_000
            }
        }))
    }

    fn blank_print() -> PrintImage {
        PrintImage::from(Grid::new(30, 30, [60_000; 3]))
    }

    #[test]
    fn strokes_of_a_displaced_part_are_drawn_at_its_own_pose() {
        let mut outcome = test_fixtures::metric(ThresholdMetric::Density, 0.8, &[]).outcome;
        outcome.print_from_depth = Affine2::IDENTITY;
        let part = DisplacedPart {
            normal: [0.0, 1.0],
            offset_px: 14.5,
            ink_share: 0.5,
            shift_px: [9.0, 0.0],
            angle_deg: 0.0,
            print_from_depth: Affine2::scale_shift(1.0, [9.0, 0.0]),
        };
        let view = PrintView::of_side(&blank_print(), 30);
        let picture = view.overlay(&blank_print(), &depth(), &outcome, Some(&part));
        let shown = |x, y| picture.at(x, y);
        // The bar begins at column 8 above the line, and at column 17 below it.
        let blank = shown(28, 2);
        assert_eq!([shown(8, 10), shown(17, 10)], [EDGE, blank]);
        assert_eq!([shown(8, 20), shown(17, 20)], [blank, DISPLACED_EDGE]);
        assert_eq!([shown(2, 14), shown(2, 15)], [blank, DISPLACED_EDGE]);
    }

    #[test]
    fn overlay_draws_the_bar_at_its_aligned_place() {
        let mut outcome = test_fixtures::metric(ThresholdMetric::Density, 0.8, &[]).outcome;
        outcome.print_from_depth = Affine2::scale_shift(1.0, [10.0, 0.0]);
        let view = PrintView::of_side(&blank_print(), 30);
        let picture = view.overlay(&blank_print(), &depth(), &outcome, None);
        let edge: Vec<_> = (0..30).filter(|x| picture.at(*x, 15) == EDGE).collect();
        assert_eq!(edge, [18, 21]);
    }

    #[test]
    fn an_enlarged_view_keeps_positions() {
        let mut outcome = test_fixtures::metric(ThresholdMetric::Density, 0.8, &[]).outcome;
        outcome.print_from_depth = Affine2::IDENTITY;
        let view = PrintView::enlarged(&blank_print());
        assert_eq!((view.width, view.height), (240, 240));
        let strokes = depth().stroke_mask(outcome.threshold_level);
        let of_depth = view.overlay(&blank_print(), &depth(), &outcome, None);
        let of_mask = view.overlay_on(view.print(&blank_print()), &strokes, None);
        for picture in [of_depth, of_mask] {
            let row: Vec<_> = (0..240).filter(|x| picture.at(*x, 120) == EDGE).collect();
            // The bar covers print pixels 8 to 11. Enlarged 8 times, it covers view pixels 64 to 95.
            assert!(
                row[0].abs_diff(64) <= 1 && row[row.len() - 1].abs_diff(95) <= 1,
                "{row:?}"
            );
        }
    }

    #[test]
    fn true_edges_are_drawn_below_the_found_ones() {
        let mut outcome = test_fixtures::metric(ThresholdMetric::Density, 0.8, &[]).outcome;
        outcome.print_from_depth = Affine2::scale_shift(1.0, [3.0, 0.0]);
        let tops = Mask::from_fn(30, 30, |x, y| (8..12).contains(&x) && (5..25).contains(&y));
        let view = PrintView::of_side(&blank_print(), 30);
        let picture = view.overlay_on_truth(&blank_print(), &tops, &depth(), &outcome);
        let columns =
            |colour| -> Vec<_> { (0..30).filter(|x| picture.at(*x, 15) == colour).collect() };
        assert_eq!(columns(TRUE_EDGE), [8]);
        assert_eq!(columns(EDGE), [11, 14]);
    }

    #[test]
    fn strokes_cut_by_the_border_have_no_edge_there() {
        let mask = Mask::from_fn(6, 6, |x, _| x < 3);
        let found = edges(&mask, 1);
        assert_eq!(found.row(0), [false, false, true, false, false, false]);
    }

    #[test]
    fn the_relief_follows_the_alignment() {
        let view = PrintView::of_side(&blank_print(), 30);
        let still = view.relief(&depth(), &Affine2::IDENTITY);
        let moved = view.relief(&depth(), &Affine2::scale_shift(1.0, [5.0, 0.0]));
        assert_eq!(still.at(10, 15), moved.at(15, 15));
    }
}
