//! The run's loop: keeps the slots filled, hears what comes back, looks after the queue.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::task::{JoinError, JoinSet};
use tokio::time::{Interval, MissedTickBehavior, interval};

use super::events::RunEvent;
use super::input_changes;
use super::memory_budget::MemoryBudget;
use super::options::RunOptions;
use super::pair_task::{PairEnd, PairOutcome, PairReport, RunContext};
use super::policy::{self, Liveness};
use super::prefetch::Prefetch;
use super::stop::StopLevel;
use super::{RunError, this_process};
use crate::catalog::{DeadWorker, Outstanding, PairSelection, Waiting};
use crate::domain::{PairName, UnixMillis, WorkerId};
use crate::raster;

/// Between two looks for pairs that others give back or whose back-off is over.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// Pairs a slot that may be on their way to the disk before no more are begun: what they gave is in memory.
const MOST_ENDINGS: usize = 8;

/// What the loop has counted.
#[derive(Debug, Default)]
pub(super) struct RunCounts {
    pub(super) done: u64,
    pub(super) failed: u64,
    pub(super) stages: u64,
    pub(super) too_many_failures: bool,
}

/// The loop's own state.
pub(super) struct Scheduler {
    pub(super) shared: Arc<RunContext>,
    pub(super) worker: WorkerId,
    pub(super) workers: usize,
    pub(super) among: Option<PairSelection>,
    pub(super) max_failures: Option<u64>,
    pub(super) images: raster::ImageLimits,
    /// Pairs that are computed, each with its name and the memory it was given.
    pub(super) tasks: JoinSet<(PairOutcome, PairName, u64)>,
    /// Pairs whose last files and checkpoint are on their way.
    endings: JoinSet<PairReport>,
    /// Checkpointer while pairs are not stored yet and a slot has nothing to do, or they are many.
    waiting: Option<Waiting>,
    pub(super) in_hand: Prefetch,
    pub(super) budget: MemoryBudget,
    /// The next pair waits for memory that somebody must give back first.
    pub(super) short: bool,
    /// A pair that nothing may run beside is in hand.
    pub(super) exclusive: bool,
    /// Whether a claim may find something that the last one did not.
    pub(super) look: bool,
    /// When this worker last showed that it lives, by the run's clock.
    last_beat: UnixMillis,
    liveness: Liveness,
    tally: RunCounts,
    fatal: Option<RunError>,
    told: StopLevel,
}

impl Scheduler {
    pub(super) fn new(
        shared: Arc<RunContext>,
        worker: WorkerId,
        among: Option<PairSelection>,
        options: &RunOptions,
    ) -> Self {
        Self {
            last_beat: shared.clock.now(),
            liveness: Liveness::new(shared.timing.lease_ms()),
            shared,
            worker,
            workers: options.workers.max(1),
            among,
            max_failures: options.max_failures,
            images: options.image_limits,
            tasks: JoinSet::new(),
            endings: JoinSet::new(),
            waiting: None,
            in_hand: Prefetch::default(),
            budget: MemoryBudget::new(options.memory),
            short: false,
            exclusive: false,
            look: true,
            tally: RunCounts::default(),
            fatal: None,
            told: StopLevel::Go,
        }
    }

    /// The number this process works under now.
    pub(super) const fn worker(&self) -> WorkerId {
        self.worker
    }

    /// Works until nothing is left or the run is stopped. Gives the error that ended it, if one did.
    pub(super) async fn run(
        &mut self,
        events: &mut mpsc::UnboundedReceiver<RunEvent>,
        on_event: &mut (impl FnMut(RunEvent) + Send),
    ) -> Result<RunCounts, RunError> {
        let timing = self.shared.timing;
        let mut looks = every(LOOK_EVERY);
        let mut recoveries = every(timing.rescue_every);
        let mut heartbeats = every(timing.beat_every);
        while !self.is_over().await? {
            self.wait().await?;
            let shared = Arc::clone(&self.shared);
            tokio::select! {
                biased;
                () = shared.stop.reached(next_level(self.told)), if self.told < StopLevel::Now => self.tell_stop(),
                _ = heartbeats.tick() => self.heartbeat().await?,
                Some(event) = events.recv() => {
                    self.observe(&event);
                    on_event(event);
                }
                Some(over) = self.tasks.join_next() => self.take(unwound(over)),
                Some(report) = self.endings.join_next() => self.count(unwound(report)),
                _ = recoveries.tick() => self.recover().await?,
                _ = looks.tick(), if self.tasks.len() < self.workers => self.look_again().await?,
            }
        }
        while let Ok(event) = events.try_recv() {
            on_event(event);
        }
        match self.fatal.take() {
            Some(error) => Err(error),
            None => Ok(std::mem::take(&mut self.tally)),
        }
    }

    /// Fills the slots; whether nothing is in hand and nothing can come.
    async fn is_over(&mut self) -> Result<bool, RunError> {
        if self.shared.is_draining() || self.fatal.is_some() {
            self.give_back().await?;
            return Ok(self.is_idle());
        }
        if self.exclusive || self.short {
            return Ok(false);
        }
        self.begin().await?;
        let wanted = self.wanted();
        if !self.look || self.short || wanted == 0 {
            return Ok(false);
        }
        self.look = false;
        self.claim(wanted, false).await?;
        if !self.is_idle() {
            return Ok(false);
        }
        // Nothing ordinary is left or in hand: now the pairs that must run by themselves, one at a time.
        self.claim(1, true).await?;
        if !self.is_idle() {
            return Ok(false);
        }
        let left = self.outstanding().await?;
        Ok(left.ready == 0 && left.leased == 0 && left.backoff == 0)
    }

    /// While all slots are busy, what is finished may wait for company, until it is much. Else it is stored at once: the
    /// next pair may wait for it, or the end, and a pair that nothing may run beside is to be blamed by itself if it
    /// kills.
    async fn wait(&mut self) -> Result<(), RunError> {
        let is_free = self.tasks.len() < self.workers && !self.endings.is_empty();
        let is_waiting = is_free || self.endings.len() > self.workers * MOST_ENDINGS / 2;
        if is_waiting != self.waiting.is_some() {
            self.waiting = if is_waiting {
                Some(self.shared.catalog.waiting().await?)
            } else {
                None
            };
        }
        Ok(())
    }

    /// Whether so many pairs are computed and not stored that the disk must catch up.
    pub(super) fn is_disk_behind(&self) -> bool {
        self.endings.len() >= self.workers * MOST_ENDINGS
    }

    /// Whether nothing is computed or on its way.
    fn is_idle(&self) -> bool {
        self.tasks.is_empty() && self.endings.is_empty()
    }

    async fn outstanding(&self) -> Result<Outstanding, RunError> {
        let shared = &self.shared;
        let catalog = &shared.catalog;
        Ok(catalog
            .outstanding(shared.until, self.among.as_ref())
            .await?)
    }

    /// Takes in that a pair's computing is over.
    fn take(&mut self, (over, name, need): (PairOutcome, PairName, u64)) {
        self.exclusive = false;
        self.short = false;
        self.look = true;
        self.budget.take_back(need);
        self.in_hand.over(&name);
        match over {
            PairOutcome::Ended(report) => self.count(report),
            PairOutcome::Storing(held) => drop(self.endings.spawn(held.done())),
        }
    }

    /// Takes in how a pair ended.
    fn count(&mut self, report: PairReport) {
        self.look = true;
        self.tally.stages += report.stages;
        match report.end {
            PairEnd::Done => self.tally.done += 1,
            PairEnd::Failed => self.tally.failed += 1,
            PairEnd::Later | PairEnd::GivenBack | PairEnd::Lost => {}
        }
        if let Some(error) = report.fatal {
            self.drain("the run cannot go on");
            self.fatal.get_or_insert(error);
        }
        if self
            .max_failures
            .is_some_and(|max| self.tally.failed >= max)
            && !self.tally.too_many_failures
        {
            self.tally.too_many_failures = true;
            self.drain("too many failures");
        }
    }

    fn drain(&self, reason: &str) {
        if self.shared.drain.level() == StopLevel::Go {
            self.shared.drain.drain();
            self.shared.tell(RunEvent::Stopping {
                level: StopLevel::Drain,
                reason: reason.to_owned(),
            });
        }
    }

    fn tell_stop(&mut self) {
        self.told = self.shared.stop.level();
        self.shared.tell(RunEvent::Stopping {
            level: self.told,
            reason: "asked to stop".to_owned(),
        });
    }

    /// Makes pairs ready whose time has come; looks whether others have given some back.
    async fn look_again(&mut self) -> Result<(), RunError> {
        if self.shared.is_draining() {
            return Ok(());
        }
        let now = self.shared.clock.now();
        let left = self.outstanding().await?;
        if left.next_due.is_some_and(|due| due <= now) {
            let longest = policy::longest_backoff_ms();
            self.shared
                .catalog
                .release_due_backoffs(now, longest)
                .await?;
        }
        self.look = true;
        Ok(())
    }

    /// A sign of life. When none can be stored for as long as a lease lasts, the run is over; when one comes too late,
    /// because the process was held up, it goes on as another worker.
    async fn heartbeat(&mut self) -> Result<(), RunError> {
        let now = self.shared.clock.now();
        let alive_since = self.shared.alive_since();
        let catalog = &self.shared.catalog;
        match catalog.heartbeat(self.worker, now, alive_since).await {
            Ok(true) => self.last_beat = now,
            Ok(false) => self.enter_anew(now).await?,
            Err(error) => {
                tracing::warn!(%error, "no sign of life could be stored");
                if self.last_beat < alive_since {
                    self.drain("the catalog cannot be written any more");
                    self.fatal.get_or_insert(error.into());
                }
            }
        }
        Ok(())
    }

    /// Takes a new number. What is in hand under the old one can no longer be stored; its pairs are ready again.
    async fn enter_anew(&mut self, now: UnixMillis) -> Result<(), RunError> {
        tracing::warn!("held up past the end of its leases: the stages in hand run again");
        self.give_back().await?;
        let catalog = &self.shared.catalog;
        let old = self.worker;
        catalog.end_worker(old, now).await?;
        self.worker = catalog
            .register_worker(this_process(), self.shared.fingerprints, now)
            .await?;
        self.last_beat = now;
        catalog.recover(DeadWorker::Workers(vec![old]), now).await?;
        self.look = true;
        Ok(())
    }

    /// Takes back the leases of dead workers in other processes.
    async fn recover(&mut self) -> Result<(), RunError> {
        let catalog = &self.shared.catalog;
        let now = self.shared.clock.now();
        let holders = catalog.lease_holders().await?;
        let dead = self.liveness.observe(&holders, self.worker, now);
        let mut recovered = 0;
        if !dead.is_empty() {
            let found = catalog.recover(DeadWorker::Workers(dead), now).await?;
            input_changes::poisoned(&self.shared.project, catalog, &found.poisoned).await?;
            recovered += found.ready;
        }
        if holders.iter().any(|holder| holder.worker != self.worker) {
            let margin = self.shared.timing.deadline_margin.as_millis() as i64;
            let overdue = catalog.recover_overdue(self.worker, margin, now).await?;
            recovered += overdue.ready;
        }
        if recovered > 0 {
            self.look = true;
            self.shared.tell(RunEvent::Recovered { pairs: recovered });
        }
        Ok(())
    }
}

/// What a task gave; its panic is ours.
fn unwound<T>(ended: Result<T, JoinError>) -> T {
    match ended {
        Ok(ended) => ended,
        Err(panic) => std::panic::resume_unwind(panic.into_panic()),
    }
}

const fn next_level(level: StopLevel) -> StopLevel {
    match level {
        StopLevel::Go => StopLevel::Drain,
        StopLevel::Drain | StopLevel::Now => StopLevel::Now,
    }
}

fn every(period: Duration) -> Interval {
    let mut ticks = interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticks
}
