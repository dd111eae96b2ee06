//! Fits the surface of the stroke tops. Both sides of the mesh are rendered and fitted at a coarse resolution. The
//! carved side is then fitted again at a finer resolution. If this side does not resemble the print, or if the scan shows
//! several pieces, it is registered (`trials`); unless it is sure, so are the likeliest parts of the print, and the likeliest
//! sides of all parts of the scan.

use super::carved_side::{self, CarvedSide, SideInputs};
use super::params::{FitError, FitParams};
use super::part_search;
use super::pca::{Axes, frame};
use super::print_agreement::InkPyramids;
use super::side_surface::{FINE, FittedSide, coarse_sides, fit_view};
use super::trials::Trials;
use super::wider_search::{self, BETTER, FoundSide, LEAST};
use crate::stages::print::Print;
use crate::stages::scan::Scan;
use mocban_core::domain::{FitOutcome, Rigid3, SideEvidence};
use mocban_core::mesh::Mesh;

/// A usual side that resembles the print less than a side that is accepted is registered before others are sought, if its
/// agreement is at least this.
const LIKELY: f64 = 0.35;

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
    let fitting = Fitting {
        scan,
        params,
        start,
    };
    let shows_pieces = |usual: &CarvedSide| usual.side.samples.shows_pieces();
    if let (Some(print), Some(inks)) = (print, &inks)
        && (agreement < LEAST || usual.as_ref().is_some_and(shows_pieces))
    {
        let fine = fine.as_ref().filter(|fine| is_carved(fine));
        let found = fitting.by_trials(print, inks, (usual.as_ref(), fine), agreement);
        if indexed.overlaps_too_often() {
            return Err(too_often());
        }
        if let Some(found) = found {
            return Ok(found);
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
    Ok(fitting.of_whole(&fine, usual.evidence))
}

/// What is fitted, with the frame from which both sides are seen.
pub(super) struct Fitting<'a> {
    pub(super) scan: &'a Scan,
    pub(super) params: &'a FitParams,
    pub(super) start: Rigid3,
}

impl Fitting<'_> {
    /// Returns the result of the stage for a side of the whole scan.
    pub(super) fn of_whole(&self, fine: &FittedSide, evidence: SideEvidence) -> FitOutcome {
        let mesh = self.scan.mesh();
        // The rest of the scan is not the face: side walls, a foot or a table below it, or debris above it.
        let is_part = fine.samples.is_cropped || wider_search::has_debris_above(fine);
        let indexed = self.scan.indexed();
        let region = is_part.then(|| wider_search::region(mesh, indexed, fine, &self.start));
        FitOutcome {
            region,
            ..outcome(fine, evidence, mesh)
        }
    }

    /// Returns the result of the stage for a side of a part of the scan or for a part of the print.
    fn of_part(&self, found: FoundSide) -> (FitOutcome, bool) {
        let part = FitOutcome {
            region: found.region,
            print_outline: found.print_outline,
            ..outcome(&found.side, found.evidence, self.scan.mesh())
        };
        (part, found.is_piece)
    }

    /// Registers candidates, the likeliest first, until one is sure: the side or part that resembles the print best, both
    /// sides of the whole scan, and the other sides and parts. `usual` is the usual side with its fine fit, if that is
    /// carved, and `agreement` its agreement with the print. If it resembles the print, so that only separate pieces ask
    /// for trials, it is registered first. So is one with some resemblance: most searches for other sides and parts, which take
    /// ten times as long, find none that is surer. Returns `None` if there is no candidate.
    fn by_trials(
        &self,
        print: &Print,
        inks: &InkPyramids,
        usual: (Option<&CarvedSide>, Option<&FittedSide>),
        agreement: f64,
    ) -> Option<FitOutcome> {
        let (scan, params) = (self.scan, self.params);
        let (mesh, indexed) = (scan.mesh(), scan.indexed());
        let (chosen, fine) = usual;
        let of_usual = || Some(self.of_whole(fine?, chosen?.evidence));
        let mut trials = Trials::new(scan, print, params);
        if agreement >= LEAST {
            if let Some(usual) = of_usual() {
                trials.add(usual, false);
            }
            if trials.is_sure() {
                return trials.into_best(true);
            }
        } else if agreement >= LIKELY
            && let Some(certain) = of_usual().and_then(|usual| trials.certain(usual))
        {
            return Some(certain);
        }
        let parts = part_search::search(indexed, &self.start, print, params);
        let parts = parts.filter(|found| found.agreement > agreement * BETTER);
        let wider = wider_search::search(mesh, indexed, inks, params);
        let best = [wider.best(agreement), parts].into_iter().flatten();
        let mut best: Vec<FoundSide> = best.collect();
        best.sort_by(|a, b| b.agreement.total_cmp(&a.agreement));
        let has_first = !best.is_empty() || fine.is_some();
        let of_other = || {
            let chosen = chosen?;
            let plane = &chosen.other.as_ref()?.plane_from_mesh;
            let fine = fit_view(indexed, plane, params.curved_blocks, FINE)?;
            let is_carved = fine.relief >= params.min_relief * fine.extent;
            is_carved.then(|| self.of_whole(&fine, chosen.evidence_of_other(&fine)))
        };
        let of_whole = std::iter::once_with(of_usual).chain(std::iter::once_with(of_other));
        let of_part = |found| self.of_part(found);
        let candidates = best
            .into_iter()
            .map(of_part)
            .chain(of_whole.flatten().map(|whole| (whole, false)))
            .chain(wider.distinct().map(of_part));
        for (candidate, is_piece) in candidates {
            trials.add(candidate, is_piece);
            if trials.is_sure() {
                break;
            }
        }
        trials.into_best(has_first)
    }
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
