//! A Parquet file that is written row group by row group.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{Compression, Repetition};
use parquet::data_type::{BoolType, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, Type};

use super::export_folder::{FolderError, at};
use super::parquet_columns::{CellValue, ColumnType, LeafColumn, LeafValues};

/// Size of the values in memory, in bytes, at which a row group is written.
const GROUP_BYTES: usize = 8 << 20;
/// Rows in memory at which a row group is written.
const GROUP_ROWS: usize = 4096;
/// Approximate size of a row without images, in bytes.
const ROW_BYTES: usize = 4096;

/// The columns of a table, and how its file is described.
#[derive(Debug, Clone)]
pub(super) struct TableLayout {
    /// Columns by name.
    pub(super) columns: Vec<(String, ColumnType)>,
    /// Name and version of this program.
    pub(super) program: String,
    /// Entries of the file's metadata.
    pub(super) metadata: Vec<(String, String)>,
    /// Whether equal images of a row group are stored once.
    pub(super) share_images: bool,
}

/// A Parquet file in progress.
pub(super) struct ParquetTable {
    path: PathBuf,
    columns: Vec<(String, ColumnType)>,
    writer: SerializedFileWriter<File>,
    leaves: Vec<LeafColumn>,
    rows: usize,
    bytes: usize,
}

impl ParquetTable {
    /// Creates a file.
    pub(super) fn create(path: &Path, layout: &TableLayout) -> Result<Self, FolderError> {
        let file = File::create(path).map_err(at(path))?;
        let writer = open(file, layout).map_err(|error| folder_error(path, error))?;
        let mut table = Self {
            path: path.to_owned(),
            columns: layout.columns.clone(),
            writer,
            leaves: Vec::new(),
            rows: 0,
            bytes: 0,
        };
        table.clear();
        Ok(table)
    }

    /// Appends a row with a cell for each column.
    pub(super) fn append(&mut self, row: Vec<CellValue>) -> Result<(), FolderError> {
        let mut first = 0;
        for ((_, kind), cell) in self.columns.iter().zip(row) {
            if let CellValue::Image(_, bytes) = &cell {
                self.bytes += bytes.len();
            }
            let count = kind.leaf_count();
            kind.append(cell, &mut self.leaves[first..first + count]);
            first += count;
        }
        self.rows += 1;
        self.bytes += ROW_BYTES;
        if self.bytes >= GROUP_BYTES || self.rows >= GROUP_ROWS {
            self.flush()?;
        }
        Ok(())
    }

    /// Returns the size of the file so far, without the row group in memory, in bytes.
    pub(super) fn bytes_written(&self) -> u64 {
        self.writer.bytes_written() as u64
    }

    /// Writes the last row group and the footer.
    pub(super) fn finish(mut self) -> Result<(), FolderError> {
        self.flush()?;
        let closed = self.writer.close();
        closed.map_err(|error| folder_error(&self.path, error))?;
        Ok(())
    }

    fn flush(&mut self) -> Result<(), FolderError> {
        if self.rows > 0 {
            let leaves = std::mem::take(&mut self.leaves);
            let written = write_group(&mut self.writer, leaves);
            written.map_err(|error| folder_error(&self.path, error))?;
        }
        self.clear();
        Ok(())
    }

    fn clear(&mut self) {
        self.leaves = Vec::new();
        for (_, kind) in &self.columns {
            kind.add_leaves(false, &mut self.leaves);
        }
        (self.rows, self.bytes) = (0, 0);
    }
}

fn open(file: File, layout: &TableLayout) -> Result<SerializedFileWriter<File>> {
    let fields = layout
        .columns
        .iter()
        .map(|(name, kind)| kind.parquet_type(name));
    let schema = Type::group_type_builder("pairs")
        .with_repetition(Repetition::REQUIRED)
        .with_fields(fields.collect::<Result<_>>()?)
        .build()?;
    let metadata = layout.metadata.iter();
    let metadata = metadata.map(|(key, value)| KeyValue::new(key.clone(), value.clone()));
    let mut properties = WriterProperties::builder()
        .set_created_by(layout.program.clone())
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(metadata.collect()));
    for (name, kind) in &layout.columns {
        if *kind == ColumnType::Image {
            // PNG and JPEG are compressed already, and their smallest value means nothing.
            let bytes = ColumnPath::from(vec![name.clone(), "bytes".to_owned()]);
            properties = properties
                .set_column_compression(bytes.clone(), Compression::UNCOMPRESSED)
                .set_column_statistics_enabled(bytes.clone(), EnabledStatistics::None)
                .set_column_dictionary_enabled(bytes.clone(), layout.share_images)
                .set_column_dictionary_page_size_limit(bytes, 2 * GROUP_BYTES);
        }
    }
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))
}

fn write_group(writer: &mut SerializedFileWriter<File>, leaves: Vec<LeafColumn>) -> Result<()> {
    let mut group = writer.next_row_group()?;
    for leaf in leaves {
        let Some(mut column) = group.next_column()? else {
            return Err(ParquetError::General("the table lacks a column".to_owned()));
        };
        write_leaf(&mut column, &leaf)?;
        column.close()?;
    }
    group.close()?;
    Ok(())
}

fn write_leaf(column: &mut SerializedColumnWriter<'_>, leaf: &LeafColumn) -> Result<()> {
    let definition = Some(&leaf.definition[..]);
    let repetition = leaf.is_repeated.then_some(&leaf.repetition[..]);
    match &leaf.values {
        LeafValues::Bytes(values) => {
            let writer = column.typed::<ByteArrayType>();
            writer.write_batch(values, definition, repetition)?;
        }
        LeafValues::Bools(values) => {
            let writer = column.typed::<BoolType>();
            writer.write_batch(values, definition, repetition)?;
        }
        LeafValues::Ints(values) => {
            let writer = column.typed::<Int64Type>();
            writer.write_batch(values, definition, repetition)?;
        }
        LeafValues::Reals(values) => {
            let writer = column.typed::<DoubleType>();
            writer.write_batch(values, definition, repetition)?;
        }
    }
    Ok(())
}

/// Returns the error of the file system if there is one, so that a full disk is recognized.
fn folder_error(path: &Path, error: ParquetError) -> FolderError {
    let source = match error {
        ParquetError::External(cause) => match cause.downcast::<std::io::Error>() {
            Ok(error) => *error,
            Err(cause) => std::io::Error::other(cause),
        },
        other => std::io::Error::other(other),
    };
    at(path)(source)
}
