//! Failure modes of job queues: late workers, reused ids, busy databases, clock jumps.

use super::{World, enter, fingerprints, inputs, name, register, row, slow_disk};
use crate::db::query::query;
use crate::lease_recovery::CRASH_LIMIT;
use crate::{
    Catalog, CheckpointOutcome, ClaimRequest, DeadWorker, FailureAction, Lease, RerunPolicy,
    StageFailure,
};
use mocban_core::domain::{JobStatus, PairId, Stage, WorkerId};

async fn status(world: &World) -> JobStatus {
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    detail.expect("the pair").results.status
}

/// Worker ids are not reused, even if the newest worker was deleted.
#[tokio::test]
async fn worker_ids_are_not_reused() {
    let world = World::new(1).await;
    let first = register(&world.catalog).await;
    let lease = world.claim_as(first, 1).await.remove(0);
    let me = world.worker;
    let recovered = world.catalog.recover(DeadWorker::AllExcept(me), 60).await;
    assert_eq!(recovered.expect("a recovery").ready, 1);
    let mut conn = world.place.conn().await;
    let removed = query("DELETE FROM worker WHERE id = ?1").bind(first.0);
    removed.execute(&mut conn).await.expect("removed");

    let second = register(&world.catalog).await;
    assert!(second > first, "{second:?} again");
    assert_eq!(world.claim_exclusive(second).await.len(), 1);
    let late = world.catalog.checkpoint_now(lease, world.done(Stage::Fit));
    assert!(matches!(late.await, Ok(CheckpointOutcome::Refused)));
    assert_eq!(status(&world).await, JobStatus::Leased);
}

/// Returns two leases of one worker on the same pair. Another worker recovered the first lease, which was overdue, and
/// then the pair was leased again. Of the values that a write must match, only the token differs.
async fn leased_twice(world: &World) -> [Lease; 2] {
    let late = world.claim(1).await.remove(0);
    let heartbeat = world.catalog.heartbeat(world.worker, 5_000, 0, None).await;
    assert!(heartbeat.expect("an answer"));
    let other = register(&world.catalog).await;
    let overdue = world.catalog.recover_overdue(other, 60, 70).await;
    assert_eq!(overdue.expect("a recovery").ready, 1);
    let again = world.claim_exclusive(world.worker).await.remove(0);
    assert_eq!(
        (again.pair(), again.cursor(), again.token),
        (late.pair(), late.cursor(), late.token + 2)
    );
    [late, again]
}

#[tokio::test]
async fn a_late_checkpoint_under_an_older_lease_of_the_same_worker_changes_nothing() {
    let world = World::new(1).await;
    let [late, again] = leased_twice(&world).await;
    let kept = world
        .catalog
        .checkpoint_now(late, world.done(Stage::Fit))
        .await;
    assert!(matches!(kept, Ok(CheckpointOutcome::Refused)));
    // The job has not advanced either.
    world.assert_counters().await;
    let kept = world
        .catalog
        .checkpoint_now(again, world.done(Stage::Fit))
        .await;
    assert!(matches!(kept, Ok(CheckpointOutcome::Lease(_))));
    world.assert_counters().await;
}

/// Both requests share one commit, and each must get its own reply. A third lease keeps the counters above zero.
/// Otherwise a wrongly stored checkpoint would fail the commit, and each request would be committed on its own.
#[tokio::test]
async fn a_late_checkpoint_in_the_same_commit_changes_nothing() {
    let world = World::new(2).await;
    let late = world.claim(1).await.remove(0);
    let other = world.recovered_by_another(1).await;
    let mut conn = world.place.conn().await;
    let shared = query("UPDATE job SET exclusive = 0");
    shared.execute(&mut conn).await.expect("stored");
    let lease = world.claim_as(other, 2).await.remove(0);
    let mut lost = world.done(Stage::Fit);
    lost.outcome = r#"{"late":true}"#.to_owned();
    // Both requests are sent before either future is polled again.
    let (lost, kept) = tokio::join!(
        world.catalog.checkpoint_now(late, lost),
        world.catalog.checkpoint_now(lease, world.done(Stage::Fit)),
    );
    assert!(matches!(lost, Ok(CheckpointOutcome::Refused)), "{lost:?}");
    assert!(matches!(kept, Ok(CheckpointOutcome::Lease(_))), "{kept:?}");
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    let stages = detail.expect("the pair").results.stages;
    assert_eq!(stages[0].outcome, serde_json::json!({}));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_late_failure_under_an_older_lease_of_the_same_worker_changes_nothing() {
    let world = World::new(1).await;
    let [late, again] = leased_twice(&world).await;
    let quarantine = || slow_disk(world.fingerprints, FailureAction::Quarantine);
    assert!(
        !world
            .catalog
            .fail(late, quarantine())
            .await
            .expect("an answer")
    );
    assert_eq!(status(&world).await, JobStatus::Leased);
    assert!(
        world
            .catalog
            .fail(again, quarantine())
            .await
            .expect("an answer")
    );
    world.assert_counters().await;
}

#[tokio::test]
async fn a_late_release_of_an_older_lease_of_the_same_worker_changes_nothing() {
    let world = World::new(1).await;
    let [late, again] = leased_twice(&world).await;
    assert!(!world.catalog.release(late).await.expect("an answer"));
    assert_eq!(status(&world).await, JobStatus::Leased);
    assert!(world.catalog.release(again).await.expect("an answer"));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_worker_that_ended_completes_and_claims_nothing() {
    let world = World::new(2).await;
    let lease = world.claim(1).await.remove(0);
    let ended = world.catalog.end_worker(world.worker, 50, None).await;
    ended.expect("ended");
    let late = world.catalog.checkpoint_now(lease, world.done(Stage::Fit));
    assert!(matches!(late.await, Ok(CheckpointOutcome::Refused)));
    assert!(world.claim(1).await.is_empty());
    let heartbeat = world.catalog.heartbeat(world.worker, 51, 0, None).await;
    assert!(!heartbeat.expect("an answer"));
}

/// The worker's last heartbeat was at time 1, and nobody has recovered its leases yet.
#[tokio::test]
async fn a_heartbeat_or_checkpoint_after_the_lease_expired_is_refused() {
    let world = World::new(3).await;
    let mut leases = world.claim(2).await;
    let (first, second) = (leases.remove(0), leases.remove(0));
    let mut late = world.done(Stage::Fit);
    late.alive_since = 2;
    let kept = world.catalog.checkpoint_now(first, late).await;
    assert!(matches!(kept, Ok(CheckpointOutcome::Refused)));
    let late = StageFailure {
        alive_since: 2,
        ..slow_disk(world.fingerprints, FailureAction::Quarantine)
    };
    assert!(!world.catalog.fail(second, late).await.expect("an answer"));
    let heartbeat = world.catalog.heartbeat(world.worker, 90, 2, None).await;
    assert!(!heartbeat.expect("an answer"));
    let request = ClaimRequest {
        alive_since: 2,
        ..ClaimRequest::new(world.worker, 1, 1_000)
    };
    assert!(
        world
            .catalog
            .claim(request)
            .await
            .expect("a claim")
            .is_empty()
    );
    assert_eq!(status(&world).await, JobStatus::Leased);
    // Within the lease, all of them are accepted.
    let heartbeat = world.catalog.heartbeat(world.worker, 90, 1, None).await;
    assert!(heartbeat.expect("an answer"));
    assert_eq!(world.claim(1).await.len(), 1);
    world.assert_counters().await;
}

/// Two workers write as fast as they can while pairs are imported and open work is counted.
#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn busy_errors_do_not_reach_callers() {
    let world = World::new(80).await;
    let fingerprints = world.fingerprints;
    let worker = |catalog: Catalog| async move {
        let worker = register(&catalog).await;
        let mut done = 0;
        loop {
            let request = ClaimRequest::new(worker, 1, 1_000);
            let Some(lease) = catalog.claim(request).await.expect("a claim").pop() else {
                return done;
            };
            let stage = lease.cursor();
            let kept = catalog
                .checkpoint_now(lease, super::done(fingerprints, stage))
                .await;
            let CheckpointOutcome::Lease(lease) = kept.expect("stored") else {
                panic!("not the last stage")
            };
            let fail = slow_disk(fingerprints, FailureAction::Quarantine);
            assert!(catalog.fail(lease, fail).await.expect("stored"));
            done += 1;
        }
    };
    let mut tasks = Vec::new();
    for _ in 0..2 {
        let catalog = world.place.open().await.expect("a catalog");
        tasks.push(tokio::spawn(worker(catalog)));
    }
    let importer = world.place.open().await.expect("a catalog");
    for count in 80..100 {
        let rows = vec![row(&format!("p{count}"))];
        importer.import(rows, 1).await.expect("imported");
        world
            .catalog
            .outstanding(Stage::Register, None)
            .await
            .expect("a read");
    }
    let mut done = 0;
    for task in tasks {
        done += task.await.expect("no panic");
    }
    done += worker(importer).await;
    assert_eq!(done, 100);
    world.assert_counters().await;
}

/// The end of a back-off is stored in the job, so it survives the death of the process.
#[tokio::test]
async fn a_backoff_survives_the_death_of_its_process() {
    let world = World::new(1).await;
    for attempt in 1..=2 {
        let worker = register(&world.catalog).await;
        let lease = world.claim_as(worker, 1).await.remove(0);
        assert_eq!(lease.attempt(), attempt);
        let back_off = slow_disk(world.fingerprints, FailureAction::BackOff { run_at: 2_000 });
        assert!(world.catalog.fail(lease, back_off).await.expect("stored"));
        let next = register(&world.catalog).await;
        let recovered = world.catalog.recover(DeadWorker::AllExcept(next), 60).await;
        assert_eq!(recovered.expect("a recovery").ready, 0);
        assert_eq!(status(&world).await, JobStatus::Backoff);
        let due = world.catalog.release_due_backoffs(2_000, 60_000).await;
        assert_eq!(due.expect("stored"), 1);
    }
    // A crash does not count as an attempt.
    let worker = register(&world.catalog).await;
    assert_eq!(world.claim_as(worker, 1).await[0].attempt(), 3);
    let next = register(&world.catalog).await;
    let recovered = world.catalog.recover(DeadWorker::AllExcept(next), 60).await;
    assert_eq!(recovered.expect("a recovery").ready, 1);
    let again = world.claim_exclusive(next).await;
    assert_eq!((again[0].attempt(), world.crashes("p0").await), (3, 1));
}

/// One worker's clock is years behind, and another worker's clock is years ahead. No living worker loses a lease, and
/// no pair waits for years.
#[tokio::test]
async fn clock_jumps_neither_block_pairs_nor_cost_leases() {
    const YEARS: i64 = 100_000_000_000;
    let world = World::new(3).await;
    let past = enter(&world.catalog, world.fingerprints, 5).await;
    let future = enter(&world.catalog, world.fingerprints, YEARS).await;
    let mut leases = Vec::new();
    for (worker, clock) in [(past, 5), (future, YEARS)] {
        let request = ClaimRequest {
            alive_since: clock - 50,
            ..ClaimRequest::new(worker, 1, clock + 10)
        };
        leases.extend(world.catalog.claim(request).await.expect("a claim"));
        let heartbeat = world
            .catalog
            .heartbeat(worker, clock + 20, clock - 30, None)
            .await;
        assert!(heartbeat.expect("an answer"));
    }
    for (me, now) in [(past, 25), (future, YEARS + 20)] {
        let overdue = world.catalog.recover_overdue(me, 60, now).await;
        assert_eq!(overdue.expect("a recovery").ready, 0);
    }
    for (lease, clock) in leases.into_iter().zip([5, YEARS]) {
        let mut done = world.done(Stage::Fit);
        (done.at, done.alive_since) = (clock + 20, clock - 30);
        let kept = world.catalog.checkpoint_now(lease, done).await;
        assert!(matches!(kept, Ok(CheckpointOutcome::Lease(_))));
    }
    // The worker with the early clock ends the back-off of the other one.
    let lease = world.claim_as(future, 1).await.remove(0);
    let run_at = YEARS + 1_000;
    let back_off = slow_disk(world.fingerprints, FailureAction::BackOff { run_at });
    assert!(world.catalog.fail(lease, back_off).await.expect("stored"));
    let due = world.catalog.release_due_backoffs(25, 90_000).await;
    assert_eq!(due.expect("stored"), 1);
    world.assert_counters().await;
}

/// A pair that must run exclusively is not leased while any worker holds a lease. While it is leased, no worker gets
/// another lease.
#[tokio::test]
async fn an_exclusive_pair_is_leased_alone_whichever_worker_asks() {
    let world = World::new(3).await;
    assert_eq!(world.claim(1).await.len(), 1);
    let one = world.recovered_by_another(1).await;
    let two = register(&world.catalog).await;
    let lease = world.claim_as(one, 1).await.remove(0);
    for worker in [one, two] {
        assert!(world.claim_exclusive(worker).await.is_empty());
    }
    let released = world.catalog.release(lease).await;
    assert!(released.expect("an answer"));
    let alone = world.claim_exclusive(two).await.remove(0);
    assert!(alone.exclusive());
    for worker in [one, two] {
        assert!(world.claim_as(worker, 1).await.is_empty());
        assert!(world.claim_exclusive(worker).await.is_empty());
    }
    let released = world.catalog.release(alone).await;
    assert!(released.expect("an answer"));
    assert_eq!(world.claim_as(one, 3).await.len(), 2);
    world.assert_counters().await;
}

/// Returns a catalog whose only pair was quarantined after `CRASH_LIMIT` worker deaths, and the newest worker.
async fn poisoned() -> (World, WorkerId) {
    let world = World::new(1).await;
    let mut me = world.worker;
    for crash in 0..CRASH_LIMIT {
        let taken = if crash == 0 {
            world.claim_as(me, 1).await
        } else {
            world.claim_exclusive(me).await
        };
        assert_eq!(taken.len(), 1);
        me = register(&world.catalog).await;
        let recovered = world.catalog.recover(DeadWorker::AllExcept(me), 60).await;
        let poisoned = recovered.expect("a recovery").poisoned;
        let expected = (crash + 1 == CRASH_LIMIT).then_some(PairId(1));
        assert_eq!(poisoned, Vec::from_iter(expected));
    }
    (world, me)
}

#[tokio::test]
async fn a_poisoned_pair_is_requeued_with_other_settings() {
    let (world, _) = poisoned().await;
    for (revision, sent) in [([1; 4], 0), ([1, 2, 1, 1], 0), ([2, 1, 1, 1], 1)] {
        let fingerprints = fingerprints(revision);
        let back = world
            .catalog
            .requeue_stale(&fingerprints, None, RerunPolicy::Changed)
            .await;
        assert_eq!(back.expect("requeued"), sent);
    }
    assert_eq!(status(&world).await, JobStatus::Ready);
}

#[tokio::test]
async fn a_poisoned_pair_is_requeued_with_another_mesh() {
    let (world, _) = poisoned().await;
    let seen = |text: &str| {
        let mut seen = inputs(Stage::Fit);
        let mesh = seen.mesh.as_mut().expect("a mesh");
        mesh.hash = mocban_core::domain::ContentHash::of(text.as_bytes());
        vec![(PairId(1), seen)]
    };
    let stored = world.catalog.record_poisoned_inputs(seen("fatal")).await;
    stored.expect("stored");
    let requeue_stale = async || {
        let fingerprints = fingerprints([1; 4]);
        let back = world
            .catalog
            .requeue_stale(&fingerprints, None, RerunPolicy::Changed)
            .await;
        back.expect("requeued")
    };
    assert_eq!(requeue_stale().await, 0);
    let stored = world.catalog.store_inputs(seen("repaired")).await;
    stored.expect("stored");
    assert_eq!(requeue_stale().await, 1);
}
