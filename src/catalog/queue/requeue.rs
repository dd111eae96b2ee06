//! Taking pairs up again: after a change of settings or inputs, or because somebody asks.

use std::sync::Arc;

use serde_json::json;
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::alike;
use crate::catalog::queue::alike::made;
use crate::catalog::queue::claim::PairSelection;
use crate::catalog::queue::counters::{Deltas, cursor};
use crate::catalog::queue::fingerprint::{Fingerprints, current_json};
use crate::catalog::queue::staleness::{Cause, RerunPolicy, Seen, decide, look};
use crate::catalog::records::import;
use crate::domain::{FailureClass, JobStatus, PairName, Stage};

/// Which failed pairs to take up again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RetrySelection {
    /// These pairs, whatever keeps them: failed or backing off.
    Names(Vec<PairName>),
    /// All that failed or back off with this class.
    Class(FailureClass),
    /// All that failed or back off.
    All,
}

/// Back to a stage, as if newly imported; never a job that somebody works on.
pub(crate) const REQUEUE: &str = concat!(
    "
UPDATE job SET stage = item.value ->> 1, status = 0, run_at = NULL, prio = 0, attempt = 0, crashes = 0,
    exclusive = 0, made = ",
    made!("(item.value ->> 1)"),
    "
FROM json_each(?1) AS item WHERE job.pair = item.value ->> 0 AND job.status <> 1"
);

const FORGET: &str = "DELETE FROM failure WHERE pair IN (SELECT value ->> 0 FROM json_each(?1))";

const KEPT_BACK: &str = "
SELECT j.pair, j.stage, j.status FROM job AS j JOIN failure AS f ON f.pair = j.pair
WHERE j.status IN (2, 4) AND (?1 IS NULL OR f.class = ?1)";

const KEPT_BACK_AMONG: &str = "
SELECT j.pair, j.stage, j.status FROM json_each(?1) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
WHERE j.status IN (2, 4)";

/// A job that goes back.
struct Moved {
    pair: i64,
    from: (i64, JobStatus),
    to: Stage,
}

impl Catalog {
    /// Sends pairs back whose settings or inputs changed, and what is asked for besides; says how many.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn requeue_stale(
        &self,
        fingerprints: &Fingerprints,
        among: Option<&PairSelection>,
        again: RerunPolicy,
    ) -> Result<u64> {
        let Some(among) = among else {
            return self.send_all_back(fingerprints, again).await;
        };
        let mut sent = 0;
        let mut after = Some(0);
        while let Some(from) = after {
            let (fingerprints, among) = (fingerprints.clone(), among.clone());
            let (moved, next) = self
                .in_transaction(move |conn| {
                    Box::pin(async move { page(conn, &fingerprints, &among, again, from).await })
                })
                .await?;
            sent += moved;
            after = next;
        }
        Ok(sent)
    }

    /// Pairs that are alike go back together; only those that are not are looked at one by one. Each page is a
    /// transaction of its own, so that others' writes are not kept waiting.
    async fn send_all_back(&self, fingerprints: &Fingerprints, again: RerunPolicy) -> Result<u64> {
        let (current, groups) = {
            let mut conn = self.snapshot().await?;
            let current = current_json(&mut conn, fingerprints).await?;
            let groups = alike::groups(&mut conn, &current).await?;
            (current, groups)
        };
        let mut sent = 0;
        for group in groups {
            let group = Arc::new(group);
            let mut after = Some(0);
            while let (Some(from), Some(to)) = (after, goes_back(&group.seen, again)) {
                let group = Arc::clone(&group);
                let (moved, next) = self
                    .in_transaction(move |conn| Box::pin(group_page(conn, group, to, from)))
                    .await?;
                sent += moved;
                after = next;
            }
        }
        let mut after = Some(0);
        while let Some(from) = after {
            let current = current.clone();
            let (moved, next) = self
                .in_transaction(move |conn| Box::pin(apart_page(conn, current, again, from)))
                .await?;
            sent += moved;
            after = next;
        }
        Ok(sent)
    }

    /// Takes failed pairs up again; says how many. Pairs that did not fail are left as they are.
    ///
    /// # Errors
    /// When a named pair is not there; then nothing changes.
    pub async fn retry(&self, selection: &RetrySelection) -> Result<u64> {
        let selection = selection.clone();
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let found = kept_back(conn, &selection).await?;
                apply(conn, &found).await
            })
        })
        .await
    }
}

/// Where a job goes back to; `None` when it stays or waits to be run anyhow.
fn goes_back(seen: &Seen, again: RerunPolicy) -> Option<Stage> {
    let (to, cause) = decide(seen, again)?;
    let waits = matches!(cause, Cause::New | Cause::Unfinished | Cause::BackingOff);
    (!waits).then_some(to)
}

fn moved(seen: &[Seen], again: RerunPolicy) -> Vec<Moved> {
    let moved = |seen: &Seen| {
        Some(Moved {
            pair: seen.pair,
            from: (seen.cursor, seen.status),
            to: goes_back(seen, again)?,
        })
    };
    seen.iter().filter_map(moved).collect()
}

/// One page of some pairs: how many moved, and where the next page begins.
async fn page(
    conn: &mut SqliteConnection,
    fingerprints: &Fingerprints,
    among: &PairSelection,
    again: RerunPolicy,
    after: i64,
) -> Result<(u64, Option<i64>)> {
    let current = current_json(conn, fingerprints).await?;
    let found = look(conn, &current, after, among).await?;
    let sent = apply(conn, &moved(&found, again)).await?;
    Ok((sent, found.last().map(|seen| seen.pair)))
}

/// One page of a group that goes back.
async fn group_page(
    conn: &mut SqliteConnection,
    group: Arc<alike::Group>,
    to: Stage,
    after: i64,
) -> Result<(u64, Option<i64>)> {
    let pairs = alike::members(conn, &group, after).await?;
    let from = (group.seen.cursor, group.seen.status);
    let moved = pairs.iter().map(|pair| Moved {
        pair: *pair,
        from,
        to,
    });
    let sent = apply(conn, &moved.collect::<Vec<_>>()).await?;
    Ok((sent, pairs.last().copied()))
}

/// One page of the pairs that are in no group.
async fn apart_page(
    conn: &mut SqliteConnection,
    current: String,
    again: RerunPolicy,
    after: i64,
) -> Result<(u64, Option<i64>)> {
    let Some((found, last)) = alike::look_apart(conn, &current, after).await? else {
        return Ok((0, None));
    };
    let sent = apply(conn, &moved(&found, again)).await?;
    alike::settle(conn, after, last).await?;
    Ok((sent, Some(last)))
}

async fn kept_back(conn: &mut SqliteConnection, selection: &RetrySelection) -> Result<Vec<Moved>> {
    let found = match selection {
        RetrySelection::All => {
            sqlx::query(KEPT_BACK)
                .bind(None::<&str>)
                .fetch_all(conn)
                .await?
        }
        RetrySelection::Class(class) => {
            sqlx::query(KEPT_BACK)
                .bind(class.name())
                .fetch_all(conn)
                .await?
        }
        RetrySelection::Names(names) => {
            for name in names {
                if import::select(conn, std::slice::from_ref(name))
                    .await?
                    .is_empty()
                {
                    return Err(CatalogError::UnknownPair(name.clone()));
                }
            }
            let among = import::select(conn, names).await?;
            sqlx::query(KEPT_BACK_AMONG)
                .bind(among.json)
                .fetch_all(conn)
                .await?
        }
    };
    found
        .iter()
        .map(|row| {
            let at: i64 = row.try_get("stage")?;
            Ok(Moved {
                pair: row.try_get("pair")?,
                from: (at, rows::status(row.try_get("status")?)?),
                to: rows::stage(at)?,
            })
        })
        .collect()
}

async fn apply(conn: &mut SqliteConnection, moved: &[Moved]) -> Result<u64> {
    if moved.is_empty() {
        return Ok(0);
    }
    let items = moved
        .iter()
        .map(|moved| json!([moved.pair, moved.to.index()]));
    let items = rows::array(items).to_string();
    for sql in [REQUEUE, FORGET] {
        sqlx::query(sql).bind(&items).execute(&mut *conn).await?;
    }
    let mut deltas = Deltas::default();
    for moved in moved {
        deltas.moved(moved.from, (cursor(moved.to), JobStatus::Ready));
    }
    deltas.apply(conn).await?;
    Ok(moved.len() as u64)
}
