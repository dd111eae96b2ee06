//! Finds the side of a block and the map of its face to a page, or refuses.

use super::agreement::{self, Agreement, Support};
use super::coarse::{self, CoarsePosition, CoarseRange};
use super::error::BlockError;
use super::field::ShiftField;
use super::height_map::{HEIGHT_STEP_MM, HeightMap};
use super::page_ink::PageInk;
use super::page_map::PageMap;
use super::relief::Relief;
use super::stored_heights::StoredHeights;
use super::window_images::ShrunkRelief;
use super::windows::{WindowSizes, match_windows};
use mocban_core::raster::Grid;

/// Rotations of the page against the outline of the face that are searched, apart from quarter turns: up to this angle,
/// degrees.
const MAX_ANGLE_DEG: f64 = 6.0;
/// Rotations of the search in which the outline of the face says nothing: all.
const ALL_ANGLES_DEG: f64 = 45.0;
/// Step of rotations, degrees.
const ANGLE_STEP_DEG: f64 = 1.5;
/// Scales that are searched, in relation to the one at which ink and strokes have the same extent.
const SCALE_RATIOS: [f64; 9] = [0.88, 0.91, 0.94, 0.97, 1.0, 1.03, 1.06, 1.09, 1.12];
/// Scales of the second search, page pixels per mm, and the ratio of two neighbours.
const WIDE_SCALES: [f64; 2] = [4.0, 30.0];
const WIDE_RATIO: f64 = 1.035;
/// Positions of each side that are compared by windows.
const CANDIDATES: usize = 5;
/// Windows that compare positions, and the distance over which their shifts are smooth, mm.
const COMPARED: WindowSizes = sizes(6, 50.0, 36.0, 8.0);
const COMPARED_SIGMA_MM: f64 = 80.0;
/// Windows that are farther from the field count nothing in the comparison, mm.
const COMPARED_MM: f64 = 2.0;
/// Window sizes of the rounds.
const ROUNDS: [(WindowSizes, f64, Option<f64>); 5] = [
    (sizes(6, 50.0, 20.0, 9.0), 60.0, None),
    (sizes(3, 32.0, 13.0, 3.5), 45.0, None),
    (sizes(3, 26.0, 9.0, 2.0), 45.0, Some(20.0)),
    (sizes(2, 18.0, 7.0, 1.2), 45.0, Some(14.0)),
    (sizes(2, 14.0, 6.0, 0.9), 45.0, Some(12.0)),
];
const fn sizes(shrink: usize, side_mm: f64, step_mm: f64, reach_mm: f64) -> WindowSizes {
    WindowSizes {
        shrink,
        side_mm,
        step_mm,
        reach_mm,
    }
}

/// The face on one side of a block.
#[derive(Debug, Clone)]
pub struct CarvedFace {
    /// Heights.
    pub map: HeightMap,
    /// Strokes.
    pub relief: Relief,
}

impl CarvedFace {
    /// Computes the relief of stored heights; `None` if no surface fits them.
    pub fn of(stored: &StoredHeights) -> Option<Self> {
        let map = HeightMap::from(stored);
        let relief = Relief::of(&map)?;
        Some(Self { map, relief })
    }
}

/// A page on a face of a block.
#[derive(Debug, Clone)]
pub struct PageAlignment {
    /// Map of the face to the page.
    pub map: PageMap,
    /// Evidence.
    pub agreement: Agreement,
    /// Where on the face the page agrees.
    pub support: Support,
}

/// What is searched for coarse positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CoarseSearch {
    /// The whole page, nearly parallel to the outline of the face.
    Narrow,
    /// A page that shows only a part of the face, or more than the face: any resolution.
    AllScales,
    /// A face with an outline that is no rectangle: any rotation.
    AllAngles,
}

impl CoarseSearch {
    /// Returns the rotations and scales for one side.
    fn range(self, side: &CarvedFace, relief: &ShrunkRelief, page: &PageInk) -> CoarseRange {
        let max_angle_deg = match self {
            Self::Narrow | Self::AllScales => MAX_ANGLE_DEG,
            Self::AllAngles => ALL_ANGLES_DEG,
        };
        let steps = (max_angle_deg / ANGLE_STEP_DEG) as i32;
        let angle =
            |step: i32| f64::from(step) * ANGLE_STEP_DEG.to_radians() - side.relief.angle_rad;
        let scales = if self == Self::AllScales {
            let count = (WIDE_SCALES[1] / WIDE_SCALES[0]).ln() / WIDE_RATIO.ln();
            (0..=count as i32)
                .map(|k| WIDE_SCALES[0] * WIDE_RATIO.powi(k))
                .collect()
        } else {
            expected_scale(relief, page)
                .map(|scale| SCALE_RATIOS.map(|ratio| ratio * scale).to_vec())
                .unwrap_or_default()
        };
        CoarseRange {
            angle_rad: side.relief.angle_rad,
            angles: (-steps..=steps).map(angle).collect(),
            scales,
            min_overlap: if self == Self::AllScales { 0.3 } else { 0.6 },
            count: if self == Self::AllScales {
                2 * CANDIDATES
            } else {
                CANDIDATES
            },
        }
    }
}

/// A position while it is refined.
struct PageCandidate {
    side: usize,
    map: PageMap,
    quality: f64,
}

/// Aligns a page with the sides of a block. Returns the index of the side and the alignment.
///
/// # Errors
/// Returns an error if no side shows a face or the page does not belong to the block.
pub fn align(sides: &[&CarvedFace], page: &PageInk) -> Result<(usize, PageAlignment), BlockError> {
    if sides.is_empty() {
        return Err(BlockError::no_face());
    }
    let reliefs: Vec<ShrunkRelief> = sides.iter().map(|side| shrunk_face(side)).collect();
    let mut best: Option<(usize, PageAlignment)> = None;
    for search in [
        CoarseSearch::Narrow,
        CoarseSearch::AllScales,
        CoarseSearch::AllAngles,
    ] {
        let found = refined(sides, &reliefs, page, search);
        let quality = |found: &Option<(usize, PageAlignment)>| {
            let found = found.as_ref();
            found.map_or(-1.0, |(_, found)| found.agreement.quality())
        };
        if quality(&found) > quality(&best) {
            best = found;
        }
        let agreement = best.as_ref().map(|(_, best)| best.agreement);
        if agreement.is_some_and(|agreement| agreement.is_sure()) {
            break;
        }
    }
    match best {
        Some(best) if best.1.agreement.is_sure() => Ok(best),
        best => Err(BlockError::Refused {
            width_mm: sides[0].map.heights.width() as f64 * HEIGHT_STEP_MM,
            height_mm: sides[0].map.heights.height() as f64 * HEIGHT_STEP_MM,
            share: 100.0 * best.map_or(0.0, |(_, best)| best.agreement.agreeing),
        }),
    }
}

/// Searches coarse positions, chooses the one whose places agree best, and refines it. `reliefs` are the faces in the
/// pixels of the first round.
fn refined(
    sides: &[&CarvedFace],
    reliefs: &[ShrunkRelief],
    page: &PageInk,
    search: CoarseSearch,
) -> Option<(usize, PageAlignment)> {
    let mut best: Option<PageCandidate> = None;
    for (side, (block, relief)) in sides.iter().zip(reliefs).enumerate() {
        for position in coarse::search(relief, page, &search.range(block, relief, page)) {
            let Some(candidate) = first_round(side, relief, page, &position) else {
                continue;
            };
            if best
                .as_ref()
                .is_none_or(|best| candidate.quality > best.quality)
            {
                best = Some(candidate);
            }
        }
    }
    let PageCandidate { side, map, .. } = best?;
    Some((side, refine(sides[side], &reliefs[side], page, map)?))
}

/// Returns a face in the pixels of the first round.
pub(super) fn shrunk_face(face: &CarvedFace) -> ShrunkRelief {
    ShrunkRelief::of(&face.map, &face.relief, ROUNDS[0].0.shrink)
}

/// Follows the strokes from a first map in rounds of ever smaller windows. `relief` is the face in the pixels of the first
/// round. Returns `None` if too few windows match.
pub(super) fn refine(
    face: &CarvedFace,
    relief: &ShrunkRelief,
    page: &PageInk,
    mut map: PageMap,
) -> Option<PageAlignment> {
    let mut last = None;
    let mut shrunk = ROUNDS[0].0.shrink;
    let mut relief = relief.clone();
    for (sizes, sigma, fine) in ROUNDS {
        if sizes.shrink != shrunk {
            shrunk = sizes.shrink;
            relief = ShrunkRelief::of(&face.map, &face.relief, shrunk);
        }
        let windows = match_windows(&relief, page, &map, &sizes);
        let field = ShiftField::fit(&windows, sigma, fine)?;
        map = map.shifted(&field.at_all(&map.node_positions()));
        last = Some((windows, field));
    }
    let (windows, field) = last?;
    let (agreement, support) = Agreement::of(&windows, &field);
    Some(PageAlignment {
        map,
        agreement,
        support,
    })
}

/// Refines a coarse position by one round of windows, and says how well they agree.
fn first_round(
    side: usize,
    relief: &ShrunkRelief,
    page: &PageInk,
    position: &CoarsePosition,
) -> Option<PageCandidate> {
    let mut map = relief.page_map(&position.page_from_face)?;
    let windows = match_windows(relief, page, &map, &COMPARED);
    let field = ShiftField::fit(&windows, COMPARED_SIGMA_MM, None)?;
    let quality = agreement::mean_near(&windows, &field, COMPARED_MM);
    map = map.shifted(&field.at_all(&map.node_positions()));
    Some(PageCandidate { side, map, quality })
}

/// Returns the scale at which the ink has the extent of the strokes, page pixels per mm.
fn expected_scale(relief: &ShrunkRelief, page: &PageInk) -> Option<f64> {
    let face = extent(&relief.soft)? * relief.pixel_mm;
    let ink = page.reduced(4);
    Some(extent(&ink)? * page.size()[0] as f64 / ink.width() as f64 / face)
}

/// Returns the geometric mean of the standard deviations of a distribution along its two axes, pixels.
fn extent(weights: &Grid<f32>) -> Option<f64> {
    let (mut all, mut x1, mut y1) = (0.0, 0.0, 0.0);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for y in 0..weights.height() {
        for (x, weight) in weights.row(y).iter().enumerate() {
            let (x, y, weight) = (x as f64, y as f64, f64::from(*weight));
            all += weight;
            x1 += weight * x;
            y1 += weight * y;
            xx += weight * x * x;
            yy += weight * y * y;
            xy += weight * x * y;
        }
    }
    if all <= 0.0 {
        return None;
    }
    let (x, y) = (x1 / all, y1 / all);
    let determinant = (xx / all - x * x) * (yy / all - y * y) - (xy / all - x * y).powi(2);
    (determinant > 0.0).then(|| determinant.powf(0.25))
}

#[cfg(test)]
mod tests {
    use super::super::test_world::{SIDES_MM, TestWorld};
    use super::{CarvedFace, PageAlignment, align};
    use crate::block::{BlockError, PageInk};
    use mocban_core::domain::Affine2;

    fn aligned(world: &TestWorld, page: &PageInk) -> Result<PageAlignment, BlockError> {
        let face: CarvedFace = world.face();
        align(&[&face], page).map(|(_, alignment)| alignment)
    }

    /// Returns the largest error of a map at points of the face, mm.
    fn error_mm(found: &PageAlignment, page_from_face: impl Fn([f64; 2]) -> [f64; 2]) -> f64 {
        let points = (1..10).flat_map(|x| (1..10).map(move |y| [x, y]));
        points
            .map(|[x, y]| {
                let face = [
                    f64::from(x) / 10.0 * SIDES_MM[0],
                    f64::from(y) / 10.0 * SIDES_MM[1],
                ];
                let (a, b) = (found.map.page_from_face(face), page_from_face(face));
                (a[0] - b[0]).hypot(a[1] - b[1]) / found.map.scale()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_turned_page_is_aligned_to_a_tenth_of_a_millimetre() {
        let world = TestWorld::new(1);
        for (quarter, size) in [(0, [1300, 900]), (1, [900, 1300]), (2, [1300, 900])] {
            let angle = f64::from(quarter) * std::f64::consts::FRAC_PI_2 + 0.05;
            let rotation = Affine2::similarity(7.6, angle, [0.0; 2]);
            let middle = rotation.apply(SIDES_MM.map(|side| side / 2.0));
            let shift = [0, 1].map(|k: usize| size[k] as f64 / 2.0 + 12.0 - middle[k]);
            let map = Affine2::similarity(7.6, angle, shift);
            let found = aligned(&world, &world.affine_page(size, &map)).unwrap();
            let error = error_mm(&found, |face| map.apply(face));
            assert!(error < 0.1, "{error} mm after {quarter} quarter turns");
            assert_eq!(found.map.quarter_turns(), quarter as u8);
        }
    }

    #[test]
    fn a_warped_page_is_followed() {
        let world = TestWorld::new(2);
        let warp = |[u, v]: [f64; 2]| {
            [
                8.0 * (u + 0.8 * (v / 20.0).sin()) + 40.0,
                8.0 * (v + 0.6 * (u / 25.0).cos()) + 30.0,
            ]
        };
        let page = world.page([1290, 880], |[x, y]| {
            let mut face = [(x - 40.0) / 8.0, (y - 30.0) / 8.0];
            for _ in 0..8 {
                let at = warp(face);
                face = [face[0] + (x - at[0]) / 8.0, face[1] + (y - at[1]) / 8.0];
            }
            face
        });
        let found = aligned(&world, &page).unwrap();
        let error = error_mm(&found, warp);
        assert!(error < 0.15, "{error} mm");
    }

    #[test]
    fn a_page_that_shows_half_of_the_face_is_aligned() {
        let world = TestWorld::new(3);
        let map = Affine2::scale_shift(9.0, [20.0, 20.0]);
        let half = world.affine_page([20 + 9 * 75, 940], &map);
        let found = aligned(&world, &half).unwrap();
        let at = [40.0, 50.0];
        let (a, b) = (found.map.page_from_face(at), map.apply(at));
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1.0);
        assert!(found.support.at(at) > 0.9);
    }

    #[test]
    fn the_page_of_another_block_is_refused() {
        let map = Affine2::scale_shift(8.0, [40.0, 40.0]);
        let page = TestWorld::new(5).affine_page([1280, 880], &map);
        let refused = aligned(&TestWorld::new(4), &page);
        assert!(matches!(refused, Err(BlockError::Refused { .. })));
    }

    #[test]
    fn a_mirrored_page_is_refused() {
        let world = TestWorld::new(6);
        let map = Affine2([[-8.0, 0.0, 1240.0], [0.0, 8.0, 40.0]]);
        let refused = aligned(&world, &world.affine_page([1280, 880], &map));
        assert!(matches!(refused, Err(BlockError::Refused { .. })));
    }
}
