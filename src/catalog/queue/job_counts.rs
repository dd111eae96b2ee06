//! Jobs counted by where they stand, in ranges of their numbers: the database sorts what it groups in memory, and that
//! must not grow with the pairs.

use std::collections::BTreeMap;

use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::queue::counters::{Cursor, JobCounts};

/// Numbers of pairs that are counted in one statement.
const RANGE: i64 = 100_000;

/// A statement for [`census`]: the jobs `j` of a range for which a condition holds.
macro_rules! counted {
    ($holds:expr) => {
        concat!(
            "SELECT j.stage, j.status, j.made, count(*) AS n, min(j.pair) AS pair FROM job AS j
    WHERE j.pair BETWEEN ?1 AND ?2 AND ",
            $holds,
            " GROUP BY j.stage, j.status, j.made"
        )
    };
}
pub(crate) use counted;

/// All jobs.
pub(crate) const ALL: &str = counted!("true");

pub(crate) const NEXT: &str = "SELECT min(pair) FROM job WHERE pair > ?1";

/// Where jobs stand, in the order of their stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Standing {
    pub(crate) cursor: Cursor,
    /// As it is stored: a check counts what no program would write, too.
    pub(crate) status: i64,
    /// Fingerprint of the result right behind the cursor.
    pub(crate) made: Option<i64>,
}

/// Jobs that stand alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Alike {
    pub(crate) jobs: u64,
    /// The first of them.
    pub(crate) first: i64,
}

/// Jobs by where they stand.
pub(crate) type Census = BTreeMap<Standing, Alike>;

/// Counts the jobs that a statement by `counted` finds. In a transaction the counts are of one moment.
pub(crate) async fn census(conn: &mut SqliteConnection, sql: &'static str) -> Result<Census> {
    in_ranges(conn, sql, RANGE).await
}

async fn in_ranges(conn: &mut SqliteConnection, sql: &'static str, range: i64) -> Result<Census> {
    let mut all = BTreeMap::new();
    let mut after = i64::MIN;
    loop {
        let next = sqlx::query_scalar(NEXT).bind(after);
        let Some(from) = next.fetch_one(&mut *conn).await? else {
            return Ok(all);
        };
        let to = i64::saturating_add(from, range - 1);
        let query = sqlx::query(sql).bind(from).bind(to);
        for row in query.fetch_all(&mut *conn).await? {
            let standing = Standing {
                cursor: row.try_get("stage")?,
                status: row.try_get("status")?,
                made: row.try_get("made")?,
            };
            let first = row.try_get("pair")?;
            let alike = all.entry(standing).or_insert(Alike { jobs: 0, first });
            alike.jobs += row.try_get::<i64, _>("n")?.unsigned_abs();
        }
        after = to;
    }
}

/// Every job by cursor and status.
pub(crate) fn by_status(census: &Census) -> Result<JobCounts> {
    let mut counts = JobCounts::new();
    for (standing, alike) in census {
        let status = rows::status(standing.status)?;
        *counts.entry((standing.cursor, status)).or_default() += alike.jobs;
    }
    Ok(counts)
}

/// Every job that keeps a fingerprint, by fingerprint.
pub(crate) fn by_fingerprint(census: &Census) -> BTreeMap<i64, u64> {
    let mut counts = BTreeMap::new();
    for (standing, alike) in census {
        if let Some(made) = standing.made {
            *counts.entry(made).or_default() += alike.jobs;
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use proptest::collection::btree_map;
    use proptest::prelude::*;
    use sqlx::{Connection as _, SqliteConnection};

    use super::{ALL, RANGE, in_ranges};

    /// Stage, status, fingerprint, how many, first number.
    type Row = (i64, i64, Option<i64>, i64, i64);

    async fn at_once_and_by_ranges(jobs: &[(i64, i64)], range: i64) -> (Vec<Row>, Vec<Row>) {
        let conn = SqliteConnection::connect("sqlite::memory:").await;
        let mut conn = conn.expect("a database");
        let table = "CREATE TABLE job (pair INTEGER PRIMARY KEY, stage, status, made)";
        sqlx::query(table)
            .execute(&mut conn)
            .await
            .expect("a table");
        for (pair, kind) in jobs {
            let sql = "INSERT INTO job VALUES (?1, ?2 % 3, ?2 % 2, iif(?2 < 3, NULL, ?2))";
            let insert = sqlx::query(sql).bind(pair).bind(kind);
            insert.execute(&mut conn).await.expect("a row");
        }
        let all = "SELECT stage, status, made, count(*), min(pair) FROM job
            GROUP BY stage, status, made ORDER BY stage, status, made";
        let at_once = sqlx::query_as(all)
            .fetch_all(&mut conn)
            .await
            .expect("rows");
        let ranges = in_ranges(&mut conn, ALL, range).await.expect("a census");
        let ranges = ranges.into_iter().map(|(at, alike)| {
            let jobs = i64::try_from(alike.jobs).expect("few");
            (at.cursor, at.status, at.made, jobs, alike.first)
        });
        (at_once, ranges.collect())
    }

    proptest! {
        #[test]
        fn ranges_add_up_to_what_is_counted_at_once(
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
