//! Rows that do not agree with their checksums are left out, and no row makes another one faulty.

use super::{World, name};
use crate::db::query::query;
use crate::{Catalog, ChecksummedTable, NewVerdict, ReviewContext, RowFault};
use mocban_core::domain::Verdict;

/// A verdict without a checksum, as a reviewer's login could store it.
const FORGED: &str = "
INSERT INTO verdict (act, pair, metric, result_hash, verdict, reviewer, at)
SELECT act, pair, metric, result_hash, 'fail', reviewer, at FROM verdict ORDER BY id LIMIT 1";

/// Stores a verdict of a reviewer on all metrics. Returns whether it is new.
async fn judge(catalog: &Catalog, reviewer: &str, verdict: Verdict) -> bool {
    let given = NewVerdict {
        pair: name("p0"),
        metric: None,
        verdict,
        reviewer: reviewer.to_owned(),
        reason: None,
        note: None,
        context: ReviewContext::default(),
        at: None,
    };
    let stored = catalog.verdict_set(vec![given], 5).await;
    stored.expect("stored") > 0
}

/// Returns the faults with the numbers of their rows.
async fn faults(catalog: &Catalog) -> Vec<(i64, RowFault)> {
    let rows = catalog.faulty_rows().await.expect("a read");
    rows.iter().map(|row| (row.row, row.fault)).collect()
}

#[tokio::test]
async fn a_forged_row_is_left_out_and_makes_no_other_row_faulty() {
    let world = World::new(1).await;
    world.finish_one().await;
    let mut conn = world.place.conn().await;
    judge(&world.catalog, "ana", Verdict::Pass).await;
    judge(&world.catalog, "bo", Verdict::Pass).await;
    let log = world.catalog.verdict_log(None).await.expect("a log");
    let last = log.last().expect("a verdict").id;
    for _ in 0..2 {
        query(FORGED).execute(&mut conn).await.expect("stored");
    }
    // The checksum of a forged row is stored after the next verdict.
    judge(&world.catalog, "chi", Verdict::Pass).await;
    let late = query("INSERT INTO checksum (record, row, value, previous) VALUES (2, ?1, 7, ?2)");
    let late = late.bind(last + 1).bind(last);
    late.execute(&mut conn).await.expect("stored");
    let expected = [(last + 1, RowFault::Changed), (last + 2, RowFault::Added)];
    assert_eq!(faults(&world.catalog).await, expected);

    let (sound, faulty) = world.catalog.without_faulty_rows().await.expect("a read");
    assert_eq!(faulty[0].values["verdict"], "fail");
    let log = sound.verdict_log(None).await.expect("a log");
    assert!(log.iter().all(|event| event.verdict == Verdict::Pass));
    let detail = sound.pair(&name("p0")).await.expect("a read");
    let metrics = detail.expect("the pair").results.metrics;
    let reviewers = metrics[0].verdicts.iter().map(|given| &*given.reviewer);
    assert_eq!(reviewers.collect::<Vec<_>>(), ["ana", "bo", "chi"]);

    // What the owner knows of is no damage any more, until it changes.
    world.catalog.set_apart(faulty, 9).await.expect("stored");
    let known = world.catalog.faulty_rows().await.expect("a read");
    assert!(known.iter().all(|row| row.is_set_apart));
    let other = query("UPDATE checksum SET previous = NULL WHERE record = 2 AND row = ?1");
    let other = other.bind(last + 1);
    other.execute(&mut conn).await.expect("stored");
    let known = world.catalog.faulty_rows().await.expect("a read");
    assert!(!known[0].is_set_apart && known[1].is_set_apart);
    // A verdict that is set apart can be entered again.
    assert!(judge(&world.catalog, "ana", Verdict::Fail).await);
}

#[tokio::test]
async fn a_removed_row_is_named_and_the_next_one_stays_valid() {
    let world = World::new(1).await;
    world.finish_one().await;
    for reviewer in ["ana", "bo"] {
        judge(&world.catalog, reviewer, Verdict::Pass).await;
    }
    let log = world.catalog.verdict_log(None).await.expect("a log");
    let gone = log[1].id;
    let mut conn = world.place.conn().await;
    let statements = if world.catalog.is_shared() {
        [
            "ALTER TABLE verdict DISABLE TRIGGER ALL",
            "ALTER TABLE checksum DISABLE TRIGGER ALL",
        ]
    } else {
        [
            "PRAGMA foreign_keys = OFF",
            "DROP TRIGGER verdict_no_delete",
        ]
    };
    for sql in statements {
        query(sql).execute(&mut conn).await.expect("run");
    }
    for sql in [
        "DELETE FROM verdict WHERE id = ?1",
        "DELETE FROM checksum WHERE record = 2 AND row = ?1",
    ] {
        query(sql).bind(gone).execute(&mut conn).await.expect("run");
    }
    let faulty = world.catalog.faulty_rows().await.expect("a read");
    assert_eq!(faulty.len(), 1);
    let found = (faulty[0].table, faulty[0].row, faulty[0].fault);
    assert_eq!(found, (ChecksummedTable::Verdict, gone, RowFault::Removed));
}

#[tokio::test]
async fn counts_of_verdicts_read_only_pairs_with_verdicts() {
    let world = World::new(3).await;
    world.finish_one().await;
    world.finish_one().await;
    judge(&world.catalog, "ana", Verdict::Pass).await;
    let judged = async |catalog: &Catalog| {
        let mut pages = catalog.judged_pages(1).await.expect("a read");
        let mut names = Vec::new();
        while let Some(page) = pages.next().await.expect("a read") {
            names.extend(page.into_iter().map(|pair| pair.attributes.name));
        }
        names
    };
    assert_eq!(judged(&world.catalog).await, [name("p0")]);
    let (sound, faulty) = world
        .catalog
        .without_faulty_verdicts()
        .await
        .expect("a read");
    assert_eq!((faulty.len(), judged(&sound).await.len()), (0, 1));

    let mut conn = world.place.conn().await;
    let damage = query("UPDATE pair SET character = 'x'");
    damage.execute(&mut conn).await.expect("changed");
    let (_, faulty) = world.catalog.without_faulty_rows().await.expect("a read");
    assert_eq!(faulty.len(), 3);
    let (sound, faulty) = world
        .catalog
        .without_faulty_verdicts()
        .await
        .expect("a read");
    let pairs = faulty.iter().map(|row| (row.pair.as_deref(), row.fault));
    assert_eq!(pairs.collect::<Vec<_>>(), [(Some("p0"), RowFault::Changed)]);
    assert_eq!(judged(&sound).await, []);
}
