//! The data of the 3D view as one binary file.
//!
//! The file starts with the length of a JSON header in bytes as a 32-bit integer. The header follows, padded with spaces
//! to a multiple of 4 bytes, and then the arrays that the header lists. All numbers are little-endian.

use serde_json::{Value, json};

use super::view_inputs::ViewInputs;
use crate::mesh::texture_coordinates;
use crate::pair_pictures::{PairPictures, PictureError};
use crate::stage_outcomes::StageOutcomes;
use mocban_catalog::PairResults;
use mocban_core::InputLimits;
use mocban_core::domain::{Affine2, DepthScale, LengthUnit, MetricOutcome, ThresholdMetric};
use mocban_results::pair_artifacts::PairArtifacts;
use mocban_store::Project;

/// Fraction of the heights below and above the range of the threshold slider.
const OUTSIDE_RANGE: f64 = 0.002;

/// The data of the 3D view of a result: a scan in the frame of its print, and textures.
#[derive(Debug)]
pub struct ScanView {
    inputs: ViewInputs,
    /// Height over the fitted surface at which strokes begin, in the unit of the positions.
    threshold: f64,
    /// Name of the pair, if the view may show it.
    pair: Option<String>,
    metric: ThresholdMetric,
}

impl ScanView {
    /// Reads the view of a result of a pair. Returns `None` if the pair has no result of the metric.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, has changed since it was aligned, or exceeds the limits.
    pub fn read(
        project: &Project,
        pair: &PairResults,
        metric: ThresholdMetric,
        limits: InputLimits,
    ) -> Result<Option<Self>, PictureError> {
        let Some(record) = pair.metric(metric) else {
            return Ok(None);
        };
        let outcomes = StageOutcomes::read(&PairArtifacts::new(project, pair))?;
        let metrics = vec![record];
        let pictures = PairPictures::new(project, pair, &outcomes, metrics, limits, None);
        let scale = with_unit(&outcomes.depth.scale, pair);
        let view = Self::new(&pictures, &record.outcome, scale)?;
        Ok(Some(view.named(pair.attributes.name.to_string())))
    }

    /// Reads the view of any alignment of a pair that has a result of the metric. Strokes begin at `level` of the depth
    /// map. The view does not name the pair. Returns `None` if the pair has no result of the metric.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, has changed since it was aligned, or exceeds the limits.
    pub fn of_alignment(
        project: &Project,
        pair: &PairResults,
        metric: ThresholdMetric,
        print_from_depth: &Affine2,
        level: u16,
        limits: InputLimits,
    ) -> Result<Option<Self>, PictureError> {
        let Some(record) = pair.metric(metric) else {
            return Ok(None);
        };
        let outcomes = StageOutcomes::read(&PairArtifacts::new(project, pair))?;
        let pictures = PairPictures::new(project, pair, &outcomes, vec![record], limits, None);
        let scale = with_unit(&outcomes.depth.scale, pair);
        let outcome = MetricOutcome {
            print_from_depth: *print_from_depth,
            threshold_level: level,
            threshold_depth: scale.height(level),
            ..record.outcome
        };
        Self::new(&pictures, &outcome, scale).map(Some)
    }

    /// Reads the view of a result. `scale` is the scale of its depth map.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, has changed since it was aligned, or exceeds the limits.
    pub(crate) fn new(
        pictures: &PairPictures<'_>,
        outcome: &MetricOutcome,
        scale: DepthScale,
    ) -> Result<Self, PictureError> {
        let inputs = ViewInputs::read(pictures, outcome, scale)?;
        Ok(Self {
            threshold: outcome.threshold_depth * inputs.placement.frame_unit_per_mesh_unit(),
            inputs,
            pair: None,
            metric: outcome.metric,
        })
    }

    /// Adds the name of the pair.
    #[must_use]
    pub(crate) fn named(mut self, pair: String) -> Self {
        self.pair = Some(pair);
        self
    }

    /// Encodes the data; see the documentation of this module.
    pub fn to_bytes(&self) -> Vec<u8> {
        let (scan, textures) = (&self.inputs.scan, &self.inputs.textures);
        let coordinates = scan.pixels.iter();
        let coordinates = coordinates.map(|pixel| texture_coordinates(*pixel, textures.print_size));
        let coordinates: Vec<[f32; 2]> = coordinates.collect();
        let corners = scan.source.triangles.as_flattened().iter();
        let arrays = [
            ("positions", bytes_of(scan.positions.as_flattened())),
            ("texture_coordinates", bytes_of(coordinates.as_flattened())),
            ("heights", bytes_of(&scan.heights)),
            ("corners", corners.flat_map(|c| c.to_le_bytes()).collect()),
            ("print", textures.print.clone()),
            ("masks", textures.masks.clone()),
        ];
        encode(self.header(), arrays)
    }

    /// Returns the header without the list of arrays.
    fn header(&self) -> Value {
        let (scan, textures) = (&self.inputs.scan, &self.inputs.textures);
        let mut heights = scan.heights.clone();
        heights.sort_unstable_by(f32::total_cmp);
        let last = heights.len().saturating_sub(1) as f64;
        let height = |share: f64| heights.get((share * last).round() as usize).copied();
        json!({
            "version": 1,
            "pair": self.pair,
            "metric": self.metric,
            "unit": self.inputs.placement.unit().map(|_| LengthUnit::Mm.name()),
            "vertices": scan.positions.len(),
            "triangles": scan.source.triangles.len(),
            "source_elements": self.inputs.source_elements,
            "threshold": self.threshold,
            "height_range": [height(OUTSIDE_RANGE), height(1.0 - OUTSIDE_RANGE)],
            "writing_is_mirrored": self.inputs.placement.writing_is_mirrored(),
            "print_size": textures.print_size,
            "texture_size": textures.size,
            "arrays": {},
        })
    }
}

/// Returns the scale with the unit of the manifest if the result has none.
fn with_unit(scale: &DepthScale, pair: &PairResults) -> DepthScale {
    DepthScale {
        unit: scale.unit.or(pair.attributes.unit),
        ..scale.clone()
    }
}

/// Returns the file of a header, to which the places of the arrays are added, and arrays by name.
pub(super) fn encode<const N: usize>(
    mut header: Value,
    arrays: [(&'static str, Vec<u8>); N],
) -> Vec<u8> {
    let mut offset = 0;
    for (name, bytes) in &arrays {
        header["arrays"][*name] = json!({"offset": offset, "bytes": bytes.len()});
        offset += bytes.len().next_multiple_of(4);
    }
    let mut text = header.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = Vec::with_capacity(4 + text.len() + offset);
    file.extend((text.len() as u32).to_le_bytes());
    file.extend(text);
    for (_, bytes) in arrays {
        file.extend(bytes);
        file.resize(file.len().next_multiple_of(4), 0);
    }
    file
}

pub(super) fn bytes_of(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}
