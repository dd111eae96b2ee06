//! Stores the control points of blocks.

use crate::blocks::model::BlockChange;
use crate::db::checksummed_table::ChecksummedTable;
use crate::db::query::{query, query_scalar};
use crate::db::transaction::in_transaction;
use crate::records::checksums;
use crate::{Catalog, Result};
use mocban_core::domain::{BlockName, ContentHash, ControlPoints};

const STORED: &str = "SELECT control_points FROM block WHERE name = ?1";

/// Stores points `?2` if the stored ones still are `?3`.
const UPDATE: &str = "
UPDATE block SET control_points = ?2 WHERE name = ?1 AND control_points IS NOT DISTINCT FROM ?3 RETURNING id";

impl Catalog {
    /// Stores the control points of a block, or removes them, if the stored ones still have the hash `read`; `None` stands
    /// for no points. So nobody replaces points that they have not seen. The next run finds out which stages are stale.
    pub async fn set_control_points(
        &self,
        block: &BlockName,
        read: Option<ContentHash>,
        points: Option<&ControlPoints>,
    ) -> Result<BlockChange> {
        let text = points.map(serde_json::to_string).transpose()?;
        let name = block.to_string();
        in_transaction!(self, |conn| {
            let row = query(STORED).bind(&name).fetch_optional(&mut *conn);
            let Some(row) = row.await? else {
                return Ok(BlockChange::NoBlock);
            };
            let stored: Option<String> = row.get("control_points")?;
            let points = stored.as_deref().map(serde_json::from_str::<ControlPoints>);
            if points.transpose()?.map(|points| points.hash()) != read {
                return Ok(BlockChange::Outdated);
            }
            let update = query_scalar(UPDATE).bind(&name).bind(&text).bind(&stored);
            let id: Option<i64> = update.fetch_optional(&mut *conn).await?;
            let Some(id) = id else {
                return Ok(BlockChange::Outdated);
            };
            checksums::store(conn, ChecksummedTable::Block, &[id]).await?;
            Ok(BlockChange::Stored)
        })
    }
}
