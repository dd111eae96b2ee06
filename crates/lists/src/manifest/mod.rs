//! Lists of pairs: CSV, JSON Lines, or two directories paired by file stem; and lists of whole blocks in CSV or JSON. The
//! functions parse text or lists of paths and read no files. All problems of a list are reported together.

mod block_columns;
mod block_list;
mod cell_errors;
mod cell_forms;
mod changed_ids;
mod chosen_columns;
mod column_names;
mod csv;
mod decimal_ids;
mod draft;
mod encoding_hint;
mod error;
mod folder_file;
mod folders;
mod json_array;
mod json_rows;
mod jsonl;
mod later_header;
mod list_head;
mod list_kind;
mod missing_words;
mod misspelt_columns;
mod row;
mod row_reader;
mod similar_columns;
mod similar_files;
mod text;
mod unnamed_values;
mod unread_columns;
mod whole_numbers;

pub use self::csv::{fits_header, parse_csv, read_csv, read_csv_as};
pub use block_list::{BlockRow, ReadBlocks, parse_blocks, read_block_json, read_blocks};
pub use cell_errors::{FormulaErrors, cell_error, formula_error};
pub use cell_forms::{UnusualCells, plain_cell, plain_header};
pub use changed_ids::ChangedIds;
pub use chosen_columns::ChosenColumns;
pub use decimal_ids::DecimalIds;
pub use error::ManifestError;
pub use folders::{
    FolderPairs, ListedFolder, MESH_EXTENSIONS, PRINT_EXTENSIONS, PairingChanges,
    is_named_like_input, is_named_like_mesh, is_named_like_print, pair_folders,
};
pub use json_array::{ArrayCursor, DamagedArray, is_array, place_in_row};
pub use jsonl::{parse_jsonl, read_jsonl};
pub use later_header::later_header;
pub use list_head::{ListHead, read_head};
pub use list_kind::ListKind;
pub use misspelt_columns::MisspeltColumns;
pub use row::{ManifestRow, ReadRows, RowIds};
pub(crate) use row::{is_id_or_path_column, is_text_column};
pub use text::{CsvText, LineCounter, NotText, as_utf8, trimmed};
pub use unnamed_values::UnnamedValues;
pub use unread_columns::UnreadColumns;
pub use whole_numbers::{whole_and_decimals, whole_part};
