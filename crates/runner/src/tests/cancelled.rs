//! Stages that compute without end are cancelled, and their memory is free before the run goes on.

use std::sync::atomic::Ordering;
use std::time::Duration;

use super::{RunFixture, options};
use crate::{RunOptions, RunSummary};
use mocban_catalog::DeadWorker;
use mocban_core::domain::{JobStatus, Stage, WorkerId};

#[tokio::test]
async fn a_stage_that_times_out_has_ended_before_its_memory_is_given_to_others() {
    let fixture = RunFixture::new(&["loops_1"]).await;
    let limited = RunOptions {
        stage_timeout: Duration::from_secs(2),
        ..options(1)
    };
    let summary = fixture.run(&limited).await;
    assert_eq!((summary.done, summary.failed), (0, 1));
    assert_eq!(fixture.pairs.count("loops_1", Stage::Fit), 2);
    assert_eq!(fixture.pairs.endless.load(Ordering::SeqCst), 0);
}

#[tokio::test]
async fn a_block_that_computes_too_long_has_ended_before_the_run_goes_on() {
    let fixture = RunFixture::of_blocks(&["loops_1"], "r1 a").await;
    let short = RunOptions {
        stage_timeout: Duration::from_secs(2),
        ..options(1)
    };
    let summary = fixture.run(&short).await;
    assert_eq!(summary.blocks.failed, 1);
    assert_eq!(fixture.blocks.endless.load(Ordering::SeqCst), 0);
}

impl RunFixture {
    /// Waits until a condition holds in a run. Returns the worker of the run.
    async fn worker_when(&self, holds: impl Fn(&Self) -> bool) -> WorkerId {
        while !holds(self) {
            tokio::task::yield_now().await;
        }
        let holders = self.catalog.lease_holders().await.expect("a read");
        holders[0].worker
    }

    /// Runs with one slot, and does something meanwhile. Fails if a stage is not cancelled.
    async fn run_during(&self, meanwhile: impl Future<Output = ()>) -> RunSummary {
        let options = options(1);
        let run = async { tokio::join!(self.run(&options), meanwhile) };
        let ended = tokio::time::timeout(Duration::from_mins(10), run).await;
        ended.expect("a stage was not cancelled").0
    }

    /// Lets the leases of a worker expire, and its next heartbeat be refused at once.
    async fn end_leases_of(&self, worker: WorkerId) {
        let ended = self.catalog.end_worker(worker, 1, None).await;
        ended.expect("ended");
        self.stop.escalate();
    }
}

#[tokio::test]
async fn a_stage_is_cancelled_when_the_stage_before_it_is_refused() {
    let fixture = RunFixture::new(&["outlives_1"]).await;
    let recovered = async {
        let fit = |fixture: &RunFixture| fixture.pairs.count("outlives_1", Stage::Fit) == 1;
        let worker = fixture.worker_when(fit).await;
        let dead = DeadWorker::Known(worker);
        let recovered = fixture.catalog.recover(dead, 1).await;
        assert_eq!(recovered.expect("a recovery").ready, 1);
        fixture.pairs.open();
    };
    let summary = Box::pin(fixture.run_during(recovered)).await;
    assert_eq!((summary.done, summary.failed), (1, 0));
    assert_eq!(fixture.pairs.count("outlives_1", Stage::Fit), 2);
    assert_eq!(fixture.pairs.endless.load(Ordering::SeqCst), 0);
}

#[tokio::test]
async fn a_stage_of_a_pair_is_cancelled_when_the_heartbeat_is_refused() {
    let fixture = RunFixture::new(&["loops_1"]).await;
    let expired = async {
        let computes = |fixture: &RunFixture| fixture.pairs.endless.load(Ordering::SeqCst) == 1;
        let worker = fixture.worker_when(computes).await;
        fixture.end_leases_of(worker).await;
    };
    let summary = Box::pin(fixture.run_during(expired)).await;
    assert_eq!((summary.left, summary.failed), (1, 0));
    assert_eq!(fixture.pairs.endless.load(Ordering::SeqCst), 0);
    assert_eq!(fixture.status("loops_1").await, JobStatus::Ready);
}

#[tokio::test]
async fn a_stage_of_a_block_is_cancelled_when_the_heartbeat_is_refused() {
    let fixture = RunFixture::of_blocks(&["loops_1"], "r1 a").await;
    let expired = async {
        let computes = |fixture: &RunFixture| fixture.blocks.endless.load(Ordering::SeqCst) == 1;
        let worker = fixture.worker_when(computes).await;
        fixture.end_leases_of(worker).await;
    };
    let summary = Box::pin(fixture.run_during(expired)).await;
    assert_eq!((summary.blocks.left, summary.blocks.failed), (1, 0));
    assert_eq!(fixture.blocks.endless.load(Ordering::SeqCst), 0);
    assert_eq!(
        fixture.block_state("loops_1").await.status,
        JobStatus::Ready
    );
}
