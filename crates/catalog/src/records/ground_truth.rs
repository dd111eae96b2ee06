//! Ground truth: the true alignments that a dataset gives for its pairs, stored unchanged.

use serde_json::{Value, json};

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::query::query_scalar;
use crate::db::rows::json_array;
use crate::records::checksums;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::PairName;

const SET: &str = "
INSERT INTO truth (pair, body)
SELECT p.id, item.value ->> 'body' FROM json_each(?1) AS item CROSS JOIN pair AS p ON p.name = item.value ->> 'name'
WHERE true
ON CONFLICT (pair) DO UPDATE SET body = excluded.body
RETURNING pair";

const UNKNOWN: &str = "
SELECT item.value ->> 'name' FROM json_each(?1) AS item
WHERE NOT EXISTS (SELECT 1 FROM pair AS p WHERE p.name = item.value ->> 'name') LIMIT 1";

impl Catalog {
    /// Returns whether any pair has a true alignment.
    pub async fn has_truth(&self) -> Result<bool> {
        let mut conn = self.read_conn().await?;
        let exists = query_scalar("SELECT EXISTS (SELECT 1 FROM truth)");
        exists.fetch_one(&mut conn).await
    }
}

/// Stores true alignments unchanged, replacing earlier ones. Returns their number. The caller begins the transaction.
pub(crate) async fn set(conn: &mut Conn, truths: &[(PairName, Value)]) -> Result<u64> {
    let mut stored = 0;
    for chunk in truths.chunks(500) {
        let items = chunk.iter();
        let items = items.map(|(name, body)| json!({ "name": name, "body": body.to_string() }));
        let items = json_array(items);
        let unknown = query_scalar(UNKNOWN).bind(&items);
        if let Some(name) = unknown.fetch_optional(&mut *conn).await? {
            return Err(CatalogError::UnknownPair(name));
        }
        let pairs: Vec<i64> = query_scalar(SET).bind(items).fetch_all(&mut *conn).await?;
        checksums::store(conn, ChecksummedTable::Truth, &pairs).await?;
        stored += pairs.len() as u64;
    }
    Ok(stored)
}
