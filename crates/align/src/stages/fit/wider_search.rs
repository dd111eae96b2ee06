//! Searches all sides and parts of a scan for the carved side, if the usual side does not resemble the print.
//!
//! The usual side is perpendicular to the least principal axis of the whole scan. This side is wrong for a block that
//! is deeper than wide, for a block on a scanned table, for a scan with debris around it, and for a grid of characters
//! of which the print shows one.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use super::carved_side::AGREEMENT;
use super::directions::{Facet, candidates, facets};
use super::height_samples::{DEEPEST, DEEPEST_CARVING};
use super::near_plane::near_plane;
use super::params::FitParams;
use super::pca::{Axes, frame, frame_along};
use super::print_agreement::InkPyramids;
use super::scan_parts::{CandidatePart, parts, some_points, without_spikes};
use super::side_surface::{COARSE, FINE, FittedSide, fit_view};
use super::tightest_frame::{ANGLES, bounds, tightest_frame};
use crate::stages::scan::{lowest_along, part_in, part_of};
use crate::stages::zbuffer::IndexedSurface;
use mocban_core::domain::cancel::poll;
use mocban_core::domain::{PrintOutline, Rigid3, ScanRegion, SideEvidence};
use mocban_core::mesh::Mesh;

/// Least agreement with the print at which a side is accepted. The search begins if the usual side has a lower one. On generated scans, carved sides reached 0.65 to 0.93
/// and other sides at most 0.51.
pub(super) const LEAST: f64 = 0.58;
/// Factor by which the agreement of a side must exceed the agreement of the usual side.
pub(super) const BETTER: f64 = 1.12;
/// A side is also accepted if its agreement is at least [`LEAST_BY_FAR`], and at least this many times that of the usual
/// side. A wrong side is refused later, by the confidence in the pose.
const MUCH_BETTER: f64 = 2.0;
const LEAST_BY_FAR: f64 = 0.45;
/// Sides whose normals differ by a larger angle, in radians, are rivals.
const RIVAL: f64 = 0.5;
/// A lower agreement of the best rival counts as this.
const LEAST_RIVAL: f64 = 0.1;
/// A region extends above the surface by this many times the relief. Anything higher floats or is a spike.
const HIGHEST: f64 = 1.0;
/// If at least this fraction of the visible area lies deeper than any carving, that area is cut off.
const DEEP_AREA: f64 = 0.02;
/// Fractions of the width and height of a grid of characters that are tried for the middle character.
const MIDDLE: [f64; 2] = [0.38, 0.5];
/// Largest number of distinct sides that are registered if the evidence is weak, and their least agreement.
const MOST_TRIED: usize = 4;
const LEAST_TRIED: f64 = 0.25;
/// Two sides are alike if their normals differ by less than this angle, in radians, and their boxes by less than this
/// fraction of their size.
const LIKE: f64 = 0.2;
/// A box is wider than its points by this fraction of their extent, so that corners on the boundary stay inside despite
/// rounding.
const SLACK: f64 = 1e-4;

/// A carved side that is not the usual side of the whole scan, or that resembles a part of the print.
#[derive(Debug)]
pub(super) struct FoundSide {
    pub(super) side: FittedSide,
    pub(super) evidence: SideEvidence,
    /// The part of the scan that shows the character. `None` for the whole scan.
    pub(super) region: Option<ScanRegion>,
    /// The part of the print that shows the character. `None` for the whole print.
    pub(super) print_outline: Option<PrintOutline>,
    /// Agreement of the side with the print or its part, from 0 to 1.
    pub(super) agreement: f64,
    /// Whether the side is one of several connected pieces of the scan.
    pub(super) is_piece: bool,
}

/// A side with its agreement with the print.
struct JudgedSide {
    plane_from_mesh: Rigid3,
    agreement: f64,
    region: ScanRegion,
    /// Whether the side is one of several connected pieces of the scan.
    is_piece: bool,
}

/// The sides of all parts of a scan, the one that resembles the print best first.
pub(super) struct WiderSearch<'a> {
    mesh: &'a Mesh,
    params: &'a FitParams,
    found: Vec<JudgedSide>,
}

/// Compares the sides of all parts of a scan with the print.
pub(super) fn search<'a>(
    mesh: &'a Mesh,
    indexed: &IndexedSurface,
    inks: &InkPyramids,
    params: &'a FitParams,
) -> WiderSearch<'a> {
    let search = SideSearch { inks, params };
    let blocks = parts(mesh, indexed);
    let (mut found, mut whole) = (Vec::new(), None);
    for (k, CandidatePart { mesh, beside }) in blocks.iter().enumerate() {
        if mesh.vertices.is_empty() {
            continue;
        }
        let indexed = IndexedSurface::new(mesh);
        let axes = Axes::of_surface(mesh, &indexed);
        let facets = facets(mesh);
        for normal in candidates(&axes, &facets) {
            let start = frame(normal, axes.centre);
            let mut side = search.candidate(mesh, &indexed, &start);
            if let Some(side) = side.as_mut().filter(|_| !beside.is_empty()) {
                side.keep_apart(mesh, beside);
            }
            found.extend(side);
        }
        if k == 0 {
            whole = Some(WholeScan { mesh, axes, facets });
        }
    }
    if let Some(whole) = &whole {
        found.extend(search.middles_of_grid(whole));
    }
    if found.iter().all(|side| side.agreement < LEAST)
        && let Some(whole) = &whole
    {
        found.extend(search.near_planes(whole));
    }
    // Of equal sides, the last one found comes first.
    found.reverse();
    found.sort_by(|a, b| b.agreement.total_cmp(&a.agreement));
    WiderSearch {
        mesh,
        params,
        found,
    }
}

impl WiderSearch<'_> {
    /// Returns the side that resembles the print best. `usual` is the agreement of the usual side with the print. Returns
    /// `None` if the best agreement is below [`least_agreement`], or if the finer fit of the side finds no carving.
    pub(super) fn best(&self, usual: f64) -> Option<FoundSide> {
        let best = self.found.first()?;
        (best.agreement >= least_agreement(usual))
            .then(|| self.fitted(best))
            .flatten()
    }

    /// Returns the best few of the sides that differ from each other, the best one first.
    pub(super) fn distinct(&self) -> impl Iterator<Item = FoundSide> {
        let mut chosen: Vec<&JudgedSide> = Vec::new();
        for side in self
            .found
            .iter()
            .filter(|side| side.agreement >= LEAST_TRIED)
        {
            if chosen.len() < MOST_TRIED && !chosen.iter().any(|other| side.is_like(other)) {
                chosen.push(side);
            }
        }
        chosen.into_iter().filter_map(|side| self.fitted(side))
    }

    /// Fits a side finely. Returns `None` if it has no carving.
    fn fitted(&self, side: &JudgedSide) -> Option<FoundSide> {
        let here = side.normal();
        let rivals = self.found.iter();
        let rivals = rivals.filter(|other| other.normal().angle(&here) > RIVAL);
        let rival = rivals.map(|other| other.agreement).fold(0.0, f64::max);
        let part = without_spikes(&part_in(self.mesh, &side.region));
        let indexed = IndexedSurface::new(&part);
        let curved = self.params.curved_blocks;
        let fine = fit_view(&indexed, &side.plane_from_mesh, curved, FINE)?;
        if fine.relief < self.params.min_relief * fine.extent {
            return None;
        }
        Some(FoundSide {
            evidence: evidence(&indexed, &fine, side.agreement, rival),
            region: Some(side.region),
            print_outline: None,
            agreement: side.agreement,
            is_piece: side.is_piece,
            side: fine,
        })
    }
}

impl JudgedSide {
    /// Returns the normal in mesh coordinates.
    fn normal(&self) -> Vector3<f64> {
        let [.., row, _] = self.plane_from_mesh.0;
        Vector3::new(row[0], row[1], row[2])
    }

    /// Turns the box of a piece about its normal so that it contains as little of the other pieces as possible. `beside`
    /// are points of the other pieces.
    fn keep_apart(&mut self, piece: &Mesh, beside: &[[f64; 3]]) {
        let points = some_points(piece);
        let old = self.region.box_from_mesh;
        let row = |k: usize| Vector3::new(old.0[k][0], old.0[k][1], old.0[k][2]);
        let origin = Vector3::from(old.inverse().apply([0.0; 3]));
        let turned = (0..ANGLES).map(|step| {
            poll();
            let angle = FRAC_PI_2 * f64::from(step) / f64::from(ANGLES);
            let along = row(0) * angle.cos() + row(1) * angle.sin();
            let box_from_mesh = frame_along(row(2), along, origin);
            let mut bounds = self.region.bounds;
            for k in 0..2 {
                let at = || points.iter().map(|point| box_from_mesh.apply(*point)[k]);
                bounds[0][k] = at().fold(f64::INFINITY, f64::min);
                bounds[1][k] = at().fold(f64::NEG_INFINITY, f64::max);
            }
            let region = ScanRegion {
                box_from_mesh,
                bounds,
            };
            let inside = beside.iter().filter(|point| region.contains(**point));
            (inside.count(), region)
        });
        if let Some((_, region)) = turned.min_by_key(|(inside, _)| *inside) {
            self.region = region;
            let slack = SLACK * self.size();
            let [low, high] = bounds(piece.vertices.iter(), &region.box_from_mesh);
            for k in 0..2 {
                self.region.bounds[0][k] = low[k] - slack;
                self.region.bounds[1][k] = high[k] + slack;
            }
        }
        self.is_piece = true;
    }

    /// Returns the diagonal of the box across the normal, in mesh units.
    fn size(&self) -> f64 {
        let [low, high] = self.region.bounds;
        (high[0] - low[0]).hypot(high[1] - low[1])
    }

    /// Returns whether two sides show about the same part of the scan from about the same direction.
    fn is_like(&self, other: &Self) -> bool {
        let middle = |side: &Self| {
            let [low, high] = side.region.bounds;
            let middle = [0, 1, 2].map(|k| f64::midpoint(low[k], high[k]));
            Vector3::from(side.region.box_from_mesh.inverse().apply(middle))
        };
        let [a, b] = [self.size(), other.size()];
        self.is_piece == other.is_piece
            && self.normal().angle(&other.normal()) < LIKE
            && (middle(self) - middle(other)).norm() < LIKE * a.min(b)
            && (a / b).max(b / a) < 1.0 + LIKE
    }
}

/// Returns the least agreement of a side that replaces the usual side, which has the agreement `usual`.
fn least_agreement(usual: f64) -> f64 {
    (usual * MUCH_BETTER)
        .clamp(LEAST_BY_FAR, LEAST)
        .max(usual * BETTER)
}

/// Returns the evidence for a side. `agreement` is the agreement of the side, and `rival` the best other agreement.
pub(super) fn evidence(
    indexed: &IndexedSurface,
    side: &FittedSide,
    agreement: f64,
    rival: f64,
) -> SideEvidence {
    SideEvidence {
        winding: indexed.upward_facing_share(&side.plane_from_mesh),
        flatness: side.surface.tops,
        confidence: confidence(agreement, rival),
    }
}

/// Returns the confidence in a side, 0 if its rival agrees better with the print.
fn confidence(agreement: f64, rival: f64) -> f64 {
    let odds = AGREEMENT * (agreement / rival.max(LEAST_RIVAL)).ln();
    (odds / 2.0).tanh().max(0.0)
}

/// The scan without spikes and debris, with what is measured of it once.
struct WholeScan<'a> {
    mesh: &'a Mesh,
    axes: Axes,
    facets: Vec<Facet>,
}

/// What all sides are compared with.
#[derive(Clone, Copy)]
struct SideSearch<'a> {
    inks: &'a InkPyramids,
    params: &'a FitParams,
}

impl SideSearch<'_> {
    /// Fits a side of a part and measures how well it resembles the print. Returns `None` if the side is not carved.
    fn candidate(
        self,
        mesh: &Mesh,
        indexed: &IndexedSurface,
        start: &Rigid3,
    ) -> Option<JudgedSide> {
        let curved = self.params.curved_blocks;
        let seen = fit_view(indexed, start, curved, COARSE)?;
        let Some(face) = without_depths(mesh, &seen) else {
            return self.judged(mesh, indexed, &seen, start);
        };
        let indexed = IndexedSurface::new(&face);
        let seen = fit_view(&indexed, &seen.plane_from_mesh, curved, COARSE)?;
        self.judged(&face, &indexed, &seen, start)
    }

    /// Returns the carved sides among the parts near large planes.
    fn near_planes(self, WholeScan { mesh, axes, facets }: &WholeScan) -> Vec<JudgedSide> {
        let normals = candidates(axes, facets).into_iter();
        let parts = normals.filter_map(|normal| near_plane(mesh, facets, normal));
        parts
            .filter_map(|(part, start)| self.candidate(&part, &IndexedSurface::new(&part), &start))
            .collect()
    }

    /// Returns a fitted side with its agreement, or `None` if the side is not carved.
    fn judged(
        self,
        mesh: &Mesh,
        indexed: &IndexedSurface,
        side: &FittedSide,
        start: &Rigid3,
    ) -> Option<JudgedSide> {
        (side.relief >= self.params.min_relief * side.extent).then(|| JudgedSide {
            plane_from_mesh: side.plane_from_mesh,
            agreement: self.inks.agreement(side),
            region: region(mesh, indexed, side, start),
            is_piece: false,
        })
    }

    /// Returns the carved sides of the middles of a flat scan, where the middle character of a grid lies.
    fn middles_of_grid(self, WholeScan { mesh, axes, .. }: &WholeScan) -> Vec<JudgedSide> {
        let (plane, size) = tightest_frame(mesh, axes);
        let sides = MIDDLE.map(|share| self.middle_of_grid(mesh, &plane, size, share));
        sides.into_iter().flatten().collect()
    }

    /// Returns the carved sides of the part of a scan that has `share` of the width and of the height of a frame. `low` and
    /// `high` are the bounds of the scan in the frame.
    fn middle_of_grid(
        self,
        mesh: &Mesh,
        plane: &Rigid3,
        [low, high]: [[f64; 2]; 2],
        share: f64,
    ) -> Vec<JudgedSide> {
        let inside = |at: f64, k: usize| {
            let (middle, side) = (f64::midpoint(low[k], high[k]), high[k] - low[k]);
            (at - middle).abs() < side * share / 2.0
        };
        let middle = part_of(mesh, |corner| {
            let [x, y, _] = plane.apply(corner);
            inside(x, 0) && inside(y, 1)
        });
        if middle.vertices.len() < 16 {
            return Vec::new();
        }
        let indexed = IndexedSurface::new(&middle);
        let [x, y, z, last] = plane.0;
        let back = Rigid3([x, y.map(|v| -v), z.map(|v| -v), last]);
        let sides = [*plane, back].into_iter();
        sides
            .filter_map(|side| self.candidate(&middle, &indexed, &side))
            .collect()
    }
}

/// Cuts off the area that lies deeper than any carving, such as the foot of a block or a table below it. Returns `None`
/// if that area is a small fraction of the visible area, or if almost nothing would remain.
fn without_depths(mesh: &Mesh, side: &FittedSide) -> Option<Mesh> {
    let deepest = -DEEPEST_CARVING * side.extent - side.curvature_height;
    let heights = side.samples.residuals(&side.surface);
    let deep = heights.iter().filter(|height| **height < deepest).count();
    if (deep as f64) < DEEP_AREA * heights.len() as f64 {
        return None;
    }
    let near = part_of(mesh, |corner| {
        side.plane_from_mesh.apply(corner)[2] > deepest
    });
    (near.vertices.len() >= 16).then_some(near)
}

/// Returns the height over the plane, in mesh units, above which nothing belongs to the carving.
fn top(side: &FittedSide) -> f64 {
    HIGHEST * side.relief + side.curvature_height
}

/// Returns whether a side shows floating debris or spikes above the carving.
pub(super) fn has_debris_above(side: &FittedSide) -> bool {
    let heights = side.samples.residuals(&side.surface);
    heights.iter().any(|height| *height > top(side))
}

/// Returns the box around a side of a part. Its z is the side's normal, and its x is close to that of `along`.
pub(super) fn region(
    mesh: &Mesh,
    indexed: &IndexedSurface,
    side: &FittedSide,
    along: &Rigid3,
) -> ScanRegion {
    let row = |of: &Rigid3, k: usize| Vector3::new(of.0[k][0], of.0[k][1], of.0[k][2]);
    let origin = side.plane_from_mesh.inverse().apply([0.0; 3]);
    let normal = row(&side.plane_from_mesh, 2);
    let box_from_mesh = frame_along(normal, row(along, 0), Vector3::from(origin));
    let [low, high] = indexed.bounds(&box_from_mesh);
    let slack = SLACK * side.extent;
    // A table that was cut off lies below the lowest corner.
    let lowest = lowest_along(&mesh.vertices, box_from_mesh.0[2]) - slack;
    let down = lowest.max(-DEEPEST * side.relief - side.curvature_height);
    ScanRegion {
        box_from_mesh,
        bounds: [
            [low[0] - slack, low[1] - slack, down],
            [high[0] + slack, high[1] + slack, top(side)],
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::confidence;

    #[test]
    fn a_side_with_a_better_rival_has_no_confidence() {
        assert_eq!(confidence(0.3, 0.6), 0.0);
        assert!(confidence(0.6, 0.3) > 0.9);
    }
}
