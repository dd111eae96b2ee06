//! Fits the surface of the stroke tops. Both sides of the mesh are rendered and fitted at a coarse resolution. The
//! carved side is then fitted again at a finer resolution. If this side does not resemble the print, parts of the print
//! are tried, and all sides of all parts of the scan.

use super::carved_side::{self, SideInputs};
use super::params::{FitError, FitParams};
use super::part_search;
use super::pca::{Axes, frame};
use super::print_agreement::InkPyramids;
use super::side_surface::{FINE, FittedSide, coarse_sides, fit_view};
use super::wider_search::{self, BETTER, LEAST};
use crate::stages::print::Print;
use crate::stages::scan::Scan;
use mocban_core::domain::{FitOutcome, SideEvidence};
use mocban_core::mesh::Mesh;

/// Fits the surface on which the stroke tops lie, and finds the carved side.
///
/// `scanned_face_down` is whether the block lay face down in the scan, with the carved face towards -z of the mesh.
/// This is weak evidence for the carved side. `print` is stronger evidence, and does not influence the plane of a side.
/// In the outcome, lengths are in mesh units. The plane's x axis is as close as possible to the mesh's x, so an upright
/// scan stays upright.
///
/// # Errors
/// Returns an error if the vertices span no surface, neither side shows a surface, or nothing is carved.
pub fn fit(
    scan: &Scan,
    print: Option<&Print>,
    scanned_face_down: Option<bool>,
    params: &FitParams,
) -> Result<FitOutcome, FitError> {
    let mesh = scan.mesh();
    if mesh.vertices.len() < 3 {
        return Err(FitError::TooFewPoints(mesh.vertices.len()));
    }
    let indexed = scan.indexed();
    let axes = Axes::of_surface(mesh, indexed);
    axes.require_surface(mesh)?;
    let start = frame(axes.normal(), axes.centre);
    let inks = print.and_then(InkPyramids::new);
    let inputs = SideInputs {
        indexed,
        inks: inks.as_ref(),
        scanned_face_down,
    };
    let sides = coarse_sides(indexed, &start, params.curved_blocks);
    let too_often = || FitError::Overlap(mesh.triangles.len());
    if indexed.overlaps_too_often() {
        return Err(too_often());
    }
    let usual = carved_side::choose(sides, inputs).map(|mut chosen| {
        let measured = || inks.as_ref().map(|inks| inks.agreement(&chosen.side));
        chosen.agreement = chosen.agreement.or_else(measured);
        chosen
    });
    let is_carved = |side: &FittedSide| side.relief >= params.min_relief * side.extent;
    let fine = usual.as_ref().and_then(|usual| {
        let plane = &usual.side.plane_from_mesh;
        fit_view(indexed, plane, params.curved_blocks, FINE)
    });
    if indexed.overlaps_too_often() {
        return Err(too_often());
    }
    let carved = usual
        .as_ref()
        .filter(|_| fine.as_ref().is_some_and(is_carved));
    let agreement = carved.map_or(0.0, |carved| carved.agreement.unwrap_or(1.0));
    if let (Some(print), Some(inks)) = (print, &inks)
        && agreement < LEAST
    {
        let parts = part_search::search(indexed, &start, print, params)
            .filter(|found| found.agreement > agreement * BETTER);
        let wider = wider_search::search(mesh, indexed, inks, agreement, params);
        let found = [parts, wider].into_iter().flatten();
        if let Some(found) = found.max_by(|a, b| a.agreement.total_cmp(&b.agreement)) {
            return Ok(FitOutcome {
                region: found.region,
                print_outline: found.print_outline,
                ..outcome(&found.side, found.evidence, mesh)
            });
        }
    }
    let (Some(usual), Some(fine)) = (usual, fine) else {
        return Err(FitError::NoSurface(mesh.vertices.len()));
    };
    if !is_carved(&fine) {
        return Err(FitError::NoRelief {
            relief: fine.relief,
            extent: fine.extent,
            min_relief: params.min_relief,
            searched: inks.is_some(),
        });
    }
    // The rest of the scan is not the face: side walls, a foot or a table below it, or debris above it.
    let is_part = fine.samples.is_cropped || wider_search::has_debris_above(&fine);
    let region = is_part.then(|| wider_search::region(mesh, indexed, &fine, &start));
    Ok(FitOutcome {
        region,
        ..outcome(&fine, usual.evidence, mesh)
    })
}

/// Returns the result of the stage for a surface, for the whole scan and the whole print.
fn outcome(fine: &FittedSide, side: SideEvidence, mesh: &Mesh) -> FitOutcome {
    FitOutcome {
        plane_from_mesh: fine.plane_from_mesh,
        curvature: fine.curvature,
        curvature_height: fine.curvature_height,
        inlier_ratio: fine.surface.tops,
        rms: fine.surface.rms,
        relief: fine.relief,
        side,
        region: None,
        print_outline: None,
        vertices: mesh.vertices.len() as u64,
        triangles: mesh.triangles.len() as u64,
        missing_vertices: None,
        incomplete_faces: None,
    }
}
