//! Pairs that a person or a shorter list takes out of every count, and that come back.

use super::block_pairs::{judge, names_of, status_of};
use super::blocks::{attributes, block, character, world};
use super::{World, fingerprints, name, row};
use crate::{
    CatalogError, CheckpointOutcome, ImportChunk, ImportSummary, ImportTerms, LastImport,
    ListedRetiredPair, RerunPolicy, RetiredPair, StatusCounts,
};
use mocban_core::domain::{BlockStage, JobStatus, PairName, RetireCause, Stage, Verdict};

async fn status(world: &World) -> StatusCounts {
    let status = world.catalog.status(&fingerprints([1; 4])).await;
    status.expect("a read")
}

async fn retired(world: &World) -> Vec<RetiredPair> {
    world.catalog.retired_pairs().await.expect("a read")
}

/// Imports a list with these ids that replaces the others.
async fn replace(world: &World, ids: &[&str]) -> ImportSummary {
    let (sender, chunks) = tokio::sync::mpsc::channel(2);
    let rows = ids.iter().map(|id| row(id)).collect();
    for chunk in [ImportChunk::Rows(rows), ImportChunk::End] {
        sender.try_send(chunk).expect("room");
    }
    let terms = ImportTerms {
        replace: true,
        ..ImportTerms::default()
    };
    let (summary, _) = world
        .catalog
        .import_all(chunks, terms, 7)
        .await
        .expect("imported");
    world.assert_counters().await;
    summary
}

#[tokio::test]
async fn verdicts_wait_for_the_results_of_their_pairs() {
    let world = World::new(2).await;
    world.finish_one().await;
    judge(&world, "p0").await;
    let waiting = async || world.catalog.waiting_verdicts().await.expect("a read");
    assert_eq!(waiting().await, 0);
    let other = fingerprints([2, 1, 1, 1]);
    let requeued = world
        .catalog
        .requeue_stale(&other, None, RerunPolicy::Changed);
    assert!(requeued.await.expect("requeued") > 0);
    assert_eq!(waiting().await, 1);
    world.retire("p0", 9).await;
    assert_eq!(waiting().await, 0, "a retired pair is in no count");
}

#[tokio::test]
async fn a_retired_pair_is_in_no_count_and_comes_back_with_all_it_had() {
    let world = World::new(2).await;
    world.finish_one().await;
    judge(&world, "p0").await;
    let before = status(&world).await;
    assert_eq!((before.pairs, before.verdicts[&Verdict::Pass]), (2, 1));
    let names = [name("p0")];
    let catalog = &world.catalog;
    assert_eq!(catalog.retire_pairs(&names, 9).await.expect("retired"), 1);
    assert_eq!(catalog.retire_pairs(&names, 10).await.expect("again"), 0);
    world.assert_counters().await;
    let counts = status(&world).await;
    assert_eq!(
        (
            counts.pairs,
            counts.retired,
            counts.verdicts[&Verdict::Pass]
        ),
        (1, 1, 0)
    );
    assert_eq!(counts.jobs[&JobStatus::Done], 0);
    let expected = RetiredPair {
        name: name("p0"),
        cause: RetireCause::Person,
        at: 9,
    };
    assert_eq!(retired(&world).await, [expected]);
    assert_eq!(status_of(&world, "p0").await, None);
    assert_eq!(
        catalog
            .verdict_log(Some(&names[0]))
            .await
            .expect("the log")
            .len(),
        1
    );
    let shared = catalog.pair_groups("character").await.expect("groups");
    assert_eq!(shared.values().sum::<u64>(), 1);
    // A list with the pair does not bring it back, and gives it no new job.
    let again = catalog
        .import(vec![row("p0"), row("p1")], 11)
        .await
        .expect("the list");
    assert_eq!((again.unchanged, again.restored), (2, 0));
    world.assert_counters().await;
    assert_eq!(status(&world).await, counts);
    assert_eq!(catalog.restore_pairs(&names).await.expect("restored"), 1);
    assert_eq!(catalog.restore_pairs(&names).await.expect("again"), 0);
    world.assert_counters().await;
    assert_eq!(status(&world).await, before);
    assert_eq!(status_of(&world, "p0").await, Some(JobStatus::Done));
}

#[tokio::test]
async fn the_lease_of_a_retired_pair_ends() {
    let world = World::new(1).await;
    let lease = world.claim(1).await.pop().expect("a ready pair");
    world.retire("p0", 9).await;
    assert!(world.claim(1).await.is_empty());
    let stored = world
        .catalog
        .checkpoint_now(lease, world.done(Stage::Fit))
        .await;
    assert!(
        matches!(stored, Ok(CheckpointOutcome::Refused)),
        "{stored:?}"
    );
    world
        .catalog
        .restore_pairs(&[name("p0")])
        .await
        .expect("restored");
    assert_eq!(world.claim(1).await.len(), 1);
}

#[tokio::test]
async fn a_list_that_replaces_the_others_retires_pairs_until_a_list_has_them_again() {
    let world = World::new(3).await;
    world.retire("p2", 5).await;
    let shorter = replace(&world, &["p0", "p3"]).await;
    assert_eq!(
        (shorter.added, shorter.retired, shorter.restored),
        (1, 1, 0)
    );
    let all = retired(&world).await;
    assert_eq!(names_of(&all), [name("p1"), name("p2")]);
    assert_eq!((all[0].cause, all[0].at), (RetireCause::List, 7));
    assert_eq!(all[1].cause, RetireCause::Person);
    assert_eq!(status(&world).await.pairs, 2);
    let whole = replace(&world, &["p0", "p1", "p2", "p3"]).await;
    assert_eq!((whole.retired, whole.restored), (0, 1));
    // The pair that a person retired stays so.
    assert_eq!(names_of(&retired(&world).await), [name("p2")]);
    // A person may bring back what a list retired.
    replace(&world, &["p0"]).await;
    let back: Vec<PairName> = ["p1", "p2"].map(name).to_vec();
    assert_eq!(
        world.catalog.restore_pairs(&back).await.expect("restored"),
        2
    );
    assert_eq!(names_of(&retired(&world).await), [name("p3")]);
    world.assert_counters().await;
}

#[tokio::test]
async fn an_interrupted_list_that_replaces_the_others_changes_nothing() {
    let world = World::new(3).await;
    let before = status(&world).await;
    let (sender, chunks) = tokio::sync::mpsc::channel(1);
    let rows = ImportChunk::Rows(vec![row("p0"), row("new")]);
    sender.try_send(rows).expect("room");
    drop(sender);
    let terms = ImportTerms {
        replace: true,
        ..ImportTerms::default()
    };
    let refused = world.catalog.import_all(chunks, terms, 7).await;
    assert!(
        matches!(refused, Err(CatalogError::CutShort)),
        "{refused:?}"
    );
    world.assert_counters().await;
    assert_eq!(status(&world).await, before);
    assert!(retired(&world).await.is_empty());
}

#[tokio::test]
async fn pairs_of_blocks_are_retired_by_people_and_not_by_lists() {
    let world = world().await;
    world
        .finish_block(vec![character("a", "a"), character("b", "b")])
        .await;
    let shorter = replace(&world, &["q0"]).await;
    assert_eq!((shorter.added, shorter.retired), (1, 0));
    world.retire("b_a", 9).await;
    let catalog = &world.catalog;
    let state = async || {
        let detail = catalog.block(&block("b")).await.expect("a read");
        let state = detail.expect("the block").state;
        (state.characters, state.retired)
    };
    assert_eq!(state().await, (1, 1));
    let of_block = catalog.pairs_of_block_with_retired("b").await;
    assert_eq!(of_block.expect("a read"), ["b_a", "b_b"].map(name));
    // The next cut does not bring it back, and without its box neither does a person.
    let known = catalog.known_blocks().await.expect("a read");
    let cut = vec![(known[0].block, BlockStage::Cut)];
    catalog.reset_blocks(cut.clone()).await.expect("reset");
    world
        .finish_block(vec![character("a", "new a"), character("b", "b")])
        .await;
    world.assert_counters().await;
    assert_eq!(names_of(&retired(&world).await), [name("b_a")]);
    catalog.reset_blocks(cut.clone()).await.expect("reset");
    world.finish_block(vec![character("b", "b")]).await;
    assert_eq!(
        catalog
            .restore_pairs(&[name("b_a")])
            .await
            .expect("not restored"),
        0
    );
    catalog.reset_blocks(cut).await.expect("reset");
    world
        .finish_block(vec![character("a", "a"), character("b", "b")])
        .await;
    assert_eq!(
        catalog
            .restore_pairs(&[name("b_a")])
            .await
            .expect("restored"),
        1
    );
    assert_eq!(state().await, (2, 0));
    world.assert_counters().await;
}

#[tokio::test]
async fn an_import_counts_the_listed_pairs_that_a_person_retired() {
    let world = World::new(2).await;
    world.retire("p0", 9).await;
    let summary = replace(&world, &["p0", "p1"]).await;
    assert_eq!((summary.restored, summary.still_retired), (0, 1));
}

#[tokio::test]
async fn retired_pairs_are_listed_in_pages_and_found_by_name() {
    let world = World::new(5).await;
    let catalog = &world.catalog;
    let names = ["p3", "p0", "p4"].map(name);
    assert_eq!(catalog.retire_pairs(&names, 9).await.expect("retired"), 3);
    let page = async |block, after, limit| {
        let page = catalog.retired_page((block, None), after, limit).await;
        page.expect("a read")
    };
    let first = page(None, 0, 2).await;
    let names = |page: &[ListedRetiredPair]| {
        let names = page.iter().map(|pair| pair.retired.name.to_string());
        names.collect::<Vec<_>>()
    };
    assert_eq!(names(&first), ["p0", "p3"]);
    assert_eq!(names(&page(None, first[1].id, 2).await), ["p4"]);
    assert!(page(Some("none"), 0, 2).await.is_empty());
    assert_eq!(catalog.retired_count().await.expect("a read"), 3);
    let found = catalog.retired_pair(&name("p3")).await.expect("a read");
    assert_eq!(found.as_ref(), Some(&first[1].retired));
    for other in ["p1", "none"] {
        assert_eq!(
            catalog.retired_pair(&name(other)).await.expect("a read"),
            None
        );
    }
}

#[tokio::test]
async fn a_block_without_pairs_is_removed_and_one_with_pairs_or_a_lease_is_not() {
    let world = world().await;
    world
        .finish_block(vec![character("r01", "first content")])
        .await;
    world.import_block(attributes("c")).await;
    let names = ["b", "c", "d"].map(block);
    let catalog = &world.catalog;
    let (lease, _) = world.leased_block().await;
    let removed = catalog.remove_blocks(&names).await.expect("asked");
    assert!(removed.is_empty(), "{removed:?}");
    assert!(catalog.release_block(lease).await.expect("released"));
    let removed = catalog.remove_blocks(&names).await.expect("removed");
    assert_eq!(removed, [block("c")]);
    let left = catalog.block_names().await.expect("a read");
    assert_eq!(left, [block("b")]);
    let faulty = catalog.faulty_rows().await.expect("a read");
    assert!(faulty.is_empty(), "{faulty:?}");
    // It comes back as a new one.
    world.import_block(attributes("c")).await;
    let states = catalog.block_states().await.expect("a read");
    assert_eq!(states[1].status, JobStatus::Ready);
}

#[tokio::test]
async fn the_newest_import_is_counted_to_a_limit() {
    let world = World::new(3).await;
    let rows = ["q0", "q1", "q2"].map(row).to_vec();
    world.catalog.import(rows, 5).await.expect("imported");
    // The list of the newest import may name pairs of earlier ones.
    let rows = ["p0", "r0", "r1", "r2", "r3"].map(row).to_vec();
    world.catalog.import(rows, 7).await.expect("imported");
    let retire = async |names: &[PairName], at| {
        let retired = world.catalog.retire_pairs(names, at).await;
        retired.expect("retired");
    };
    retire(&[name("p0"), name("r3")], 9).await;
    let counts = async |most| {
        let counted = world.catalog.last_import_counts(most).await;
        let LastImport {
            imported,
            pairs,
            jobs,
            retired_last,
        } = counted.expect("a read").expect("an import");
        (imported, pairs, jobs, retired_last)
    };
    assert_eq!(counts(3).await, (7, 3, 2, 1));
    assert_eq!(counts(100).await, (7, 4, 3, 1));
    // An undo of the import does not count the pair that was retired before.
    retire(&["r0", "r1", "r2", "r3"].map(name), 11).await;
    assert_eq!(counts(100).await, (7, 4, 0, 3));
}
