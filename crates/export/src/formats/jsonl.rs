//! The format `jsonl`: one line per pair and metric in `pairs.jsonl`, and pictures below `pairs/`.
//!
//! A picture that several metrics of a pair share is written once, and their lines name the same file.

use schemars::JsonSchema;
use serde::Serialize;

use crate::block_lines::{BLOCKS_FILE, fields_table};
use crate::export_folder::{FolderError, SharedFile};
use crate::export_logs::{LOG_FILES, json_lines};
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_files::{Files, write_files};
use crate::pair_pictures::PictureError;
use crate::record::{MetricFields, PairFields, PairRecord};
use crate::record_fields::{FILE_FIELDS, METRIC_FIELDS, PAIR_FIELDS, markdown_table, schema_of};

/// The file of lines.
const LINES: &str = "pairs.jsonl";

/// A line of `pairs.jsonl`: one pair and metric. A value that does not exist is null.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ExportLine<'a> {
    /// What all metrics of the pair share.
    #[serde(flatten)]
    pair: &'a PairFields,
    /// The result of the metric.
    #[serde(flatten)]
    metric: &'a MetricFields,
    /// Files of the line, paths below the folder of `pairs.jsonl`.
    files: Option<Files>,
}

/// Writes `pairs.jsonl`.
pub(super) struct JsonlWriter {
    folder: FormatFolder,
    lines: SharedFile,
}

impl JsonlWriter {
    pub(super) fn begin(folder: FormatFolder) -> Result<Self, FolderError> {
        Ok(Self {
            lines: SharedFile::create(&folder.root, LINES)?,
            folder,
        })
    }
}

impl FormatWriter for JsonlWriter {
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let pair = &view.record.pair;
        let mut encoded = EncodedPair::default();
        let text = match view.result {
            None => {
                let metrics = self.folder.context.metrics.iter();
                let metrics: Vec<_> = metrics.copied().map(MetricFields::without_result).collect();
                let line = |metric| ExportLine {
                    pair,
                    metric,
                    files: None,
                };
                json_lines(&metrics.iter().map(line).collect::<Vec<_>>())
            }
            Some(pictures) => {
                let files = write_files(pictures, &mut encoded)?;
                let line = |(metric, files): (_, Files)| ExportLine {
                    pair,
                    metric,
                    files: Some(files.of_pair(&pair.id)),
                };
                let lines = view.record.metrics.iter().zip(files).map(line);
                json_lines(&lines.collect::<Vec<_>>())
            }
        };
        encoded.shared.push(text.into_bytes());
        Ok(encoded)
    }

    fn append(&mut self, _: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        shared.iter().try_for_each(|lines| self.lines.append(lines))
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        self.lines.flush()?;
        Ok(vec![LINES.to_owned()])
    }

    fn guide(&self) -> FormatGuide {
        let schema = schema_of::<ExportLine<'_>>();
        let mut files = vec![
            [LINES, "one line per pair and metric"],
            ["pairs/ID/", "pictures of a pair that its metrics share"],
            [
                "pairs/ID/METRIC/",
                "pictures that differ from metric to metric; metrics with equal pictures share those of the first",
            ],
            [
                "pairs/ID/depth.json",
                "scale of `depth.png`, with the curved surface as `curvature`",
            ],
        ];
        files.extend(LOG_FILES);
        files.push(BLOCKS_FILE);
        let tables = [
            ("Fields of a line", &PAIR_FIELDS[..]),
            ("", &METRIC_FIELDS[..]),
            ("Pictures, as named in `files`", &FILE_FIELDS[..]),
        ];
        FormatGuide {
            purpose: "Pairs of block scans and prints, aligned: one line per pair and metric, with masks and depth maps as PNG files.".to_owned(),
            files: files.iter().map(|pair| pair.map(str::to_owned)).collect(),
            usage: "```python\nimport json\nlines = [json.loads(line) for line in open(\"pairs.jsonl\", encoding=\"utf-8\")]\n```".to_owned(),
            fields: format!("{}\n{}", markdown_table(&schema, &tables), fields_table()),
            schema: Some(schema),
            ..FormatGuide::default()
        }
    }
}
