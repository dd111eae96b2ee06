//! Rows that do not agree with their checksums: changed, added and removed rows, whatever changed them.

use std::collections::BTreeSet;

use serde_json::{Map, Value as Json, json};

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::Row;
use crate::db::rows::json_array;
use crate::db::value::Value;
use crate::records::checksums::{COVERED, checksum};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{Affine2, AttentionCheck, PrintFromMesh, enum_names};

/// Number of rows that are read at a time.
const PAGE: i64 = 2000;

/// The tables of all that reviewers answered, but for manual alignments.
const OF_VERDICTS: [ChecksummedTable; 4] = [
    ChecksummedTable::Verdict,
    ChecksummedTable::VerdictUndo,
    ChecksummedTable::Answer,
    ChecksummedTable::AnswerUndo,
];

/// What is wrong with a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowFault {
    /// The row differs from its checksum.
    Changed,
    /// The row is missing, but its checksum or the next row is stored.
    Removed,
    /// The row has no checksum.
    Added,
    /// Rows at the end of a log are missing, with their checksums.
    CutOff,
    /// The row has the right checksum, but a value that this program cannot read, so this program did not store it.
    Invalid,
}

enum_names! { pub RowFault, "a fault of a row":
    Changed = "changed", Removed = "removed", Added = "added", CutOff = "cut_off", Invalid = "invalid",
}

/// A row that does not agree with its checksum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultyRow {
    /// The table.
    pub table: ChecksummedTable,
    /// The row's number.
    pub row: i64,
    /// Name of the pair that the row belongs to, if it is known. The name may be damaged too.
    pub pair: Option<String>,
    /// What is wrong.
    pub fault: RowFault,
    /// The row by column, with bytes as hexadecimal digits. Empty if it is missing.
    pub values: Map<String, Json>,
    /// Whether the owner has set the row apart since it was last changed.
    pub is_set_apart: bool,
    /// The checksum that the row would have. 0 if the row is missing.
    pub(super) value: i64,
}

impl std::fmt::Display for FaultyRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (row, table) = (self.row, self.table);
        let of_pair = self.pair.as_ref();
        let of_pair = of_pair.map_or_else(String::new, |pair| format!(" (pair {pair})"));
        match self.fault {
            RowFault::Changed => {
                write!(
                    f,
                    "row {row} of the table {table}{of_pair} differs from its checksum"
                )
            }
            RowFault::Removed => write!(f, "row {row} of the table {table} is missing"),
            RowFault::Added => write!(f, "row {row} of the table {table}{of_pair} has no checksum"),
            RowFault::CutOff => write!(
                f,
                "the last rows of the table {table}, up to row {row}, are missing"
            ),
            RowFault::Invalid => write!(
                f,
                "row {row} of the table {table}{of_pair} has a value that this program did not store"
            ),
        }
    }
}

const LAST_ROW: &str = "SELECT max(row) FROM checksum WHERE record = ?1";

/// Selects the largest row number that a log has ever had, if it exceeds ?2.
const CUT_OFF: &str = "SELECT seq FROM sqlite_sequence WHERE name = ?1 AND seq > ?2";

const MARKS: &str = "SELECT record, row, value FROM set_apart";

impl Catalog {
    /// Compares the rows of all tables in [`ChecksummedTable`] with their checksums. Returns the rows that do not
    /// agree.
    pub async fn faulty_rows(&self) -> Result<Vec<FaultyRow>> {
        self.faulty_rows_of(&ChecksummedTable::ALL).await
    }

    /// Compares the verdicts, the answers to attention checks, their undos, and the pairs of verdicts with their checksums.
    /// Returns the rows that do not agree.
    pub(super) async fn faulty_rows_of_verdicts(&self) -> Result<Vec<FaultyRow>> {
        let mut faulty = self.faulty_rows_of(&OF_VERDICTS).await?;
        let statements = ChecksummedTable::Pair.statements();
        let judged = self.judged_pairs().await?;
        let mut conn = self.read_conn().await?;
        for pairs in judged.chunks(PAGE as usize) {
            let rows = query(statements.some).bind(ChecksummedTable::Pair.code());
            let rows = rows.bind(json_array(pairs.iter().copied()));
            for row in &rows.fetch_all(&mut conn).await? {
                faulty.extend(faulty_row(ChecksummedTable::Pair, row)?);
            }
        }
        Ok(faulty)
    }

    async fn faulty_rows_of(&self, tables: &[ChecksummedTable]) -> Result<Vec<FaultyRow>> {
        let mut conn = self.snapshot().await?;
        let mut faulty = Vec::new();
        for table in tables {
            faulty_rows(&mut conn, *table, &mut faulty).await?;
        }
        if !faulty.is_empty() {
            let marks: Vec<(i64, i64, i64)> = query_as(MARKS).fetch_all(&mut conn).await?;
            let marks: BTreeSet<_> = marks.into_iter().collect();
            for row in &mut faulty {
                row.is_set_apart = marks.contains(&(row.table.code(), row.row, row.value));
            }
        }
        Ok(faulty)
    }

    /// Verifies the checksums of some tables.
    ///
    /// # Errors
    /// Returns an error that names the first faulty row, or an error if a database operation fails.
    pub(crate) async fn verify_checksums(&self, tables: &[ChecksummedTable]) -> Result<()> {
        match self.faulty_rows_of(tables).await?.first() {
            None => Ok(()),
            Some(faulty) => Err(CatalogError::Corrupt(faulty.to_string())),
        }
    }
}

async fn faulty_rows(
    conn: &mut Conn,
    table: ChecksummedTable,
    faulty: &mut Vec<FaultyRow>,
) -> Result<()> {
    let statements = table.statements();
    let missing = |row, fault| FaultyRow {
        table,
        row,
        pair: None,
        fault,
        values: Map::new(),
        is_set_apart: false,
        value: 0,
    };
    let mut after = i64::MIN;
    loop {
        let page = query(statements.page).bind(table.code());
        let page = page.bind(after).bind(PAGE).fetch_all(&mut *conn).await?;
        let Some(last) = page.last() else { break };
        after = last.get(0)?;
        for row in &page {
            faulty.extend(faulty_row(table, row)?);
        }
    }
    let removed = query_scalar(statements.removed).bind(table.code());
    let removed: Vec<i64> = removed.fetch_all(&mut *conn).await?;
    faulty.extend(
        removed
            .into_iter()
            .map(|row| missing(row, RowFault::Removed)),
    );
    // A sequence of PostgreSQL also counts rows that were rolled back, so it does not show whether rows are missing.
    if statements.is_chained && matches!(conn, Conn::Sqlite(_)) {
        let last: Option<i64> = query_scalar(LAST_ROW)
            .bind(table.code())
            .fetch_one(&mut *conn)
            .await?;
        let cut_off = query_scalar(CUT_OFF)
            .bind(table.name())
            .bind(last.unwrap_or(0));
        let cut_off: Option<i64> = cut_off.fetch_optional(&mut *conn).await?;
        faulty.extend(cut_off.map(|row| missing(row, RowFault::CutOff)));
    }
    Ok(())
}

/// Compares a row of [`Statements::page`] or [`Statements::some`] with its checksum. Returns the row if it is faulty.
fn faulty_row(table: ChecksummedTable, row: &Row) -> Result<Option<FaultyRow>> {
    let stored: Option<i64> = row.get(1)?;
    let before: Option<i64> = row.get(2)?;
    let number = row.get(0)?;
    let value = checksum(table, row, before)?;
    let fault = match stored {
        None => RowFault::Added,
        Some(stored) if stored != value || before.is_some_and(|before| before >= number) => {
            RowFault::Changed
        }
        Some(_) if !is_readable(table, row) => RowFault::Invalid,
        Some(_) => return Ok(None),
    };
    let values = (COVERED..row.len()).map(|column| {
        let value = match row.value(column)? {
            Value::Null => Json::Null,
            Value::Integer(number) => json!(number),
            Value::Real(number) => json!(number),
            Value::Text(text) => json!(String::from_utf8_lossy(&text)),
            Value::Blob(bytes) => {
                let digits = bytes.iter().map(|byte| format!("{byte:02x}"));
                json!(digits.collect::<String>())
            }
        };
        Ok((row.name(column).to_owned(), value))
    });
    Ok(Some(FaultyRow {
        table,
        row: number,
        pair: pair_name(row),
        fault,
        values: values.collect::<Result<_>>()?,
        is_set_apart: false,
        value,
    }))
}

/// Returns whether the values of a row with the right checksum can be read. Constraints of the schema do not compare JSON
/// with the types of this program, so a reviewer's login could store any.
fn is_readable(table: ChecksummedTable, row: &Row) -> bool {
    match table {
        ChecksummedTable::Answer => row.get::<AttentionCheck>("attention_check").is_ok(),
        ChecksummedTable::ManualAlignment => {
            row.get::<Affine2>("print_from_depth").is_ok()
                && row.get::<PrintFromMesh>("print_from_mesh").is_ok()
        }
        _ => true,
    }
}

/// Returns the name of a row's pair. Invalid UTF-8 is replaced, because the name may be what is damaged.
fn pair_name(row: &Row) -> Option<String> {
    match row.value(3) {
        Ok(Value::Text(name)) => Some(String::from_utf8_lossy(&name).into_owned()),
        _ => None,
    }
}
