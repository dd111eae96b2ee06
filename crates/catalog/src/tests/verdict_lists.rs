//! Lists of verdicts: what is stored of them, and what is left out.

use super::verdicts::{counted, verdict};
use super::{World, name};
use crate::{Catalog, CatalogError, ImportedVerdicts, ListedVerdict, NewVerdict, VerdictEvent};
use mocban_core::domain::{ContentHash, ThresholdMetric, Verdict};

/// Returns verdicts of a list of four reviewers, with events, angles and repetitions.
fn mixed_list() -> Vec<ListedVerdict> {
    let listed = |number: i64| {
        let given = [Verdict::Pass, Verdict::Fail, Verdict::Unsure][number as usize % 3];
        let reviewer = format!("reviewer {}", number % 4);
        let mut new = verdict(&reviewer, given);
        new.pair = name(if number % 2 == 0 { "p0" } else { "p1" });
        new.metric = (number % 5 == 0).then_some(ThresholdMetric::Density);
        new.note = (number % 7 == 0).then(|| format!("note {}", number % 14));
        new.context.event = (number % 11 == 0).then(|| format!("event {}", number % 33));
        new.context.angle_read_deg = (number % 13 == 0).then_some(number as f64 / 8.0);
        ListedVerdict {
            verdict: new,
            judged: None,
            day: None,
        }
    };
    (0..300).map(listed).collect()
}

/// Returns the log without ids and actions; numbers of actions are counted from 1.
async fn plain_log(catalog: &Catalog) -> Vec<(i64, VerdictEvent)> {
    let log = catalog.verdict_log(None).await.expect("a log");
    let mut acts: Vec<i64> = log.iter().map(|event| event.act).collect();
    acts.dedup();
    let plain = log.into_iter().map(|event| {
        let act = acts.iter().position(|act| *act == event.act);
        let event = VerdictEvent {
            id: 0,
            act: 0,
            ..event
        };
        (act.expect("listed") as i64, event)
    });
    plain.collect()
}

#[tokio::test]
async fn a_list_stores_what_its_verdicts_store_one_by_one() {
    let (whole, single) = (World::new(2).await, World::new(2).await);
    for world in [&whole, &single] {
        world.finish_one().await;
        world.finish_one().await;
    }
    let list = mixed_list();
    let mut counts = ImportedVerdicts::default();
    for listed in list.clone() {
        let stored = single.catalog.import_verdicts([Ok(listed)].into_iter(), 9);
        let stored = stored.await.expect("stored");
        counts.recorded += stored.recorded;
        counts.known += stored.known;
    }
    assert!(counts.known > 0 && counts.recorded > 0, "{counts:?}");
    let stored = whole.catalog.import_verdicts(list.into_iter().map(Ok), 9);
    assert_eq!(stored.await.expect("stored"), counts);
    let logs = [
        plain_log(&whole.catalog).await,
        plain_log(&single.catalog).await,
    ];
    assert_eq!(logs[0].len(), logs[1].len());
    for (one, other) in logs[0].iter().zip(&logs[1]) {
        assert_eq!(one, other);
    }
    assert_eq!(whole.catalog.faulty_rows().await.expect("a read"), []);
}

#[tokio::test]
async fn equal_verdicts_with_a_time_are_stored_once_per_list_and_never_again() {
    let world = World::new(1).await;
    world.finish_one().await;
    let mut timed = verdict("ana", Verdict::Pass);
    timed.at = Some(3);
    for stored in [2, 0] {
        let given = vec![timed.clone(), timed.clone()];
        let set = world.catalog.verdict_set(given, 5).await;
        assert_eq!(set.expect("stored"), stored);
    }
}

#[tokio::test]
async fn a_listed_verdict_that_is_older_than_the_newest_one_is_left_out() {
    let world = World::new(1).await;
    world.finish_one().await;
    let import = async |rows: &[(Verdict, Option<i64>)], now| {
        let rows = rows.iter().map(|(given, at)| ListedVerdict {
            verdict: NewVerdict {
                at: *at,
                ..verdict("ana", *given)
            },
            judged: None,
            day: None,
        });
        let rows: Vec<_> = rows.map(Ok).collect();
        let counts = world.catalog.import_verdicts(rows.into_iter(), now).await;
        let counts = counts.expect("stored");
        (counts.recorded, counts.known, counts.first_older)
    };
    let (pass, fail) = (Verdict::Pass, Verdict::Fail);
    for (rows, now, counts, newest) in [
        (
            &[(pass, Some(7_i64)), (fail, Some(6))] as &[_],
            9,
            (1, 0, Some(1)),
            pass,
        ),
        (
            &[(pass, Some(7)), (fail, Some(6))],
            9,
            (0, 1, Some(1)),
            pass,
        ),
        (
            &[(fail, Some(5)), (fail, Some(8))],
            9,
            (1, 0, Some(0)),
            fail,
        ),
        // A verdict without a time counts as given now, but the order of a list with such ones is kept.
        (
            &[(pass, None), (fail, Some(8)), (pass, Some(8))],
            10,
            (2, 1, None),
            pass,
        ),
    ] {
        assert_eq!(import(rows, now).await, counts, "{rows:?}");
        assert_eq!(counted(&world.catalog).await, [("ana".to_owned(), newest)]);
    }
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
}

#[tokio::test]
async fn a_listed_verdict_with_a_day_replaces_no_correction_when_it_is_imported_again() {
    let world = World::new(1).await;
    world.finish_one().await;
    // On a day from 100 to 199.
    let import = async |given, at, now| {
        let listed = ListedVerdict {
            verdict: NewVerdict {
                at,
                ..verdict("ana", given)
            },
            judged: None,
            day: Some(100..=199),
        };
        let counts = world.catalog.import_verdicts([Ok(listed)].into_iter(), now);
        let counts = counts.await.expect("stored");
        (counts.recorded, counts.known, counts.older)
    };
    let (pass, fail) = (Verdict::Pass, Verdict::Fail);
    let in_app = async |event: &str, given, now| {
        let mut new = verdict("ana", given);
        new.context.event = Some(event.to_owned());
        let set = world.catalog.verdict_set(vec![new], now).await;
        assert_eq!(set.expect("stored"), 1);
    };
    // The list is newer than both verdicts of the app, one of which is equal.
    in_app("1", pass, 110).await;
    in_app("2", fail, 120).await;
    assert_eq!(import(pass, None, 130).await, (1, 0, 0));
    assert_eq!(counted(&world.catalog).await, [("ana".to_owned(), pass)]);
    in_app("3", fail, 140).await;
    for (at, now) in [(None, 150), (Some(199), 250), (Some(100), 99)] {
        assert_eq!(import(pass, at, now).await, (0, 1, 0), "{now}");
        assert_eq!(counted(&world.catalog).await, [("ana".to_owned(), fail)]);
    }
    // Another verdict of the list counts, and one after a correction on a later day does not.
    assert_eq!(import(Verdict::Unsure, Some(199), 260).await, (1, 0, 0));
    in_app("4", pass, 270).await;
    assert_eq!(import(fail, Some(199), 280).await, (0, 0, 1));
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
}

#[tokio::test]
async fn a_long_list_takes_few_statements_and_is_stored_whole_or_not_at_all() {
    let world = World::new(1).await;
    world.finish_one().await;
    let row = |number: usize| ListedVerdict {
        verdict: verdict(&format!("reviewer {number}"), Verdict::Pass),
        judged: None,
        day: None,
    };
    let rows = 2500;
    let broken = (0..rows).map(move |number| match number {
        2400 => Err(CatalogError::CutShort),
        _ => Ok(row(number)),
    });
    let refused = world.catalog.import_verdicts(broken, 5).await;
    assert!(
        matches!(refused, Err(CatalogError::CutShort)),
        "{refused:?}"
    );
    let log = world.catalog.verdict_log_page(0, 1).await.expect("a log");
    assert_eq!(log, []);
    for (recorded, known) in [(rows, 0), (0, rows)] {
        let stored = world.catalog.import_verdicts((0..rows).map(row).map(Ok), 5);
        let counts = ImportedVerdicts {
            recorded: recorded as u64,
            known: known as u64,
            ..ImportedVerdicts::default()
        };
        assert_eq!(stored.await.expect("stored"), counts);
    }
    assert_eq!(world.catalog.faulty_rows().await.expect("a read"), []);
}

#[tokio::test]
async fn a_listed_verdict_on_another_result_is_left_out() {
    let world = World::new(2).await;
    world.finish_one().await;
    let detail = world.catalog.pair(&name("p0")).await.expect("a read");
    let results = detail.expect("the pair").results;
    let density = results.metric(ThresholdMetric::Density).expect("a result");
    let on = |pair: &str, metric, judged| ListedVerdict {
        verdict: NewVerdict {
            pair: name(pair),
            metric,
            ..verdict("ana", Verdict::Pass)
        },
        judged: Some(judged),
        day: None,
    };
    let (current, other) = (density.result_hash, ContentHash::of(b"another"));
    let list = [
        on("p0", Some(ThresholdMetric::Density), current),
        on("p0", Some(ThresholdMetric::Density), other),
        on("p1", None, current),
    ];
    let stored = world.catalog.import_verdicts(list.map(Ok).into_iter(), 5);
    let counts = ImportedVerdicts {
        recorded: 1,
        left_out: 2,
        ..ImportedVerdicts::default()
    };
    assert_eq!(stored.await.expect("stored"), counts);
}
