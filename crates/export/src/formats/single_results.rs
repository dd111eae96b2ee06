//! The file `pairs.jsonl` of formats that hold one result per pair.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::export_folder::{FolderError, SharedFile};
use crate::export_logs::json_lines;
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, PairView};
use crate::pair_pictures::PairPictures;
use crate::record::{MetricFields, PairFields};
use crate::record_fields::{METRIC_FIELDS, PAIR_FIELDS, markdown_table, schema_of};
use crate::sample::chosen;
use mocban_catalog::MetricRecord;
use mocban_core::domain::{DepthScale, ThresholdMetric};

/// The file of lines.
const LINES: &str = "pairs.jsonl";

/// Files of a line by name, as paths below the folder of `pairs.jsonl`.
pub(super) type NamedFiles = BTreeMap<&'static str, String>;

/// A file of each pair: its name in `pairs.jsonl`, its path below the folder with `*` for the id, and its meaning.
pub(super) type FileOfPair = [&'static str; 3];

/// The result of a pair that a format shows.
pub(super) struct ShownResult<'a> {
    pub(super) fields: &'a MetricFields,
    pub(super) record: &'a MetricRecord,
    pub(super) pictures: &'a PairPictures<'a>,
    /// Scale of the depth map, with the unit of the manifest if the result has none.
    pub(super) scale: DepthScale,
}

/// A line: one pair and the result that the other files of the format show.
#[derive(Debug, Serialize, JsonSchema)]
struct SingleResult<'a> {
    /// The pair.
    #[serde(flatten)]
    pair: &'a PairFields,
    /// The result.
    #[serde(flatten)]
    metric: &'a MetricFields,
    /// Files of the pair, paths below the folder of `pairs.jsonl`; null if the pair has no result.
    files: Option<NamedFiles>,
}

/// Selects one result per pair, and writes a line about each.
pub(super) struct SingleResults {
    lines: SharedFile,
    metric: ThresholdMetric,
}

impl SingleResults {
    pub(super) fn begin(folder: &FormatFolder) -> Result<Self, FolderError> {
        let metrics = &folder.context.metrics;
        let default = ThresholdMetric::DEFAULT;
        let first = metrics.first().copied().unwrap_or(default);
        Ok(Self {
            lines: SharedFile::create(&folder.root, LINES)?,
            metric: if metrics.contains(&default) {
                default
            } else {
                first
            },
        })
    }

    /// Returns the result of a pair to show: that of the default metric if it was selected, otherwise the first.
    /// Returns `None` if the pair has no result.
    pub(super) fn of_pair<'a>(view: &PairView<'a>) -> Option<ShownResult<'a>> {
        let (fields, pictures) = (&view.record.metrics, view.result?);
        let place = chosen(fields)?;
        let scale = pictures.outcomes.depth.scale.clone();
        Some(ShownResult {
            fields: fields.get(place)?,
            record: pictures.metrics.get(place)?,
            pictures,
            scale: DepthScale {
                unit: scale.unit.or(view.record.pair.unit),
                ..scale
            },
        })
    }

    /// Returns a pair without a result: only a line.
    pub(super) fn without_result(&self, view: &PairView<'_>) -> EncodedPair {
        EncodedPair {
            files: Vec::new(),
            shared: vec![self.line(view, None)],
        }
    }

    /// Returns a pair with its line and its files. `contents` are in the order of `files`.
    pub(super) fn with_files(
        &self,
        view: &PairView<'_>,
        fields: &MetricFields,
        files: &[FileOfPair],
        contents: impl IntoIterator<Item = Vec<u8>>,
    ) -> EncodedPair {
        let mut encoded = EncodedPair::default();
        let mut names = NamedFiles::new();
        for ([name, path, _], content) in files.iter().zip(contents) {
            names.insert(name, (*path).to_owned());
            encoded.add_file(*path, content);
        }
        let line = self.line(view, Some((fields, names)));
        encoded.shared.push(line);
        encoded
    }

    /// Returns the line of a pair. `shown` is its result with its files.
    pub(super) fn line(
        &self,
        view: &PairView<'_>,
        shown: Option<(&MetricFields, NamedFiles)>,
    ) -> Vec<u8> {
        let id = view.record.pair.id.file_name();
        let missing = MetricFields::without_result(self.metric);
        let (metric, files) = shown.map_or((&missing, None), |(metric, files)| {
            let files = files.into_iter();
            let paths = files.map(|(name, path)| (name, path.replace('*', &id)));
            (metric, Some(paths.collect()))
        });
        let line = SingleResult {
            pair: &view.record.pair,
            metric,
            files,
        };
        json_lines(&[line]).into_bytes()
    }

    /// Appends a line.
    pub(super) fn append(&mut self, line: &[u8]) -> Result<(), FolderError> {
        self.lines.append(line)
    }

    /// Completes the file and returns its path.
    pub(super) fn finish(&mut self) -> Result<String, FolderError> {
        self.lines.flush()?;
        Ok(LINES.to_owned())
    }

    /// Returns what the README says about the lines and the files of each pair, for a format with this purpose.
    pub(super) fn guide_of_files(
        &self,
        purpose: &str,
        files: &[FileOfPair],
        usage: &str,
    ) -> FormatGuide {
        let paths: Vec<String> = files
            .iter()
            .map(|[_, path, _]| path.replace('*', "ID"))
            .collect();
        let rows = files.iter().zip(&paths);
        let rows: Vec<[&str; 2]> = rows
            .map(|([_, _, meaning], path)| [path.as_str(), *meaning])
            .collect();
        self.guide(purpose, &rows, usage)
    }

    /// Returns what the README says about the lines, for a format with this purpose and these files.
    pub(super) fn guide(&self, purpose: &str, files: &[[&str; 2]], usage: &str) -> FormatGuide {
        let schema = schema_of::<SingleResult<'_>>();
        let lines = [
            LINES,
            "one line per pair: its record, and its paths as `files`",
        ];
        let all = [lines].into_iter().chain(files.iter().copied());
        let tables = [
            ("Fields of a line of `pairs.jsonl`", &PAIR_FIELDS[..]),
            ("", &METRIC_FIELDS[..]),
        ];
        FormatGuide {
            purpose: format!(
                "{purpose} Each pair is shown by one result: that of `{}`, or else of the first selected metric.",
                self.metric
            ),
            files: all.map(|pair| pair.map(str::to_owned)).collect(),
            usage: usage.to_owned(),
            fields: markdown_table(&schema, &tables),
            schema: Some(schema),
            ..FormatGuide::default()
        }
    }
}
