//! Aligned pairs and pictures for other tools and for people.

mod contact_sheet;
mod export_folder;
mod export_line;
mod gallery_selection;
mod jsonl;
mod manual_alignment;
mod pair_files;
pub mod pictures;
mod tiles;

pub use contact_sheet::{
    ContactSheet, ContactSheetOptions, ContactSheetOrder, DrawError, draw_contact_sheet,
};
pub use export_folder::FolderError;
pub use export_line::{ExportLine, Hashes, LineStatus, Maps, Numbers};
pub use gallery_selection::{GallerySelection, draw_gallery};
pub use jsonl::{ExportError, ExportSummary, JsonlOptions, json_lines, to_jsonl};
pub use manual_alignment::LineManualAlignment;
pub use pair_files::{Files, FilesError, SourcePrint};
