//! Reads the inputs of stages: input files, and results of earlier stages from memory or from artifacts.

use super::options::RunOptions;
use super::pair_context::PairContext;
use super::run_metrics::{RunMetrics, TimedRead};
use super::stage_output::PairStageError;
use mocban_align::stages::normalize::{Normalized, PrintMasks};
use mocban_align::stages::{Print, Scan};
use mocban_core::domain::artifact_role::{DEPTH, print_mask};
use mocban_core::domain::{
    DepthOutcome, Failure, FailureClass, FitOutcome, InputVersion, NormalizeOutcome, Stage,
    WaitReason,
};
use mocban_core::raster::{self, DepthMap};
use mocban_core::{InputLimits, mesh};
use mocban_store::{ArtifactError, InputError, Project, open_input, read_input};

/// Where the stages of a project read from, and how large files may be.
#[derive(Debug)]
pub(super) struct StageInputs {
    project: Project,
    limits: InputLimits,
    metrics: RunMetrics,
}

impl StageInputs {
    pub(super) fn new(project: &Project, options: &RunOptions) -> Self {
        Self {
            project: project.clone(),
            limits: options.limits,
            metrics: options.metrics.clone(),
        }
    }

    /// Returns the fit's outcome, from memory or as stored.
    pub(super) fn fit(pair: &PairContext) -> Result<FitOutcome, PairStageError> {
        let fit = pair.fit.clone();
        fit.or_else(|| pair.outcome(Stage::Fit))
            .ok_or(PairStageError::RerunFrom(Stage::Fit))
    }

    /// Returns the fitted scan from memory, or reads the mesh file again. If the file has changed, the fit runs again.
    pub(super) fn fitted_scan(&self, pair: &mut PairContext) -> Result<Scan, PairStageError> {
        if let Some(scan) = pair.scan.take() {
            return Ok(scan);
        }
        let fitted = pair.mesh_hash();
        let scan = self.read_scan(pair)?;
        if fitted == pair.mesh_hash() {
            return Ok(scan);
        }
        pair.scan = Some(scan);
        Err(PairStageError::RerunFrom(Stage::Fit))
    }

    /// Returns the print from memory, or reads its file. If the file has changed since the fit read it, the fit runs
    /// again.
    pub(super) fn print(&self, pair: &mut PairContext) -> Result<Print, PairStageError> {
        if let Some(print) = pair.print.take() {
            return Ok(print);
        }
        let fit = pair.stored.get(&Stage::Fit);
        let fitted = fit.and_then(|stored| stored.print_hash);
        let print = self.read_print(pair)?;
        if fitted.is_none_or(|fitted| pair.print_hash() == Some(fitted)) {
            return Ok(print);
        }
        Err(PairStageError::RerunFrom(Stage::Fit))
    }

    /// Takes the depth map out of memory, or reads its artifact.
    pub(super) fn depth_map(&self, pair: &mut PairContext) -> Result<DepthMap, PairStageError> {
        if let Some(map) = pair.depth.take() {
            return Ok(map);
        }
        let rerun = || PairStageError::RerunFrom(Stage::Depth);
        let outcome: DepthOutcome = pair.outcome(Stage::Depth).ok_or_else(rerun)?;
        let bytes = self.artifact(pair, Stage::Depth, DEPTH)?;
        let levels = raster::decode_grey16(&bytes).ok().ok_or_else(rerun)?;
        Ok(DepthMap {
            levels,
            scale: outcome.scale,
        })
    }

    /// Takes the print's masks out of memory, or reads their artifact.
    pub(super) fn normalized(&self, pair: &mut PairContext) -> Result<Normalized, PairStageError> {
        if let Some(normalized) = pair.normalized.take() {
            return Ok(normalized);
        }
        let rerun = || PairStageError::RerunFrom(Stage::Normalize);
        let outcome: NormalizeOutcome = pair.outcome(Stage::Normalize).ok_or_else(rerun)?;
        let mut prints = Vec::new();
        for ink in 0..outcome.inks.len() {
            let bytes = self.artifact(pair, Stage::Normalize, &print_mask(ink))?;
            let grey = raster::decode_grey8(&bytes).ok().ok_or_else(rerun)?;
            let (scale, size) = (outcome.mask_scale(), [grey.width(), grey.height()]);
            if scale.mask_size(scale.print_size(size)) != Some(size) {
                return Err(rerun());
            }
            prints.push(PrintMasks::from_grey(&grey, scale));
        }
        Ok(Normalized { outcome, prints })
    }

    /// Reads an artifact of an earlier stage. If the artifact is missing or was changed, the earlier stage runs again.
    fn artifact(
        &self,
        pair: &PairContext,
        stage: Stage,
        role: &str,
    ) -> Result<Vec<u8>, PairStageError> {
        let artifact = pair
            .stored
            .get(&stage)
            .and_then(|stored| stored.files.get(role))
            .ok_or(PairStageError::RerunFrom(stage))?;
        pair.file_in_use
            .set(Some(&self.project.artifact_path(artifact)));
        let bytes = self.metrics.waiting(WaitReason::Artifacts, || {
            self.project.read_artifact(artifact)
        });
        pair.file_in_use.set(None);
        bytes.map_err(|error| match error {
                ArtifactError::Missing(_) | ArtifactError::Changed(_) => {
                    tracing::warn!(pair = %pair.attributes.name, %stage, "{error}; the stage runs again");
                    PairStageError::RerunFrom(stage)
                }
                ArtifactError::NoStore(_) | ArtifactError::Bucket(_) => {
                    PairStageError::Store(error)
                }
                ArtifactError::Io { .. } | ArtifactError::Moved(_) | ArtifactError::Blocked { .. } => {
                    PairStageError::Failed {
                        failure: Failure::new(FailureClass::Io, error.to_string()),
                        is_transient: !matches!(error, ArtifactError::Blocked { .. }),
                    }
                }
            })
    }

    /// Reads the mesh file, and records its hash in the pair.
    pub(super) fn read_scan(&self, pair: &mut PairContext) -> Result<Scan, PairStageError> {
        let stored = &pair.attributes.mesh_path;
        let input = self.project.input(stored);
        let limit = self.limits.mesh.max_bytes;
        pair.file_in_use.set(Some(input.path()));
        let open = || open_input(&input, limit, "limits.mesh.max_bytes");
        let opened = self.metrics.waiting(WaitReason::Inputs, open);
        let mut file = opened.map_err(|error| unopened(error, &mut pair.inputs.mesh))?;
        let size = file.size();
        let mut timed = TimedRead::new(&mut file);
        let mesh = mesh::read_from(&mut timed, size, stored, &self.limits.mesh);
        self.metrics.add_wait(WaitReason::Inputs, timed.elapsed);
        let mesh = match mesh {
            Err(mesh::MeshReadError::Io(error)) => return Err(unreadable(file.error(error))),
            Err(mesh::MeshReadError::Mesh(error)) => Err(error),
            Ok(mesh) => Ok(mesh),
        };
        pair.inputs.mesh = Some(file.finish().map_err(unreadable)?);
        pair.file_in_use.set(None);
        let mesh = mesh.map_err(|error| {
            let message = format!("{stored}: {error}");
            PairStageError::failed(error.class(), message)
        })?;
        Ok(mesh.into())
    }

    /// Reads the print image, and records its hash in the pair.
    pub(super) fn read_print(&self, pair: &mut PairContext) -> Result<Print, PairStageError> {
        let stored = &pair.attributes.print_path;
        let input = self.project.input(stored);
        let limit = self.limits.image.max_bytes;
        pair.file_in_use.set(Some(input.path()));
        let read = || read_input(&input, limit, "limits.image.max_bytes");
        let read = self.metrics.waiting(WaitReason::Inputs, read);
        let file = read.map_err(|error| unopened(error, &mut pair.inputs.print))?;
        pair.inputs.print = Some(file.version);
        pair.file_in_use.set(None);
        let image = raster::decode(&file.bytes, &self.limits.image).map_err(|error| {
            let message = format!("{stored}: {error}");
            PairStageError::failed(error.class(), message)
        })?;
        if let Some(warning) = image.profile_warning() {
            tracing::warn!("{stored}: {warning}");
        }
        Ok(Print::from(image))
    }
}

/// Stores with the failure that there is no file to read, so that a later run takes the pair up when it is there.
fn unopened(error: InputError, version: &mut Option<InputVersion>) -> PairStageError {
    if error.is_correctable() {
        *version = Some(InputVersion::gone());
    }
    unreadable(error)
}

fn unreadable(error: InputError) -> PairStageError {
    if let InputError::Store(error) = error {
        return PairStageError::Store(ArtifactError::Bucket(error));
    }
    let is_transient = error.is_transient();
    PairStageError::Failed {
        failure: Failure::new(error.class(), error.to_string()),
        is_transient,
    }
}
