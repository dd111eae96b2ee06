//! One file for each format of exports.

mod annotations;
mod csv;
mod fiji;
mod huggingface;
mod jsonl;
mod mesh;
mod parquet;
mod single_results;
mod viewer;
mod webdataset;

#[cfg(test)]
pub(super) use jsonl::ExportLine;

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
        ExportFormat::WebDataset => Box::new(webdataset::WebDatasetWriter::begin(folder)?),
        ExportFormat::Mesh => Box::new(mesh::MeshWriter::begin(&folder)?),
        ExportFormat::Fiji => Box::new(fiji::FijiWriter::begin(&folder)?),
        ExportFormat::Viewer => Box::new(viewer::ViewerWriter::begin(&folder)?),
        ExportFormat::Annotations => Box::new(annotations::AnnotationWriter::begin(folder)?),
    })
}
