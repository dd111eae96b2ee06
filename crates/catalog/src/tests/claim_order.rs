//! Claims that begin behind earlier ones, which only those on a server do. Every ready pair is still found.

use super::{World, register};
use crate::{CheckpointOutcome, Lease};
use mocban_core::domain::Stage;

fn pairs(leases: &[Lease]) -> Vec<i64> {
    leases.iter().map(|lease| lease.pair().0).collect()
}

#[tokio::test]
async fn a_pair_that_another_process_releases_is_claimed_again() {
    let world = World::new(8).await;
    let other = world.place.open().await.expect("the catalog");
    let mut first = world.claim(2).await;
    assert_eq!(pairs(&world.claim(2).await), [3, 4]);
    assert!(other.release(first.remove(0)).await.expect("released"));
    // There are not enough pairs behind 4.
    assert_eq!(pairs(&world.claim(5).await), [1, 5, 6, 7, 8]);
    assert!(other.release(first.remove(0)).await.expect("released"));
    assert_eq!(pairs(&world.claim(5).await), [2]);
    world.assert_counters().await;
}

#[tokio::test]
async fn a_pair_that_this_process_releases_is_claimed_next() {
    let world = World::new(8).await;
    let mut first = world.claim(3).await;
    assert_eq!(pairs(&world.claim(2).await), [4, 5]);
    let lease = first.remove(1);
    assert!(world.catalog.release(lease).await.expect("released"));
    assert_eq!(pairs(&world.claim(2).await), [2, 6]);
}

#[tokio::test]
async fn pairs_with_other_next_stages_are_found() {
    let world = World::new(6).await;
    let other = world.place.open().await.expect("the catalog");
    let worker = register(&other).await;
    let mut first = world.claim_as(worker, 3).await;
    assert_eq!(pairs(&world.claim(1).await), [4]);
    let done = world.done(Stage::Fit);
    let lease = other.checkpoint_now(first.remove(0), done).await;
    let Ok(CheckpointOutcome::Lease(lease)) = lease else {
        panic!("the checkpoint was not stored")
    };
    for lease in [lease, first.remove(0)] {
        assert!(other.release(lease).await.expect("released"));
    }
    // The most advanced pair is first.
    assert_eq!(pairs(&world.claim(6).await), [1, 2, 5, 6]);
    assert!(world.claim(1).await.is_empty());
    world.assert_counters().await;
}
