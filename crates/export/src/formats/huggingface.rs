//! The format `huggingface`: a folder that `datasets.load_dataset` opens, with one row per pair and images as columns.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::export_folder::{FolderError, at};
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::PictureError;
use crate::parquet_columns::ColumnType;
use crate::parquet_table::{ParquetTable, TableLayout};
use crate::record::{PairRecord, SplitName};
use crate::record_fields::{METRIC_FIELDS, PAIR_FIELDS, markdown_table};
use crate::sample::{PICTURE_FIELDS, chosen, fields, pictures, schema};
use crate::table_columns::{field_cells, field_columns, picture_cells, picture_columns};

/// The folder of the tables.
const DATA: &str = "data";

/// Writes the tables and the dataset card.
pub(super) struct HuggingFaceWriter {
    folder: FormatFolder,
    /// Columns of the fields, without the pictures.
    columns: Vec<(String, ColumnType)>,
    layout: TableLayout,
    parts: BTreeMap<SplitName, DatasetPart>,
}

/// The tables of one part of the dataset.
#[derive(Default)]
struct DatasetPart {
    table: Option<ParquetTable>,
    files: Vec<String>,
    rows: u64,
    /// Size of the pictures and of the numbers as JSON.
    bytes: u64,
}

impl HuggingFaceWriter {
    pub(super) fn begin(folder: FormatFolder) -> Result<Self, FolderError> {
        let data = folder.root.join(DATA);
        std::fs::create_dir(&data).map_err(at(&data))?;
        let columns = field_columns(&schema(), &folder.context.meta_columns);
        let image = |(name, _): (String, ColumnType)| (name, json!({"_type": "Image"}));
        let features: serde_json::Map<String, Value> = picture_columns().map(image).collect();
        let layout = TableLayout {
            columns: columns.iter().cloned().chain(picture_columns()).collect(),
            program: folder.context.program.clone(),
            metadata: vec![(
                "huggingface".to_owned(),
                json!({"info": {"features": features}}).to_string(),
            )],
            share_images: false,
        };
        Ok(Self {
            folder,
            columns,
            layout,
            parts: BTreeMap::new(),
        })
    }

    /// Returns the YAML header of the dataset card.
    fn front_matter(&self) -> String {
        let license = self.folder.context.options.license.as_deref();
        let rows: u64 = self.parts.values().map(|part| part.rows).sum();
        let mut text = format!(
            "---\nlicense: {}\npretty_name: Aligned woodblock scans and prints\ntask_categories:\n- image-segmentation\n\
             - image-to-image\ntags:\n- woodblock\n- depth-map\n- registration\nsize_categories:\n- {}\nconfigs:\n\
             - config_name: default\n  data_files:\n",
            yaml_text(license.unwrap_or("other")),
            size_category(rows)
        );
        for part in self.parts.keys() {
            let name = part.name();
            let _ = writeln!(text, "  - split: {name}\n    path: {DATA}/{name}-*.parquet");
        }
        text += "dataset_info:\n  features:\n";
        for (name, kind) in &self.layout.columns {
            let _ = writeln!(text, "  - name: {}", yaml_text(name));
            text += &feature(kind, "    ");
        }
        text += "  splits:\n";
        for (part, data) in &self.parts {
            let _ = writeln!(
                text,
                "  - name: {}\n    num_bytes: {}\n    num_examples: {}",
                part.name(),
                data.bytes,
                data.rows
            );
        }
        text + "---\n\n"
    }
}

impl FormatWriter for HuggingFaceWriter {
    /// Encodes the pictures: file names and contents in turn.
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let mut encoded = EncodedPair::default();
        if let (Some(result), Some(index)) = (view.result, chosen(&view.record.metrics)) {
            for picture in pictures(result, result.metrics[index], true)? {
                encoded.shared.extend(picture.named(&view.record.pair.id));
            }
        }
        Ok(encoded)
    }

    fn append(&mut self, record: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        let Some(row) = fields(record) else {
            return Ok(());
        };
        let pictures = shared.iter().map(Vec::len).sum::<usize>();
        let bytes = (pictures + row.to_string().len()) as u64;
        let mut cells = field_cells(row, &self.columns);
        cells.extend(picture_cells(&mut shared.into_iter()));
        let split = record.pair.split.unwrap_or(SplitName::Train);
        let part = self.parts.entry(split).or_default();
        let limit = self.folder.context.options.shard_bytes();
        if let Some(full) = part.table.take_if(|table| table.bytes_written() >= limit) {
            full.finish()?;
        }
        let mut table = if let Some(table) = part.table.take() {
            table
        } else {
            let name = format!("{DATA}/{}-{:05}.parquet", split.name(), part.files.len());
            let table = ParquetTable::create(&self.folder.root.join(&name), &self.layout)?;
            part.files.push(name);
            table
        };
        table.append(cells)?;
        part.table = Some(table);
        part.rows += 1;
        part.bytes += bytes;
        Ok(())
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        let mut files = Vec::new();
        for part in self.parts.values_mut() {
            if let Some(table) = part.table.take() {
                table.finish()?;
            }
            files.extend(part.files.iter().cloned());
        }
        Ok(files)
    }

    fn guide(&self) -> FormatGuide {
        let tables = [("Columns", &PAIR_FIELDS[..]), ("", &METRIC_FIELDS[..])];
        let mut fields = markdown_table(&schema(), &tables);
        fields += "| `metrics` | list of objects |  |  | All selected metrics, each with the fields above from `metric` on. |\n";
        for (field, meaning) in PICTURE_FIELDS {
            let _ = writeln!(
                fields,
                "| `{}` | image | {} | {} | {meaning} |",
                field.name, field.unit, field.frame
            );
        }
        let counts = self
            .parts
            .iter()
            .map(|(part, data)| format!("{}: {}", part.name(), data.rows));
        let counts = counts.collect::<Vec<_>>().join(", ");
        FormatGuide {
            front_matter: self.front_matter(),
            purpose: format!(
                "Scans of carved woodblock characters aligned with images of their prints, one row per pair. Rows: {counts}. \
                 Pairs without a result are left out; the formats `jsonl` and `csv` list them."
            ),
            files: vec![[format!("{DATA}/SPLIT-NUMBER.parquet"), "the rows of a part of the dataset".to_owned()]],
            usage: "\
The numbers from `metric` on and the pictures belong to one metric: `ensemble` if it was selected, otherwise the first.
`metrics` holds the numbers of all selected metrics. The paths of mesh and print in the catalog are `mesh_path` and
`print_path`; they may name folders of the computer that made the dataset.

```python
from datasets import load_dataset
pairs = load_dataset(\"PATH\", split=\"train\")
pairs[0][\"print\"], pairs[0][\"aligned_mask\"]
```"
            .to_owned(),
            fields,
            ..FormatGuide::default()
        }
    }
}

/// Returns a text as a YAML scalar. JSON strings are YAML.
fn yaml_text(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let is_word = text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(is_plain);
    let is_keyword = matches!(
        text,
        "true" | "false" | "null" | "yes" | "no" | "on" | "off" | "y" | "n"
    );
    if is_word && !is_keyword {
        text.to_owned()
    } else {
        json!(text).to_string()
    }
}

/// Returns the size category of the Hugging Face Hub.
const fn size_category(rows: u64) -> &'static str {
    match rows {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        _ => "1M<n<10M",
    }
}

/// Returns the type of a column as YAML lines of a feature.
fn feature(kind: &ColumnType, indent: &str) -> String {
    let plain = |name: &str| format!("{indent}dtype: {name}\n");
    match kind {
        ColumnType::Text => plain("string"),
        ColumnType::Bool => plain("bool"),
        ColumnType::Int => plain("int64"),
        ColumnType::Real => plain("float64"),
        ColumnType::Image => plain("image"),
        ColumnType::List(element) => match scalar(element) {
            Some(name) => format!("{indent}list: {name}\n"),
            None => format!("{indent}list:\n{}", element_feature(element, indent)),
        },
        ColumnType::Group(fields) => format!("{indent}struct:\n{}", group_feature(fields, indent)),
    }
}

/// Returns the type of the elements of a list as YAML lines.
fn element_feature(kind: &ColumnType, indent: &str) -> String {
    match kind {
        ColumnType::Group(fields) => group_feature(fields, indent),
        other => feature(other, &format!("{indent}  ")),
    }
}

fn group_feature(fields: &[(String, ColumnType)], indent: &str) -> String {
    let field = |(name, kind): &(String, ColumnType)| {
        format!(
            "{indent}- name: {}\n{}",
            yaml_text(name),
            feature(kind, &format!("{indent}  "))
        )
    };
    fields.iter().map(field).collect()
}

/// Returns the name of a type without parts.
const fn scalar(kind: &ColumnType) -> Option<&'static str> {
    match kind {
        ColumnType::Text => Some("string"),
        ColumnType::Bool => Some("bool"),
        ColumnType::Int => Some("int64"),
        ColumnType::Real => Some("float64"),
        ColumnType::Image | ColumnType::List(_) | ColumnType::Group(_) => None,
    }
}
