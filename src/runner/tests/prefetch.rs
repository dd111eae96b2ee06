//! What goes on while a checkpoint is on its way or a pair is nearly over, and which pairs are taken then.

use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::timeout;

use super::{RunFixture, name, options};
use crate::catalog::{Catalog, DeadWorker};
use crate::domain::{JobStatus, PairName, Stage, WorkerId};
use crate::runner::policy::Clock;
use crate::runner::{RunEvent, RunOptions, StopLevel};

impl RunFixture {
    /// With a catalog that stores nothing that can wait before it is told to.
    async fn patient(pairs: &[&str]) -> Self {
        Self::with(pairs, async |path| Catalog::create_patient(path).await).await
    }

    /// Until a stage of a pair has begun.
    async fn begun(&self, pair: &str, stage: Stage) {
        while self.executor.count(pair, stage) == 0 {
            tokio::task::yield_now().await;
        }
    }

    /// Where among the events the first one is that is like this.
    fn position(&self, like: impl Fn(&RunEvent) -> bool) -> Option<usize> {
        let events = self.events.lock().expect("no panic holds it");
        events.iter().position(like)
    }
}

fn started(event: &RunEvent, wanted: Stage) -> bool {
    matches!(event, RunEvent::StageStarted { stage, .. } if *stage == wanted)
}

fn finished(event: &RunEvent, wanted: Stage) -> bool {
    matches!(event, RunEvent::StageFinished { stage, .. } if *stage == wanted)
}

#[tokio::test]
async fn stages_are_computed_while_those_before_are_stored_and_only_what_is_stored_is_told() {
    let world = RunFixture::new(&["wait_1"]).await;
    let hold = async {
        world.begun("wait_1", Stage::Fit).await;
        let release = world.catalog.hold().await;
        world.executor.open();
        world.begun("wait_1", Stage::Register).await;
        assert_eq!(world.position(|event| finished(event, Stage::Fit)), None);
        release.send(()).expect("the writer waits");
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(world.run(&options), hold);
    assert_eq!((summary.done, summary.stages), (1, 4));
    let told = Stage::ALL.map(|stage| world.position(|event| finished(event, stage)));
    assert!(told.is_sorted() && told[0].is_some(), "{told:?}");
    assert!(world.position(|event| started(event, Stage::Register)) < told[0]);
    let detail = world.catalog.pair(&name("wait_1")).await.expect("a read");
    assert_eq!(detail.expect("the pair").attempts.len(), 4);
}

#[tokio::test]
async fn what_is_finished_is_stored_while_a_long_stage_is_computed() {
    let world = RunFixture::new(&["lasts_1"]).await;
    let look = async {
        world.begun("lasts_1", Stage::Register).await;
        let stored = async {
            while world
                .position(|event| finished(event, Stage::Normalize))
                .is_none()
            {
                tokio::task::yield_now().await;
            }
        };
        let stored = timeout(Duration::from_mins(1), stored).await;
        let detail = world.catalog.pair(&name("lasts_1")).await;
        world.executor.open();
        assert!(stored.is_ok(), "it waits for the end");
        assert_eq!(detail.expect("a read").expect("the pair").attempts.len(), 3);
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(world.run(&options), look);
    assert_eq!((summary.done, summary.stages), (1, 4));
}

/// Less than passes between two signs of life, which take along what waits.
const SOON: Duration = Duration::from_secs(8);

#[tokio::test]
async fn who_needs_the_lease_back_has_what_is_on_its_way_stored_at_once() {
    let world = RunFixture::patient(&["breaks_1"]).await;
    let options = options(1);
    let ended = timeout(SOON, world.run(&options)).await;
    assert_eq!(ended.expect("it does not wait").done, 1);
    assert_eq!(world.executor.count("breaks_1", Stage::Depth), 2);
}

#[tokio::test]
async fn nothing_is_stored_of_a_stage_that_was_computed_while_the_lease_was_lost() {
    let world = RunFixture::new(&["wait_1"]).await;
    let rob = async {
        world.begun("wait_1", Stage::Fit).await;
        let nobody = DeadWorker::AllExcept(WorkerId(99));
        let rescued = world.catalog.recover(nobody, 1).await.expect("a recover");
        assert_eq!(rescued.ready, 1);
        world.executor.open();
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(world.run(&options), rob);
    assert_eq!((summary.done, summary.stages), (1, 4));
    assert_eq!(world.executor.count("wait_1", Stage::Fit), 2);
    let detail = world.catalog.pair(&name("wait_1")).await.expect("a read");
    let attempts = detail.expect("the pair").attempts;
    let stored = attempts.iter().filter(|attempt| attempt.failure.is_none());
    assert_eq!(stored.count(), 4);
}

#[tokio::test]
async fn the_next_pair_is_taken_ahead_and_given_back_by_a_drain() {
    let world = RunFixture::new(&["lasts_1", "next", "other"]).await;
    let drain = async {
        world.begun("lasts_1", Stage::Register).await;
        while world.status("next").await != JobStatus::Leased {
            tokio::task::yield_now().await;
        }
        assert_eq!(world.stop.escalate(), StopLevel::Drain);
        while world.status("next").await != JobStatus::Ready {
            tokio::task::yield_now().await;
        }
        world.executor.open();
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(world.run(&options), drain);
    assert_eq!((summary.done, summary.left), (1, 2));
    assert_eq!(world.executor.count("next", Stage::Fit), 0);
    let attempt = async |pair: PairName| {
        world
            .catalog
            .pair(&pair)
            .await
            .map(|pair| pair.expect("it").attempt)
    };
    assert_eq!(attempt(name("next")).await.expect("a read"), 0);
    assert_eq!(world.status("other").await, JobStatus::Ready);
}

/// Nor does the run wait for company when it could begin them.
#[tokio::test]
async fn no_more_pairs_are_begun_than_the_disk_keeps_up_with() {
    let names: Vec<String> = (0..60).map(|number| format!("pair_{number}")).collect();
    let world = RunFixture::patient(&names.iter().map(String::as_str).collect::<Vec<_>>()).await;
    let options = options(1);
    let ended = timeout(SOON, world.run(&options)).await;
    assert_eq!(ended.expect("it does not wait").done, 60);
    let events = world.events.lock().expect("no panic holds it");
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
async fn no_more_are_taken_ahead_than_slots_will_be_free() {
    let world = RunFixture::new(&["lasts_1", "lasts_2", "next_1", "next_2", "other"]).await;
    let look = async {
        while world.status("next_2").await != JobStatus::Leased {
            tokio::task::yield_now().await;
        }
        assert_eq!(world.status("other").await, JobStatus::Ready);
        world.executor.open();
    };
    let options = options(2);
    let (summary, ()) = tokio::join!(world.run(&options), look);
    assert_eq!(summary.done, 5);
}

/// It may have to wait for the one before it for as long as a stage may last, and then has its own time.
#[tokio::test]
async fn a_pair_taken_ahead_is_not_overdue_before_it_could_have_begun() {
    let world = RunFixture::new(&["lasts_1", "next"]).await;
    let options = options(1);
    let limit = options.stage_timeout.as_millis() as i64;
    let clock = Clock::start();
    let look = async {
        world.begun("lasts_1", Stage::Register).await;
        while world.status("next").await != JobStatus::Leased {
            tokio::task::yield_now().await;
        }
        // As if its worker had gone on for one and a half times that long.
        let (me, other) = (WorkerId(1), WorkerId(99));
        let heartbeat = world
            .catalog
            .heartbeat(me, clock.now() + limit * 3 / 2, 0)
            .await;
        assert!(heartbeat.expect("stored"));
        let overdue = world.catalog.recover_overdue(other, 0, 0).await;
        assert_eq!(overdue.expect("a recover").ready, 1);
        assert_eq!(world.status("next").await, JobStatus::Leased);
        world.executor.open();
    };
    let (summary, ()) = tokio::join!(world.run(&options), look);
    assert_eq!(summary.done, 2);
}

/// Both are leased in one claim; the second is given back when it does not fit, before the first can end.
#[tokio::test]
async fn pairs_that_do_not_fit_together_run_one_after_the_other() {
    let world = RunFixture::new(&["wait_1", "wait_2", "wait_3"]).await;
    for (limit, together) in [(None, 3), (Some(80 << 20), 2), (Some(1), 1)] {
        let world = if limit.is_none() {
            &world
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
                let begun = pairs
                    .iter()
                    .filter(|pair| world.executor.count(pair, Stage::Fit) > 0);
                let begun = begun.count();
                let mut ready = 0;
                for pair in pairs {
                    ready += usize::from(world.status(pair).await == JobStatus::Ready);
                }
                begun > 0 && begun + ready == 3
            };
            while !settled().await {
                tokio::task::yield_now().await;
            }
            world.executor.open();
        };
        let (summary, ()) = tokio::join!(world.run(&options), open);
        assert_eq!(summary.done, 3);
        let most = world.executor.most.load(Ordering::SeqCst);
        assert_eq!(most, together, "{limit:?}");
    }
}
