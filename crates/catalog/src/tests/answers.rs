//! Answers on the review page: bound to what was shown, stored once, and undone by event id.

use super::{World, name};
use crate::db::query::query;
use crate::{AnsweredOn, Catalog, CatalogError, ManualAlignment, NewVerdict, ReviewContext, Shown};
use mocban_core::domain::{
    Affine2, AttentionCheck, ContentHash, PrintFromMesh, Reason, ReviewOrder, ThresholdMetric,
    Verdict,
};

fn given(event: &str, verdict: Verdict) -> NewVerdict {
    NewVerdict {
        pair: name("p0"),
        metric: None,
        verdict,
        reviewer: "ana".to_owned(),
        reason: (verdict == Verdict::Fail).then_some(Reason::WrongPair),
        note: Some("torn".to_owned()),
        context: ReviewContext {
            event: Some(event.to_owned()),
            seen: Some(ContentHash::of(b"seen")),
            shown_ms: Some(1_900),
            angle_read_deg: Some(-4.5),
            review_order: Some(ReviewOrder::Random),
        },
        at: None,
    }
}

/// Returns a shown item with the results of two metrics.
fn two() -> Shown {
    let of = |metric: ThresholdMetric| (metric, ContentHash::of(metric.name().as_bytes()));
    Shown::Results(vec![
        of(ThresholdMetric::Density),
        of(ThresholdMetric::Ensemble),
    ])
}

fn turned() -> Shown {
    Shown::Check {
        check: AttentionCheck::Turned { angle_deg: 9.5 },
        metric: ThresholdMetric::Density,
        result_hash: ContentHash::of(b"density"),
    }
}

async fn counted(catalog: &Catalog) -> Vec<Vec<Verdict>> {
    let detail = catalog.pair(&name("p0")).await.expect("a read");
    let metrics = detail.expect("the pair").results.metrics;
    let verdicts = metrics
        .iter()
        .map(|m| m.verdicts.iter().map(|v| v.verdict).collect());
    verdicts.collect()
}

#[tokio::test]
async fn an_answer_sent_again_is_stored_once() {
    let world = World::new(1).await;
    world.finish_one().await;
    for (shown, is_new) in [(two(), true), (two(), false), (turned(), false)] {
        let stored = world
            .catalog
            .answer(given("e1", Verdict::Fail), shown, 5)
            .await;
        assert_eq!(stored.expect("stored"), is_new);
    }
    let log = world.catalog.verdict_log(None).await.expect("a log");
    assert_eq!(log.len(), 2);
    assert!(log.iter().all(|event| event.act == log[0].id));
    assert_eq!(log[0].context, given("e1", Verdict::Fail).context);
    assert_eq!(log[0].reason, Some(Reason::WrongPair));
    let fail = vec![Verdict::Fail];
    assert_eq!(
        counted(&world.catalog).await,
        [vec![], fail.clone(), fail, vec![]]
    );
}

#[tokio::test]
async fn answers_to_attention_checks_are_not_verdicts() {
    let world = World::new(1).await;
    world.finish_one().await;
    for event in ["c1", "c1"] {
        let stored = world
            .catalog
            .answer(given(event, Verdict::Fail), turned(), 5)
            .await;
        stored.expect("stored");
    }
    assert!(
        world
            .catalog
            .verdict_log(None)
            .await
            .expect("a log")
            .is_empty()
    );
    assert!(counted(&world.catalog).await.iter().all(Vec::is_empty));
    let checks = world
        .catalog
        .attention_check_answers()
        .await
        .expect("checks");
    assert_eq!(checks.len(), 1);
    assert_eq!(checks[0].check, AttentionCheck::Turned { angle_deg: 9.5 });
    assert!(checks[0].check.is_fault());
    assert_eq!(checks[0].context.shown_ms, Some(1_900));
}

#[tokio::test]
async fn only_the_reviewer_can_undo_an_answer_by_its_event() {
    let world = World::new(1).await;
    world.finish_one().await;
    let answer = async |event: &str, verdict, shown, at| {
        let stored = world.catalog.answer(given(event, verdict), shown, at).await;
        stored.expect("stored");
    };
    answer("e1", Verdict::Pass, two(), 5).await;
    answer("c1", Verdict::Fail, turned(), 6).await;
    answer("e2", Verdict::Fail, two(), 7).await;
    let left = async || -> Vec<String> {
        let answers = world.catalog.answers("ana").await.expect("answers");
        answers.into_iter().map(|a| a.event).collect()
    };
    assert_eq!(left().await, ["e1", "e1", "c1", "e2", "e2"]);
    let other = world.catalog.undo_event("e2", "bo", 8).await;
    assert!(matches!(other, Err(CatalogError::NothingToUndo(_))));
    for event in ["e2", "e2", "c1"] {
        let taken = world.catalog.undo_event(event, "ana", 8).await;
        taken.expect("undone");
    }
    assert_eq!(left().await, ["e1", "e1"]);
    assert_eq!(counted(&world.catalog).await[1], [Verdict::Pass]);
    let checks = world
        .catalog
        .attention_check_answers()
        .await
        .expect("checks");
    assert_eq!(checks[0].undone_at, Some(8));
    assert!(
        world
            .catalog
            .answers("bo")
            .await
            .expect("answers")
            .is_empty()
    );
}

#[tokio::test]
async fn a_verdict_from_the_command_line_is_among_the_answers() {
    let world = World::new(1).await;
    world.finish_one().await;
    let typed = NewVerdict {
        context: ReviewContext::default(),
        at: Some(3),
        ..given("", Verdict::Pass)
    };
    world
        .catalog
        .verdict_set(vec![typed], 9)
        .await
        .expect("set");
    let answers = world.catalog.answers("ana").await.expect("answers");
    assert_eq!(answers.len(), ThresholdMetric::ALL.len());
    assert_eq!((answers[0].event.as_str(), answers[0].at), ("act-1", 3));
    assert!(matches!(answers[0].on, AnsweredOn::Result(_)));
    let taken = world.catalog.undo_event("act-1", "ana", 10).await;
    taken.expect("undone");
    assert!(
        world
            .catalog
            .answers("ana")
            .await
            .expect("answers")
            .is_empty()
    );
}

#[tokio::test]
async fn importing_a_log_twice_stores_each_verdict_once() {
    let world = World::new(1).await;
    world.finish_one().await;
    let of = |metric| NewVerdict {
        metric: Some(metric),
        ..given("e1", Verdict::Pass)
    };
    let log = ThresholdMetric::PAPER.map(of).to_vec();
    for stored in [3, 0] {
        let set = world.catalog.verdict_set(log.clone(), 5).await;
        assert_eq!(set.expect("stored"), stored);
    }
    assert_eq!(
        world.catalog.verdict_log(None).await.expect("a log").len(),
        3
    );
}

#[tokio::test]
async fn a_verdict_on_an_older_result_is_kept_as_stale() {
    let world = World::new(1).await;
    world.finish_one().await;
    let old = Shown::Results(vec![(ThresholdMetric::Density, ContentHash::of(b"old"))]);
    let stored = world
        .catalog
        .answer(given("e1", Verdict::Pass), old, 5)
        .await;
    assert!(stored.expect("stored"));
    assert!(counted(&world.catalog).await.iter().all(Vec::is_empty));
    let log = world.catalog.verdict_log(None).await.expect("a log");
    assert!(log.len() == 1 && !log[0].current);
}

fn manual_alignment(event: &str) -> ManualAlignment {
    ManualAlignment {
        event: event.to_owned(),
        pair: name("p0"),
        reviewer: "ana".to_owned(),
        print_from_depth: Affine2::similarity(0.1 + 0.2, 0.3, [1.0, -2.0]),
        print_from_mesh: PrintFromMesh([[0.1; 4], [0.2; 4], [0.3; 4]]),
        mesh_hash: ContentHash::of(b"mesh"),
        print_hash: ContentHash::of(b"print"),
        depth_hash: ContentHash::of(b"depth"),
        seen: ContentHash::of(b"seen"),
        iou: 0.75,
        dice: 0.85,
        note: None,
    }
}

#[tokio::test]
async fn a_manual_alignment_is_stored_once_beside_the_result() {
    let world = World::new(1).await;
    world.finish_one().await;
    for is_new in [true, false] {
        let stored = world
            .catalog
            .store_manual_alignment(manual_alignment("a1"), 5)
            .await;
        assert_eq!(stored.expect("stored"), is_new);
    }
    let another_mesh = ManualAlignment {
        mesh_hash: ContentHash::of(b"another"),
        ..manual_alignment("a2")
    };
    world
        .catalog
        .store_manual_alignment(another_mesh, 6)
        .await
        .expect("stored");
    let stored = world.catalog.manual_alignments().await.expect("a read");
    assert_eq!(stored[0].made, manual_alignment("a1"));
    assert!(stored[0].holds && stored[0].on_current_depth);
    assert!(!stored[1].holds);
    world
        .catalog
        .undo_event("a1", "ana", 7)
        .await
        .expect("undone");
    let stored = world.catalog.manual_alignments().await.expect("a read");
    assert_eq!((stored.len(), stored[0].undone_at), (2, Some(7)));
}

#[tokio::test]
async fn triggers_reject_changes_of_answers_and_alignments() {
    let world = World::new(1).await;
    world.finish_one().await;
    let check = given("c1", Verdict::Fail);
    world
        .catalog
        .answer(check, turned(), 5)
        .await
        .expect("stored");
    world
        .catalog
        .store_manual_alignment(manual_alignment("a1"), 5)
        .await
        .expect("stored");
    for event in ["c1", "a1"] {
        world
            .catalog
            .undo_event(event, "ana", 6)
            .await
            .expect("undone");
    }
    let mut conn = world.place.conn().await;
    for sql in [
        "UPDATE attention_check_answer SET reviewer = 'bo'",
        "DELETE FROM attention_check_answer",
        "UPDATE attention_check_undo SET at = 9",
        "DELETE FROM attention_check_undo",
        "UPDATE manual_alignment SET iou = 1",
        "DELETE FROM manual_alignment",
        "UPDATE manual_alignment_undo SET at = 9",
        "DELETE FROM manual_alignment_undo",
    ] {
        let refused = query(sql).execute(&mut conn).await;
        let refused = refused.expect_err(sql).to_string();
        assert!(refused.contains("append-only"), "{sql}: {refused}");
    }
}

#[tokio::test]
async fn the_review_key_is_the_same_after_reopening() {
    let world = World::new(0).await;
    let key = world.catalog.review_key().await.expect("a key");
    let again = world.place.open().await.expect("a catalog");
    assert_eq!(again.review_key().await.expect("a key"), key);
    let other = World::new(0).await;
    assert_ne!(other.catalog.review_key().await.expect("a key"), key);
}
