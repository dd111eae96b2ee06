//! Writes and reads the artifacts of the stages of a block.

use std::sync::{Mutex, PoisonError};

use super::block_stages::{BlockArtifacts, BlockStageError};
use crate::domain::{
    ArtifactRef, ArtifactSet, BlockName, BlockStage, BlockStageRecord, Failure, FailureClass,
};
use crate::failpoint::{self, Point};
use crate::store::{ArtifactError, NewArtifact, Project};

/// The artifacts of a stage in progress.
pub(super) struct StageArtifacts<'a> {
    project: &'a Project,
    block: &'a BlockName,
    stage: BlockStage,
    written: Mutex<ArtifactSet>,
}

impl<'a> StageArtifacts<'a> {
    /// Creates an empty set of artifacts.
    pub(super) fn new(project: &'a Project, block: &'a BlockName, stage: BlockStage) -> Self {
        Self {
            project,
            block,
            stage,
            written: Mutex::default(),
        }
    }

    /// Returns the artifacts that were written, by role.
    pub(super) fn finish(self) -> ArtifactSet {
        let written = self.written.into_inner();
        written.unwrap_or_else(PoisonError::into_inner)
    }
}

impl BlockArtifacts for StageArtifacts<'_> {
    fn write(&self, role: &str, ext: &str, bytes: Vec<u8>) -> Result<ArtifactRef, BlockStageError> {
        let file = NewArtifact::new(role, ext, bytes);
        let reference = file.reference().clone();
        let on_written = || failpoint::hit(self.stage, Point::Written, Some(self.block));
        let files = std::slice::from_ref(&file);
        let outcome = self.project.write_artifacts(files, &on_written);
        outcome.map_err(|error| failed(&error))?;
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        let earlier = written.insert(role.to_owned(), reference.clone());
        if earlier.is_some_and(|earlier| earlier != reference) {
            let text = format!("the stage {} wrote {role} twice", self.stage);
            return Err(BlockStageError::failed(FailureClass::Bug, text));
        }
        Ok(reference)
    }

    fn read(&self, record: &BlockStageRecord, role: &str) -> Result<Vec<u8>, BlockStageError> {
        let rerun = || BlockStageError::RerunFrom(record.stage);
        let artifact = record.files.get(role).ok_or_else(rerun)?;
        self.project
            .read_artifact(artifact)
            .map_err(|error| match error {
                ArtifactError::Missing(_) | ArtifactError::Changed(_) => {
                    tracing::warn!(block = %self.block, stage = %record.stage, "{error}; the stage runs again");
                    rerun()
                }
                error => failed(&error),
            })
    }
}

fn failed(error: &ArtifactError) -> BlockStageError {
    BlockStageError::Failed {
        failure: Failure::new(FailureClass::Io, error.to_string()),
        is_transient: !matches!(error, ArtifactError::Moved(_) | ArtifactError::NoStore(_)),
    }
}
