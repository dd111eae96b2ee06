//! Runs the stages of a pair: reads the inputs of a stage, calls its pure function, and encodes the result.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::memory_estimate::{self, PAIR_BYTES};
use super::options::RunOptions;
use super::pair_context::PairContext;
use super::stage_inputs::StageInputs;
use super::stage_output::{self, PairStageError, PairStageOutput, png};
use mocban_align::scan_size;
use mocban_align::stages::fit::ExpectedFace;
use mocban_align::stages::normalize::{Normalized, PrintMasks};
use mocban_align::stages::register::ExpectedPose;
use mocban_align::stages::{ScanHints, Settings, StageError, depth, pipeline};
use mocban_core::domain::artifact_role::{
    CANVAS_PRINT_MASK, DEPTH, canvas_depth_mask, print_mask, stroke_map,
};
use mocban_core::domain::{AlignmentPrior, ArtifactRef, FailureClass, Stage};
use mocban_core::raster::{DepthMap, png_grey8, png_grey16, png_mask};
use mocban_store::Project;

/// Runs stages on a pair's thread. In tests, fake stages fail or hang.
pub(super) trait PairStages: Send + Sync + 'static {
    /// Runs a stage, and leaves in the pair what later stages need.
    fn run(&self, stage: Stage, pair: &mut PairContext) -> Result<PairStageOutput, PairStageError>;

    /// Returns the memory in bytes for the maps and masks of a pair.
    fn map_bytes(&self) -> u64 {
        PAIR_BYTES
    }
}

/// Runs the stages of a project with its settings.
#[derive(Debug)]
pub(super) struct PairPipeline {
    inputs: StageInputs,
    settings: Settings,
}

impl PairStages for PairPipeline {
    fn run(&self, stage: Stage, pair: &mut PairContext) -> Result<PairStageOutput, PairStageError> {
        match stage {
            Stage::Fit => self.fit(pair),
            Stage::Depth => self.depth(pair),
            Stage::Normalize => self.normalize(pair),
            Stage::Register => self.register(pair),
        }
    }

    fn map_bytes(&self) -> u64 {
        memory_estimate::map_bytes(&self.settings.depth)
    }
}

impl PairPipeline {
    /// Creates a pipeline with the settings and limits of a run.
    pub(super) fn new(project: &Project, settings: &Settings, options: &RunOptions) -> Self {
        Self {
            inputs: StageInputs::new(project, options),
            settings: settings.clone(),
        }
    }

    fn fit(&self, pair: &mut PairContext) -> Result<PairStageOutput, PairStageError> {
        let scan = self.inputs.read_scan(pair)?;
        for said in scan.losses().sentences() {
            tracing::warn!(pair = %pair.attributes.name, "{}: {said}", pair.attributes.mesh_path);
        }
        let length = scan_size::length_of(&scan.mesh().vertices);
        if let Some(reason) = scan_size::wrong_unit(length, pair.attributes.unit) {
            let path = &pair.attributes.mesh_path;
            let text = if pair.attributes.is_listed() {
                format!("{path}: {reason} in the list, and import it again")
            } else {
                format!("{path}: {reason}, and import it again")
            };
            return Err(PairStageError::failed(FailureClass::BadInput, text));
        }
        // A fit that does not read the print stays valid when the print changes.
        let print = if self.settings.fit_reads_print() {
            Some(self.inputs.read_print(pair)?)
        } else {
            None
        };
        let face_down = pair.attributes.scanned_face_down;
        let face = expected_face(pair)?;
        let settings = &self.settings;
        let outcome = pipeline::fit(&scan, print.as_ref(), face_down, face.as_ref(), settings)
            .map_err(|error| in_file(pair, &error.into(), length))?;
        let hints = ScanHints {
            unit: pair.attributes.unit,
            scanned_face_down: face_down,
        };
        for said in scan_size::contradictions(&outcome, hints) {
            tracing::warn!(pair = %pair.attributes.name, "{}: {said}", pair.attributes.mesh_path);
        }
        let (outcome, json) = round_trip(&outcome)?;
        (pair.scan, pair.print) = (Some(scan), print);
        pair.fit = Some(outcome);
        Ok(PairStageOutput::numbers(json))
    }

    fn depth(&self, pair: &mut PairContext) -> Result<PairStageOutput, PairStageError> {
        let fit = StageInputs::fit(pair)?;
        // This function drops the scan, because no later stage needs it. Another pair can then use the memory.
        let scan = self.inputs.fitted_scan(pair)?;
        let map = depth::depth(&scan, &fit, pair.attributes.unit, &self.settings.depth)
            .map_err(|error| in_file(pair, &error.into(), 0.0))?;
        let attributes = &pair.attributes;
        // A block warns once about the unit of all pairs that are cut from it.
        if attributes.prior.is_none()
            && let Some(said) =
                scan_size::doubtful_surface(scan_size::length_of_map(&map), attributes.unit)
        {
            tracing::warn!(pair = %attributes.name, "{}: {said}", attributes.mesh_path);
        }
        let (outcome, json) = round_trip(&stage_output::depth_outcome(&map))?;
        let output = PairStageOutput {
            files: vec![png(DEPTH, png_grey16(&map.levels))],
            ..PairStageOutput::numbers(json)
        };
        pair.depth = Some(DepthMap {
            scale: outcome.scale,
            ..map
        });
        Ok(output)
    }

    fn normalize(&self, pair: &mut PairContext) -> Result<PairStageOutput, PairStageError> {
        let depth = self.inputs.depth_map(pair)?;
        let fit = StageInputs::fit(pair)?;
        let print = self.inputs.print(pair)?.within(fit.print_outline.as_ref());
        let normalized = pipeline::normalize(&depth, &print, &self.settings)
            .map_err(|error| in_file(pair, &error.into(), scan_size::length_of_map(&depth)))?;
        pair.depth = Some(depth);
        let (outcome, json) = round_trip(&normalized.outcome)?;
        let masks: Vec<_> = normalized.prints.iter().map(PrintMasks::to_grey).collect();
        let files = masks.iter().enumerate();
        let output = PairStageOutput {
            files: files
                .map(|(ink, grey)| png(&print_mask(ink), png_grey8(grey)))
                .collect(),
            ..PairStageOutput::numbers(json)
        };
        pair.normalized = Some(Normalized {
            outcome,
            ..normalized
        });
        Ok(output)
    }

    fn register(&self, pair: &mut PairContext) -> Result<PairStageOutput, PairStageError> {
        let depth = self.inputs.depth_map(pair)?;
        let normalized = self.inputs.normalized(pair)?;
        let expected = expected_pose(pair, &depth)?;
        let registered = pipeline::register(&depth, &normalized, expected.as_ref(), &self.settings)
            .map_err(|error| in_file(pair, &error.into(), scan_size::length_of_map(&depth)))?;
        let (outcome, json) = round_trip(&registered.outcome)?;
        let mut files = vec![png(CANVAS_PRINT_MASK, png_mask(&registered.canvas_print))];
        for (metric, mask) in outcome.metrics.iter().zip(&registered.canvas_depths) {
            files.push(png(&canvas_depth_mask(metric.metric), png_mask(mask)));
        }
        let maps = &registered.stroke_maps;
        let mut encoded: Vec<Vec<u8>> = Vec::new();
        for (metric, map) in outcome.metrics.iter().zip(maps) {
            // Metrics often have equal maps, above all empty ones.
            let twin = maps[..encoded.len()].iter().position(|other| other == map);
            let image = twin.map_or_else(|| png_grey8(map), |twin| encoded[twin].clone());
            files.push(png(&stroke_map(metric.metric), image.clone()));
            encoded.push(image);
        }
        Ok(PairStageOutput {
            outcome: json,
            files,
            metrics: outcome.metrics,
        })
    }
}

/// Returns the pose that the registration of the block expects; `None` for a pair that was not cut from one.
fn expected_pose(
    pair: &PairContext,
    depth: &DepthMap,
) -> Result<Option<ExpectedPose>, PairStageError> {
    let Some(prior) = alignment_prior(pair)? else {
        return Ok(None);
    };
    let fit = StageInputs::fit(pair)?;
    let scale = &depth.scale.depth_from_plane;
    let pose = prior
        .print_from_mesh
        .print_from_depth(scale, &fit.plane_from_mesh);
    Ok(pose.map(|print_from_depth| ExpectedPose {
        print_from_depth,
        confidence: prior.confidence,
    }))
}

/// Returns the face that the scan of the block shows around the character; `None` for a pair that was not cut from one.
fn expected_face(pair: &PairContext) -> Result<Option<ExpectedFace>, PairStageError> {
    let prior = alignment_prior(pair)?;
    Ok(prior.map(|prior| {
        let [.., [x, y, z, _]] = prior.print_from_mesh.0;
        ExpectedFace { normal: [x, y, z] }
    }))
}

/// Returns what the registration of the block expects; `None` for a pair that was not cut from one.
fn alignment_prior(pair: &PairContext) -> Result<Option<AlignmentPrior>, PairStageError> {
    let Some(prior) = &pair.attributes.prior else {
        return Ok(None);
    };
    let prior = serde_json::from_str(prior).map_err(|error| {
        let text = format!(
            "the expected alignment of {}: {error}",
            pair.attributes.name
        );
        PairStageError::failed(FailureClass::Bug, text)
    })?;
    Ok(Some(prior))
}

/// Returns the failure of a stage on the likelier of the two files. `length` is that of the scan in its unit, or 0 if it
/// does not matter.
fn in_file(pair: &PairContext, error: &StageError, length: f64) -> PairStageError {
    let attributes = &pair.attributes;
    let (word, path) = if error.is_of_print() {
        ("print", &attributes.print_path)
    } else {
        ("mesh", &attributes.mesh_path)
    };
    let file = match ArtifactRef::at_path(path) {
        // A file that was cut from a block: its path says nothing to a user.
        Some(_) => format!("the {word} of {}", attributes.name),
        None => path.clone(),
    };
    let advice = scan_size::advice_for(error, length, attributes.unit);
    PairStageError::failed(error.class(), format!("{file}: {error}{advice}"))
}

/// Encodes an outcome as JSON. Returns the outcome as a later run would decode it, and the JSON.
///
/// # Errors
/// Returns an error if a number is not finite, because JSON cannot hold it.
fn round_trip<T: Serialize + DeserializeOwned + PartialEq>(
    outcome: &T,
) -> Result<(T, Value), PairStageError> {
    let json = serde_json::to_value(outcome);
    let read = json.and_then(|json| Ok((serde_json::from_str::<T>(&json.to_string())?, json)));
    match read {
        Ok((read, json)) if read == *outcome => Ok((read, json)),
        Ok(_) | Err(_) => Err(PairStageError::failed(
            FailureClass::Bug,
            "the stage returned a number that is not finite",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::round_trip;
    use mocban_core::domain::Affine2;

    #[test]
    fn every_finite_number_comes_back_bit_for_bit() {
        let odd = Affine2([
            [0.1 + 0.2, f64::MIN_POSITIVE, 1e300],
            [-0.0, 1.0 / 3.0, 5e-324],
        ]);
        let (back, _) = round_trip(&odd).expect("finite numbers");
        let bits = |map: Affine2| map.0.map(|row| row.map(f64::to_bits));
        assert_eq!(bits(back), bits(odd));
    }

    #[test]
    fn a_number_that_is_not_finite_is_an_error() {
        assert!(round_trip(&Affine2([[f64::NAN; 3]; 2])).is_err());
    }
}
