//! Verdicts: an append-only log; the newest of each reviewer on a result counts.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sqlx::sqlite::SqliteRow;
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::records::review_context::ReviewContext;
use crate::domain::{
    ContentHash, PairName, Reason, ReviewOrder, ThresholdMetric, UnixMillis, Verdict,
};

/// A verdict to store.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct NewVerdict {
    /// The pair.
    pub pair: PairName,
    /// One metric's result, or those of all metrics.
    pub metric: Option<ThresholdMetric>,
    /// The judgement.
    pub verdict: Verdict,
    /// Who read it.
    pub reviewer: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// In the reviewer's words.
    pub note: Option<String>,
    /// Context in which it was given, if known.
    #[serde(flatten)]
    pub look: ReviewContext,
    /// When it was given, where that was before it is stored.
    pub at: Option<UnixMillis>,
}

/// One line of the verdict log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictEvent {
    /// Number in the log.
    pub id: i64,
    /// Number of the act; one act judges one or all metrics of a pair.
    pub act: i64,
    /// The pair.
    pub pair: PairName,
    /// The metric.
    pub metric: ThresholdMetric,
    /// The result that was judged.
    pub result_hash: ContentHash,
    /// The judgement.
    pub verdict: Verdict,
    /// Who read it.
    pub reviewer: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// In the reviewer's words.
    pub note: Option<String>,
    /// Context in which it was given, if known.
    #[serde(flatten)]
    pub look: ReviewContext,
    /// When.
    pub at: UnixMillis,
    /// When it was taken back, if it was.
    pub undone_at: Option<UnixMillis>,
    /// Whether the pair's current result is still the one that was judged.
    pub current: bool,
}

/// A verdict that counts: the newest of its reviewer on its result, not taken back.
#[derive(Debug)]
pub(crate) struct Counted {
    pub(crate) result_hash: ContentHash,
    pub(crate) verdict: Verdict,
    pub(crate) reviewer: String,
    pub(crate) reason: Option<Reason>,
    pub(crate) review_order: Option<ReviewOrder>,
}

/// Results that a verdict on a pair judges: those of a job that is done.
const JUDGED: &str = "
SELECT p.id AS pair, m.metric, m.result_hash FROM pair AS p
    JOIN job AS j ON j.pair = p.id LEFT JOIN metric_result AS m ON m.pair = p.id AND j.status = 3
WHERE p.name = ?1 ORDER BY m.metric";

const INSERT: &str = "
INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, reason, note, at,
    event, seen, shown_ms, angle_read_deg, review_order)
SELECT coalesce(?1, (SELECT coalesce(max(id), 0) + 1 FROM verdict)), ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14
WHERE ?10 IS NULL OR NOT EXISTS (SELECT 1 FROM verdict WHERE event = ?10 AND metric = ?3)
RETURNING act";

/// Lines of the log of one act, or of one pair, or all.
const LOG: &str = "
SELECT v.id, v.act, p.name, v.metric, v.result_hash, v.verdict, v.reviewer, v.reason, v.note, v.at,
    v.event, v.seen, v.shown_ms, v.angle_read_deg, v.review_order, u.at AS undone_at, coalesce(m.result_hash = v.result_hash, 0) AS current
FROM verdict AS v JOIN pair AS p ON p.id = v.pair LEFT JOIN verdict_undo AS u ON u.act = v.act
    LEFT JOIN metric_result AS m ON m.pair = v.pair AND m.metric = v.metric
WHERE (?1 IS NULL OR v.act = ?1) AND (?2 IS NULL OR p.name = ?2) ORDER BY v.id";

pub(crate) const COUNTED: &str = "
SELECT v.pair, v.metric, v.result_hash, v.verdict, v.reviewer, v.reason, v.review_order
FROM json_each(?1) AS wanted CROSS JOIN verdict AS v ON v.pair = wanted.value
WHERE NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act)
ORDER BY v.pair, v.metric, v.reviewer, v.id";

impl Catalog {
    /// Appends verdicts on the current results, all or none. Those that are there already by the client's number are
    /// left alone; says how many were not.
    ///
    /// # Errors
    /// When a pair is not there or has no result; then nothing is stored.
    pub async fn verdict_set(&self, verdicts: Vec<NewVerdict>, now: UnixMillis) -> Result<u64> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let mut stored = 0;
                for verdict in &verdicts {
                    stored += u64::from(append(conn, verdict, now).await?);
                }
                Ok(stored)
            })
        })
        .await
    }

    /// Takes back the newest act that is not taken back yet, of one reviewer or of anybody; says which.
    /// The log keeps both.
    ///
    /// # Errors
    /// When there is none.
    pub async fn verdict_undo(
        &self,
        reviewer: Option<&str>,
        now: UnixMillis,
    ) -> Result<Vec<VerdictEvent>> {
        let reviewer = reviewer.map(str::to_owned);
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let act: Option<i64> = sqlx::query_scalar(
                    "SELECT max(v.act) FROM verdict AS v WHERE (?1 IS NULL OR v.reviewer = ?1)
                        AND NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act)",
                )
                .bind(&reviewer)
                .fetch_one(&mut *conn)
                .await?;
                let Some(act) = act else {
                    let who = reviewer.unwrap_or_else(|| "anybody".to_owned());
                    return Err(CatalogError::NothingToUndo(who));
                };
                sqlx::query("INSERT INTO verdict_undo (act, at) VALUES (?1, ?2)")
                    .bind(act)
                    .bind(now)
                    .execute(&mut *conn)
                    .await?;
                let found = sqlx::query(LOG)
                    .bind(act)
                    .bind(None::<&str>)
                    .fetch_all(conn)
                    .await?;
                found.iter().map(event).collect()
            })
        })
        .await
    }

    /// The log, oldest first, of one pair or of all.
    ///
    /// # Errors
    /// When the database returns an error.
    pub async fn verdict_log(&self, pair: Option<&PairName>) -> Result<Vec<VerdictEvent>> {
        let mut conn = self.read_conn().await?;
        log(&mut conn, pair).await
    }
}

/// Says whether anything of it is new.
async fn append(conn: &mut SqliteConnection, new: &NewVerdict, now: UnixMillis) -> Result<bool> {
    let judged = sqlx::query(JUDGED)
        .bind(new.pair.as_str())
        .fetch_all(&mut *conn)
        .await?;
    if judged.is_empty() {
        return Err(CatalogError::UnknownPair(new.pair.clone()));
    }
    let mut act: Option<i64> = None;
    let mut found = false;
    for row in &judged {
        let Some(metric) = row.try_get::<Option<String>, _>("metric")? else {
            return Err(CatalogError::NoResult(new.pair.clone()));
        };
        let metric = rows::name(&metric)?;
        if new.metric.is_some_and(|wanted| wanted != metric) {
            continue;
        }
        found = true;
        let hash = rows::hash(&row.try_get::<Vec<u8>, _>("result_hash")?)?;
        let judged = (row.try_get("pair")?, metric, hash);
        act = insert(conn, new, judged, act, now).await?.or(act);
    }
    match new.metric {
        Some(metric) if !found => Err(CatalogError::NoMetricResult(new.pair.clone(), metric)),
        Some(_) | None => Ok(act.is_some()),
    }
}

/// Appends one row on a result of a pair; its act is the number of the act's first row, which is returned. A row with the
/// client's number of one that is there already is left out.
pub(crate) async fn insert(
    conn: &mut SqliteConnection,
    new: &NewVerdict,
    (pair, metric, result_hash): (i64, ThresholdMetric, ContentHash),
    act: Option<i64>,
    now: UnixMillis,
) -> Result<Option<i64>> {
    let look = &new.look;
    let act = sqlx::query_scalar(INSERT)
        .bind(act)
        .bind(pair)
        .bind(metric.name())
        .bind(&result_hash.as_bytes()[..])
        .bind(new.verdict.name())
        .bind(&new.reviewer)
        .bind(new.reason.map(Reason::name))
        .bind(&new.note)
        .bind(new.at.unwrap_or(now))
        .bind(&look.event)
        .bind(look.seen.as_ref().map(|hash| &hash.as_bytes()[..]))
        .bind(look.shown_ms.map(u64::cast_signed))
        .bind(look.angle_read_deg)
        .bind(look.review_order.map(ReviewOrder::name))
        .fetch_optional(conn)
        .await?;
    Ok(act)
}

pub(crate) async fn log(
    conn: &mut SqliteConnection,
    pair: Option<&PairName>,
) -> Result<Vec<VerdictEvent>> {
    let found = sqlx::query(LOG)
        .bind(None::<i64>)
        .bind(pair.map(PairName::as_str))
        .fetch_all(conn)
        .await?;
    found.iter().map(event).collect()
}

fn event(row: &SqliteRow) -> Result<VerdictEvent> {
    let reason: Option<String> = row.try_get("reason")?;
    Ok(VerdictEvent {
        id: row.try_get("id")?,
        act: row.try_get("act")?,
        pair: rows::pair_name(&row.try_get::<String, _>("name")?)?,
        metric: rows::name(&row.try_get::<String, _>("metric")?)?,
        result_hash: rows::hash(&row.try_get::<Vec<u8>, _>("result_hash")?)?,
        verdict: rows::name(&row.try_get::<String, _>("verdict")?)?,
        reviewer: row.try_get("reviewer")?,
        reason: reason.map(|reason| rows::name(&reason)).transpose()?,
        note: row.try_get("note")?,
        look: ReviewContext::read(row)?,
        at: row.try_get("at")?,
        undone_at: row.try_get("undone_at")?,
        current: row.try_get("current")?,
    })
}

/// The verdicts that count, of some pairs, in the order of reviewers.
pub(crate) async fn of_pairs(
    conn: &mut SqliteConnection,
    pairs: &[i64],
) -> Result<BTreeMap<(i64, ThresholdMetric), Vec<Counted>>> {
    let found = sqlx::query(COUNTED)
        .bind(Value::from(pairs).to_string())
        .fetch_all(conn)
        .await?;
    let mut counted: BTreeMap<_, Vec<Counted>> = BTreeMap::new();
    for row in &found {
        let metric = rows::name(&row.try_get::<String, _>("metric")?)?;
        let reason: Option<String> = row.try_get("reason")?;
        let order: Option<String> = row.try_get("review_order")?;
        let newest = Counted {
            result_hash: rows::hash(&row.try_get::<Vec<u8>, _>("result_hash")?)?,
            verdict: rows::name(&row.try_get::<String, _>("verdict")?)?,
            reviewer: row.try_get("reviewer")?,
            reason: reason.map(|reason| rows::name(&reason)).transpose()?,
            review_order: order.map(|order| rows::name(&order)).transpose()?,
        };
        let of_metric = counted.entry((row.try_get("pair")?, metric)).or_default();
        // Rows come oldest first, so a later one of the same reviewer on the same result takes its place.
        of_metric.retain(|old| {
            (&old.reviewer, old.result_hash) != (&newest.reviewer, newest.result_hash)
        });
        of_metric.push(newest);
    }
    Ok(counted)
}
