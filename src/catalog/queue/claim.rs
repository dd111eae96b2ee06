//! Leases: taking them, keeping them alive, giving them back.

use serde_json::{Value, json};
use sqlx::Row as _;
use sqlx::sqlite::SqliteRow;
use tokio::sync::oneshot;

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::group_commit::{Heartbeat, Reply, Request};
use crate::catalog::db::rows;
use crate::catalog::db::script::Script;
use crate::catalog::db::writer::Message;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::checkpoint::over;
use crate::catalog::queue::counters::{Deltas, cursor};
use crate::catalog::queue::lease::Lease;
use crate::domain::{JobStatus, PairId, Stage, UnixMillis, WorkerId};
use crate::failpoint::{self, Point};

/// What a worker wants to take.
#[derive(Debug, Clone)]
pub struct ClaimRequest {
    /// Who takes it.
    pub worker: WorkerId,
    /// At most so many.
    pub slots: usize,
    /// Only pairs whose next stage is this one or an earlier one.
    pub until: Stage,
    /// Pairs that must run with nothing beside them, or the others.
    pub exclusive: bool,
    /// Only these; `None` for all.
    pub among: Option<PairSelection>,
    /// When the first stage should be over.
    pub deadline: UnixMillis,
    /// Nothing is taken unless the worker's last sign of life is of then or later, by its own clock.
    pub alive_since: UnixMillis,
}

impl ClaimRequest {
    /// Any ordinary pairs with any stages left, whenever the worker gave its last sign of life.
    pub const fn new(worker: WorkerId, slots: usize, deadline: UnixMillis) -> Self {
        Self {
            worker,
            slots,
            until: Stage::Register,
            exclusive: false,
            among: None,
            deadline,
            alive_since: UnixMillis::MIN,
        }
    }
}

/// Some pairs of the catalog.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairSelection {
    /// Numbers as a JSON array, for `json_each`.
    pub(crate) json: String,
    /// How many.
    pub(crate) len: usize,
}

impl PairSelection {
    /// How many pairs.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// These pairs.
    pub fn of(pairs: &[PairId]) -> Self {
        Self {
            json: rows::array(pairs.iter().map(|pair| pair.0)).to_string(),
            len: pairs.len(),
        }
    }

    /// Whether it is none at all.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// Takes the first ready jobs in the order of the index `job_ready`. A bare `?5` as the limit would have the statement
/// prepared anew each time, because the planner looks at its value.
pub(crate) const CLAIM: &str = "
UPDATE job SET status = 1, worker = ?1, deadline = ?2, token = token + 1, attempt = attempt + 1
WHERE pair IN (
    SELECT pair FROM job WHERE status = 0 AND stage <= ?3 AND exclusive = ?4
    ORDER BY prio, stage DESC, pair LIMIT +?5)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ?1 AND ended IS NULL AND heartbeat >= ?6)
RETURNING pair, stage, attempt, token, crashes, exclusive";

/// The same among some pairs only.
pub(crate) const CLAIM_AMONG: &str = "
UPDATE job SET status = 1, worker = ?1, deadline = ?2, token = token + 1, attempt = attempt + 1
WHERE pair IN (
    SELECT j.pair FROM json_each(?7) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
    WHERE j.status = 0 AND j.stage <= ?3 AND j.exclusive = ?4
    ORDER BY j.prio, j.stage DESC, j.pair LIMIT +?5)
    AND EXISTS (SELECT 1 FROM worker WHERE id = ?1 AND ended IS NULL AND heartbeat >= ?6)
RETURNING pair, stage, attempt, token, crashes, exclusive";

/// Gives leases back as if they had never been taken.
pub(crate) const RELEASE: &str = "
UPDATE job SET status = 0, worker = NULL, deadline = NULL, attempt = max(attempt - 1, 0)
FROM jsonb_each(?1) AS item
WHERE job.pair = item.value ->> 0 AND job.worker = item.value ->> 1 AND job.token = item.value ->> 2
    AND job.status = 1
RETURNING pair, token";

/// A sign of life. A worker that has ended, or whose last one is too long ago, gives none: others may have taken it for
/// dead.
pub(crate) const HEARTBEAT: &str = "UPDATE worker SET heartbeat = ?2 WHERE id = ?1 AND ended IS NULL AND heartbeat >= ?3 RETURNING id";

pub(crate) fn heartbeat(script: &mut Script, heartbeat: Heartbeat) -> Result<()> {
    let script = script.add(&[HEARTBEAT]).bind(heartbeat.worker.0)?;
    script.bind(heartbeat.now)?.bind(heartbeat.alive_since)?;
    Ok(())
}

/// Adds a claim to a script.
pub(crate) fn take(script: &mut Script, request: &ClaimRequest) -> Result<()> {
    let sql = if request.among.is_some() {
        CLAIM_AMONG
    } else {
        CLAIM
    };
    let script = script.add(&[sql]).bind(request.worker.0)?;
    let script = script
        .bind(request.deadline)?
        .bind(cursor(request.until))?
        .bind(i64::from(request.exclusive))?
        .bind(request.slots as i64)?
        .bind(request.alive_since)?;
    if let Some(among) = &request.among {
        script.bind(among.json.clone())?;
    }
    Ok(())
}

/// The leases of a claim from the rows that it returned.
pub(crate) fn taken(
    rows: &[SqliteRow],
    request: &ClaimRequest,
    deltas: &mut Deltas,
) -> Result<Vec<Lease>> {
    let mut leases = rows
        .iter()
        .map(|row| lease(row, request.worker))
        .collect::<Result<Vec<_>>>()?;
    // RETURNING promises no order.
    leases.sort_by_key(|lease| (std::cmp::Reverse(lease.cursor), lease.pair));
    for lease in &leases {
        let at = cursor(lease.cursor);
        deltas.moved((at, JobStatus::Ready), (at, JobStatus::Leased));
        failpoint::hit(lease.cursor, Point::Claiming, None);
    }
    Ok(leases)
}

fn lease(row: &SqliteRow, worker: WorkerId) -> Result<Lease> {
    Ok(Lease {
        pair: PairId(row.try_get("pair")?),
        worker,
        token: row.try_get("token")?,
        cursor: rows::stage(row.try_get("stage")?)?,
        attempt: row.try_get("attempt")?,
        crashes: row.try_get("crashes")?,
        exclusive: row.try_get::<i64, _>("exclusive")? == 1,
        cleared: false,
    })
}

/// Adds the giving back of leases to a script.
pub(crate) fn release<'l>(
    script: &mut Script,
    leases: impl Iterator<Item = &'l Lease>,
) -> Result<()> {
    over(script, &[RELEASE], leases.map(fence))
}

/// Counts leases that were given back.
pub(crate) fn given_back<'l>(leases: impl Iterator<Item = &'l Lease>, deltas: &mut Deltas) {
    for lease in leases {
        let at = cursor(lease.cursor);
        deltas.moved((at, JobStatus::Leased), (at, JobStatus::Ready));
    }
}

/// What a write under a lease must match: pair, worker, token.
fn fence(lease: &Lease) -> Value {
    json!([lease.pair.0, lease.worker.0, lease.token])
}

impl Catalog {
    /// Takes pairs to work on; fewer than asked for, or none, when no more are ready.
    ///
    /// # Errors
    /// When the database refuses; then nothing is taken.
    pub async fn claim(&self, request: ClaimRequest) -> Result<Vec<Lease>> {
        self.grouped(|reply| Request::Claim(request, reply)).await
    }

    /// Gives a lease back as if it had never been taken; `false` when it was lost already.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn release(&self, lease: Lease) -> Result<bool> {
        self.grouped(|reply| Request::Release(lease, reply)).await
    }

    /// A sign of life of a worker; `false` when it comes too late, because the last one is from before `alive_since`
    /// or the worker has ended. Then its leases are over, and it must enter anew to work on.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn heartbeat(
        &self,
        worker: WorkerId,
        now: UnixMillis,
        alive_since: UnixMillis,
    ) -> Result<bool> {
        let heartbeat = Heartbeat {
            worker,
            now,
            alive_since,
        };
        self.grouped(|reply| Request::Heartbeat(heartbeat, reply))
            .await
    }

    /// Sends a request into the next group commit and waits for the answer.
    pub(crate) async fn grouped<T>(&self, request: impl FnOnce(Reply<T>) -> Request) -> Result<T> {
        self.answered(|reply| Message::Grouped(request(reply)))
            .await
    }

    /// Sends the writer a message and waits for the answer.
    pub(crate) async fn answered<T>(&self, message: impl FnOnce(Reply<T>) -> Message) -> Result<T> {
        let (sender, receiver) = oneshot::channel();
        self.send(message(sender)).await?;
        receiver.await.unwrap_or(Err(CatalogError::Closed))
    }

    /// Sends the writer a message.
    pub(crate) async fn send(&self, message: Message) -> Result<()> {
        let sent = self.writer()?.send(message).await;
        sent.or(Err(CatalogError::Closed))
    }
}
