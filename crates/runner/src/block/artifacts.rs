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
    /// Artifacts that are not written yet; for an object store, all of its pack.
    waiting: Mutex<WaitingArtifacts>,
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
            waiting: Mutex::default(),
            began: OnceLock::new(),
        }
    }

    /// Stores what waits. Returns the artifacts that were written, by role, and when the first write began.
    pub(crate) fn finish(self) -> Result<(ArtifactSet, Instant), BlockStageError> {
        let began = *self.began.get_or_init(Instant::now);
        let waiting = std::mem::take(&mut *locked(&self.waiting)).files;
        if !self.project.has_packs() {
            self.write_files(&waiting)?;
        }
        let written = self.written.into_inner();
        let mut written = written.unwrap_or_else(PoisonError::into_inner);
        if !self.project.has_packs() || waiting.is_empty() {
            return Ok((written, began));
        }
        failpoint::hit(self.stage, Point::Written, Some(self.block));
        let locations = self.project.write_pack(&waiting).map_err(unwritten)?;
        for (file, location) in waiting.iter().zip(locations) {
            if let Some(artifact) = written.get_mut(file.role()) {
                artifact.pack = Some(location);
            }
        }
        Ok((written, began))
    }

    /// Writes an artifact or keeps it, until there are enough to be written together or the pack is complete.
    fn store(&self, file: NewArtifact) -> Result<(), BlockStageError> {
        let has_packs = self.project.has_packs();
        if !has_packs || self.stage == BlockStage::Cut {
            self.began.get_or_init(Instant::now);
        }
        if has_packs && self.stage == BlockStage::Cut {
            failpoint::hit(self.stage, Point::Written, Some(self.block));
            return self.project.write_objects(&[file]).map_err(unwritten);
        }
        let mut waiting = locked(&self.waiting);
        waiting.bytes += file.reference().bytes;
        waiting.files.push(file);
        if has_packs || !waiting.are_enough() {
            return Ok(());
        }
        let files = std::mem::take(&mut *waiting).files;
        drop(waiting);
        self.write_files(&files)
    }

    /// Writes artifacts to the project's folder.
    fn write_files(&self, files: &[NewArtifact]) -> Result<(), BlockStageError> {
        let on_written = || failpoint::hit(self.stage, Point::Written, Some(self.block));
        let written = self.project.write_artifacts(files, &on_written);
        written.map_err(unwritten)
    }
}

/// Artifacts that are written together.
#[derive(Default)]
struct WaitingArtifacts {
    files: Vec<NewArtifact>,
    bytes: u64,
}

impl WaitingArtifacts {
    /// Returns whether these are as many as should be written together: a disk makes many files durable in little more time
    /// than one. The limit in bytes bounds the memory.
    const fn are_enough(&self) -> bool {
        self.files.len() >= 64 || self.bytes >= 8 << 20
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
