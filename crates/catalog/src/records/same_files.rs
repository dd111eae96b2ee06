//! Finds pairs and blocks with the files of other ones, which are then counted twice: new ones by their paths, and after
//! a run by their contents.

use serde::Serialize;

use crate::db::conn::Conn;
use crate::db::query::query_as;
use crate::db::row::from_row;
use crate::{Catalog, Result};
use mocban_core::domain::InputVersion;

/// New pairs with the mesh and print of a pair that was there before and is not retired: how many, and the first one.
const PAIRS: &str = "
SELECT n.name AS id, min(o.name) AS known, count(*) OVER () AS count FROM pair AS n
JOIN pair AS o ON o.mesh_path = n.mesh_path AND o.print_path = n.print_path JOIN job AS j ON j.pair = o.id
WHERE n.id > ?1 AND o.id <= ?1 GROUP BY n.id, n.name ORDER BY n.id LIMIT 1";

/// New blocks with the scan and page of a block that was there before.
const BLOCKS: &str = "
SELECT n.name AS id, min(o.name) AS known, count(*) OVER () AS count FROM block AS n
JOIN block AS o ON o.mesh_path = n.mesh_path AND o.page_path = n.page_path
WHERE n.id > ?1 AND o.id <= ?1 GROUP BY n.id, n.name ORDER BY n.id LIMIT 1";

/// Pairs in the counts whose mesh and print have the contents of those of an earlier pair. `?1` is the hash of files that
/// are missing.
const PAIR_CONTENTS: &str = "
WITH same AS (SELECT p.id, p.name, min(p.id) OVER (PARTITION BY p.mesh_hash, p.print_hash) AS first_id
    FROM pair AS p JOIN job AS j ON j.pair = p.id WHERE p.mesh_hash <> ?1 AND p.print_hash <> ?1)
SELECT s.name AS id, o.name AS known, count(*) OVER () AS count FROM same AS s JOIN pair AS o ON o.id = s.first_id
WHERE s.id <> s.first_id ORDER BY s.id LIMIT 1";

/// Blocks whose scan and page have the contents of those of an earlier block. Blocks whose pairs are all retired are left
/// out.
const BLOCK_CONTENTS: &str = "
WITH same AS (SELECT id, name, min(id) OVER (PARTITION BY mesh_hash, page_hash) AS first_id
    FROM block WHERE mesh_hash <> ?1 AND page_hash <> ?1 AND (
        NOT EXISTS (SELECT 1 FROM block_character AS c WHERE c.block = block.id AND c.pair IS NOT NULL)
        OR EXISTS (SELECT 1 FROM block_character AS c JOIN job AS j ON j.pair = c.pair WHERE c.block = block.id)))
SELECT s.name AS id, o.name AS known, count(*) OVER () AS count FROM same AS s JOIN block AS o ON o.id = s.first_id
WHERE s.id <> s.first_id ORDER BY s.id LIMIT 1";

/// Pairs or blocks with the files of others.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SameFiles {
    /// The first one.
    pub id: String,
    /// An earlier one with the same files.
    pub known: String,
    /// Number of copies, without the first of each.
    pub count: u64,
}

from_row! { SameFiles { id, known, count } }

/// Returns the pairs after `last` with the files of earlier ones.
pub(crate) async fn pairs(conn: &mut Conn, last: i64) -> Result<Option<SameFiles>> {
    query_as(PAIRS).bind(last).fetch_optional(conn).await
}

/// Returns the blocks after `last` with the files of earlier ones.
pub(crate) async fn blocks(conn: &mut Conn, last: i64) -> Result<Option<SameFiles>> {
    query_as(BLOCKS).bind(last).fetch_optional(conn).await
}

/// Pairs and blocks with the contents of others.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct SameContents {
    /// Pairs with the same mesh and print.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<SameFiles>,
    /// Blocks with the same scan and page.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blocks: Option<SameFiles>,
}

impl SameContents {
    /// Returns whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.pairs.is_none() && self.blocks.is_none()
    }

    /// Returns a sentence about the pairs and one about the blocks, if there are any.
    pub fn sentences(&self) -> Vec<String> {
        let sentence = |found: &SameFiles, kind: &str, files: &str| {
            let SameFiles { id, known, count } = found;
            format!(
                "{kind} with the same {files} as an earlier one: {count}, first {id}, as {known}; `retire` takes a copy out of \
                 every count"
            )
        };
        let pairs = self.pairs.iter();
        let pairs = pairs.map(|found| sentence(found, "pairs", "mesh and print"));
        let blocks = self.blocks.iter();
        let blocks = blocks.map(|found| sentence(found, "blocks", "scan and page"));
        pairs.chain(blocks).collect()
    }
}

impl Catalog {
    /// Returns pairs and blocks whose files have the contents of others, as they were last read. Reads all pairs.
    pub async fn same_contents(&self) -> Result<SameContents> {
        let mut conn = self.read_conn().await?;
        let missing = InputVersion::gone().hash;
        let pairs = query_as(PAIR_CONTENTS).bind(&missing.as_bytes()[..]);
        let pairs = pairs.fetch_optional(&mut conn).await?;
        let blocks = query_as(BLOCK_CONTENTS).bind(&missing.as_bytes()[..]);
        let blocks = blocks.fetch_optional(&mut conn).await?;
        Ok(SameContents { pairs, blocks })
    }
}
