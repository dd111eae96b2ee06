//! Claims pairs, queues them, and limits the memory of pairs and blocks. Holds the pairs that this process has leased:
//! running pairs, and a queue of pairs that start when a slot becomes free. With the queue, no core waits for a claim.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use tokio::task::JoinHandle;

use super::claim_size::{CLAIM_AHEAD, DurationEstimate, FETCH_AHEAD, Load};
use super::error::RunError;
use super::events::RunEvent;
use super::input_reads::{ReadLimits, read_each};
use super::memory_budget::{EstimatedPair, MemoryBudget};
use super::options::RunOptions;
use super::retry::retried;
use super::run_context::RunContext;
use super::stop::StopLevel;
use mocban_catalog::{ClaimRequest, Lease, PairSelection, PairWork};
use mocban_core::domain::{BlockName, PairName, WaitReason, WorkerId};
use mocban_core::raster;

/// Identifies a task that occupies a slot. A pair may occupy two slots: after its lease was lost, the process may lease
/// the pair again while the earlier task still computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct SlotId(u64);

/// A pair that is leased and has not started.
#[derive(Debug)]
pub(super) struct LeasedPair {
    pub(super) lease: Lease,
    pub(super) work: PairWork,
    /// Estimate of the memory it needs.
    bytes: u64,
}

/// The leased pairs, and the memory they may take.
pub(super) struct Prefetch {
    context: Arc<RunContext>,
    selection: Option<PairSelection>,
    image_limits: raster::ImageLimits,
    /// Pairs that are computed at the same time at most.
    slots: usize,
    /// Leased pairs that have not started, in the order of their claim.
    queue: VecDeque<LeasedPair>,
    /// Leased pairs whose inputs are read from an object store, in the order of their claim.
    arriving: VecDeque<ArrivingPairs>,
    running: BTreeMap<SlotId, RunningPair>,
    next_slot: SlotId,
    durations: DurationEstimate,
    memory: MemoryBudget,
    /// Memory that is reserved for the block in progress, in bytes.
    block_bytes: u64,
    /// The next pair needs memory that a running pair has to return first.
    waits_for_memory: bool,
    /// A pair is running that no other may run beside.
    is_exclusive: bool,
    /// A claim may find pairs that the last one did not find.
    may_find_more: bool,
}

/// Pairs of one claim, whose estimates a task makes. With remote inputs, this reads the inputs into the local cache.
struct ArrivingPairs {
    leased: Vec<(Lease, PairWork)>,
    estimates: JoinHandle<Vec<Option<u64>>>,
}

/// A pair in a slot.
#[derive(Debug)]
struct RunningPair {
    name: PairName,
    since: Instant,
    bytes: u64,
    is_at_last_stage: bool,
}

impl Prefetch {
    /// Nothing is leased yet.
    pub(super) fn new(
        context: Arc<RunContext>,
        selection: Option<PairSelection>,
        options: &RunOptions,
    ) -> Self {
        Self {
            context,
            selection,
            image_limits: options.limits.image,
            slots: options.workers.max(1),
            queue: VecDeque::new(),
            arriving: VecDeque::new(),
            running: BTreeMap::new(),
            next_slot: SlotId(0),
            durations: DurationEstimate::default(),
            memory: MemoryBudget::new(options.memory),
            block_bytes: 0,
            waits_for_memory: false,
            is_exclusive: false,
            may_find_more: true,
        }
    }

    /// Returns the number of slots without a pair.
    pub(super) fn free_slots(&self) -> usize {
        self.slots.saturating_sub(self.running.len())
    }

    /// Returns the number of leased pairs that run or have not started.
    pub(super) fn leased(&self) -> usize {
        self.queue.len() + self.running.len()
    }

    /// Notes that pairs may have become ready since the last claim.
    pub(super) const fn expect_more(&mut self) {
        self.may_find_more = true;
    }

    /// Records an event of a running pair. If the pair starts its last stage, its slot will soon be free.
    pub(super) fn observe(&mut self, event: &RunEvent) {
        if let RunEvent::StageStarted { pair, stage } = event
            && *stage == self.context.until
            && !self.is_exclusive
        {
            // If two tasks compute the pair, the later one has the lease.
            let mut running = self.running.values_mut().rev();
            if let Some(running) = running.find(|running| running.name == *pair) {
                running.is_at_last_stage = true;
            }
            self.may_find_more = true;
        }
    }

    /// Records that a pair has left its slot.
    pub(super) fn finish(&mut self, slot: SlotId) {
        if let Some(running) = self.running.remove(&slot) {
            self.durations.add(running.since.elapsed());
            self.memory.release(running.bytes);
        }
        self.is_exclusive = false;
        self.waits_for_memory = false;
        self.may_find_more = true;
    }

    /// Replaces the pairs that may be claimed.
    pub(super) fn select(&mut self, pairs: &PairSelection) {
        self.selection = Some(pairs.clone());
    }

    /// Returns whether the memory of pairs and blocks is limited.
    pub(super) const fn is_memory_limited(&self) -> bool {
        self.memory.is_limited()
    }

    /// Reserves memory for a block. Returns `false` if it needs memory that running pairs have to return first. Warns
    /// if it needs more than the limit for all together.
    pub(super) fn reserve_for_block(&mut self, block: &BlockName, bytes: u64) -> bool {
        if !self.memory.reserve(bytes) {
            return false;
        }
        self.block_bytes = bytes;
        self.memory
            .warn_if_exceeded(format_args!("block {block}"), bytes);
        true
    }

    /// Ends the reservation for a block.
    pub(super) fn release_block_memory(&mut self) {
        self.memory.release(std::mem::take(&mut self.block_bytes));
        self.waits_for_memory = false;
        self.may_find_more = true;
    }

    /// Claims pairs for slots that are free or soon become free. Returns `false`, and claims nothing, if no pair is
    /// needed, if none may start yet, or if nothing has changed since the last claim.
    pub(super) async fn claim(&mut self, worker: WorkerId) -> Result<bool, RunError> {
        let load = self.load();
        let wanted = if self.context.project.has_remote_inputs() {
            load.pairs_to_fetch(self.durations.pairs_within(FETCH_AHEAD))
        } else {
            load.pairs_to_claim(self.durations.pairs_within(CLAIM_AHEAD))
        };
        let is_blocked = self.is_exclusive || self.waits_for_memory;
        if is_blocked || !self.may_find_more || wanted == 0 {
            return Ok(false);
        }
        self.may_find_more = false;
        self.lease(worker, wanted, false).await?;
        Ok(true)
    }

    /// Claims one of the pairs that must run with no other beside them.
    pub(super) async fn claim_exclusive(&mut self, worker: WorkerId) -> Result<(), RunError> {
        self.lease(worker, 1, true).await?;
        self.is_exclusive = !self.queue.is_empty() || self.arriving_pairs() > 0;
        Ok(())
    }

    /// Returns the next pair to start, with its slot. Returns `None` if no slot is free, the queue is empty, or memory
    /// is short.
    pub(super) async fn next_pair(&mut self) -> Result<Option<(SlotId, LeasedPair)>, RunError> {
        if self.free_slots() == 0 || self.waits_for_memory {
            return Ok(None);
        }
        let Some(next) = self.queue.pop_front() else {
            return Ok(None);
        };
        if !self.memory.reserve(next.bytes) {
            self.waits_for_memory = true;
            if self.block_bytes == 0 {
                self.durations.disable();
            }
            // Release the whole queue, not only this pair. Otherwise smaller pairs could keep overtaking it.
            self.queue.push_front(next);
            self.release_all().await?;
            return Ok(None);
        }
        let name = &next.work.attributes.name;
        self.memory
            .warn_if_exceeded(format_args!("{name}"), next.bytes);
        let running = RunningPair {
            name: next.work.attributes.name.clone(),
            since: Instant::now(),
            bytes: next.bytes,
            is_at_last_stage: false,
        };
        let slot = self.next_slot;
        self.next_slot = SlotId(slot.0 + 1);
        self.running.insert(slot, running);
        Ok(Some((slot, next)))
    }

    /// Releases the leases of all pairs that have not started.
    pub(super) async fn release_all(&mut self) -> Result<(), RunError> {
        let arriving = std::mem::take(&mut self.arriving);
        let arriving = arriving.into_iter().flat_map(|pairs| {
            pairs.estimates.abort();
            pairs.leased.into_iter().map(|(lease, _)| lease)
        });
        let queued = std::mem::take(&mut self.queue);
        for lease in queued.into_iter().map(|pair| pair.lease).chain(arriving) {
            self.context.catalog.release(lease).await?;
        }
        Ok(())
    }

    fn load(&self) -> Load {
        let at_last_stage = self
            .running
            .values()
            .filter(|running| running.is_at_last_stage);
        Load {
            free: self.free_slots(),
            running: self.running.len(),
            soon_free: at_last_stage.count(),
            queued: self.queue.len() + self.arriving_pairs(),
        }
    }

    /// Returns the number of leased pairs whose inputs have not arrived.
    pub(super) fn arriving_pairs(&self) -> usize {
        self.arriving.iter().map(|pairs| pairs.leased.len()).sum()
    }

    /// Leases up to `count` pairs and appends them to the queue.
    async fn lease(
        &mut self,
        worker: WorkerId,
        count: usize,
        exclusive: bool,
    ) -> Result<(), RunError> {
        let context = &self.context;
        // If more pairs are claimed than slots are free, some pairs first wait for another pair's last stage. Every
        // deadline of this claim is therefore extended by one stage timeout.
        let wait = if count > self.free_slots() {
            context.stage_timeout.as_millis() as i64
        } else {
            0
        };
        let request = ClaimRequest {
            worker,
            slots: count,
            until: context.until,
            exclusive,
            selection: self.selection.clone(),
            deadline: context.deadline() + wait,
            alive_since: context.alive_since(),
        };
        let (begun, waiting) = (Instant::now(), self.free_slots() as u32);
        let leases = context.catalog.claim(request).await?;
        if leases.is_empty() {
            return Ok(());
        }
        let catalog = &context.catalog;
        let works = retried!(catalog.work(&leases))?;
        let waited = begun.elapsed() * waiting;
        context.metrics.add_wait(WaitReason::Database, waited);
        let leased: Vec<_> = leases.into_iter().zip(works).collect();
        for (lease, work) in &leased {
            let (pair, stage) = (&work.attributes.name, lease.cursor());
            tracing::debug!(%pair, %stage, attempt = lease.attempt(), exclusive, "a pair is leased");
        }
        let estimates = tokio::spawn(self.estimates(&leased));
        self.arriving.push_back(ArrivingPairs { leased, estimates });
        if !self.context.project.has_remote_inputs() {
            self.arrive().await;
        }
        Ok(())
    }

    /// Waits until the inputs of the pairs that were claimed first have arrived, and appends these pairs to the queue.
    /// Does not return if no pair is arriving. Nothing is lost if the wait is cancelled.
    pub(super) async fn arrive(&mut self) {
        let Some(first) = self.arriving.front_mut() else {
            return std::future::pending().await;
        };
        // After a panic, the pairs count as pairs whose files cannot be read.
        let estimates = (&mut first.estimates).await.unwrap_or_default();
        let Some(ArrivingPairs { leased, .. }) = self.arriving.pop_front() else {
            return;
        };
        let estimates = estimates.into_iter().chain(std::iter::repeat(None));
        let leased = leased.into_iter().zip(estimates);
        let map_bytes = self.context.pairs.map_bytes();
        self.queue
            .extend(leased.map(|((lease, work), bytes)| LeasedPair {
                lease,
                work,
                bytes: bytes.unwrap_or(map_bytes),
            }));
    }

    /// Estimates the memory that each pair needs. Reads the headers of the print images, and remote inputs as a whole.
    /// If this takes too long for a pair, its estimate is `None`.
    fn estimates(
        &self,
        leased: &[(Lease, PairWork)],
    ) -> impl Future<Output = Vec<Option<u64>>> + use<> {
        let is_needed = self.memory.is_limited() || self.context.project.has_remote_inputs();
        let estimated = leased.iter().map(|(lease, work)| EstimatedPair {
            project: self.context.project.clone(),
            attributes: work.attributes.clone(),
            from: lease.cursor(),
            limits: self.image_limits,
            map_bytes: self.context.pairs.map_bytes(),
        });
        let estimated: Vec<_> = estimated.take_while(|_| is_needed).collect();
        let others = vec![Some(0); leased.len() - estimated.len()];
        let limits = ReadLimits {
            timeout: self.context.timing.read_timeout(),
            stop: self.context.stop.clone(),
            until: StopLevel::Drain,
        };
        async move { [read_each(estimated, &limits).await, others].concat() }
    }
}
