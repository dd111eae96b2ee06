//! What the page of a run shows of blocks and of the time left.

use std::collections::BTreeMap;

use super::{RunState, controls, figures, progress};
use crate::app::latest_results::LatestResults;
use crate::app::run_blocks::{blocks_text, failed_block_list};
use crate::app::visit::Visit;
use crate::review::Language;
use mocban_catalog::{
    BlockAttributes, BlockState, Plan, PlanEntry, StaleReason, StatusCounts, WorkerRecord,
};
use mocban_core::domain::{BlockStage, JobStatus, Stage, WorkerId, WorkerMetrics};
use mocban_project::block_status::BlockStatus;

fn block(name: &str, status: JobStatus) -> BlockState {
    BlockState {
        attributes: BlockAttributes {
            name: name.parse().expect("a valid id"),
            mesh_path: "m.stl".to_owned(),
            page_path: "p.png".to_owned(),
            labels_path: None,
            unit: None,
            side: None,
            meta: None,
        },
        status,
        next_stage: (status != JobStatus::Done).then_some(BlockStage::Align),
        attempts: 0,
        crashes: 0,
        failure: None,
        control_points: None,
        characters: 0,
        left_out: 0,
        retired: 0,
        low_confidence: 0,
        other_files: false,
    }
}

/// A run that has done 10 of 20 pairs in a minute, in a project with these blocks.
fn running(blocks: Vec<BlockState>) -> RunState {
    let metrics = WorkerMetrics {
        elapsed_ms: 60_000,
        done: 10,
        ..WorkerMetrics::default()
    };
    RunState {
        counts: StatusCounts {
            schema: 1,
            pairs: 20,
            retired: 0,
            jobs: BTreeMap::from([(JobStatus::Done, 10), (JobStatus::Ready, 10)]),
            stages: BTreeMap::new(),
            stale: 0,
            other_files: 0,
            low_confidence: 0,
            verdicts: BTreeMap::new(),
        },
        is_running: true,
        workers: vec![WorkerRecord {
            id: WorkerId(1),
            host: "here".to_owned(),
            pid: 7,
            started: 0,
            heartbeat: 0,
            ended: None,
            died: false,
            leased: 1,
            metrics: Some(metrics),
        }],
        latest: LatestResults::default(),
        failures: Vec::new(),
        blocks: BlockStatus(blocks),
        outdated_blocks: 0,
        changed_blocks: 0,
        failed_run: None,
        jobs: 2,
        plan: None,
    }
}

#[test]
fn blocks_in_progress_have_their_stage_in_both_languages() {
    let blocks = BlockStatus(vec![
        block("b03", JobStatus::Done),
        block("b04", JobStatus::Leased),
        block("b05", JobStatus::Ready),
    ]);
    let text = |language| blocks_text(&Visit::in_language(language), &blocks);
    assert_eq!(
        text(Language::English),
        "b04: registration with the page, 1 of 3 blocks done"
    );
    assert_eq!(
        text(Language::Vietnamese),
        "b04: căn chỉnh với trang in, xong 1 trên 3 ván"
    );
}

#[test]
fn time_is_estimated_once_every_pair_is_known() {
    let visit = Visit::in_language(Language::English);
    let is_estimated = |blocks| {
        let shown = progress(&visit, &running(blocks)).into_string();
        assert!(shown.contains("10.0 pairs a minute"), "{shown}");
        shown.contains("time left 60 s")
    };
    assert!(is_estimated(Vec::new()));
    assert!(is_estimated(vec![
        block("b1", JobStatus::Done),
        block("b2", JobStatus::Quarantined)
    ]));
    for status in [JobStatus::Ready, JobStatus::Backoff, JobStatus::Leased] {
        assert!(!is_estimated(vec![block("b1", status)]), "{status}");
    }
}

#[test]
fn a_project_of_blocks_alone_can_be_run() {
    let mut run = running(vec![block("b1", JobStatus::Ready)]);
    run.is_running = false;
    run.counts.jobs.clear();
    let shown = controls(&Visit::in_language(Language::English), &run).into_string();
    assert!(shown.contains("Align 1 block<"), "{shown}");
    assert!(!shown.contains("disabled"), "{shown}");
    run.blocks = BlockStatus(Vec::new());
    run.counts.pairs = 0;
    let shown = controls(&Visit::in_language(Language::English), &run).into_string();
    assert!(shown.contains("disabled"), "{shown}");
}

#[test]
fn a_finished_project_can_be_searched_for_changed_files() {
    let mut run = running(Vec::new());
    run.is_running = false;
    run.counts.jobs = BTreeMap::from([(JobStatus::Done, 20)]);
    let shown = controls(&Visit::in_language(Language::English), &run).into_string();
    assert!(shown.contains("Look for changed files"), "{shown}");
    assert!(!shown.contains("disabled"), "{shown}");
}

#[test]
fn pairs_with_other_files_in_the_list_are_named_in_both_languages() {
    let mut run = running(Vec::new());
    run.is_running = false;
    run.counts.jobs = BTreeMap::from([(JobStatus::Done, 20)]);
    let shown =
        |run: &RunState, language| controls(&Visit::in_language(language), run).into_string();
    let before = shown(&run, Language::English);
    assert!(before.contains("Everything is aligned"), "{before}");
    assert!(!before.contains("other-files"), "{before}");
    run.counts.other_files = 2;
    for (language, text) in [
        (
            Language::English,
            "2 aligned pairs have another scan or print",
        ),
        (
            Language::Vietnamese,
            "2 cặp đã căn chỉnh có bản quét hoặc bản in khác",
        ),
    ] {
        let shown = shown(&run, language);
        assert!(shown.contains(text), "{shown}");
    }
    let after = shown(&run, Language::English);
    assert!(!after.contains("Everything is aligned"), "{after}");
}

#[test]
fn blocks_with_other_files_are_named_in_both_languages() {
    let mut run = running(vec![block("b1", JobStatus::Done)]);
    run.is_running = false;
    run.counts.jobs = BTreeMap::from([(JobStatus::Done, 20)]);
    let shown =
        |run: &RunState, language| controls(&Visit::in_language(language), run).into_string();
    let before = shown(&run, Language::English);
    assert!(before.contains("Everything is aligned"), "{before}");
    assert!(!before.contains("other-block-files"), "{before}");
    run.blocks.0[0].other_files = true;
    let moved = shown(&run, Language::English);
    assert!(moved.contains("Look for changed files<"), "{moved}");
    run.changed_blocks = 1;
    for (language, text, button) in [
        (
            Language::English,
            "Blocks with another scan, page or labels than before: 1.",
            "Cut 1 block again<",
        ),
        (
            Language::Vietnamese,
            "Số ván có bản quét, trang in hoặc nhãn khác so với trước: 1.",
            "Cắt lại 1 ván<",
        ),
    ] {
        let shown = shown(&run, language);
        assert!(shown.contains(button), "{shown}");
        assert!(shown.contains(text), "{shown}");
        assert!(!shown.contains("Everything is aligned"), "{shown}");
    }
}

#[test]
fn an_interrupted_pair_with_outdated_results_is_counted_once() {
    let mut run = running(Vec::new());
    run.is_running = false;
    let entry = |why, pairs| PlanEntry {
        from: Stage::Fit,
        why,
        changes: None,
        pairs,
    };
    // Four of the ten pairs that wait were interrupted, and their meshes have changed since.
    run.counts.stale = 4;
    run.plan = Some(Plan {
        entries: vec![entry(StaleReason::New, 6), entry(StaleReason::Mesh, 4)],
        done: 10,
        ..Plan::default()
    });
    let shown = |run: &RunState, language| {
        let visit = Visit::in_language(language);
        controls(&visit, run).into_string()
    };
    let english = shown(&run, Language::English);
    assert!(english.contains("Align 10 pairs<"), "{english}");
    assert!(
        english.contains(">4 of the pairs to align had other settings"),
        "{english}"
    );
    let vietnamese = shown(&run, Language::Vietnamese);
    assert!(
        vietnamese.contains(">4 trong số các cặp cần căn chỉnh"),
        "{vietnamese}"
    );
    if let Some(plan) = &mut run.plan {
        plan.entries.remove(0);
    }
    let all = shown(&run, Language::English);
    assert!(all.contains("Align 4 pairs<"), "{all}");
    assert!(
        all.contains(">The pairs to align had other settings"),
        "{all}"
    );
    assert_eq!(all.matches("4 ").count(), 1, "one number: {all}");
}

#[test]
fn blocks_to_align_again_keep_the_project_unfinished() {
    let mut run = running(vec![block("b1", JobStatus::Done)]);
    run.is_running = false;
    run.counts.jobs = BTreeMap::from([(JobStatus::Done, 20)]);
    let shown = |run: &RunState, language| {
        let visit = Visit::in_language(language);
        controls(&visit, run).into_string()
    };
    let before = shown(&run, Language::English);
    assert!(before.contains("Everything is aligned"), "{before}");
    run.outdated_blocks = 1;
    let english = shown(&run, Language::English);
    for part in ["Align 1 block<", "1 block has other control points"] {
        assert!(english.contains(part), "{part}: {english}");
    }
    assert!(!english.contains("Everything is aligned"), "{english}");
    let vietnamese = shown(&run, Language::Vietnamese);
    assert!(vietnamese.contains("1 ván có điểm tự chọn"), "{vietnamese}");
}

#[test]
fn failed_blocks_are_counted_and_listed() {
    let mut run = running(vec![block("b1", JobStatus::Quarantined)]);
    run.is_running = false;
    run.counts.jobs = BTreeMap::from([(JobStatus::Done, 20)]);
    let visit = Visit::in_language(Language::English);
    let counted = figures(&visit, &run).into_string();
    let figure = "href=\"blocks?state=failed\"><b>1</b><span>block failed<";
    assert!(counted.contains(figure), "{counted}");
    let listed = failed_block_list(&visit, &run.blocks).into_string();
    assert!(listed.contains("href=\"block/b1/\">b1<"), "{listed}");
    let next = controls(&visit, &run).into_string();
    assert!(!next.contains("Everything is aligned"), "{next}");
}

#[test]
fn pairs_that_are_only_read_ahead_count_as_waiting() {
    let mut run = running(vec![block("b1", JobStatus::Leased)]);
    run.counts.jobs = BTreeMap::from([
        (JobStatus::Done, 10),
        (JobStatus::Leased, 3),
        (JobStatus::Ready, 7),
    ]);
    if let Some(metrics) = &mut run.workers[0].metrics {
        metrics.jobs = 1;
    }
    let visit = Visit::in_language(Language::English);
    let shown = figures(&visit, &run).into_string();
    for part in [
        "<b>9</b><span>waiting<",
        "<b>1</b><span>running<",
        "<b>1</b><span>block running<",
    ] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    run.counts.jobs.remove(&JobStatus::Leased);
    let shown = figures(&visit, &run).into_string();
    assert!(!shown.contains("<b>0</b><span>running<"), "{shown}");
}
