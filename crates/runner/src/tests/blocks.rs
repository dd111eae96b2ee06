//! Runs of blocks with fake stages: pairs that are cut, refusals, changed files and stops.

use super::values::pair_row;
use super::{RunFixture, name, options};
use crate::{NamedWork, RunError, RunEvent, RunOptions, StopLevel};
use mocban_catalog::{BlockAttributes, BlockState, RerunPolicy};
use mocban_core::domain::{BlockName, BlockStage, FailureClass, JobStatus, Stage};

pub(super) fn block(text: &str) -> BlockName {
    BlockName::new(text).expect("a valid name")
}

impl RunFixture {
    /// A project with blocks, all with the same labels.
    pub(super) async fn of_blocks(blocks: &[&str], labels: &str) -> Self {
        let fixture = Self::new(&[]).await;
        for text in blocks {
            fixture.write(text, "stl", &format!("mesh of {text}"));
            fixture.write(text, "png", &format!("page of {text}"));
            fixture.write(text, "txt", labels);
        }
        let rows = blocks.iter().map(|text| BlockAttributes {
            name: block(text),
            mesh_path: format!("{text}.stl"),
            page_path: format!("{text}.png"),
            labels_path: Some(format!("{text}.txt")),
            unit: None,
            side: None,
            meta: None,
        });
        let rows: Vec<BlockAttributes> = rows.collect();
        let imported = fixture.catalog.import_blocks(rows, true, 1).await;
        imported.expect("imported");
        let _ = fixture.pairs.project.set(fixture.project.clone());
        fixture
    }

    pub(super) fn write(&self, block: &str, ext: &str, content: &str) {
        let path = self.project.input_path(&format!("{block}.{ext}"));
        std::fs::write(path, content).expect("written");
    }

    pub(super) async fn block_state(&self, text: &str) -> BlockState {
        let detail = self.catalog.block(&block(text)).await.expect("a read");
        detail.expect("the block").state
    }

    async fn failure(&self, text: &str) -> (FailureClass, String) {
        let failure = self.block_state(text).await.failure.expect("a failure");
        (failure.failure.class, failure.failure.message)
    }

    /// Returns how often each stage of a block was computed.
    pub(super) fn counts(&self, text: &str) -> [usize; 4] {
        BlockStage::ALL.map(|stage| self.blocks.count(text, stage))
    }
}

#[tokio::test]
async fn the_characters_of_a_block_are_cut_and_run_in_the_same_run() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a\nr2 b\nr3").await;
    let summary = fixture.run(&options(2)).await;
    assert_eq!((summary.blocks.done, summary.blocks.left), (1, 0));
    assert_eq!((summary.done, summary.stages, summary.left), (2, 8, 0));
    assert_eq!(fixture.status("b_1_r2").await, JobStatus::Done);
    let state = fixture.block_state("b_1").await;
    assert_eq!((state.characters, state.left_out), (2, 1));
    let pair = fixture.catalog.pair(&name("b_1_r1")).await.expect("a read");
    let mesh = pair.expect("the pair").results.attributes.mesh_path;
    let content = std::fs::read_to_string(fixture.project.input_path(&mesh));
    assert_eq!(content.expect("a file"), "ply of a");
    let again = fixture.run(&options(2)).await;
    assert_eq!((again.blocks.done, again.done), (0, 0));
    assert_eq!(fixture.counts("b_1"), [1; 4]);
}

#[tokio::test]
async fn a_page_of_another_block_is_refused_until_it_is_replaced() {
    let fixture = RunFixture::of_blocks(&["b_1", "b_2"], "r1 a").await;
    fixture.write("b_1", "png", "other page");
    let summary = fixture.run(&options(1)).await;
    assert_eq!((summary.blocks.done, summary.blocks.failed), (1, 1));
    assert_eq!((summary.done, summary.blocks.failed_in_all), (1, 1));
    let message = "b_1.png: the page is of another block".to_owned();
    assert_eq!(
        fixture.failure("b_1").await,
        (FailureClass::NoSolution, message)
    );
    let again = fixture.run(&options(1)).await;
    assert_eq!((again.blocks.failed, again.blocks.failed_in_all), (0, 1));
    fixture.write("b_1", "png", "the right page");
    let right = fixture.run(&options(1)).await;
    assert_eq!((right.blocks.done, right.done), (1, 1));
    assert_eq!(fixture.counts("b_1"), [1, 2, 1, 1]);
}

#[tokio::test]
async fn changed_labels_run_only_the_changed_characters_again() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a\nr2 b\nr3 c").await;
    fixture.run(&options(2)).await;
    fixture.write("b_1", "txt", "r1 a\nr2 new b");
    let changed = fixture.run(&options(2)).await;
    assert_eq!((changed.blocks.done, changed.done), (1, 1));
    assert_eq!(fixture.counts("b_1"), [1, 1, 2, 2]);
    assert_eq!(fixture.pairs.count("b_1_r1", Stage::Fit), 1);
    assert_eq!(fixture.pairs.count("b_1_r2", Stage::Fit), 2);
    let retired = fixture.catalog.retired_pairs().await.expect("a read");
    assert_eq!((retired.len(), &retired[0].name), (1, &name("b_1_r3")));
    assert_eq!(changed.status.pairs, 2);
    fixture.write("b_1", "txt", "r1 a\nr2 new b\nr3 c");
    let back = fixture.run(&options(2)).await;
    assert_eq!((back.done, back.status.pairs), (0, 3));
    assert_eq!(fixture.pairs.count("b_1_r3", Stage::Fit), 1);
}

#[tokio::test]
async fn labels_that_are_added_to_a_finished_block_are_used() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a\nr2 b").await;
    let with_labels = fixture.block_state("b_1").await.attributes;
    let without = BlockAttributes {
        labels_path: None,
        ..with_labels.clone()
    };
    let import = async |attributes: BlockAttributes| {
        let imported = fixture
            .catalog
            .import_blocks(vec![attributes], true, 1)
            .await;
        imported.expect("imported");
    };
    import(without.clone()).await;
    fixture.run(&options(1)).await;
    assert_eq!(fixture.block_state("b_1").await.characters, 1);
    import(with_labels).await;
    fixture.run(&options(1)).await;
    assert_eq!(fixture.counts("b_1"), [1, 1, 2, 2]);
    assert_eq!(fixture.block_state("b_1").await.characters, 2);
    import(without).await;
    fixture.run(&options(1)).await;
    assert_eq!(fixture.counts("b_1"), [1, 1, 3, 3]);
}

#[tokio::test]
async fn a_changed_page_or_mesh_or_setting_runs_the_stages_that_depend_on_it() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a").await;
    fixture.run(&options(1)).await;
    fixture.write("b_1", "png", "a new scan of the page");
    fixture.run(&options(1)).await;
    assert_eq!(fixture.counts("b_1"), [1, 2, 2, 2]);
    fixture.write("b_1", "stl", "a new mesh");
    fixture.run(&options(1)).await;
    assert_eq!(fixture.counts("b_1"), [2, 3, 3, 3]);
    fixture
        .blocks
        .revision
        .store(7, std::sync::atomic::Ordering::SeqCst);
    fixture.run(&options(1)).await;
    assert_eq!(fixture.counts("b_1"), [2, 3, 4, 4]);
    // Nothing of the characters changed.
    assert_eq!(fixture.pairs.count("b_1_r1", Stage::Fit), 1);
}

#[tokio::test]
async fn failures_that_may_pass_are_retried_and_others_are_not() {
    let fixture = RunFixture::of_blocks(&["flaky_1", "loses_1", "panics_1"], "r1 a").await;
    let summary = fixture.run(&options(1)).await;
    assert_eq!((summary.blocks.done, summary.blocks.failed), (2, 1));
    assert_eq!(fixture.counts("flaky_1"), [1, 2, 1, 1]);
    // After the third stage lost a result, the block starts again.
    assert_eq!(fixture.counts("loses_1"), [2, 2, 2, 1]);
    let (class, message) = fixture.failure("panics_1").await;
    assert_eq!(class, FailureClass::Bug);
    assert!(
        message.starts_with("the stage panicked (made up)"),
        "{message}"
    );
    let failed = RunOptions {
        rerun: RerunPolicy::Failed,
        ..options(1)
    };
    assert_eq!(fixture.run(&failed).await.blocks.failed, 1);
}

#[tokio::test]
async fn a_missing_artifact_of_an_earlier_stage_is_computed_again() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a").await;
    fixture.run(&options(1)).await;
    let blocks = fixture.catalog.audited_blocks().await.expect("a read");
    let face = &blocks[0].results[0];
    let path = fixture.project.artifact_path(&face.files["heights.txt"]);
    std::fs::remove_file(&path).expect("removed");
    fixture.write("b_1", "png", "a new scan of the page");
    let summary = fixture.run(&options(1)).await;
    assert_eq!(summary.blocks.done, 1);
    assert_eq!(fixture.counts("b_1"), [2, 3, 2, 2]);
    assert!(path.exists());
}

#[tokio::test]
async fn missing_and_duplicate_labels_are_failures_that_name_them() {
    let fixture = RunFixture::of_blocks(&["b_1", "b_2", "b_3"], "r1 a\nr1 b").await;
    fixture.write("b_2", "txt", "r/1 a");
    let labels = fixture.project.input_path("b_3.txt");
    std::fs::remove_file(labels).expect("removed");
    let summary = fixture.run(&options(1)).await;
    assert_eq!(summary.blocks.failed, 3);
    for (text, expected) in [
        ("b_1", "two characters have the label \"r1\"; rename one"),
        ("b_2", "label \"r/1\" cannot be part of an id"),
        ("b_3", "b_3.txt is not there"),
    ] {
        let (_, message) = fixture.failure(text).await;
        assert!(message.contains(expected), "{message}");
    }
}

#[tokio::test]
async fn a_pair_with_the_same_name_is_not_replaced() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a").await;
    let other = RunFixture::new(&["b_1_r1"]).await;
    let rows = other.catalog.pair(&name("b_1_r1")).await.expect("a read");
    let row = rows.expect("the pair").results.attributes;
    fixture
        .catalog
        .import(vec![row], 1)
        .await
        .expect("imported");
    fixture.run(&options(1)).await;
    let (class, message) = fixture.failure("b_1").await;
    assert_eq!(class, FailureClass::BadInput);
    assert!(
        message.contains("there is a pair b_1_r1 that was not cut"),
        "{message}"
    );
}

#[tokio::test]
async fn named_pairs_run_without_blocks() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a\nr2 b").await;
    fixture.run(&options(1)).await;
    fixture.write("b_1", "txt", "r1 new a\nr2 b");
    let named = RunOptions {
        only: Some(NamedWork {
            pairs: vec![name("b_1_r2")],
            blocks: Vec::new(),
        }),
        ..options(1)
    };
    assert_eq!(fixture.run(&named).await.blocks.done, 0);
    assert_eq!(fixture.counts("b_1"), [1; 4]);
}

#[tokio::test]
async fn a_named_block_runs_with_the_pairs_that_are_cut_from_it_and_no_others() {
    let fixture = RunFixture::of_blocks(&["b_1", "b_2"], "r1 a\nr2 b").await;
    fixture.write("b_2", "txt", "r1 c");
    fixture
        .catalog
        .import(vec![pair_row("other")], 1)
        .await
        .expect("imported");
    let named = |blocks: &[&str], pairs: &[&str]| RunOptions {
        only: Some(NamedWork {
            pairs: pairs.iter().map(|text| name(text)).collect(),
            blocks: blocks.iter().map(|text| block(text)).collect(),
        }),
        ..options(2)
    };
    let first = fixture.run(&named(&["b_1"], &[])).await;
    assert_eq!((first.blocks.done, first.blocks.left), (1, 0));
    assert_eq!((first.done, first.left, first.status.pairs), (2, 0, 3));
    assert_eq!(fixture.counts("b_2"), [0; 4]);
    assert_eq!(fixture.pairs.count("other", Stage::Fit), 0);
    fixture.write("b_1", "txt", "r1 a\nr2 new b");
    let second = fixture.run(&named(&["b_2"], &["other"])).await;
    assert_eq!((second.blocks.done, second.done), (1, 2));
    assert_eq!(fixture.counts("b_1"), [1; 4]);
    let again = fixture.run(&named(&["b_1"], &[])).await;
    assert_eq!((again.blocks.done, again.done), (1, 1));
    assert_eq!(fixture.counts("b_1"), [1, 1, 2, 2]);
    let refused = fixture.try_run(&named(&["b_3"], &[])).await;
    assert!(matches!(refused, Err(RunError::NoSuchBlock(unknown)) if unknown == block("b_3")));
}

#[tokio::test]
async fn a_drained_run_stores_the_stage_in_progress_and_the_next_run_goes_on() {
    let fixture = RunFixture::of_blocks(&["waits_1"], "r1 a").await;
    let stop = async {
        while fixture.blocks.count("waits_1", BlockStage::Align) == 0 {
            tokio::task::yield_now().await;
        }
        fixture.stop.drain();
        fixture.blocks.open();
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(fixture.run(&options), stop);
    assert!(summary.stopped);
    assert_eq!((summary.blocks.done, summary.blocks.left), (0, 1));
    let state = fixture.block_state("waits_1").await;
    assert_eq!(state.next_stage, Some(BlockStage::Boxes));
    assert_eq!((state.status, state.attempts), (JobStatus::Ready, 0));
}

#[tokio::test]
async fn an_immediate_stop_releases_the_block() {
    let fixture = RunFixture::of_blocks(&["waits_1"], "r1 a").await;
    let stop = async {
        while fixture.blocks.count("waits_1", BlockStage::Align) == 0 {
            tokio::task::yield_now().await;
        }
        while fixture.stop.escalate() != StopLevel::Now {}
    };
    let options = options(1);
    let (summary, ()) = tokio::join!(fixture.run(&options), stop);
    fixture.blocks.open();
    assert!(summary.stopped);
    let state = fixture.block_state("waits_1").await;
    assert_eq!(state.next_stage, Some(BlockStage::Align));
    assert_eq!(state.status, JobStatus::Ready);
}

#[tokio::test]
async fn a_block_that_takes_too_long_fails() {
    let fixture = RunFixture::of_blocks(&["waits_1"], "r1 a").await;
    let short = RunOptions {
        stage_timeout: std::time::Duration::from_secs(3),
        ..options(1)
    };
    let summary = fixture.run(&short).await;
    fixture.blocks.open();
    assert_eq!(summary.blocks.failed, 1);
    let (class, message) = fixture.failure("waits_1").await;
    assert_eq!(class, FailureClass::Resource);
    assert!(
        message.contains("longer than 3 s (run.stage_timeout_s)"),
        "{message}"
    );
}

#[tokio::test]
async fn two_runs_work_on_different_blocks_and_share_the_pairs() {
    let fixture = RunFixture::of_blocks(&["waits_1", "b_2"], "r1 a\nr2 b").await;
    let joined = RunOptions {
        join: true,
        ..options(1)
    };
    let first = async {
        let summary = fixture.run(&joined).await;
        summary.blocks.done
    };
    let second = async {
        while fixture.blocks.count("waits_1", BlockStage::Align) == 0 {
            tokio::task::yield_now().await;
        }
        let opened = async {
            while fixture
                .catalog
                .outstanding_blocks(None)
                .await
                .expect("a read")
                .left()
                > 1
            {
                tokio::task::yield_now().await;
            }
            fixture.blocks.open();
        };
        let (summary, ()) = tokio::join!(fixture.run(&joined), opened);
        summary.blocks.done
    };
    assert_eq!(tokio::join!(first, second), (1, 1));
    for block in ["waits_1", "b_2"] {
        assert_eq!(fixture.counts(block), [1; 4], "{block}");
        for label in ["r1", "r2"] {
            let pair = format!("{block}_{label}");
            assert_eq!(fixture.status(&pair).await, JobStatus::Done);
            assert_eq!(fixture.pairs.count(&pair, Stage::Fit), 1, "{pair}");
        }
    }
}

#[tokio::test]
async fn what_a_stage_left_out_is_an_event() {
    for (labels, expected) in [
        ("r1 beside", vec!["b_1: 1 box was left out"]),
        ("r1 a", vec![]),
    ] {
        let fixture = RunFixture::of_blocks(&["b_1"], labels).await;
        fixture.run(&options(1)).await;
        let events = fixture.events.lock().expect("an unpoisoned lock");
        let warned = events.iter().filter_map(|event| match event {
            RunEvent::BlockWarned { block, warning, .. } => Some(format!("{block}: {warning}")),
            _ => None,
        });
        assert_eq!(warned.collect::<Vec<_>>(), expected);
    }
}

#[tokio::test]
async fn events_name_the_block_and_its_pairs() {
    let fixture = RunFixture::of_blocks(&["b_1"], "r1 a\nr2 b").await;
    fixture.run(&options(1)).await;
    let events = fixture.events.lock().expect("an unpoisoned lock");
    let done = events.iter().find_map(|event| match event {
        RunEvent::BlockDone { cut, stages, .. } => Some((cut.added, *stages)),
        _ => None,
    });
    assert_eq!(done, Some((2, 4)));
    let is_finished = |event: &&RunEvent| matches!(event, RunEvent::BlockStageFinished { .. });
    assert_eq!(events.iter().filter(is_finished).count(), 4);
}
