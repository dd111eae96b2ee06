//! Taking pairs: for slots that are free, and one ahead for each that soon will be, so that no core waits for a claim.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use super::RunError;
use super::budget;
use super::dispatch::Dispatch;
use super::events::RunEvent;
use super::worker::work;
use crate::catalog::{ClaimRequest, KnownInputs, Lease, PairSelection, PairWork};
use crate::domain::{PairId, PairName};

/// A pair that is leased and not begun.
#[derive(Debug)]
pub(super) struct Taken {
    lease: Lease,
    work: PairWork,
    /// Memory it may need.
    need: u64,
}

/// Pairs that are leased: those begun and those to come.
#[derive(Debug, Default)]
pub(super) struct InHand {
    /// Taken ahead.
    ahead: VecDeque<Taken>,
    /// Those begun, and whether they are at their last stage.
    begun: BTreeMap<PairName, bool>,
}

impl InHand {
    /// Notes that a pair is at its last stage, if it is one of ours.
    pub(super) fn nearly_over(&mut self, pair: &PairName) {
        if let Some(last) = self.begun.get_mut(pair) {
            *last = true;
        }
    }

    /// Notes that a pair's computing is over.
    pub(super) fn over(&mut self, pair: &PairName) {
        self.begun.remove(pair);
    }

    /// Pairs to take when so many slots are free.
    fn wanted(&self, free: usize) -> usize {
        let nearly_over = self.begun.values().filter(|last| **last).count();
        (free + nearly_over).saturating_sub(self.ahead.len())
    }
}

impl Dispatch {
    /// Takes in what an event says about the slots.
    pub(super) fn observe(&mut self, event: &RunEvent) {
        if let RunEvent::StageStarted { pair, stage } = event
            && *stage == self.shared.until
            && !self.alone
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
    pub(super) async fn claim(&mut self, slots: usize, alone: bool) -> Result<(), RunError> {
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
                alone,
                among: self.among.clone(),
                deadline: shared.deadline() + wait,
                alive_since: shared.alive_since(),
            })
            .await?;
        self.alone = alone && !leases.is_empty();
        let needs = self.needs(&leases).await?;
        for lease in leases {
            let need = needs.get(&lease.pair()).copied().unwrap_or(0);
            let work = self.shared.catalog.work(&lease).await?;
            self.in_hand.ahead.push_back(Taken { lease, work, need });
        }
        self.begin().await
    }

    /// Begins what was taken ahead, as far as slots are free and the memory goes.
    pub(super) async fn begin(&mut self) -> Result<(), RunError> {
        while self.tasks.len() < self.workers {
            let Some(taken) = self.in_hand.ahead.pop_front() else {
                break;
            };
            if !self.budget.give(taken.need) {
                self.short = true;
                self.in_hand.ahead.push_front(taken);
                // Those after one that must wait wait too, so that it is not passed over for ever.
                return self.give_back().await;
            }
            self.spawn(taken);
        }
        Ok(())
    }

    fn spawn(&mut self, taken: Taken) {
        let Taken { lease, work, need } = taken;
        let name = work.facts.name.clone();
        self.in_hand.begun.insert(name.clone(), false);
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
}
