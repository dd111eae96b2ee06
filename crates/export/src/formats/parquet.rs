//! The format `parquet`: a table with one row per pair and metric, with typed columns, and pictures if requested.

use crate::export_folder::FolderError;
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::PictureError;
use crate::parquet_columns::{CellValue, ColumnType};
use crate::parquet_table::{ParquetTable, TableLayout};
use crate::record::{MetricFields, PairFields, PairRecord};
use crate::record_fields::{METRIC_FIELDS, PAIR_FIELDS, markdown_table, schema_of};
use crate::sample::pictures;
use crate::table_columns::{field_cells, field_columns, picture_cells, picture_columns};

/// The table.
const TABLE: &str = "pairs.parquet";

/// The fields of a row.
#[derive(Debug, serde::Serialize, schemars::JsonSchema)]
struct TableRow<'a> {
    #[serde(flatten)]
    pair: &'a PairFields,
    #[serde(flatten)]
    metric: &'a MetricFields,
}

/// Writes `pairs.parquet`.
pub(super) struct ParquetWriter {
    folder: FormatFolder,
    /// Columns of the fields, without the pictures.
    columns: Vec<(String, ColumnType)>,
    table: Option<ParquetTable>,
}

impl ParquetWriter {
    pub(super) fn begin(folder: FormatFolder) -> Result<Self, FolderError> {
        let context = &folder.context;
        let schema = schema_of::<TableRow<'_>>();
        let columns = field_columns(&schema, &context.meta_columns);
        let mut all = columns.clone();
        if context.options.images {
            all.extend(picture_columns());
        }
        let layout = TableLayout {
            columns: all,
            program: context.program.clone(),
            metadata: Vec::new(),
            share_images: true,
        };
        let table = ParquetTable::create(&folder.root.join(TABLE), &layout)?;
        Ok(Self {
            columns,
            table: Some(table),
            folder,
        })
    }

    /// Returns the cells of a row without pictures.
    fn cells(&self, pair: &PairFields, metric: &MetricFields) -> Vec<CellValue> {
        let row = serde_json::to_value(&TableRow { pair, metric });
        field_cells(row.expect("a row is JSON"), &self.columns)
    }
}

impl FormatWriter for ParquetWriter {
    /// Encodes the pictures of each metric, if they were requested: file names and contents in turn.
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let mut encoded = EncodedPair::default();
        let result = view.result.filter(|_| self.folder.context.options.images);
        for (result, record) in result
            .iter()
            .flat_map(|result| result.metrics.iter().map(move |record| (result, record)))
        {
            for picture in pictures(result, record, true)? {
                encoded.shared.extend(picture.named(&view.record.pair.id));
            }
        }
        Ok(encoded)
    }

    fn append(&mut self, record: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        let missing: Vec<_> = if record.metrics.is_empty() {
            let metrics = self.folder.context.metrics.iter().copied();
            metrics.map(MetricFields::without_result).collect()
        } else {
            Vec::new()
        };
        let mut files = shared.into_iter();
        for metric in record.metrics.iter().chain(&missing) {
            let mut row = self.cells(&record.pair, metric);
            if self.folder.context.options.images {
                row.extend(picture_cells(&mut files));
            }
            if let Some(table) = &mut self.table {
                table.append(row)?;
            }
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        if let Some(table) = self.table.take() {
            table.finish()?;
        }
        Ok(vec![TABLE.to_owned()])
    }

    fn guide(&self) -> FormatGuide {
        let schema = schema_of::<TableRow<'_>>();
        let tables = [("Columns", &PAIR_FIELDS[..]), ("", &METRIC_FIELDS[..])];
        FormatGuide {
            purpose: "Results of block scans aligned with prints, as a table with one row per pair and metric.".to_owned(),
            files: vec![[TABLE, "the table: typed columns, compressed with Snappy"].map(str::to_owned)],
            usage: "\
The user's columns are fields of `meta`, and matrices are lists of rows. The paths of mesh and print are the columns
`mesh_path` and `print_path`. With `--images`, the columns `print`, `print_mask`, `depth`, `aligned_depth` and
`aligned_mask` hold image files: `bytes` and a name as `path`. Equal images of a row group are stored once.

```python
import pandas
pairs = pandas.read_parquet(\"pairs.parquet\")
```"
            .to_owned(),
            fields: markdown_table(&schema, &tables),
            ..FormatGuide::default()
        }
    }
}
