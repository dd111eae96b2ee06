//! Checksums of the rows that no run can compute again, so that a check finds changed, added and removed rows.
//!
//! The table `checksum` has a row for each row of the tables in [`ChecksummedTable`], written in the same transaction.
//! A checksum is the first 64 bits of a BLAKE3 hash of the table's number, the row's number and the row's columns. For
//! a pair or a block, it covers only the columns that no run writes. The checksum of a verdict, an answer or a manual
//! alignment is stored with the number of the previous row, and covers it. This reveals a row that was removed together
//! with its checksum, and no row can make another one faulty, whoever stores it and when. The tables of undone rows have
//! no such chain.

use serde_json::json;

use crate::Result;
use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::{query, query_scalar};
use crate::db::row::Row;
use crate::db::rows::json_array;
use mocban_core::domain::ContentHash;

/// The statements of one table.
pub(super) struct Statements {
    /// Selects the rows with the listed numbers.
    listed: &'static str,
    /// Selects a page of rows with their checksums.
    pub(super) page: &'static str,
    /// Selects the rows with the numbers of `?2`, with their checksums.
    pub(super) some: &'static str,
    /// Selects the numbers of checksums without a row.
    pub(super) removed: &'static str,
    /// Whether a checksum also covers the previous row's checksum.
    pub(super) is_chained: bool,
}

/// Returns the beginning of a statement that selects rows with their checksums.
macro_rules! checked {
    ($key:literal, $columns:literal, $pair:literal) => {
        concat!(
            "SELECT t.",
            $key,
            ", c.value, c.previous, (SELECT p.name FROM pair AS p WHERE p.id = ",
            $pair,
            "), ",
            $columns
        )
    };
}

/// Builds the statements of a table from its name, its key column, the columns that a checksum covers, an SQL
/// expression for the id of a row's pair, and whether its checksums are chained.
///
/// The first four columns of a selected row are its number, its checksum, the number of the previous row, and the name of
/// its pair. `listed` selects only the number, and NULL for the other three.
macro_rules! statements {
    ($table:literal, $key:literal, $columns:literal, $pair:literal, $is_chained:literal) => {
        Statements {
            listed: concat!(
                "SELECT t.",
                $key,
                ", NULL, NULL, NULL, ",
                $columns,
                " FROM json_each(?1) AS wanted CROSS JOIN ",
                $table,
                " AS t ON t.",
                $key,
                " = CAST(wanted.atom AS bigint) ORDER BY 1"
            ),
            page: concat!(
                checked!($key, $columns, $pair),
                " FROM ",
                $table,
                " AS t LEFT JOIN checksum AS c ON c.record = ?1 AND c.row = t.",
                $key,
                " WHERE t.",
                $key,
                " > ?2 ORDER BY 1 LIMIT ?3"
            ),
            some: concat!(
                checked!($key, $columns, $pair),
                " FROM json_each(?2) AS wanted CROSS JOIN ",
                $table,
                " AS t ON t.",
                $key,
                " = CAST(wanted.atom AS bigint) LEFT JOIN checksum AS c ON c.record = ?1 AND c.row = t.",
                $key,
                " ORDER BY 1"
            ),
            removed: concat!(
                "SELECT row FROM checksum AS c WHERE record = ?1 AND NOT EXISTS (SELECT 1 FROM ",
                $table,
                " AS t WHERE t.",
                $key,
                " = c.row) UNION SELECT c.previous FROM checksum AS c WHERE c.record = ?1 AND c.previous IS NOT NULL \
                 AND NOT EXISTS (SELECT 1 FROM checksum AS p WHERE p.record = ?1 AND p.row = c.previous) ORDER BY 1"
            ),
            is_chained: $is_chained,
        }
    };
}

impl ChecksummedTable {
    #[rustfmt::skip]
    pub(super) const fn statements(self) -> Statements {
        match self {
            Self::Pair => statements!("pair", "id",
                "t.name, t.mesh_path, t.print_path, t.unit, t.scanned_face_down, t.character, t.block, t.meta, \
                 t.prior, t.attributes, t.imported",
                "t.id", false),
            Self::Truth => statements!("truth", "pair", "t.body", "t.pair", false),
            Self::Verdict => statements!("verdict", "id", "t.*", "t.pair", true),
            Self::VerdictUndo => statements!("verdict_undo", "act", "t.*",
                "(SELECT min(v.pair) FROM verdict AS v WHERE v.act = t.act)", false),
            Self::Answer => statements!("attention_check_answer", "id", "t.*", "t.pair", true),
            Self::AnswerUndo => statements!("attention_check_undo", "answer", "t.*",
                "(SELECT a.pair FROM attention_check_answer AS a WHERE a.id = t.answer)", false),
            Self::ManualAlignment => statements!("manual_alignment", "id", "t.*", "t.pair", true),
            Self::ManualAlignmentUndo => statements!("manual_alignment_undo", "alignment", "t.*",
                "(SELECT a.pair FROM manual_alignment AS a WHERE a.id = t.alignment)", false),
            Self::Block => statements!("block", "id",
                "t.name, t.mesh_path, t.page_path, t.labels_path, t.unit, t.side, t.meta, t.attributes, t.imported, \
                 t.true_boxes, t.control_points",
                "NULL", false),
        }
    }

    /// Returns whether rows are only added, never changed.
    pub const fn is_append_only(self) -> bool {
        !matches!(self, Self::Pair | Self::Truth | Self::Block)
    }

    /// Returns whether this is the log of verdicts or of their undos.
    pub const fn is_of_verdicts(self) -> bool {
        matches!(self, Self::Verdict | Self::VerdictUndo)
    }

    /// Returns the number by which the table `checksum` refers to this table.
    pub(super) const fn code(self) -> i64 {
        self as i64
    }
}

/// Index of the first column that a checksum covers, in the rows of `listed` and `page`.
pub(super) const COVERED: usize = 4;

const LAST: &str =
    "SELECT row FROM checksum WHERE record = ?1 AND row < ?2 ORDER BY row DESC LIMIT 1";

const STORE: &str = "
INSERT INTO checksum (record, row, value, previous)
SELECT ?1, CAST(value ->> 0 AS bigint), CAST(value ->> 1 AS bigint), CAST(value ->> 2 AS bigint) FROM json_each(?2) WHERE true
ON CONFLICT (record, row) DO UPDATE SET value = excluded.value";

/// Like [`STORE`], for new rows of append-only tables. PostgreSQL needs no right to change checksums for it.
const APPEND: Sql = Sql::pair(
    STORE,
    "
INSERT INTO checksum (record, row, value, previous)
SELECT ?1, CAST(value ->> 0 AS bigint), CAST(value ->> 1 AS bigint), CAST(value ->> 2 AS bigint) FROM json_each(?2)",
);

const REMOVE: &str = "DELETE FROM checksum WHERE record = ?1 AND row = ?2";

/// Removes the checksum of a row, which the caller removes in the same transaction.
pub(crate) async fn remove(conn: &mut Conn, table: ChecksummedTable, row: i64) -> Result<()> {
    let remove = query(REMOVE).bind(table.code()).bind(row);
    remove.execute(conn).await
}

/// Stores the checksums of new or changed rows. The caller writes the rows earlier in the same transaction.
pub(crate) async fn store(conn: &mut Conn, table: ChecksummedTable, rows: &[i64]) -> Result<()> {
    let Some(first) = rows.iter().min() else {
        return Ok(());
    };
    let listed = query(table.statements().listed).bind(json_array(rows.iter().copied()));
    let listed = listed.fetch_all(&mut *conn).await?;
    let mut before: Option<i64> = None;
    if table.statements().is_chained {
        let last = query_scalar(LAST).bind(table.code()).bind(*first);
        before = last.fetch_optional(&mut *conn).await?;
    }
    store_following(conn, table, &listed, before).await
}

/// Stores the checksums of new or changed rows of a table without chained checksums: the rows that a statement with the
/// columns of [`Statements::listed`] returned.
pub(crate) async fn store_of_rows(
    conn: &mut Conn,
    table: ChecksummedTable,
    rows: &[Row],
) -> Result<()> {
    store_following(conn, table, rows, None).await
}

/// Stores the checksums of rows that follow the row `before`.
async fn store_following(
    conn: &mut Conn,
    table: ChecksummedTable,
    rows: &[Row],
    mut before: Option<i64>,
) -> Result<()> {
    let is_chained = table.statements().is_chained;
    let mut checksums = Vec::with_capacity(rows.len());
    for row in rows {
        let value = checksum(table, row, before)?;
        let number: i64 = row.get(0)?;
        checksums.push(match before {
            Some(before) => json!([number, value, before]),
            None => json!([number, value]),
        });
        before = is_chained.then_some(number);
    }
    let store = query(if table.is_append_only() {
        APPEND
    } else {
        STORE.into()
    });
    let store = store.bind(table.code());
    store.bind(json_array(checksums)).execute(conn).await
}

/// Returns the first 64 bits of a hash. The hash covers the table, the numbers of the row and of the previous row, and the
/// columns from [`COVERED`] on.
pub(super) fn checksum(table: ChecksummedTable, row: &Row, before: Option<i64>) -> Result<i64> {
    let mut bytes = Vec::with_capacity(512);
    bytes.extend(table.code().to_le_bytes());
    bytes.extend(row.get::<i64>(0)?.to_le_bytes());
    bytes.extend(before.unwrap_or(0).to_le_bytes());
    for column in COVERED..row.len() {
        row.value(column)?.hash_into(|part| bytes.extend(part));
    }
    let hash = ContentHash::of(&bytes);
    let (first, _) = hash.as_bytes().split_at(8);
    Ok(i64::from_le_bytes(first.try_into().unwrap_or_default()))
}
