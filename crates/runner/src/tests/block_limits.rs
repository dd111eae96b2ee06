//! What blocks share with pairs: limits of failures and memory, and settings that joined runs must not change.

use std::sync::atomic::Ordering;

use super::values::pair_row;
use super::{RunFixture, options};
use crate::{RunEvent, RunOptions};
use mocban_core::domain::{BlockStage, JobStatus, Stage};

#[tokio::test]
async fn failed_blocks_count_for_the_limit_of_failures() {
    let fixture = RunFixture::of_blocks(&["b_1", "b_2", "b_3"], "r1 a").await;
    for block in ["b_1", "b_2"] {
        fixture.write(block, "png", "other page");
    }
    let limited = |max_failures| RunOptions {
        max_failures: Some(max_failures),
        ..options(1)
    };
    let first = fixture.run(&limited(1)).await;
    assert!(first.too_many_failures);
    assert_eq!((first.blocks.failed, first.blocks.left), (1, 2));
    let rest = fixture.run(&limited(2)).await;
    assert!(!rest.too_many_failures);
    assert_eq!((rest.blocks.failed, rest.blocks.done, rest.done), (1, 1, 1));
}

/// The block backs off once, so that a pair is running when the block is ready again.
#[tokio::test]
async fn a_block_waits_until_a_running_pair_returns_its_memory() {
    let fixture = RunFixture::of_blocks(&["flaky_1"], "r1 a").await;
    let pair = pair_row("wait_1");
    fixture
        .catalog
        .import(vec![pair], 1)
        .await
        .expect("imported");
    let limited = RunOptions {
        memory: Some(1 << 20),
        ..options(2)
    };
    let hold = async {
        while fixture.pairs.count("wait_1", Stage::Fit) == 0 {
            tokio::task::yield_now().await;
        }
        let claimed = fixture.catalog.block_tokens().await.expect("a read");
        // The back-off ends, and the block is claimed and released, because the pair has all memory.
        while fixture.catalog.block_tokens().await.expect("a read") == claimed
            || fixture.block_state("flaky_1").await.status != JobStatus::Ready
        {
            tokio::task::yield_now().await;
        }
        assert_eq!(fixture.blocks.count("flaky_1", BlockStage::Align), 1);
        fixture.pairs.open();
    };
    let (summary, ()) = tokio::join!(fixture.run(&limited), hold);
    assert_eq!((summary.blocks.done, summary.done), (1, 2));
    let events = fixture.events.lock().expect("an unpoisoned lock");
    let position = |wanted: fn(&RunEvent) -> bool| events.iter().rposition(wanted);
    let started = position(
        |event| matches!(event, RunEvent::BlockStageStarted { stage, .. } if *stage == BlockStage::Align),
    );
    // The pair returns its memory when its last stage is computed, before that is stored.
    let last = position(
        |event| matches!(event, RunEvent::StageStarted { pair, stage: Stage::Register } if pair.as_str() == "wait_1"),
    );
    assert!(last.is_some() && started > last, "{events:?}");
}

#[tokio::test]
async fn joining_with_other_settings_of_blocks_is_refused_with_the_difference() {
    let fixture = RunFixture::of_blocks(&["waits_1"], "r1 a").await;
    let joined = RunOptions {
        join: true,
        ..options(1)
    };
    let join = async {
        while fixture.blocks.count("waits_1", BlockStage::Align) == 0 {
            tokio::task::yield_now().await;
        }
        fixture.blocks.revision.store(7, Ordering::SeqCst);
        let refused = fixture.try_run(&joined).await.expect_err("refused");
        fixture.blocks.revision.store(0, Ordering::SeqCst);
        fixture.blocks.open();
        refused.to_string()
    };
    let (summary, refused) = tokio::join!(fixture.run(&joined), join);
    assert_eq!(summary.blocks.done, 1);
    assert!(refused.contains("(boxes.revision: 0 -> 7)"), "{refused}");
}
