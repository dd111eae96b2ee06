//! One file for each format of exports.

mod annotations;
mod csv;
mod csv_cell;
mod fiji;
mod huggingface;
mod jsonl;
mod mesh;
mod parquet;
mod single_results;
mod viewer;
mod viewer_index;
mod webdataset;

#[cfg(test)]
pub(super) use jsonl::ExportLine;

use self::single_results::{SingleResultFormat, SingleResultWriter};
use super::export_folder::FolderError;
use super::format::ExportFormat;
use super::format_writer::{FormatFolder, FormatWriter};

/// Creates the writer of a format for an empty folder.
pub(super) fn begin(
    format: ExportFormat,
    folder: FormatFolder,
) -> Result<Box<dyn FormatWriter>, FolderError> {
    Ok(match format {
        ExportFormat::Jsonl => Box::new(jsonl::JsonlWriter::begin(folder)?),
        ExportFormat::Csv => Box::new(csv::CsvWriter::begin(folder)?),
        ExportFormat::Parquet => Box::new(parquet::ParquetWriter::begin(folder)?),
        ExportFormat::HuggingFace => Box::new(huggingface::HuggingFaceWriter::begin(folder)?),
        ExportFormat::WebDataset => Box::new(webdataset::WebDatasetWriter::begin(folder)),
        ExportFormat::Mesh => single_result::<mesh::PlacedScanFormat>(&folder)?,
        ExportFormat::Fiji => single_result::<fiji::FijiFormat>(&folder)?,
        ExportFormat::Viewer => Box::new(viewer::ViewerWriter::begin(&folder)?),
        ExportFormat::Annotations => Box::new(annotations::AnnotationWriter::begin(folder)?),
    })
}

fn single_result<F: SingleResultFormat + 'static>(
    folder: &FormatFolder,
) -> Result<Box<dyn FormatWriter>, FolderError> {
    Ok(Box::new(SingleResultWriter::<F>::begin(folder)?))
}
