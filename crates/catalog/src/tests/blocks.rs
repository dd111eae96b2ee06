//! Blocks: import, leases, results, and the pairs that are cut from them.

use serde_json::json;

use super::World;
use crate::{
    BlockAttributes, BlockInputVersions, BlockJob, BlockProvenance, BlockReason, BlockSettings,
    BlockWork, CatalogError, CheckpointOutcome, CutPair, CutReply, CutSummary, FailureAction,
    InputVersion, Lease, NewCharacter, RerunPolicy, RetrySelection, StageCheckpoint, StageFailure,
};
use mocban_core::domain::{
    ArtifactSet, BlockCharacterState, BlockName, BlockStage, ContentHash, Failure, FailureClass,
    JobStatus, PairName, WorkerId,
};

pub(super) fn block(text: &str) -> BlockName {
    BlockName::new(text).expect("a valid name")
}

pub(super) fn attributes(text: &str) -> BlockAttributes {
    BlockAttributes {
        name: block(text),
        mesh_path: format!("{text}.stl"),
        page_path: format!("{text}.png"),
        labels_path: Some(format!("{text}.json")),
        unit: None,
        side: None,
        meta: None,
    }
}

pub(super) fn settings(revision: [u32; 4]) -> BlockSettings {
    BlockSettings::new(|stage| json!({ "revision": revision[stage.index()] }))
}

pub(super) fn version(text: &str) -> InputVersion {
    InputVersion {
        hash: ContentHash::of(text.as_bytes()),
        stat: format!("{text} stat"),
    }
}

pub(super) fn inputs(texts: [&str; 3]) -> BlockInputVersions {
    BlockInputVersions {
        mesh: Some(version(texts[0])),
        page: Some(version(texts[1])),
        labels: Some(version(texts[2])),
    }
}

pub(super) fn done(work: &BlockWork, stage: BlockStage) -> StageCheckpoint<BlockJob> {
    let inputs = inputs(["mesh", "page", "labels"]);
    let settings = settings([1; 4]);
    StageCheckpoint {
        stage,
        outcome: json!({ "stage": stage }).to_string(),
        files: ArtifactSet::new(),
        result_hash: ContentHash::of(stage.name().as_bytes()),
        metrics: Vec::new(),
        provenance: BlockProvenance::new(
            stage,
            settings.of(stage),
            &work.attributes,
            &inputs,
            work.control_points.as_ref(),
        ),
        inputs,
        ms: 5,
        at: 100,
        next_deadline: 2_000,
        alive_since: 0,
        write_began: std::time::Instant::now(),
    }
}

/// A character whose files have this content.
pub(super) fn character(label: &str, content: &str) -> NewCharacter {
    NewCharacter {
        label: label.to_owned(),
        character: Some("天".to_owned()),
        bounds: [1.0, 2.0, 30.5, 40.25],
        confidence: Some(0.75),
        maps: Some(json!({ "page_from_crop": [1, 2] })),
        cut: Ok(CutPair {
            mesh_path: format!("artifacts/{content}.ply"),
            mesh: version(content),
            print_path: format!("artifacts/{content}.png"),
            print: version(&format!("{content} print")),
            unit: None,
            scanned_face_down: None,
            prior: Some(json!({ "angle_deg": 0.5 }).to_string()),
        }),
    }
}

/// Returns the lease after a checkpoint.
pub(super) fn continued(outcome: CheckpointOutcome<BlockJob>) -> Lease<BlockJob> {
    match outcome {
        CheckpointOutcome::Lease(lease) => lease,
        other => panic!("the lease ended: {other:?}"),
    }
}

impl World {
    pub(super) async fn claim_block(
        &self,
        worker: WorkerId,
    ) -> Option<(Lease<BlockJob>, BlockWork)> {
        let claim = self.catalog.claim_block(worker, 1_000, 0, None);
        claim.await.expect("a claim")
    }

    pub(super) async fn leased_block(&self) -> (Lease<BlockJob>, BlockWork) {
        self.claim_block(self.worker).await.expect("a ready block")
    }

    /// Runs the remaining stages of the next block. The last one cuts these characters.
    pub(super) async fn finish_block(&self, characters: Vec<NewCharacter>) -> CutReply {
        let (mut lease, work) = self.leased_block().await;
        while lease.cursor() != BlockStage::Cut {
            let stage = done(&work, lease.cursor());
            let stored = self.catalog.checkpoint_block(lease, stage).await;
            lease = continued(stored.expect("stored"));
        }
        let stage = done(&work, BlockStage::Cut);
        let cut = self.catalog.finish_cut(lease, stage, characters).await;
        cut.expect("stored")
    }

    /// Requeues stale blocks, and returns why each would run.
    pub(super) async fn requeue_blocks(
        &self,
        revision: [u32; 4],
    ) -> Vec<(BlockStage, BlockReason)> {
        let settings = settings(revision);
        let policy = RerunPolicy::Changed;
        let plan = self.catalog.plan_blocks(&settings, policy, None).await;
        let requeued = self
            .catalog
            .requeue_stale_blocks(&settings, policy, None)
            .await;
        requeued.expect("requeued");
        let plan = plan.expect("a plan").into_iter();
        plan.map(|entry| (entry.from, entry.why)).collect()
    }

    pub(super) async fn import_block(&self, row: BlockAttributes) {
        let imported = self.catalog.import_blocks(vec![row], false, 1).await;
        imported.expect("imported");
    }

    pub(super) async fn character_states(
        &self,
    ) -> Vec<(String, BlockCharacterState, Option<String>)> {
        let characters = self.catalog.block_characters(&block("b")).await;
        let characters = characters.expect("a read").into_iter();
        characters
            .map(|one| (one.label, one.state, one.pair))
            .collect()
    }
}

pub(super) async fn world() -> World {
    let world = World::new(0).await;
    world.import_block(attributes("b")).await;
    world
}

pub(super) fn stored(added: u64, changed: u64, unchanged: u64, retired: u64) -> CutReply {
    CutReply::Stored(CutSummary {
        added,
        changed,
        unchanged,
        retired,
        judged: 0,
        restored: 0,
    })
}

#[tokio::test]
async fn an_import_is_idempotent_and_names_what_changed() {
    let world = world().await;
    let again = world
        .catalog
        .import_blocks(vec![attributes("b")], false, 2)
        .await;
    let again = again.expect("imported");
    assert_eq!((again.added, again.unchanged), (0, 1));
    let other = BlockAttributes {
        page_path: "other.png".to_owned(),
        labels_path: None,
        ..attributes("b")
    };
    let changed = world.catalog.import_blocks(vec![other], true, 2).await;
    let changed = changed.expect("imported").changed;
    assert_eq!(changed, [(block("b"), vec!["page", "labels"])]);
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
    assert_eq!(world.catalog.block_names().await.expect("a read").len(), 1);
}

#[tokio::test]
async fn changes_make_the_right_stages_stale() {
    let world = world().await;
    world.finish_block(vec![character("a", "a")]).await;
    let known = world.catalog.known_blocks().await.expect("a read");
    let id = known[0].block;
    for (texts, revision, from, why) in [
        (
            ["new", "page", "labels"],
            [1; 4],
            BlockStage::Face,
            BlockReason::Mesh,
        ),
        (
            ["mesh", "new", "labels"],
            [1; 4],
            BlockStage::Align,
            BlockReason::Page,
        ),
        (
            ["mesh", "page", "new"],
            [1; 4],
            BlockStage::Boxes,
            BlockReason::Labels,
        ),
        (
            ["mesh", "page", "labels"],
            [1, 2, 1, 1],
            BlockStage::Align,
            BlockReason::Settings,
        ),
        (
            ["mesh", "page", "labels"],
            [1, 1, 1, 2],
            BlockStage::Cut,
            BlockReason::Settings,
        ),
    ] {
        let seen = vec![(id, inputs(texts))];
        world
            .catalog
            .store_block_inputs(seen)
            .await
            .expect("stored");
        assert_eq!(world.requeue_blocks(revision).await, [(from, why)]);
        let lease = world.leased_block().await;
        assert_eq!(lease.0.cursor(), from);
        assert_eq!(lease.1.results.len(), from.index());
        world
            .catalog
            .release_block(lease.0)
            .await
            .expect("released");
        // The stages compute the old inputs again.
        world.finish_block(vec![character("a", "a")]).await;
    }
    let other_side = BlockAttributes {
        side: Some(mocban_core::domain::BlockSide::Back),
        ..attributes("b")
    };
    world.import_block(other_side).await;
    let requeued = world.requeue_blocks([1; 4]).await;
    assert_eq!(requeued, [(BlockStage::Face, BlockReason::Attributes)]);
}

pub(super) fn failed(
    work: &BlockWork,
    stage: BlockStage,
    action: FailureAction,
) -> StageFailure<BlockJob> {
    let done = done(work, stage);
    StageFailure {
        stage,
        failure: Failure::new(
            FailureClass::NoSolution,
            "b.png: the page is of another block",
        ),
        action,
        provenance: done.provenance,
        inputs: done.inputs,
        ms: Some(3),
        at: 100,
        alive_since: 0,
    }
}

#[tokio::test]
async fn an_earlier_stage_that_is_computed_again_continues_with_the_stage_after_it() {
    let world = world().await;
    let (mut lease, work) = world.leased_block().await;
    for stage in [
        BlockStage::Face,
        BlockStage::Align,
        BlockStage::Face,
        BlockStage::Align,
    ] {
        let stored = world.catalog.checkpoint_block(lease, done(&work, stage));
        lease = continued(stored.await.expect("stored"));
        assert_eq!(Some(lease.cursor), stage.next());
    }
}

#[tokio::test]
async fn a_failed_block_runs_again_after_an_import_with_another_page() {
    let world = world().await;
    let (lease, work) = world.leased_block().await;
    let refused = failed(&work, BlockStage::Face, FailureAction::Quarantine);
    let stored = world.catalog.fail_block(lease, refused).await;
    assert!(stored.expect("stored"));
    let mut attributes = work.attributes.clone();
    for (page, expected) in [
        (attributes.page_path.clone(), JobStatus::Quarantined),
        ("elsewhere.png".to_owned(), JobStatus::Ready),
    ] {
        attributes.page_path = page;
        let import = world
            .catalog
            .import_blocks(vec![attributes.clone()], false, 9);
        import.await.expect("imported");
        let states = world.catalog.block_states().await.expect("a read");
        assert_eq!(states[0].status, expected);
    }
}

#[tokio::test]
async fn a_missing_file_restarts_no_stage_of_the_block_that_failed_on_it() {
    let world = world().await;
    let (mut lease, work) = world.leased_block().await;
    for stage in [BlockStage::Face, BlockStage::Align] {
        let stored = world.catalog.checkpoint_block(lease, done(&work, stage));
        lease = continued(stored.await.expect("stored"));
    }
    let mut refused = failed(&work, BlockStage::Boxes, FailureAction::Quarantine);
    let gone = InputVersion::gone();
    refused.provenance.page = Some(gone.hash);
    refused.inputs.page = Some(gone);
    let stored = world.catalog.fail_block(lease, refused).await;
    assert!(stored.expect("stored"));
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
    let block = world.catalog.known_blocks().await.expect("a read")[0].block;
    let back = BlockInputVersions {
        page: Some(version("page")),
        ..BlockInputVersions::default()
    };
    let stored = world.catalog.store_block_inputs(vec![(block, back)]).await;
    stored.expect("stored");
    let requeued = world.requeue_blocks([1; 4]).await;
    assert_eq!(requeued, [(BlockStage::Boxes, BlockReason::FailedBefore)]);
}

#[tokio::test]
async fn a_refused_block_stays_until_a_retry_or_another_page() {
    let world = world().await;
    let (lease, work) = world.leased_block().await;
    let refused = failed(&work, BlockStage::Face, FailureAction::Quarantine);
    let stored = world.catalog.fail_block(lease, refused).await;
    assert!(stored.expect("stored"));
    assert!(world.claim_block(world.worker).await.is_none());
    assert_eq!(world.requeue_blocks([1; 4]).await, []);
    let states = world.catalog.block_states().await.expect("a read");
    let failure = states[0].failure.clone().expect("a failure");
    assert_eq!(
        failure.failure.message,
        "b.png: the page is of another block"
    );
    let other = RerunPolicy::Failed;
    let plan = world
        .catalog
        .plan_blocks(&settings([1; 4]), other, None)
        .await
        .expect("a plan");
    assert_eq!(plan[0].why, BlockReason::Requested);
    let known = world.catalog.known_blocks().await.expect("a read");
    let seen = vec![(known[0].block, inputs(["other", "page", "labels"]))];
    world
        .catalog
        .store_block_inputs(seen)
        .await
        .expect("stored");
    let requeued = world.requeue_blocks([1; 4]).await;
    assert_eq!(requeued, [(BlockStage::Face, BlockReason::FailedBefore)]);
    let (lease, work) = world.leased_block().await;
    let refused = failed(&work, BlockStage::Face, FailureAction::Quarantine);
    world
        .catalog
        .fail_block(lease, refused)
        .await
        .expect("stored");
    let names = RetrySelection::Names(vec![block("b")]);
    let unknown = RetrySelection::Names(vec![PairName::new("none").expect("a name")]);
    let refused = world.catalog.retry_pairs_and_blocks(&unknown, &names).await;
    assert!(matches!(refused, Err(CatalogError::UnknownPair(_))));
    let none = RetrySelection::Names(Vec::new());
    let retried = world.catalog.retry_pairs_and_blocks(&none, &names).await;
    assert_eq!(retried.expect("stored"), [0, 1]);
    assert_eq!(world.leased_block().await.0.attempt(), 1);
}

#[tokio::test]
async fn a_block_backs_off_and_becomes_due() {
    let world = world().await;
    let (lease, work) = world.leased_block().await;
    let waits = failed(
        &work,
        BlockStage::Face,
        FailureAction::BackOff { run_at: 500 },
    );
    assert!(
        world
            .catalog
            .fail_block(lease, waits)
            .await
            .expect("stored")
    );
    let left = world
        .catalog
        .outstanding_blocks(None)
        .await
        .expect("a read");
    assert_eq!(
        (left.backoff, left.next_due, left.left()),
        (1, Some(500), 1)
    );
    assert_eq!(
        world
            .catalog
            .release_due_blocks(499, 1_000)
            .await
            .expect("a reply"),
        0
    );
    assert_eq!(
        world
            .catalog
            .release_due_blocks(500, 1_000)
            .await
            .expect("a reply"),
        1
    );
    assert_eq!(world.leased_block().await.0.attempt(), 2);
}
