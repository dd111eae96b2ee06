//! Removes blocks that were imported by mistake, or with files that cannot be read.

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::query::{query, query_scalar};
use crate::db::transaction::in_transaction;
use crate::records::checksums;
use crate::{Catalog, Result};
use mocban_core::domain::BlockName;

/// Selects a block that no process works on, from which no pair was cut, and for which nobody chose points or gave boxes.
const WITHOUT_PAIRS: &str = "
SELECT b.id FROM block AS b JOIN block_job AS j ON j.block = b.id
WHERE b.name = ?1 AND j.status <> 1 AND b.control_points IS NULL AND b.true_boxes IS NULL AND NOT EXISTS (
    SELECT 1 FROM block_character AS c WHERE c.block = b.id AND c.pair IS NOT NULL)";

/// Remove all rows of a block. Rows that refer to others come first.
const REMOVE: [&str; 6] = [
    "DELETE FROM block_job WHERE block = ?1",
    "DELETE FROM block_failure WHERE block = ?1",
    "DELETE FROM block_result WHERE block = ?1",
    "DELETE FROM block_attempt WHERE block = ?1",
    "DELETE FROM block_character WHERE block = ?1",
    "DELETE FROM block WHERE id = ?1",
];

impl Catalog {
    /// Removes blocks. Keeps blocks from which pairs were cut, on which a process works, or with control points or true
    /// boxes. Returns the removed blocks.
    ///
    /// # Errors
    /// Returns an error if a database operation fails, such as for a role without the right to remove blocks. In that case
    /// no block is removed.
    pub async fn remove_blocks(&self, names: &[BlockName]) -> Result<Vec<BlockName>> {
        let names = names.to_vec();
        in_transaction!(self, |conn| {
            let mut removed = Vec::new();
            for name in &names {
                if remove(conn, name).await? {
                    removed.push(name.clone());
                }
            }
            Ok(removed)
        })
    }
}

/// Removes a block. Returns whether it did.
async fn remove(conn: &mut Conn, name: &BlockName) -> Result<bool> {
    let id = query_scalar(WITHOUT_PAIRS).bind(name.as_str());
    let id: Option<i64> = id.fetch_optional(&mut *conn).await?;
    let Some(id) = id else { return Ok(false) };
    for statement in REMOVE {
        query(statement).bind(id).execute(&mut *conn).await?;
    }
    checksums::remove(conn, ChecksummedTable::Block, id).await?;
    Ok(true)
}
