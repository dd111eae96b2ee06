//! Selections of pairs.

use crate::db::conn::Conn;
use crate::db::error::Result;
use crate::db::query::query_scalar;
use crate::db::rows::{json_array, names_json};
use mocban_core::domain::{PairId, PairName};

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
        Self {
            len: pairs.len(),
            json: json_array(pairs.iter().map(|pair| pair.0)),
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
pub(crate) async fn select(conn: &mut Conn, names: &[PairName]) -> Result<PairSelection> {
    let sql = "SELECT id FROM pair WHERE name IN (SELECT atom FROM json_each(?1)) ORDER BY id";
    let query = query_scalar(sql).bind(names_json(names));
    let pairs: Vec<PairId> = query.fetch_all(conn).await?;
    Ok(PairSelection::of(&pairs))
}

/// Returns the names that are not pairs, in the order given.
pub(crate) async fn unknown_names(conn: &mut Conn, names: &[PairName]) -> Result<Vec<PairName>> {
    let sql = "SELECT atom FROM json_each(?1) AS given
        WHERE NOT EXISTS (SELECT 1 FROM pair WHERE name = given.atom) ORDER BY given.key";
    let query = query_scalar(sql).bind(names_json(names));
    query.fetch_all(conn).await
}
