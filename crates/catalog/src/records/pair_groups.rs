//! Groups of pairs and columns of the user, for exports.

use std::collections::BTreeMap;

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::dialect::Sql;
use crate::db::left_out::is_counted;
use crate::db::query::{query, query_scalar};
use crate::{Catalog, Result};
use mocban_core::domain::PairName;

const META_COLUMNS: Sql = Sql::pair(
    concat!(
        "SELECT DISTINCT m.key FROM pair AS p, json_each(p.meta) AS m WHERE ",
        is_counted!("p.id", "?1"),
        " ORDER BY m.key"
    ),
    concat!(
        "SELECT DISTINCT m.key COLLATE \"C\" AS key FROM pair AS p, json_object_keys(CAST(p.meta AS json)) AS m (key) WHERE ",
        is_counted!("p.id", "?1"),
        " ORDER BY 1"
    ),
);

const GROUPS: &str = concat!(
    "
SELECT p.shared, min(p.name) AS name, count(*) AS pairs FROM (
    SELECT CASE ?1 WHEN 'block' THEN nullif(block, '') WHEN 'character' THEN nullif(character, '') END AS shared, name
    FROM pair WHERE NOT EXISTS (SELECT 1 FROM retired_pair AS r WHERE r.pair = pair.id) AND ",
    is_counted!("pair.id", "?2"),
    ") AS p
GROUP BY p.shared, CASE WHEN p.shared IS NULL THEN p.name END"
);

const SHARED_PRINTS: &str = concat!(
    "
SELECT p.print_path, min(p.name) AS first FROM pair AS p
WHERE NOT EXISTS (SELECT 1 FROM retired_pair AS r WHERE r.pair = p.id) AND ",
    is_counted!("p.id", "?1"),
    " GROUP BY p.print_path HAVING count(*) > 1"
);

impl Catalog {
    /// Returns the names of the user's columns of all pairs, sorted.
    pub async fn meta_columns(&self) -> Result<Vec<String>> {
        let mut conn = self.read_conn().await?;
        let query = query_scalar(META_COLUMNS).bind(self.left_out.of(ChecksummedTable::Pair));
        query.fetch_all(&mut conn).await
    }

    /// Counts the pairs with equal values of an attribute, which is `block`, `character` or another text for none. A
    /// pair without a value is counted alone. A key is whether the pair is alone, then the value or the pair's name.
    pub async fn pair_groups(&self, attribute: &str) -> Result<BTreeMap<(bool, String), u64>> {
        let mut conn = self.read_conn().await?;
        let query = query(GROUPS).bind(attribute);
        let query = query.bind(self.left_out.of(ChecksummedTable::Pair));
        let found = query.fetch_all(&mut conn).await?;
        let groups = found.iter().map(|row| {
            let shared: Option<String> = row.get("shared")?;
            let key = match shared {
                Some(value) => (false, value),
                None => (true, row.get("name")?),
            };
            Ok((key, row.get("pairs")?))
        });
        groups.collect()
    }

    /// Returns the paths of prints that several pairs share, such as pages, each with the first of its pairs by name.
    pub async fn shared_prints(&self) -> Result<BTreeMap<String, PairName>> {
        let mut conn = self.read_conn().await?;
        let query = query(SHARED_PRINTS).bind(self.left_out.of(ChecksummedTable::Pair));
        let found = query.fetch_all(&mut conn).await?;
        let prints = found
            .iter()
            .map(|row| Ok((row.get("print_path")?, row.get("first")?)));
        prints.collect()
    }
}
