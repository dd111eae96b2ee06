//! Registers this process as a worker in the catalog, stores its heartbeats, and recovers the pairs of dead workers.

use std::collections::BTreeMap;

use super::error::RunError;
use super::input_changes;
use super::input_reads::ReadLimits;
use super::run_context::RunContext;
use super::stop::StopLevel;
use crate::catalog::{CatalogError, DeadWorker, LeaseHolder, WorkerInfo};
use crate::domain::{UnixMillis, WorkerId};
use crate::platform;

/// The worker that this process is registered as.
#[derive(Debug)]
pub(super) struct WorkerSession {
    worker: WorkerId,
    /// When the last heartbeat was stored, by the run's clock.
    last_heartbeat: UnixMillis,
    liveness: Liveness,
}

/// What became of a heartbeat.
#[derive(Debug)]
pub(super) enum HeartbeatOutcome {
    /// The worker's leases are valid. Either the heartbeat was stored, or there is still time to retry it.
    Alive,
    /// The heartbeat came after the leases had expired. Another worker may have leased the pairs since.
    Expired,
    /// No heartbeat was stored during one lease length, or the catalog's write-ahead log is lost.
    Unwritable(CatalogError),
}

impl WorkerSession {
    /// A worker that has just been registered.
    pub(super) const fn new(worker: WorkerId, now: UnixMillis, lease_ms: i64) -> Self {
        Self {
            worker,
            last_heartbeat: now,
            liveness: Liveness::new(lease_ms),
        }
    }

    /// Returns the worker's current id.
    pub(super) const fn worker(&self) -> WorkerId {
        self.worker
    }

    /// Stores a heartbeat, with the counts and times of the run.
    pub(super) async fn heartbeat(&mut self, context: &RunContext) -> HeartbeatOutcome {
        let now = context.clock.now();
        let alive_since = context.alive_since();
        let catalog = &context.catalog;
        let metrics = context.worker_metrics();
        let stored = catalog.heartbeat(self.worker, now, alive_since, Some(&metrics));
        match stored.await {
            Ok(true) => {
                self.last_heartbeat = now;
                HeartbeatOutcome::Alive
            }
            Ok(false) => HeartbeatOutcome::Expired,
            Err(error) => {
                tracing::warn!(%error, "the heartbeat could not be stored");
                if self.last_heartbeat < alive_since || error.log_loss().is_some() {
                    HeartbeatOutcome::Unwritable(error)
                } else {
                    HeartbeatOutcome::Alive
                }
            }
        }
    }

    /// Registers the process as a new worker after its leases expired. Pairs that the old worker still holds become
    /// ready again. Stages that are being computed under the old leases cannot be stored.
    pub(super) async fn register_again(&mut self, context: &RunContext) -> Result<(), RunError> {
        let (catalog, now) = (&context.catalog, context.clock.now());
        let expired = self.worker;
        catalog
            // The counts go on in the row of the new worker.
            .retry_while_unavailable(async || catalog.end_worker(expired, now, None).await)
            .await?;
        let settings = context.worker_settings();
        self.worker = catalog
            .retry_while_unavailable(async || {
                catalog
                    .register_worker(this_process(), settings.clone(), now)
                    .await
            })
            .await?;
        self.last_heartbeat = now;
        let dead = DeadWorker::Workers(vec![expired]);
        catalog
            .retry_while_unavailable(async || catalog.recover(dead.clone(), now).await)
            .await?;
        Ok(())
    }

    /// Recovers the leases of dead workers, and leases of other workers that are long past their deadline. Returns how
    /// many pairs are ready again.
    pub(super) async fn recover(&mut self, context: &RunContext) -> Result<u64, RunError> {
        let catalog = &context.catalog;
        let holders = catalog.retry_while_unavailable(async || catalog.lease_holders().await);
        let holders = holders.await?;
        // The time after the reply, which may have been waited for.
        let now = context.clock.now();
        let dead = self.liveness.observe(&holders, self.worker, now);
        let (mut ready, mut poisoned) = (0, Vec::new());
        if !dead.is_empty() {
            let dead = DeadWorker::Workers(dead);
            let recovered =
                catalog.retry_while_unavailable(async || catalog.recover(dead.clone(), now).await);
            let recovered = recovered.await?;
            ready += recovered.ready;
            poisoned.extend(recovered.poisoned);
        }
        if holders.iter().any(|holder| holder.worker != self.worker) {
            let margin = context.timing.deadline_margin.as_millis() as i64;
            let me = self.worker;
            let overdue = catalog
                .retry_while_unavailable(async || catalog.recover_overdue(me, margin, now).await);
            let overdue = overdue.await?;
            ready += overdue.ready;
            poisoned.extend(overdue.poisoned);
        }
        let limits = ReadLimits {
            timeout: context.timing.read_timeout(),
            stop: context.stop.clone(),
            until: StopLevel::Drain,
        };
        input_changes::store_inputs_of_quarantined(&context.project, catalog, &poisoned, &limits)
            .await?;
        Ok(ready)
    }
}

/// Finds dead workers. A worker is dead if its heartbeat does not change during one lease length on the clock of this
/// process, while this process could read the catalog. The clocks of two machines are never compared.
#[derive(Debug)]
struct Liveness {
    lease_ms: i64,
    /// The last heartbeat of each worker, and when it was first seen.
    seen: BTreeMap<WorkerId, (UnixMillis, UnixMillis)>,
    /// Time of the last call of [`Self::observe`].
    observed: UnixMillis,
}

impl Liveness {
    const fn new(lease_ms: i64) -> Self {
        Self {
            lease_ms,
            seen: BTreeMap::new(),
            observed: 0,
        }
    }

    /// Records the current heartbeats of all workers with leases. Returns the workers that are dead.
    fn observe(&mut self, holders: &[LeaseHolder], me: WorkerId, now: UnixMillis) -> Vec<WorkerId> {
        if now - self.observed > self.lease_ms / 2 {
            // This process was away from the catalog, or suspended, and perhaps the others were too: watch them anew.
            self.seen.clear();
        }
        self.observed = now;
        self.seen
            .retain(|worker, _| holders.iter().any(|holder| holder.worker == *worker));
        let mut dead = Vec::new();
        for holder in holders.iter().filter(|holder| holder.worker != me) {
            let (heartbeat, since) = self
                .seen
                .entry(holder.worker)
                .or_insert((holder.heartbeat, now));
            if *heartbeat != holder.heartbeat {
                (*heartbeat, *since) = (holder.heartbeat, now);
            } else if now - *since >= self.lease_ms {
                dead.push(holder.worker);
            }
        }
        dead
    }
}

/// Returns what the catalog records about this process.
pub(super) fn this_process() -> WorkerInfo {
    let boot_id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").ok();
    WorkerInfo {
        host: platform::host_name(),
        pid: std::process::id(),
        boot_id: boot_id.map(|id| id.trim().to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::Liveness;
    use crate::catalog::LeaseHolder;
    use crate::domain::WorkerId;

    #[test]
    fn a_worker_is_dead_after_a_lease_without_a_new_heartbeat() {
        let (me, other) = (WorkerId(1), WorkerId(2));
        let holders = |heartbeat| {
            [me, other].map(|worker| LeaseHolder {
                worker,
                heartbeat: if worker == me { 0 } else { heartbeat },
            })
        };
        let mut liveness = Liveness::new(60_000);
        // Observes every five seconds.
        let mut observe_until = |from: i64, until: i64, heartbeat| -> Vec<WorkerId> {
            let times = (from..until).step_by(5_000).chain([until]);
            let dead = times.map(|now| liveness.observe(&holders(heartbeat), me, now));
            dead.collect::<Vec<_>>().concat()
        };
        assert!(observe_until(0, 59_999, 5).is_empty());
        assert!(observe_until(59_999, 119_998, 6).is_empty());
        assert_eq!(observe_until(119_999, 119_999, 6), [other]);
    }

    #[test]
    fn after_a_gap_the_others_are_watched_anew() {
        let (me, other) = (WorkerId(1), WorkerId(2));
        let holder = [LeaseHolder {
            worker: other,
            heartbeat: 5,
        }];
        let mut liveness = Liveness::new(60_000);
        for now in [0, 5_000, 205_000, 235_000, 264_999] {
            assert!(liveness.observe(&holder, me, now).is_empty(), "{now}");
        }
        assert_eq!(liveness.observe(&holder, me, 265_000), [other]);
    }
}
