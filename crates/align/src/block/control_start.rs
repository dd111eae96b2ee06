//! Aligns a page with a face from control points instead of a search.

use nalgebra::{Matrix4, Vector4};

use super::align::{CarvedFace, PageAlignment, refine, shrunk_face};
use super::page_ink::PageInk;
use mocban_core::domain::{Affine2, ControlPoint, ControlPoints};

/// Largest distance of a control point from the similarity of all, mm. Paper shrinks unevenly by about 2 %, which is
/// 3 mm on a long block; clicks are accurate to 1 mm.
const MAX_APART_MM: f64 = 8.0;
/// Least distance between the two control points farthest apart, mm.
const MIN_SPAN_MM: f64 = 40.0;

/// A point of the face (u, v in mm) and a pixel of the page.
type PointPair = ([f64; 2], [f64; 2]);

/// Why control points give no alignment.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ControlPointError {
    /// There are too few.
    #[error(
        "{count} control points are too few: choose at least {}",
        ControlPoints::MIN
    )]
    TooFew {
        /// How many.
        count: usize,
    },
    /// They are too near to each other.
    #[error(
        "the control points lie within {span_mm:.0} mm of each other: choose points that are at least {MIN_SPAN_MM} mm apart, \
         best near the corners of the text"
    )]
    TooNear {
        /// Largest distance of two points, mm.
        span_mm: f64,
    },
    /// They contradict each other. With three points, it cannot be said which one is wrong.
    #[error(
        "the control points contradict each other: no common position is nearer than {apart_mm:.0} mm to all of them; choose \
         them again on the same strokes of both images, or add a fourth one"
    )]
    Contradiction {
        /// Largest distance of a point from the common position, mm.
        apart_mm: f64,
    },
    /// One of them contradicts the others.
    #[error(
        "control point {number} contradicts the others, which put it {apart_mm:.0} mm away: choose it again on the same stroke \
         of both images"
    )]
    Outlier {
        /// Which one, from 1.
        number: usize,
        /// Its distance from the place where the others put it, mm.
        apart_mm: f64,
    },
    /// Relief and ink do not agree around the position that they give.
    #[error(
        "relief and ink do not agree at the control points: {share:.0} % of the places agree; choose points on the same \
         strokes of both images"
    )]
    NoAgreement {
        /// Percentage of places that agree.
        share: f64,
    },
}

/// Aligns a page with a face: starts at the similarity of the control points, and follows the strokes from there.
///
/// # Errors
/// Returns an error if the points are too few or too near, contradict each other, or relief and ink do not agree.
pub fn align_at(
    face: &CarvedFace,
    page: &PageInk,
    points: &[ControlPoint],
) -> Result<PageAlignment, ControlPointError> {
    let pairs: Vec<PointPair> = (points.iter())
        .map(|point| {
            let [u, v, _] = face.map.frame.face_from_mesh(point.mesh);
            ([u, v], point.page)
        })
        .collect();
    let start = similarity(&pairs)?;
    let relief = shrunk_face(face);
    let map = relief.page_map(&start);
    let found = map.and_then(|map| refine(face, &relief, page, map));
    match found {
        Some(alignment) if alignment.agreement.is_sure_where_given() => Ok(alignment),
        found => Err(ControlPointError::NoAgreement {
            share: 100.0 * found.map_or(0.0, |found| found.agreement.agreeing),
        }),
    }
}

/// Fits the similarity from the face (mm) to the page (pixels), and checks that all points agree with it.
fn similarity(pairs: &[PointPair]) -> Result<Affine2, ControlPointError> {
    if pairs.len() < ControlPoints::MIN {
        return Err(ControlPointError::TooFew { count: pairs.len() });
    }
    let spans = (pairs.iter()).flat_map(|(a, _)| pairs.iter().map(|(b, _)| distance(*a, *b)));
    let span_mm = spans.fold(0.0, f64::max);
    let too_near = ControlPointError::TooNear { span_mm };
    if span_mm < MIN_SPAN_MM {
        return Err(too_near);
    }
    let map = fitted(pairs).ok_or(too_near)?;
    let apart_mm = farthest(&map, pairs);
    if apart_mm <= MAX_APART_MM {
        return Ok(map);
    }
    Err(outlier(pairs).unwrap_or(ControlPointError::Contradiction { apart_mm }))
}

/// Returns the error of the one point that contradicts the others; `None` with three points, or if no point does alone.
fn outlier(pairs: &[PointPair]) -> Option<ControlPointError> {
    if pairs.len() == ControlPoints::MIN {
        return None;
    }
    let without = (0..pairs.len()).filter_map(|index| {
        let mut others = pairs.to_vec();
        let (face, page) = others.remove(index);
        let map = fitted(&others)?;
        let apart_mm = distance(map.apply(face), page) / map.scale();
        Some((farthest(&map, &others), index + 1, apart_mm))
    });
    let best = without.min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, number, apart_mm) = best.filter(|(others, ..)| *others <= MAX_APART_MM)?;
    Some(ControlPointError::Outlier { number, apart_mm })
}

/// Returns the largest distance of points from a map, mm.
fn farthest(map: &Affine2, pairs: &[PointPair]) -> f64 {
    let apart = pairs
        .iter()
        .map(|(face, page)| distance(map.apply(*face), *page));
    // A map without scale is far from all points.
    apart
        .map(|apart| apart / map.scale())
        .fold(0.0, |a: f64, b| if a.is_nan() || b <= a { a } else { b })
}

/// Fits a similarity by least squares; `None` if all points of the face are one.
fn fitted(pairs: &[PointPair]) -> Option<Affine2> {
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for ([u, v], page) in pairs {
        for (row, value) in [([*u, -v, 1.0, 0.0], page[0]), ([*v, *u, 0.0, 1.0], page[1])] {
            let row = Vector4::from(row);
            normal += row * row.transpose();
            right += row * value;
        }
    }
    let found = normal.cholesky()?.solve(&right);
    Some(Affine2([
        [found[0], -found[1], found[2]],
        [found[1], found[0], found[3]],
    ]))
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::super::test_world::TestWorld;
    use super::{ControlPointError, align_at};
    use crate::block::CarvedFace;
    use mocban_core::domain::{Affine2, ControlPoint};

    /// Points of the face in mm, far from each other.
    const PLACES: [[f64; 2]; 4] = [[15.0, 12.0], [135.0, 20.0], [120.0, 85.0], [20.0, 90.0]];

    /// Returns control points on a page, each moved by a shift in pixels.
    fn points(face: &CarvedFace, map: &Affine2, shifts: [[f64; 2]; 4]) -> Vec<ControlPoint> {
        let places = PLACES.iter().zip(shifts);
        places
            .map(|(at, shift)| {
                let page = map.apply(*at);
                ControlPoint {
                    mesh: face.map.frame.mesh_from_face([at[0], at[1], 0.0]),
                    page: [page[0] + shift[0], page[1] + shift[1]],
                }
            })
            .collect()
    }

    #[test]
    fn inexact_points_lead_to_the_right_alignment() {
        let world = TestWorld::new(11);
        let face = world.face();
        let map = Affine2::similarity(8.0, 0.9, [700.0, 50.0]);
        let page = world.affine_page([1500, 1500], &map);
        let shifts = [[12.0, -9.0], [-14.0, 8.0], [5.0, 16.0], [9.0, -11.0]];
        let found = align_at(&face, &page, &points(&face, &map, shifts)).unwrap();
        for at in PLACES {
            let (a, b) = (found.map.page_from_face(at), map.apply(at));
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1.0, "{at:?} {a:?} {b:?}");
        }
    }

    #[test]
    fn points_on_other_strokes_are_refused() {
        let world = TestWorld::new(12);
        let face = world.face();
        let map = Affine2::scale_shift(8.0, [200.0, 200.0]);
        let page = world.affine_page([1600, 1200], &map);
        let moved = points(&face, &map, [[200.0, 80.0]; 4]);
        let refused = align_at(&face, &page, &moved);
        assert!(
            matches!(refused, Err(ControlPointError::NoAgreement { share }) if share < 40.0),
            "{refused:?}"
        );
    }

    #[test]
    fn one_wrong_point_is_named_where_others_outvote_it() {
        let world = TestWorld::new(13);
        let face = world.face();
        let map = Affine2::scale_shift(8.0, [40.0, 40.0]);
        let page = world.affine_page([1280, 880], &map);
        let mut shifts = [[0.0; 2]; 4];
        shifts[2] = [0.0, -300.0];
        let refused = align_at(&face, &page, &points(&face, &map, shifts));
        let named = |number: usize| matches!(refused, Err(ControlPointError::Outlier { number: found, apart_mm }) if found == number && (apart_mm - 37.5).abs() < 1.0);
        assert!(named(3), "{refused:?}");
        // With three points, the wrong one cannot be determined.
        let three = align_at(&face, &page, &points(&face, &map, shifts)[..3]);
        assert!(
            matches!(three, Err(ControlPointError::Contradiction { .. })),
            "{three:?}"
        );
        // The points of a mirrored page.
        let mirrored = Affine2([[-8.0, 0.0, 1240.0], [0.0, 8.0, 40.0]]);
        let refused = align_at(&face, &page, &points(&face, &mirrored, [[0.0; 2]; 4]));
        assert!(
            matches!(refused, Err(ControlPointError::Contradiction { .. })),
            "{refused:?}"
        );
    }

    #[test]
    fn few_or_near_points_are_refused() {
        let world = TestWorld::new(14);
        let face = world.face();
        let map = Affine2::scale_shift(8.0, [40.0, 40.0]);
        let page = world.affine_page([1280, 880], &map);
        let all = points(&face, &map, [[0.0; 2]; 4]);
        let few = align_at(&face, &page, &all[..2]);
        assert!(
            matches!(few, Err(ControlPointError::TooFew { count: 2 })),
            "{few:?}"
        );
        let near = align_at(&face, &page, &[all[0]; 3]);
        assert!(
            matches!(near, Err(ControlPointError::TooNear { .. })),
            "{near:?}"
        );
    }
}
