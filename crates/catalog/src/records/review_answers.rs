//! Answers on the review page: verdicts on results, and answers to attention checks.

use serde::Serialize;

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::left_out::is_counted;
use crate::db::query::{query_as, query_scalar};
use crate::db::row::{FromRow, Row, from_row};
use crate::db::transaction::in_transaction;
use crate::records::checksums;
use crate::records::review_context::ReviewContext;
use crate::records::reviewer_names::{Spellings, of_row, to_store};
use crate::records::verdicts::{self, NewVerdict};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{
    AttentionCheck, ContentHash, PairName, Reason, ThresholdMetric, UnixMillis, Verdict,
};

/// Item shown to a reviewer.
#[derive(Debug, Clone, PartialEq)]
pub enum Shown {
    /// Results of one or several metrics that look the same to the reviewer, each with its hash.
    Results(Vec<(ThresholdMetric, ContentHash)>),
    /// An attention check made from a metric's result.
    Check {
        /// The kind of check.
        check: AttentionCheck,
        /// The metric whose result the check was made from.
        metric: ThresholdMetric,
        /// Hash of that metric's result.
        result_hash: ContentHash,
    },
}

/// An answer that was not undone.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Id by which it is undone.
    pub event: String,
    /// The pair.
    pub pair: PairName,
    /// The item that it belongs to.
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

from_row! { Answer { event, pair, on in row, verdict, reason, note, at } }

/// Item that an answer belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum AnsweredOn {
    /// A result, by its hash.
    Result(ContentHash),
    /// An attention check, by the hash of what was shown.
    Check(ContentHash),
}

impl FromRow for AnsweredOn {
    fn from_row(row: &Row) -> Result<Self> {
        let hash = row.get("hash")?;
        let is_check = row.get("is_check")?;
        Ok(if is_check {
            Self::Check(hash)
        } else {
            Self::Result(hash)
        })
    }
}

/// An answer to an attention check, undone or not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttentionCheckAnswer {
    /// Number in the log.
    #[serde(skip)]
    pub id: i64,
    /// The pair.
    pub pair: PairName,
    /// The metric whose result the check was made from.
    pub metric: ThresholdMetric,
    /// Hash of that metric's result.
    pub result_hash: ContentHash,
    /// The kind of check.
    pub check: AttentionCheck,
    /// The judgement.
    pub verdict: Verdict,
    /// Name of the reviewer.
    pub reviewer: String,
    /// Why, for a fail.
    pub reason: Option<Reason>,
    /// Note of the reviewer.
    pub note: Option<String>,
    /// Context in which it was given.
    #[serde(flatten)]
    pub context: ReviewContext,
    /// When.
    pub at: UnixMillis,
    /// When it was undone, if it was.
    pub undone_at: Option<UnixMillis>,
}

from_row! { AttentionCheckAnswer { id, pair, metric, result_hash, check, verdict, reviewer by of_row, reason, note, context in row, at, undone_at } }

const INSERT_CHECK: &str = "
INSERT INTO attention_check_answer (event, pair, metric, result_hash, kind, attention_check, seen, shown_ms, angle_read_deg,
    verdict, reviewer, reason, note, at)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14)
RETURNING id";

/// Whether an answer with this event is stored.
const KNOWN: &str = "
SELECT EXISTS (SELECT 1 FROM verdict WHERE event = ?1) OR EXISTS (SELECT 1 FROM attention_check_answer WHERE event = ?1)";

/// Selects the answers of a reviewer, with the spellings `?1` of the name, without the verdicts of `?2`, the answers of `?4`, and their undos of `?3` and `?5`.
const ANSWERS: &str = concat!(
    "
SELECT coalesce(v.event, 'act-' || v.act) AS event, p.name AS pair, v.result_hash AS hash, 0 AS is_check,
    v.verdict, v.reason, v.note, v.at AS at, v.id AS id
FROM verdict AS v JOIN pair AS p ON p.id = v.pair
WHERE v.reviewer IN (SELECT atom FROM json_each(?1)) AND ",
    is_counted!("v.id", "?2"),
    " AND NOT EXISTS (SELECT 1 FROM verdict_undo AS u WHERE u.act = v.act AND ",
    is_counted!("u.act", "?3"),
    ")
UNION ALL
SELECT c.event, p.name, c.seen, 1, c.verdict, c.reason, c.note, c.at, c.id
FROM attention_check_answer AS c JOIN pair AS p ON p.id = c.pair
WHERE c.reviewer IN (SELECT atom FROM json_each(?1)) AND ",
    is_counted!("c.id", "?4"),
    " AND NOT EXISTS (SELECT 1 FROM attention_check_undo AS u WHERE u.answer = c.id AND ",
    is_counted!("u.answer", "?5"),
    ")
ORDER BY at, is_check, id"
);

/// Selects answers to attention checks, without the answers of `?3` and the undos of `?4`.
const CHECK_ANSWERS: &str = concat!(
    r#"
SELECT c.id, c.event, p.name AS pair, c.metric, c.result_hash, c.attention_check AS "check", c.seen, c.shown_ms, c.angle_read_deg,
    NULL AS review_order, c.verdict, c.reviewer, c.reason, c.note, c.at, u.at AS undone_at
FROM attention_check_answer AS c JOIN pair AS p ON p.id = c.pair LEFT JOIN attention_check_undo AS u ON u.answer = c.id AND "#,
    is_counted!("u.answer", "?4"),
    "
WHERE c.id > ?1 AND ",
    is_counted!("c.id", "?3"),
    " ORDER BY c.id LIMIT ?2"
);

/// Statements that undo what a reviewer stored under an event id, with their tables. A second undo has no effect.
const UNDO: [(ChecksummedTable, &str); 3] = [
    (
        ChecksummedTable::VerdictUndo,
        "INSERT INTO verdict_undo (act, reviewer, at) SELECT DISTINCT act, reviewer, ?3 FROM verdict
        WHERE coalesce(event, 'act-' || act) = ?1 AND reviewer IN (SELECT atom FROM json_each(?2)) ON CONFLICT DO NOTHING RETURNING act",
    ),
    (
        ChecksummedTable::AnswerUndo,
        "INSERT INTO attention_check_undo (answer, reviewer, at) SELECT id, reviewer, ?3 FROM attention_check_answer
        WHERE event = ?1 AND reviewer IN (SELECT atom FROM json_each(?2)) ON CONFLICT DO NOTHING RETURNING answer",
    ),
    (
        ChecksummedTable::ManualAlignmentUndo,
        "INSERT INTO manual_alignment_undo (alignment, reviewer, at) SELECT id, reviewer, ?3 FROM manual_alignment
        WHERE event = ?1 AND reviewer IN (SELECT atom FROM json_each(?2)) ON CONFLICT DO NOTHING RETURNING alignment",
    ),
];

/// Whether a reviewer stored anything under an event id, undone or not.
const EXISTS: &str = "
SELECT EXISTS (SELECT 1 FROM verdict WHERE coalesce(event, 'act-' || act) = ?1 AND reviewer IN (SELECT atom FROM json_each(?2)))
    OR EXISTS (SELECT 1 FROM attention_check_answer WHERE event = ?1 AND reviewer IN (SELECT atom FROM json_each(?2)))
    OR EXISTS (SELECT 1 FROM manual_alignment WHERE event = ?1 AND reviewer IN (SELECT atom FROM json_each(?2)))";

impl Catalog {
    /// Appends an answer to a shown item durably, even if the shown result is outdated. Returns `false`, and stores
    /// nothing, if an answer with the same `context.event` exists.
    ///
    /// # Errors
    /// Returns an error if there is no such pair, if `shown` lists no result, or if a database operation fails.
    pub async fn answer(&self, given: NewVerdict, shown: Shown, now: UnixMillis) -> Result<bool> {
        in_transaction!(self, |conn| {
            let known = query_scalar(KNOWN).bind(&given.context.event);
            if known.fetch_one(&mut *conn).await? {
                return Ok(false);
            }
            let pair = pair_id(conn, &given.pair).await?;
            let given = NewVerdict {
                reviewer: to_store(conn, &given.reviewer).await?,
                ..given
            };
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
    }

    /// Undoes what a reviewer stored under an event id: a verdict, an answer to an attention check, or a manual
    /// alignment. A second call changes nothing. The log keeps the answer and records the undo.
    ///
    /// # Errors
    /// Returns an error if the reviewer stored nothing under this event id, or if a database operation fails.
    pub async fn undo_event(&self, event: &str, reviewer: &str, now: UnixMillis) -> Result<()> {
        let (event, reviewer) = (event.to_owned(), reviewer.to_owned());
        in_transaction!(self, |conn| {
            let spellings = Spellings::read(conn).await?.json(&reviewer);
            let exists: bool = query_scalar(EXISTS)
                .bind(&event)
                .bind(&spellings)
                .fetch_one(&mut *conn)
                .await?;
            if !exists {
                return Err(CatalogError::NothingToUndo(Some(reviewer)));
            }
            for (table, undo) in UNDO {
                let undo = query_scalar(undo).bind(&event).bind(&spellings);
                let undone: Vec<i64> = undo.bind(now).fetch_all(&mut *conn).await?;
                checksums::store(conn, table, &undone).await?;
            }
            Ok(())
        })
    }

    /// Returns the answers of a reviewer that are not undone, oldest first. An answer on several results appears once
    /// for each of these results.
    pub async fn answers(&self, reviewer: &str) -> Result<Vec<Answer>> {
        let mut conn = self.read_conn().await?;
        let left_out = &self.left_out;
        let spellings = Spellings::read(&mut conn).await?;
        let query = query_as(ANSWERS)
            .bind(spellings.json(reviewer))
            .bind(left_out.of(ChecksummedTable::Verdict))
            .bind(left_out.of(ChecksummedTable::VerdictUndo))
            .bind(left_out.of(ChecksummedTable::Answer))
            .bind(left_out.of(ChecksummedTable::AnswerUndo));
        query.fetch_all(&mut conn).await
    }

    /// Returns all answers to attention checks, including undone ones, oldest first.
    pub async fn attention_check_answers(&self) -> Result<Vec<AttentionCheckAnswer>> {
        self.attention_check_page(0, i64::MAX as usize).await
    }

    /// Returns up to `limit` answers to attention checks with ids above `after`, including undone ones, oldest first.
    pub async fn attention_check_page(
        &self,
        after: i64,
        limit: usize,
    ) -> Result<Vec<AttentionCheckAnswer>> {
        let mut conn = self.read_conn().await?;
        let left_out = &self.left_out;
        let query = query_as(CHECK_ANSWERS)
            .bind(after)
            .bind(limit as i64)
            .bind(left_out.of(ChecksummedTable::Answer))
            .bind(left_out.of(ChecksummedTable::AnswerUndo));
        query.fetch_all(&mut conn).await
    }

    /// Returns the key from which the review page derives the ids of its items. A catalog's key never changes.
    pub async fn review_key(&self) -> Result<ContentHash> {
        let mut conn = self.read_conn().await?;
        let query = query_scalar("SELECT key FROM review_key");
        query.fetch_one(&mut conn).await
    }
}

/// Returns the row id of a pair.
pub(crate) async fn pair_id(conn: &mut Conn, name: &PairName) -> Result<i64> {
    let id = query_scalar("SELECT id FROM pair WHERE name = ?1")
        .bind(name.as_str())
        .fetch_optional(conn)
        .await?;
    id.ok_or_else(|| CatalogError::UnknownPair(name.clone()))
}

async fn insert_check(
    conn: &mut Conn,
    given: &NewVerdict,
    (pair, metric, result_hash): (i64, ThresholdMetric, ContentHash),
    check: &AttentionCheck,
    now: UnixMillis,
) -> Result<()> {
    let context = &given.context;
    let row: i64 = query_scalar(INSERT_CHECK)
        .bind(&context.event)
        .bind(pair)
        .bind(metric.name())
        .bind(&result_hash.as_bytes()[..])
        .bind(check.name())
        .bind(serde_json::to_string(check)?)
        .bind(context.seen.as_ref().map(|hash| &hash.as_bytes()[..]))
        .bind(context.shown_ms.map(u64::cast_signed))
        .bind(context.angle_read_deg)
        .bind(given.verdict.name())
        .bind(&given.reviewer)
        .bind(given.reason.map(Reason::name))
        .bind(&given.note)
        .bind(given.at.unwrap_or(now))
        .fetch_one(&mut *conn)
        .await?;
    checksums::store(conn, ChecksummedTable::Answer, &[row]).await
}
