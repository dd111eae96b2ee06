//! Aligned pairs and pictures for other tools and for people.

mod by_hand;
mod files;
mod folder;
mod gallery;
mod jsonl;
mod line;
pub mod pictures;
mod sheet;
mod tiles;

pub use by_hand::ByHand;
pub use files::{Files, FilesError, Print};
pub use folder::FolderError;
pub use gallery::{Chosen, draw_gallery};
pub use jsonl::{ExportError, ExportSummary, JsonlOptions, json_lines, to_jsonl};
pub use line::{Hashes, Line, LineStatus, Maps, Numbers};
pub use sheet::{Sheet, SheetError, SheetOptions, SheetOrder, draw_sheet};
