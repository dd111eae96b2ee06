//! The direction in which a page is read.
//!
//! The sharpest projections near the axes of the page give the angle of the text up to quarter turns. Long rules inside
//! the frame run along the columns; without them, the gaps between columns are wider than those between rows. Which end
//! of the columns is the top is decided by the characters: their lower corners hold more ink than their upper ones,
//! because falling strokes and feet spread there (in a Song typeface by 4 to 10 standard errors for 200 characters). A
//! page that would be upright in its image is only turned over by clear evidence.

use std::f64::consts::FRAC_PI_2;

use super::layout::Layout;
use super::places::{CharacterPlace, Strokes};
use super::skew::text_angle;
use super::text_image::{TextFrame, TextImage};
use crate::block::align::CarvedFace;
use crate::block::height_map::HEIGHT_STEP_MM;
use crate::block::page_ink::PageInk;
use crate::block::page_map::PageMap;
use mocban_core::raster::Mask;

/// Total length of inner rules that decides alone, mm.
const SURE_RULES_MM: f64 = 150.0;
/// A profile below this fraction of its mean is a gap. Profiles are those of squares of this side, so that a page with
/// few characters has gaps between them and not only beside all of them.
const GAP_INK: f64 = 0.25;
const GAP_WINDOW_MM: f64 = 45.0;
/// The fraction of gaps along the image must be larger by this to turn the text.
const SURE_GAPS: f64 = 0.05;
/// Side of the corners of a character, in its size.
const CORNER: f64 = 0.22;
/// Standard errors at which the corners turn a page over that is upright in its image.
const SURE_ERRORS: f64 = 3.0;
/// Fewest characters that decide.
const MIN_CHARACTERS: usize = 8;

/// The text of a page with columns along y. It may still be upside down.
pub(super) struct Upright {
    pub(super) image: TextImage,
    pub(super) layout: Layout,
    /// Whether x runs to the right in the image of the page, and not up or down.
    pub(super) is_as_on_page: bool,
}

impl Upright {
    /// Samples a page so that its columns run along y.
    pub(super) fn of(face: &CarvedFace, page: &PageInk, map: &PageMap) -> Self {
        let soft = &face.relief.soft;
        let middle = [
            face.map.origin_mm[0] + soft.width() as f64 / 2.0 * HEIGHT_STEP_MM,
            face.map.origin_mm[1] + soft.height() as f64 / 2.0 * HEIGHT_STEP_MM,
        ];
        // Text that runs to the right on the page runs against the rotation of the map on the face.
        let angle = text_angle(face, -map.angle_at(middle));
        let sample = |angle: f64, is_as_on_page: bool| {
            let frame = TextFrame::around(face, angle);
            let image = TextImage::sample(face, page, map, frame);
            Self {
                layout: Layout::of(&image),
                image,
                is_as_on_page,
            }
        };
        let straight = sample(angle, true);
        if runs_along_x(&straight.layout) {
            sample(angle + FRAC_PI_2, false)
        } else {
            straight
        }
    }

    /// Returns whether the characters stand on their heads.
    pub(super) fn is_upside_down(&self, places: &[CharacterPlace], strokes: &[Strokes]) -> bool {
        let limit = if self.is_as_on_page {
            -SURE_ERRORS
        } else {
            0.0
        };
        let characters = places.iter().zip(strokes);
        let full = characters.filter(|(place, strokes)| place.half.is_none() && strokes.area > 0);
        let bounds: Vec<[f64; 4]> = full.map(|(_, strokes)| strokes.bounds).collect();
        standing(&self.layout.rules.text, &bounds) < limit
    }
}

/// Returns whether columns run along x.
fn runs_along_x(layout: &Layout) -> bool {
    let [along_y, along_x] = layout.rule_lengths_mm;
    if (along_y - along_x).abs() >= SURE_RULES_MM {
        return along_x > along_y;
    }
    let [across, along] = layout.gaps(GAP_INK, GAP_WINDOW_MM);
    along > across + SURE_GAPS
}

/// Returns how much more ink the lower corners of characters hold than the upper ones, in standard errors; 0 for few
/// characters.
fn standing(text: &Mask, bounds: &[[f64; 4]]) -> f64 {
    let mut sizes: Vec<f64> = bounds
        .iter()
        .map(|b| (b[2] - b[0]).min(b[3] - b[1]))
        .collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let full = bounds
        .iter()
        .filter(|b| (b[2] - b[0]).min(b[3] - b[1]) > 0.7 * usual);
    let differences: Vec<f64> = full.map(|bounds| corners(text, bounds)).collect();
    let count = differences.len();
    if count < MIN_CHARACTERS {
        return 0.0;
    }
    let mean = differences.iter().sum::<f64>() / count as f64;
    let squares: f64 = differences.iter().map(|d| (d - mean) * (d - mean)).sum();
    let error = (squares / count as f64 / count as f64).sqrt();
    mean / error.max(1e-9)
}

/// Returns the fraction of the lower corners of a box that is inked minus that of the upper ones.
fn corners(text: &Mask, bounds: &[f64; 4]) -> f64 {
    let [left, top, right, bottom] = bounds.map(|edge| (edge + 0.5) as usize);
    let size = |from: usize, to: usize| (((to - from) as f64 * CORNER) as usize).max(1);
    let (across, down) = (size(left, right), size(top, bottom));
    let ink = |from: usize| {
        let count = |row: usize, from: usize| {
            let part = &text.row(row)[from..from + across];
            part.iter().filter(|set| **set).count()
        };
        let rows = from..from + down;
        rows.map(|row| count(row, left) + count(row, right - across))
            .sum::<usize>() as f64
    };
    (ink(bottom - down) - ink(top)) / (2 * across * down) as f64
}
