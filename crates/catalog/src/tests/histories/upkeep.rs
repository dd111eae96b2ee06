//! Events from outside a worker: deaths, recoveries, clock jumps, requests of users.

use rand::RngExt as _;

use super::super::model::LEASE;
use super::super::state_machine::JobState;
use super::super::{fingerprints, name, observed, row};
use super::{Game, LONGEST, MOST_PAIRS};
use crate::{DeadWorker, NewVerdict, RerunPolicy, RetrySelection, ReviewContext};
use mocban_core::domain::{JobStatus, Stage, ThresholdMetric, Verdict};

impl Game {
    pub(super) async fn end(&mut self) {
        let Some(index) = self.somebody() else { return };
        let process = &mut self.model.processes[index];
        (process.ended, process.running) = (true, false);
        let ended = self
            .world
            .catalog
            .end_worker(process.worker, process.clock, None);
        ended.await.expect("ended");
    }

    /// A process dies, without notice to others.
    pub(super) fn crash(&mut self) {
        if let Some(index) = self.somebody() {
            self.model.processes[index].running = false;
        }
    }

    /// A process recovers overdue leases, or the leases of a process that it considers dead, rightly or not.
    pub(super) async fn recover(&mut self) {
        let (Some(me), now) = (self.somebody(), self.wall) else {
            return;
        };
        let me = self.model.processes[me].worker;
        let other = self.dice.random_range(0..self.model.processes.len());
        let other = self.model.processes[other].worker;
        let recovered = if self.is_likely(0.5) && other != me {
            let catalog = &self.world.catalog;
            let mut holders = catalog.lease_holders().await.expect("a read");
            holders.retain(|holder| holder.worker == other);
            let dead = match holders.as_slice() {
                [] => DeadWorker::Known(other),
                _ => observed(holders),
            };
            let recover = catalog.recover(dead, now);
            (recover.await, self.model.recover(&[other]))
        } else {
            if let Some(index) = self.somebody() {
                let exclusive = self.is_likely(0.5);
                self.claim_by(index, 1, exclusive).await;
                self.model.processes[index].clock += LEASE / 2;
                self.heartbeat_of(index).await;
            }
            self.join().await;
            let me = self.model.processes.last().expect("it joined").worker;
            let overdue = self.world.catalog.recover_overdue(me, 10, now);
            let expected = self.model.recover_overdue(me, 10);
            self.seen.overdue += expected;
            (overdue.await, expected)
        };
        let found = recovered.0.expect("a recovery");
        assert_eq!(found.ready, recovered.1);
        self.seen.poisoned += found.poisoned.len() as u32;
    }

    /// All processes die, and a new one opens the catalog exclusively.
    pub(super) async fn take_over(&mut self) {
        for process in &mut self.model.processes {
            process.running = false;
        }
        self.join().await;
        let (me, others) = self.model.processes.split_last().expect("it joined");
        let (me, others) = (me.worker, others.iter().map(|other| other.worker));
        let others: Vec<_> = others.collect();
        let recover = self
            .world
            .catalog
            .recover(DeadWorker::AllExcept(me), self.wall);
        let recovered = recover.await.expect("a recovery");
        assert_eq!(recovered.ready, self.model.recover(&others));
        self.seen.poisoned += recovered.poisoned.len() as u32;
        assert!(
            self.model
                .jobs
                .values()
                .all(|job| job.state.status() != JobStatus::Leased)
        );
    }

    /// A pair kills one process after another.
    pub(super) async fn poison(&mut self) {
        let before = self.seen.poisoned;
        for round in 0..8 {
            self.take_over().await;
            let me = self.model.processes.len() - 1;
            self.claim_by(me, 1, round > 0).await;
            if self.seen.poisoned > before {
                return;
            }
        }
    }

    /// The wall clock jumps, forward or back.
    pub(super) async fn due(&mut self) {
        self.wall += self.dice.random_range(-300..300);
        let due = self
            .world
            .catalog
            .release_due_backoffs(self.wall, LONGEST)
            .await;
        assert_eq!(due.expect("stored"), self.model.due(self.wall, LONGEST));
    }

    pub(super) async fn requeue_stale(&mut self) {
        let mut again = RerunPolicy::Changed;
        if self.is_likely(0.7) {
            let revisions = [1; 4].map(|one: u32| one + self.dice.random_range(0..2));
            let new = fingerprints(revisions);
            let ids = self.world.catalog.register_fingerprints(&new).await;
            self.settings = (new, ids.expect("fingerprints"));
        } else {
            again = RerunPolicy::All(Stage::ALL[self.dice.random_range(0..4)]);
        }
        let (fingerprints, ids) = &self.settings;
        let sent = self
            .world
            .catalog
            .requeue_stale(fingerprints, None, again)
            .await;
        assert_eq!(
            sent.expect("requeued"),
            self.model.requeue_stale(*ids, again)
        );
    }

    pub(super) async fn retry(&mut self) {
        let retried = self.world.retry(&RetrySelection::All).await;
        assert_eq!(retried.expect("retried"), self.model.retry());
    }

    pub(super) async fn import(&mut self) {
        let count = self.model.jobs.len();
        if count < MOST_PAIRS {
            let imported = self
                .world
                .catalog
                .import(vec![row(&format!("p{count}"))], 1);
            imported.await.expect("imported");
            self.model.import();
        }
    }

    pub(super) async fn verdict(&mut self) {
        let pair = self.dice.random_range(1..=self.model.jobs.len());
        if self.model.jobs[&(pair as i64)].state != JobState::Done {
            return;
        }
        let verdict = NewVerdict {
            pair: name(&format!("p{}", pair - 1)),
            metric: Some(ThresholdMetric::Density),
            verdict: Verdict::Pass,
            reviewer: "ana".to_owned(),
            reason: None,
            note: None,
            context: ReviewContext::default(),
            at: None,
        };
        let stored = self.world.catalog.verdict_set(vec![verdict], self.wall);
        stored.await.expect("stored");
        self.verdicts.push(self.verdicts.len() as i64 + 1);
    }
}
