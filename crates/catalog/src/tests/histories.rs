//! Applies random events of several processes to the catalog and to the model. Both must always agree.

mod compare;
mod upkeep;

use crate::db::conn::Conn;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::model::{LEASE, Process, Queue};
use super::{CatalogPlace, World, done, enter, fingerprints, inputs};
use crate::{
    Catalog, CheckpointOutcome, ClaimRequest, FailureAction, FingerprintIds, Fingerprints, Lease,
    StageFailure,
};
use mocban_core::domain::{Failure, FailureClass, Stage};

/// Number of pairs at the start of a history.
const PAIRS: usize = 5;
/// Largest number of pairs.
const MOST_PAIRS: usize = 8;
/// Longest back-off.
const LONGEST: i64 = 200;
struct Game {
    world: World,
    /// The catalog as another computer sees it. It only claims.
    elsewhere: Catalog,
    conn: Conn,
    dice: ChaCha8Rng,
    model: Queue,
    /// Leases that processes hold or believe to hold.
    leases: Vec<Lease>,
    /// Wall clock in ms, which new processes start with and which ends back-offs. It jumps forward and back.
    wall: i64,
    settings: (Fingerprints, FingerprintIds),
    verdicts: Vec<i64>,
    tokens: Vec<i64>,
    seen: Seen,
}

/// Counts of difficult situations. A history without them proves nothing.
#[derive(Debug, Default, Clone, Copy)]
struct Seen {
    /// Writes under a lease that another process has recovered.
    fenced: u32,
    /// Writes under an expired lease that nobody has recovered yet.
    late: u32,
    poisoned: u32,
    overdue: u64,
    /// Claims that did not lease the first pairs.
    out_of_order: u32,
}

impl Game {
    async fn new(seed: u64) -> Self {
        let world = World::new(PAIRS).await;
        let conn = world.place.conn().await;
        let mut game = Self {
            elsewhere: world.place.open().await.expect("the catalog"),
            settings: (fingerprints([1; 4]), world.fingerprints),
            conn,
            world,
            dice: ChaCha8Rng::seed_from_u64(seed),
            model: Queue::default(),
            leases: Vec::new(),
            wall: 10_000,
            verdicts: Vec::new(),
            tokens: vec![0; MOST_PAIRS + 1],
            seen: Seen::default(),
        };
        // The worker of `World` is not used.
        game.world
            .catalog
            .end_worker(game.world.worker, 1, None)
            .await
            .expect("ended");
        (0..PAIRS).for_each(|_| game.model.import());
        game.join().await;
        game
    }

    async fn step(&mut self) {
        match self.dice.random_range(0..41) {
            0..9 => self.claim().await,
            9..20 => self.checkpoint().await,
            20..23 => self.fail().await,
            23 => self.release().await,
            24..27 => self.heartbeat().await,
            27..30 => self.time_passes(),
            30 => self.join().await,
            31 => self.end().await,
            32 => self.crash(),
            33 => self.recover().await,
            34 => self.take_over().await,
            35 => self.due().await,
            36 => self.requeue_stale().await,
            37 => self.retry().await,
            38 => self.import().await,
            39 => self.poison().await,
            _ => self.verdict().await,
        }
    }

    fn is_likely(&mut self, chance: f64) -> bool {
        self.dice.random_bool(chance)
    }

    /// Picks a running process, even if others consider it dead.
    fn somebody(&mut self) -> Option<usize> {
        let running = |index: &usize| self.model.processes[*index].running;
        let running: Vec<_> = (0..self.model.processes.len()).filter(running).collect();
        let index = self.dice.random_range(0..running.len().max(1));
        running.get(index).copied()
    }

    fn some_lease(&mut self) -> Option<Lease> {
        let index = self.dice.random_range(0..self.leases.len().max(1));
        (index < self.leases.len()).then(|| self.leases.swap_remove(index))
    }

    fn process(&mut self, lease: &Lease) -> &mut Process {
        let mut processes = self.model.processes.iter_mut();
        processes
            .find(|process| process.worker == lease.worker)
            .expect("a process")
    }

    async fn join(&mut self) {
        self.wall += self.dice.random_range(-5_000..5_000);
        let (fingerprints, clock) = (self.settings.1, self.wall);
        self.model.processes.push(Process {
            worker: enter(&self.world.catalog, fingerprints, clock).await,
            clock,
            heartbeat: clock,
            ended: false,
            died: false,
            running: true,
            fingerprints,
        });
    }

    /// Advances the clock of one process, because no two clocks agree.
    fn time_passes(&mut self) {
        let ms = self.dice.random_range(0..LEASE);
        if let Some(index) = self.somebody() {
            self.model.processes[index].clock += ms;
        }
    }

    async fn heartbeat(&mut self) {
        if let Some(index) = self.somebody() {
            self.heartbeat_of(index).await;
        }
    }

    async fn heartbeat_of(&mut self, index: usize) {
        let process = &mut self.model.processes[index];
        let (now, since) = (process.clock, process.alive_since());
        let heartbeat = self
            .world
            .catalog
            .heartbeat(process.worker, now, since, None)
            .await;
        assert_eq!(heartbeat.expect("an answer"), process.is_alive());
        if process.is_alive() {
            process.heartbeat = now;
        }
    }

    async fn claim(&mut self) {
        let (slots, exclusive) = (self.dice.random_range(1..3), self.is_likely(0.4));
        let is_elsewhere = self.is_likely(0.4);
        if let Some(index) = self.somebody() {
            if is_elsewhere {
                self.claim_elsewhere(index, slots, exclusive).await;
            } else {
                self.claim_by(index, slots, exclusive).await;
            }
        }
    }

    async fn claim_by(&mut self, index: usize, slots: usize, exclusive: bool) {
        let (process, request) = self.claim_request(index, slots, exclusive);
        let deadline = request.deadline;
        let taken = self.world.catalog.claim(request).await.expect("a claim");
        let expected = self.model.claim(&process, slots, exclusive, deadline);
        assert_eq!(pairs_and_tokens(&taken), expected);
        self.leases.extend(taken);
    }

    /// Claims where releases and other changes are not noticed. Finds as many pairs, but not always the first ones, and
    /// on a server perhaps not with the first claim.
    async fn claim_elsewhere(&mut self, index: usize, slots: usize, exclusive: bool) {
        let (process, request) = self.claim_request(index, slots, exclusive);
        let claimable = self.model.claimable(&process, exclusive);
        let wanted = claimable.len().min(request.slots);
        let mut taken = self.claims_elsewhere(request.clone()).await;
        if taken.len() < wanted {
            let any = self
                .elsewhere
                .in_transaction(|_| Box::pin(async { Ok(()) }));
            any.await.expect("an empty transaction");
            let rest = ClaimRequest {
                slots: wanted - taken.len(),
                ..request.clone()
            };
            taken.extend(self.claims_elsewhere(rest).await);
        }
        let found = pairs_and_tokens(&taken);
        let pairs: Vec<_> = found.iter().map(|(pair, _)| *pair).collect();
        assert!(pairs.iter().all(|pair| claimable.contains(pair)));
        assert_eq!(pairs.len(), wanted);
        self.seen.out_of_order += u32::from(pairs != claimable[..wanted]);
        let expected = self.model.take(process.worker, &pairs, request.deadline);
        assert_eq!(found, expected);
        self.leases.extend(taken);
    }

    async fn claims_elsewhere(&self, request: ClaimRequest) -> Vec<Lease> {
        self.elsewhere.claim(request).await.expect("a claim")
    }

    fn claim_request(
        &mut self,
        index: usize,
        slots: usize,
        exclusive: bool,
    ) -> (Process, ClaimRequest) {
        let process = self.model.processes[index];
        let deadline = process.clock + self.dice.random_range(0..LEASE / 2);
        let request = ClaimRequest {
            exclusive,
            alive_since: process.alive_since(),
            ..ClaimRequest::new(process.worker, if exclusive { 1 } else { slots }, deadline)
        };
        (process, request)
    }

    /// Returns whether a write under a lease must be accepted.
    fn stands(&mut self, lease: &Lease) -> bool {
        let (holds, stands) = (self.model.holds(lease), self.model.stands(lease));
        self.seen.fenced += u32::from(!holds);
        self.seen.late += u32::from(holds && !stands);
        stands
    }

    async fn checkpoint(&mut self) {
        let Some(lease) = self.some_lease() else {
            return;
        };
        let (stands, process) = (self.stands(&lease), *self.process(&lease));
        // Sometimes compute an earlier stage again, as a worker does after an artifact was lost.
        let again = self.is_likely(0.2);
        let earlier = self.dice.random_range(0..=lease.cursor().index());
        let stage = if again {
            Stage::ALL[earlier]
        } else {
            lease.cursor()
        };
        let mut done = done(process.fingerprints, stage);
        done.alive_since = process.alive_since();
        done.next_deadline = process.clock + self.dice.random_range(0..LEASE / 2);
        let before = self.dump(stands).await;
        if stands {
            self.model.checkpoint(&lease, stage, done.next_deadline);
        }
        let kept = self
            .world
            .catalog
            .checkpoint_now(lease, done)
            .await
            .expect("an answer");
        assert_eq!(stands, !matches!(kept, CheckpointOutcome::Refused));
        if let CheckpointOutcome::Lease(lease) = kept {
            self.leases.push(lease);
        }
        assert_eq!(before, self.dump(stands).await);
    }

    async fn fail(&mut self) {
        let Some(lease) = self.some_lease() else {
            return;
        };
        let (stands, process) = (self.stands(&lease), *self.process(&lease));
        let stage = lease.cursor();
        let run_at = self.wall + self.dice.random_range(0..LONGEST);
        let action = match self.dice.random_range(0..3) {
            0 => FailureAction::BackOff { run_at },
            1 => FailureAction::RetryExclusive,
            _ => FailureAction::Quarantine,
        };
        let failed = StageFailure {
            stage,
            failure: Failure::new(FailureClass::Bug, "made up"),
            action,
            provenance: done(process.fingerprints, stage).provenance,
            inputs: inputs(stage),
            ms: None,
            at: process.clock,
            alive_since: process.alive_since(),
        };
        let before = self.dump(stands).await;
        if stands {
            let back_off = (action == FailureAction::BackOff { run_at }).then_some(run_at);
            self.model
                .fail(&lease, back_off, action == FailureAction::RetryExclusive);
        }
        let kept = self
            .world
            .catalog
            .fail(lease, failed)
            .await
            .expect("an answer");
        assert_eq!(stands, kept);
        assert_eq!(before, self.dump(stands).await);
    }

    async fn release(&mut self) {
        let Some(lease) = self.some_lease() else {
            return;
        };
        let held = self.model.holds(&lease);
        let before = self.dump(held).await;
        if held {
            self.model.release(&lease);
        }
        assert_eq!(
            self.world.catalog.release(lease).await.expect("an answer"),
            held
        );
        assert_eq!(before, self.dump(held).await);
    }
}

fn pairs_and_tokens(leases: &[Lease]) -> Vec<(i64, i64)> {
    let ids = leases.iter().map(|lease| (lease.pair().0, lease.token));
    ids.collect()
}

#[tokio::test]
async fn random_histories_agree_with_the_model() {
    let mut all = Seen::default();
    for seed in 0..6 {
        let mut game = Game::new(seed).await;
        for _ in 0..300 {
            game.step().await;
            game.agrees().await;
        }
        all.fenced += game.seen.fenced;
        all.late += game.seen.late;
        all.poisoned += game.seen.poisoned;
        all.overdue += game.seen.overdue;
        all.out_of_order += game.seen.out_of_order;
    }
    assert!(all.fenced > 50 && all.late > 10, "{all:?}");
    assert!(all.poisoned > 0 && all.overdue > 0, "{all:?}");
    // Only claims on a server begin behind earlier ones.
    let is_shared = matches!(CatalogPlace::new(), CatalogPlace::Url(_));
    assert_eq!(all.out_of_order > 0, is_shared, "{all:?}");
}
