//! Random events against the catalog and against the pure state machine: both must always say the same.

use std::collections::BTreeMap;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use sqlx::Row as _;

use super::{World, recipes, register};
use crate::catalog::{
    Again, ClaimRequest, Dead, Kept, Lease, RetrySelection, Sentence, StageFailed, connect,
};
use crate::domain::{
    Event, Failure, FailureClass, JobState, JobStatus, Stage, WorkerId, is_condemned, transition,
};

const PAIRS: usize = 6;
const DEADLINE: i64 = 1_000_000;

/// What a job should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Model {
    state: JobState,
    epoch: i64,
    crashes: u32,
}

struct Game {
    world: World,
    rng: ChaCha8Rng,
    model: BTreeMap<i64, Model>,
    /// Leases of living and of dead workers.
    leases: Vec<(Lease, WorkerId)>,
    worker: WorkerId,
    now: i64,
    /// Workers that died.
    deaths: u32,
}

impl Game {
    async fn new(seed: u64) -> Self {
        let world = World::new(PAIRS).await;
        let stage = Stage::Fit;
        let fresh = Model {
            state: JobState::Ready { stage },
            epoch: 0,
            crashes: 0,
        };
        Self {
            worker: world.worker,
            model: (1..=PAIRS as i64).map(|pair| (pair, fresh)).collect(),
            world,
            rng: ChaCha8Rng::seed_from_u64(seed),
            leases: Vec::new(),
            now: 100,
            deaths: 0,
        }
    }

    async fn step(&mut self) {
        self.now += self.rng.random_range(0..50);
        match self.rng.random_range(0..20) {
            0..6 => self.claim().await,
            6..13 => self.checkpoint().await,
            13..15 => self.fail().await,
            15 => self.release().await,
            16 => self.crash().await,
            17 => self.due().await,
            18 => self.send_back().await,
            _ => self.retry().await,
        }
    }

    /// Moves one pair of the model; what the machine refuses must not have happened.
    fn happens(&mut self, pair: i64, event: Event) {
        let model = self.model.get_mut(&pair).expect("the pair");
        model.state = transition(model.state, event).expect("the catalog allowed it");
    }

    fn holds(&self, lease: &Lease, worker: WorkerId) -> bool {
        let model = self.model[&lease.pair().0];
        let held =
            matches!(model.state, JobState::Leased { worker: holder, .. } if holder == worker);
        held && model.epoch == lease.epoch()
    }

    fn some_lease(&mut self) -> Option<(Lease, WorkerId)> {
        if self.leases.is_empty() {
            return None;
        }
        let index = self.rng.random_range(0..self.leases.len());
        Some(self.leases.swap_remove(index))
    }

    async fn claim(&mut self) {
        let request = ClaimRequest {
            worker: self.worker,
            slots: self.rng.random_range(1..3),
            until: Stage::Register,
            alone: self.rng.random_bool(0.4),
            among: None,
            deadline: DEADLINE,
            alive_since: 0,
        };
        for lease in self.world.catalog.claim(request).await.expect("a claim") {
            let pair = lease.pair().0;
            let event = Event::Claim {
                worker: self.worker,
                deadline: DEADLINE,
            };
            self.happens(pair, event);
            let model = self.model.get_mut(&pair).expect("the pair");
            model.epoch += 1;
            assert_eq!(model.epoch, lease.epoch());
            self.leases.push((lease, self.worker));
        }
    }

    async fn checkpoint(&mut self) {
        let Some((lease, worker)) = self.some_lease() else {
            return;
        };
        let (held, pair) = (self.holds(&lease, worker), lease.pair().0);
        // Now and then an earlier stage is done again, as when an artifact is gone.
        let back = self.rng.random_range(0..=lease.cursor().index());
        let redo = self.rng.random_bool(0.2);
        let stage = if redo {
            Stage::ALL[back]
        } else {
            lease.cursor()
        };
        let mut done = self.world.done(stage);
        done.next_deadline = DEADLINE;
        let kept = self
            .world
            .catalog
            .checkpoint(lease, done)
            .await
            .expect("an answer");
        assert_eq!(held, !matches!(kept, Kept::Lost));
        if held {
            let deadline = DEADLINE;
            self.happens(
                pair,
                Event::Checkpoint {
                    worker,
                    stage,
                    deadline,
                },
            );
            self.model.get_mut(&pair).expect("the pair").crashes = 0;
        }
        if let Kept::Lease(lease) = kept {
            self.leases.push((lease, worker));
        }
    }

    async fn fail(&mut self) {
        let Some((lease, worker)) = self.some_lease() else {
            return;
        };
        let (held, pair, stage) = (self.holds(&lease, worker), lease.pair().0, lease.cursor());
        let run_at = self.now + 70;
        let (sentence, event) = if self.rng.random_bool(0.5) {
            (
                Sentence::BackOff { run_at },
                Event::BackOff { worker, run_at },
            )
        } else {
            (Sentence::Quarantine, Event::Quarantine { worker })
        };
        let failed = StageFailed {
            stage,
            failure: Failure::new(FailureClass::Bug, "made up"),
            sentence,
            recipe: self.world.recipes.of(stage),
            facts: "{}".to_owned(),
            inputs: super::inputs(stage),
            ms: None,
            at: self.now,
            alive_since: 0,
        };
        let kept = self
            .world
            .catalog
            .fail(lease, failed)
            .await
            .expect("an answer");
        assert_eq!(held, kept);
        if held {
            self.happens(pair, event);
        }
    }

    async fn release(&mut self) {
        let Some((lease, worker)) = self.some_lease() else {
            return;
        };
        let (held, pair) = (self.holds(&lease, worker), lease.pair().0);
        assert_eq!(
            self.world.catalog.release(lease).await.expect("an answer"),
            held
        );
        if held {
            self.happens(pair, Event::Release { worker });
        }
    }

    /// The worker dies, another takes over; the dead one's leases stay in the game.
    async fn crash(&mut self) {
        let dead = self.worker;
        self.worker = register(&self.world.catalog).await;
        let rescue = self
            .world
            .catalog
            .rescue(Dead::AllBut(self.worker), self.now);
        rescue.await.expect("a rescue");
        let left = self.model.iter().filter(
            |(_, model)| matches!(model.state, JobState::Leased { worker, .. } if worker == dead),
        );
        let left: Vec<_> = left.map(|(pair, _)| *pair).collect();
        self.deaths += 1;
        for pair in &left {
            let blamed = left.len() == 1;
            let model = self.model.get_mut(pair).expect("the pair");
            model.epoch += 1;
            model.crashes += u32::from(blamed);
            let condemned = blamed && is_condemned(model.crashes, self.deaths.min(31));
            self.happens(*pair, Event::Rescue { condemned });
        }
    }

    async fn due(&mut self) {
        let due = self.world.catalog.stage_due(self.now, 1_000_000).await;
        let mut expected = 0;
        for model in self.model.values_mut() {
            if let Ok(next) = transition(model.state, Event::Due { now: self.now }) {
                (model.state, expected) = (next, expected + 1);
            }
        }
        assert_eq!(due.expect("stored"), expected);
    }

    async fn send_back(&mut self) {
        let stage = Stage::ALL[self.rng.random_range(0..4)];
        let recipes = recipes([1; 4]);
        let sent = self
            .world
            .catalog
            .send_back(&recipes, None, Again::All(stage));
        sent.await.expect("sent back");
        for model in self.model.values_mut() {
            if let Ok(next) = transition(model.state, Event::SendBack { stage }) {
                (model.state, model.crashes) = (next, 0);
            }
        }
    }

    async fn retry(&mut self) {
        let retried = self.world.catalog.retry(&RetrySelection::All).await;
        retried.expect("retried");
        for model in self.model.values_mut() {
            let failed = [JobStatus::Backoff, JobStatus::Quarantined];
            let Some(stage) = model.state.stage() else {
                continue;
            };
            if failed.contains(&model.state.status()) {
                let next = transition(model.state, Event::SendBack { stage });
                (model.state, model.crashes) = (next.expect("sent back"), 0);
            }
        }
    }

    /// Every row is what the model says, and the counters are right.
    async fn agrees(&self, conn: &mut sqlx::SqliteConnection) {
        let rows = sqlx::query("SELECT pair, stage, status, epoch, crashes, worker FROM job")
            .fetch_all(conn)
            .await
            .expect("a read");
        for row in rows {
            let pair: i64 = row.get("pair");
            let model = self.model[&pair];
            let stage: i64 = row.get("stage");
            let expected = model.state.stage().map_or(4, |stage| stage.index() as i64);
            let worker: Option<i64> = row.get("worker");
            let holder = match model.state {
                JobState::Leased { worker, .. } => Some(worker.0),
                _ => None,
            };
            assert_eq!(
                (
                    row.get::<i64, _>("status"),
                    stage,
                    row.get("epoch"),
                    row.get("crashes"),
                    worker
                ),
                (
                    model.state.status().code(),
                    expected,
                    model.epoch,
                    model.crashes,
                    holder
                ),
                "pair {pair}"
            );
        }
        self.world.counters_hold().await;
    }
}

#[tokio::test]
async fn random_events_leave_the_catalog_as_the_state_machine_says() {
    for seed in 0..4 {
        let mut game = Game::new(seed).await;
        let path = game.world.dir.path().join("catalog.sqlite");
        let mut conn = connect::writer(&path, false).await.expect("a connection");
        for _ in 0..200 {
            game.step().await;
            game.agrees(&mut conn).await;
        }
    }
}
