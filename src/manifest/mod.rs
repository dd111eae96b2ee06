//! Lists of pairs: CSV, JSON Lines, or two directories paired by file stem. The functions parse text or lists of paths
//! and read no files. All problems of a list are reported together.

mod csv;
mod draft;
mod error;
mod folders;
mod jsonl;
mod row;
mod text;

pub use self::csv::{parse_csv, read_csv};
pub use error::ManifestError;
pub use folders::{FolderPairs, is_named_like_input, pair_folders};
pub use jsonl::{parse_jsonl, read_jsonl};
pub use row::{ManifestRow, RowIds};
pub use text::{LineCounter, NotText, as_utf8, delimiter};
