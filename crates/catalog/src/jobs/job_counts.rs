//! Counts jobs from their rows, in ranges of pairs. SQLite sorts the rows of a `GROUP BY` in memory, so one statement
//! over all jobs could use too much memory.

use std::collections::BTreeMap;

use crate::db::conn::Conn;
use crate::db::query::{query_as, query_scalar};
use crate::queue::counters::{CounterKey, JobCounts, JobGroup, by_status, counters};
use crate::{Catalog, Result};

/// Pairs counted in one statement.
const RANGE: i64 = 100_000;

pub(crate) const COUNT_RANGE: &str = "
SELECT stage, status, coalesce(fingerprint, 0) AS fingerprint, count(*) AS n FROM job WHERE pair BETWEEN ?1 AND ?2
GROUP BY stage, status, job.fingerprint";

pub(crate) const NEXT_PAIR: &str = "SELECT min(pair) FROM job WHERE pair > ?1";

impl Catalog {
    /// Reads the counters of jobs.
    pub async fn counters(&self) -> Result<JobCounts> {
        let mut conn = self.read_conn().await?;
        Ok(by_status(counters(&mut conn).await?))
    }

    /// Counts all jobs from their rows. In an undamaged catalog, [`Catalog::counters`] gives the same result.
    pub async fn recount(&self) -> Result<JobCounts> {
        let mut conn = self.snapshot().await?;
        Ok(by_status(count_jobs(&mut conn).await?))
    }
}

/// Counts all jobs. In a transaction, all counts are of the same moment.
pub(crate) async fn count_jobs(conn: &mut Conn) -> Result<BTreeMap<CounterKey, u64>> {
    count_in_ranges(conn, RANGE).await
}

async fn count_in_ranges(conn: &mut Conn, range: i64) -> Result<BTreeMap<CounterKey, u64>> {
    let mut counts = BTreeMap::new();
    let mut after = i64::MIN;
    loop {
        let next = query_scalar(NEXT_PAIR).bind(after);
        let Some(from) = next.fetch_one(&mut *conn).await? else {
            return Ok(counts);
        };
        let to = i64::saturating_add(from, range - 1);
        let query = query_as(COUNT_RANGE).bind(from).bind(to);
        let found: Vec<JobGroup> = query.fetch_all(&mut *conn).await?;
        for group in found {
            *counts.entry(group.key).or_default() += group.n;
        }
        after = to;
    }
}

#[cfg(test)]
mod tests {
    use super::{RANGE, count_in_ranges};
    use crate::db::conn::Conn;
    use crate::db::query::{query, query_as};
    use proptest::collection::btree_map;
    use proptest::prelude::*;

    /// Stage, status, fingerprint, number of jobs.
    type CountRow = (i64, i64, i64, i64);

    async fn at_once_and_by_ranges(
        jobs: &[(i64, i64)],
        range: i64,
    ) -> (Vec<CountRow>, Vec<CountRow>) {
        let mut conn = Conn::in_memory().await;
        let table = "CREATE TABLE job (pair INTEGER PRIMARY KEY, stage, status, fingerprint)";
        query(table).execute(&mut conn).await.expect("a table");
        for (pair, kind) in jobs {
            let sql = "INSERT INTO job VALUES (?1, ?2 % 3, ?2 % 2, iif(?2 < 3, NULL, ?2))";
            let insert = query(sql).bind(*pair).bind(*kind);
            insert.execute(&mut conn).await.expect("a row");
        }
        let all = "SELECT stage, status, coalesce(fingerprint, 0), count(*) FROM job
            GROUP BY 1, 2, 3 ORDER BY 1, 2, 3";
        let at_once = query_as(all).fetch_all(&mut conn).await.expect("rows");
        let ranges = count_in_ranges(&mut conn, range).await.expect("counts");
        let ranges = ranges.into_iter().map(|(key, n)| {
            let n = i64::try_from(n).expect("few");
            (key.cursor, key.status.code(), key.fingerprint, n)
        });
        (at_once, ranges.collect())
    }

    proptest! {
        #[test]
        fn counts_by_ranges_add_up_to_the_counts_at_once(
            jobs in btree_map(prop_oneof![-9..30_i64, i64::MIN + 1..], 0..6_i64, 0..40),
            range in prop_oneof![1..9_i64, Just(RANGE), Just(i64::MAX)],
        ) {
            let jobs: Vec<_> = jobs.into_iter().collect();
            let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
            let (at_once, ranges) = runtime.block_on(at_once_and_by_ranges(&jobs, range));
            prop_assert_eq!(at_once, ranges);
        }
    }
}
