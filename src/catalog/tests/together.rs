//! Stages of a pair that are stored in one commit.

use super::{World, name};
use crate::catalog::{CheckpointOutcome, Lease, PairDetail};
use crate::domain::Stage;

/// Stores stages under a lease in one commit.
async fn store(world: &World, lease: Lease, stages: &[Stage]) -> CheckpointOutcome {
    let done = stages.iter().map(|stage| world.done(*stage)).collect();
    let kept = world.catalog.checkpoint_in_time(lease, done).await;
    kept.expect("stored")
}

async fn detail(world: &World, pair: &str) -> PairDetail {
    let detail = world.catalog.pair(&name(pair)).await.expect("a read");
    detail.expect("the pair")
}

/// The fingerprint that the job's results were made with, where they follow on each other.
async fn made(world: &World, pair: i64) -> Option<i64> {
    let mut conn = world.catalog.read_conn().await.expect("a reader");
    let made = sqlx::query_scalar("SELECT made FROM job WHERE pair = ?1").bind(pair);
    made.fetch_one(&mut *conn).await.expect("the job")
}

#[tokio::test]
async fn stages_stored_together_leave_what_they_leave_one_by_one() {
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
    world.counters_hold().await;
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
        assert_eq!(made(&world, number).await, made(&world, 1).await);
        assert!(made(&world, number).await.is_some());
    }
    world.counters_hold().await;
}

#[tokio::test]
async fn results_that_do_not_follow_on_each_other_are_not_taken_for_one_chain() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.remove(0);
    let way = [Stage::Fit, Stage::Depth, Stage::Normalize, Stage::Depth];
    let CheckpointOutcome::Lease(lease) = store(&world, lease, &way).await else {
        panic!("stages are left");
    };
    assert_eq!(lease.cursor(), Stage::Normalize);
    assert_eq!(made(&world, 1).await, None);
    world.counters_hold().await;
    // From the first stage on it is one again.
    let again = [Stage::Normalize, Stage::Fit, Stage::Depth];
    store(&world, lease, &again).await;
    assert!(made(&world, 1).await.is_some());
    world.counters_hold().await;
}
