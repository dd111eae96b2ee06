//! One group commit: the requests by kind, one statement for all requests of a kind, two round trips in all.

use std::sync::Arc;

use sqlx::SqliteConnection;

use crate::catalog::db::error::{CatalogError, Result};
use crate::catalog::db::request::{Reply, Request};
use crate::catalog::db::script::{Script, ScriptRows, Statement};
use crate::catalog::queue::checkpoint::{self, LeasedCheckpoints};
use crate::catalog::queue::claim::{self, ClaimRequest, ClaimedRow, Heartbeat};
use crate::catalog::queue::counters::Deltas;
use crate::catalog::queue::fail::{self, FailedRow};
use crate::catalog::queue::lease::{FencedRow, Lease, StageCheckpoint, StageFailure};

/// Something to store under a lease, and where to reply whether the lease held.
type Leased<T> = (Box<(Lease, T)>, Reply<bool>);

/// The requests of one commit by kind.
#[derive(Default)]
pub(crate) struct Batch {
    heartbeats: Vec<(Heartbeat, Reply<bool>)>,
    checkpoints: Vec<Leased<Vec<StageCheckpoint>>>,
    failures: Vec<Leased<StageFailure>>,
    releases: Vec<(Lease, Reply<bool>)>,
    claims: Vec<(ClaimRequest, Reply<Vec<Lease>>)>,
}

/// Replies to the requests of a batch, in their order.
pub(crate) struct BatchReply {
    heartbeats: Vec<bool>,
    checkpoints: Vec<bool>,
    failures: Vec<bool>,
    releases: Vec<bool>,
    claims: Vec<Vec<Lease>>,
}

/// The statements of the first round trip, which change workers and jobs as far as leases hold.
struct JobStatements {
    heartbeats: Vec<Statement<(i64,)>>,
    advanced: Option<Statement<FencedRow>>,
    failed: Option<Statement<FailedRow>>,
    released: Option<Statement<FencedRow>>,
    claims: Vec<Statement<ClaimedRow>>,
}

impl Batch {
    pub(crate) fn push(&mut self, request: Request) {
        match request {
            Request::Heartbeat(heartbeat, reply) => self.heartbeats.push((heartbeat, reply)),
            Request::Checkpoint(done, reply) => self.checkpoints.push((done, reply)),
            Request::Fail(failed, reply) => self.failures.push((failed, reply)),
            Request::Release(lease, reply) => self.releases.push((lease, reply)),
            Request::Claim(claim, reply) => self.claims.push((claim, reply)),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.heartbeats.len()
            + self.checkpoints.len()
            + self.failures.len()
            + self.releases.len()
            + self.claims.len()
    }

    /// Runs the requests in one transaction: heartbeats, checkpoints, failures, releases, claims. After an error that
    /// transaction may still be open.
    pub(crate) async fn apply(&self, conn: &mut SqliteConnection) -> Result<BatchReply> {
        let mut script = Script::default();
        script.execute("BEGIN IMMEDIATE");
        let statements = self.add_jobs(&mut script)?;
        let rows = script.run(conn).await?;
        let mut script = Script::default();
        let reply = self.add_records(&mut script, &statements, &rows)?;
        script.execute("COMMIT");
        script.run(conn).await?;
        Ok(reply)
    }

    /// Adds the statements that change workers and jobs.
    fn add_jobs(&self, script: &mut Script) -> Result<JobStatements> {
        let heartbeats = self.heartbeats.iter();
        let heartbeats = heartbeats.map(|(heartbeat, _)| claim::add_heartbeat(script, *heartbeat));
        let heartbeats = heartbeats.collect::<Result<_>>()?;
        let checkpoints = self.checkpoints.iter().map(|(item, _)| &**item);
        let failures = self.failures.iter().map(|(item, _)| &**item);
        let releases = self.releases.iter().map(|(lease, _)| lease);
        Ok(JobStatements {
            heartbeats,
            advanced: checkpoint::add_advance(script, checkpoints)?,
            failed: fail::add_failures(script, failures)?,
            released: claim::add_release(script, releases)?,
            claims: self
                .claims
                .iter()
                .map(|(request, _)| claim::add_claim(script, request))
                .collect::<Result<_>>()?,
        })
    }

    /// Adds the statements that store results, failures and counters; returns the replies.
    fn add_records(
        &self,
        script: &mut Script,
        statements: &JobStatements,
        rows: &ScriptRows,
    ) -> Result<BatchReply> {
        let mut deltas = Deltas::default();
        let advanced = rows.read_if_any(statements.advanced.as_ref())?;
        let failed = rows.read_if_any(statements.failed.as_ref())?;
        let released = rows.read_if_any(statements.released.as_ref())?;
        let heartbeats = statements.heartbeats.iter();
        let heartbeats = heartbeats.map(|statement| Ok(!rows.read(statement)?.is_empty()));
        let mut claims = Vec::with_capacity(self.claims.len());
        for ((request, _), statement) in self.claims.iter().zip(&statements.claims) {
            let claimed = rows.read(statement)?;
            claims.push(claim::leases(claimed, request.worker, &mut deltas)?);
        }
        let stored: Vec<&LeasedCheckpoints> = self
            .checkpoints
            .iter()
            .map(|(item, _)| &**item)
            .filter(|(lease, _)| lease.is_in(&advanced))
            .collect();
        checkpoint::add_results(script, &stored, &mut deltas)?;
        let failures = self.failures.iter().filter_map(|(item, _)| {
            let row = fail::row_of(&item.0, &failed)?;
            Some((&**item, row))
        });
        fail::add_failure_records(script, &failures.collect::<Vec<_>>(), &mut deltas)?;
        let releases = self.releases.iter().map(|(lease, _)| lease);
        claim::count_released(releases.filter(|lease| lease.is_in(&released)), &mut deltas);
        deltas.add_to(script)?;
        let checkpoints = self.checkpoints.iter();
        let failures = self.failures.iter();
        let releases = self.releases.iter();
        Ok(BatchReply {
            heartbeats: heartbeats.collect::<Result<_>>()?,
            checkpoints: checkpoints
                .map(|(item, _)| item.0.is_in(&advanced))
                .collect(),
            failures: failures
                .map(|(item, _)| fail::row_of(&item.0, &failed).is_some())
                .collect(),
            releases: releases.map(|(lease, _)| lease.is_in(&released)).collect(),
            claims,
        })
    }

    /// Sends the replies. Senders that no longer wait get none.
    pub(crate) fn answer(self, replies: BatchReply) {
        for ((_, reply), alive) in self.heartbeats.into_iter().zip(replies.heartbeats) {
            let _ = reply.send(Ok(alive));
        }
        for ((_, reply), kept) in self.checkpoints.into_iter().zip(replies.checkpoints) {
            let _ = reply.send(Ok(kept));
        }
        for ((_, reply), kept) in self.failures.into_iter().zip(replies.failures) {
            let _ = reply.send(Ok(kept));
        }
        for ((_, reply), kept) in self.releases.into_iter().zip(replies.releases) {
            let _ = reply.send(Ok(kept));
        }
        for ((_, reply), leases) in self.claims.into_iter().zip(replies.claims) {
            let _ = reply.send(Ok(leases));
        }
    }

    /// Replies to all requests that nothing was stored.
    pub(crate) fn refuse(self, error: &Arc<CatalogError>) {
        let shared = || CatalogError::Shared(Arc::clone(error));
        let replies = self.heartbeats.into_iter().map(|(_, reply)| reply);
        let replies = replies.chain(self.checkpoints.into_iter().map(|(_, reply)| reply));
        let replies = replies.chain(self.failures.into_iter().map(|(_, reply)| reply));
        for reply in replies.chain(self.releases.into_iter().map(|(_, reply)| reply)) {
            let _ = reply.send(Err(shared()));
        }
        for (_, reply) in self.claims {
            let _ = reply.send(Err(shared()));
        }
    }

    /// Splits the batch into one batch per request, in the order of execution.
    pub(crate) fn split(self) -> Vec<Self> {
        let heartbeats = self
            .heartbeats
            .into_iter()
            .map(|(a, b)| Request::Heartbeat(a, b));
        let checkpoints = self.checkpoints.into_iter();
        let checkpoints = checkpoints.map(|(a, b)| Request::Checkpoint(a, b));
        let failures = self.failures.into_iter();
        let failures = failures.map(|(a, b)| Request::Fail(a, b));
        let releases = self.releases.into_iter();
        let releases = releases.map(|(a, b)| Request::Release(a, b));
        let claims = self.claims.into_iter().map(|(a, b)| Request::Claim(a, b));
        let all = heartbeats.chain(checkpoints).chain(failures);
        all.chain(releases)
            .chain(claims)
            .map(|request| {
                let mut single = Self::default();
                single.push(request);
                single
            })
            .collect()
    }
}
