//! Single pairs: the latest results, the neighbours of a pair, and the blocks of lists.

use crate::db::query::{query, query_as, query_scalar};
use crate::db::row::FromRow as _;
use crate::db::rows::json_array;
use crate::records::import::SELECT;
use crate::records::model::{PairAttributes, PairResults};
use crate::{Catalog, Result};
use mocban_core::domain::{PairId, PairName, ThresholdMetric, UnixMillis};

/// Number of names in one statement.
const LOOKED_UP: usize = 2_000;

/// How many attempts are searched for the latest results.
const RECENT_ATTEMPTS: usize = 2000;

/// How many attempts are searched for the least confident results: those of 2000 pairs of four stages.
const SORTED_ATTEMPTS: usize = 8000;

/// Completed pairs whose last stage was stored most recently, the newest first.
const RECENT: &str = "
SELECT a.pair FROM attempt AS a CROSS JOIN job AS j ON j.pair = a.pair
WHERE a.stage = 3 AND a.class IS NULL AND j.status = 3 AND a.id > (SELECT coalesce(max(id), 0) - ?1 FROM attempt)
ORDER BY a.id DESC LIMIT ?2";

/// Completed pairs whose last stage was stored since a time, least confident first. Confidences are looked up pair by pair in
/// a subquery: for a join, the statistics of PostgreSQL may lead to a scan of the whole table. A result without a confidence
/// comes last.
pub(crate) const LEAST_CONFIDENT: &str = "
SELECT DISTINCT a.pair, coalesce(
        (SELECT m.confidence FROM metric_result AS m WHERE m.pair = a.pair AND m.metric = ?3), 2.0) AS confidence
FROM (SELECT pair, stage, class, at FROM attempt
    WHERE id > (SELECT coalesce(max(id), 0) - ?1 FROM attempt) ORDER BY id DESC LIMIT ?1) AS a
WHERE a.stage = 3 AND a.class IS NULL AND a.at >= ?2 AND (SELECT j.status FROM job AS j WHERE j.pair = a.pair) = 3
ORDER BY confidence, a.pair LIMIT ?4";

const LAST_ATTEMPT: &str = "SELECT at FROM attempt ORDER BY id DESC LIMIT 1";

const BY_ID: &str = "
SELECT name, mesh_path, print_path, unit, scanned_face_down, character, block, meta, prior FROM pair WHERE id = ?1";

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

    /// Returns the completed pairs whose last stage was stored since a time, the least confident by a metric first. No index has
    /// results by time and confidence, so only the newest 8000 attempts are searched: a run that stores more in this
    /// time has only its last 2000 results, or fewer after failures, here.
    pub async fn least_confident_results(
        &self,
        since: UnixMillis,
        metric: ThresholdMetric,
        limit: usize,
    ) -> Result<Vec<PairResults>> {
        let mut conn = self.snapshot().await?;
        let query = query_as(LEAST_CONFIDENT)
            .bind(SORTED_ATTEMPTS as i64)
            .bind(since)
            .bind(metric.name())
            .bind(limit as i64);
        let found: Vec<(i64, f64)> = query.fetch_all(&mut conn).await?;
        let ids: Vec<i64> = found.into_iter().map(|(id, _)| id).collect();
        self.results_of(&mut conn, &ids).await
    }

    /// Returns when the last attempt at a stage ended.
    pub async fn last_activity(&self) -> Result<Option<UnixMillis>> {
        let mut conn = self.read_conn().await?;
        query_scalar(LAST_ATTEMPT).fetch_optional(&mut conn).await
    }

    /// Returns the attributes of the pairs with these names. Leaves out unknown names, and pairs with an invalid value.
    pub async fn pair_attributes(&self, names: &[&PairName]) -> Result<Vec<PairAttributes>> {
        let mut conn = self.read_conn().await?;
        let mut found = Vec::new();
        for names in names.chunks(LOOKED_UP) {
            let names = json_array(names.iter().map(|name| name.as_str()));
            let rows = query(SELECT).bind(&names).fetch_all(&mut conn).await?;
            let pairs = rows.iter();
            found.extend(pairs.filter_map(|row| PairAttributes::from_row(row).ok()));
        }
        Ok(found)
    }

    /// Returns the attributes of a pair by its number, or `None` if there are none that can be read.
    pub async fn attributes_of(&self, pair: PairId) -> Result<Option<PairAttributes>> {
        let mut conn = self.read_conn().await?;
        let row = query(BY_ID).bind(pair.0).fetch_optional(&mut conn).await?;
        Ok(row.and_then(|row| PairAttributes::from_row(&row).ok()))
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
