//! Selections of blocks.

use std::collections::BTreeSet;

use crate::db::query::query_scalar;
use crate::db::rows::json_array;
use crate::queue::selection::PairSelection;
use crate::{Catalog, Result};
use mocban_core::domain::{BlockId, BlockName, PairId};

const SELECT: &str =
    "SELECT id FROM block WHERE name IN (SELECT atom FROM json_each(?1)) ORDER BY id";

/// Selects pairs, and the pairs that were cut from some blocks and are not retired.
const WITH_CUT: &str = "
SELECT CAST(atom AS bigint) FROM json_each(?1)
UNION SELECT c.pair FROM block_character AS c JOIN job AS j ON j.pair = c.pair
WHERE c.block IN (SELECT CAST(atom AS bigint) FROM json_each(?2)) ORDER BY 1";

/// Some blocks of the catalog.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BlockSelection(BTreeSet<BlockId>);

impl BlockSelection {
    /// Returns whether no block is selected.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns whether a block is selected.
    pub fn contains(&self, block: BlockId) -> bool {
        self.0.contains(&block)
    }

    /// Returns the ids as a JSON array, for `json_each`.
    pub(crate) fn json(&self) -> String {
        json_array(self.0.iter().map(|block| block.0))
    }
}

impl Catalog {
    /// Returns the blocks with the given names. Unknown names are left out.
    pub async fn select_blocks(&self, names: &[BlockName]) -> Result<BlockSelection> {
        let names: Vec<&str> = names.iter().map(BlockName::as_str).collect();
        let mut conn = self.read_conn().await?;
        let found = query_scalar(SELECT).bind(serde_json::to_string(&names)?);
        let found: Vec<BlockId> = found.fetch_all(&mut conn).await?;
        Ok(BlockSelection(found.into_iter().collect()))
    }

    /// Returns the given pairs together with the pairs that have been cut from the blocks so far, without retired ones.
    pub async fn with_cut_pairs(
        &self,
        pairs: &PairSelection,
        blocks: &BlockSelection,
    ) -> Result<PairSelection> {
        let mut conn = self.read_conn().await?;
        let all = query_scalar(WITH_CUT).bind(&pairs.json);
        let all: Vec<PairId> = all.bind(blocks.json()).fetch_all(&mut conn).await?;
        Ok(PairSelection::of(&all))
    }
}
