//! Finds new pairs and blocks with the files of known ones, which are then counted twice.

use crate::Result;
use crate::db::conn::Conn;
use crate::db::query::query_as;
use crate::db::row::from_row;

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

/// New pairs or blocks with the files of known ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SameFiles {
    /// The first one.
    pub id: String,
    /// A known one with the same files.
    pub known: String,
    /// Number of new ones.
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
