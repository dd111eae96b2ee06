//! Exports results for other tools, and images for people.

mod annotations;
mod block_grid;
mod block_lines;
pub mod block_view;
mod contact_sheet;
mod export_folder;
mod export_logs;
mod exporter;
mod exporter_error;
mod fiji;
mod format;
mod format_writer;
mod formats;
mod gallery_selection;
mod manifest;
mod mesh;
mod options;
mod page_labels;
mod pair_files;
mod pair_pictures;
mod pair_writer;
mod parquet_columns;
mod parquet_table;
pub mod pictures;
mod readme;
mod record;
mod record_fields;
mod sample;
pub mod scan_view;
mod source_print;
mod split;
mod stage_outcomes;
mod table_columns;

pub use contact_sheet::{
    ContactSheet, ContactSheetOptions, ContactSheetOrder, DrawError, draw_contact_sheet,
};
pub use export_folder::FolderError;
pub use exporter::{ExportSummary, export};
pub use exporter_error::ExportError;
pub use format::ExportFormat;
pub use gallery_selection::{GallerySelection, draw_gallery};
pub use manifest::PairCounts;
pub use options::{ExportOptions, ResultFilter, UnusedOption};
pub use pair_pictures::{InputFileLimits, PictureError};
pub use record::{
    ManualAlignmentFields, MetricFields, PairFields, PairRecord, RecordStatus, ReviewerFields,
    SplitName,
};
pub use source_print::{SourcePrint, SourcePrintError};
pub use split::{SplitBy, SplitCounts, SplitSettings, SplitShares};
