//! Local shifts between the relief of a face and the ink of its page: normalized cross-correlation of windows.

use rayon::prelude::*;

use super::page_ink::PageInk;
use super::page_map::PageMap;
use super::window_images::{ShrunkRelief, WarpedInk, Window};
use super::window_template::WindowTemplate;
use mocban_core::domain::cancel::ThreadToken;

/// Sizes of one round of windows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WindowSizes {
    /// Pixels of the height map per pixel of the windows.
    pub(super) shrink: usize,
    /// Side of a window, mm.
    pub(super) side_mm: f64,
    /// Distance between the middles of windows, mm.
    pub(super) step_mm: f64,
    /// Largest shift, mm.
    pub(super) reach_mm: f64,
}

/// The best shift of one window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowMatch {
    /// Middle of the window on the face, mm.
    pub at: [f64; 2],
    /// Shift of the ink against the relief, mm: the relief at `at` is printed where the map has `at + shift`.
    pub shift: [f64; 2],
    /// Normalized cross-correlation at this shift, at most 1.
    pub ncc: f64,
    /// How sharply the correlation falls along x and y, and its mixed derivative, per pixel squared.
    pub curvature: [f64; 3],
}

/// Finds the best shifts of windows on a regular grid over the face. Windows with too little face, page or relief are
/// left out.
pub(super) fn match_windows(
    relief: &ShrunkRelief,
    page: &PageInk,
    map: &PageMap,
    sizes: &WindowSizes,
) -> Vec<WindowMatch> {
    let Some([left, top, right, bottom]) = relief.face_bounds() else {
        return Vec::new();
    };
    let reach = (sizes.reach_mm / relief.pixel_mm).ceil() as usize;
    let warped = WarpedInk::of(relief, page, map, WarpedInk::border_for(reach));
    let half = (sizes.side_mm / relief.pixel_mm / 2.0).round() as usize;
    // Windows hang over the edges of the face by half of their size at most.
    let middles = |first: usize, last: usize| {
        let step = sizes.step_mm / relief.pixel_mm;
        let count = ((last - first) as f64 / step).round().max(1.0);
        (0..=count as usize)
            .map(move |k| first + (k as f64 * (last - first) as f64 / count).round() as usize)
    };
    let windows: Vec<Window> = middles(top, bottom)
        .flat_map(|y| middles(left, right).map(move |x| [x, y]))
        .map(|[x, y]| {
            let clip =
                |at: usize, count: usize| (at.saturating_sub(half), (at + half + 1).min(count));
            let (x0, x1) = clip(x, relief.soft.width());
            let (y0, y1) = clip(y, relief.soft.height());
            Window {
                first: [x0, y0],
                size: [x1 - x0, y1 - y0],
            }
        })
        .collect();
    let token = ThreadToken::current();
    windows
        .par_iter()
        .filter_map(|window| token.scope(|| match_window(relief, &warped, *window, reach)))
        .collect()
}

/// Finds the best shift of one window, at most `reach` pixels along each axis.
pub(super) fn match_window(
    relief: &ShrunkRelief,
    warped: &WarpedInk,
    window: Window,
    reach: usize,
) -> Option<WindowMatch> {
    let template = WindowTemplate::of(relief, warped, window)?;
    let side = 2 * reach + 1;
    let scores = template.scores(warped, window, reach);
    let best = (0..side * side).max_by(|a, b| scores[*a].total_cmp(&scores[*b]))?;
    let (x, y) = (best % side, best / side);
    let at = |dx: i64, dy: i64| {
        let x = (x as i64 + dx).clamp(0, side as i64 - 1) as usize;
        let y = (y as i64 + dy).clamp(0, side as i64 - 1) as usize;
        f64::from(scores[y * side + x])
    };
    let ncc = at(0, 0);
    let xx = 2.0 * ncc - at(-1, 0) - at(1, 0);
    let yy = 2.0 * ncc - at(0, -1) - at(0, 1);
    let xy = (at(1, -1) + at(-1, 1) - at(1, 1) - at(-1, -1)) / 4.0;
    let parabola = |before: f64, after: f64, curvature: f64| {
        if curvature > 1e-9 {
            ((after - before) / (2.0 * curvature)).clamp(-0.5, 0.5)
        } else {
            0.0
        }
    };
    let offset = [
        x as f64 - reach as f64 + parabola(at(-1, 0), at(1, 0), xx),
        y as f64 - reach as f64 + parabola(at(0, -1), at(0, 1), yy),
    ];
    Some(WindowMatch {
        at: template.centre,
        shift: offset.map(|pixels| pixels * relief.pixel_mm),
        ncc,
        curvature: [xx, yy, xy],
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_world::shifted_world;
    use super::super::window_images::{ShrunkRelief, WarpedInk, Window};
    use super::{WindowSizes, match_window, match_windows};

    const SIZES: WindowSizes = WindowSizes {
        shrink: 2,
        side_mm: 18.0,
        step_mm: 20.0,
        reach_mm: 1.5,
    };

    #[test]
    fn windows_find_the_shift_to_a_fifth_of_a_pixel() {
        let (relief, page, map) = shifted_world(SIZES.shrink);
        let windows = match_windows(&relief, &page, &map, &SIZES);
        assert!(windows.len() > 30);
        for window in windows {
            let [dx, dy] = [window.shift[0] - 0.62, window.shift[1] + 0.47];
            assert!(dx.hypot(dy) < 0.06, "{window:?}");
            assert!(window.ncc > 0.8, "{window:?}");
        }
    }

    #[test]
    fn a_window_without_relief_has_no_match() {
        let (relief, page, map) = shifted_world(SIZES.shrink);
        let empty = ShrunkRelief {
            soft: relief.soft.map(|_| 0.0),
            ..relief
        };
        let warped = WarpedInk::of(&empty, &page, &map, WarpedInk::border_for(3));
        let window = Window {
            first: [50, 50],
            size: [40, 40],
        };
        assert!(match_window(&empty, &warped, window, 3).is_none());
    }
}
