//! Pictures of the files of a block before it is imported: its page with the boxes of labels, and some points of its scan.

use crate::pictures::{Rgb, VERMILLION, mark_edges, resized, shaded};
use mocban_core::mesh::robust_bounds::{bulk_box, is_in_box};
use mocban_core::raster::{Colours, Grid, PrintImage, reduce};

/// Highest level of a height.
const LEVELS: f64 = 65_000.0;
/// How often gaps between points are filled from their sides.
const FILLS: usize = 6;
/// Side of a cell, pixels, in which the highest point is of the front of a block.
const CELL: f64 = 16.0;
/// Distance below it, pixels, from which on points are of the back or the edge. Strokes are less deep.
const LAYER: f64 = 8.0;
/// Fewest points of a picture.
const FEWEST: usize = 16;

/// Draws a page with boxes, given by their edges in its pixels. Its longer side gets at most `longest` pixels.
pub fn page_with_boxes(page: &PrintImage, boxes: &[[f64; 4]], longest: usize) -> Rgb {
    let size = [page.rgb.width().max(1), page.rgb.height().max(1)];
    let scale = (longest as f64 / size[0].max(size[1]) as f64).min(1.0);
    let [width, height] = size.map(|side| ((side as f64 * scale).round() as usize).max(1));
    // Fewer pixels are converted if those of a large page are reduced before.
    let times = (0.5 / scale).floor() as u32;
    let mut picture = if times > 1 {
        let reduced = Colours::from(reduce(&page.rgb, times));
        resized(&reduced.to_rgb8(), width, height)
    } else {
        resized(&page.rgb.to_rgb8(), width, height)
    };
    // Edges are between pixels, whose centres have whole coordinates.
    let edges = |bounds: &[f64; 4]| bounds.map(|edge| (edge + 0.5) * scale);
    let boxes: Vec<[f64; 4]> = boxes.iter().map(edges).collect();
    mark_edges(&mut picture, &boxes, VERMILLION);
    picture
}

/// Draws points of a scan as heights along the shortest side of the box around them, lit from the upper left. The longer
/// side of the picture has `longest` pixels. `None` if there are too few points, or if they have no extent.
pub fn points_from_above(points: &[[f32; 3]], longest: usize) -> Option<Rgb> {
    let bulk = bulk_box(points);
    let points: Vec<[f64; 3]> = points
        .iter()
        .map(|point| point.map(f64::from))
        .filter(|point| is_in_box(&bulk, point))
        .collect();
    if points.len() < FEWEST {
        return None;
    }
    let mut ends = [points[0]; 2];
    for point in &points {
        for axis in 0..3 {
            ends[0][axis] = ends[0][axis].min(point[axis]);
            ends[1][axis] = ends[1][axis].max(point[axis]);
        }
    }
    let [low, high] = ends;
    let sides = [0, 1, 2].map(|axis| high[axis] - low[axis]);
    let mut axes = [0, 1, 2];
    axes.sort_by(|a, b| sides[*b].total_cmp(&sides[*a]));
    let [across, down, along] = axes;
    let pixel = sides[across] / longest.max(1) as f64;
    if !(pixel.is_finite() && pixel > 0.0) {
        return None;
    }
    let count = |axis: usize| ((sides[axis] / pixel).ceil() as usize).clamp(1, longest);
    let (width, height) = (count(across), count(down));
    let mut levels = Grid::new(width, height, 0_u16);
    let per_level = (sides[along] / LEVELS).max(pixel / LEVELS);
    // The picture of a closed block would otherwise mix its front with its back, because few points are seen.
    let of_cell = |point: &[f64; 3]| {
        let [x, y] = [across, down].map(|axis| (point[axis] - low[axis]) / pixel / CELL);
        (x as usize, y as usize)
    };
    let (cells_x, cells_y) = of_cell(&high);
    let mut highest = Grid::new(cells_x + 1, cells_y + 1, f64::NEG_INFINITY);
    for point in &points {
        let (x, y) = of_cell(point);
        highest.set(x, y, highest.at(x, y).max(point[along]));
    }
    let is_front = |point: &&[f64; 3]| {
        let (x, y) = of_cell(point);
        point[along] > highest.at(x, y) - LAYER * pixel
    };
    for point in points.iter().filter(is_front) {
        let at = |axis: usize| point[axis] - low[axis];
        let [x, y] = [across, down].map(|axis| (at(axis) / pixel).floor());
        let level = (at(along) / per_level).round() + 1.0;
        let is_inside = (0.0..width as f64).contains(&x)
            && (0.0..height as f64).contains(&y)
            && (1.0..=LEVELS + 1.0).contains(&level);
        if is_inside {
            let (x, y) = (x as usize, y as usize);
            levels.set(x, y, levels.at(x, y).max(level as u16));
        }
    }
    for _ in 0..FILLS {
        levels = filled(&levels);
    }
    Some(shaded(&levels, per_level / pixel))
}

/// Returns heights with the mean of the known ones beside each gap.
fn filled(levels: &Grid<u16>) -> Grid<u16> {
    Grid::from_fn(levels.width(), levels.height(), |x, y| {
        let own = levels.at(x, y);
        if own > 0 {
            return own;
        }
        let beside = [[-1, 0], [1, 0], [0, -1], [0, 1]];
        let known = beside.map(|[dx, dy]| levels.get(x as i64 + dx, y as i64 + dy).unwrap_or(0));
        let count = known.iter().filter(|level| **level > 0).count() as u32;
        let sum: u32 = known.iter().map(|level| u32::from(*level)).sum();
        sum.checked_div(count).unwrap_or(0) as u16
    })
}

#[cfg(test)]
mod tests {
    use super::{page_with_boxes, points_from_above};
    use crate::pictures::VERMILLION;
    use mocban_core::raster::{Grid, ImageLimits, decode, png_rgb8};

    #[test]
    fn boxes_of_labels_are_drawn_on_a_smaller_page() {
        let white = png_rgb8(&Grid::new(400, 200, [255; 3]));
        let page = decode(&white, &ImageLimits::SUGGESTED).expect("a page");
        let picture = page_with_boxes(&page, &[[99.5, 49.5, 199.5, 149.5]], 200);
        assert_eq!((picture.width(), picture.height()), (200, 100));
        assert_eq!(picture.at(50, 25), VERMILLION);
        assert_eq!(picture.at(75, 50), [255; 3], "inside");
        let small = page_with_boxes(&page, &[[99.5, 49.5, 199.5, 149.5]], 50);
        assert_eq!((small.width(), small.height()), (50, 25));
        assert_eq!(small.at(13, 10), VERMILLION);
        let whole = page_with_boxes(&page, &[], 1000);
        assert_eq!((whole.width(), whole.height()), (400, 200), "never larger");
    }

    #[test]
    fn the_back_of_a_closed_block_is_not_seen() {
        // Only every second row of the front and of the back is there, as in samples of a file.
        let front = |x: u16, y: u16| [f32::from(x), f32::from(y), 30.0];
        let back = |x: u16, y: u16| [f32::from(x), f32::from(y) + 1.0, 0.0];
        let rows = || {
            (0..200)
                .step_by(2)
                .flat_map(|y| (0..200).map(move |x| (x, y)))
        };
        let open: Vec<_> = rows()
            .map(|(x, y)| front(x, y))
            .chain([[100.0, 201.0, 0.0]])
            .collect();
        let closed: Vec<_> = open
            .iter()
            .copied()
            .chain(rows().map(|(x, y)| back(x, y)))
            .collect();
        let [open, closed] =
            [open, closed].map(|points| points_from_above(&points, 200).expect("a picture"));
        let differing = (50..150)
            .flat_map(|y| (50..150).map(move |x| (x, y)))
            .filter(|(x, y)| open.at(*x, *y) != closed.at(*x, *y));
        assert_eq!(differing.count(), 0);
    }

    #[test]
    fn points_are_seen_along_the_shortest_side() {
        let plate: Vec<[f32; 3]> = (0..40_000)
            .map(|k: u16| {
                let (x, z) = (f32::from(k % 200), f32::from(k / 200));
                [x, if x < 100.0 { 0.0 } else { 5.0 }, z / 2.0]
            })
            .collect();
        let picture = points_from_above(&plate, 100).expect("a picture");
        assert_eq!(picture.width(), 100);
        assert!((49..=51).contains(&picture.height()));
        let [low, high] = [20, 80].map(|x| picture.at(x, 25)[0]);
        assert!(low < high, "{low} {high}");
        assert_eq!(points_from_above(&plate[..3], 100), None);
        assert_eq!(points_from_above(&[[1.0; 3]; 20], 100), None);
    }
}
