//! Boxes on the pages of blocks that are known to be right, where a dataset has them.

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::left_out::is_counted;
use crate::db::query::query;
use crate::db::value::Json;
use crate::{Catalog, Result};
use mocban_core::domain::{BlockName, TrueBox};

const SET: &str = "UPDATE block SET true_boxes = ?2 WHERE name = ?1 RETURNING id";

const ALL: &str = concat!(
    "SELECT name, true_boxes FROM block WHERE true_boxes IS NOT NULL AND ",
    is_counted!("id", "?1"),
    " ORDER BY name"
);

impl Catalog {
    /// Stores the true boxes of a block, replacing earlier ones. Returns `false` if there is no such block.
    pub async fn set_true_boxes(&self, block: &BlockName, boxes: &[TrueBox]) -> Result<bool> {
        let text = serde_json::to_string(boxes)?;
        self.update_block(SET, block, Some(text)).await
    }

    /// Returns the blocks that have true boxes, sorted by name.
    pub async fn true_boxes(&self) -> Result<Vec<(BlockName, Vec<TrueBox>)>> {
        let mut conn = self.read_conn().await?;
        let rows = query(ALL).bind(self.left_out.of(ChecksummedTable::Block));
        let rows = rows.fetch_all(&mut conn).await?;
        let blocks = rows.iter().map(|row| {
            let Json(boxes) = row.get("true_boxes")?;
            Ok((row.get("name")?, boxes))
        });
        blocks.collect()
    }
}
