//! Gives a block other labels.

use crate::blocks::block_job::BlockJob;
use crate::blocks::queue::uncounted;
use crate::db::checksummed_table::ChecksummedTable;
use crate::db::query::{query, query_scalar};
use crate::db::transaction::in_transaction;
use crate::jobs::requeue::{self, RetrySelection};
use crate::records::checksums;
use crate::{Catalog, Result};
use mocban_core::domain::BlockName;

const STORED: &str = "SELECT labels_path FROM block WHERE name = ?1";

/// Stores the path `?2` if the stored one still is `?3`. The next run reads the file.
const UPDATE: &str = "
UPDATE block SET labels_path = ?2, labels_stat = '' WHERE name = ?1 AND labels_path IS NOT DISTINCT FROM ?3 RETURNING id";

/// What became of other labels of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockLabelsChange {
    /// Their path is stored.
    Stored,
    /// The block has other labels than the caller has read. Nothing is changed.
    Outdated,
    /// There is no such block.
    NoBlock,
}

impl Catalog {
    /// Stores the path of the labels of a block, or none, if the stored path still is `read`, as an import of the block would.
    /// So nobody replaces labels that they have not seen. The next run finds out which stages are stale.
    pub async fn set_block_labels(
        &self,
        block: &BlockName,
        read: Option<&str>,
        labels: Option<&str>,
    ) -> Result<BlockLabelsChange> {
        let block = block.clone();
        let [read, labels] = [read, labels].map(|path| path.map(str::to_owned));
        in_transaction!(self, |conn| {
            let name = block.to_string();
            let row = query(STORED).bind(&name).fetch_optional(&mut *conn);
            let Some(row) = row.await? else {
                return Ok(BlockLabelsChange::NoBlock);
            };
            let stored: Option<String> = row.get("labels_path")?;
            if stored != read {
                return Ok(BlockLabelsChange::Outdated);
            }
            let update = query_scalar(UPDATE).bind(&name).bind(&labels).bind(&stored);
            let id: Option<i64> = update.fetch_optional(&mut *conn).await?;
            let Some(id) = id else {
                return Ok(BlockLabelsChange::Outdated);
            };
            checksums::store(conn, ChecksummedTable::Block, &[id]).await?;
            // What failed with the other labels is tried again.
            let failed = RetrySelection::<BlockJob>::Names(vec![block]);
            requeue::retry(conn, &failed, &mut uncounted()).await?;
            Ok(BlockLabelsChange::Stored)
        })
    }
}
