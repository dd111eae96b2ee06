//! A minimal model of the queue in memory. The SQL of the queue is tested against it.

use std::collections::BTreeMap;

use super::state_machine::{Event, JobState, transition};
use crate::lease_recovery::CRASH_LIMIT;
use crate::{FingerprintIds, Lease, RerunPolicy};
use mocban_core::domain::{JobStatus, Stage, UnixMillis, WorkerId};

/// How long a worker counts as alive without a heartbeat.
pub(super) const LEASE: i64 = 100;
/// How many of the newest workers are searched for deaths.
const LOOKED_AT: usize = 32;

/// Returns whether a pair with this number of crashes is quarantined after this number of recent worker deaths.
const fn is_poisoned(crashes: u32, deaths: u32) -> bool {
    crashes >= CRASH_LIMIT + deaths.saturating_sub(crashes + 1)
}

#[test]
fn the_third_crash_poisons_unless_others_died_too() {
    assert!(!is_poisoned(2, 2));
    assert!(is_poisoned(3, 3));
    // The first death was shared.
    assert!(is_poisoned(3, 4));
    // Two deaths the pair had no part in.
    assert!(!is_poisoned(3, 6));
    assert!(!is_poisoned(4, 7));
    assert!(is_poisoned(5, 8));
}

/// Expected state of a job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Job {
    pub(super) state: JobState,
    pub(super) token: i64,
    pub(super) attempt: u32,
    pub(super) crashes: u32,
    pub(super) exclusive: bool,
    /// Settings of each stage's result.
    results: [Option<FingerprintIds>; 4],
    /// Stage and settings of the failure.
    pub(super) failure: Option<(Stage, FingerprintIds)>,
}

/// A worker's process.
#[derive(Debug, Clone, Copy)]
pub(super) struct Process {
    pub(super) worker: WorkerId,
    /// Its clock, independent of other clocks.
    pub(super) clock: UnixMillis,
    pub(super) heartbeat: UnixMillis,
    pub(super) ended: bool,
    pub(super) died: bool,
    /// Whether the process runs, even if others consider it dead.
    pub(super) running: bool,
    pub(super) fingerprints: FingerprintIds,
}

impl Process {
    /// Returns whether its leases are valid, by its own clock.
    pub(super) const fn is_alive(&self) -> bool {
        !self.ended && self.heartbeat >= self.alive_since()
    }

    pub(super) const fn alive_since(&self) -> UnixMillis {
        self.clock - LEASE
    }
}

/// All jobs and processes.
#[derive(Debug, Default)]
pub(super) struct Queue {
    pub(super) jobs: BTreeMap<i64, Job>,
    pub(super) processes: Vec<Process>,
}

impl Job {
    const fn fresh() -> Self {
        Self {
            state: JobState::Ready { stage: Stage::Fit },
            token: 0,
            attempt: 0,
            crashes: 0,
            exclusive: false,
            results: [None; 4],
            failure: None,
        }
    }

    fn happens(&mut self, event: Event) {
        self.state = transition(self.state, event).expect("the model allows it");
    }

    /// Returns the first stage whose result has other settings than the current ones.
    fn changed(&self, current: FingerprintIds) -> Option<Stage> {
        let behind = |stage: &Stage| self.state.stage().is_none_or(|next| *stage < next);
        Stage::ALL.into_iter().filter(behind).find(|stage| {
            self.results[stage.index()].is_some_and(|then| then.of(*stage) != current.of(*stage))
        })
    }

    fn start_over(&mut self, stage: Stage) {
        self.happens(Event::Requeue { stage });
        (self.attempt, self.crashes, self.exclusive) = (0, 0, false);
        self.failure = None;
    }
}

impl Queue {
    pub(super) fn import(&mut self) {
        self.jobs.insert(self.jobs.len() as i64 + 1, Job::fresh());
    }

    fn job(&mut self, pair: i64) -> &mut Job {
        self.jobs.get_mut(&pair).expect("the pair")
    }

    fn of_worker(&self, worker: WorkerId) -> &Process {
        let mut processes = self.processes.iter();
        processes
            .find(|process| process.worker == worker)
            .expect("a process")
    }

    /// Returns whether a lease is the current one of its pair.
    pub(super) fn holds(&self, lease: &Lease) -> bool {
        let job = &self.jobs[&lease.pair().0];
        let held = |worker| matches!(job.state, JobState::Leased { worker: holder, .. } if holder == worker);
        held(lease.worker) && job.token == lease.token
    }

    /// Returns whether a write under a lease must be accepted.
    pub(super) fn stands(&self, lease: &Lease) -> bool {
        self.holds(lease) && self.of_worker(lease.worker).is_alive()
    }

    /// Returns the pairs that a claim may lease, in order.
    pub(super) fn claimable(&self, process: &Process, exclusive: bool) -> Vec<i64> {
        if !process.is_alive() {
            return Vec::new();
        }
        let mut leased = self.jobs.values();
        let blocks =
            |job: &Job| job.state.status() == JobStatus::Leased && (exclusive || job.exclusive);
        if leased.any(blocks) {
            return Vec::new();
        }
        let ready = self.jobs.iter().filter_map(|(pair, job)| match job.state {
            JobState::Ready { stage } if job.exclusive == exclusive => {
                Some((std::cmp::Reverse(stage), *pair))
            }
            _ => None,
        });
        let mut ready: Vec<_> = ready.collect();
        ready.sort_unstable();
        ready.into_iter().map(|(_, pair)| pair).collect()
    }

    /// Leases jobs; returns the pairs with their tokens, in order.
    pub(super) fn claim(
        &mut self,
        process: &Process,
        slots: usize,
        exclusive: bool,
        deadline: UnixMillis,
    ) -> Vec<(i64, i64)> {
        let mut pairs = self.claimable(process, exclusive);
        pairs.truncate(if exclusive { 1 } else { slots });
        self.take(process.worker, &pairs, deadline)
    }

    /// Leases these jobs; returns the pairs with their tokens.
    pub(super) fn take(
        &mut self,
        worker: WorkerId,
        pairs: &[i64],
        deadline: UnixMillis,
    ) -> Vec<(i64, i64)> {
        let take = |pair: &i64| {
            let job = self.job(*pair);
            job.happens(Event::Claim { worker, deadline });
            job.token += 1;
            job.attempt += 1;
            (*pair, job.token)
        };
        pairs.iter().map(take).collect()
    }

    pub(super) fn checkpoint(&mut self, lease: &Lease, stage: Stage, deadline: UnixMillis) {
        let (worker, fingerprints) = (lease.worker, self.of_worker(lease.worker).fingerprints);
        let job = self.job(lease.pair().0);
        job.happens(Event::Checkpoint {
            worker,
            stage,
            deadline,
        });
        (job.attempt, job.crashes, job.exclusive) = (1, 0, false);
        job.results[stage.index()] = Some(fingerprints);
        job.failure = None;
    }

    /// Stores a failure. `back_off` is the time of the next attempt. `exclusive` makes the pair ready for an exclusive
    /// run. If neither is set, quarantines the pair.
    pub(super) fn fail(&mut self, lease: &Lease, back_off: Option<UnixMillis>, exclusive: bool) {
        let (worker, fingerprints) = (lease.worker, self.of_worker(lease.worker).fingerprints);
        let job = self.job(lease.pair().0);
        if exclusive {
            job.happens(Event::Release { worker });
            job.exclusive = true;
            return;
        }
        job.happens(match back_off {
            Some(run_at) => Event::BackOff { worker, run_at },
            None => Event::Quarantine { worker },
        });
        job.failure = Some((lease.cursor(), fingerprints));
    }

    pub(super) fn release(&mut self, lease: &Lease) {
        let worker = lease.worker;
        let job = self.job(lease.pair().0);
        job.happens(Event::Release { worker });
        job.attempt = job.attempt.saturating_sub(1);
    }

    /// Recovers the leases of workers that are considered dead. Returns the number of pairs made ready.
    pub(super) fn recover(&mut self, dead: &[WorkerId]) -> u64 {
        for process in &mut self.processes {
            process.died |= dead.contains(&process.worker) && !process.ended;
        }
        let newest = self.processes.iter().rev().take(LOOKED_AT);
        let deaths = newest.filter(|process| process.died && !process.ended);
        let deaths = deaths.count() as u32;
        let mut ready = 0;
        for worker in dead {
            let (died, fingerprints) = (
                !self.of_worker(*worker).ended,
                self.of_worker(*worker).fingerprints,
            );
            let left: Vec<_> = self.leased_by(*worker);
            let blamed = died && left.len() == 1;
            for pair in left {
                let job = self.job(pair);
                job.crashes += u32::from(blamed);
                job.exclusive |= died;
                let poisoned = blamed && is_poisoned(job.crashes, deaths);
                ready += u64::from(!poisoned);
                job.taken_back(poisoned, fingerprints);
            }
        }
        ready
    }

    fn leased_by(&self, wanted: WorkerId) -> Vec<i64> {
        let leased =
            |job: &Job| matches!(job.state, JobState::Leased { worker, .. } if worker == wanted);
        let jobs = self.jobs.iter().filter(|(_, job)| leased(job));
        jobs.map(|(pair, _)| *pair).collect()
    }

    /// Recovers each lease whose deadline is more than `margin` milliseconds before its worker's last heartbeat. Skips
    /// the leases of `me`. Returns the number of pairs made ready.
    pub(super) fn recover_overdue(&mut self, me: WorkerId, margin: i64) -> u64 {
        let mut ready = 0;
        for process in self.processes.clone() {
            for pair in self.leased_by(process.worker) {
                let job = self.job(pair);
                let late = matches!(job.state, JobState::Leased { deadline, .. } if deadline + margin < process.heartbeat);
                if late && process.worker != me {
                    job.crashes += 1;
                    job.exclusive = true;
                    let poisoned = is_poisoned(job.crashes, job.crashes);
                    ready += u64::from(!poisoned);
                    job.taken_back(poisoned, process.fingerprints);
                }
            }
        }
        ready
    }

    /// Ends back-offs that are due, or implausibly far in the future.
    pub(super) fn due(&mut self, now: UnixMillis, longest_ms: i64) -> u64 {
        let mut due = 0;
        for job in self.jobs.values_mut() {
            if let Ok(state) = transition(job.state, Event::Due { now, longest_ms }) {
                job.state = state;
                due += 1;
            }
        }
        due
    }

    /// Requeues jobs whose results or failure have outdated settings. If `again` requests it, requeues all jobs.
    pub(super) fn requeue_stale(&mut self, current: FingerprintIds, again: RerunPolicy) -> u64 {
        let mut sent = 0;
        for job in self.jobs.values_mut() {
            if job.state.status() == JobStatus::Leased {
                continue;
            }
            let at = job.state.stage();
            let asked = match again {
                RerunPolicy::All(from) => Some(at.map_or(from, |at| at.min(from))),
                RerunPolicy::Changed | RerunPolicy::Failed => None,
            };
            let failed_otherwise = job.state.status() == JobStatus::Quarantined
                && job
                    .failure
                    .is_some_and(|(stage, then)| then.of(stage) != current.of(stage));
            let to = job.changed(current).into_iter().chain(asked).min();
            if let Some(stage) = to.or(at.filter(|_| failed_otherwise)) {
                job.start_over(stage);
                sent += 1;
            }
        }
        sent
    }

    pub(super) fn retry(&mut self) -> u64 {
        let mut taken_up = 0;
        for job in self.jobs.values_mut() {
            let failed = [JobStatus::Backoff, JobStatus::Quarantined];
            if let Some(stage) = job.state.stage()
                && failed.contains(&job.state.status())
            {
                job.start_over(stage);
                taken_up += 1;
            }
        }
        taken_up
    }
}

impl Job {
    fn taken_back(&mut self, poisoned: bool, fingerprints: FingerprintIds) {
        let stage = self.state.stage().expect("it is leased");
        self.token += 1;
        self.attempt = self.attempt.saturating_sub(1);
        self.happens(Event::Recover { poisoned });
        if poisoned {
            self.failure = Some((stage, fingerprints));
        }
    }
}
