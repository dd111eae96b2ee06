//! Writes and reads the artifacts of the stages of a block.

use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;

use crate::block_stages::{BlockArtifacts, BlockStageError};
use mocban_core::domain::{
    ArtifactRef, ArtifactSet, BlockName, BlockStage, BlockStageRecord, Failure, FailureClass,
};
use mocban_core::locked;
use mocban_store::{ArtifactError, NewArtifact, Project};
use mocban_system::failpoint::{self, Point};

/// The artifacts of a stage in progress. In an object store, they are one pack, except for the meshes and prints of
/// characters: pairs read these as inputs, so each is an object of its own.
pub(crate) struct StageArtifacts<'a> {
    project: &'a Project,
    block: &'a BlockName,
    stage: BlockStage,
    written: Mutex<ArtifactSet>,
    /// Artifacts for the pack.
    packed: Mutex<Vec<NewArtifact>>,
    /// When the first file was written.
    began: OnceLock<Instant>,
}

impl<'a> StageArtifacts<'a> {
    /// Creates an empty set of artifacts.
    pub(crate) fn new(project: &'a Project, block: &'a BlockName, stage: BlockStage) -> Self {
        Self {
            project,
            block,
            stage,
            written: Mutex::default(),
            packed: Mutex::default(),
            began: OnceLock::new(),
        }
    }

    /// Stores the pack. Returns the artifacts that were written, by role, and when the first write began.
    pub(crate) fn finish(self) -> Result<(ArtifactSet, Instant), BlockStageError> {
        let began = *self.began.get_or_init(Instant::now);
        let written = self.written.into_inner();
        let mut written = written.unwrap_or_else(PoisonError::into_inner);
        let packed = self.packed.into_inner();
        let packed = packed.unwrap_or_else(PoisonError::into_inner);
        if packed.is_empty() {
            return Ok((written, began));
        }
        failpoint::hit(self.stage, Point::Written, Some(self.block));
        let locations = self.project.write_pack(&packed).map_err(unwritten)?;
        for (file, location) in packed.iter().zip(locations) {
            if let Some(artifact) = written.get_mut(file.role()) {
                artifact.pack = Some(location);
            }
        }
        Ok((written, began))
    }

    /// Writes an artifact, or keeps it for the pack.
    fn store(&self, file: NewArtifact) -> Result<(), BlockStageError> {
        let on_written = || failpoint::hit(self.stage, Point::Written, Some(self.block));
        if !self.project.has_packs() || self.stage == BlockStage::Cut {
            self.began.get_or_init(Instant::now);
        }
        if !self.project.has_packs() {
            let files = std::slice::from_ref(&file);
            return (self.project.write_artifacts(files, &on_written)).map_err(unwritten);
        }
        if self.stage == BlockStage::Cut {
            on_written();
            return self.project.write_objects(&[file]).map_err(unwritten);
        }
        let mut packed = locked(&self.packed);
        packed.push(file);
        Ok(())
    }
}

impl BlockArtifacts for StageArtifacts<'_> {
    fn write(&self, role: &str, ext: &str, bytes: Vec<u8>) -> Result<ArtifactRef, BlockStageError> {
        let file = NewArtifact::new(role, ext, bytes);
        let reference = file.reference().clone();
        self.store(file)?;
        let mut written = locked(&self.written);
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
                error => unread(error),
            })
    }
}

/// Converts an error of reading an artifact.
fn unread(error: ArtifactError) -> BlockStageError {
    match error {
        ArtifactError::NoStore(_) | ArtifactError::Bucket(_) => BlockStageError::Store(error),
        error => BlockStageError::Failed {
            failure: Failure::new(FailureClass::Io, error.to_string()),
            is_transient: !matches!(
                error,
                ArtifactError::Moved(_) | ArtifactError::Blocked { .. }
            ),
        },
    }
}

/// Converts an error of writing an artifact. A disk that is full or fails is not the fault of the block, and would fail
/// all others.
fn unwritten(error: ArtifactError) -> BlockStageError {
    match error {
        error @ ArtifactError::Blocked { .. } => unread(error),
        error => BlockStageError::Store(error),
    }
}
