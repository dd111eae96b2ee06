//! Leases of blocks that are lost: what a worker stores under them is refused.

use super::blocks::{block, continued, done, failed, inputs, world};
use super::register;
use crate::{
    BlockInputVersions, BlockJob, CheckpointOutcome, DeadWorker, FailureAction, Lease,
    RetrySelection,
};
use mocban_core::domain::BlockStage;

#[tokio::test]
async fn the_lease_of_a_dead_worker_is_recovered_and_its_writes_are_refused() {
    let world = world().await;
    let (lease, work) = world.leased_block().await;
    // A second claim of the same worker returns the same lease: the reply to the first may have been lost.
    assert_eq!(world.leased_block().await.0, lease);
    let other = register(&world.catalog).await;
    assert!(world.claim_block(other).await.is_none());
    let recovered = world
        .catalog
        .recover(DeadWorker::AllExcept(other), 60)
        .await;
    assert_eq!(recovered.expect("a recovery").blocks, 1);
    let stage = done(&work, BlockStage::Face);
    let lost = lease.clone();
    let late = world.catalog.checkpoint_block(lease, stage.clone()).await;
    assert_eq!(late.expect("a reply"), CheckpointOutcome::Refused);
    let [kept, late_ones] = ["mesh", "other"].map(|mesh| inputs([mesh, "page", "labels"]));
    let store = async |lease: &Lease<BlockJob>, seen: &BlockInputVersions| {
        let stored = world
            .catalog
            .store_leased_inputs(lease.clone(), seen.clone(), 0);
        stored.await.expect("a reply")
    };
    assert!(!store(&lost, &late_ones).await);
    let (lease, _) = world.claim_block(other).await.expect("a ready block");
    assert!(store(&lease, &kept).await);
    assert!(!store(&lost, &late_ones).await);
    let known = world.catalog.known_blocks().await.expect("a read");
    assert_eq!(known[0].inputs, kept);
    let advanced = world
        .catalog
        .checkpoint_block(lease.clone(), stage.clone())
        .await;
    let advanced = continued(advanced.expect("a reply"));
    assert_eq!(advanced.cursor(), BlockStage::Align);
    // The reply was lost, and the worker sends the same checkpoint again.
    let attempts = async || {
        let detail = world.catalog.block(&block("b")).await.expect("a read");
        detail.expect("the block").attempts.len()
    };
    let before = attempts().await;
    let again = world.catalog.checkpoint_block(lease, stage).await;
    assert_eq!(again.expect("a reply"), CheckpointOutcome::Lease(advanced));
    assert_eq!(attempts().await, before);
}

/// A worker sends a failure or a release again if the connection broke, because it may have been stored.
#[tokio::test]
async fn a_failure_or_a_release_that_is_sent_again_is_stored_once() {
    let world = world().await;
    let (lease, work) = world.leased_block().await;
    for _ in 0..2 {
        let released = world.catalog.release_block(lease.clone()).await;
        assert!(released.expect("a reply"));
    }
    let (lease, _) = world.leased_block().await;
    assert_eq!(lease.attempt(), 1);
    let refused = failed(&work, BlockStage::Face, FailureAction::Quarantine);
    for _ in 0..2 {
        let stored = world.catalog.fail_block(lease.clone(), refused.clone());
        assert!(stored.await.expect("a reply"));
    }
    let detail = world.catalog.block(&block("b")).await.expect("a read");
    assert_eq!(detail.expect("the block").attempts.len(), 1);
    let names = RetrySelection::Names(vec![block("b")]);
    let none = RetrySelection::Names(Vec::new());
    let retried = world.catalog.retry_pairs_and_blocks(&none, &names).await;
    assert_eq!(retried.expect("stored"), [0, 1]);
    // Another lease has begun, so neither was stored under this one.
    let (other, _) = world.leased_block().await;
    let late = world.catalog.fail_block(lease.clone(), refused).await;
    assert!(!late.expect("a reply"));
    let late = world.catalog.release_block(lease).await;
    assert!(!late.expect("a reply"));
    assert_eq!(world.leased_block().await.0, other);
}

#[tokio::test]
async fn a_block_that_kills_its_workers_is_quarantined() {
    let world = world().await;
    let mut worker = world.worker;
    for crashes in 1..=3 {
        assert!(world.claim_block(worker).await.is_some(), "{crashes}");
        worker = register(&world.catalog).await;
        let recovered = world
            .catalog
            .recover(DeadWorker::AllExcept(worker), 60)
            .await;
        let ready = u64::from(crashes < 3);
        assert_eq!(recovered.expect("a recovery").blocks, ready, "{crashes}");
    }
    let states = world.catalog.block_states().await.expect("a read");
    let failure = states[0].failure.clone().expect("a failure");
    let message = "3 workers died or hung over it at face";
    assert_eq!(failure.failure.message, message);
    assert_eq!(world.requeue_blocks([9; 4]).await, []);
}
