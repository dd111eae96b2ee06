//! Damaged rows, which are left out of everything that is counted or exported, and always stated.
//!
//! Whether a row is left out depends only on its checksum, which each command compares again. The table `set_apart` only
//! records which of these rows the owner knows of, so that a check no longer reports them as damage.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::json;

use crate::db::left_out::LeftOut;
use crate::db::query::{query, query_scalar};
use crate::db::rows::json_array;
use crate::db::transaction::in_transaction;
use crate::records::faulty_rows::FaultyRow;
use crate::{Catalog, Result};
use mocban_core::domain::{UnixMillis, one_line};

/// Number of rows that [`SetApart`] names.
const NAMED: usize = 20;

/// Damaged rows that a result does not include.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct SetApart {
    /// Number of rows.
    pub count: u64,
    /// The first rows, with their table and what is wrong.
    pub first: Vec<String>,
}

impl SetApart {
    /// Describes rows.
    pub fn of<'a>(rows: impl IntoIterator<Item = &'a FaultyRow>) -> Self {
        let mut found = Self::default();
        for row in rows {
            found.count += 1;
            if found.first.len() < NAMED {
                found.first.push(one_line(&row.to_string()).into_owned());
            }
        }
        found
    }

    /// Returns whether there is no such row.
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns a sentence for users, or `None` if there is no such row.
    pub fn sentence(&self) -> Option<String> {
        let first = self.first.first()?;
        let rows = match self.count {
            1 => "1 stored row that is damaged is".to_owned(),
            count => format!("{count} stored rows that are damaged or missing are"),
        };
        Some(format!(
            "{rows} set apart and not counted, first: {first}; `check` lists them"
        ))
    }
}

const SET_APART: &str = "
INSERT INTO set_apart (record, row, value, fault, at)
SELECT CAST(value ->> 0 AS bigint), CAST(value ->> 1 AS bigint), CAST(value ->> 2 AS bigint), value ->> 3, ?2
FROM json_each(?1) WHERE true
ON CONFLICT (record, row) DO UPDATE SET value = excluded.value, fault = excluded.fault, at = excluded.at";

impl Catalog {
    /// Compares all rows with their checksums. Returns the catalog without the rows that do not agree, and these rows.
    pub async fn without_faulty_rows(&self) -> Result<(Self, Vec<FaultyRow>)> {
        let faulty = self.faulty_rows().await?;
        Ok((self.without(&faulty), faulty))
    }

    /// Like [`Self::without_faulty_rows`], but only compares the rows that counts of verdicts depend on: verdicts, answers to
    /// attention checks, their undos, and the pairs of verdicts. The time grows with their number, not with that of all pairs.
    pub async fn without_faulty_verdicts(&self) -> Result<(Self, Vec<FaultyRow>)> {
        let faulty = self.faulty_rows_of_verdicts().await?;
        Ok((self.without(&faulty), faulty))
    }

    /// Returns the catalog without some rows.
    fn without(&self, faulty: &[FaultyRow]) -> Self {
        let mut by_table: BTreeMap<_, Vec<i64>> = BTreeMap::new();
        for row in faulty {
            by_table.entry(row.table).or_default().push(row.row);
        }
        let arrays = by_table.into_iter();
        let arrays = arrays.map(|(table, rows)| (table, json_array(rows)));
        self.leaving_out(LeftOut::new(arrays.collect()))
    }

    /// Returns whether the user of the database may set rows apart: the owner, or anybody if the catalog is a file.
    pub async fn may_set_apart(&self) -> Result<bool> {
        if !self.is_shared() {
            return Ok(true);
        }
        let mut conn = self.read_conn().await?;
        let may = query_scalar("SELECT has_table_privilege('set_apart', 'INSERT')");
        may.fetch_one(&mut conn).await
    }

    /// Records that the owner knows of damaged rows of append-only tables. The rows stay as they are.
    pub async fn set_apart(&self, rows: Vec<FaultyRow>, now: UnixMillis) -> Result<()> {
        let rows = rows.iter();
        let rows = rows.map(|row| json!([row.table.code(), row.row, row.value, row.fault.name()]));
        let rows = json_array(rows);
        in_transaction!(self, |conn| {
            query(SET_APART).bind(rows).bind(now).execute(conn).await
        })
    }
}
