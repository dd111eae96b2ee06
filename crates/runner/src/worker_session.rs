//! Stores the heartbeats of this process, registers it again after its leases have expired, finds dead workers by their
//! heartbeats and connections, and recovers their leases.

use std::collections::BTreeMap;
use std::time::Instant;

use super::error::RunError;
use super::input_changes;
use super::input_reads::ReadLimits;
use super::retry::retried;
use super::run_context::RunContext;
use super::stop::StopLevel;
use mocban_catalog::{Catalog, CatalogError, DeadWorker, LeaseHolder, WorkerInfo};
use mocban_core::domain::{UnixMillis, WorkerId};
use mocban_store::Project;
use mocban_system::platform;

/// Time without a connection and without a new heartbeat after which a worker is dead, as a fraction of the lease: 7 of
/// 50 seconds. A living worker notices a broken connection within one recovery interval (2.5 s), and then usually
/// connects again at once.
const UNCONNECTED_SHARE: f64 = 0.14;
/// Longest time between two observations that is no sign of an outage of the server, as a fraction of the lease: 5 of
/// 50 seconds.
const USUAL_GAP_SHARE: f64 = 0.1;

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

/// Recovers all leases but those of `me`, when a run starts with the exclusive run lock. Returns how many pairs are ready
/// again.
pub(super) async fn recover_all(
    project: &Project,
    catalog: &Catalog,
    me: WorkerId,
    limits: &ReadLimits,
    now: UnixMillis,
) -> Result<u64, RunError> {
    let recovered = retried!(catalog.recover(DeadWorker::AllExcept(me), now))?;
    let poisoned = &recovered.poisoned;
    input_changes::store_inputs_of_quarantined(project, catalog, poisoned, limits).await?;
    Ok(recovered.ready)
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

/// Finds dead workers. A worker is dead if its heartbeat does not change during one lease length on the clock of this
/// process, or for a shorter time if it has no connection to the server either. Only times during which this process
/// could read the catalog count. The clocks of two machines are never compared.
#[derive(Debug)]
struct Liveness {
    lease_ms: i64,
    seen: BTreeMap<WorkerId, SeenWorker>,
    /// Time of the last call of [`Self::observe`].
    observed: Option<UnixMillis>,
    /// Time of the first observation after the last gap.
    steady_since: UnixMillis,
}

/// What was seen of a worker.
#[derive(Debug)]
struct SeenWorker {
    heartbeat: UnixMillis,
    /// When the heartbeat was first seen.
    since: UnixMillis,
    /// Whether it had a connection since the last gap. True for a worker that appeared later, which connects when it starts.
    was_connected: bool,
    /// Since when it has no connection.
    unconnected_since: Option<UnixMillis>,
}

impl Liveness {
    /// Starts without knowledge of other workers.
    const fn new(lease_ms: i64) -> Self {
        Self {
            lease_ms,
            seen: BTreeMap::new(),
            observed: None,
            steady_since: 0,
        }
    }

    /// Returns for how long, in milliseconds, this process could read the catalog without a gap.
    const fn steady_for(&self, now: UnixMillis) -> i64 {
        now - self.steady_since
    }

    /// Records the current heartbeats and connections of all workers with leases. Returns the dead ones, as observed now.
    /// Must be called every few seconds.
    fn observe(
        &mut self,
        holders: &[LeaseHolder],
        me: WorkerId,
        now: UnixMillis,
    ) -> Vec<LeaseHolder> {
        let part_of_lease = |share: f64| (self.lease_ms as f64 * share) as i64;
        let usual_gap_ms = part_of_lease(USUAL_GAP_SHARE);
        let unconnected_ms = part_of_lease(UNCONNECTED_SHARE);
        let gap = self.observed.map_or(i64::MAX, |last| now - last);
        self.observed = Some(now);
        let is_steady = gap <= usual_gap_ms;
        if !is_steady {
            self.steady_since = now;
            // The others may need longer to connect again, so only their heartbeats count until they have.
            for seen in self.seen.values_mut() {
                (seen.was_connected, seen.unconnected_since) = (false, None);
            }
        }
        if gap > self.lease_ms / 2 {
            // This process was away from the catalog, or suspended, and perhaps the others were too.
            self.seen.clear();
        }
        self.seen
            .retain(|worker, _| holders.iter().any(|holder| holder.worker == *worker));
        let others = holders.iter().filter(|holder| holder.worker != me);
        let dead = others.filter(|holder| {
            let seen = self.seen.entry(holder.worker).or_insert(SeenWorker {
                heartbeat: holder.heartbeat,
                since: now,
                // A worker takes its lock when it starts. After a gap, it may not have connected again yet.
                was_connected: is_steady,
                unconnected_since: None,
            });
            seen.was_connected |= holder.is_connected;
            if holder.is_connected {
                seen.unconnected_since = None;
            }
            if seen.heartbeat != holder.heartbeat {
                (seen.heartbeat, seen.since) = (holder.heartbeat, now);
                seen.unconnected_since = None;
            }
            if seen.was_connected && !holder.is_connected {
                seen.unconnected_since.get_or_insert(now);
            }
            let unconnected = seen.unconnected_since.map_or(0, |since| now - since);
            now - seen.since >= self.lease_ms || unconnected >= unconnected_ms
        });
        dead.copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Liveness;
    use mocban_catalog::LeaseHolder;
    use mocban_core::domain::WorkerId;

    const ME: WorkerId = WorkerId(1);
    const OTHER: WorkerId = WorkerId(2);

    fn holders(heartbeat: i64, is_connected: bool) -> [LeaseHolder; 2] {
        [ME, OTHER].map(|worker| LeaseHolder {
            worker,
            heartbeat: if worker == ME { 0 } else { heartbeat },
            is_connected,
        })
    }

    /// Observes at the given times. Returns the time at which the other worker is dead.
    fn dead_at(
        liveness: &mut Liveness,
        times: impl IntoIterator<Item = i64>,
        heartbeat: i64,
        is_connected: bool,
    ) -> Option<i64> {
        let holders = holders(heartbeat, is_connected);
        times.into_iter().find(|now| {
            let dead = liveness.observe(&holders, ME, *now);
            assert!(dead.is_empty() || dead == holders[1..], "{dead:?}");
            !dead.is_empty()
        })
    }

    #[test]
    fn a_worker_is_dead_after_a_lease_without_a_new_heartbeat() {
        let mut liveness = Liveness::new(50_000);
        let every = |from: i64, until: i64| (from..=until).step_by(2_500);
        assert_eq!(dead_at(&mut liveness, every(0, 47_500), 5, true), None);
        let found = dead_at(&mut liveness, every(50_000, 200_000), 6, true);
        assert_eq!(found, Some(100_000));
        assert_eq!(liveness.steady_for(100_000), 100_000);
        assert_eq!(dead_at(&mut liveness, [300_000], 6, true), None);
        assert_eq!(liveness.steady_for(300_000), 0);
    }

    #[test]
    fn after_a_gap_the_others_are_watched_anew() {
        let mut liveness = Liveness::new(50_000);
        let times = [0, 5_000, 205_000, 230_000, 254_999];
        assert_eq!(dead_at(&mut liveness, times, 5, true), None);
        assert_eq!(dead_at(&mut liveness, [255_000], 5, true), Some(255_000));
    }

    #[test]
    fn a_worker_without_a_connection_is_dead_after_seconds() {
        let mut liveness = Liveness::new(50_000);
        assert_eq!(dead_at(&mut liveness, [0], 5, true), None);
        let times = [2_500, 5_000, 9_499, 9_500];
        assert_eq!(dead_at(&mut liveness, times, 5, false), Some(9_500));
        // A worker that died before anybody saw its connection.
        let mut liveness = Liveness::new(50_000);
        assert!(liveness.observe(&[], ME, 0).is_empty());
        let times = [2_500, 5_000, 7_500, 9_500];
        assert_eq!(dead_at(&mut liveness, times, 5, false), Some(9_500));
        // When this process starts, others may be about to connect again.
        let mut liveness = Liveness::new(50_000);
        let times = (0..50_000).step_by(2_500);
        assert_eq!(dead_at(&mut liveness, times, 5, false), None);
    }

    #[test]
    fn a_worker_that_connects_again_or_sends_a_heartbeat_lives() {
        let mut liveness = Liveness::new(50_000);
        assert_eq!(dead_at(&mut liveness, [0], 5, true), None);
        assert_eq!(
            dead_at(&mut liveness, [1_000, 5_000, 7_000], 5, false),
            None
        );
        assert_eq!(dead_at(&mut liveness, [7_500], 5, true), None);
        assert_eq!(dead_at(&mut liveness, [10_000, 15_000], 5, false), None);
        assert_eq!(dead_at(&mut liveness, [17_500, 22_500], 6, false), None);
    }

    #[test]
    fn after_an_outage_only_workers_that_connected_again_are_dead_without_a_connection() {
        let mut liveness = Liveness::new(50_000);
        assert_eq!(dead_at(&mut liveness, [0], 5, true), None);
        let times = [12_000, 17_000, 22_000, 27_000];
        assert_eq!(dead_at(&mut liveness, times, 5, false), None);
        assert_eq!(dead_at(&mut liveness, [29_500], 5, true), None);
        let times = [32_000, 37_000, 39_000];
        assert_eq!(dead_at(&mut liveness, times, 5, false), Some(39_000));
    }
}
