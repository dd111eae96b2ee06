//! The pairs that this process has leased: running pairs, and a queue of pairs that start when a slot becomes free.
//! With the queue, no core waits for a claim.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::error::RunError;
use super::events::RunEvent;
use super::input_reads::{ReadItem, ReadLimits, read_each};
use super::memory_budget::{MemoryBudget, PAIR_BYTES, estimated_bytes};
use super::options::RunOptions;
use super::run_context::RunContext;
use super::stop::StopLevel;
use crate::catalog::{ClaimRequest, Lease, PairAttributes, PairSelection, PairWork};
use crate::domain::{PairName, Stage, WorkerId};
use crate::raster;
use crate::store::Project;

/// Pairs are claimed ahead to keep each slot busy for this time. One claim then covers several short pairs.
const CLAIM_AHEAD: Duration = Duration::from_millis(250);
/// Most pairs claimed ahead for one slot, however short they are.
const MAX_AHEAD_PER_SLOT: u128 = 16;

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
    running: BTreeMap<SlotId, RunningPair>,
    next_slot: SlotId,
    durations: DurationEstimate,
    memory: MemoryBudget,
    /// The next pair needs memory that a running pair has to return first.
    waits_for_memory: bool,
    /// A pair is running that no other may run beside.
    is_exclusive: bool,
    /// A claim may find pairs that the last one did not find.
    may_find_more: bool,
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
            image_limits: options.image_limits,
            slots: options.workers.max(1),
            queue: VecDeque::new(),
            running: BTreeMap::new(),
            next_slot: SlotId(0),
            durations: DurationEstimate::default(),
            memory: MemoryBudget::new(options.memory),
            waits_for_memory: false,
            is_exclusive: false,
            may_find_more: true,
        }
    }

    /// Returns the number of slots without a pair.
    pub(super) fn free_slots(&self) -> usize {
        self.slots.saturating_sub(self.running.len())
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

    /// Claims pairs for slots that are free or soon become free. Returns `false`, and claims nothing, if no pair is
    /// needed, if none may start yet, or if nothing has changed since the last claim.
    pub(super) async fn claim(&mut self, worker: WorkerId) -> Result<bool, RunError> {
        let wanted = self.load().pairs_to_claim(self.durations.pairs_ahead());
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
        self.is_exclusive = !self.queue.is_empty();
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
            self.durations.disable();
            // Release the whole queue, not only this pair. Otherwise smaller pairs could keep overtaking it.
            self.queue.push_front(next);
            self.release_all().await?;
            return Ok(None);
        }
        self.warn_if_oversized(&next);
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
        for pair in std::mem::take(&mut self.queue) {
            self.context.catalog.release(pair.lease).await?;
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
            queued: self.queue.len(),
        }
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
            among: self.selection.clone(),
            deadline: context.deadline() + wait,
            alive_since: context.alive_since(),
        };
        let leases = context.catalog.claim(request).await?;
        if leases.is_empty() {
            return Ok(());
        }
        let catalog = &context.catalog;
        let works = catalog.retry_while_unavailable(async || catalog.work(&leases).await);
        let works = works.await?;
        let leased = self.estimate(leases.into_iter().zip(works)).await;
        self.queue.extend(leased);
        Ok(())
    }

    /// Adds a memory estimate to each pair. Reads the headers of the print images. If this takes too long for a pair,
    /// its files count as empty.
    async fn estimate(&self, leased: impl Iterator<Item = (Lease, PairWork)>) -> Vec<LeasedPair> {
        let leased: Vec<_> = leased.collect();
        let estimates = if self.memory.is_limited() {
            let estimated = leased.iter().map(|(lease, work)| EstimatedPair {
                project: self.context.project.clone(),
                attributes: work.attributes.clone(),
                from: lease.cursor(),
                limits: self.image_limits,
            });
            let limits = ReadLimits {
                timeout: self.context.timing.read_timeout(),
                stop: self.context.stop.clone(),
                until: StopLevel::Drain,
            };
            read_each(estimated.collect(), &limits).await
        } else {
            vec![Some(0); leased.len()]
        };
        let leased = leased.into_iter().zip(estimates);
        leased
            .map(|((lease, work), bytes)| LeasedPair {
                lease,
                work,
                bytes: bytes.unwrap_or(PAIR_BYTES),
            })
            .collect()
    }

    /// Warns if the memory estimate of a pair exceeds the limit for all running pairs together.
    fn warn_if_oversized(&self, pair: &LeasedPair) {
        if let Some(limit) = self.memory.exceeded_by(pair.bytes) {
            let (need, limit) = (pair.bytes >> 20, limit >> 20);
            let pair = &pair.work.attributes.name;
            tracing::warn!(
                "{pair} may need {need} MiB, more than the {limit} MiB of --memory: it runs with no other pair beside it"
            );
        }
    }
}

/// A pair whose memory is estimated.
struct EstimatedPair {
    project: Project,
    attributes: PairAttributes,
    from: Stage,
    limits: raster::ImageLimits,
}

impl ReadItem for EstimatedPair {
    type Output = u64;

    fn read(&self) -> u64 {
        estimated_bytes(&self.project, &self.attributes, self.from, &self.limits)
    }

    fn path(&self) -> PathBuf {
        self.project.input_path(&self.attributes.mesh_path)
    }
}

/// How busy the slots are.
#[derive(Debug, Clone, Copy)]
struct Load {
    free: usize,
    running: usize,
    /// Running pairs at their last stage.
    soon_free: usize,
    /// Leased pairs that wait for a slot.
    queued: usize,
}

impl Load {
    /// Returns how many pairs to claim, or 0 if enough pairs are queued. `ahead_per_slot` is the number of pairs to
    /// claim ahead for each slot.
    const fn pairs_to_claim(self, ahead_per_slot: usize) -> usize {
        match (self.free + self.soon_free).saturating_sub(self.queued) {
            0 => 0,
            needed => needed + (self.free + self.running) * ahead_per_slot,
        }
    }
}

/// Estimate of how long a pair occupies its slot: a moving average in which recent pairs weigh most.
#[derive(Debug, Default)]
struct DurationEstimate {
    mean: Option<Duration>,
    is_disabled: bool,
}

impl DurationEstimate {
    /// Takes in how long a pair occupied its slot.
    fn add(&mut self, elapsed: Duration) {
        self.mean = Some(self.mean.map_or(elapsed, |mean| (mean * 3 + elapsed) / 4));
    }

    /// Ends claiming ahead. Called if memory is short, because the pairs would have to be released again.
    const fn disable(&mut self) {
        self.is_disabled = true;
    }

    /// Returns how many pairs one slot finishes within [`CLAIM_AHEAD`].
    fn pairs_ahead(&self) -> usize {
        match self.mean {
            Some(mean) if !self.is_disabled => {
                let pairs = CLAIM_AHEAD.as_micros() / mean.as_micros().max(1);
                pairs.min(MAX_AHEAD_PER_SLOT) as usize
            }
            Some(_) | None => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::{DurationEstimate, Load, MAX_AHEAD_PER_SLOT};

    /// Returns how many pairs are claimed ahead per slot, given the durations of earlier pairs in milliseconds.
    fn pairs_ahead(durations: &[u64]) -> usize {
        let mut estimate = DurationEstimate::default();
        for ms in durations {
            estimate.add(Duration::from_millis(*ms));
        }
        estimate.pairs_ahead()
    }

    #[test]
    fn pairs_are_claimed_for_slots_that_soon_become_free_and_more_where_they_are_short() {
        let load = |free, soon_free, queued| Load {
            free,
            running: 2 - free,
            soon_free,
            queued,
        };
        assert_eq!(load(2, 0, 0).pairs_to_claim(0), 2);
        assert_eq!(load(0, 0, 0).pairs_to_claim(0), 0);
        assert_eq!(load(0, 1, 0).pairs_to_claim(0), 1);
        assert_eq!(load(0, 1, 1).pairs_to_claim(2), 0);
        assert_eq!(load(0, 1, 0).pairs_to_claim(2), 1 + 4);
        assert_eq!(load(1, 1, 0).pairs_to_claim(2), 2 + 4);
    }

    #[test]
    fn short_pairs_are_claimed_ahead_and_long_ones_are_not() {
        assert_eq!(pairs_ahead(&[]), 0);
        assert_eq!(pairs_ahead(&[100]), 2);
        assert_eq!(pairs_ahead(&[0, 0]), MAX_AHEAD_PER_SLOT as usize);
        assert_eq!(pairs_ahead(&[5000]), 0);
        assert_eq!(pairs_ahead(&[100, 5000]), 0, "they have become long");
    }

    #[test]
    fn no_pairs_are_claimed_ahead_where_memory_is_short() {
        let mut estimate = DurationEstimate::default();
        estimate.add(Duration::from_millis(1));
        estimate.disable();
        assert_eq!(estimate.pairs_ahead(), 0);
    }
}
