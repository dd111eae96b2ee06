//! Encodes pairs in all formats of an export, and writes the files that belong to one pair.

use std::collections::BTreeSet;
use std::path::Path;

use super::export_folder::{FolderError, remove_below, write_below};
use super::format::ExportFormat;
use super::format_writer::{EncodedFile, EncodedPair, ExportContext, FormatWriter, PairView};
use super::left_out::OmissionReason;
use super::pair_pictures::{PairPictures, PictureError, canvas_from_print};
use super::record::{ManualAlignmentFields, PairRecord};
use super::split::SplitPlan;
use super::stage_outcomes::StageOutcomes;
use mocban_catalog::{CutOrigin, MetricRecord, PairResults};
use mocban_core::domain::{Affine2, Failure, FailureClass};
use mocban_results::pair_artifacts::PairArtifacts;
use mocban_store::Project;

/// One format of an export.
pub(super) struct FormatOutput {
    /// The format.
    pub(super) format: ExportFormat,
    /// Path of its folder below the folder of the export: empty, or its name and a slash.
    pub(super) prefix: String,
    /// Writes its files.
    pub(super) writer: Box<dyn FormatWriter>,
}

/// A pair that was encoded and whose own files were written.
pub(super) struct WrittenPair {
    /// The complete record.
    pub(super) record: PairRecord,
    /// What each format appends to shared files.
    pub(super) shared: Vec<Vec<Vec<u8>>>,
    /// Patterns of the written files.
    pub(super) files: BTreeSet<String>,
    /// Why its files are missing although it is finished.
    pub(super) unreadable: Option<String>,
}

/// What the formats made of a pair.
#[derive(Default)]
struct FormatFiles {
    /// What each format appends to shared files.
    shared: Vec<Vec<Vec<u8>>>,
    /// Patterns of the written files.
    files: BTreeSet<String>,
}

/// Why a pair was not written.
#[derive(Debug, thiserror::Error)]
enum WriteError {
    /// An input or artifact cannot be read.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A file cannot be written.
    #[error(transparent)]
    Folder(#[from] FolderError),
}

/// Writes pairs below the folder of an export. Several threads may use it.
pub(super) struct PairWriter<'a> {
    /// The project of the pairs.
    pub(super) project: &'a Project,
    /// The folder of the export.
    pub(super) root: &'a Path,
    /// The formats.
    pub(super) outputs: &'a [FormatOutput],
    /// What all formats know.
    pub(super) context: &'a ExportContext,
    /// The split, if the export has one.
    pub(super) plan: Option<&'a SplitPlan>,
}

impl PairWriter<'_> {
    /// Encodes a pair in every format and writes its own files. The inner error says why the pair is left out.
    pub(super) fn write(
        &self,
        pair: &PairResults,
        alignment: Option<&ManualAlignmentFields>,
        origin: Option<&CutOrigin>,
    ) -> Result<Result<WrittenPair, OmissionReason>, FolderError> {
        let options = &self.context.options;
        let kept: Vec<_> = pair
            .metrics
            .iter()
            .filter(|record| options.keeps(record))
            .collect();
        if let Some(reason) = options.reason_to_leave_out(pair, !kept.is_empty()) {
            return Ok(Err(reason));
        }
        let complete = |mut record: PairRecord| {
            record.pair.manual_alignment = alignment.cloned();
            if let Some(origin) = origin {
                record.pair.add_origin(origin);
            }
            record.pair.split = self.plan.and_then(|plan| plan.part(&pair.attributes));
            record
        };
        let (record, output, unreadable) = match self.write_result(pair, &kept, complete) {
            Ok((record, output)) => (record, output, None),
            Err(WriteError::Folder(error)) => return Err(error),
            Err(WriteError::Picture(error)) => {
                let failure = Failure::new(FailureClass::Io, error.to_string());
                let record = complete(PairRecord::unreadable(pair, &failure));
                let output = match self.write_formats(&record, None) {
                    Err(WriteError::Folder(error)) => return Err(error),
                    written => written.expect("nothing is read"),
                };
                (record, output, Some(failure.message))
            }
        };
        Ok(Ok(WrittenPair {
            record,
            shared: output.shared,
            files: output.files,
            unreadable,
        }))
    }

    /// Reads the outcomes of a pair and writes it in every format.
    fn write_result(
        &self,
        pair: &PairResults,
        kept: &[&MetricRecord],
        complete: impl Fn(PairRecord) -> PairRecord,
    ) -> Result<(PairRecord, FormatFiles), WriteError> {
        let options = &self.context.options;
        if kept.is_empty() {
            let record = complete(PairRecord::of(pair, None, &[]));
            let output = self.write_formats(&record, None)?;
            return Ok((record, output));
        }
        let outcomes = StageOutcomes::read(&PairArtifacts::new(self.project, pair))
            .map_err(PictureError::from)?;
        let mut record = complete(PairRecord::of(pair, Some(&outcomes), kept));
        record.pair.seconds = options.with_times.then(|| pair.seconds());
        record.pair.picture_from_print = Some(match options.canvas_px {
            None => Affine2::IDENTITY,
            Some(side) => canvas_from_print(&outcomes, side).unwrap_or(Affine2::IDENTITY),
        });
        let kept = kept.to_vec();
        let (limits, canvas) = (options.limits, options.canvas_px);
        let pictures = PairPictures::new(self.project, pair, &outcomes, kept, limits, canvas);
        let output = self.write_formats(&record, Some(&pictures))?;
        Ok((record, output))
    }

    /// Encodes a pair in one format after the other, and writes the files of each before the next is encoded. Removes
    /// the written files if a picture cannot be read.
    fn write_formats(
        &self,
        record: &PairRecord,
        result: Option<&PairPictures<'_>>,
    ) -> Result<FormatFiles, WriteError> {
        let view = PairView { record, result };
        let path = |pattern: &str| pattern.replace('*', &record.pair.id.file_name());
        let mut written = FormatFiles::default();
        for output in self.outputs {
            let EncodedPair { files, shared } = match output.writer.encode(&view) {
                Ok(encoded) => encoded,
                Err(error) => {
                    // Other pairs may share files without the id in their names.
                    for pattern in written.files.iter().filter(|name| name.contains('*')) {
                        remove_below(self.root, &path(pattern))?;
                    }
                    return Err(error.into());
                }
            };
            for EncodedFile { pattern, bytes } in files {
                let pattern = format!("{}{pattern}", output.prefix);
                write_below(self.root, &path(&pattern), &bytes)?;
                written.files.insert(pattern);
            }
            written.shared.push(shared);
        }
        Ok(written)
    }
}
