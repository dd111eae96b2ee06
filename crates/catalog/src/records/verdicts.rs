//! Verdicts, in an append-only log. Of a reviewer's verdicts on one result, only the newest counts.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::left_out::{LeftOut, is_counted};
use crate::db::query::{As, Query, query, query_as, query_scalar};
use crate::db::row::from_row;
use crate::db::rows::json_array;
use crate::db::transaction::in_transaction;
use crate::records::checksums;
use crate::records::review_context::ReviewContext;
use crate::records::reviewer_names::{Spellings, of_row};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{
    ContentHash, PairName, Reason, ReviewOrder, ThresholdMetric, UnixMillis, Verdict,
};

/// A verdict to store.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct NewVerdict {
    /// The pair.
    pub pair: PairName,
    /// The judged metric. `None` for all metrics.
    pub metric: Option<ThresholdMetric>,
    /// The judgement.
    pub verdict: Verdict,
    /// Name of the reviewer.
    pub reviewer: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// Note of the reviewer.
    pub note: Option<String>,
    /// Context in which it was given, if known.
    #[serde(flatten)]
    pub context: ReviewContext,
    /// When the verdict was given, if not at the time of storing.
    pub at: Option<UnixMillis>,
}

/// One line of the verdict log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictEvent {
    /// Number in the log.
    pub id: i64,
    /// Number of the reviewer's action. One action can judge several metrics of a pair.
    pub act: i64,
    /// The pair.
    pub pair: PairName,
    /// The metric.
    pub metric: ThresholdMetric,
    /// The result that was judged.
    pub result_hash: ContentHash,
    /// The judgement.
    pub verdict: Verdict,
    /// Name of the reviewer.
    pub reviewer: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// Note of the reviewer.
    pub note: Option<String>,
    /// Context in which it was given, if known.
    #[serde(flatten)]
    pub context: ReviewContext,
    /// When.
    pub at: UnixMillis,
    /// When it was undone, if it was.
    pub undone_at: Option<UnixMillis>,
    /// Whether the judged result is still the current one.
    pub current: bool,
}

from_row! { VerdictEvent { id, act, pair, metric, result_hash, verdict, reviewer by of_row, reason, note, context in row, at, undone_at, current } }

/// A reviewer's newest verdict on a result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ReviewerVerdict {
    /// Name of the reviewer.
    pub reviewer: String,
    /// The judgement.
    pub verdict: Verdict,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// Order of the review queue. [`ReviewOrder::Adjudicate`] marks a decision between conflicting verdicts.
    pub review_order: Option<ReviewOrder>,
}

from_row! { ReviewerVerdict { reviewer by of_row, verdict, reason, review_order } }

/// A verdict that was not undone, with the result that it judges.
#[derive(Debug)]
pub(crate) struct ResultVerdict {
    id: i64,
    pair: i64,
    metric: ThresholdMetric,
    pub(crate) result_hash: ContentHash,
    pub(crate) verdict: ReviewerVerdict,
}

from_row! { ResultVerdict { id, pair, metric, result_hash, verdict in row } }

/// Begins an action, unless a verdict with the same event and metric exists.
const NEW_ACT: &str = "
INSERT INTO review_act (reviewer) SELECT ?1
WHERE ?2 IS NULL OR NOT EXISTS (SELECT 1 FROM verdict WHERE event = ?2 AND metric = ?3)
RETURNING id";

const INSERT: &str = "
INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, reason, note, at,
    event, seen, shown_ms, angle_read_deg, review_order)
SELECT ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14
WHERE ?10 IS NULL OR NOT EXISTS (SELECT 1 FROM verdict WHERE event = ?10 AND metric = ?3)
RETURNING id";

/// Selects the verdict log, without the verdicts of `?1` and the undos of `?2`. The tables are in the order of the join, so
/// that the log of one pair or action reads no other verdicts.
macro_rules! select_log {
    ($from:literal, $condition:literal) => {
        concat!(
            "
SELECT v.id, v.act, p.name AS pair, v.metric, v.result_hash, v.verdict, v.reviewer, v.reason, v.note, v.at,
    v.event, v.seen, v.shown_ms, v.angle_read_deg, v.review_order, u.at AS undone_at, coalesce(m.result_hash = v.result_hash, false) AS current
FROM ",
            $from,
            "
    LEFT JOIN verdict_undo AS u ON u.act = v.act AND ",
            is_counted!("u.act", "?2"),
            "
    LEFT JOIN metric_result AS m ON m.pair = v.pair AND m.metric = v.metric
WHERE ",
            is_counted!("v.id", "?1"),
            " AND ",
            $condition
        )
    };
}

const LOG: &str = select_log!(
    "verdict AS v JOIN pair AS p ON p.id = v.pair",
    "v.id > ?3 ORDER BY v.id LIMIT ?4"
);

pub(crate) const LOG_OF_PAIR: &str = select_log!(
    "pair AS p CROSS JOIN verdict AS v ON v.pair = p.id",
    "p.name = ?3 ORDER BY v.id"
);

pub(crate) const LOG_OF_ACT: &str = select_log!(
    "verdict AS v CROSS JOIN pair AS p ON p.id = v.pair",
    "v.act = ?3 ORDER BY v.id"
);

/// Counts the verdicts of the log, without those of `?1`.
const COUNT: &str = concat!(
    "SELECT count(*) FROM verdict AS v WHERE ",
    is_counted!("v.id", "?1")
);

const UNDO: &str = "
INSERT INTO verdict_undo (act, reviewer, at) SELECT id, reviewer, ?2 FROM review_act WHERE id = ?1";

/// Selects the verdicts of the pairs of `?1`, without the verdicts of `?2` and the undos of `?3`.
pub(crate) const COUNTED: &str = concat!(
    "
SELECT v.id, v.pair, v.metric, v.result_hash, v.verdict, v.reviewer, v.reason, v.review_order
FROM json_each(?1) AS wanted CROSS JOIN verdict AS v ON v.pair = CAST(wanted.atom AS bigint)
WHERE ",
    is_counted!("v.id", "?2"),
    " AND NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act AND ",
    is_counted!("u.act", "?3"),
    ")
ORDER BY v.pair, v.metric, v.reviewer, v.id"
);

impl Catalog {
    /// Undoes the newest action that is not undone yet, and returns its verdicts. If `reviewer` is given, only actions
    /// of this reviewer count. The log keeps the action and records the undo.
    ///
    /// # Errors
    /// Returns an error if there is no action to undo, or if a database operation fails.
    pub async fn verdict_undo(
        &self,
        reviewer: Option<&str>,
        now: UnixMillis,
    ) -> Result<Vec<VerdictEvent>> {
        let reviewer = reviewer.map(str::to_owned);
        in_transaction!(self, |conn| {
            let spellings = match &reviewer {
                Some(reviewer) => Some(Spellings::read(conn).await?.json(reviewer)),
                None => None,
            };
            let act: Option<i64> = query_scalar(
                "SELECT max(v.act) FROM verdict AS v WHERE (?1 IS NULL OR v.reviewer IN (SELECT atom FROM json_each(?1)))
                        AND NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act)",
            )
            .bind(&spellings)
            .fetch_one(&mut *conn)
            .await?;
            let Some(act) = act else {
                return Err(CatalogError::NothingToUndo(reviewer));
            };
            query(UNDO).bind(act).bind(now).execute(&mut *conn).await?;
            checksums::store(conn, ChecksummedTable::VerdictUndo, &[act]).await?;
            let nothing = LeftOut::default();
            let log = logged(LOG_OF_ACT, &nothing).bind(act);
            log.fetch_all(conn).await
        })
    }

    /// Returns the verdict log of one pair, or of all pairs, oldest first.
    pub async fn verdict_log(&self, pair: Option<&PairName>) -> Result<Vec<VerdictEvent>> {
        let mut conn = self.read_conn().await?;
        log(&mut conn, pair, &self.left_out).await
    }

    /// Returns the number of lines of the verdict log.
    pub async fn count_verdicts(&self) -> Result<u64> {
        let mut conn = self.read_conn().await?;
        let left_out = self.left_out.of(ChecksummedTable::Verdict);
        let query = query_scalar(COUNT).bind(left_out);
        query.fetch_one(&mut conn).await
    }

    /// Returns up to `limit` lines of the verdict log with ids above `after`, oldest first.
    pub async fn verdict_log_page(&self, after: i64, limit: usize) -> Result<Vec<VerdictEvent>> {
        let mut conn = self.read_conn().await?;
        let log = logged(LOG, &self.left_out).bind(after);
        log.bind(limit as i64).fetch_all(&mut conn).await
    }
}

/// Appends a verdict row for one metric. Returns the row's action number. Returns `None`, and appends nothing, if a row
/// with the same event and metric exists. If `act` is `None`, the row begins a new action.
pub(crate) async fn insert(
    conn: &mut Conn,
    new: &NewVerdict,
    (pair, metric, result_hash): (i64, ThresholdMetric, ContentHash),
    act: Option<i64>,
    now: UnixMillis,
) -> Result<Option<i64>> {
    let context = &new.context;
    let act = if let Some(act) = act {
        act
    } else {
        let begun = query_scalar(NEW_ACT).bind(&new.reviewer);
        let begun = begun.bind(&context.event).bind(metric.name());
        let Some(act) = begun.fetch_optional(&mut *conn).await? else {
            return Ok(None);
        };
        act
    };
    let inserted: Option<i64> = query_scalar(INSERT)
        .bind(act)
        .bind(pair)
        .bind(metric.name())
        .bind(&result_hash.as_bytes()[..])
        .bind(new.verdict.name())
        .bind(&new.reviewer)
        .bind(new.reason.map(Reason::name))
        .bind(&new.note)
        .bind(new.at.unwrap_or(now))
        .bind(&context.event)
        .bind(context.seen.as_ref().map(|hash| &hash.as_bytes()[..]))
        .bind(context.shown_ms.map(u64::cast_signed))
        .bind(context.angle_read_deg)
        .bind(context.review_order.map(ReviewOrder::name))
        .fetch_optional(&mut *conn)
        .await?;
    let Some(row) = inserted else {
        return Ok(None);
    };
    checksums::store(conn, ChecksummedTable::Verdict, &[row]).await?;
    Ok(Some(act))
}

/// Reads the log of one pair or all.
pub(crate) async fn log(
    conn: &mut Conn,
    pair: Option<&PairName>,
    left_out: &LeftOut,
) -> Result<Vec<VerdictEvent>> {
    let log = match pair {
        Some(pair) => logged(LOG_OF_PAIR, left_out).bind(pair.as_str()),
        None => logged(LOG, left_out).bind(0_i64).bind(i64::MAX),
    };
    log.fetch_all(conn).await
}

/// Returns a query of the log, for the parameters from `?3` on.
fn logged(sql: &'static str, left_out: &LeftOut) -> Query<As<VerdictEvent>> {
    let query = query_as(sql).bind(left_out.of(ChecksummedTable::Verdict));
    query.bind(left_out.of(ChecksummedTable::VerdictUndo))
}

/// Returns each reviewer's newest verdict on each result of the given pairs, sorted by reviewer. Ignores undone
/// verdicts.
pub(crate) async fn of_pairs(
    conn: &mut Conn,
    pairs: &[i64],
    left_out: &LeftOut,
) -> Result<BTreeMap<(i64, ThresholdMetric), Vec<ResultVerdict>>> {
    let query = query_as(COUNTED).bind(json_array(pairs.iter().copied()));
    let query = query.bind(left_out.of(ChecksummedTable::Verdict));
    let query = query.bind(left_out.of(ChecksummedTable::VerdictUndo));
    let mut found: Vec<ResultVerdict> = query.fetch_all(conn).await?;
    // Each spelling's verdicts come oldest first, but those of another spelling may be newer.
    found.sort_unstable_by_key(|given| given.id);
    let mut counted: BTreeMap<_, Vec<ResultVerdict>> = BTreeMap::new();
    for newest in found {
        let of_metric = counted.entry((newest.pair, newest.metric)).or_default();
        of_metric.retain(|old| {
            old.verdict.reviewer != newest.verdict.reviewer || old.result_hash != newest.result_hash
        });
        of_metric.push(newest);
    }
    for of_metric in counted.values_mut() {
        of_metric.sort_by(|a, b| a.verdict.reviewer.cmp(&b.verdict.reviewer));
    }
    Ok(counted)
}
