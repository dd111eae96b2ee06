//! Recovery of the pairs of dead workers, and crashes that are blamed on a pair.

use super::blocks::attributes;
use super::protocol::status;
use super::{World, name, observed, register};
use crate::lease_recovery::CRASH_LIMIT;
use crate::{CheckpointOutcome, ClaimRequest, DeadWorker};
use mocban_core::domain::{FailureClass, JobStatus, Stage};

#[tokio::test]
async fn the_third_crash_quarantines_the_pair_with_a_message() {
    let world = World::new(1).await;
    for crash in 1..=CRASH_LIMIT {
        let worker = register(&world.catalog).await;
        let request = ClaimRequest {
            exclusive: crash > 1,
            ..ClaimRequest::new(worker, 1, 1_000)
        };
        assert_eq!(
            world.catalog.claim(request).await.expect("a claim").len(),
            1
        );
        let holders = world.catalog.lease_holders().await.expect("a read");
        assert_eq!(holders.len(), 1);
        let recover = world.catalog.recover(observed(holders), 60);
        recover.await.expect("a recovery");
        world.assert_counters().await;
    }
    let failures = world.catalog.failures(10).await.expect("a read");
    assert_eq!(failures[0].failure.failure.class, FailureClass::Resource);
    let text = &failures[0].failure.failure.message;
    assert!(text.contains("3 workers died"), "{text}");
}

#[tokio::test]
async fn a_worker_with_a_newer_heartbeat_than_observed_is_not_dead() {
    let world = World::new(1).await;
    let worker = register(&world.catalog).await;
    let request = ClaimRequest::new(worker, 1, 1_000);
    world.catalog.claim(request).await.expect("a claim");
    let seen = world.catalog.lease_holders().await.expect("a read");
    let heartbeat = world.catalog.heartbeat(worker, 500, 0, None);
    assert!(heartbeat.await.expect("an answer"));
    let recover = async |holders| {
        let dead = observed(holders);
        world
            .catalog
            .recover(dead, 600)
            .await
            .expect("a recovery")
            .ready
    };
    assert_eq!(recover(seen).await, 0);
    assert_eq!(status(&world, "p0").await, JobStatus::Leased);
    let seen = world.catalog.lease_holders().await.expect("a read");
    let too_old = DeadWorker::Observed {
        workers: seen.clone(),
        valid_until: std::time::Instant::now(),
    };
    let late = world.catalog.recover(too_old, 600).await;
    assert_eq!(late.expect("a recovery").ready, 0);
    assert_eq!(recover(seen).await, 1);
    world.assert_counters().await;
}

#[tokio::test]
async fn repeated_kills_from_outside_quarantine_no_pair() {
    let world = World::new(1).await;
    for round in 0..8 {
        // One worker dies before its first claim, and the next worker dies while it holds the pair.
        register(&world.catalog).await;
        let worker = register(&world.catalog).await;
        let request = ClaimRequest {
            exclusive: round > 0,
            ..ClaimRequest::new(worker, 1, 1_000)
        };
        assert_eq!(
            world.catalog.claim(request).await.expect("a claim").len(),
            1
        );
        world.recovered_by_another(1).await;
    }
    world.assert_counters().await;
}

#[tokio::test]
async fn pairs_leased_together_at_a_death_run_exclusively_but_are_not_blamed() {
    let world = World::new(2).await;
    assert_eq!(world.claim(2).await.len(), 2);
    let other = world.recovered_by_another(2).await;
    let detail = world.catalog.pair(&name("p1")).await.expect("a read");
    assert_eq!(detail.expect("the pair").crashes, 0);
    assert!(world.claim_as(other, 2).await.is_empty());
}

#[tokio::test]
async fn leases_of_a_worker_that_ended_properly_do_not_count_as_crashes() {
    let world = World::new(1).await;
    drop(world.claim(1).await);
    let ended = world.catalog.end_worker(world.worker, 50, None).await;
    ended.expect("ended");
    world.recovered_by_another(1).await;
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    assert_eq!(detail.expect("the pair").crashes, 0);
}

#[tokio::test]
async fn a_finished_stage_resets_the_crash_count() {
    let world = World::new(1).await;
    drop(world.claim(1).await);
    let other = world.recovered_by_another(1).await;
    let lease = world.claim_exclusive(other).await.remove(0);
    assert_eq!(world.crashes("p0").await, 1);
    let kept = world
        .catalog
        .checkpoint_now(lease, world.done(Stage::Fit))
        .await;
    let Ok(CheckpointOutcome::Lease(lease)) = kept else {
        panic!("the checkpoint was not stored")
    };
    assert_eq!(lease.attempt(), 1);
    assert_eq!(world.crashes("p0").await, 0);
}

#[tokio::test]
async fn an_overdue_lease_of_a_living_worker_is_recovered() {
    let world = World::new(1).await;
    drop(world.claim(1).await);
    let other = register(&world.catalog).await;
    // The deadline is 1000 by the worker's own clock, and the margin is 60. Other clocks do not matter.
    for (heartbeat, recovered) in [(1_060, 0), (1_061, 1)] {
        assert!(
            world
                .catalog
                .heartbeat(world.worker, heartbeat, 0, None)
                .await
                .expect("stored")
        );
        let own = world.catalog.recover_overdue(world.worker, 60, 9_000_000);
        assert_eq!(own.await.expect("a recovery").ready, 0);
        let by_others = world.catalog.recover_overdue(other, 60, 9_000_000);
        assert_eq!(by_others.await.expect("a recovery").ready, recovered);
    }
    world.assert_counters().await;
}

#[tokio::test]
async fn a_death_with_a_pair_and_a_block_blames_neither() {
    let world = World::new(1).await;
    world.import_block(attributes("b")).await;
    assert_eq!(world.claim(1).await.len(), 1);
    world.leased_block().await;
    let other = register(&world.catalog).await;
    let recovered = world.catalog.recover(DeadWorker::AllExcept(other), 60);
    let recovered = recovered.await.expect("a recovery");
    assert_eq!((recovered.ready, recovered.blocks), (1, 1));
    assert_eq!(world.crashes("p0").await, 0);
    let blocks = world.catalog.block_states().await.expect("a read");
    assert_eq!(blocks[0].crashes, 0);
}
