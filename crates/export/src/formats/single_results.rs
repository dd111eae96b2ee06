//! Formats that hold one result per pair, and their file `pairs.jsonl`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::export_folder::{FolderError, SharedFile};
use crate::export_logs::json_lines;
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::{PairPictures, PictureError};
use crate::record::{MetricFields, PairFields, PairRecord};
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

/// A format whose files show one result of each pair.
pub(super) trait SingleResultFormat: Default + Send + Sync {
    /// What the folder is.
    const PURPOSE: &'static str;
    /// Files of a pair.
    const FILES: &'static [FileOfPair];
    /// How to open the files, as Markdown.
    const USAGE: &'static str;

    /// Encodes the files of a pair, in the order of [`Self::FILES`].
    fn contents(
        &self,
        view: &PairView<'_>,
        shown: ShownResult<'_>,
    ) -> Result<Vec<Vec<u8>>, PictureError>;
}

/// Writes the files of a format, with a line about each pair.
pub(super) struct SingleResultWriter<F> {
    format: F,
    results: SingleResults,
}

impl<F: SingleResultFormat> SingleResultWriter<F> {
    pub(super) fn begin(folder: &FormatFolder) -> Result<Self, FolderError> {
        Ok(Self {
            format: F::default(),
            results: SingleResults::begin(folder)?,
        })
    }
}

impl<F: SingleResultFormat> FormatWriter for SingleResultWriter<F> {
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let Some(shown) = SingleResults::of_pair(view) else {
            return Ok(self.results.without_result(view));
        };
        let mut encoded = EncodedPair::default();
        let mut names = NamedFiles::new();
        let fields = shown.fields;
        let contents = self.format.contents(view, shown)?;
        for ([name, path, _], content) in F::FILES.iter().zip(contents) {
            names.insert(name, (*path).to_owned());
            encoded.add_file(*path, content);
        }
        let line = self.results.line(view, Some((fields, names)));
        encoded.shared.push(line);
        Ok(encoded)
    }

    fn append(&mut self, _: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        shared.iter().try_for_each(|line| self.results.append(line))
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        Ok(vec![self.results.finish()?])
    }

    fn guide(&self) -> FormatGuide {
        let paths = F::FILES.iter().map(|[_, path, _]| path.replace('*', "ID"));
        let paths: Vec<String> = paths.collect();
        let rows = F::FILES.iter().zip(&paths);
        let rows = rows.map(|([_, _, meaning], path)| [path.as_str(), *meaning]);
        let rows: Vec<[&str; 2]> = rows.collect();
        self.results.guide(F::PURPOSE, &rows, F::USAGE)
    }
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
