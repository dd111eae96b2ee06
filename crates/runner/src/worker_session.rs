//! Registers this process as a worker in the catalog, stores its heartbeats, and recovers the pairs of dead workers.

use std::time::Instant;

use super::error::RunError;
use super::input_changes;
use super::input_reads::ReadLimits;
use super::liveness::Liveness;
use super::retry::retried;
use super::run_context::RunContext;
use super::stop::StopLevel;
use mocban_catalog::{CatalogError, DeadWorker, WorkerInfo};
use mocban_core::domain::UnixMillis;
use mocban_system::platform;

/// What this process has seen as a worker.
#[derive(Debug)]
pub(super) struct WorkerSession {
    /// When the last heartbeat was stored, by the run's clock.
    last_heartbeat: UnixMillis,
    /// When overdue leases were last searched for.
    overdue_checked: UnixMillis,
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
    pub(super) const fn new(now: UnixMillis, lease_ms: i64) -> Self {
        Self {
            last_heartbeat: now,
            overdue_checked: 0,
            liveness: Liveness::new(lease_ms),
        }
    }

    /// Stores a heartbeat, with the counts and times of the run.
    pub(super) async fn heartbeat(&mut self, context: &RunContext) -> HeartbeatOutcome {
        let now = context.clock.now();
        let alive_since = context.alive_since();
        let catalog = &context.catalog;
        let metrics = context.worker_metrics();
        let stored = catalog.heartbeat(context.worker_id(), now, alive_since, Some(&metrics));
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
    /// ready again, and stages that are being computed under the old leases are cancelled.
    pub(super) async fn register_again(&mut self, context: &RunContext) -> Result<(), RunError> {
        let (catalog, now) = (&context.catalog, context.clock.now());
        let expired = context.worker_id();
        // The counts go on in the row of the new worker.
        retried!(catalog.end_worker(expired, now, None))?;
        let settings = context.worker_settings();
        let worker = retried!(catalog.register_worker(this_process(), settings.clone(), now))?;
        context.worker.send_replace(worker);
        self.last_heartbeat = now;
        let dead = DeadWorker::Known(expired);
        retried!(catalog.recover(dead.clone(), now))?;
        Ok(())
    }

    /// Keeps the lock that shows that this process is connected. Recovers the leases of dead workers, and leases of other
    /// workers that are long past their deadline. Returns how many pairs are ready again.
    pub(super) async fn recover(&mut self, context: &RunContext) -> Result<u64, RunError> {
        let (catalog, me) = (&context.catalog, context.worker_id());
        if let Err(error) = catalog.keep_worker_lock(me).await {
            // The lock is only a hint for others. Whether the run can go on is decided by the heartbeat.
            tracing::debug!(%error, "the worker's lock is not held");
        }
        let holders = retried!(catalog.lease_holders())?;
        // The time after the reply, which may have been waited for.
        let (now, replied) = (context.clock.now(), Instant::now());
        let dead = self.liveness.observe(&holders, me, now);
        let (mut ready, mut poisoned) = (0, Vec::new());
        if !dead.is_empty() {
            let dead = DeadWorker::Observed {
                workers: dead,
                valid_until: replied + context.timing.recover_every,
            };
            let recovered = retried!(catalog.recover(dead.clone(), now))?;
            ready += recovered.ready;
            poisoned.extend(recovered.poisoned);
        }
        // Deadlines pass during an outage. After it, each worker ends or renews its leases within the longest deadline, that
        // of a block.
        let longest = 2 * context.stage_timeout.as_millis() as i64;
        let is_steady = self.liveness.steady_for(now) > longest;
        let is_due =
            now - self.overdue_checked >= context.timing.heartbeat_every.as_millis() as i64;
        if is_due && is_steady && holders.iter().any(|holder| holder.worker != me) {
            self.overdue_checked = now;
            let margin = context.timing.deadline_margin.as_millis() as i64;
            let overdue = retried!(catalog.recover_overdue(me, margin, now))?;
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

/// Returns what the catalog records about this process.
pub(super) fn this_process() -> WorkerInfo {
    let boot_id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id").ok();
    WorkerInfo {
        host: platform::host_name(),
        pid: std::process::id(),
        boot_id: boot_id.map(|id| id.trim().to_owned()),
    }
}
