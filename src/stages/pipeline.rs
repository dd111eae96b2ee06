//! A pair taken through all four stages at once, nothing kept in between.

use super::normalize::Normalized;
use super::register::Registered;
use super::{Print, Scan, Settings, StageError, depth, fit, normalize, register};
use crate::domain::{FitOutcome, MetricOutcome, PrintFromMesh, ThresholdMetric};
use crate::raster::DepthMap;

/// What the four stages make of a mesh and a print.
#[derive(Debug, Clone)]
pub struct AlignedPair {
    /// The plane.
    pub fit: FitOutcome,
    /// The depth map, which reads like the print.
    pub depth: DepthMap,
    /// Ink, canvas, poses and thresholds.
    pub normalized: Normalized,
    /// One alignment a metric.
    pub registered: Registered,
}

impl AlignedPair {
    /// Runs the four stages, with neither unit nor side told.
    ///
    /// # Errors
    /// Those of the first stage that finds no result.
    pub fn new(scan: &Scan, print: &Print, settings: &Settings) -> Result<Self, StageError> {
        let fit = fit::fit(scan, Some(print), None, &settings.fit)?;
        let depth = depth::depth(scan, &fit, None, &settings.depth)?;
        let normalized = normalize::normalize(&depth, print, &settings.normalize)?;
        let registered = register::register(&depth, &normalized, &settings.register)?;
        Ok(Self {
            fit,
            depth,
            normalized,
            registered,
        })
    }

    /// One alignment a metric.
    pub fn metrics(&self) -> &[MetricOutcome] {
        &self.registered.outcome.metrics
    }

    /// A metric's alignment, if the settings ask for the metric.
    pub fn metric(&self, metric: ThresholdMetric) -> Option<&MetricOutcome> {
        self.metrics().iter().find(|found| found.metric == metric)
    }

    /// Where the mesh's points fall in print pixels under a metric's alignment.
    pub fn print_from_mesh(&self, metric: &MetricOutcome) -> PrintFromMesh {
        PrintFromMesh::new(
            &metric.print_from_depth,
            &self.depth.scale.depth_from_plane,
            &self.fit.plane_from_mesh,
        )
    }
}
