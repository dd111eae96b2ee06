//! Attributes of chosen blocks, and whether another block has the same files.

use crate::blocks::model::BlockAttributes;
use crate::db::dialect::Sql;
use crate::db::query::query;
use crate::db::row::FromRow as _;
use crate::db::rows::json_array;
use crate::records::import::is_same_file;
use crate::{Catalog, Result};
use mocban_core::domain::BlockName;

const SELECT: Sql = Sql::pair(
    "
SELECT name, mesh_path, page_path, labels_path, unit, side, meta
FROM block WHERE name IN (SELECT atom FROM json_each(?1))",
    "
SELECT name, mesh_path, page_path, labels_path, unit, side, meta
FROM block WHERE name = ANY (ARRAY(SELECT atom FROM json_each(?1)))",
);

impl BlockAttributes {
    /// Returns whether two blocks have the same scan and page, however their paths are written.
    pub fn has_same_scan_and_page(&self, other: &Self) -> bool {
        is_same_file(&self.mesh_path, &other.mesh_path)
            && is_same_file(&self.page_path, &other.page_path)
    }
}

impl Catalog {
    /// Most blocks whose attributes are read at once. The metadata of each may have a MiB.
    pub const BLOCKS_AT_ONCE: usize = 64;

    /// Returns the attributes of the first [`BLOCKS_AT_ONCE`](Self::BLOCKS_AT_ONCE) blocks of these names, with their metadata.
    /// Leaves out unknown names, and blocks with an invalid value.
    pub async fn block_attributes(&self, names: &[&BlockName]) -> Result<Vec<BlockAttributes>> {
        let mut conn = self.read_conn().await?;
        let names = names.iter().take(Self::BLOCKS_AT_ONCE);
        let names = json_array(names.map(|name| name.as_str()));
        let rows = query(SELECT).bind(&names).fetch_all(&mut conn).await?;
        let blocks = rows.iter();
        Ok(blocks
            .filter_map(|row| BlockAttributes::from_row(row).ok())
            .collect())
    }
}
