//! One group commit: requests in their order of weight, one statement for all of a kind.

use std::collections::BTreeSet;
use std::sync::Arc;

use sqlx::sqlite::SqliteRow;
use sqlx::{Row as _, SqliteConnection};
use tokio::sync::oneshot;

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::script::Script;
use crate::catalog::queue::checkpoint;
use crate::catalog::queue::checkpoint::Steps;
use crate::catalog::queue::claim::{self, ClaimRequest};
use crate::catalog::queue::counters::Deltas;
use crate::catalog::queue::fail;
use crate::catalog::queue::lease::{Lease, StageCheckpoint, StageFailure};
use crate::domain::{UnixMillis, WorkerId};

/// Where an answer goes.
pub(crate) type Reply<T> = oneshot::Sender<Result<T>>;

/// A sign of life.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Heartbeat {
    pub(crate) worker: WorkerId,
    pub(crate) now: UnixMillis,
    pub(crate) alive_since: UnixMillis,
}

/// A request that may share a commit. The lease travels with it and comes back only if it still holds.
pub(crate) enum Request {
    Heartbeat(Heartbeat, Reply<bool>),
    Checkpoint(Box<Steps>, Reply<bool>),
    Fail(Box<(Lease, StageFailure)>, Reply<bool>),
    Release(Lease, Reply<bool>),
    Claim(ClaimRequest, Reply<Vec<Lease>>),
}

/// Something to be stored under a lease, and where to say whether it was.
type Under<T> = (Box<(Lease, T)>, Reply<bool>);

/// Requests of one commit by kind.
#[derive(Default)]
pub(crate) struct Batch {
    heartbeats: Vec<(Heartbeat, Reply<bool>)>,
    checkpoints: Vec<Under<Vec<StageCheckpoint>>>,
    failures: Vec<Under<StageFailure>>,
    releases: Vec<(Lease, Reply<bool>)>,
    claims: Vec<(ClaimRequest, Reply<Vec<Lease>>)>,
}

/// Answers to the requests of a batch, in their order.
pub(crate) struct Answers {
    heartbeats: Vec<bool>,
    checkpoints: Vec<bool>,
    failures: Vec<bool>,
    releases: Vec<bool>,
    claims: Vec<Vec<Lease>>,
}

/// What the changed rows of workers and jobs tell.
#[derive(Default)]
struct Told {
    /// Workers whose heartbeat came in time.
    alive: BTreeSet<i64>,
    /// Leases that held, by pair and token.
    held: BTreeSet<(i64, i64)>,
    /// Jobs of the first claim.
    taken: Vec<SqliteRow>,
}

impl Told {
    /// Beats return one column, writes under a lease two, claims more.
    fn of(rows: Vec<SqliteRow>) -> Result<Self> {
        let mut told = Self::default();
        for row in rows {
            match row.len() {
                1 => drop(told.alive.insert(row.try_get(0)?)),
                2 => drop(told.held.insert((row.try_get(0)?, row.try_get(1)?))),
                _ => told.taken.push(row),
            }
        }
        Ok(told)
    }

    fn holds(&self, lease: &Lease) -> bool {
        self.held.contains(&(lease.pair.0, lease.token))
    }

    fn each<'l>(&self, leases: impl Iterator<Item = &'l Lease>) -> Vec<bool> {
        leases.map(|lease| self.holds(lease)).collect()
    }

    /// What is to be stored under leases that held.
    fn under<'i, T>(&self, items: &'i [Under<T>]) -> Vec<&'i (Lease, T)> {
        let items = items.iter().map(|(item, _)| &**item);
        items.filter(|(lease, _)| self.holds(lease)).collect()
    }
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

    /// Runs the requests in a transaction of their own: heartbeats, checkpoints, failures, releases, claims. After an error
    /// that transaction may still be open.
    pub(crate) async fn apply(&self, conn: &mut SqliteConnection) -> Result<Answers> {
        let mut deltas = Deltas::default();
        let (told, claims) = self.ask(conn, &mut deltas).await?;
        let done = told.under(&self.checkpoints);
        let failed = told.under(&self.failures);
        let released = self.releases.iter().map(|(lease, _)| lease);
        let mut script = Script::default();
        checkpoint::store(&mut script, &done, &mut deltas)?;
        fail::store(&mut script, &failed, &mut deltas)?;
        claim::given_back(released.filter(|lease| told.holds(lease)), &mut deltas);
        deltas.write(&mut script)?;
        script.add(&["COMMIT"]);
        script.run(conn).await?;
        let heartbeats = self.heartbeats.iter();
        Ok(Answers {
            heartbeats: heartbeats
                .map(|(heartbeat, _)| told.alive.contains(&heartbeat.worker.0))
                .collect(),
            checkpoints: told.each(self.checkpoints.iter().map(|(item, _)| &item.0)),
            failures: told.each(self.failures.iter().map(|(item, _)| &item.0)),
            releases: told.each(self.releases.iter().map(|(lease, _)| lease)),
            claims,
        })
    }

    /// Begins the transaction and changes workers and jobs, as far as leases hold.
    async fn ask(
        &self,
        conn: &mut SqliteConnection,
        deltas: &mut Deltas,
    ) -> Result<(Told, Vec<Vec<Lease>>)> {
        let mut script = Script::default();
        script.add(&["BEGIN IMMEDIATE"]);
        for (heartbeat, _) in &self.heartbeats {
            claim::heartbeat(&mut script, *heartbeat)?;
        }
        checkpoint::step(
            &mut script,
            self.checkpoints.iter().map(|(item, _)| &**item),
        )?;
        fail::step(&mut script, self.failures.iter().map(|(item, _)| &**item))?;
        claim::release(&mut script, self.releases.iter().map(|(lease, _)| lease))?;
        let mut requests = self.claims.iter().map(|(request, _)| request);
        let first = requests.next();
        if let Some(request) = first {
            claim::take(&mut script, request)?;
        }
        let told = Told::of(script.run(conn).await?)?;
        let mut claims = Vec::with_capacity(self.claims.len());
        if let Some(request) = first {
            claims.push(claim::taken(&told.taken, request, deltas)?);
        }
        // A process asks for all it wants at once, so more than one are rare.
        for request in requests {
            let mut script = Script::default();
            claim::take(&mut script, request)?;
            claims.push(claim::taken(&script.run(conn).await?, request, deltas)?);
        }
        Ok((told, claims))
    }

    /// Tells everybody what became of the request. Whoever does not wait any more gets no answer.
    pub(crate) fn answer(self, answers: Answers) {
        for ((_, reply), alive) in self.heartbeats.into_iter().zip(answers.heartbeats) {
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

    /// The same requests, each in a batch of its own, in the order they would have run.
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
