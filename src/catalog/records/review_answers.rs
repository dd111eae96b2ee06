//! Answers of the review page: verdicts on results, and answers to attention checks.

use serde::Serialize;
use sqlx::sqlite::SqliteRow;
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::records::review_context::ReviewContext;
use crate::catalog::records::verdicts::{self, NewVerdict};
use crate::domain::{
    AttentionCheck, ContentHash, PairName, Reason, ThresholdMetric, UnixMillis, Verdict,
};

/// Item shown to a reviewer.
#[derive(Debug, Clone, PartialEq)]
pub enum Shown {
    /// The result of one metric, or of several with equal results, each with its hash.
    Results(Vec<(ThresholdMetric, ContentHash)>),
    /// An attention check made from a metric's result.
    Check {
        /// The kind of check.
        check: AttentionCheck,
        /// The metric it was made from.
        metric: ThresholdMetric,
        /// The result it was made from.
        result_hash: ContentHash,
    },
}

/// An answer that was not undone.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Number by which it is undone.
    pub event: String,
    /// The pair.
    pub pair: PairName,
    /// Hash of the shown item, or of the result if only that is known.
    pub on: AnsweredOn,
    /// The judgement.
    pub verdict: Verdict,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// Note of the reviewer.
    pub note: Option<String>,
    /// When.
    pub at: UnixMillis,
}

/// Item that an answer belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum AnsweredOn {
    /// A result, by its hash.
    Result(ContentHash),
    /// What tests a reviewer, by the hash of what was shown.
    Check(ContentHash),
}

/// An answer to something that tests the reviewer, taken back or not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttentionCheckAnswer {
    /// The pair.
    pub pair: PairName,
    /// The metric whose result it was made from.
    pub metric: ThresholdMetric,
    /// That result.
    pub result_hash: ContentHash,
    /// What was shown.
    pub check: AttentionCheck,
    /// The judgement.
    pub verdict: Verdict,
    /// Who read it.
    pub reviewer: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// Note of the reviewer.
    pub note: Option<String>,
    /// How it came about.
    #[serde(flatten)]
    pub look: ReviewContext,
    /// When.
    pub at: UnixMillis,
    /// When it was taken back, if it was.
    pub undone_at: Option<UnixMillis>,
}

const INSERT_CONTROL: &str = "
INSERT INTO attention_check_answer (event, pair, metric, result_hash, kind, attention_check, seen, shown_ms, angle_read_deg,
    verdict, reviewer, reason, note, at)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14)";

/// Whether this number of the client is taken.
const KNOWN: &str = "
SELECT EXISTS (SELECT 1 FROM verdict WHERE event = ?1) OR EXISTS (SELECT 1 FROM attention_check_answer WHERE event = ?1)";

const ANSWERS: &str = "
SELECT coalesce(v.event, 'act-' || v.act) AS event, p.name, v.result_hash AS hash, 0 AS is_check,
    v.verdict, v.reason, v.note, v.at, v.id
FROM verdict AS v JOIN pair AS p ON p.id = v.pair
WHERE v.reviewer = ?1 AND NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act)
UNION ALL
SELECT c.event, p.name, c.seen, 1, c.verdict, c.reason, c.note, c.at, c.id
FROM attention_check_answer AS c JOIN pair AS p ON p.id = c.pair
WHERE c.reviewer = ?1 AND NOT EXISTS (SELECT 1 FROM attention_check_undo AS u WHERE u.answer = c.id)
ORDER BY v.at, is_check, v.id";

const CONTROLS: &str = "
SELECT c.event, p.name, c.metric, c.result_hash, c.attention_check, c.seen, c.shown_ms, c.angle_read_deg, NULL AS review_order,
    c.verdict, c.reviewer, c.reason, c.note, c.at, u.at AS undone_at
FROM attention_check_answer AS c JOIN pair AS p ON p.id = c.pair LEFT JOIN attention_check_undo AS u ON u.answer = c.id
ORDER BY c.id";

/// Takes back the answer of a number, by its reviewer only; once.
const UNDO: [&str; 3] = [
    "INSERT INTO verdict_undo (act, at) SELECT DISTINCT act, ?3 FROM verdict
        WHERE coalesce(event, 'act-' || act) = ?1 AND reviewer = ?2 ON CONFLICT DO NOTHING",
    "INSERT INTO attention_check_undo (answer, at) SELECT id, ?3 FROM attention_check_answer
        WHERE event = ?1 AND reviewer = ?2 ON CONFLICT DO NOTHING",
    "INSERT INTO manual_alignment_undo (alignment, at) SELECT id, ?3 FROM manual_alignment
        WHERE event = ?1 AND reviewer = ?2 ON CONFLICT DO NOTHING",
];

/// Whether there is something of this number and reviewer to take back, taken back already or not.
const IS_THERE: &str = "
SELECT EXISTS (SELECT 1 FROM verdict WHERE coalesce(event, 'act-' || act) = ?1 AND reviewer = ?2)
    OR EXISTS (SELECT 1 FROM attention_check_answer WHERE event = ?1 AND reviewer = ?2)
    OR EXISTS (SELECT 1 FROM manual_alignment WHERE event = ?1 AND reviewer = ?2)";

impl Catalog {
    /// Appends an answer to what was shown, which may be no current result any more. It is on the disk when this
    /// returns. An answer whose `look.event` is stored already is left alone, so that it may be sent again; says
    /// whether it is new.
    ///
    /// # Errors
    /// When there is no such pair, nothing was shown, or the database returns an error.
    pub async fn answer(&self, given: NewVerdict, shown: Shown, now: UnixMillis) -> Result<bool> {
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let event = given.look.event.as_deref();
                if is_known(conn, event).await? {
                    return Ok(false);
                }
                let pair = pair_id(conn, &given.pair).await?;
                match &shown {
                    Shown::Results(results) => {
                        let mut act = None;
                        for (metric, hash) in results {
                            let judged = (pair, *metric, *hash);
                            act = verdicts::insert(conn, &given, judged, act, now)
                                .await?
                                .or(act);
                        }
                        match act {
                            Some(_) => Ok(true),
                            None => Err(CatalogError::NoResult(given.pair)),
                        }
                    }
                    Shown::Check {
                        check,
                        metric,
                        result_hash,
                    } => {
                        let from = (pair, *metric, *result_hash);
                        insert_check(conn, &given, from, check, now).await?;
                        Ok(true)
                    }
                }
            })
        })
        .await
    }

    /// Takes back what a reviewer did under this number: an answer or an alignment by hand. A second time changes
    /// nothing. The log keeps both.
    ///
    /// # Errors
    /// When the reviewer did nothing under this number.
    pub async fn take_back(&self, event: &str, reviewer: &str, now: UnixMillis) -> Result<()> {
        let (event, reviewer) = (event.to_owned(), reviewer.to_owned());
        self.in_transaction(move |conn| {
            Box::pin(async move {
                let is_there: bool = sqlx::query_scalar(IS_THERE)
                    .bind(&event)
                    .bind(&reviewer)
                    .fetch_one(&mut *conn)
                    .await?;
                if !is_there {
                    return Err(CatalogError::NothingToUndo(reviewer));
                }
                for undo in UNDO {
                    sqlx::query(undo)
                        .bind(&event)
                        .bind(&reviewer)
                        .bind(now)
                        .execute(&mut *conn)
                        .await?;
                }
                Ok(())
            })
        })
        .await
    }

    /// A reviewer's answers that were not taken back, oldest first; one on several results is there once a result.
    ///
    /// # Errors
    /// When the database returns an error.
    pub async fn answers(&self, reviewer: &str) -> Result<Vec<Answer>> {
        let mut conn = self.read_conn().await?;
        let found = sqlx::query(ANSWERS)
            .bind(reviewer)
            .fetch_all(&mut *conn)
            .await?;
        found.iter().map(answer).collect()
    }

    /// Every answer to planted faults and repeats, oldest first. No verdict is among them.
    ///
    /// # Errors
    /// When the database returns an error.
    pub async fn attention_check_answers(&self) -> Result<Vec<AttentionCheckAnswer>> {
        let mut conn = self.read_conn().await?;
        let found = sqlx::query(CONTROLS).fetch_all(&mut *conn).await?;
        found.iter().map(check_answer).collect()
    }

    /// What the names of pictures are made with: the same at every start.
    ///
    /// # Errors
    /// When the database returns an error.
    pub async fn review_key(&self) -> Result<ContentHash> {
        let mut conn = self.read_conn().await?;
        let key: Vec<u8> = sqlx::query_scalar("SELECT key FROM review_key")
            .fetch_one(&mut *conn)
            .await?;
        rows::hash(&key)
    }
}

async fn is_known(conn: &mut SqliteConnection, event: Option<&str>) -> Result<bool> {
    let known = sqlx::query_scalar(KNOWN).bind(event).fetch_one(conn).await;
    Ok(known?)
}

/// The row of a pair.
pub(crate) async fn pair_id(conn: &mut SqliteConnection, name: &PairName) -> Result<i64> {
    let id = sqlx::query_scalar("SELECT id FROM pair WHERE name = ?1")
        .bind(name.as_str())
        .fetch_optional(conn)
        .await?;
    id.ok_or_else(|| CatalogError::UnknownPair(name.clone()))
}

async fn insert_check(
    conn: &mut SqliteConnection,
    given: &NewVerdict,
    (pair, metric, result_hash): (i64, ThresholdMetric, ContentHash),
    check: &AttentionCheck,
    now: UnixMillis,
) -> Result<()> {
    let look = &given.look;
    sqlx::query(INSERT_CONTROL)
        .bind(&look.event)
        .bind(pair)
        .bind(metric.name())
        .bind(&result_hash.as_bytes()[..])
        .bind(check.name())
        .bind(serde_json::to_string(check)?)
        .bind(look.seen.as_ref().map(|hash| &hash.as_bytes()[..]))
        .bind(look.shown_ms.map(u64::cast_signed))
        .bind(look.angle_read_deg)
        .bind(given.verdict.name())
        .bind(&given.reviewer)
        .bind(given.reason.map(Reason::name))
        .bind(&given.note)
        .bind(given.at.unwrap_or(now))
        .execute(conn)
        .await?;
    Ok(())
}

fn answer(row: &SqliteRow) -> Result<Answer> {
    let hash = rows::hash(&row.try_get::<Vec<u8>, _>("hash")?)?;
    Ok(Answer {
        event: row.try_get("event")?,
        pair: rows::pair_name(&row.try_get::<String, _>("name")?)?,
        on: if row.try_get("is_check")? {
            AnsweredOn::Check(hash)
        } else {
            AnsweredOn::Result(hash)
        },
        verdict: rows::name(&row.try_get::<String, _>("verdict")?)?,
        reason: reason(row)?,
        note: row.try_get("note")?,
        at: row.try_get("at")?,
    })
}

fn check_answer(row: &SqliteRow) -> Result<AttentionCheckAnswer> {
    Ok(AttentionCheckAnswer {
        pair: rows::pair_name(&row.try_get::<String, _>("name")?)?,
        metric: rows::name(&row.try_get::<String, _>("metric")?)?,
        result_hash: rows::hash(&row.try_get::<Vec<u8>, _>("result_hash")?)?,
        check: serde_json::from_str(&row.try_get::<String, _>("attention_check")?)?,
        verdict: rows::name(&row.try_get::<String, _>("verdict")?)?,
        reviewer: row.try_get("reviewer")?,
        reason: reason(row)?,
        note: row.try_get("note")?,
        look: ReviewContext::read(row)?,
        at: row.try_get("at")?,
        undone_at: row.try_get("undone_at")?,
    })
}

fn reason(row: &SqliteRow) -> Result<Option<Reason>> {
    let reason: Option<String> = row.try_get("reason")?;
    reason.map(|reason| rows::name(&reason)).transpose()
}
