//! Operations on a server that are given up after a stop request. Only in the module `tests_on_postgres`.

use super::{World, fingerprints};
use crate::db::conn::Conn;
use crate::db::postgres::LOCK_FOR_ANY_PLAN;
use crate::db::query::{query, query_scalar};
use crate::{CheckpointOutcome, RerunPolicy};
use mocban_core::domain::Stage;

/// The transaction of the operation that was given up must not contain later ones, which would be lost with it.
#[tokio::test]
async fn a_checkpoint_after_an_operation_that_was_given_up_is_stored() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.remove(0);
    let mut other = world.place.conn().await;
    if matches!(other, Conn::Sqlite(_)) {
        return;
    }
    for statement in ["BEGIN", LOCK_FOR_ANY_PLAN] {
        let held = query(statement).execute(&mut other);
        held.await.expect("held");
    }
    world.catalog.stop_waiting();
    let fingerprints = fingerprints([1; 4]);
    let policy = RerunPolicy::Changed;
    let waiting = world.catalog.requeue_stale(&fingerprints, None, policy);
    let given_up = waiting.await.expect_err("the lock is held");
    assert!(given_up.is_unavailable(), "{given_up}");
    query("ROLLBACK")
        .execute(&mut other)
        .await
        .expect("released");
    let done = world.done(Stage::Fit);
    let kept = world.catalog.checkpoint_now(lease, done).await;
    assert!(matches!(kept, Ok(CheckpointOutcome::Lease(_))), "{kept:?}");
    let stage = query_scalar("SELECT stage FROM job").fetch_one(&mut other);
    let stage: i64 = stage.await.expect("a read");
    assert_eq!(stage, 1);
    world.assert_counters().await;
}
