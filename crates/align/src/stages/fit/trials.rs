//! Registers several candidates of a fit, if the evidence of the fit alone is weak.
//!
//! The coarse agreement with the print decides between sides and parts of a scan. If it is low for all of them, it is no
//! better than chance: the back of a block or a window through the character may have the highest. The pose of a
//! registration distinguishes them, and shows whether the candidate's box cuts through the character.

use super::params::FitParams;
use super::side_surface::{FINE, fit_view};
use crate::stages::depth::{self, DepthParams, ResolutionBy};
use crate::stages::normalize::{self, NormalizeParams};
use crate::stages::print::Print;
use crate::stages::register::{self, RegisterParams};
use crate::stages::scan::Scan;
use crate::stages::score::SsimWindow;
use crate::stages::zbuffer::IndexedSurface;
use mocban_core::domain::cancel::poll;
use mocban_core::domain::{Affine2, FitOutcome, ScanRegion, ThresholdMetric};
use mocban_core::raster::{DepthMap, Mask, PixelBox};

/// The trials end at a candidate with at least this confidence.
const SURE: f64 = 0.8;
/// The usual side ends the search before any other candidate is sought, if it has at least this confidence.
const CERTAIN: f64 = 0.9;
/// The second candidate replaces the first one if its confidence exceeds that of the first by this.
const SURER: f64 = 0.1;
/// Each further candidate must exceed the best one by this more: the best of many chance matches is high.
const DEMAND: f64 = 0.03;
/// The box of a candidate is widened to the ink of the print with a margin of this fraction of the ink's longest side.
const MARGIN: f64 = 0.06;
/// A box cuts through the ink if the ink reaches beyond it by this fraction of the ink's longest side.
const CUT: f64 = 0.02;
/// The floor and the ceiling of a widened box recede by this fraction of the growth, as the plane may be tilted.
const TILT: f64 = 0.05;

/// Factor of the confidence of a side whose faces point inward, for a small print: a few pixels resemble the back of a
/// block by chance, and the faces of most files point outward.
const INWARD: f64 = 0.3;

/// Settings of the trials. They do not depend on the project's settings, so that the result of the fit does not either.
const DEPTH: DepthParams = DepthParams {
    resolution_by: ResolutionBy::LongestSide,
    longest_px: 512,
    px_per_mm: 10.0,
};
const NORMALIZE: NormalizeParams = NormalizeParams {
    canvas_px: 256,
    character_px: 192,
    print_grey: 0,
    density_greys: [0; 2],
    structure_greys: [0; 2],
    window: SsimWindow::Gaussian,
};
const REGISTER: RegisterParams = RegisterParams {
    scale_band: 1.6,
    working_px: 192,
    smoothing_px: 1.22,
    anisotropic_scale: true,
    threshold_min: 0.01,
    threshold_max: 0.6,
    min_confidence: 0.3,
    window: SsimWindow::Gaussian,
    coarse_angles: 4,
    fine_angles: 2,
};

/// Candidates that were registered.
pub(super) struct Trials<'a> {
    scan: &'a Scan,
    print: &'a Print,
    params: &'a FitParams,
    /// The best candidate so far, and its confidence.
    best: Option<(FitOutcome, f64)>,
    tried: Vec<FitOutcome>,
    /// A candidate that was registered before it is added, with its result.
    known: Option<(FitOutcome, (FitOutcome, f64))>,
}

/// The pose of a registered candidate.
struct TrialPose {
    confidence: f64,
    plane_from_print: Affine2,
    /// Fraction of the ink, from 0 to 1, that lies where the depth map of the candidate has data.
    seen_ink: f64,
    /// Corners of the ink's box, in pixels of the print.
    ink: [[f64; 2]; 4],
}

impl<'a> Trials<'a> {
    pub(super) const fn new(scan: &'a Scan, print: &'a Print, params: &'a FitParams) -> Self {
        Self {
            scan,
            print,
            params,
            best: None,
            tried: Vec::new(),
            known: None,
        }
    }

    /// Registers a candidate. Returns it if it is so sure that no other one needs to be sought, which takes longer than the
    /// registration. Otherwise its result is kept until it is added.
    pub(super) fn certain(&mut self, candidate: FitOutcome) -> Option<FitOutcome> {
        let (found, confidence) = self.rated(candidate.clone(), false);
        if confidence >= CERTAIN {
            return Some(found);
        }
        self.known = Some((candidate, (found, confidence)));
        None
    }

    /// Registers a candidate. Keeps it if it is the first one or surer than the best one so far. The box of a piece is not
    /// widened: nothing of the piece lies beyond it. A piece that explains a part of the ink only is less sure, so that it
    /// does not replace the whole of a broken character.
    pub(super) fn add(&mut self, candidate: FitOutcome, is_piece: bool) {
        if self.tried.contains(&candidate) {
            return;
        }
        self.tried.push(candidate.clone());
        let is_known = |(known, _): &mut (FitOutcome, _)| !is_piece && *known == candidate;
        let (candidate, confidence) = match self.known.take_if(is_known) {
            Some((_, rated)) => rated,
            None => self.rated(candidate, is_piece),
        };
        let before = self.tried.len() - 1;
        let is_better = |(_, best): &(FitOutcome, f64)| replaces(confidence, *best, before);
        if self.best.as_ref().is_none_or(is_better) {
            self.best = Some((candidate, confidence));
        }
    }

    /// Registers a candidate, and widens its box if it is no piece. Returns the candidate with its confidence.
    fn rated(&self, candidate: FitOutcome, is_piece: bool) -> (FitOutcome, f64) {
        let (candidate, confidence) = if is_piece {
            let pose = self.registered(&candidate);
            let confidence = pose.map_or(0.0, |pose| pose.confidence * pose.seen_ink);
            (candidate, confidence)
        } else {
            self.widened(candidate)
        };
        let is_small = self.print.mask_scale().enlargement().is_some();
        let confidence = confidence * factor_of_winding(is_small, candidate.side.winding);
        (candidate, confidence)
    }

    /// Returns whether the best candidate is so sure that no other one needs to be tried.
    pub(super) fn is_sure(&self) -> bool {
        let best = self.best.as_ref();
        best.is_some_and(|(_, confidence)| *confidence >= SURE)
    }

    /// Returns the best candidate. `first` is whether the first one may be returned although it does not match.
    pub(super) fn into_best(self, first: bool) -> Option<FitOutcome> {
        let best = self
            .best
            .filter(|(_, confidence)| first || *confidence > 0.0);
        best.map(|(candidate, _)| candidate)
    }

    /// Widens the box of a candidate that cuts through the ink. Returns the candidate with its confidence. The wider box
    /// replaces the box that cuts even if it matches worse: the narrow one hides what does not match.
    fn widened(&self, candidate: FitOutcome) -> (FitOutcome, f64) {
        let Some(pose) = self.registered(&candidate) else {
            return (candidate, 0.0);
        };
        let Some(region) = candidate
            .region
            .and_then(|region| pose.wider(&region, &candidate, self.scan))
        else {
            return (candidate, pose.confidence);
        };
        let along = FitOutcome {
            region: Some(region),
            ..candidate.clone()
        };
        let with_confidence = |wider: FitOutcome| {
            let pose = self.registered(&wider);
            (wider, pose.map_or(0.0, |pose| pose.confidence))
        };
        let again = self.fitted_again(&along).map(with_confidence);
        let along = with_confidence(along);
        again.filter(|again| again.1 > along.1).unwrap_or(along)
    }

    /// Fits the surface of a candidate once more to all of its box.
    fn fitted_again(&self, candidate: &FitOutcome) -> Option<FitOutcome> {
        let part = self.scan.mesh_in(candidate.region.as_ref()?);
        let indexed = IndexedSurface::new(&part);
        let curved = self.params.curved_blocks;
        let side = fit_view(&indexed, &candidate.plane_from_mesh, curved, FINE)?;
        let is_carved = side.relief >= self.params.min_relief * side.extent;
        is_carved.then(|| FitOutcome {
            plane_from_mesh: side.plane_from_mesh,
            curvature: side.curvature,
            curvature_height: side.curvature_height,
            inlier_ratio: side.surface.tops,
            rms: side.surface.rms,
            relief: side.relief,
            ..candidate.clone()
        })
    }

    /// Registers a candidate. Returns `None` if it does not match the print.
    fn registered(&self, candidate: &FitOutcome) -> Option<TrialPose> {
        let map = depth::depth(self.scan, candidate, None, &DEPTH).ok()?;
        let part;
        let print = if let Some(outline) = &candidate.print_outline {
            part = self.print.clone().within(Some(outline));
            &part
        } else {
            self.print
        };
        let normalized = normalize::normalize(&map, print, &NORMALIZE).ok()?;
        let registered = register::register(&map, &normalized, None, &REGISTER).ok()?;
        let outcome = &registered.outcome;
        let mut metrics = outcome.metrics.iter().zip(&registered.confidence_inputs);
        let (relief, inputs) =
            metrics.find(|(found, _)| found.metric == ThresholdMetric::Relief)?;
        let masks = &normalized.prints[outcome.ink];
        let ink = masks.ink.bounding_box()?;
        let masks_from_depth = masks.masks_from_print().after(&relief.print_from_depth);
        let print_from_plane = relief.print_from_depth.after(&map.scale.depth_from_plane);
        Some(TrialPose {
            confidence: inputs.of_candidate(),
            plane_from_print: print_from_plane.inverse()?,
            seen_ink: seen_ink(&masks.ink, &map, &masks_from_depth.inverse()?),
            ink: on_print(ink, &masks.print_from_masks()),
        })
    }
}

impl TrialPose {
    /// Returns a box widened to the ink, if it cuts through the ink and the scan extends beyond it.
    fn wider(
        &self,
        region: &ScanRegion,
        candidate: &FitOutcome,
        scan: &Scan,
    ) -> Option<ScanRegion> {
        let mesh_from_plane = candidate.plane_from_mesh.inverse();
        let mut ink = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for corner in self.ink {
            let [x, y] = self.plane_from_print.apply(corner);
            let at = region
                .box_from_mesh
                .apply(mesh_from_plane.apply([x, y, 0.0]));
            for k in 0..2 {
                ink[0][k] = ink[0][k].min(at[k]);
                ink[1][k] = ink[1][k].max(at[k]);
            }
        }
        let longest = (ink[1][0] - ink[0][0]).max(ink[1][1] - ink[0][1]);
        let [whole_low, whole_high] = scan.indexed().bounds(&region.box_from_mesh);
        let mut wider = *region;
        let mut is_cut = false;
        let mut growth: f64 = 0.0;
        for k in 0..2 {
            let [low, high] = [region.bounds[0][k], region.bounds[1][k]];
            let to_low = (ink[0][k] - MARGIN * longest).max(whole_low[k]).min(low);
            let to_high = (ink[1][k] + MARGIN * longest).min(whole_high[k]).max(high);
            let is_in_ink = ink[0][k] < low - CUT * longest || ink[1][k] > high + CUT * longest;
            is_cut |= is_in_ink && (low - to_low).max(to_high - high) > CUT * longest;
            growth = growth.max(low - to_low).max(to_high - high);
            wider.bounds[0][k] = to_low;
            wider.bounds[1][k] = to_high;
        }
        wider.bounds[0][2] -= TILT * growth;
        wider.bounds[1][2] += TILT * growth;
        is_cut.then_some(wider)
    }
}

/// Returns the factor of the confidence of a side. `outward` is the share of the faces that point outward.
fn factor_of_winding(is_small: bool, outward: Option<f64>) -> f64 {
    match outward {
        Some(outward) if is_small => INWARD + (1.0 - INWARD) * outward,
        _ => 1.0,
    }
}

/// Returns whether a candidate replaces the best one of the `before` candidates that were registered earlier. One that
/// matches is preferred to one that does not.
fn replaces(confidence: f64, best: f64, before: usize) -> bool {
    let demand = SURER + DEMAND * before.saturating_sub(1) as f64;
    (best == 0.0 && confidence > 0.0) || confidence > best + demand
}

/// Returns the fraction of the ink that lies where a depth map has data.
fn seen_ink(ink: &Mask, map: &DepthMap, depth_from_masks: &Affine2) -> f64 {
    let mut seen = 0;
    for y in 0..ink.height() {
        poll();
        for x in (0..ink.width()).filter(|x| ink.at(*x, y)) {
            let [u, v] = depth_from_masks.apply([x as f64, y as f64]);
            let level = map.levels.get(u.round() as i64, v.round() as i64);
            seen += usize::from(level.is_some_and(|level| level != 0));
        }
    }
    seen as f64 / ink.count().max(1) as f64
}

/// Returns the corners of a box of masks in pixels of the print.
fn on_print(ink: PixelBox, print_from_masks: &Affine2) -> [[f64; 2]; 4] {
    let PixelBox { x0, y0, x1, y1 } = ink;
    [[x0, y0], [x1, y0], [x0, y1], [x1, y1]]
        .map(|corner| print_from_masks.apply(corner.map(|c| c as f64)))
}

#[cfg(test)]
mod tests;
