//! Group commit: stores a batch of requests in one transaction, with two round trips to SQLite's thread.

use std::sync::Arc;
use std::time::Instant;

use crate::catalog::db::conn::Conn;
use crate::catalog::db::error::{CatalogError, Result};
use crate::catalog::db::known_leases::{KnownLeases, stored_before};
use crate::catalog::db::request::{Reply, Request};
use crate::catalog::db::script::{Script, ScriptRows, Statement};
use crate::catalog::db::write_connection::{BEGIN, CatalogServerState};
use crate::catalog::queue::checkpoint::{self, LeasedCheckpoints, position_after};
use crate::catalog::queue::claim::{self, Behind, ClaimRequest, Heartbeat};
use crate::catalog::queue::claim_start::ClaimStart;
use crate::catalog::queue::counters::{DONE, Deltas};
use crate::catalog::queue::fail::{self, FailedRow};
use crate::catalog::queue::lease::{FencedRow, Lease, StageFailure};

/// Requests of one kind, and where the reply to each goes.
struct Pending<I, R>(Vec<(I, Reply<R>)>);

impl<I, R> Pending<I, R> {
    fn items(&self) -> impl Iterator<Item = &I> {
        self.0.iter().map(|(item, _)| item)
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
    failures: Pending<Box<(Lease, StageFailure)>, bool>,
    releases: Pending<Lease, bool>,
    claims: Pending<ClaimRequest, Vec<Lease>>,
}

/// Replies to the requests of a batch, in their order.
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
    /// the transaction may still be open, so the caller must roll it back. `server` is given for a server, where an
    /// earlier commit of the same batch may have been stored although its answer was lost.
    pub(crate) async fn apply(
        &self,
        conn: &mut Conn,
        mut server: Option<&mut CatalogServerState>,
    ) -> Result<BatchReply> {
        let began = Instant::now();
        let starts = match &mut server {
            Some(server) => self.claim_starts(&mut server.claim_start, began),
            None => vec![None; self.claims.0.len()],
        };
        let mut script = Script::default();
        script.execute(BEGIN);
        let statements = self.add_jobs(&mut script, &starts)?;
        let rows = script.run(conn).await?;
        let (mut stored, mut unknown) = (Vec::new(), Vec::new());
        if let Some(server) = &mut server {
            // Otherwise, a refused checkpoint of an earlier stage, computed again, would look as if it were stored.
            if server.leases.is_searching() {
                stored = self.stored_before(conn, &statements, &rows).await?;
            }
            for request in self.claims.items() {
                unknown.push(server.leases.unknown(conn, request.worker).await?);
            }
        }
        let mut script = Script::default();
        let mut reply = self.add_records(&mut script, &statements, &rows, &stored)?;
        script.execute("COMMIT");
        script.run(conn).await?;
        if let Some(server) = &mut server {
            let times = [began, Instant::now()];
            let claims = self.claims.items().zip(starts).zip(&reply.claims);
            for ((request, start), claimed) in claims {
                server.claim_start.note(request, start, claimed, times);
            }
        }
        for (claimed, unknown) in reply.claims.iter_mut().zip(unknown) {
            let is_new = |lease: &Lease| !claimed.iter().any(|other| other.pair == lease.pair);
            let found: Vec<Lease> = unknown.into_iter().filter(is_new).collect();
            claimed.extend(found);
        }
        if let Some(server) = server {
            self.note_leases(&mut server.leases, &reply);
        }
        Ok(reply)
    }

    /// Returns where each claim on a server begins. Claims see what the other requests of the batch change.
    fn claim_starts(&self, claim_start: &mut ClaimStart, now: Instant) -> Vec<Option<Behind>> {
        if !self.heartbeats.0.is_empty() {
            claim_start.begin_again();
        }
        let failures = self.failures.items().map(|item| &item.0);
        let checkpoints = self.checkpoints.items().map(|item| &item.0);
        let exclusive = failures.chain(checkpoints).filter(|lease| lease.exclusive);
        for lease in exclusive.chain(self.releases.items()) {
            claim_start.note_release(lease);
        }
        let claims = self.claims.items();
        claims.map(|request| claim_start.of(request, now)).collect()
    }

    /// Finds the requests without effect in this transaction that an earlier commit has stored.
    async fn stored_before(
        &self,
        conn: &mut Conn,
        statements: &JobStatements,
        rows: &ScriptRows,
    ) -> Result<Vec<FencedRow>> {
        let advanced = rows.read_if_any(statements.advanced.as_ref())?;
        let failed = rows.read_if_any(statements.failed.as_ref())?;
        let released = rows.read_if_any(statements.released.as_ref())?;
        let checkpoints = self.checkpoints.items().map(|item| &**item);
        let checkpoints = checkpoints.filter(|(lease, _)| !lease.is_in(&advanced));
        let failures = self.failures.items().map(|item| &item.0);
        let failures = failures.filter(|lease| fail::row_of(lease, &failed).is_none());
        let releases = self.releases.items();
        let releases = releases.filter(|lease| !lease.is_in(&released));
        stored_before(conn, checkpoints, failures.chain(releases)).await
    }

    /// Notes which leases have begun and ended.
    fn note_leases(&self, leases: &mut KnownLeases, reply: &BatchReply) {
        for (item, kept) in self.checkpoints.items().zip(&reply.checkpoints) {
            let is_done = position_after(&item.1).is_some_and(|(cursor, _)| cursor == DONE);
            if is_done || !kept {
                leases.remove(&item.0);
            }
        }
        let failures = self.failures.items().map(|item| &item.0);
        failures
            .chain(self.releases.items())
            .for_each(|lease| leases.remove(lease));
        for claimed in &reply.claims {
            leases.add(claimed);
        }
    }

    /// Adds the statements that change workers and jobs.
    fn add_jobs(&self, script: &mut Script, starts: &[Option<Behind>]) -> Result<JobStatements> {
        let heartbeats = self.heartbeats.items();
        let heartbeats = heartbeats.map(|heartbeat| claim::add_heartbeat(script, heartbeat));
        Ok(JobStatements {
            heartbeats: heartbeats.collect(),
            advanced: checkpoint::add_advance(
                script,
                self.checkpoints.items().map(|item| &**item),
            )?,
            failed: fail::add_failures(script, self.failures.items().map(|item| &**item))?,
            released: claim::add_release(script, self.releases.items())?,
            claims: self
                .claims
                .items()
                .zip(starts)
                .map(|(request, start)| claim::add_claim(script, request, *start))
                .collect(),
        })
    }

    /// Adds the statements of the second round trip, which store results, failures and counters. Returns the replies.
    fn add_records(
        &self,
        script: &mut Script,
        statements: &JobStatements,
        rows: &ScriptRows,
        stored_before: &[FencedRow],
    ) -> Result<BatchReply> {
        let mut deltas = Deltas::default();
        let advanced = rows.read_if_any(statements.advanced.as_ref())?;
        let failed = rows.read_if_any(statements.failed.as_ref())?;
        let released = rows.read_if_any(statements.released.as_ref())?;
        let heartbeats = statements.heartbeats.iter();
        let heartbeats = heartbeats.map(|statement| Ok(!rows.read(statement)?.is_empty()));
        let mut claims = Vec::with_capacity(statements.claims.len());
        for statement in &statements.claims {
            claims.push(claim::count_claimed(rows.read(statement)?, &mut deltas));
        }
        let stored = self.checkpoints.items().map(|item| &**item);
        let stored: Vec<_> = stored.filter(|(lease, _)| lease.is_in(&advanced)).collect();
        checkpoint::add_results(script, &stored, &mut deltas)?;
        let failures = self.failures.items();
        let failures = failures.filter_map(|item| Some((&**item, fail::row_of(&item.0, &failed)?)));
        fail::add_failure_records(script, &failures.collect::<Vec<_>>(), &mut deltas)?;
        let releases = self.releases.items();
        claim::count_released(releases.filter(|lease| lease.is_in(&released)), &mut deltas);
        deltas.add_to(script)?;
        let (checkpoints, failures) = (self.checkpoints.items(), self.failures.items());
        let releases = self.releases.items();
        Ok(BatchReply {
            heartbeats: heartbeats.collect::<Result<_>>()?,
            checkpoints: checkpoints
                .map(|item| item.0.is_in(&advanced) || item.0.is_in(stored_before))
                .collect(),
            failures: failures
                .map(|item| fail::row_of(&item.0, &failed).is_some() || item.0.is_in(stored_before))
                .collect(),
            releases: releases
                .map(|lease| lease.is_in(&released) || lease.is_in(stored_before))
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

    /// Splits the batch into batches of one request each, in the order of execution.
    pub(crate) fn split(self) -> Vec<Self> {
        let heartbeats = self
            .heartbeats
            .0
            .into_iter()
            .map(|(a, b)| Request::Heartbeat(a, b));
        let checkpoints = self
            .checkpoints
            .0
            .into_iter()
            .map(|(a, b)| Request::Checkpoint(a, b));
        let failures = self
            .failures
            .0
            .into_iter()
            .map(|(a, b)| Request::Fail(a, b));
        let releases = self
            .releases
            .0
            .into_iter()
            .map(|(a, b)| Request::Release(a, b));
        let claims = self.claims.0.into_iter().map(|(a, b)| Request::Claim(a, b));
        let requests = heartbeats
            .chain(checkpoints)
            .chain(failures)
            .chain(releases)
            .chain(claims);
        let single = |request| {
            let mut batch = Self::default();
            batch.push(request);
            batch
        };
        requests.map(single).collect()
    }
}
