//! The rows of a list of pairs, their columns, and the set of their ids.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::PathBuf;

use super::cell_errors::FormulaErrors;
use super::cell_forms::UnusualCells;
use super::unnamed_values::UnnamedValues;
use super::unread_columns::UnreadColumns;
use crate::columns::{KnownColumns, plain_name};
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{ContentHash, LengthUnit, PairName};

/// One pair of a list. Paths are stored as written; a relative path is relative to the list.
#[derive(Debug, Clone, PartialEq)]
pub struct ManifestRow {
    /// The line where the row starts, counted from 1. For pairs from two directories, the number of the pair.
    pub line: usize,
    /// The pair's id.
    pub name: PairName,
    /// Path of the mesh.
    pub mesh: PathBuf,
    /// Path of the print image.
    pub print: PathBuf,
    /// The character, as text.
    pub character: Option<String>,
    /// The block on which it is carved.
    pub block: Option<String>,
    /// Unit of the mesh's coordinates; `None` if unknown.
    pub unit: Option<LengthUnit>,
    /// Whether the block lay face down in the scanner; `None` if unknown.
    pub scanned_face_down: Option<bool>,
    /// All other columns, without empty cells.
    pub meta: BTreeMap<String, serde_json::Value>,
}

/// Columns that every list needs.
pub(super) const REQUIRED: [&str; 3] = ["id", "mesh", "print"];

/// The other columns with a meaning.
pub(super) const OPTIONAL: [&str; 4] = ["character", "block", "unit", "scanned_face_down"];

/// All columns with a meaning, and their Vietnamese names.
pub(super) const COLUMNS: KnownColumns = KnownColumns {
    names: &[
        "id",
        "mesh",
        "print",
        "character",
        "block",
        "unit",
        "scanned_face_down",
    ],
    other_names: &[
        ("ma_so", "id"),
        ("so_hieu", "id"),
        ("ky_hieu", "id"),
        ("ma_chu", "id"),
        ("so_hieu_chu", "id"),
        ("ma", "id"),
        ("ma_cap", "id"),
        ("ma_hien_vat", "id"),
        ("ban_quet", "mesh"),
        ("ban_quet_3d", "mesh"),
        ("tep_quet", "mesh"),
        ("mo_hinh_3d", "mesh"),
        ("luoi", "mesh"),
        ("tep_ban_quet", "mesh"),
        ("ban_in", "print"),
        ("anh_ban_in", "print"),
        ("anh_in", "print"),
        ("tep_anh", "print"),
        ("tep_ban_in", "print"),
        ("chu", "character"),
        ("mat_chu", "character"),
        ("chu_nom", "character"),
        ("chu_han", "character"),
        ("ky_tu", "character"),
        ("ki_tu", "character"),
        ("ten_chu", "character"),
        ("so_hieu_van", "block"),
        ("ma_van", "block"),
        ("so_hieu_khoi", "block"),
        ("van", "block"),
        ("van_khac", "block"),
        ("khoi", "block"),
        ("moc_ban", "block"),
        ("van_so", "block"),
        ("don_vi", "unit"),
        ("don_vi_do", "unit"),
        ("don_vi_cua_ban_quet", "unit"),
        ("quet_up", "scanned_face_down"),
        ("quet_up_mat", "scanned_face_down"),
    ],
};

/// Columns with ids or paths that only lists of blocks or of verdicts have, and their other names.
const OTHER_LISTS: [&str; 13] = [
    "pair",
    "cap",
    "ma_cap",
    "page",
    "trang",
    "trang_in",
    "anh_trang",
    "anh_trang_in",
    "tep_trang",
    "tep_trang_in",
    "labels",
    "nhan",
    "tep_nhan",
];

/// Returns whether the values of a column in a list of pairs, of blocks or of verdicts are names of things or of files, so
/// that none is a date.
pub(crate) fn is_text_column(header: &str) -> bool {
    let plain = plain_name(header);
    let others = COLUMNS.other_names.iter();
    let names = COLUMNS.names.iter().copied();
    names
        .chain(OTHER_LISTS)
        .chain(others.map(|(name, _)| *name))
        .any(|name| name == plain)
}

/// Returns whether the values of a column in such a list are ids or paths, which are on one line.
pub(crate) fn is_id_or_path_column(header: &str) -> bool {
    let is_one = |name: &str| REQUIRED.contains(&name) || name == "block";
    let plain = plain_name(header);
    let mut others = COLUMNS.other_names.iter();
    is_one(&plain)
        || OTHER_LISTS.contains(&plain.as_str())
        || others.any(|(other, name)| *other == plain && is_one(name))
}

/// What was read of a list whose rows were passed on.
#[derive(Debug, Default)]
pub struct ReadRows {
    /// The ids of the rows.
    pub ids: RowIds,
    /// Columns that were read under other names, as written, each with its name.
    pub renamed: BTreeMap<String, &'static str>,
    /// Columns with other names of columns that are read.
    pub unread_columns: UnreadColumns,
    /// Values in columns without a name.
    pub unnamed: UnnamedValues,
    /// Values of other columns that are errors of formulas.
    pub formula_errors: FormulaErrors,
    /// Cells in unusual forms.
    pub unusual_cells: UnusualCells,
}

/// Why ids that differ only in case are refused.
const ONE_FILE: &str = "so their files would be one on Windows and macOS; rename one of them";

/// Number of hash bytes stored for each id. Among ten million ids, the probability of any collision is below 10^-24.
const HASH_BYTES: usize = 16;

/// The ids of a list, each with its line. Ids are stored as hashes, because a list may have millions of rows. No two ids
/// differ only in upper and lower case: the files of both pairs would fall together on Windows and macOS.
#[derive(Debug, Default)]
pub struct RowIds(BTreeMap<[u8; HASH_BYTES], FirstRow>);

/// The first row with an id in upper or lower case.
#[derive(Debug, Clone, Copy)]
struct FirstRow {
    line: u32,
    /// Hash of the id as written.
    exact: [u8; HASH_BYTES],
}

/// An earlier id that is equal to a new one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct EqualId {
    pub(super) line: u32,
    /// Whether they differ in upper and lower case.
    pub(super) differs_in_case: bool,
}

impl EqualId {
    /// Returns why a row with this id is refused. `kind` is the name of the column.
    pub(super) fn reason(self, kind: &str, text: &str) -> String {
        let (line, text) = (self.line, quoted(text));
        if self.differs_in_case {
            format!(
                "{kind} {text} differs from that on line {line} only in upper and lower case, {ONE_FILE}"
            )
        } else {
            format!("{kind} {text} is already on line {line}")
        }
    }
}

impl RowIds {
    /// Adds an id; returns the earlier one if an equal id was added before.
    pub(super) fn insert(&mut self, name: &PairName, line: usize) -> Option<EqualId> {
        let (folded, exact) = keys(name);
        match self.0.entry(folded) {
            Entry::Occupied(first) => Some(EqualId {
                line: first.get().line,
                differs_in_case: first.get().exact != exact,
            }),
            Entry::Vacant(free) => {
                let line = u32::try_from(line).unwrap_or(u32::MAX);
                free.insert(FirstRow { line, exact });
                None
            }
        }
    }

    /// Returns whether the list contains the id.
    pub fn contains(&self, name: &PairName) -> bool {
        let (folded, exact) = keys(name);
        let first = self.0.get(&folded);
        first.is_some_and(|first| first.exact == exact)
    }

    /// Returns whether the list has no rows.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<'n> FromIterator<&'n PairName> for RowIds {
    fn from_iter<T: IntoIterator<Item = &'n PairName>>(names: T) -> Self {
        let mut ids = Self::default();
        for (line, name) in (1..).zip(names) {
            ids.insert(name, line);
        }
        ids
    }
}

/// Returns the hashes of an id in lower case and as written.
fn keys(name: &PairName) -> ([u8; HASH_BYTES], [u8; HASH_BYTES]) {
    let folded = name.folded();
    let key_of_folded = key(&folded);
    let exact = if folded == name.as_str() {
        key_of_folded
    } else {
        key(name.as_str())
    };
    (key_of_folded, exact)
}

fn key(text: &str) -> [u8; HASH_BYTES] {
    let hash = ContentHash::of(text.as_bytes());
    std::array::from_fn(|at| hash.as_bytes()[at])
}
