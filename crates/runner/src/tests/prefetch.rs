//! Tests of pairs that are claimed ahead, and of stages that are computed while others are being stored.

use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::timeout;

use super::{RunFixture, name, options};
use crate::run_context::Clock;
use crate::{RunEvent, RunOptions, StopLevel};
use mocban_catalog::{Catalog, DeadWorker, Lease};
use mocban_core::domain::{JobStatus, PairId, PairName, Stage, WorkerId};

impl RunFixture {
    /// Creates a fixture whose catalog delays every deferrable commit until a flush.
    async fn patient(pairs: &[&str]) -> Self {
        Self::with(pairs, async |path| Catalog::create_patient(path).await).await
    }

    /// Waits until a stage of a pair has started.
    async fn started(&self, pair: &str, stage: Stage) {
        while self.pairs.count(pair, stage) == 0 {
            tokio::task::yield_now().await;
        }
    }

    /// Returns the index of the first event that matches.
    fn position(&self, matches: impl Fn(&RunEvent) -> bool) -> Option<usize> {
        let events = self.events.lock().expect("an unpoisoned lock");
        events.iter().position(matches)
    }
}

fn started(event: &RunEvent, wanted: Stage) -> bool {
    matches!(event, RunEvent::StageStarted { stage, .. } if *stage == wanted)
}

fn finished(event: &RunEvent, wanted: Stage) -> bool {
    matches!(event, RunEvent::StageFinished { stage, .. } if *stage == wanted)
}

#[tokio::test]
async fn stages_are_computed_while_earlier_ones_are_stored_and_reported_when_stored() {
    let fixture = RunFixture::new(&["wait_1"]).await;
    let hold = async {
        fixture.started("wait_1", Stage::Fit).await;
        let release = fixture.catalog.hold().await;
        fixture.pairs.open();
        fixture.started("wait_1", Stage::Register).await;
        assert_eq!(fixture.position(|event| finished(event, Stage::Fit)), None);
        release.send(()).expect("the writer waits");
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(fixture.run(&options), hold);
    assert_eq!((summary.done, summary.stages), (1, 4));
    let reported = Stage::ALL.map(|stage| fixture.position(|event| finished(event, stage)));
    assert!(
        reported.is_sorted() && reported[0].is_some(),
        "{reported:?}"
    );
    assert!(fixture.position(|event| started(event, Stage::Register)) < reported[0]);
    let detail = fixture.catalog.pair(&name("wait_1")).await.expect("a read");
    assert_eq!(detail.expect("the pair").attempts.len(), 4);
}

#[tokio::test]
async fn finished_stages_are_stored_while_a_long_stage_is_computed() {
    let fixture = RunFixture::new(&["lasts_1"]).await;
    let look = async {
        fixture.started("lasts_1", Stage::Register).await;
        let stored = async {
            while fixture
                .position(|event| finished(event, Stage::Normalize))
                .is_none()
            {
                tokio::task::yield_now().await;
            }
        };
        let stored = timeout(Duration::from_mins(10), stored).await;
        let detail = fixture.catalog.pair(&name("lasts_1")).await;
        fixture.pairs.open();
        assert!(stored.is_ok(), "it is stored only at the end");
        assert_eq!(detail.expect("a read").expect("the pair").attempts.len(), 3);
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(fixture.run(&options), look);
    assert_eq!((summary.done, summary.stages), (1, 4));
}

/// This timeout is shorter than the heartbeat interval of tests, because a heartbeat ends the delay of commits.
const SOON: Duration = Duration::from_mins(10);

#[tokio::test]
async fn stages_are_stored_at_once_when_the_lease_is_needed_to_store_a_failure() {
    let fixture = RunFixture::patient(&["breaks_1"]).await;
    let options = options(1);
    let ended = timeout(SOON, fixture.run(&options)).await;
    assert_eq!(ended.expect("no timeout").done, 1);
    assert_eq!(fixture.pairs.count("breaks_1", Stage::Depth), 2);
}

#[tokio::test]
async fn a_stage_computed_after_the_lease_was_lost_is_not_stored() {
    let fixture = RunFixture::new(&["wait_1"]).await;
    let take_lease = async {
        fixture.started("wait_1", Stage::Fit).await;
        let all = DeadWorker::AllExcept(WorkerId(99));
        let recovered = fixture.catalog.recover(all, 1).await.expect("recovered");
        assert_eq!(recovered.ready, 1);
        fixture.pairs.open();
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(fixture.run(&options), take_lease);
    assert_eq!((summary.done, summary.stages), (1, 4));
    assert_eq!(fixture.pairs.count("wait_1", Stage::Fit), 2);
    let detail = fixture.catalog.pair(&name("wait_1")).await.expect("a read");
    let attempts = detail.expect("the pair").attempts;
    let stored = attempts.iter().filter(|attempt| attempt.failure.is_none());
    assert_eq!(stored.count(), 4);
}

#[tokio::test]
async fn the_next_pair_is_claimed_ahead_and_released_by_a_drain() {
    let fixture = RunFixture::new(&["lasts_1", "next", "other"]).await;
    let drain = async {
        fixture.started("lasts_1", Stage::Register).await;
        while fixture.status("next").await != JobStatus::Leased {
            tokio::task::yield_now().await;
        }
        assert_eq!(fixture.stop.escalate(), StopLevel::Drain);
        while fixture.status("next").await != JobStatus::Ready {
            tokio::task::yield_now().await;
        }
        fixture.pairs.open();
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(fixture.run(&options), drain);
    assert_eq!((summary.done, summary.left), (1, 2));
    assert_eq!(fixture.pairs.count("next", Stage::Fit), 0);
    let attempt = async |pair: PairName| {
        fixture
            .catalog
            .pair(&pair)
            .await
            .map(|pair| pair.expect("the pair").attempt)
    };
    assert_eq!(attempt(name("next")).await.expect("a read"), 0);
    assert_eq!(fixture.status("other").await, JobStatus::Ready);
}

/// The run does not delay commits while it could start pairs.
#[tokio::test]
async fn no_more_pairs_start_than_the_disk_keeps_up_with() {
    let names: Vec<String> = (0..60).map(|number| format!("pair_{number}")).collect();
    let fixture = RunFixture::patient(&names.iter().map(String::as_str).collect::<Vec<_>>()).await;
    let options = options(1);
    let ended = timeout(SOON, fixture.run(&options)).await;
    assert_eq!(ended.expect("no timeout").done, 60);
    let events = fixture.events.lock().expect("an unpoisoned lock");
    let (mut in_memory, mut most) = (0_i32, 0);
    for event in events.iter() {
        in_memory += i32::from(started(event, Stage::Fit));
        in_memory -= i32::from(matches!(event, RunEvent::PairDone { .. }));
        most = most.max(in_memory);
    }
    assert!((1..=9).contains(&most), "{most}");
    assert_eq!(in_memory, 0);
}

#[tokio::test]
async fn no_more_pairs_are_claimed_ahead_than_slots_become_free() {
    let fixture = RunFixture::new(&["lasts_1", "lasts_2", "next_1", "next_2", "other"]).await;
    let look = async {
        while fixture.status("next_2").await != JobStatus::Leased {
            tokio::task::yield_now().await;
        }
        assert_eq!(fixture.status("other").await, JobStatus::Ready);
        fixture.pairs.open();
    };
    let options = options(2);
    let (summary, ()) = tokio::join!(fixture.run(&options), look);
    assert_eq!(summary.done, 5);
}

/// A pair claimed ahead has one stage timeout more until its deadline, because it first waits for a slot.
#[tokio::test]
async fn a_pair_claimed_ahead_is_not_overdue_before_it_can_start() {
    let fixture = RunFixture::new(&["lasts_1", "next"]).await;
    let options = options(1);
    let limit = options.stage_timeout.as_millis() as i64;
    let clock = Clock::start();
    let look = async {
        fixture.started("lasts_1", Stage::Register).await;
        while fixture.status("next").await != JobStatus::Leased {
            tokio::task::yield_now().await;
        }
        // Store a heartbeat dated one and a half stage timeouts ahead.
        let (me, other) = (WorkerId(1), WorkerId(99));
        let heartbeat = fixture
            .catalog
            .heartbeat(me, clock.now() + limit * 3 / 2, 0, None)
            .await;
        assert!(heartbeat.expect("stored"));
        let overdue = fixture.catalog.recover_overdue(other, 0, 0).await;
        assert_eq!(overdue.expect("recovered").ready, 1);
        assert_eq!(fixture.status("next").await, JobStatus::Leased);
        fixture.pairs.open();
    };
    let (summary, ()) = tokio::join!(fixture.run(&options), look);
    assert_eq!(summary.done, 2);
}

/// One claim leases all pairs. If a pair does not fit into memory, its lease is released before the first pair ends.
#[tokio::test]
async fn pairs_that_exceed_the_memory_together_run_one_after_the_other() {
    let fixture = RunFixture::new(&["wait_1", "wait_2", "wait_3"]).await;
    for (limit, together) in [(None, 3), (Some(80 << 20), 2), (Some(1), 1)] {
        let fixture = if limit.is_none() {
            &fixture
        } else {
            &RunFixture::new(&["wait_1", "wait_2", "wait_3"]).await
        };
        let options = RunOptions {
            memory: limit,
            ..options(3)
        };
        let open = async {
            let settled = async || {
                let pairs = ["wait_1", "wait_2", "wait_3"];
                let started = pairs
                    .iter()
                    .filter(|pair| fixture.pairs.count(pair, Stage::Fit) > 0);
                let started = started.count();
                let mut ready = 0;
                for pair in pairs {
                    ready += usize::from(fixture.status(pair).await == JobStatus::Ready);
                }
                started > 0 && started + ready == 3
            };
            while !settled().await {
                tokio::task::yield_now().await;
            }
            fixture.pairs.open();
        };
        let (summary, ()) = tokio::join!(fixture.run(&options), open);
        assert_eq!(summary.done, 3);
        let most = fixture.pairs.most.load(Ordering::SeqCst);
        assert_eq!(most, together, "{limit:?}");
    }
}

/// The tasks of the lost leases still compute, so their slots are not free.
#[tokio::test]
async fn a_pair_leased_again_takes_another_slot_than_its_earlier_task() {
    let fixture = RunFixture::new(&["wait_1", "wait_2"]).await;
    let started = || {
        let pairs = ["wait_1", "wait_2"];
        let counts = pairs.map(|pair| fixture.pairs.count(pair, Stage::Fit));
        counts.into_iter().sum::<usize>()
    };
    let tasks = async |count: usize| {
        while started() < count {
            tokio::task::yield_now().await;
        }
    };
    let take_leases = async {
        tasks(2).await;
        // The process does not notice that its pairs are ready again, as after the machine was suspended.
        for pair in [PairId(1), PairId(2)] {
            let lease = Lease::of_pair(pair);
            fixture.catalog.release(lease).await.expect("released");
        }
        tasks(3).await;
        // A fourth task must not start. No event shows this, so let the scheduler poll for a second.
        let fourth = timeout(Duration::from_secs(1), tasks(4)).await;
        fixture.pairs.open();
        fourth
    };
    let options = options(3);
    let (summary, fourth) = tokio::join!(fixture.run(&options), take_leases);
    assert!(fourth.is_err(), "four tasks in three slots");
    assert_eq!((summary.done, summary.left), (2, 0));
}
