//! Fits a character of a block whose strokes do not determine a plane.
//!
//! The tops of a single stroke show their height and their slope along the stroke. Across it, its walls and the ground
//! tilt or bend the fitted surface. The scan of the block shows the face around the character: the surface is a plane with
//! that normal. All other characters are fitted as if there were no block.

use nalgebra::Vector3;

use super::params::{ExpectedFace, FitError, FitParams};
use super::pca::{Axes, frame};
use super::side_surface::fit_known_normal;
use super::upper_surface::{Fitting, fit};
use crate::stages::print::Print;
use crate::stages::scan::Scan;
use mocban_core::domain::{FitOutcome, SideEvidence};

/// A surface agrees with the block if the angle between their normals, in radians, is smaller than this. On two generated
/// blocks, characters of several strokes reached 0.024.
const MAX_ANGLE: f64 = 0.07;
/// No block bends so much over its length that a normal at one of its characters differs by this angle, in radians.
const IMPOSSIBLE_ANGLE: f64 = 0.35;
/// A surface that agrees with the block is bent by at most this fraction of the relief.
const MAX_BEND: f64 = 0.2;
/// Tops, seen along the normal of the block, are one stroke if they spread less than this fraction of the extent in their
/// narrowest direction. On two generated blocks, one stroke had 0.024, another character 0.087, and the other 584 at least
/// 0.116.
const ONE_STROKE: f64 = 0.08;
/// The same for tops seen along the normal of the fit, where a wall of the stroke may count as tops.
const ONE_WALL: f64 = 0.11;

/// Fits the surface of the stroke tops of a character that was cut from a block. If [`fit`] disagrees with `face` or finds
/// no carving, and the tops are a single stroke, `face` decides the normal. Otherwise, returns what [`fit`] returns.
///
/// # Errors
/// Returns an error if the vertices span no surface, neither side shows a surface, or nothing is carved.
pub fn fit_in_block(
    scan: &Scan,
    print: Option<&Print>,
    scanned_face_down: Option<bool>,
    face: &ExpectedFace,
    params: &FitParams,
) -> Result<FitOutcome, FitError> {
    let found = fit(scan, print, scanned_face_down, params);
    let is_final = match &found {
        Ok(found) => !is_doubtful(scan, found, face),
        Err(error) => !matches!(error, FitError::NoSurface(_) | FitError::NoRelief { .. }),
    };
    if is_final {
        return found;
    }
    along_face(scan, face, params).map_or(found, Ok)
}

/// Returns whether a surface contradicts the block, and its own tops do not show that it is right.
fn is_doubtful(scan: &Scan, found: &FitOutcome, face: &ExpectedFace) -> bool {
    let [.., [x, y, z, _], _] = found.plane_from_mesh.0;
    let angle = Vector3::new(x, y, z).angle(&Vector3::from(face.normal));
    let is_bent = found.curvature_height > MAX_BEND * found.relief;
    let agrees = angle < MAX_ANGLE && !is_bent;
    !agrees && (angle > IMPOSSIBLE_ANGLE || is_narrow(scan, found))
}

/// Returns whether the tops of a surface are so narrow that they may be one stroke or one of its walls.
fn is_narrow(scan: &Scan, found: &FitOutcome) -> bool {
    let seen = fit_known_normal(scan.indexed(), &found.plane_from_mesh);
    seen.is_none_or(|side| side.samples.spread_of_tops(&side.surface) < ONE_WALL)
}

/// Fits the height of the tops along the block's normal. Returns `None` if nothing is carved there, or if the tops are
/// more than one stroke.
fn along_face(scan: &Scan, face: &ExpectedFace, params: &FitParams) -> Option<FitOutcome> {
    let normal = Vector3::<f64>::from(face.normal).try_normalize(0.0)?;
    let indexed = scan.indexed();
    let centre = Axes::of_surface(scan.mesh(), indexed).centre;
    let start = frame(normal, centre);
    let side = fit_known_normal(indexed, &start)?;
    let is_carved = side.relief >= params.min_relief * side.extent;
    if !is_carved || side.samples.spread_of_tops(&side.surface) >= ONE_STROKE {
        return None;
    }
    // The page showed which side of the block is carved.
    let evidence = SideEvidence {
        winding: indexed.upward_facing_share(&side.plane_from_mesh),
        flatness: side.surface.tops,
        confidence: 1.0,
    };
    let fitting = Fitting {
        scan,
        params,
        start,
    };
    Some(fitting.of_whole(&side, evidence))
}

#[cfg(test)]
mod tests;
