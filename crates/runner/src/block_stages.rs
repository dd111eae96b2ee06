//! The interface between block jobs and the stages that compute them.

use std::fs::File;
use std::io::{self, Read as _};
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::Value;

use mocban_catalog::BlockSettings;
use mocban_core::domain::{
    ArtifactRef, BlockName, BlockSide, BlockStage, BlockStageRecord, ControlPoints, Failure,
    FailureClass, LengthUnit,
};
use mocban_store::{ArtifactError, Input, InputError};

/// Computes the stages of whole blocks. In tests, fake stages fail, hang or wait.
///
/// A stage is a pure function of its inputs, the results of the stages before it, and the settings: the same inputs
/// give the same bytes. It may use several threads.
pub trait BlockStages: Send + Sync + 'static {
    /// Returns revision and settings of a stage. If they change, the stage and all later ones run again.
    fn settings(&self, stage: BlockStage) -> Value;

    /// Computes a stage. `earlier` has the results of all stages before it. A long computation should look at `stop`
    /// now and then and return [`BlockStageError::Stopped`] when it is set.
    ///
    /// # Errors
    /// Returns an error if the block is refused, a file cannot be read, or an artifact of an earlier stage is missing.
    fn run(
        &self,
        stage: BlockStage,
        inputs: &BlockInputs,
        earlier: &[BlockStageRecord],
        artifacts: &dyn BlockArtifacts,
        stop: &AtomicBool,
    ) -> Result<BlockStageOutput, BlockStageError>;
}

/// Returns the settings of the stages of blocks.
pub(crate) fn block_settings(stages: &dyn BlockStages) -> BlockSettings {
    BlockSettings::new(|stage| stages.settings(stage))
}

/// The files of a stage: writes its own artifacts and reads those of earlier stages. May be used by several threads.
pub trait BlockArtifacts: Sync {
    /// Writes an artifact, named by its content. It is durable when the stage ends. A file that exists already is kept.
    /// `role` is unique in the stage, such as `front.png` or `c03-r12.ply`; `ext` is the extension without the dot. The
    /// mesh and the print of a character that is cut are artifacts too.
    fn write(&self, role: &str, ext: &str, bytes: Vec<u8>) -> Result<ArtifactRef, BlockStageError>;

    /// Reads an artifact of an earlier stage and checks its hash.
    ///
    /// # Errors
    /// Returns [`BlockStageError::RerunFrom`] that stage if the file is missing or was changed, or an error if the disk
    /// or the object store fails.
    fn read(&self, record: &BlockStageRecord, role: &str) -> Result<Vec<u8>, BlockStageError>;
}

/// Bytes between two looks at whether the run stops.
const READ_STEP: u64 = 4 << 20;

/// An input file of a block, which may be opened as often as needed. Its content is the same each time: the runner
/// compares size, modification time and hash before and after a stage.
#[derive(Debug, Clone)]
pub struct BlockFile {
    stored: String,
    input: Input,
    bytes: u64,
}

impl BlockFile {
    pub(crate) const fn new(stored: String, input: Input, bytes: u64) -> Self {
        Self {
            stored,
            input,
            bytes,
        }
    }

    /// Returns the path as stored, for messages: `PATH: what is wrong`.
    pub fn name(&self) -> &str {
        &self.stored
    }

    /// Returns the length in bytes.
    pub const fn size(&self) -> u64 {
        self.bytes
    }

    /// Opens the file at its beginning.
    pub fn open(&self) -> Result<File, BlockStageError> {
        self.input.open().map_err(BlockStageError::from)
    }

    /// Reads the whole file, up to `limit` bytes.
    ///
    /// # Errors
    /// Returns an error if it cannot be read, is longer, or the run stops meanwhile.
    pub fn read(&self, limit: u64, stop: &AtomicBool) -> Result<Vec<u8>, BlockStageError> {
        if self.bytes > limit {
            let text = format!(
                "it has {} bytes, more than the limit of {limit}",
                self.bytes
            );
            return Err(self.failed(FailureClass::BadInput, text));
        }
        let mut file = self.open()?;
        let mut bytes = Vec::with_capacity(self.bytes as usize);
        loop {
            if stop.load(Ordering::Relaxed) {
                return Err(BlockStageError::Stopped);
            }
            let part = (&mut file).take(READ_STEP).read_to_end(&mut bytes);
            match part.map_err(|error| self.unreadable(error))? {
                0 => return Ok(bytes),
                _ if bytes.len() as u64 > limit => {
                    let text = format!("it grew beyond the limit of {limit} bytes");
                    return Err(self.failed(FailureClass::BadInput, text));
                }
                _ => {}
            }
        }
    }

    /// Returns the failure of a read of this file.
    pub fn unreadable(&self, error: io::Error) -> BlockStageError {
        InputError::io(self.input.path(), error).into()
    }

    /// Returns a failure of this file that a retry does not change, with its name before the message.
    pub fn failed(&self, class: FailureClass, message: impl std::fmt::Display) -> BlockStageError {
        BlockStageError::failed(class, format!("{}: {message}", self.stored))
    }
}

/// What a block is computed from.
#[derive(Debug, Clone)]
pub struct BlockInputs {
    /// The block.
    pub name: BlockName,
    /// The scan.
    pub mesh: BlockFile,
    /// The image of the page.
    pub page: BlockFile,
    /// The labels. `None` if the characters are to be found.
    pub labels: Option<BlockFile>,
    /// Unit of the scan, if the user gave it.
    pub unit: Option<LengthUnit>,
    /// The side that the page shows, if the user gave it.
    pub side: Option<BlockSide>,
    /// Places that a person chose on this scan and this page.
    pub control_points: Option<ControlPoints>,
}

/// What a stage returns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BlockStageOutput {
    /// The numbers as JSON. `show BLOCK` prints them.
    pub outcome: Value,
    /// The characters in reading order, for the stage `cut` only. Labels are unique.
    pub characters: Vec<CharacterOutput>,
}

/// A character that the stage `cut` returns.
#[derive(Debug, Clone, PartialEq)]
pub struct CharacterOutput {
    /// The label, such as `c03-r12`. The pair is named `BLOCK_LABEL`.
    pub label: String,
    /// The character, if the labels name it.
    pub character: Option<String>,
    /// Edges of its box on the page in pixels, in continuous coordinates: left, top, right, bottom.
    pub bounds: [f64; 4],
    /// How sure its position is, from 0 to 1.
    pub confidence: Option<f64>,
    /// Maps for exports, such as `page_from_crop` and `page_from_mesh`.
    pub maps: Option<Value>,
    /// Its files, or a sentence that says why nothing was cut.
    pub cut: Result<CutFiles, String>,
}

/// The files of a character, and attributes of its pair.
#[derive(Debug, Clone, PartialEq)]
pub struct CutFiles {
    /// The mesh, in the frame and unit of the block's scan, as written with [`BlockArtifacts::write`].
    pub mesh: ArtifactRef,
    /// The print, likewise.
    pub print: ArtifactRef,
    /// Unit of the mesh.
    pub unit: Option<LengthUnit>,
    /// Whether the block lay face down when scanned, if this is known.
    pub scanned_face_down: Option<bool>,
    /// The expected alignment, for `register`. If it changes, the pair runs again.
    pub prior: Option<Value>,
}

/// Why a stage returned nothing.
#[derive(Debug)]
pub enum BlockStageError {
    /// The result of an earlier stage is missing or damaged. The block runs again from that stage on.
    RerunFrom(BlockStage),
    /// The stage noticed that it is to stop.
    Stopped,
    /// An object store failed, or the disk of the artifacts, which is not the fault of the block.
    Store(ArtifactError),
    /// The stage failed. A refusal, such as a page of another block, has the class `NoSolution`; it is not retried.
    Failed {
        /// Class and message.
        failure: Failure,
        /// Whether a retry may succeed.
        is_transient: bool,
    },
}

impl BlockStageError {
    /// Returns a failure that a retry does not change.
    pub fn failed(class: FailureClass, message: impl Into<String>) -> Self {
        Self::Failed {
            failure: Failure::new(class, message),
            is_transient: false,
        }
    }
}

impl From<InputError> for BlockStageError {
    fn from(error: InputError) -> Self {
        if let InputError::Store(error) = error {
            return Self::Store(ArtifactError::Bucket(error));
        }
        Self::Failed {
            is_transient: error.is_transient(),
            failure: Failure::new(error.class(), error.to_string()),
        }
    }
}
