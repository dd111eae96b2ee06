//! Single pairs: the latest results, the neighbours of a pair, and the blocks of lists.

use crate::db::query::{query_as, query_scalar};
use crate::records::model::PairResults;
use crate::{Catalog, Result};
use mocban_core::domain::{PairName, UnixMillis};

/// How many attempts are searched for the latest results.
const RECENT_ATTEMPTS: usize = 2000;

/// Completed pairs whose last stage was stored most recently, the newest first.
const RECENT: &str = "
SELECT a.pair FROM attempt AS a CROSS JOIN job AS j ON j.pair = a.pair
WHERE a.stage = 3 AND a.class IS NULL AND j.status = 3 AND a.id > (SELECT coalesce(max(id), 0) - ?1 FROM attempt)
ORDER BY a.id DESC LIMIT ?2";

const LAST_ATTEMPT: &str = "SELECT at FROM attempt ORDER BY id DESC LIMIT 1";

/// The pairs before and after a name.
const NEIGHBOURS: [&str; 2] = [
    "SELECT p.name FROM pair AS p JOIN job AS j ON j.pair = p.id WHERE p.name < ?1 ORDER BY p.name DESC LIMIT 1",
    "SELECT p.name FROM pair AS p JOIN job AS j ON j.pair = p.id WHERE p.name > ?1 ORDER BY p.name LIMIT 1",
];

const NEXT_BLOCK: &str = "SELECT min(block) FROM pair WHERE block > ?1";

impl Catalog {
    /// Returns the completed pairs whose last stage was stored most recently, the newest first.
    pub async fn recent_results(&self, limit: usize) -> Result<Vec<PairResults>> {
        let mut conn = self.snapshot().await?;
        let query = query_as(RECENT).bind(RECENT_ATTEMPTS as i64);
        let ids: Vec<(i64,)> = query.bind(limit as i64).fetch_all(&mut conn).await?;
        let mut distinct: Vec<i64> = Vec::new();
        for (id,) in ids {
            if !distinct.contains(&id) {
                distinct.push(id);
            }
        }
        self.results_of(&mut conn, &distinct).await
    }

    /// Returns when the last attempt at a stage ended.
    pub async fn last_activity(&self) -> Result<Option<UnixMillis>> {
        let mut conn = self.read_conn().await?;
        query_scalar(LAST_ATTEMPT).fetch_optional(&mut conn).await
    }

    /// Returns the names of the pairs before and after a pair, by name.
    pub async fn pair_neighbours(&self, name: &PairName) -> Result<[Option<PairName>; 2]> {
        let mut conn = self.read_conn().await?;
        let mut found = [None, None];
        for (neighbour, sql) in found.iter_mut().zip(NEIGHBOURS) {
            let query = query_scalar(sql).bind(name.as_str());
            *neighbour = query.fetch_optional(&mut conn).await?;
        }
        Ok(found)
    }

    /// Returns the first blocks that lists of pairs name, sorted.
    pub async fn first_listed_blocks(&self, limit: usize) -> Result<Vec<String>> {
        let mut conn = self.snapshot().await?;
        let mut blocks: Vec<String> = Vec::new();
        while blocks.len() < limit {
            let last = blocks.last().map_or("", String::as_str);
            let next: Vec<(Option<String>,)> =
                query_as(NEXT_BLOCK).bind(last).fetch_all(&mut conn).await?;
            match next.into_iter().next() {
                Some((Some(block),)) => blocks.push(block),
                _ => break,
            }
        }
        Ok(blocks)
    }
}
