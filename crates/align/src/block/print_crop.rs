//! Cuts the print of a character out of its page.

use mocban_core::domain::{Affine2, BoxName};
use mocban_core::raster::{Grid, PrintImage};

/// The print of one character, cut out of its page.
#[derive(Debug, Clone)]
pub struct PrintCrop {
    /// 8-bit colours, turned by quarter turns.
    pub rgb: Grid<[u8; 3]>,
    /// Maps pixels of the crop to pixels of the page.
    pub page_from_crop: Affine2,
}

/// Returns the number of quarter turns, from x to y, by which a page is turned against its reading direction: 0 if its
/// rows follow each other downwards. `places` are the names of boxes by column and row, with their edges on the page.
pub fn reading_turns(places: &[(BoxName, [f64; 4])]) -> u8 {
    let middle = |[left, top, right, bottom]: [f64; 4]| [left + right, top + bottom];
    let mut along = [0.0; 2];
    for (row, next) in places.iter().zip(places.iter().skip(1)) {
        if row.0.column == next.0.column && row.0.row < next.0.row {
            let [from, to] = [middle(row.1), middle(next.1)];
            along = [0, 1].map(|k: usize| along[k] + to[k] - from[k]);
        }
    }
    let [x, y] = along;
    match (x.abs() > y.abs(), x < 0.0, y < 0.0) {
        (true, true, _) => 1,
        (false, _, true) => 2,
        (true, false, _) => 3,
        (false, _, false) => 0,
    }
}

/// Cuts the print of one box out of a page, with a margin in pixels. `quarter_turns` is the number of quarter turns from
/// x to y by which the page is turned. Returns `None` if the box lies outside the page.
pub fn cut_print(
    page: &PrintImage,
    [left, top, right, bottom]: [f64; 4],
    margin_px: f64,
    quarter_turns: u8,
) -> Option<PrintCrop> {
    let rgb = &page.rgb;
    let range = |low: f64, high: f64, count: usize| {
        let first = (low - margin_px).round().max(0.0);
        let last = (high + margin_px).round().min(count as f64 - 1.0);
        (last >= first).then(|| (first as usize, (last - first) as usize + 1))
    };
    let (x0, width) = range(left, right, rgb.width())?;
    let (y0, height) = range(top, bottom, rgb.height())?;
    let (w, h) = (width as f64 - 1.0, height as f64 - 1.0);
    let (x, y) = (x0 as f64, y0 as f64);
    // Upright pixels (i, j) to pixels of the page.
    let (size, map) = match quarter_turns % 4 {
        0 => ([width, height], [[1.0, 0.0, x], [0.0, 1.0, y]]),
        1 => ([height, width], [[0.0, -1.0, x + w], [1.0, 0.0, y]]),
        2 => ([width, height], [[-1.0, 0.0, x + w], [0.0, -1.0, y + h]]),
        _ => ([height, width], [[0.0, 1.0, x], [-1.0, 0.0, y + h]]),
    };
    let page_from_crop = Affine2(map);
    let pixel = |i: usize, j: usize| {
        let [x, y] = page_from_crop.apply([i as f64, j as f64]);
        rgb.at(x as usize, y as usize).map(|c| (c >> 8) as u8)
    };
    Some(PrintCrop {
        rgb: Grid::from_fn(size[0], size[1], pixel),
        page_from_crop,
    })
}

#[cfg(test)]
mod tests {
    use super::{cut_print, reading_turns};
    use mocban_core::domain::BoxName;
    use mocban_core::raster::{Grid, PrintImage};

    #[test]
    fn pages_are_turned_by_the_direction_of_their_rows() {
        // Columns from right to left and rows downwards on an upright page of 100 x 100 pixels, turned as `turned` says.
        let places = |turned: fn([f64; 2]) -> [f64; 2]| -> Vec<(BoxName, [f64; 4])> {
            let place = |k: u32| {
                let (column, row) = (k / 4 + 1, k % 4 + 1);
                let name = BoxName {
                    column,
                    row,
                    part: None,
                };
                let [x, y] = turned([90.0 - 20.0 * f64::from(column), 20.0 * f64::from(row)]);
                (name, [x - 5.0, y - 6.0, x + 5.0, y + 6.0])
            };
            (0..12).map(place).collect()
        };
        assert_eq!(reading_turns(&places(|at| at)), 0);
        assert_eq!(reading_turns(&places(|[x, y]| [100.0 - y, x])), 1);
        assert_eq!(reading_turns(&places(|[x, y]| [100.0 - x, 100.0 - y])), 2);
        assert_eq!(reading_turns(&places(|[x, y]| [y, 100.0 - x])), 3);
        assert_eq!(reading_turns(&[]), 0);
    }

    #[test]
    fn prints_are_turned_upright_and_keep_their_place() {
        let rgb = Grid::from_fn(90, 70, |x, y| [(x as u16) << 8, (y as u16) << 8, 0]);
        let page = PrintImage::from(rgb);
        for turns in 0..4 {
            let crop = cut_print(&page, [20.0, 30.0, 49.0, 39.0], 2.0, turns).unwrap();
            let upright = turns % 2 == 0;
            let size = [crop.rgb.width(), crop.rgb.height()];
            assert_eq!(size, if upright { [34, 14] } else { [14, 34] });
            for (x, y) in [(0, 0), (5, 3), (size[0] - 1, size[1] - 1)] {
                let [px, py] = crop.page_from_crop.apply([x as f64, y as f64]);
                assert_eq!(crop.rgb.at(x, y), [px as u8, py as u8, 0], "{turns} turns");
            }
        }
        assert!(cut_print(&page, [200.0, 30.0, 230.0, 39.0], 2.0, 0).is_none());
    }
}
