//! Gives a block other labels.

use crate::blocks::block_job::BlockJob;
use crate::blocks::model::BlockChange;
use crate::blocks::queue::uncounted;
use crate::db::checksummed_table::ChecksummedTable;
use crate::db::query::query_scalar;
use crate::db::transaction::in_transaction;
use crate::jobs::requeue::{self, RetrySelection};
use crate::records::checksums;
use crate::{Catalog, Result};
use mocban_core::domain::BlockName;

const BLOCK_ID: &str = "SELECT id FROM block WHERE name = ?1";

/// Stores the path `?2` if the stored one still is `?3`. The next run reads the file.
const UPDATE: &str = "
UPDATE block SET labels_path = ?2, labels_stat = '' WHERE name = ?1 AND labels_path IS NOT DISTINCT FROM ?3 RETURNING id";

impl Catalog {
    /// Replaces or removes the path of a block's labels, as an import of the block would, if the stored path still is `read`:
    /// nobody can replace labels that they have not seen. The next run finds out which stages are stale.
    pub async fn set_block_labels(
        &self,
        block: &BlockName,
        read: Option<&str>,
        labels: Option<&str>,
    ) -> Result<BlockChange> {
        let block = block.clone();
        let [read, labels] = [read, labels].map(|path| path.map(str::to_owned));
        in_transaction!(self, |conn| {
            let name = block.to_string();
            let update = query_scalar(UPDATE).bind(&name).bind(&labels).bind(&read);
            let id: Option<i64> = update.fetch_optional(&mut *conn).await?;
            let Some(id) = id else {
                let known = query_scalar(BLOCK_ID).bind(&name).fetch_optional(conn);
                let known: Option<i64> = known.await?;
                return Ok(known.map_or(BlockChange::NoBlock, |_| BlockChange::Outdated));
            };
            checksums::store(conn, ChecksummedTable::Block, &[id]).await?;
            // What failed with the other labels is tried again.
            let failed = RetrySelection::<BlockJob>::Names(vec![block]);
            requeue::retry(conn, &failed, &mut uncounted()).await?;
            Ok(BlockChange::Stored)
        })
    }
}
