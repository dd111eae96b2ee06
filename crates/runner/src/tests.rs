//! Runs with fake stages: pairs that fail, hang, panic, or are stopped.

mod block_kills;
mod block_limits;
mod blocks;
mod cancelled;
mod fake_blocks;
mod fake_pairs;
mod gate;
mod prefetch;
pub(super) mod values;

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde_json::json;

use fake_blocks::FakeBlocks;
use fake_pairs::FakePairs;

use super::run::{RunStages, run_with};
use super::{
    BlockStages as _, NamedWork, RunError, RunEvent, RunOptions, RunSummary, Stop, StopLevel,
};
use mocban_catalog::{
    BlockSettings, Catalog, ClaimRequest, Fingerprints, RerunPolicy, WorkerInfo, WorkerSettings,
};
use mocban_core::domain::{FailureClass, JobStatus, PairName, Stage};
use mocban_store::Project;

/// A project whose pairs only the fake stages can run, and the events of all runs.
struct RunFixture {
    project: Project,
    catalog: Catalog,
    pairs: Arc<FakePairs>,
    blocks: Arc<FakeBlocks>,
    stop: Stop,
    events: Mutex<Vec<RunEvent>>,
    _dir: Option<tempfile::TempDir>,
}

fn name(text: &str) -> PairName {
    PairName::new(text).expect("a pair's name")
}

fn fingerprints() -> Fingerprints {
    Fingerprints::new(|_| json!({ "revision": 1 }))
}

fn options(workers: usize) -> RunOptions {
    RunOptions {
        workers,
        ..RunOptions::default()
    }
}

impl RunFixture {
    async fn new(pairs: &[&str]) -> Self {
        Self::with(pairs, async |path| Catalog::create(path).await).await
    }

    /// With a catalog that `create` makes.
    async fn with<E: std::fmt::Debug>(
        pairs: &[&str],
        create: impl AsyncFn(&std::path::Path) -> Result<Catalog, E>,
    ) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::create(dir.path()).expect("a project");
        let path = project.catalog_path();
        let catalog = create(&path).await.expect("a catalog");
        let rows = pairs.iter().map(|pair| values::pair_row(pair));
        catalog.import(rows.collect(), 1).await.expect("imported");
        Self {
            project,
            catalog,
            pairs: Arc::default(),
            blocks: Arc::default(),
            stop: Stop::new(),
            events: Mutex::default(),
            _dir: Some(dir),
        }
    }

    async fn try_run(&self, options: &RunOptions) -> Result<RunSummary, RunError> {
        let stages = RunStages {
            pairs: Arc::clone(&self.pairs) as _,
            blocks: Arc::clone(&self.blocks) as _,
        };
        let record = |event| self.events.lock().expect("an unpoisoned lock").push(event);
        let (project, catalog) = (&self.project, &self.catalog);
        let summary = run_with(
            project,
            catalog,
            &fingerprints(),
            stages,
            options,
            &self.stop,
            record,
        )
        .await;
        let counters = catalog.counters().await.expect("counters");
        assert_eq!(counters, catalog.recount().await.expect("a recount"));
        summary
    }

    async fn run(&self, options: &RunOptions) -> RunSummary {
        self.try_run(options)
            .await
            .expect("a run without a fatal error")
    }

    async fn status(&self, pair: &str) -> JobStatus {
        let detail = self.catalog.pair(&name(pair)).await.expect("a read");
        detail.expect("the pair").results.status
    }
}

#[tokio::test]
async fn every_pair_is_done_and_each_stage_is_computed_once() {
    let fixture = RunFixture::new(&["a", "b", "c", "d", "e"]).await;
    let summary = fixture.run(&options(2)).await;
    assert_eq!(
        (summary.done, summary.failed, summary.stages, summary.left),
        (5, 0, 20, 0)
    );
    for pair in ["a", "b", "c", "d", "e"] {
        for stage in Stage::ALL {
            assert_eq!(fixture.pairs.count(pair, stage), 1);
        }
    }
    assert!(fixture.pairs.most.load(Ordering::SeqCst) <= 2);
    let again = fixture.run(&options(2)).await;
    assert_eq!(
        (
            again.done,
            again.stages,
            again.status.jobs[&JobStatus::Done]
        ),
        (0, 0, 5)
    );
}

#[tokio::test]
async fn a_bad_pair_does_not_stop_the_others_and_shows_in_the_summary() {
    let fixture = RunFixture::new(&["a", "bad_1", "panics_1", "z"]).await;
    let summary = fixture.run(&options(2)).await;
    assert_eq!(
        (summary.done, summary.failed, summary.failed_in_all),
        (2, 2, 2)
    );
    let failures = fixture.catalog.failures(9).await.expect("a read");
    let messages: Vec<_> = failures
        .iter()
        .map(|failed| {
            (
                failed.failure.failure.class,
                failed.failure.failure.message.as_str(),
            )
        })
        .collect();
    let panicked = "the stage panicked (made up): this is a bug, please report it with the output of \
        `run --rerun failed -v`";
    let bug = (FailureClass::Bug, panicked);
    assert_eq!(messages, [(FailureClass::BadInput, "no faces"), bug]);
    let again = fixture.run(&options(2)).await;
    assert_eq!((again.failed, again.failed_in_all), (0, 2));
    let failed = RunOptions {
        rerun: RerunPolicy::Failed,
        ..options(2)
    };
    assert_eq!(fixture.run(&failed).await.failed, 2);
    assert_eq!(fixture.pairs.count("panics_1", Stage::Fit), 1);
    assert_eq!(fixture.pairs.count("panics_1", Stage::Depth), 2);
}

#[tokio::test]
async fn a_pair_that_panicked_runs_again_when_its_mesh_changes() {
    let fixture = RunFixture::new(&["bursts_1"]).await;
    let mesh = fixture.project.input_path("bursts_1.stl");
    for (content, tries) in [("one", 1), ("one", 1), ("another one", 2)] {
        std::fs::write(&mesh, content).expect("written");
        fixture.run(&options(1)).await;
        assert_eq!(
            fixture.pairs.count("bursts_1", Stage::Fit),
            tries,
            "{content}"
        );
    }
}

#[tokio::test]
async fn a_transient_failure_is_retried_in_the_same_run() {
    let fixture = RunFixture::new(&["flaky_1"]).await;
    let summary = fixture.run(&options(1)).await;
    assert_eq!((summary.done, summary.failed), (1, 0));
    assert_eq!(fixture.pairs.count("flaky_1", Stage::Fit), 2);
    let detail = fixture
        .catalog
        .pair(&name("flaky_1"))
        .await
        .expect("a read");
    let attempts = detail.expect("the pair").attempts;
    assert_eq!(
        attempts
            .iter()
            .filter(|attempt| attempt.failure.is_some())
            .count(),
        1
    );
}

#[tokio::test]
async fn a_stage_that_times_out_is_retried_exclusively_and_then_quarantined() {
    let fixture = RunFixture::new(&["a", "hangs_1"]).await;
    let limited = RunOptions {
        // Longer than the stages of the other pair take on a busy machine.
        stage_timeout: Duration::from_secs(5),
        ..options(2)
    };
    let summary = fixture.run(&limited).await;
    assert_eq!((summary.done, summary.failed), (1, 1));
    assert_eq!(fixture.pairs.count("hangs_1", Stage::Fit), 2);
    let failures = fixture.catalog.failures(9).await.expect("a read");
    assert_eq!(failures[0].failure.failure.class, FailureClass::Resource);
    fixture.pairs.open();
}

#[tokio::test]
async fn an_earlier_stage_runs_again_when_its_result_is_missing() {
    let fixture = RunFixture::new(&["loses_1"]).await;
    assert_eq!(fixture.run(&options(1)).await.done, 1);
    let counts = Stage::ALL.map(|stage| fixture.pairs.count("loses_1", stage));
    assert_eq!(counts, [1, 2, 2, 2]);
    let counters = fixture.catalog.counters().await.expect("counters");
    assert_eq!(
        counters,
        fixture.catalog.recount().await.expect("a recount")
    );
}

#[tokio::test]
async fn a_drain_finishes_the_stage_in_progress_and_does_not_count_the_attempt() {
    let fixture = RunFixture::new(&["wait_1", "wait_2"]).await;
    let options = options(1);
    let drain = async {
        while fixture.pairs.count("wait_1", Stage::Fit) == 0 {
            tokio::task::yield_now().await;
        }
        assert_eq!(fixture.stop.escalate(), StopLevel::Drain);
        fixture.pairs.open();
    };
    let (summary, ()) = tokio::join!(fixture.run(&options), drain);
    assert_eq!(
        (summary.stages, summary.left, summary.stopped),
        (1, 2, true)
    );
    let detail = fixture.catalog.pair(&name("wait_1")).await.expect("a read");
    let detail = detail.expect("the pair");
    assert_eq!(
        (detail.results.status, detail.attempt),
        (JobStatus::Ready, 0)
    );
    assert_eq!(detail.results.next_stage, Some(Stage::Depth));
    assert_eq!(fixture.pairs.count("wait_2", Stage::Fit), 0);
}

#[tokio::test]
async fn an_immediate_stop_leaves_every_pair_resumable() {
    let fixture = RunFixture::new(&["wait_1"]).await;
    let options = options(1);
    let stop = async {
        while fixture.pairs.count("wait_1", Stage::Fit) == 0 {
            tokio::task::yield_now().await;
        }
        fixture.stop.escalate();
        assert_eq!(fixture.stop.escalate(), StopLevel::Now);
    };
    let (summary, ()) = tokio::join!(fixture.run(&options), stop);
    assert_eq!((summary.stages, summary.stopped), (0, true));
    let detail = fixture.catalog.pair(&name("wait_1")).await.expect("a read");
    let detail = detail.expect("the pair");
    assert_eq!(
        (detail.results.status, detail.attempt, detail.crashes),
        (JobStatus::Ready, 0, 0)
    );
    fixture.pairs.open();
}

#[tokio::test]
async fn too_many_failures_drain_the_run() {
    let fixture = RunFixture::new(&["bad_1", "bad_2", "bad_3", "bad_4"]).await;
    let few = RunOptions {
        max_failures: Some(2),
        ..options(1)
    };
    let summary = fixture.run(&few).await;
    assert_eq!(
        (summary.failed, summary.too_many_failures, summary.left),
        (2, true, 2)
    );
}

#[tokio::test]
async fn only_selected_pairs_run_and_an_unknown_name_is_an_error() {
    let fixture = RunFixture::new(&["a", "b", "c"]).await;
    let some = |names: &[&str]| RunOptions {
        only: Some(NamedWork {
            pairs: names.iter().map(|text| name(text)).collect(),
            blocks: Vec::new(),
        }),
        ..options(2)
    };
    let refused = fixture.try_run(&some(&["b", "nobody"])).await;
    assert!(matches!(refused, Err(RunError::NoSuchPair(names)) if names == [name("nobody")]));
    assert_eq!(fixture.run(&some(&["b"])).await.done, 1);
    assert_eq!(fixture.status("a").await, JobStatus::Ready);
    assert_eq!(fixture.status("b").await, JobStatus::Done);
}

#[tokio::test]
async fn a_run_up_to_a_stage_ends_there() {
    let fixture = RunFixture::new(&["a", "b"]).await;
    let early = RunOptions {
        until: Stage::Depth,
        ..options(2)
    };
    let summary = fixture.run(&early).await;
    assert_eq!((summary.done, summary.stages, summary.left), (2, 4, 0));
    assert_eq!(fixture.run(&options(2)).await.stages, 4);
}

#[tokio::test]
async fn pairs_of_a_dead_process_are_recovered_at_once() {
    let fixture = RunFixture::new(&["a", "b"]).await;
    let info = WorkerInfo {
        host: "here".to_owned(),
        pid: 1,
        boot_id: None,
    };
    let ids = fixture.catalog.register_fingerprints(&fingerprints()).await;
    let settings = WorkerSettings {
        fingerprints: ids.expect("fingerprints"),
        blocks: BlockSettings::new(|stage| fixture.blocks.settings(stage)),
    };
    let dead = fixture
        .catalog
        .register_worker(info, settings, 1)
        .await
        .expect("a worker");
    let request = ClaimRequest::new(dead, 1, 1);
    assert_eq!(
        fixture.catalog.claim(request).await.expect("a claim").len(),
        1
    );
    assert_eq!(fixture.run(&options(2)).await.done, 2);
    let events = fixture.events.lock().expect("an unpoisoned lock");
    let first = |like: fn(&RunEvent) -> bool| events.iter().position(like);
    let recovered = first(|event| matches!(event, RunEvent::Recovered { pairs: 1 }));
    let started = first(|event| matches!(event, RunEvent::StageStarted { .. }));
    assert!(recovered.is_some() && recovered < started, "{events:?}");
}

#[tokio::test]
async fn a_second_run_is_refused_and_a_joined_one_shares_the_work() {
    let fixture = RunFixture::new(&["wait_1", "b", "c", "d", "e", "f"]).await;
    let (one, joined) = (
        options(1),
        RunOptions {
            join: true,
            ..options(1)
        },
    );
    let others = async {
        while fixture.pairs.count("wait_1", Stage::Fit) == 0 {
            tokio::task::yield_now().await;
        }
        let refused = fixture.try_run(&one).await;
        let me = std::process::id();
        let in_use = format!("the project is in use by pid {me}");
        assert_eq!(refused.expect_err("in use").to_string(), in_use);
        let open = async {
            while fixture.status("f").await != JobStatus::Done {
                tokio::task::yield_now().await;
            }
            fixture.pairs.open();
        };
        tokio::join!(fixture.run(&joined), open).0
    };
    let (owner, joiner) = tokio::join!(fixture.run(&one), others);
    assert_eq!(owner.done + joiner.done, 6);
    assert!(joiner.done >= 5);
    assert_eq!(fixture.status("wait_1").await, JobStatus::Done);
}

#[tokio::test]
async fn a_disk_error_ends_the_run_and_fails_no_pair() {
    let fixture = RunFixture::new(&["a"]).await;
    std::fs::write(fixture.project.artifacts_dir(), b"in the way").expect("a file");
    let outcome = fixture.try_run(&options(1)).await;
    assert!(matches!(outcome, Err(RunError::Artifact(_))), "{outcome:?}");
    assert_eq!(fixture.status("a").await, JobStatus::Ready);
    std::fs::remove_file(fixture.project.artifacts_dir()).expect("removed");
    assert_eq!(fixture.run(&options(1)).await.done, 1);
}

/// A run does not wait for a pair whose next stage comes after the run's last stage.
#[tokio::test]
async fn a_run_up_to_a_stage_does_not_wait_for_the_retry_of_a_later_one() {
    let fixture = RunFixture::new(&["breaks_1", "a"]).await;
    let first = RunOptions {
        only: Some(NamedWork {
            pairs: vec![name("breaks_1")],
            blocks: Vec::new(),
        }),
        ..options(1)
    };
    let stop = async {
        while fixture.status("breaks_1").await != JobStatus::Backoff {
            tokio::task::yield_now().await;
        }
        fixture.stop.escalate();
    };
    let (summary, ()) = tokio::join!(fixture.run(&first), stop);
    assert_eq!((summary.stages, summary.left), (1, 1));
    let early = RunOptions {
        until: Stage::Fit,
        ..options(1)
    };
    let again = RunFixture {
        stop: Stop::new(),
        ..fixture
    };
    let ended = tokio::time::timeout(Duration::from_mins(10), again.run(&early)).await;
    let summary = ended.expect("no timeout");
    assert_eq!((summary.done, summary.stages, summary.left), (1, 1, 0));
    assert_eq!(again.status("breaks_1").await, JobStatus::Backoff);
    // The next run completes what the stopped one left.
    assert_eq!(again.run(&options(1)).await.done, 2);
    assert_eq!(again.pairs.count("breaks_1", Stage::Depth), 2);
}
