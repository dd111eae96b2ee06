//! The real stages on real files: reads inputs and earlier artifacts, calls the pure stages, encodes what they give.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::options::RunOptions;
use super::pair_context::PairContext;
use super::stage_output;
use super::steps::{ExecutionError, StageExecutor, StageOutput};
use crate::catalog::InputVersion;
use crate::domain::{DepthOutcome, Failure, FailureClass, FitOutcome, NormalizeOutcome, Stage};
use crate::mesh;
use crate::raster::{self, DepthMap};
use crate::stages::normalize::Normalized;
use crate::stages::{Print, Scan, Settings, StageError, depth, fit, normalize, register};
use crate::store::{ArtifactError, InputDigest, InputError, Project, open_input, read_input};

/// The stages of one project with their settings.
#[derive(Debug)]
pub(super) struct PipelineExecutor {
    project: Project,
    settings: Settings,
    mesh_limits: mesh::MeshLimits,
    image_limits: raster::ImageLimits,
}

impl StageExecutor for PipelineExecutor {
    fn run(&self, stage: Stage, pair: &mut PairContext) -> Result<StageOutput, ExecutionError> {
        match stage {
            Stage::Fit => self.fit(pair),
            Stage::Depth => self.depth(pair),
            Stage::Normalize => self.normalize(pair),
            Stage::Register => self.register(pair),
        }
    }
}

impl PipelineExecutor {
    /// The stages of a run.
    pub(super) fn new(project: &Project, settings: &Settings, options: &RunOptions) -> Self {
        Self {
            project: project.clone(),
            settings: settings.clone(),
            mesh_limits: options.mesh_limits,
            image_limits: options.image_limits,
        }
    }

    fn fit(&self, pair: &mut PairContext) -> Result<StageOutput, ExecutionError> {
        let scan = self.read_scan(pair)?;
        // The paper's fit does not look at the print, so a changed print need not send its results back so far.
        let print = match self.settings.fit.method {
            fit::FitMethod::UpperSurface => Some(self.read_print(pair)?),
            fit::FitMethod::Paper => None,
        };
        let face_down = pair.attributes.scanned_face_down;
        let outcome = fit::fit(&scan, print.as_ref(), face_down, &self.settings.fit)
            .map_err(|error| in_file(&pair.attributes.mesh_path, &error.into()))?;
        let (outcome, json) = settled(&outcome)?;
        (pair.scan, pair.print) = (Some(scan), print);
        pair.fit = Some(outcome);
        Ok(stage_output::numbers(json))
    }

    fn depth(&self, pair: &mut PairContext) -> Result<StageOutput, ExecutionError> {
        let fit = Self::fitted(pair)?;
        // The scan is not needed after this stage; taken out, its memory is the next pair's.
        let scan = self.scan_of_fit(pair)?;
        let map = depth::depth(&scan, &fit, pair.attributes.unit, &self.settings.depth)
            .map_err(|error| in_file(&pair.attributes.mesh_path, &error.into()))?;
        let (outcome, json) = settled(&stage_output::depth_outcome(&map))?;
        let output = stage_output::depth(json, &map);
        pair.depth = Some(DepthMap {
            scale: outcome.scale,
            ..map
        });
        Ok(output)
    }

    fn normalize(&self, pair: &mut PairContext) -> Result<StageOutput, ExecutionError> {
        let depth = self.depth_map(pair)?;
        let print = self.print_of_fit(pair)?;
        let normalized =
            normalize::normalize(&depth, &print, &self.settings.normalize).map_err(|error| {
                // Only a print without ink is the print's fault; all else speaks of the relief.
                let blamed = match error {
                    normalize::NormalizeError::Print(_) => &pair.attributes.print_path,
                    normalize::NormalizeError::NoStrokes
                    | normalize::NormalizeError::Mirrored { .. }
                    | normalize::NormalizeError::NoMatch { .. } => &pair.attributes.mesh_path,
                };
                in_file(blamed, &error.into())
            })?;
        pair.depth = Some(depth);
        let (outcome, json) = settled(&normalized.outcome)?;
        let grey = stage_output::print_mask(&normalized.ink, &normalized.known);
        let output = stage_output::normalized(json, &grey);
        pair.normalized = Some(stage_output::from_print_mask(outcome, &grey));
        Ok(output)
    }

    fn register(&self, pair: &mut PairContext) -> Result<StageOutput, ExecutionError> {
        let depth = self.depth_map(pair)?;
        let normalized = self.normalized(pair)?;
        let registered = register::register(&depth, &normalized, &self.settings.register)
            .map_err(|error| in_file(&pair.attributes.print_path, &error.into()))?;
        let (outcome, json) = settled(&registered.outcome)?;
        Ok(stage_output::registered(json, outcome, &registered))
    }

    /// The fit's outcome, from memory or as stored.
    fn fitted(pair: &PairContext) -> Result<FitOutcome, ExecutionError> {
        let fit = pair.fit.clone();
        fit.or_else(|| pair.outcome(Stage::Fit))
            .ok_or(ExecutionError::RerunFrom(Stage::Fit))
    }

    /// The scan that was fitted. When the file is another one by now, the fit is no fit of it.
    fn scan_of_fit(&self, pair: &mut PairContext) -> Result<Scan, ExecutionError> {
        if let Some(scan) = pair.scan.take() {
            return Ok(scan);
        }
        let fitted = pair.mesh_hash();
        let scan = self.read_scan(pair)?;
        if fitted == pair.mesh_hash() {
            return Ok(scan);
        }
        pair.scan = Some(scan);
        Err(ExecutionError::RerunFrom(Stage::Fit))
    }

    /// The print. When it is another one by now than the one that the fit looked at, the fit is no fit for it.
    fn print_of_fit(&self, pair: &mut PairContext) -> Result<Print, ExecutionError> {
        if let Some(print) = pair.print.take() {
            return Ok(print);
        }
        let seen = pair
            .stored
            .get(&Stage::Fit)
            .and_then(|stored| stored.print_hash);
        let print = self.read_print(pair)?;
        if seen.is_none_or(|seen| pair.print_hash() == Some(seen)) {
            return Ok(print);
        }
        Err(ExecutionError::RerunFrom(Stage::Fit))
    }

    /// The depth map, from memory or from its artifact.
    fn depth_map(&self, pair: &mut PairContext) -> Result<DepthMap, ExecutionError> {
        if let Some(map) = pair.depth.take() {
            return Ok(map);
        }
        let back = || ExecutionError::RerunFrom(Stage::Depth);
        let outcome: DepthOutcome = pair.outcome(Stage::Depth).ok_or_else(back)?;
        let bytes = self.artifact(pair, Stage::Depth, stage_output::DEPTH)?;
        let levels = raster::decode_grey16(&bytes).ok().ok_or_else(back)?;
        Ok(DepthMap {
            levels,
            scale: outcome.scale,
        })
    }

    /// The print's masks, from memory or from their artifact.
    fn normalized(&self, pair: &mut PairContext) -> Result<Normalized, ExecutionError> {
        if let Some(normalized) = pair.normalized.take() {
            return Ok(normalized);
        }
        let back = || ExecutionError::RerunFrom(Stage::Normalize);
        let outcome: NormalizeOutcome = pair.outcome(Stage::Normalize).ok_or_else(back)?;
        let bytes = self.artifact(pair, Stage::Normalize, stage_output::PRINT_MASK)?;
        let grey = raster::decode_grey8(&bytes).ok().ok_or_else(back)?;
        Ok(stage_output::from_print_mask(outcome, &grey))
    }

    /// An artifact of an earlier stage. When it is gone or changed, that stage runs again.
    fn artifact(
        &self,
        pair: &PairContext,
        stage: Stage,
        role: &str,
    ) -> Result<Vec<u8>, ExecutionError> {
        let artifact = pair
            .stored
            .get(&stage)
            .and_then(|stored| stored.files.get(role))
            .ok_or(ExecutionError::RerunFrom(stage))?;
        self.project
            .read_artifact(artifact)
            .map_err(|error| match error {
                ArtifactError::Missing(_) | ArtifactError::Changed(_) => {
                    tracing::warn!(pair = %pair.attributes.name, %stage, "{error}; the stage runs again");
                    ExecutionError::RerunFrom(stage)
                }
                ArtifactError::Io { .. } => ExecutionError::Failed {
                    failure: Failure::new(FailureClass::Io, error.to_string()),
                    is_transient: true,
                },
            })
    }

    fn read_scan(&self, pair: &mut PairContext) -> Result<Scan, ExecutionError> {
        let stored = &pair.attributes.mesh_path;
        let path = self.project.input_path(stored);
        let limit = self.mesh_limits.max_bytes;
        let mut file = open_input(&path, limit, "limits.mesh.max_bytes").map_err(unread)?;
        let about = file.size();
        let mesh = match mesh::read_from(&mut file, about, stored, &self.mesh_limits) {
            Err(mesh::MeshReadError::Io(error)) => return Err(unread(file.error(error))),
            Err(mesh::MeshReadError::Mesh(error)) => Err(error),
            Ok(mesh) => Ok(mesh),
        };
        pair.inputs.mesh = Some(seen(file.finish().map_err(unread)?));
        let mesh = mesh.map_err(|error| {
            let message = format!("{stored}: {error}");
            ExecutionError::failed(error.class(), message)
        })?;
        Ok(mesh.into())
    }

    fn read_print(&self, pair: &mut PairContext) -> Result<Print, ExecutionError> {
        let stored = &pair.attributes.print_path;
        let path = self.project.input_path(stored);
        let limit = self.image_limits.max_bytes;
        let file = read_input(&path, limit, "limits.image.max_bytes").map_err(unread)?;
        pair.inputs.print = Some(seen(file.seen));
        let picture = raster::decode(&file.bytes, &self.image_limits).map_err(|error| {
            let message = format!("{stored}: {error}");
            ExecutionError::failed(error.class(), message)
        })?;
        Ok(Print::from(picture))
    }
}

fn seen(InputDigest { hash, stat }: InputDigest) -> InputVersion {
    InputVersion {
        hash,
        stat: stat.as_str().to_owned(),
    }
}

#[expect(clippy::needless_pass_by_value, reason = "shaped for `map_err`")]
fn unread(error: InputError) -> ExecutionError {
    let is_transient = error.is_transient();
    ExecutionError::Failed {
        failure: Failure::new(error.class(), error.to_string()),
        is_transient,
    }
}

fn in_file(path: &str, error: &StageError) -> ExecutionError {
    ExecutionError::failed(error.class(), format!("{path}: {error}"))
}

/// An outcome as it will be read back, with its JSON. A number that JSON cannot hold is a defect of the stage.
fn settled<T: Serialize + DeserializeOwned + PartialEq>(
    outcome: &T,
) -> Result<(T, String), ExecutionError> {
    let json = serde_json::to_value(outcome).map(|value| value.to_string());
    let back = json.and_then(|json| Ok((serde_json::from_str::<T>(&json)?, json)));
    match back {
        Ok((back, json)) if back == *outcome => Ok((back, json)),
        Ok(_) | Err(_) => Err(ExecutionError::failed(
            FailureClass::Bug,
            "the stage gave a number that is not finite",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::settled;
    use crate::domain::Affine2;

    #[test]
    fn every_finite_number_comes_back_bit_for_bit() {
        let odd = Affine2([
            [0.1 + 0.2, f64::MIN_POSITIVE, 1e300],
            [-0.0, 1.0 / 3.0, 5e-324],
        ]);
        let (back, _) = settled(&odd).expect("finite numbers");
        let bits = |map: Affine2| map.0.map(|row| row.map(f64::to_bits));
        assert_eq!(bits(back), bits(odd));
    }

    #[test]
    fn a_number_that_is_not_finite_is_a_defect() {
        assert!(settled(&Affine2([[f64::NAN; 3]; 2])).is_err());
    }
}
