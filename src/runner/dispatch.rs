//! The run's loop: keeps the slots filled, hears what comes back, looks after the queue.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::{Interval, MissedTickBehavior, interval};

use super::budget::{self, Budget};
use super::events::RunEvent;
use super::options::RunOptions;
use super::policy::{self, Liveness};
use super::refresh;
use super::stop::StopLevel;
use super::worker::{PairEnd, PairReport, Shared, work};
use super::{RunError, this_process};
use crate::catalog::{ClaimRequest, Dead, KnownInputs, Lease, Outstanding, PairSelection};
use crate::domain::{PairId, UnixMillis, WorkerId};
use crate::raster;

/// Between two looks for pairs that others give back or whose back-off is over.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// What the loop has counted.
#[derive(Debug, Default)]
pub(super) struct Tally {
    pub(super) done: u64,
    pub(super) failed: u64,
    pub(super) stages: u64,
    pub(super) too_many_failures: bool,
}

/// The loop's own state.
pub(super) struct Dispatch {
    pub(super) shared: Arc<Shared>,
    worker: WorkerId,
    pub(super) workers: usize,
    pub(super) among: Option<PairSelection>,
    pub(super) max_failures: Option<u64>,
    images: raster::Limits,
    /// Pairs in hand, each with the memory it was given.
    tasks: JoinSet<(PairReport, u64)>,
    budget: Budget,
    /// The next pair waits for memory that somebody must give back first.
    short: bool,
    /// A pair that nothing may run beside is in hand.
    alone: bool,
    /// Whether a claim may find something that the last one did not.
    look: bool,
    /// When this worker last showed that it lives, by the run's clock.
    last_beat: UnixMillis,
    liveness: Liveness,
    tally: Tally,
    fatal: Option<RunError>,
    told: StopLevel,
}

impl Dispatch {
    pub(super) fn new(
        shared: Arc<Shared>,
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
            budget: Budget::new(options.memory),
            short: false,
            alone: false,
            look: true,
            tally: Tally::default(),
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
    ) -> Result<Tally, RunError> {
        let timing = self.shared.timing;
        let mut looks = every(LOOK_EVERY);
        let mut rescues = every(timing.rescue_every);
        let mut beats = every(timing.beat_every);
        while !self.is_over().await? {
            let shared = Arc::clone(&self.shared);
            tokio::select! {
                biased;
                () = shared.stop.reached(next_level(self.told)), if self.told < StopLevel::Now => self.tell_stop(),
                _ = beats.tick() => self.beat().await?,
                Some(event) = events.recv() => on_event(event),
                Some(ended) = self.tasks.join_next() => self.take(ended),
                _ = rescues.tick() => self.rescue().await?,
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
            return Ok(self.tasks.is_empty());
        }
        if !self.look || self.alone || self.short || self.tasks.len() >= self.workers {
            return Ok(false);
        }
        self.look = false;
        self.claim(false).await?;
        if !self.tasks.is_empty() {
            return Ok(false);
        }
        // Nothing ordinary is left or in hand: now the pairs that must run by themselves, one at a time.
        self.claim(true).await?;
        if !self.tasks.is_empty() {
            return Ok(false);
        }
        let left = self.outstanding().await?;
        Ok(left.ready == 0 && left.leased == 0 && left.backoff == 0)
    }

    async fn claim(&mut self, alone: bool) -> Result<(), RunError> {
        let shared = &self.shared;
        let slots = if alone {
            1
        } else {
            self.workers - self.tasks.len()
        };
        let leases = shared
            .catalog
            .claim(ClaimRequest {
                worker: self.worker,
                slots,
                until: shared.until,
                alone,
                among: self.among.clone(),
                deadline: shared.deadline(),
                alive_since: shared.alive_since(),
            })
            .await?;
        self.alone = alone && !leases.is_empty();
        let needs = self.needs(&leases).await?;
        for lease in leases {
            let need = needs.get(&lease.pair()).copied().unwrap_or(0);
            // Those after one that must wait wait too, so that it is not passed over for ever.
            self.short = self.short || !self.budget.give(need);
            if self.short {
                self.shared.catalog.release(lease).await?;
            } else {
                let work = work(Arc::clone(&self.shared), lease);
                self.tasks.spawn(async move { (work.await, need) });
            }
        }
        Ok(())
    }

    /// Memory that leased pairs may need.
    async fn needs(&self, leases: &[Lease]) -> Result<BTreeMap<PairId, u64>, RunError> {
        if leases.is_empty() || !self.budget.is_limited() {
            return Ok(BTreeMap::new());
        }
        let pairs: Vec<_> = leases.iter().map(Lease::pair).collect();
        let among = PairSelection::of(&pairs);
        let catalog = &self.shared.catalog;
        let inputs = catalog
            .known_inputs(None, pairs.len(), Some(&among))
            .await?;
        let from: BTreeMap<_, _> = leases
            .iter()
            .map(|lease| (lease.pair(), lease.cursor()))
            .collect();
        let (project, images) = (self.shared.project.clone(), self.images);
        let look = move || {
            let need = |inputs: KnownInputs| {
                let need = budget::need(&project, &inputs, from[&inputs.pair], &images);
                (inputs.pair, need)
            };
            inputs.into_iter().map(need).collect()
        };
        match tokio::task::spawn_blocking(look).await {
            Ok(needs) => Ok(needs),
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        }
    }

    async fn outstanding(&self) -> Result<Outstanding, RunError> {
        let shared = &self.shared;
        let catalog = &shared.catalog;
        Ok(catalog
            .outstanding(shared.until, self.among.as_ref())
            .await?)
    }

    /// Takes in how a pair ended.
    fn take(&mut self, ended: Result<(PairReport, u64), tokio::task::JoinError>) {
        self.alone = false;
        self.short = false;
        self.look = true;
        let (report, need) = match ended {
            Ok(ended) => ended,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        };
        self.budget.take_back(need);
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
            self.shared.catalog.stage_due(now, longest).await?;
        }
        self.look = true;
        Ok(())
    }

    /// A sign of life. When none can be stored for as long as a lease lasts, the run is over; when one comes too late,
    /// because the process was held up, it goes on as another worker.
    async fn beat(&mut self) -> Result<(), RunError> {
        let now = self.shared.clock.now();
        let alive_since = self.shared.alive_since();
        let catalog = &self.shared.catalog;
        match catalog.beat(self.worker, now, alive_since).await {
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
        let catalog = &self.shared.catalog;
        let old = self.worker;
        catalog.end_worker(old, now).await?;
        self.worker = catalog
            .register_worker(this_process(), self.shared.recipes, now)
            .await?;
        self.last_beat = now;
        catalog.rescue(Dead::Workers(vec![old]), now).await?;
        self.look = true;
        Ok(())
    }

    /// Takes back the leases of dead workers in other processes.
    async fn rescue(&mut self) -> Result<(), RunError> {
        let catalog = &self.shared.catalog;
        let now = self.shared.clock.now();
        let holders = catalog.lease_holders().await?;
        let dead = self.liveness.observe(&holders, self.worker, now);
        let mut rescued = 0;
        if !dead.is_empty() {
            let found = catalog.rescue(Dead::Workers(dead), now).await?;
            refresh::condemned(&self.shared.project, catalog, &found.condemned).await?;
            rescued += found.ready;
        }
        if holders.iter().any(|holder| holder.worker != self.worker) {
            let margin = self.shared.timing.deadline_margin.as_millis() as i64;
            let overdue = catalog.rescue_overdue(self.worker, margin, now).await?;
            rescued += overdue.ready;
        }
        if rescued > 0 {
            self.look = true;
            self.shared.tell(RunEvent::Rescued { pairs: rescued });
        }
        Ok(())
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
