//! Stages that compute without end are cancelled, and their memory is free before the run goes on.

use std::sync::atomic::Ordering;
use std::time::Duration;

use super::{RunFixture, options};
use crate::RunOptions;
use mocban_core::domain::Stage;

#[tokio::test]
async fn a_stage_that_times_out_has_ended_before_its_memory_is_given_to_others() {
    let fixture = RunFixture::new(&["loops_1"]).await;
    let limited = RunOptions {
        stage_timeout: Duration::from_millis(100),
        ..options(1)
    };
    let summary = fixture.run(&limited).await;
    assert_eq!((summary.done, summary.failed), (0, 1));
    assert_eq!(fixture.executor.count("loops_1", Stage::Fit), 2);
    assert_eq!(fixture.executor.endless.load(Ordering::SeqCst), 0);
}

#[tokio::test]
async fn a_block_that_computes_too_long_has_ended_before_the_run_goes_on() {
    let fixture = RunFixture::of_blocks(&["loops_1"], "r1 a").await;
    let short = RunOptions {
        stage_timeout: Duration::from_millis(100),
        ..options(1)
    };
    let summary = fixture.run(&short).await;
    assert_eq!(summary.blocks.failed, 1);
    assert_eq!(fixture.blocks.endless.load(Ordering::SeqCst), 0);
}
