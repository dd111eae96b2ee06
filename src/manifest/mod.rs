//! Lists of pairs: CSV, JSON Lines, two folders by file stem. Pure: text and listings in, rows or problems out.
//!
//! All problems of a list are collected before it is refused, so that one look is enough to mend it.

mod csv;
mod draft;
mod error;
mod folders;
mod ids;
mod jsonl;
mod text;

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::domain::{LengthUnit, PairName};

pub use self::csv::{parse_csv, read_csv};
pub use error::{ManifestError, Place, Problem};
pub use folders::{FolderPairs, pair_folders};
pub use ids::Ids;
pub use jsonl::{parse_jsonl, read_jsonl};
pub use text::{LineCounter, NotText, as_utf8, delimiter};

/// One pair as a list gives it. Paths are as written: relative ones are relative to the list.
#[derive(Debug, Clone, PartialEq)]
pub struct ManifestRow {
    /// Line the row begins at, counted from 1; for pairs of two folders the row's number.
    pub line: usize,
    /// The pair's id.
    pub name: PairName,
    /// Where the mesh is.
    pub mesh: PathBuf,
    /// Where the print image is.
    pub print: PathBuf,
    /// The character, as text.
    pub character: Option<String>,
    /// The block it is carved on.
    pub block: Option<String>,
    /// Unit of the mesh's coordinates; `None` when it is not known.
    pub unit: Option<LengthUnit>,
    /// Whether the block lay face down in the scanner; `None` when it is not known.
    pub scanned_face_down: Option<bool>,
    /// All other columns, empty ones left out.
    pub meta: BTreeMap<String, serde_json::Value>,
}

/// Names of the columns that mean something.
pub const COLUMNS: [&str; 7] = [
    "id",
    "mesh",
    "print",
    "character",
    "block",
    "unit",
    "scanned_face_down",
];

/// Columns no list can do without.
pub const REQUIRED: [&str; 3] = ["id", "mesh", "print"];
