//! Random histories of several processes, played on the catalog and on the model: both must always say the same.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use sqlx::{AssertSqlSafe, Row as _, SqliteConnection};

use super::model::{LEASE, Process, Queue};
use super::{World, done, inputs, name, recipes, row};
use crate::catalog::{
    Again, ClaimRequest, Dead, Kept, Lease, NewVerdict, RecipeIds, Recipes, RetrySelection,
    Sentence, StageFailed, WorkerInfo, connect,
};
use crate::domain::{Failure, FailureClass, JobState, JobStatus, Stage, ThresholdMetric, Verdict};

/// Pairs at first, and at most.
const PAIRS: usize = 5;
const MOST_PAIRS: usize = 8;
/// No back-off is longer.
const LONGEST: i64 = 200;
/// Tables that no refused write may touch.
const TABLES: [&str; 8] = [
    "job",
    "stage_result",
    "metric_result",
    "attempt",
    "failure",
    "verdict",
    "counter",
    "pair",
];

struct Game {
    world: World,
    conn: SqliteConnection,
    dice: ChaCha8Rng,
    model: Queue,
    /// Leases as their holders have them: also of the dead, and of those who do not know that they are taken for dead.
    leases: Vec<Lease>,
    /// The wall clock that the next process and the back-offs look at; it jumps.
    wall: i64,
    settings: (Recipes, RecipeIds),
    verdicts: Vec<i64>,
    epochs: Vec<i64>,
    seen: Seen,
}

/// How often what is hard came up; a history without it proves nothing.
#[derive(Debug, Default, Clone, Copy)]
struct Seen {
    /// Writes under a lease that somebody else has taken back.
    fenced: u32,
    /// Writes under a lease that is over, though nobody has taken it back.
    late: u32,
    condemned: u32,
    overdue: u64,
}

impl Game {
    async fn new(seed: u64) -> Self {
        let world = World::new(PAIRS).await;
        let path = world.dir.path().join("catalog.sqlite");
        let conn = connect::writer(&path, false).await.expect("a connection");
        let mut game = Self {
            settings: (recipes([1; 4]), world.recipes),
            conn,
            world,
            dice: ChaCha8Rng::seed_from_u64(seed),
            model: Queue::default(),
            leases: Vec::new(),
            wall: 10_000,
            verdicts: Vec::new(),
            epochs: vec![0; MOST_PAIRS + 1],
            seen: Seen::default(),
        };
        // The world's own worker takes no part.
        game.world
            .catalog
            .end_worker(game.world.worker, 1)
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
            24..27 => self.beat().await,
            27..30 => self.time_passes(),
            30 => self.join().await,
            31 => self.end().await,
            32 => self.crash(),
            33 => self.rescue().await,
            34 => self.take_over().await,
            35 => self.due().await,
            36 => self.send_back().await,
            37 => self.retry().await,
            38 => self.import().await,
            39 => self.poison().await,
            _ => self.verdict().await,
        }
    }

    fn is_likely(&mut self, chance: f64) -> bool {
        self.dice.random_bool(chance)
    }

    /// A process that can do something; it may have been taken for dead and not know it.
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
        let info = WorkerInfo {
            host: "here".to_owned(),
            pid: 1,
            boot_id: None,
        };
        let (recipes, clock) = (self.settings.1, self.wall);
        let entered = self.world.catalog.register_worker(info, recipes, clock);
        self.model.processes.push(Process {
            worker: entered.await.expect("a worker"),
            clock,
            beat: clock,
            ended: false,
            died: false,
            running: true,
            recipes,
        });
    }

    /// One process's time, while the others' stand still: no two clocks go together.
    fn time_passes(&mut self) {
        let ms = self.dice.random_range(0..LEASE);
        if let Some(index) = self.somebody() {
            self.model.processes[index].clock += ms;
        }
    }

    async fn beat(&mut self) {
        if let Some(index) = self.somebody() {
            self.beat_of(index).await;
        }
    }

    async fn beat_of(&mut self, index: usize) {
        let process = &mut self.model.processes[index];
        let (now, since) = (process.clock, process.alive_since());
        let beat = self.world.catalog.beat(process.worker, now, since).await;
        assert_eq!(beat.expect("an answer"), process.is_alive());
        if process.is_alive() {
            process.beat = now;
        }
    }

    async fn claim(&mut self) {
        let (slots, alone) = (self.dice.random_range(1..3), self.is_likely(0.4));
        if let Some(index) = self.somebody() {
            self.claim_by(index, slots, alone).await;
        }
    }

    async fn claim_by(&mut self, index: usize, slots: usize, alone: bool) {
        let process = self.model.processes[index];
        let deadline = process.clock + self.dice.random_range(0..LEASE / 2);
        let request = ClaimRequest {
            worker: process.worker,
            slots,
            until: Stage::Register,
            alone,
            among: None,
            deadline,
            alive_since: process.alive_since(),
        };
        let taken = self.world.catalog.claim(request).await.expect("a claim");
        let expected = self.model.claim(&process, slots, alone, deadline);
        let found: Vec<_> = taken
            .iter()
            .map(|lease| (lease.pair().0, lease.epoch()))
            .collect();
        assert_eq!(found, expected);
        self.leases.extend(taken);
    }

    /// Whether a write under a lease is to be taken.
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
        // Now and then an earlier stage is done again, as when an artifact is gone.
        let again = self.is_likely(0.2);
        let earlier = self.dice.random_range(0..=lease.cursor().index());
        let stage = if again {
            Stage::ALL[earlier]
        } else {
            lease.cursor()
        };
        let mut done = done(process.recipes, stage);
        done.alive_since = process.alive_since();
        done.next_deadline = process.clock + self.dice.random_range(0..LEASE / 2);
        let before = self.dump(stands).await;
        if stands {
            self.model.checkpoint(&lease, stage, done.next_deadline);
        }
        let kept = self
            .world
            .catalog
            .checkpoint(lease, done)
            .await
            .expect("an answer");
        assert_eq!(stands, !matches!(kept, Kept::Lost));
        if let Kept::Lease(lease) = kept {
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
        let sentence = match self.dice.random_range(0..3) {
            0 => Sentence::BackOff { run_at },
            1 => Sentence::Alone,
            _ => Sentence::Quarantine,
        };
        let failed = StageFailed {
            stage,
            failure: Failure::new(FailureClass::Bug, "made up"),
            sentence,
            recipe: process.recipes.of(stage),
            facts: done(process.recipes, stage).facts,
            inputs: inputs(stage),
            ms: None,
            at: process.clock,
            alive_since: process.alive_since(),
        };
        let before = self.dump(stands).await;
        if stands {
            let back_off = (sentence == Sentence::BackOff { run_at }).then_some(run_at);
            self.model
                .fail(&lease, back_off, sentence == Sentence::Alone);
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

    async fn end(&mut self) {
        let Some(index) = self.somebody() else { return };
        let process = &mut self.model.processes[index];
        (process.ended, process.running) = (true, false);
        let ended = self.world.catalog.end_worker(process.worker, process.clock);
        ended.await.expect("ended");
    }

    /// A process dies; nobody knows yet.
    fn crash(&mut self) {
        if let Some(index) = self.somebody() {
            self.model.processes[index].running = false;
        }
    }

    /// Somebody takes another for dead, rightly or not, or finds its deadlines long past.
    async fn rescue(&mut self) {
        let (Some(me), now) = (self.somebody(), self.wall) else {
            return;
        };
        let me = self.model.processes[me].worker;
        let other = self.dice.random_range(0..self.model.processes.len());
        let other = self.model.processes[other].worker;
        let rescued = if self.is_likely(0.5) && other != me {
            let rescue = self.world.catalog.rescue(Dead::Workers(vec![other]), now);
            (rescue.await, self.model.rescue(&[other]))
        } else {
            if let Some(index) = self.somebody() {
                self.model.processes[index].clock += LEASE / 2;
                self.beat_of(index).await;
            }
            let overdue = self.world.catalog.rescue_overdue(me, 10, now);
            let expected = self.model.rescue_overdue(me, 10);
            self.seen.overdue += expected;
            (overdue.await, expected)
        };
        let found = rescued.0.expect("a rescue");
        assert_eq!(found.ready, rescued.1);
        self.seen.condemned += found.condemned.len() as u32;
    }

    /// All processes die; a new one opens the catalog alone.
    async fn take_over(&mut self) {
        for process in &mut self.model.processes {
            process.running = false;
        }
        self.join().await;
        let (me, others) = self.model.processes.split_last().expect("it joined");
        let (me, others) = (me.worker, others.iter().map(|other| other.worker));
        let others: Vec<_> = others.collect();
        let rescue = self.world.catalog.rescue(Dead::AllBut(me), self.wall);
        let rescued = rescue.await.expect("a rescue");
        assert_eq!(rescued.ready, self.model.rescue(&others));
        self.seen.condemned += rescued.condemned.len() as u32;
        assert!(
            self.model
                .jobs
                .values()
                .all(|job| job.state.status() != JobStatus::Leased)
        );
    }

    /// A pair kills one process after the other.
    async fn poison(&mut self) {
        let before = self.seen.condemned;
        for round in 0..8 {
            self.take_over().await;
            let me = self.model.processes.len() - 1;
            self.claim_by(me, 1, round > 0).await;
            if self.seen.condemned > before {
                return;
            }
        }
    }

    /// The wall clock jumps, forward or back.
    async fn due(&mut self) {
        self.wall += self.dice.random_range(-300..300);
        let due = self.world.catalog.stage_due(self.wall, LONGEST).await;
        assert_eq!(due.expect("stored"), self.model.due(self.wall, LONGEST));
    }

    async fn send_back(&mut self) {
        let mut again = Again::Changed;
        if self.is_likely(0.7) {
            let revisions = [1; 4].map(|one: u32| one + self.dice.random_range(0..2));
            let new = recipes(revisions);
            let ids = self.world.catalog.register_recipes(&new).await;
            self.settings = (new, ids.expect("recipes"));
        } else {
            again = Again::All(Stage::ALL[self.dice.random_range(0..4)]);
        }
        let (recipes, ids) = &self.settings;
        let sent = self.world.catalog.send_back(recipes, None, again).await;
        assert_eq!(sent.expect("sent back"), self.model.send_back(*ids, again));
    }

    async fn retry(&mut self) {
        let retried = self.world.catalog.retry(&RetrySelection::All).await;
        assert_eq!(retried.expect("retried"), self.model.retry());
    }

    async fn import(&mut self) {
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

    async fn verdict(&mut self) {
        let pair = self.dice.random_range(1..=self.model.jobs.len());
        if self.model.jobs[&(pair as i64)].state != JobState::Done {
            return;
        }
        let verdict = NewVerdict {
            pair: name(&format!("p{}", pair - 1)),
            metric: Some(ThresholdMetric::Density),
            verdict: Verdict::Pass,
            reader: "ana".to_owned(),
            reason: None,
            note: None,
        };
        let stored = self.world.catalog.verdict_set(vec![verdict], self.wall);
        stored.await.expect("stored");
        self.verdicts.push(self.verdicts.len() as i64 + 1);
    }

    /// Everything that a write could change, when the write is to be refused; nothing when it is not.
    async fn dump(&mut self, allowed: bool) -> Vec<String> {
        let mut lines = Vec::new();
        for table in TABLES.iter().filter(|_| !allowed) {
            let columns: String = sqlx::query_scalar(
                "SELECT group_concat('quote(' || name || ')', ' || '' '' || ') FROM pragma_table_info(?1)",
            )
            .bind(table)
            .fetch_one(&mut self.conn)
            .await
            .expect("columns");
            let rows = sqlx::query_scalar(AssertSqlSafe(format!(
                "SELECT {columns} FROM {table} ORDER BY 1"
            )));
            lines.extend(rows.fetch_all(&mut self.conn).await.expect("rows"));
        }
        lines
    }

    /// Every row is what the model says, no epoch falls, the counters are right, no verdict is lost.
    async fn agrees(&mut self) {
        let rows = sqlx::query(
            "SELECT pair, stage, status, epoch, attempt, crashes, mem_class, worker, deadline, run_at FROM job ORDER BY pair",
        );
        let rows = rows.fetch_all(&mut self.conn).await.expect("a read");
        assert_eq!(rows.len(), self.model.jobs.len());
        for (row, (pair, job)) in rows.iter().zip(&self.model.jobs) {
            let (mut holder, mut when, mut run_at) = (None, None, None);
            match job.state {
                JobState::Leased {
                    worker, deadline, ..
                } => {
                    (holder, when) = (Some(worker.0), Some(deadline));
                }
                JobState::Backoff { run_at: at, .. } => run_at = Some(at),
                JobState::Ready { .. }
                | JobState::Done
                | JobState::Quarantined { .. }
                | JobState::Held { .. } => {}
            }
            let number = |column: &str| row.get::<i64, _>(column);
            let stage = job.state.stage().map_or(4, |stage| stage.index() as i64);
            assert_eq!(
                (number("pair"), number("stage"), number("status")),
                (*pair, stage, job.state.status().code())
            );
            assert_eq!(
                (
                    number("epoch"),
                    number("attempt"),
                    number("crashes"),
                    number("mem_class")
                ),
                (
                    job.epoch,
                    i64::from(job.attempt),
                    i64::from(job.crashes),
                    i64::from(job.alone)
                ),
                "pair {pair}"
            );
            assert_eq!(
                (row.get("worker"), row.get("deadline"), row.get("run_at")),
                (holder, when, run_at),
                "pair {pair}"
            );
            assert!(job.epoch >= self.epochs[*pair as usize]);
            self.epochs[*pair as usize] = job.epoch;
        }
        self.world.counters_hold().await;
        let log = self.world.catalog.verdict_log(None).await.expect("a log");
        let kept: Vec<_> = log.iter().map(|event| event.id).collect();
        assert_eq!(kept, self.verdicts);
    }
}

#[tokio::test]
async fn random_histories_leave_the_catalog_as_the_model_says() {
    let mut all = Seen::default();
    for seed in 0..6 {
        let mut game = Game::new(seed).await;
        for _ in 0..300 {
            game.step().await;
            game.agrees().await;
        }
        all.fenced += game.seen.fenced;
        all.late += game.seen.late;
        all.condemned += game.seen.condemned;
        all.overdue += game.seen.overdue;
    }
    assert!(all.fenced > 50 && all.late > 10, "{all:?}");
    assert!(all.condemned > 0 && all.overdue > 0, "{all:?}");
}
