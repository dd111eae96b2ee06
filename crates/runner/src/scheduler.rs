//! The main loop of a run: fills the slots, handles pairs that end, and stores this worker's heartbeats.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::{Interval, MissedTickBehavior, interval};

use super::block::task::{BlockReport, BlockRunCounts, BlockSlot};
use super::blocking::task_result;
use super::error::RunError;
use super::events::{CutPairs, RunEvent};
use super::options::RunOptions;
use super::pair_task::{PairOutcome, process_pair};
use super::policy;
use super::prefetch::{Prefetch, SlotId};
use super::retry::retried;
use super::run_context::{JobEnd, PairReport, RunContext};
use super::run_selection::RunSelection;
use super::stop::StopLevel;
use super::worker_session::{HeartbeatOutcome, WorkerSession};
use mocban_catalog::{Outstanding, Waiting};
use mocban_core::domain::WaitReason;

/// Interval between searches for pairs that other workers released or whose back-off is over.
const POLL_EVERY: Duration = Duration::from_millis(250);

/// Limit of computed but unstored pairs per slot. At the limit no pair starts, because unstored results take memory.
const MAX_STORING_PER_SLOT: usize = 8;

/// What a run has counted.
#[derive(Debug, Default)]
pub(super) struct RunCounts {
    pub(super) done: u64,
    pub(super) failed: u64,
    /// Stages computed and stored.
    pub(super) stages: u64,
    pub(super) too_many_failures: bool,
    pub(super) blocks: BlockRunCounts,
    pub(super) cut: CutPairs,
}

/// The state of the main loop.
pub(super) struct Scheduler {
    context: Arc<RunContext>,
    session: WorkerSession,
    selection: Option<RunSelection>,
    prefetch: Prefetch,
    /// The block in progress. While there is one, this process claims no pairs.
    block: BlockSlot,
    max_storing: usize,
    max_failures: Option<u64>,
    /// Pairs that are computed.
    computing: JoinSet<(SlotId, PairOutcome)>,
    /// Pairs that are computed and whose last stages are being stored.
    storing: JoinSet<PairReport>,
    /// While this guard exists, the catalog commits at once instead of waiting for more requests.
    flush: Option<Waiting>,
    counts: RunCounts,
    fatal: Option<RunError>,
    /// The stop level that was last reported as an event.
    reported_stop: StopLevel,
}

impl Scheduler {
    pub(super) fn new(
        context: Arc<RunContext>,
        selection: Option<RunSelection>,
        options: &RunOptions,
    ) -> Self {
        let now = context.clock.now();
        context.metrics.set_jobs(options.workers.max(1));
        let pairs = selection.as_ref().map(|selection| selection.pairs.clone());
        let blocks = selection.as_ref().map(|selection| selection.blocks.clone());
        Self {
            session: WorkerSession::new(now, context.timing.lease_ms()),
            prefetch: Prefetch::new(Arc::clone(&context), pairs, options),
            block: BlockSlot::new(Arc::clone(&context), blocks, options),
            context,
            selection,
            max_storing: options.workers.max(1) * MAX_STORING_PER_SLOT,
            max_failures: options.max_failures,
            computing: JoinSet::new(),
            storing: JoinSet::new(),
            flush: None,
            counts: RunCounts::default(),
            fatal: None,
            reported_stop: StopLevel::Go,
        }
    }

    /// Runs until nothing is left to do or the run is stopped. Returns the run's counts, or the error that ended the
    /// run.
    pub(super) async fn run(
        &mut self,
        events: &mut mpsc::UnboundedReceiver<RunEvent>,
        on_event: &mut (impl FnMut(RunEvent) + Send),
    ) -> Result<RunCounts, RunError> {
        let context = Arc::clone(&self.context);
        let mut polls = every(POLL_EVERY);
        let mut recoveries = every(context.timing.recover_every);
        let mut heartbeats = every(context.timing.heartbeat_every);
        while !self.fill_slots().await? {
            self.flush_where_needed().await?;
            let leased = self.prefetch.leased() + self.storing.len();
            context.metrics.set_leased(leased);
            let begun = Instant::now();
            let waiting = self.slots_waiting_for_storage();
            tokio::select! {
                biased;
                () = context.stop.reached(self.reported_stop.next()), if self.reported_stop < StopLevel::Now => {
                    self.report_stop();
                    if self.reported_stop == StopLevel::Drain {
                        // Others see at once that this worker stops.
                        heartbeats.reset_immediately();
                    }
                }
                _ = heartbeats.tick() => self.heartbeat().await?,
                Some(event) = events.recv() => {
                    self.prefetch.observe(&event);
                    self.counts.cut.observe(&event);
                    on_event(event);
                }
                Some(computed) = self.computing.join_next() => self.finish_computing(task_result(computed)),
                Some(report) = self.storing.join_next() => self.count(task_result(report)),
                Some(report) = self.block.ended() => self.count_block(report).await?,
                () = self.prefetch.arrive() => {}
                _ = recoveries.tick() => self.recover().await?,
                _ = polls.tick(), if self.prefetch.free_slots() > 0 => self.poll().await?,
            }
            self.add_storage_wait(waiting, begun.elapsed());
        }
        context.metrics.set_leased(0);
        while let Ok(event) = events.try_recv() {
            self.counts.cut.observe(&event);
            on_event(event);
        }
        match self.fatal.take() {
            Some(error) => Err(error),
            None => Ok(RunCounts {
                blocks: self.block.counts,
                ..std::mem::take(&mut self.counts)
            }),
        }
    }

    /// Starts pairs in free slots. Returns `true` if the run is over: no pair is in progress and none can follow.
    async fn fill_slots(&mut self) -> Result<bool, RunError> {
        if self.context.is_draining() || self.fatal.is_some() {
            self.prefetch.release_all().await?;
            return Ok(self.is_idle());
        }
        self.start_pairs().await?;
        let worker = self.context.worker_id();
        if self.block.start(worker, &mut self.prefetch).await? {
            return Ok(false);
        }
        if !self.prefetch.claim(worker).await? {
            return Ok(false);
        }
        self.start_pairs().await?;
        if !self.is_idle() {
            return Ok(false);
        }
        // This process has no pair in progress. If another process has one, the catalog refuses the claim.
        self.prefetch.claim_exclusive(worker).await?;
        self.start_pairs().await?;
        if !self.is_idle() {
            return Ok(false);
        }
        // Blocks first: the cut of a block that another process works on may add pairs.
        let blocks = self.block.outstanding().await?.left();
        self.refresh_selection().await?;
        let left = self.outstanding().await?;
        Ok(blocks == 0 && left.ready == 0 && left.leased == 0 && left.backoff == 0)
    }

    /// Starts leased pairs while slots and memory are free and fewer than `max_storing` pairs are being stored.
    async fn start_pairs(&mut self) -> Result<(), RunError> {
        while self.storing.len() < self.max_storing
            && let Some((slot, pair)) = self.prefetch.next_pair().await?
        {
            let task = process_pair(Arc::clone(&self.context), pair.lease, pair.work);
            self.computing.spawn(async move { (slot, task.await) });
        }
        Ok(())
    }

    /// Returns how many slots are free because too many computed pairs are being stored.
    fn slots_waiting_for_storage(&self) -> usize {
        if self.storing.len() < self.max_storing {
            return 0;
        }
        self.prefetch.free_slots()
    }

    /// Adds the time that slots waited for pairs to be stored. The commits count as the reason if most of these pairs
    /// are being committed, and otherwise the files.
    fn add_storage_wait(&self, slots: usize, elapsed: Duration) {
        if slots == 0 {
            return;
        }
        let metrics = &self.context.metrics;
        let reason = if metrics.commits() * 2 >= self.max_storing as u64 {
            WaitReason::Database
        } else {
            WaitReason::Artifacts
        };
        metrics.add_wait(reason, elapsed * slots as u32);
    }

    fn is_idle(&self) -> bool {
        self.computing.is_empty()
            && self.storing.is_empty()
            && self.prefetch.arriving_pairs() == 0
            && !self.block.is_busy()
    }

    /// Turns the catalog's commit delay off in two cases: a slot is free while a pair is being stored, or more than
    /// half of `max_storing` pairs are being stored. Otherwise turns the delay on. While a slot is free, the run's end
    /// or a pair that must run alone may be waiting for the commit.
    async fn flush_where_needed(&mut self) -> Result<(), RunError> {
        let is_slot_free = self.prefetch.free_slots() > 0 && !self.storing.is_empty();
        let is_needed = is_slot_free || self.storing.len() > self.max_storing / 2;
        if is_needed != self.flush.is_some() {
            self.flush = if is_needed {
                Some(self.context.catalog.waiting().await?)
            } else {
                None
            };
        }
        Ok(())
    }

    async fn outstanding(&self) -> Result<Outstanding, RunError> {
        let until = self.context.until;
        let catalog = &self.context.catalog;
        let selection = self.selection.as_ref().map(|selection| &selection.pairs);
        Ok(retried!(catalog.outstanding(until, selection))?)
    }

    fn finish_computing(&mut self, (slot, outcome): (SlotId, PairOutcome)) {
        self.prefetch.finish(slot);
        self.block.memory_was_freed();
        match outcome {
            PairOutcome::Ended(report) => self.count(report),
            PairOutcome::Storing(checkpointer) => {
                drop(self.storing.spawn(checkpointer.finish(JobEnd::Done)));
            }
        }
    }

    fn count(&mut self, report: PairReport) {
        self.prefetch.expect_more();
        self.counts.stages += report.stages;
        match report.end {
            Ok(JobEnd::Done) => {
                self.counts.done += 1;
                self.context.metrics.count_done();
            }
            Ok(JobEnd::Failed) => {
                self.counts.failed += 1;
                self.context.metrics.count_failed();
            }
            Ok(JobEnd::Retry | JobEnd::Released | JobEnd::LeaseLost) => {}
            Err(error) => {
                self.drain("the run cannot go on");
                self.fatal.get_or_insert(error);
            }
        }
        self.stop_after_too_many_failures();
    }

    /// Lets nothing more start if too many pairs and blocks have failed.
    fn stop_after_too_many_failures(&mut self) {
        let failed = self.counts.failed + self.block.counts.failed;
        let is_over_limit = self.max_failures.is_some_and(|max| failed >= max);
        if is_over_limit && !self.counts.too_many_failures {
            self.counts.too_many_failures = true;
            self.drain("too many failures");
        }
    }

    async fn count_block(&mut self, report: BlockReport) -> Result<(), RunError> {
        self.prefetch.release_block_memory();
        if let Err(error) = self.block.count(report) {
            self.drain("the run cannot go on");
            self.fatal.get_or_insert(error);
        }
        self.stop_after_too_many_failures();
        self.refresh_selection().await
    }

    /// Selects the pairs that this or another process has cut from the selected blocks.
    async fn refresh_selection(&mut self) -> Result<(), RunError> {
        if let Some(selection) = &mut self.selection {
            selection.refresh(&self.context.catalog).await?;
            self.prefetch.select(&selection.pairs);
        }
        Ok(())
    }

    fn drain(&self, reason: &str) {
        if self.context.drain.level() == StopLevel::Go {
            self.context.drain.drain();
            self.context.emit(RunEvent::Stopping {
                level: StopLevel::Drain,
                reason: reason.to_owned(),
            });
        }
    }

    fn report_stop(&mut self) {
        self.reported_stop = self.context.stop.level();
        self.context.emit(RunEvent::Stopping {
            level: self.reported_stop,
            reason: "asked to stop".to_owned(),
        });
    }

    /// Ends back-offs that are due, and lets the next claim look for pairs that other workers released.
    async fn poll(&mut self) -> Result<(), RunError> {
        if self.context.is_draining() {
            return Ok(());
        }
        let now = self.context.clock.now();
        let left = self.outstanding().await?;
        if left.next_due.is_some_and(|due| due <= now) {
            let longest = policy::longest_backoff_ms();
            let catalog = &self.context.catalog;
            retried!(catalog.release_due_backoffs(now, longest))?;
        }
        self.block.poll().await?;
        self.prefetch.expect_more();
        Ok(())
    }

    /// Stores a heartbeat. If the leases have expired, registers this process as a new worker. Ends the run if the
    /// outcome is `Unwritable`.
    async fn heartbeat(&mut self) -> Result<(), RunError> {
        match self.session.heartbeat(&self.context).await {
            HeartbeatOutcome::Alive => {}
            HeartbeatOutcome::Expired => {
                tracing::warn!(
                    "this process could not reach the catalog until its leases ended: the stages in progress run again"
                );
                self.prefetch.release_all().await?;
                self.session.register_again(&self.context).await?;
                self.prefetch.expect_more();
            }
            HeartbeatOutcome::Unwritable(error) => {
                self.drain("the catalog cannot be written any more");
                self.fatal.get_or_insert(error.into());
            }
        }
        Ok(())
    }

    async fn recover(&mut self) -> Result<(), RunError> {
        let pairs = self.session.recover(&self.context).await?;
        if pairs > 0 {
            self.prefetch.expect_more();
            self.context.emit(RunEvent::Recovered { pairs });
        }
        Ok(())
    }
}

fn every(period: Duration) -> Interval {
    let mut ticks = interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticks
}
