//! Encodes pairs in all formats of an export, and writes the files that belong to one pair.

use std::collections::BTreeSet;
use std::path::Path;

use super::export_folder::{FolderError, write_below};
use super::format::ExportFormat;
use super::format_writer::{EncodedFile, EncodedPair, ExportContext, FormatWriter, PairView};
use super::pair_pictures::{PairPictures, PictureError, canvas_from_print};
use super::record::{ManualAlignmentFields, PairRecord};
use super::split::SplitPlan;
use super::stage_outcomes::StageOutcomes;
use crate::catalog::{MetricRecord, PairResults};
use crate::domain::{Affine2, Failure, FailureClass};
use crate::report::pair_artifacts::PairArtifacts;
use crate::store::Project;

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
    /// Encodes a pair in every format and writes its own files. Returns `None` if the pair is left out.
    pub(super) fn write(
        &self,
        pair: &PairResults,
        alignment: Option<&ManualAlignmentFields>,
    ) -> Result<Option<WrittenPair>, FolderError> {
        let options = &self.context.options;
        let kept: Vec<_> = pair
            .metrics
            .iter()
            .filter(|record| options.keeps(record))
            .collect();
        if options.is_filtered() && kept.is_empty() {
            return Ok(None);
        }
        let complete = |mut record: PairRecord| {
            record.pair.manual_alignment = alignment.cloned();
            record.pair.split = self.plan.and_then(|plan| plan.part(&pair.attributes));
            record
        };
        let (record, encoded, unreadable) = match self.encode_result(pair, &kept, complete) {
            Ok((record, encoded)) => (record, encoded, None),
            Err(error) => {
                let failure = Failure::new(FailureClass::Io, error.to_string());
                let record = complete(PairRecord::unreadable(pair, &failure));
                let encoded = self.encode(&record, None).expect("nothing is read");
                (record, encoded, Some(failure.message))
            }
        };
        let mut written = WrittenPair {
            record,
            shared: Vec::new(),
            files: BTreeSet::new(),
            unreadable,
        };
        let id = pair.attributes.name.as_str();
        for (output, EncodedPair { files, shared }) in self.outputs.iter().zip(encoded) {
            for EncodedFile { pattern, bytes } in files {
                let pattern = format!("{}{pattern}", output.prefix);
                write_below(self.root, &pattern.replace('*', id), &bytes)?;
                written.files.insert(pattern);
            }
            written.shared.push(shared);
        }
        Ok(Some(written))
    }

    /// Reads the outcomes of a pair and encodes it in every format.
    fn encode_result(
        &self,
        pair: &PairResults,
        kept: &[&MetricRecord],
        complete: impl Fn(PairRecord) -> PairRecord,
    ) -> Result<(PairRecord, Vec<EncodedPair>), PictureError> {
        let options = &self.context.options;
        if kept.is_empty() {
            let record = complete(PairRecord::of(pair, None, &[]));
            let encoded = self.encode(&record, None)?;
            return Ok((record, encoded));
        }
        let outcomes = StageOutcomes::read(&PairArtifacts::new(self.project, pair))?;
        let mut record = complete(PairRecord::of(pair, Some(&outcomes), kept));
        record.pair.seconds = options.with_times.then(|| pair.seconds());
        record.pair.picture_from_print = Some(match options.canvas_px {
            None => Affine2::IDENTITY,
            Some(side) => canvas_from_print(&outcomes, side).unwrap_or(Affine2::IDENTITY),
        });
        let kept = kept.to_vec();
        let (limits, canvas) = (options.limits, options.canvas_px);
        let pictures = PairPictures::new(self.project, pair, &outcomes, kept, limits, canvas);
        let encoded = self.encode(&record, Some(&pictures))?;
        Ok((record, encoded))
    }

    /// Encodes a pair in every format.
    fn encode(
        &self,
        record: &PairRecord,
        result: Option<&PairPictures<'_>>,
    ) -> Result<Vec<EncodedPair>, PictureError> {
        let view = PairView { record, result };
        let outputs = self.outputs.iter();
        outputs.map(|output| output.writer.encode(&view)).collect()
    }
}
