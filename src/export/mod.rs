//! Exports results for other tools, and images for people.

mod contact_sheet;
mod earlier_export;
mod export_folder;
mod export_line;
mod file_names;
mod gallery_selection;
mod jsonl;
mod pair_files;
pub mod pictures;
mod source_print;

pub use contact_sheet::{
    ContactSheet, ContactSheetOptions, ContactSheetOrder, DrawError, draw_contact_sheet,
};
pub use export_folder::FolderError;
pub use export_line::{ExportLine, Hashes, LineManualAlignment, LineStatus, Maps, Numbers};
pub use gallery_selection::{GallerySelection, draw_gallery};
pub use jsonl::{ExportError, ExportSummary, JsonlOptions, json_lines, to_jsonl};
pub use pair_files::{Files, FilesError};
pub use source_print::{SourcePrint, SourcePrintError};
