//! The position of each character on the face, and the evidence for it.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::agreement::Support;
use super::align::CarvedFace;
use super::bounds::bounds;
use super::field::ShiftField;
use super::page_ink::PageInk;
use super::page_map::PageMap;
use super::window_images::{ShrunkRelief, WarpedInk, Window};
use super::windows::{WindowMatch, match_window};
use mocban_core::domain::cancel::ThreadToken;

/// Margin around a character's box whose relief and ink are compared, mm.
const MARGIN_MM: f64 = 0.8;
/// Largest shift of a character against the map, mm.
const REACH_MM: f64 = 1.0;
/// Characters with at least this correlation refine the map.
const SURE_NCC: f64 = 0.6;
/// Distances over which the shifts of characters are smoothed, mm.
const SIGMA_MM: f64 = 30.0;
const FINE_SIGMA_MM: f64 = 9.0;
/// Values at which the confidence is 0 and 1.
const NCC_RAMP: [f64; 2] = [0.35, 0.75];
const SHIFT_RAMP_MM: [f64; 2] = [0.8, 0.3];
const SUPPORT_RAMP: [f64; 2] = [0.4, 0.8];
/// Boxes with a smaller side are not compared, mm.
const MIN_SIDE_MM: f64 = 1.0;

/// A character's box on the page.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CharacterBox {
    /// Name within the block.
    pub name: String,
    /// The character, if it is known.
    pub text: Option<String>,
    /// Left, top, right and bottom edge on the page, pixels; (0, 0) is the centre of the first pixel.
    pub page_box: [f64; 4],
}

/// A character on the face.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlacedCharacter {
    /// The box on the page.
    #[serde(flatten)]
    pub label: CharacterBox,
    /// Smallest and largest u and v of the box on the face, mm: `[u0, v0, u1, v1]`.
    pub face_box: [f64; 4],
    /// Correlation of relief and ink at the position; 0 if there is too little of either.
    pub ncc: f64,
    /// Shift of the character's own ink against the map, mm.
    pub shift_mm: [f64; 2],
    /// Fraction of the places around the character that agree, 0..=1.
    pub support: f64,
    /// How sure the position is, 0..=1: by its own correlation and by the places around it.
    pub confidence: f64,
}

/// Characters and the map that was refined by them.
#[derive(Debug, Clone)]
pub struct PlacedCharacters {
    /// The refined map of the face to the page.
    pub map: PageMap,
    /// The characters, in the order of the boxes.
    pub characters: Vec<PlacedCharacter>,
}

/// Places characters on the face: refines the map by them, and compares relief and ink of each.
pub fn place_characters(
    side: &CarvedFace,
    page: &PageInk,
    alignment: (&PageMap, &Support),
    boxes: &[CharacterBox],
) -> PlacedCharacters {
    let (map, support) = alignment;
    let relief = ShrunkRelief::of(&side.map, &side.relief, 1);
    let first = matches(&relief, page, map, boxes);
    let sure: Vec<WindowMatch> = (first.iter().flatten().copied())
        .filter(|window| window.ncc >= SURE_NCC)
        .collect();
    let map = match ShiftField::fit(&sure, SIGMA_MM, Some(FINE_SIGMA_MM)) {
        Some(field) => map.shifted(&field.at_all(&map.node_positions())),
        None => map.clone(),
    };
    let second = matches(&relief, page, &map, boxes);
    let characters = boxes
        .iter()
        .zip(second)
        .map(|(label, window)| {
            let face_box = face_box(&map, label.page_box);
            let middle = [0, 1].map(|k: usize| f64::midpoint(face_box[k], face_box[k + 2]));
            let ncc = window.map_or(0.0, |window| window.ncc.max(0.0));
            let shift_mm = window.map_or([0.0; 2], |window| window.shift);
            let support = support.at(middle);
            PlacedCharacter {
                label: label.clone(),
                face_box,
                ncc,
                shift_mm,
                support,
                confidence: confidence(ncc, shift_mm, support),
            }
        })
        .collect();
    PlacedCharacters { map, characters }
}

/// Returns the product of three ramps: the character's own correlation, the distance of its ink from the map, and the
/// agreement of the places around it.
fn confidence(ncc: f64, shift_mm: [f64; 2], support: f64) -> f64 {
    let ramp =
        |value: f64, [none, full]: [f64; 2]| ((value - none) / (full - none)).clamp(0.0, 1.0);
    ramp(ncc, NCC_RAMP)
        * ramp(shift_mm[0].hypot(shift_mm[1]), SHIFT_RAMP_MM)
        * ramp(support, SUPPORT_RAMP)
}

/// Compares relief and ink of each character.
fn matches(
    relief: &ShrunkRelief,
    page: &PageInk,
    map: &PageMap,
    boxes: &[CharacterBox],
) -> Vec<Option<WindowMatch>> {
    let reach = (REACH_MM / relief.pixel_mm).ceil() as usize;
    let warped = WarpedInk::of(relief, page, map, WarpedInk::border_for(reach));
    let token = ThreadToken::current();
    let match_box = |label: &CharacterBox| {
        let window = relief.window(face_box(map, label.page_box), MARGIN_MM)?;
        match_window(relief, &warped, window, reach)
    };
    boxes
        .par_iter()
        .map(|label| token.scope(|| match_box(label)))
        .collect()
}

/// Returns the bounding box on the face of a box on the page, mm.
pub(super) fn face_box(map: &PageMap, [left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
    let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
    bounds(corners.map(|corner| map.face_from_page(corner)))
}

impl ShrunkRelief {
    /// Returns the pixels of a box in mm with a margin; `None` if it is mostly outside the height map or tiny.
    fn window(&self, face_box: [f64; 4], margin_mm: f64) -> Option<Window> {
        let size = [self.soft.width(), self.soft.height()];
        let mut window = Window {
            first: [0; 2],
            size: [0; 2],
        };
        for k in 0..2 {
            let (low, high) = (face_box[k], face_box[k + 2]);
            let pixel = |at: f64| ((at - self.origin_mm[k]) / self.pixel_mm).round();
            let last = size[k] as f64 - 1.0;
            let (from, to) = (pixel(low - margin_mm), pixel(high + margin_mm));
            let (from, to) = (from.clamp(0.0, last), to.clamp(0.0, last));
            if high - low < MIN_SIDE_MM || (to - from) * self.pixel_mm < (high - low) / 2.0 {
                return None;
            }
            window.first[k] = from as usize;
            window.size[k] = (to - from) as usize + 1;
        }
        Some(window)
    }
}
