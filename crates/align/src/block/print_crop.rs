//! Cuts the print of a character out of its page.

use mocban_core::domain::Affine2;
use mocban_core::raster::{Grid, PrintImage};

/// The print of one character, cut out of its page.
#[derive(Debug, Clone)]
pub struct PrintCrop {
    /// 8-bit colours, turned by quarter turns so that the character is upright.
    pub rgb: Grid<[u8; 3]>,
    /// Maps pixels of the crop to pixels of the page.
    pub page_from_crop: Affine2,
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
    use super::cut_print;
    use mocban_core::raster::{Grid, PrintImage};

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
