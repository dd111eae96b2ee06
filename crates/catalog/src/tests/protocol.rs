//! Leases, checkpoints, failures, recovery and counters.

use std::time::{Duration, Instant};

use super::{World, blocks, done, name, register, row, slow_disk};
use crate::db::query::query;
use crate::{
    Catalog, CatalogError, CheckpointOutcome, ClaimRequest, FailureAction, RerunPolicy,
    RetrySelection, StageCheckpoint,
};
use mocban_core::domain::{
    BlockStage, FailureClass, JobStatus, LengthUnit, MetricOutcome, Stage, ThresholdMetric,
};

pub(super) async fn status(world: &World, pair: &str) -> JobStatus {
    let detail = world.catalog.pair(&name(pair)).await.expect("a read");
    detail.expect("the pair").results.status
}

#[tokio::test]
async fn a_pair_passes_four_checkpoints_and_is_read_back() {
    let world = World::new(1).await;
    world.finish_one().await;
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    let detail = detail.expect("the pair");
    assert_eq!(detail.results.status, JobStatus::Done);
    assert_eq!(detail.results.stages.len(), 4);
    let metrics: Vec<_> = detail.results.metrics.iter().map(|m| m.outcome).collect();
    assert_eq!(metrics, ThresholdMetric::ALL.map(super::metric));
    assert_eq!(detail.attempts.len(), 4);
    assert!(detail.mesh_hash.is_some() && detail.print_hash.is_some());
    world.assert_counters().await;
}

/// A server takes the first lease of a pair as a sign that the pair has no results.
#[tokio::test]
async fn results_before_the_first_lease_of_a_pair_are_replaced() {
    let world = World::new(1).await;
    world.finish_one().await;
    let fingerprints = super::fingerprints([1; 4]);
    let again = RerunPolicy::All(Stage::Fit);
    let sent = world.catalog.requeue_stale(&fingerprints, None, again);
    assert_eq!(sent.await.expect("requeued"), 1);
    let mut conn = world.place.conn().await;
    let first = query("UPDATE job SET token = 0").execute(&mut conn);
    first.await.expect("changed");
    world.finish_one().await;
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    let detail = detail.expect("the pair");
    assert_eq!(detail.results.status, JobStatus::Done);
    assert_eq!((detail.results.stages.len(), detail.attempts.len()), (4, 8));
    world.assert_counters().await;
}

#[tokio::test]
async fn pairs_of_low_confidence_are_counted() {
    let limit = MetricOutcome::LOW_CONFIDENCE;
    let world = World::new(4).await;
    for confidence in [Some(limit - 1e-9), Some(limit), Some(1.0), None] {
        let set_confidence = |done: &mut StageCheckpoint| {
            for metric in &mut done.metrics {
                let is_default = metric.outcome.metric == ThresholdMetric::DEFAULT;
                metric.outcome.confidence = if is_default { confidence } else { Some(0.0) };
            }
        };
        world.finish_with(set_confidence).await;
    }
    let status = world.catalog.status(&super::fingerprints([1; 4])).await;
    assert_eq!(status.expect("counts").low_confidence, 1);
}

#[tokio::test]
async fn a_claim_leases_the_most_advanced_pair_first() {
    let world = World::new(3).await;
    let lease = world.claim(1).await.remove(0);
    let pair = lease.pair();
    let Ok(CheckpointOutcome::Lease(lease)) = world
        .catalog
        .checkpoint_now(lease, world.done(Stage::Fit))
        .await
    else {
        panic!("the checkpoint was not stored")
    };
    assert!(world.catalog.release(lease).await.expect("given back"));
    let next = world.claim(1).await.remove(0);
    assert_eq!((next.pair(), next.cursor()), (pair, Stage::Depth));
    assert_eq!(next.attempt(), 1);
}

#[tokio::test]
async fn two_claims_never_get_the_same_pair() {
    let world = World::new(40).await;
    let other = register(&world.catalog).await;
    let (a, b) = tokio::join!(world.claim(30), world.claim_as(other, 30));
    let mut pairs: Vec<_> = a.iter().chain(&b).map(super::Lease::pair).collect();
    pairs.sort_unstable();
    pairs.dedup();
    assert_eq!((a.len() + b.len(), pairs.len()), (40, 40));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_late_checkpoint_of_a_recovered_job_changes_nothing() {
    let world = World::new(1).await;
    let late = world.claim(1).await.remove(0);
    let other = world.recovered_by_another(1).await;
    let token = late.token;
    let kept = world
        .catalog
        .checkpoint_now(late, world.done(Stage::Fit))
        .await;
    assert!(matches!(kept, Ok(CheckpointOutcome::Refused)));
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    let detail = detail.expect("the pair");
    assert!(detail.results.stages.is_empty() && detail.attempts.is_empty());
    assert_eq!(
        (detail.results.status, detail.crashes),
        (JobStatus::Ready, 1)
    );
    let again = world.claim_exclusive(other).await.remove(0);
    assert!(again.exclusive() && again.token > token);
    world.assert_counters().await;
}

#[tokio::test]
async fn a_late_failure_and_a_late_release_change_nothing() {
    let world = World::new(2).await;
    let mut leases = world.claim(2).await;
    world.recovered_by_another(2).await;
    let (first, second) = (leases.remove(0), leases.remove(0));
    let kept = slow_disk(world.fingerprints, FailureAction::Quarantine);
    assert!(!world.catalog.fail(first, kept).await.expect("an answer"));
    assert!(!world.catalog.release(second).await.expect("an answer"));
    assert_eq!(status(&world, "p0").await, JobStatus::Ready);
    world.assert_counters().await;
}

/// The files may have been removed, because no row named them for so long.
#[tokio::test]
async fn a_server_does_not_store_a_stage_whose_files_are_old() {
    let world = World::new(1).await;
    let long_ago = Instant::now().checked_sub(Duration::from_mins(31));
    let [lease] = world.claim(1).await.try_into().expect("a lease");
    let late = StageCheckpoint {
        write_began: long_ago.expect("the clock began before"),
        ..world.done(Stage::Fit)
    };
    let stored = world.catalog.checkpoint(lease, vec![late]).await;
    let stored = stored.expect("a reply");
    if !world.catalog.is_shared() {
        assert!(matches!(stored, CheckpointOutcome::Lease(_)));
        return;
    }
    assert!(matches!(stored, CheckpointOutcome::Refused));
    assert_eq!(status(&world, "p0").await, JobStatus::Leased);
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    assert!(detail.expect("the pair").results.stages.is_empty());
    world.assert_counters().await;
}

#[tokio::test]
async fn a_backoff_ends_when_it_is_due_and_after_a_clock_jump() {
    let world = World::new(2).await;
    for (lease, run_at) in world.claim(2).await.into_iter().zip([2_000, 9_000_000]) {
        let back_off = slow_disk(world.fingerprints, FailureAction::BackOff { run_at });
        assert!(world.catalog.fail(lease, back_off).await.expect("stored"));
    }
    assert!(world.claim(2).await.is_empty());
    let left = world.catalog.outstanding(Stage::Register, None).await;
    let left = left.expect("a read");
    assert_eq!((left.backoff, left.next_due), (2, Some(2_000)));
    let due = world.catalog.release_due_backoffs(1_999, 90_000_000).await;
    assert_eq!(due.expect("stored"), 0);
    let due = world.catalog.release_due_backoffs(2_000, 60_000).await;
    assert_eq!(due.expect("stored"), 2);
    let again = world.claim(2).await;
    assert!(again.len() == 2 && again.iter().all(|lease| lease.attempt() == 2));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_failure_keeps_class_and_message_and_can_be_retried() {
    let world = World::new(3).await;
    for lease in world.claim(2).await {
        let quarantine = slow_disk(world.fingerprints, FailureAction::Quarantine);
        assert!(world.catalog.fail(lease, quarantine).await.expect("stored"));
    }
    assert_eq!(world.claim(5).await.len(), 1);
    let counts = world.catalog.failure_counts().await.expect("a read");
    assert_eq!(counts, [(FailureClass::Io, 2)]);
    let bug = RetrySelection::Class(FailureClass::Bug);
    assert_eq!(world.retry(&bug).await.expect("stored"), 0);
    let unknown = RetrySelection::Names(vec![name("p0"), name("nobody")]);
    let refused = world.retry(&unknown).await;
    assert!(matches!(refused, Err(CatalogError::UnknownPair(_))));
    let one = RetrySelection::Names(vec![name("p0")]);
    assert_eq!(world.retry(&one).await.expect("stored"), 1);
    assert_eq!(status(&world, "p0").await, JobStatus::Ready);
    assert_eq!(status(&world, "p1").await, JobStatus::Quarantined);
    let all = world.retry(&RetrySelection::All).await;
    assert_eq!(all.expect("stored"), 1);
    assert!(world.catalog.failures(9).await.expect("a read").is_empty());
    world.assert_counters().await;
}

#[tokio::test]
async fn an_exclusive_pair_is_claimed_only_exclusively() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.remove(0);
    let alone = slow_disk(world.fingerprints, FailureAction::RetryExclusive);
    assert!(world.catalog.fail(lease, alone).await.expect("stored"));
    assert!(world.claim(1).await.is_empty());
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    assert!(detail.expect("the pair").results.failure.is_none());
    world.assert_counters().await;
}

#[tokio::test]
async fn a_claim_among_selected_pairs_leases_no_other() {
    let world = World::new(4).await;
    let wanted = [name("p3"), name("p1")];
    let selection = world.catalog.select(&wanted).await.expect("a read");
    let request = ClaimRequest {
        selection: Some(selection.clone()),
        ..ClaimRequest::new(world.worker, 9, 1_000)
    };
    assert_eq!(
        world.catalog.claim(request).await.expect("a claim").len(),
        2
    );
    assert_eq!(status(&world, "p0").await, JobStatus::Ready);
    assert_eq!(status(&world, "p3").await, JobStatus::Leased);
    let left = world
        .catalog
        .work_left(Stage::Depth, Some(&selection))
        .await;
    assert_eq!(left.expect("a read").by_stage, [2, 2, 0, 0]);
}

#[tokio::test]
async fn a_second_import_adds_new_pairs_and_returns_changes() {
    let world = World::new(2).await;
    let mut changed = row("p1");
    changed.unit = Some(LengthUnit::Cm);
    changed.print_path = "other.png".to_owned();
    let rows = vec![row("p0"), changed, row("p2")];
    let summary = world.catalog.import(rows, 5).await.expect("imported");
    assert_eq!((summary.added, summary.unchanged), (1, 1));
    assert_eq!(summary.changed.len(), 1);
    assert_eq!(summary.changed[0].fields, ["print", "unit"]);
    let names = world.catalog.pair_names().await.expect("a read");
    assert_eq!(names, ["p0", "p1", "p2"].map(name));
    world.assert_counters().await;
}

#[tokio::test]
async fn pages_come_in_the_order_of_names_and_end() {
    let world = World::new(12).await;
    let first = world.catalog.results_page(None, 5).await.expect("a page");
    let after = &first[4].attributes.name;
    let second = world.catalog.results_page(Some(after), 50).await;
    let names: Vec<_> = first
        .iter()
        .chain(&second.expect("a page"))
        .map(|pair| pair.attributes.name.clone())
        .collect();
    assert_eq!(names.len(), 12);
    assert!(names.is_sorted());
    let end = world.catalog.results_page(names.last(), 5).await;
    assert!(end.expect("a page").is_empty());
}

#[tokio::test]
async fn a_read_only_catalog_reads_during_writes_and_cannot_write() {
    let world = World::new(1).await;
    let reader = world.place.open_read_only().await.expect("a reader");
    world.finish_one().await;
    let status = reader.status(&super::fingerprints([1; 4])).await;
    assert_eq!(status.expect("a read").jobs[&JobStatus::Done], 1);
    let refused = reader.import(vec![row("p9")], 1).await;
    assert!(matches!(refused, Err(CatalogError::ReadOnly)));
    reader.close().await;
}

#[tokio::test]
async fn a_missing_catalog_is_an_error_of_its_own_kind() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("catalog.sqlite");
    assert!(matches!(
        Catalog::open(&path).await,
        Err(CatalogError::Missing(_))
    ));
    assert!(!path.exists());
}

#[tokio::test]
async fn one_failing_request_does_not_fail_its_batch() {
    let world = World::new(2).await;
    let mut leases = world.claim(2).await;
    let (good, bad) = (leases.remove(0), leases.remove(0));
    let mut broken = world.done(Stage::Fit);
    broken.outcome = "no JSON".to_owned();
    let (good, bad) = tokio::join!(
        world.catalog.checkpoint_now(good, world.done(Stage::Fit)),
        world.catalog.checkpoint_now(bad, broken),
    );
    assert!(matches!(good, Ok(CheckpointOutcome::Lease(_))));
    assert!(matches!(bad, Err(CatalogError::Shared(_))));
    world.assert_counters().await;
}

#[tokio::test]
async fn a_score_that_is_not_a_number_is_not_stored() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.remove(0);
    let mut last = world.done(Stage::Register);
    last.metrics[0].outcome.scores.dice = f64::NAN;
    let stages = [Stage::Fit, Stage::Depth, Stage::Normalize].map(|stage| world.done(stage));
    let stages = stages.into_iter().chain([last]).collect();
    let refused = world.catalog.checkpoint(lease, stages).await;
    assert!(matches!(refused, Err(CatalogError::Corrupt(_))));
    assert_eq!(status(&world, "p0").await, JobStatus::Leased);
}

#[tokio::test]
async fn everything_sent_is_stored_when_the_catalog_is_closed() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.remove(0);
    let (kept, ()) = tokio::join!(
        world
            .catalog
            .checkpoint_now(lease, done(world.fingerprints, Stage::Fit)),
        world.catalog.clone().close(),
    );
    assert!(matches!(kept, Ok(CheckpointOutcome::Lease(_))));
    let again = world.place.open().await.expect("a catalog");
    let detail = again.pair(&name("p0")).await.expect("a read");
    assert_eq!(detail.expect("the pair").results.stages.len(), 1);
}

#[tokio::test]
async fn a_worker_without_heartbeats_or_with_old_files_stores_no_stage_of_a_block() {
    let world = blocks::world().await;
    let (lease, work) = world.leased_block().await;
    // Files without a row for 31 minutes may have been removed.
    for (alive_since, minutes) in [(50, 0), (0, 31)] {
        let written = Instant::now().checked_sub(Duration::from_mins(minutes));
        let refused = StageCheckpoint {
            alive_since,
            write_began: written.expect("the clock began before"),
            ..blocks::done(&work, BlockStage::Face)
        };
        let stored = world.catalog.checkpoint_block(lease.clone(), refused).await;
        assert_eq!(stored.expect("a reply"), CheckpointOutcome::Refused);
    }
    let ended = world.catalog.end_worker(world.worker, 60, None).await;
    ended.expect("ended");
    let stage = blocks::done(&work, BlockStage::Face);
    let stored = world.catalog.checkpoint_block(lease, stage).await;
    assert_eq!(stored.expect("a reply"), CheckpointOutcome::Refused);
}
