//! Selections of pairs.

use serde_json::Value;
use sqlx::SqliteConnection;

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::domain::{PairId, PairName};

/// Some pairs of the catalog.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairSelection {
    /// Pair ids as a JSON array, for `json_each`.
    pub(crate) json: String,
    len: usize,
}

impl PairSelection {
    /// Selects pairs.
    pub fn of(pairs: &[PairId]) -> Self {
        let ids: Vec<i64> = pairs.iter().map(|pair| pair.0).collect();
        Self::of_ids(&ids)
    }

    /// Selects pairs by their row ids.
    pub(crate) fn of_ids(ids: &[i64]) -> Self {
        Self {
            len: ids.len(),
            json: Value::from(ids).to_string(),
        }
    }

    /// Returns the number of pairs.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns whether no pair is selected.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// Selects pairs by name; unknown names are left out.
pub(crate) async fn select(
    conn: &mut SqliteConnection,
    names: &[PairName],
) -> Result<PairSelection> {
    let ids: Vec<i64> = sqlx::query_scalar(
        "SELECT id FROM pair WHERE name IN (SELECT value FROM json_each(?1)) ORDER BY id",
    )
    .bind(rows::names_json(names))
    .fetch_all(conn)
    .await?;
    Ok(PairSelection::of_ids(&ids))
}
