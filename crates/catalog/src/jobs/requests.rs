//! Requests of the queue to the writer task, and its counters.

use crate::jobs::job_counts::count_jobs;
use crate::queue::claim::ClaimRequest;
use crate::queue::commit::batch_collector::Message;
use crate::queue::commit::commit_delay::Waiting;
use crate::queue::commit::group_commit::{Reply, Request};
use crate::queue::counters::{JobCounts, by_status, counters};
use crate::queue::lease::{CheckpointOutcome, Heartbeat, Lease};
use crate::queue::stage_record::{StageCheckpoint, StageFailure};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{UnixMillis, WorkerId, WorkerMetrics};

impl Catalog {
    /// Leases up to `slots` ready pairs, or none if the worker has ended or its heartbeat is before `alive_since`. May also
    /// return leases of an earlier claim whose reply was lost.
    ///
    /// # Errors
    /// Returns an error if a database operation fails. On a server, pairs may be leased nevertheless. The worker's
    /// claims of the next two minutes return them.
    pub async fn claim(&self, request: ClaimRequest) -> Result<Vec<Lease>> {
        self.grouped(|reply| Request::Claim(request, reply)).await
    }

    /// Gives a lease back. The attempt does not count. Returns `false` if the lease was already lost.
    pub async fn release(&self, lease: Lease) -> Result<bool> {
        self.grouped(|reply| Request::Release(lease, reply)).await
    }

    /// Keeps the lock of this process's worker on a server, also over a new connection if the old one is broken. Must be
    /// called every few seconds. Does nothing if the catalog is a file.
    pub async fn keep_worker_lock(&self, worker: WorkerId) -> Result<()> {
        if !self.is_shared() {
            return Ok(());
        }
        self.reply_to(|reply| {
            Message::Transaction(Box::new(move |writer| {
                Box::pin(async move {
                    let _ = reply.send(writer.keep_worker_lock(worker).await);
                })
            }))
        })
        .await
    }

    /// Stores a worker's heartbeat, and its metrics if given. Returns `false`, and stores nothing, if the worker has ended
    /// or its previous heartbeat is older than `alive_since`. In that case the worker's leases are void, and it must
    /// register again.
    pub async fn heartbeat(
        &self,
        worker: WorkerId,
        now: UnixMillis,
        alive_since: UnixMillis,
        metrics: Option<&WorkerMetrics>,
    ) -> Result<bool> {
        let heartbeat = Heartbeat {
            worker,
            now,
            alive_since,
            metrics: metrics.map(serde_json::to_string).transpose()?,
        };
        self.grouped(|reply| Request::Heartbeat(heartbeat, reply))
            .await
    }

    /// Stores finished stages and advances the job, both or neither. The stages must be in the order they were
    /// computed, and their artifacts must be on disk already. The commit may be delayed so that later requests can
    /// share it. Call [`Catalog::waiting`] to turn the delay off.
    ///
    /// # Errors
    /// Returns an error if a score is not a finite number, or if a database operation fails. In that case nothing is stored,
    /// unless a server stored it and the reply was lost. The lease remains until it is recovered.
    pub async fn checkpoint(
        &self,
        lease: Lease,
        stages: Vec<StageCheckpoint>,
    ) -> Result<CheckpointOutcome> {
        let Some(last) = stages.last() else {
            return Ok(CheckpointOutcome::Lease(lease));
        };
        let mut metrics = stages.iter().flat_map(|stage| &stage.metrics);
        if let Some(invalid) = metrics.find(|metric| !metric.is_finite()) {
            let metric = invalid.outcome.metric;
            let text = format!("a score of {metric} is not a finite number");
            return Err(CatalogError::Corrupt(text));
        }
        let advanced = lease.after(last);
        let item = Box::new((lease, stages));
        let stored = self
            .reply_to(|reply| Message::Deferrable(Request::Checkpoint(item, reply)))
            .await?;
        Ok(match (stored, advanced) {
            (false, _) => CheckpointOutcome::Refused,
            (true, Some(lease)) => CheckpointOutcome::Lease(lease),
            (true, None) => CheckpointOutcome::Done,
        })
    }

    /// Stores a failed stage. Returns `false`, and stores nothing, if the lease was lost.
    pub async fn fail(&self, lease: Lease, failure: StageFailure) -> Result<bool> {
        self.grouped(|reply| Request::Fail(Box::new((lease, failure)), reply))
            .await
    }

    /// Reads the counters of jobs.
    pub async fn counters(&self) -> Result<JobCounts> {
        let mut conn = self.read_conn().await?;
        Ok(by_status(counters(&mut conn).await?))
    }

    /// Counts all jobs from their rows. In an undamaged catalog, [`Catalog::counters`] gives the same result.
    pub async fn recount(&self) -> Result<JobCounts> {
        let mut conn = self.snapshot().await?;
        Ok(by_status(count_jobs(&mut conn).await?))
    }

    /// Commits all pending requests at once. Prevents delays of later commits until the returned value is dropped.
    ///
    /// # Errors
    /// Returns an error if the catalog is closed or read-only.
    pub async fn waiting(&self) -> Result<Waiting> {
        let waiting = Waiting::new(&self.delay);
        self.send(Message::Flush).await?;
        Ok(waiting)
    }

    /// Sends a request into the next group commit and waits for the reply.
    async fn grouped<T>(&self, request: impl FnOnce(Reply<T>) -> Request) -> Result<T> {
        self.reply_to(|reply| Message::Grouped(request(reply)))
            .await
    }
}
