//! What a format of exports must implement.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use serde_json::Value;

use super::export_folder::FolderError;
use super::options::ExportOptions;
use super::pair_pictures::{PairPictures, PictureError};
use super::record::PairRecord;
use mocban_core::domain::{PairName, ThresholdMetric};

/// What all formats know about an export.
#[derive(Debug, Clone)]
pub(super) struct ExportContext {
    /// Name and version of this program.
    pub(super) program: String,
    /// The selected metrics of the current method.
    pub(super) metrics: Vec<ThresholdMetric>,
    /// Names of the user's columns of all pairs, sorted.
    pub(super) meta_columns: Vec<String>,
    /// Paths of prints that several pairs share, each with the first of its pairs. Empty unless a format needs it.
    pub(super) shared_prints: BTreeMap<String, PairName>,
    /// What to export.
    pub(super) options: ExportOptions,
}

/// A pair to encode.
pub(super) struct PairView<'a> {
    /// The complete record.
    pub(super) record: &'a PairRecord,
    /// Inputs, artifacts and typed results; `None` if the pair has no result, or its files cannot be read.
    pub(super) result: Option<&'a PairPictures<'a>>,
}

/// The files of one pair, and what the pair adds to files that pairs share.
#[derive(Debug, Default)]
pub(super) struct EncodedPair {
    /// Files of the pair alone. The frame writes them.
    pub(super) files: Vec<EncodedFile>,
    /// Bytes for [`FormatWriter::append`], such as a line, or a sample of a shard.
    pub(super) shared: Vec<Vec<u8>>,
}

/// A file of one pair.
#[derive(Debug)]
pub(super) struct EncodedFile {
    /// Path below the folder of the format. `*` stands for the id of the pair, as in `pairs/*/depth.png`.
    pub(super) pattern: String,
    /// The content.
    pub(super) bytes: Vec<u8>,
}

impl EncodedPair {
    /// Adds a file of the pair; see [`EncodedFile::pattern`].
    pub(super) fn add_file(&mut self, pattern: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        self.files.push(EncodedFile {
            pattern: pattern.into(),
            bytes: bytes.into(),
        });
    }
}

/// Writes the pairs of an export in one format.
///
/// The frame calls `encode` for the pairs of a page on several threads, writes their files, then calls `append` for each
/// pair in the order of the catalog. Only one page of pairs is in memory. A writer is created for an empty folder, to
/// which it may write. If anything fails, the folder is discarded.
pub(super) trait FormatWriter: Send + Sync {
    /// Encodes a pair. Equal pairs give equal bytes, whatever was encoded before.
    ///
    /// # Errors
    /// Returns an error if an input or artifact cannot be read. The pair is then encoded again without a result, in all
    /// formats, and the other pairs are exported.
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError>;

    /// Appends what the pair adds to shared files.
    ///
    /// # Errors
    /// Returns an error if a shared file cannot be written. This ends the export.
    fn append(&mut self, record: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError>;

    /// Completes the shared files, and returns their paths below the folder of the format.
    ///
    /// # Errors
    /// Returns an error if a shared file cannot be written. This ends the export.
    fn finish(&mut self) -> Result<Vec<String>, FolderError>;

    /// Returns what the README of the export says about the format.
    fn guide(&self) -> FormatGuide;
}

/// What the generated README says about a format.
#[derive(Debug, Default)]
pub(super) struct FormatGuide {
    /// A YAML header, such as that of a dataset card, with its `---` lines. Empty if there is none.
    pub(super) front_matter: String,
    /// What the folder is, in one or two sentences.
    pub(super) purpose: String,
    /// Files with their meaning; `ID` and `METRIC` stand for names.
    pub(super) files: Vec<[String; 2]>,
    /// How to open the export, as Markdown.
    pub(super) usage: String,
    /// Tables of fields, as Markdown.
    pub(super) fields: String,
    /// JSON Schema of a line, which is written to `schema.json`.
    pub(super) schema: Option<Value>,
}

/// A folder and a context, from which a writer is created.
#[derive(Debug, Clone)]
pub(super) struct FormatFolder {
    /// The empty folder to write to.
    pub(super) root: PathBuf,
    /// What all formats know.
    pub(super) context: Arc<ExportContext>,
}
