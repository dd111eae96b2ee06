//! Taking pairs: for slots that are free, and ahead for those that soon will be, so that no core waits for a claim.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use super::RunError;
use super::events::RunEvent;
use super::memory_budget;
use super::pace::DurationEstimate;
use super::pair_task::work;
use super::scheduler::Scheduler;
use crate::catalog::{ClaimRequest, Lease, PairWork};
use crate::domain::PairName;

/// A pair that is leased and not begun.
#[derive(Debug)]
pub(super) struct LeasedPair {
    lease: Lease,
    work: PairWork,
    /// Memory it may need.
    need: u64,
}

/// Pairs that are leased: those begun and those to come.
#[derive(Debug, Default)]
pub(super) struct Prefetch {
    /// Taken ahead.
    ahead: VecDeque<LeasedPair>,
    begun: BTreeMap<PairName, RunningPair>,
    pace: DurationEstimate,
}

/// A pair in a slot.
#[derive(Debug)]
struct RunningPair {
    at: Instant,
    /// Whether it is at its last stage.
    is_last: bool,
}

impl Prefetch {
    /// Notes that a pair is begun.
    fn begin(&mut self, pair: PairName) {
        let (at, is_last) = (Instant::now(), false);
        self.begun.insert(pair, RunningPair { at, is_last });
    }

    /// Notes that a pair is at its last stage, if it is one of ours.
    pub(super) fn nearly_over(&mut self, pair: &PairName) {
        if let Some(begun) = self.begun.get_mut(pair) {
            begun.is_last = true;
        }
    }

    /// Notes that a pair's computing is over.
    pub(super) fn over(&mut self, pair: &PairName) {
        if let Some(begun) = self.begun.remove(pair) {
            self.pace.took(begun.at.elapsed());
        }
    }

    /// Pairs to take when so many slots are free. None while there are enough; then at once as many as will be begun
    /// soon.
    fn wanted(&self, free: usize) -> usize {
        let nearly_over = self.begun.values().filter(|begun| begun.is_last).count();
        let taken = self.ahead.len();
        match (free + nearly_over).saturating_sub(taken) {
            0 => 0,
            least => least + (free + self.begun.len()) * self.pace.ahead(),
        }
    }
}

impl Scheduler {
    /// Takes in what an event says about the slots.
    pub(super) fn observe(&mut self, event: &RunEvent) {
        if let RunEvent::StageStarted { pair, stage } = event
            && *stage == self.shared.until
            && !self.exclusive
        {
            self.in_hand.nearly_over(pair);
            self.look = true;
        }
    }

    /// Pairs that may be taken now.
    pub(super) fn wanted(&self) -> usize {
        self.in_hand
            .wanted(self.workers.saturating_sub(self.tasks.len()))
    }

    /// Takes so many pairs and begins as many as there are free slots.
    pub(super) async fn claim(&mut self, slots: usize, exclusive: bool) -> Result<(), RunError> {
        let shared = &self.shared;
        // One that is taken ahead may wait for a slot for as long as a stage may last.
        let is_ahead = slots + self.tasks.len() > self.workers;
        let wait = if is_ahead {
            shared.stage_limit.as_millis() as i64
        } else {
            0
        };
        let leases = shared
            .catalog
            .claim(ClaimRequest {
                worker: self.worker,
                slots,
                until: shared.until,
                exclusive,
                among: self.among.clone(),
                deadline: shared.deadline() + wait,
                alive_since: shared.alive_since(),
            })
            .await?;
        self.exclusive = exclusive && !leases.is_empty();
        if !leases.is_empty() {
            let works = self.shared.catalog.work(&leases).await?;
            let taken = leases.into_iter().zip(works);
            self.in_hand.ahead.extend(self.with_needs(taken).await);
        }
        self.begin().await
    }

    /// Begins what was taken ahead, as far as slots are free and the memory goes.
    pub(super) async fn begin(&mut self) -> Result<(), RunError> {
        while self.tasks.len() < self.workers && !self.is_disk_behind() {
            let Some(taken) = self.in_hand.ahead.pop_front() else {
                break;
            };
            if !self.budget.give(taken.need) {
                self.short = true;
                self.in_hand.pace.stay_single();
                self.in_hand.ahead.push_front(taken);
                // Those after one that must wait wait too, so that it is not passed over for ever.
                return self.give_back().await;
            }
            self.warn(&taken);
            self.spawn(taken);
        }
        Ok(())
    }

    /// Says so when a pair may need more memory than pairs may take.
    fn warn(&self, taken: &LeasedPair) {
        if let Some(limit) = self.budget.exceeded_by(taken.need) {
            let (need, limit) = (taken.need >> 20, limit >> 20);
            let pair = &taken.work.attributes.name;
            tracing::warn!(
                "{pair} may need {need} MiB, more than the {limit} MiB of --memory: it runs with nothing beside it"
            );
        }
    }

    fn spawn(&mut self, taken: LeasedPair) {
        let LeasedPair { lease, work, need } = taken;
        let name = work.attributes.name.clone();
        self.in_hand.begin(name.clone());
        let over = self::work(Arc::clone(&self.shared), lease, work);
        self.tasks.spawn(async move { (over.await, name, need) });
    }

    /// Gives back what was taken ahead.
    pub(super) async fn give_back(&mut self) -> Result<(), RunError> {
        for taken in std::mem::take(&mut self.in_hand.ahead) {
            self.shared.catalog.release(taken.lease).await?;
        }
        Ok(())
    }

    /// Leased pairs with the memory that they may need.
    async fn with_needs(
        &self,
        leased: impl Iterator<Item = (Lease, PairWork)> + Send + 'static,
    ) -> Vec<LeasedPair> {
        let is_limited = self.budget.is_limited();
        let (project, images) = (self.shared.project.clone(), self.images);
        let look = move |(lease, work): (Lease, PairWork)| {
            let need = if is_limited {
                memory_budget::need(&project, &work.attributes, lease.cursor(), &images)
            } else {
                0
            };
            LeasedPair { lease, work, need }
        };
        match tokio::task::spawn_blocking(move || leased.map(look).collect()).await {
            Ok(taken) => taken,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::Prefetch;
    use crate::domain::PairName;

    #[test]
    fn pairs_are_taken_ahead_when_one_is_nearly_over_and_several_where_they_are_short() {
        let pair = PairName::new("1").expect("a name");
        let mut in_hand = Prefetch::default();
        assert_eq!(in_hand.wanted(2), 2);
        in_hand.begin(pair.clone());
        assert_eq!(in_hand.wanted(0), 0);
        in_hand.nearly_over(&pair);
        assert_eq!(in_hand.wanted(0), 1);
        in_hand.pace.took(Duration::from_millis(100));
        assert_eq!(in_hand.wanted(0), 1 + 2);
        assert_eq!(in_hand.wanted(1), 2 + 4);
    }
}
