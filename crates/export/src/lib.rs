//! Aligned pairs and blocks for other tools, pictures for people, and the data of 3D views.
//!
//! - `exporter.rs` reads pages of pairs, encodes them on all cores, and appends them in the order of the catalog
//! - `record.rs` has the fields of a pair that all formats share, `record_fields.rs` their units and frames,
//!   `pair_pictures.rs` reads inputs and artifacts when a format needs them
//! - `formats/` has the formats, which implement `format_writer.rs`; `manifest.rs` recognizes an earlier export, and
//!   `checksums.rs` finds what somebody edited in it
//! - `alignment_files.rs` encodes the pictures of one pair that has no project
//! - `block_lines.rs`, `block_grid.rs` and `page_labels.rs` write whole blocks, their maps and their boxes
//! - `pictures` and `contact_sheet.rs` draw overlays and sheets; `block_view` draws any part of a page, of its relief, or of
//!   both
//! - `import_pictures.rs` draws a page with its labels and a scan before a block is imported
//! - `size_forecast.rs` estimates the size of an export before it is written
//! - `zip_folder.rs` writes an export as one ZIP archive, in the order of `zip_listing.rs`
//! - `scan_view` encodes a scan in the frame of its print for the viewer, on pages of a server and in files
//!
//! Every call fails if the catalog, an input or an artifact cannot be read, or the output cannot be written. `# Errors` names
//! other reasons, and what an error leaves behind.
//!
//! **Invariant:** equal results give equal bytes, memory does not grow with the number of pairs (except for labels of whole
//! pages, and names of files for a ZIP archive and for checksums), and an earlier export is replaced as a whole or not at all.

mod alignment_files;
mod annotations;
mod block_grid;
mod block_lines;
pub mod block_view;
mod checksums;
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
pub mod import_pictures;
mod left_out;
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
mod size_forecast;
mod source_print;
mod split;
mod stage_outcomes;
mod table_columns;
mod zip_error;
mod zip_folder;
mod zip_listing;

pub use alignment_files::{ALIGNMENT_FILES, alignment_files};
pub use checksums::{CHECKSUMS, refuse_edited, write_checksums};
pub use contact_sheet::{
    ContactSheet, ContactSheetOptions, ContactSheetOrder, DrawError, draw_contact_sheet,
};
pub use export_folder::FolderError;
pub use exporter::{ExportSummary, export};
pub use exporter_error::ExportError;
pub use format::ExportFormat;
pub use gallery_selection::{GallerySelection, draw_gallery};
pub use left_out::{OmissionCounts, OmissionReason};
pub use manifest::{MANIFEST as EXPORT_MANIFEST, PairCounts};
pub use options::{ExportOptions, ResultFilter, UnusedOption};
pub use pair_pictures::{PictureError, read_mesh};
pub use record::{
    ManualAlignmentFields, MetricFields, PairFields, PairRecord, RecordStatus, ReviewerFields,
    SplitName,
};
pub use size_forecast::{ExportedSizes, PrintFileSize, shared_bytes};
pub use source_print::{SourcePrint, SourcePrintError};
pub use split::{SplitBy, SplitCounts, SplitSettings, SplitShares};
pub use zip_error::FolderZipError;
pub use zip_folder::{ExportVersion, FolderZip, zip_size};
