//! Group commit: stores a batch of requests in one transaction. On a server, checkpoints, and each claim, are one statement
//! that commits by itself; only the rarer requests share a transaction. Requests for blocks are not grouped.

use std::sync::Arc;
use std::time::Instant;

use tokio::sync::oneshot;

use crate::db::conn::Conn;
use crate::db::error::{CatalogError, Result};
use crate::db::script::{Script, ScriptRows, Statement};
use crate::db::transaction::BEGIN;
use crate::queue::checkpoint::{self, FailedRow, LeasedFailure};
use crate::queue::claim::{self, ClaimRequest, claim_on_server};
use crate::queue::commit::write_connection::CatalogServerState;
use crate::queue::counters::{self, Deltas, cursor};
use crate::queue::lease::{
    FencedRow, Heartbeat, Lease, LeasedCheckpoints, add_heartbeat, add_release, is_late,
    position_after, stored_before,
};
use crate::queue::server_checkpoint;
use mocban_core::domain::JobStatus;

/// Where a reply goes.
pub(crate) type Reply<T> = oneshot::Sender<Result<T>>;

/// A request that may share a commit with others. The reply `false` means that its lease or worker was not valid.
pub(crate) enum Request {
    Heartbeat(Heartbeat, Reply<bool>),
    Checkpoint(Box<LeasedCheckpoints>, Reply<bool>),
    Fail(Box<LeasedFailure>, Reply<bool>),
    Release(Lease, Reply<bool>),
    Claim(ClaimRequest, Reply<Vec<Lease>>),
}

/// Requests of one kind, and where the reply to each goes.
struct Pending<I, R>(Vec<(I, Reply<R>)>);

impl<I, R> Pending<I, R> {
    const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn items(&self) -> impl Iterator<Item = &I> {
        self.0.iter().map(|(item, _)| item)
    }

    fn into_requests(self, request: fn(I, Reply<R>) -> Request) -> impl Iterator<Item = Request> {
        self.0
            .into_iter()
            .map(move |(item, reply)| request(item, reply))
    }

    fn answer(self, replies: Vec<R>) {
        for ((_, reply), answer) in self.0.into_iter().zip(replies) {
            // The sender may no longer wait.
            let _ = reply.send(Ok(answer));
        }
    }

    fn refuse(self, error: &Arc<CatalogError>) {
        for (_, reply) in self.0 {
            let _ = reply.send(Err(CatalogError::Shared(Arc::clone(error))));
        }
    }
}

impl<I, R> Default for Pending<I, R> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

/// The requests of one commit by kind.
#[derive(Default)]
pub(crate) struct Batch {
    heartbeats: Pending<Heartbeat, bool>,
    checkpoints: Pending<Box<LeasedCheckpoints>, bool>,
    failures: Pending<Box<LeasedFailure>, bool>,
    releases: Pending<Lease, bool>,
    claims: Pending<ClaimRequest, Vec<Lease>>,
}

/// Replies to the requests of a batch, in their order.
#[derive(Debug, Default)]
pub(crate) struct BatchReply {
    heartbeats: Vec<bool>,
    checkpoints: Vec<bool>,
    failures: Vec<bool>,
    releases: Vec<bool>,
    claims: Vec<Vec<Lease>>,
}

/// Statements of the first round trip, which change workers and jobs. A request under a lease changes its job only if
/// the lease is still valid.
struct JobStatements {
    heartbeats: Vec<Statement<(i64,)>>,
    advanced: Option<Statement<FencedRow>>,
    failed: Option<Statement<FailedRow>>,
    released: Option<Statement<FencedRow>>,
    claims: Vec<Statement<Lease>>,
}

impl Batch {
    pub(crate) fn push(&mut self, request: Request) {
        match request {
            Request::Heartbeat(heartbeat, reply) => self.heartbeats.0.push((heartbeat, reply)),
            Request::Checkpoint(done, reply) => self.checkpoints.0.push((done, reply)),
            Request::Fail(failed, reply) => self.failures.0.push((failed, reply)),
            Request::Release(lease, reply) => self.releases.0.push((lease, reply)),
            Request::Claim(claim, reply) => self.claims.0.push((claim, reply)),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.heartbeats.0.len()
            + self.checkpoints.0.len()
            + self.failures.0.len()
            + self.releases.0.len()
            + self.claims.0.len()
    }

    /// Runs the requests in one transaction: heartbeats, checkpoints, failures, releases, then claims. After an error,
    /// the transaction may still be open, so the caller must roll it back. `may_be_stored` says that an earlier commit of
    /// the same failures and releases may have been stored although its reply was lost, on a server.
    pub(crate) async fn apply(&self, conn: &mut Conn, may_be_stored: bool) -> Result<BatchReply> {
        let mut script = Script::default();
        script.execute(BEGIN);
        let statements = self.add_jobs(&mut script)?;
        let rows = script.run(conn).await?;
        let mut stored = Vec::new();
        if may_be_stored {
            stored = self.stored_before(conn, &statements, &rows).await?;
        }
        let mut script = Script::default();
        let reply = self.add_records(&mut script, &statements, &rows, &stored)?;
        script.execute("COMMIT");
        script.run(conn).await?;
        Ok(reply)
    }

    /// Finds the failures and releases without effect in this transaction that an earlier commit has stored.
    async fn stored_before(
        &self,
        conn: &mut Conn,
        statements: &JobStatements,
        rows: &ScriptRows,
    ) -> Result<Vec<FencedRow>> {
        let failed = rows.read_if_any(statements.failed.as_ref())?;
        let released = rows.read_if_any(statements.released.as_ref())?;
        let failures = self.failures.items().map(|item| &item.0);
        let failures = failures.filter(|lease| checkpoint::failed_row(lease, &failed).is_none());
        let releases = self.releases.items();
        let releases = releases.filter(|lease| !lease.is_in(&released));
        stored_before(conn, [].into_iter(), failures.chain(releases)).await
    }

    /// Adds the statements that change workers and jobs.
    fn add_jobs(&self, script: &mut Script) -> Result<JobStatements> {
        let heartbeats = self.heartbeats.items();
        let heartbeats = heartbeats.map(|heartbeat| add_heartbeat(script, heartbeat));
        Ok(JobStatements {
            heartbeats: heartbeats.collect(),
            advanced: checkpoint::add_advance(
                script,
                self.checkpoints.items().map(|item| &**item),
            )?,
            failed: checkpoint::add_failures(script, self.failures.items().map(|item| &**item))?,
            released: add_release(script, self.releases.items())?,
            claims: self
                .claims
                .items()
                .map(|request| claim::add_claim(script, request))
                .collect(),
        })
    }

    /// Adds the statements of the second round trip, which store results, failures and counters. Returns the replies.
    /// `found` are the jobs of failures and releases that an earlier commit has stored.
    fn add_records(
        &self,
        script: &mut Script,
        statements: &JobStatements,
        rows: &ScriptRows,
        found: &[FencedRow],
    ) -> Result<BatchReply> {
        let mut deltas = Deltas::default();
        let advanced = rows.read_if_any(statements.advanced.as_ref())?;
        let failed = rows.read_if_any(statements.failed.as_ref())?;
        let released = rows.read_if_any(statements.released.as_ref())?;
        let heartbeats = statements.heartbeats.iter();
        let heartbeats = heartbeats.map(|statement| Ok(!rows.read(statement)?.is_empty()));
        let mut claims = Vec::with_capacity(statements.claims.len());
        for statement in &statements.claims {
            let leases = claim::in_order(rows.read(statement)?);
            claim::count_claimed(&leases, &mut deltas);
            claims.push(leases);
        }
        let stored = self.checkpoints.items().map(|item| &**item);
        let stored: Vec<_> = stored.filter(|(lease, _)| lease.is_in(&advanced)).collect();
        checkpoint::add_results(script, &stored, &mut deltas)?;
        let failures = self.failures.items();
        let failures =
            failures.filter_map(|item| Some((&**item, checkpoint::failed_row(&item.0, &failed)?)));
        checkpoint::add_failure_records(script, &failures.collect::<Vec<_>>(), &mut deltas)?;
        let releases = self.releases.items();
        claim::count_released(releases.filter(|lease| lease.is_in(&released)), &mut deltas);
        deltas.add_to(script)?;
        let (checkpoints, failures) = (self.checkpoints.items(), self.failures.items());
        let releases = self.releases.items();
        Ok(BatchReply {
            heartbeats: heartbeats.collect::<Result<_>>()?,
            checkpoints: checkpoints.map(|item| item.0.is_in(&advanced)).collect(),
            failures: failures
                .map(|item| {
                    checkpoint::failed_row(&item.0, &failed).is_some() || item.0.is_in(found)
                })
                .collect(),
            releases: releases
                .map(|lease| lease.is_in(&released) || lease.is_in(found))
                .collect(),
            claims,
        })
    }

    /// Sends the replies.
    pub(crate) fn answer(self, replies: BatchReply) {
        self.heartbeats.answer(replies.heartbeats);
        self.checkpoints.answer(replies.checkpoints);
        self.failures.answer(replies.failures);
        self.releases.answer(replies.releases);
        self.claims.answer(replies.claims);
    }

    /// Replies to all requests that nothing was stored.
    pub(crate) fn refuse(self, error: &Arc<CatalogError>) {
        self.heartbeats.refuse(error);
        self.checkpoints.refuse(error);
        self.failures.refuse(error);
        self.releases.refuse(error);
        self.claims.refuse(error);
    }

    /// Returns whether there are requests that share a transaction on a server.
    const fn has_shared_transaction(&self) -> bool {
        !self.heartbeats.is_empty() || !self.failures.is_empty() || !self.releases.is_empty()
    }

    /// Splits the batch into the parts that a server commits one after another: heartbeats with failures and releases,
    /// then checkpoints, then each claim.
    pub(crate) fn split_for_server(self) -> Vec<Self> {
        let checkpoints = Self {
            checkpoints: self.checkpoints,
            ..Self::default()
        };
        let claims = self.claims.0.into_iter().map(|claim| Self {
            claims: Pending(vec![claim]),
            ..Self::default()
        });
        let shared = Self {
            heartbeats: self.heartbeats,
            failures: self.failures,
            releases: self.releases,
            ..Self::default()
        };
        let parts = [shared, checkpoints].into_iter().chain(claims);
        parts.filter(|part| part.len() > 0).collect()
    }

    /// Splits the batch into batches of one request each, in the order of execution.
    pub(crate) fn split(self) -> Vec<Self> {
        let mut requests: Vec<Request> = Vec::with_capacity(self.len());
        requests.extend(self.heartbeats.into_requests(Request::Heartbeat));
        requests.extend(self.checkpoints.into_requests(Request::Checkpoint));
        requests.extend(self.failures.into_requests(Request::Fail));
        requests.extend(self.releases.into_requests(Request::Release));
        requests.extend(self.claims.into_requests(Request::Claim));
        let single = |request| {
            let mut batch = Self::default();
            batch.push(request);
            batch
        };
        requests.into_iter().map(single).collect()
    }
}

/// Commits a batch of [`Batch::split_for_server`]. An earlier commit of the same batch may have been stored although its
/// reply was lost.
///
/// # Errors
/// Returns an error if a database operation fails. A part of the batch may be stored nevertheless.
pub(crate) async fn commit_on_server(
    batch: &Batch,
    conn: &mut Conn,
    state: &mut CatalogServerState,
) -> Result<BatchReply> {
    let outcome = commit_parts(batch, conn, state).await;
    // The leases may exist although the claim failed.
    if outcome.is_err() && !batch.claims.is_empty() {
        state.leases.replies_may_be_lost();
    }
    outcome
}

async fn commit_parts(
    batch: &Batch,
    conn: &mut Conn,
    state: &mut CatalogServerState,
) -> Result<BatchReply> {
    let mut reply = BatchReply::default();
    if batch.has_shared_transaction() {
        reply = batch.apply(conn, state.leases.is_searching()).await?;
        if !batch.heartbeats.is_empty() {
            state.claim_tracker.begin_again();
            // The reply does not depend on it. A broken connection shows at the next statement.
            match counters::fold(conn, !state.has_folded_all).await {
                Ok(()) => state.has_folded_all = true,
                Err(error) => tracing::debug!(%error, "counters are added up later"),
            }
        }
        let failed = || batch.failures.items().map(|item| &item.0);
        for lease in batch.releases.items().chain(failed()) {
            state.leases.remove(lease);
        }
        for lease in batch.releases.items() {
            state.claim_tracker.note_release(lease);
        }
        note_exclusive(failed(), state);
    }
    if !batch.checkpoints.is_empty() {
        let checkpoints: Vec<_> = batch.checkpoints.items().map(|item| &**item).collect();
        reply.checkpoints = store_checkpoints(conn, &checkpoints, state).await?;
    }
    for request in batch.claims.items() {
        reply.claims.push(claim_pairs(conn, request, state).await?);
    }
    Ok(reply)
}

/// Returns whether stages that were computed again end where their lease began. The position of the job then does not show
/// whether they are stored.
fn ends_at_its_start((lease, stages): &LeasedCheckpoints) -> bool {
    position_after(stages).is_some_and(|(end, _)| end == cursor(lease.cursor))
}

/// Stores checkpoints. Returns for each whether it is stored.
async fn store_checkpoints(
    conn: &mut Conn,
    checkpoints: &[&LeasedCheckpoints],
    state: &mut CatalogServerState,
) -> Result<Vec<bool>> {
    let Conn::Postgres(server) = conn else {
        unreachable!("a server is PostgreSQL");
    };
    let (late, timely): (Vec<&LeasedCheckpoints>, Vec<_>) =
        checkpoints.iter().partition(|item| is_late(item));
    let stored = server_checkpoint::store(server, &timely).await?;
    if !late.is_empty() {
        // The next claim gets these leases back, and computes the stages again.
        state.leases.replies_may_be_lost();
    }
    let mut earlier = Vec::new();
    // Otherwise, a refused checkpoint of an earlier stage, computed again, would look as if it were stored.
    if state.leases.is_searching() {
        let refused = timely.iter().filter(|(lease, _)| !lease.is_in(&stored));
        let late = late.iter().filter(|item| !ends_at_its_start(item));
        earlier = stored_before(conn, refused.chain(late).copied(), [].into_iter()).await?;
    }
    let is_kept = |lease: &Lease| lease.is_in(&stored) || lease.is_in(&earlier);
    let kept: Vec<bool> = checkpoints
        .iter()
        .map(|(lease, _)| is_kept(lease))
        .collect();
    for ((lease, stages), kept) in checkpoints.iter().zip(&kept) {
        let is_done = position_after(stages).is_some_and(|(_, status)| status == JobStatus::Done);
        if is_done || !kept {
            state.leases.remove(lease);
        }
    }
    note_exclusive(checkpoints.iter().map(|(lease, _)| lease), state);
    Ok(kept)
}

/// Leases pairs. Also returns leases of the worker that an earlier claim received without a reply.
async fn claim_pairs(
    conn: &mut Conn,
    request: &ClaimRequest,
    state: &mut CatalogServerState,
) -> Result<Vec<Lease>> {
    // Before the claim, because nothing may fail between its commit and its reply.
    let unknown = state.leases.unknown(conn, request.worker).await?;
    let began = Instant::now();
    let start = state.claim_tracker.of(request, began);
    let mut claimed = claim_on_server(conn, request, start).await?;
    let times = [began, Instant::now()];
    state.claim_tracker.note(request, start, &claimed, times);
    claimed.extend(without_pairs_of(unknown, &claimed));
    state.leases.add(&claimed);
    Ok(claimed)
}

/// Returns leases without those of a pair that was leased again meanwhile.
fn without_pairs_of(mut leases: Vec<Lease>, later: &[Lease]) -> Vec<Lease> {
    leases.retain(|lease| later.iter().all(|other| other.unit != lease.unit));
    leases
}

/// Lets claims search from the beginning after an exclusive lease, which prevented claims.
fn note_exclusive<'l>(leases: impl Iterator<Item = &'l Lease>, state: &mut CatalogServerState) {
    for lease in leases.filter(|lease| lease.exclusive) {
        state.claim_tracker.note_release(lease);
    }
}
