//! One group commit: requests in their order of weight, one statement for all of a kind.

use std::sync::Arc;

use sqlx::SqliteConnection;
use tokio::sync::oneshot;

use super::claim::{self, ClaimRequest};
use super::counters::Deltas;
use super::lease::{Lease, StageDone, StageFailed};
use super::{CatalogError, Result, checkpoint, fail};
use crate::domain::{UnixMillis, WorkerId};

/// Where an answer goes.
pub(super) type Reply<T> = oneshot::Sender<Result<T>>;

/// A sign of life.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beat {
    pub(super) worker: WorkerId,
    pub(super) now: UnixMillis,
    pub(super) alive_since: UnixMillis,
}

/// A request that may share a commit. The lease travels with it and comes back only if it still holds.
pub(super) enum Request {
    Beat(Beat, Reply<bool>),
    Checkpoint(Box<(Lease, StageDone)>, Reply<bool>),
    Fail(Box<(Lease, StageFailed)>, Reply<bool>),
    Release(Lease, Reply<bool>),
    Claim(ClaimRequest, Reply<Vec<Lease>>),
}

/// Something to be stored under a lease, and where to say whether it was.
type Under<T> = (Box<(Lease, T)>, Reply<bool>);

/// Requests of one commit by kind.
#[derive(Default)]
pub(super) struct Batch {
    beats: Vec<(Beat, Reply<bool>)>,
    checkpoints: Vec<Under<StageDone>>,
    failures: Vec<Under<StageFailed>>,
    releases: Vec<(Lease, Reply<bool>)>,
    claims: Vec<(ClaimRequest, Reply<Vec<Lease>>)>,
}

/// Answers to the requests of a batch, in their order.
pub(super) struct Answers {
    beats: Vec<bool>,
    checkpoints: Vec<bool>,
    failures: Vec<bool>,
    releases: Vec<bool>,
    claims: Vec<Vec<Lease>>,
}

impl Batch {
    pub(super) fn push(&mut self, request: Request) {
        match request {
            Request::Beat(beat, reply) => self.beats.push((beat, reply)),
            Request::Checkpoint(done, reply) => self.checkpoints.push((done, reply)),
            Request::Fail(failed, reply) => self.failures.push((failed, reply)),
            Request::Release(lease, reply) => self.releases.push((lease, reply)),
            Request::Claim(claim, reply) => self.claims.push((claim, reply)),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.beats.len()
            + self.checkpoints.len()
            + self.failures.len()
            + self.releases.len()
            + self.claims.len()
    }

    /// Runs the requests in the transaction that is open: beats, checkpoints, failures, releases, claims.
    pub(super) async fn apply(&self, conn: &mut SqliteConnection) -> Result<Answers> {
        let mut deltas = Deltas::default();
        let mut beats = Vec::with_capacity(self.beats.len());
        for (beat, _) in &self.beats {
            beats.push(claim::beat(conn, *beat).await?);
        }
        let done: Vec<_> = self.checkpoints.iter().map(|(done, _)| &**done).collect();
        let checkpoints = checkpoint::apply(conn, &done, &mut deltas).await?;
        let failed: Vec<_> = self.failures.iter().map(|(failed, _)| &**failed).collect();
        let failures = fail::apply(conn, &failed, &mut deltas).await?;
        let given_back: Vec<_> = self.releases.iter().map(|(lease, _)| lease).collect();
        let releases = claim::release(conn, &given_back, &mut deltas).await?;
        let mut claims = Vec::with_capacity(self.claims.len());
        for (request, _) in &self.claims {
            claims.push(claim::claim(conn, request, &mut deltas).await?);
        }
        deltas.apply(conn).await?;
        Ok(Answers {
            beats,
            checkpoints,
            failures,
            releases,
            claims,
        })
    }

    /// Tells everybody what became of the request. Whoever does not wait any more gets no answer.
    pub(super) fn answer(self, answers: Answers) {
        for ((_, reply), alive) in self.beats.into_iter().zip(answers.beats) {
            let _ = reply.send(Ok(alive));
        }
        for ((_, reply), kept) in self.checkpoints.into_iter().zip(answers.checkpoints) {
            let _ = reply.send(Ok(kept));
        }
        for ((_, reply), kept) in self.failures.into_iter().zip(answers.failures) {
            let _ = reply.send(Ok(kept));
        }
        for ((_, reply), kept) in self.releases.into_iter().zip(answers.releases) {
            let _ = reply.send(Ok(kept));
        }
        for ((_, reply), leases) in self.claims.into_iter().zip(answers.claims) {
            let _ = reply.send(Ok(leases));
        }
    }

    /// Tells everybody that nothing was stored.
    pub(super) fn refuse(self, error: &Arc<CatalogError>) {
        let shared = || CatalogError::Shared(Arc::clone(error));
        let replies = self.beats.into_iter().map(|(_, reply)| reply);
        let replies = replies.chain(self.checkpoints.into_iter().map(|(_, reply)| reply));
        let replies = replies.chain(self.failures.into_iter().map(|(_, reply)| reply));
        for reply in replies.chain(self.releases.into_iter().map(|(_, reply)| reply)) {
            let _ = reply.send(Err(shared()));
        }
        for (_, reply) in self.claims {
            let _ = reply.send(Err(shared()));
        }
    }

    /// The same requests, each in a batch of its own, in the order they would have run.
    pub(super) fn split(self) -> Vec<Self> {
        let beats = self.beats.into_iter().map(|(a, b)| Request::Beat(a, b));
        let checkpoints = self.checkpoints.into_iter();
        let checkpoints = checkpoints.map(|(a, b)| Request::Checkpoint(a, b));
        let failures = self.failures.into_iter();
        let failures = failures.map(|(a, b)| Request::Fail(a, b));
        let releases = self.releases.into_iter();
        let releases = releases.map(|(a, b)| Request::Release(a, b));
        let claims = self.claims.into_iter().map(|(a, b)| Request::Claim(a, b));
        let all = beats.chain(checkpoints).chain(failures);
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
