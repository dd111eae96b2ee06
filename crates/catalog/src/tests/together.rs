//! Several stages of a pair in one commit.

use super::{World, fingerprints, name};
use crate::db::query::query_as;
use crate::{CheckpointOutcome, Lease, PairDetail, RerunPolicy};
use mocban_core::domain::Stage;

/// Stores stages under a lease in one commit.
async fn store(world: &World, lease: Lease, stages: &[Stage]) -> CheckpointOutcome {
    let done = stages.iter().map(|stage| world.done(*stage)).collect();
    let kept = world.catalog.checkpoint(lease, done).await;
    kept.expect("stored")
}

async fn detail(world: &World, pair: &str) -> PairDetail {
    let detail = world.catalog.pair(&name(pair)).await.expect("a read");
    detail.expect("the pair")
}

/// The job's fingerprint, and whether it is marked dirty.
async fn fingerprint(world: &World, pair: i64) -> (Option<i64>, bool) {
    let mut conn = world.catalog.read_conn().await.expect("a connection");
    let job = query_as("SELECT fingerprint, dirty FROM job WHERE pair = ?1").bind(pair);
    job.fetch_one(&mut conn).await.expect("the job")
}

#[tokio::test]
async fn stages_stored_together_leave_the_same_rows_as_one_by_one() {
    let world = World::new(3).await;
    world.finish_one().await;
    let lease = world.claim(1).await.remove(0);
    assert!(matches!(
        store(&world, lease, &Stage::ALL).await,
        CheckpointOutcome::Done
    ));
    let lease = world.claim(1).await.remove(0);
    let CheckpointOutcome::Lease(lease) = store(&world, lease, &Stage::ALL[..2]).await else {
        panic!("two stages are left");
    };
    assert_eq!(lease.cursor(), Stage::Normalize);
    world.assert_counters().await;
    assert!(matches!(
        store(&world, lease, &Stage::ALL[2..]).await,
        CheckpointOutcome::Done
    ));
    let one_by_one = detail(&world, "p0").await;
    for (pair, number) in [("p1", 2), ("p2", 3)] {
        let together = detail(&world, pair).await;
        assert_eq!(together.results.stages, one_by_one.results.stages);
        assert_eq!(together.results.metrics, one_by_one.results.metrics);
        assert_eq!(together.attempts.len(), 4);
        assert_eq!(together.mesh_hash, one_by_one.mesh_hash);
        assert_eq!(together.print_hash, one_by_one.print_hash);
        let found = fingerprint(&world, number).await;
        assert_eq!(found, fingerprint(&world, 1).await);
        assert!(matches!(found, (Some(_), false)), "{found:?}");
    }
    world.assert_counters().await;
}

#[tokio::test]
async fn a_job_with_inconsistent_results_is_dirty_until_they_agree() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.remove(0);
    let order = [Stage::Fit, Stage::Depth, Stage::Normalize, Stage::Depth];
    let CheckpointOutcome::Lease(lease) = store(&world, lease, &order).await else {
        panic!("stages are left");
    };
    assert_eq!(lease.cursor(), Stage::Normalize);
    assert!(fingerprint(&world, 1).await.1);
    world.assert_counters().await;
    // These stages include a new `Fit`, so the results agree again. The next run removes the dirty mark.
    let again = [Stage::Normalize, Stage::Fit, Stage::Depth];
    let CheckpointOutcome::Lease(lease) = store(&world, lease, &again).await else {
        panic!("stages are left");
    };
    world.assert_counters().await;
    assert!(world.catalog.release(lease).await.expect("released"));
    let current = fingerprints([1; 4]);
    let requeued = world
        .catalog
        .requeue_stale(&current, None, RerunPolicy::Changed);
    assert_eq!(requeued.await.expect("requeued"), 0);
    assert!(matches!(fingerprint(&world, 1).await, (Some(_), false)));
    world.assert_counters().await;
}
