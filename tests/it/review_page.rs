//! What the review page's server stores and tells: bound to what was seen, blind, the same after a restart.

use std::collections::{BTreeMap, BTreeSet};

use mocban::catalog::{AttentionCheckAnswer, Catalog};
use mocban::domain::{Reason, Verdict};
use mocban::store::Project;
use serde_json::{Value, json};

use crate::cli::{Call, mocban};
use crate::page::{Page, answer, read_project};

/// Reads something of a project's catalog.
pub(crate) fn ask<T>(project: &Project, read: impl AsyncFnOnce(&Catalog) -> T) -> T {
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let catalog = Catalog::open_read_only(&project.catalog_path()).await;
        let catalog = catalog.expect("the catalog");
        let found = read(&catalog).await;
        catalog.close().await;
        found
    })
}

fn controls(project: &Project) -> Vec<AttentionCheckAnswer> {
    ask(project, async |catalog| {
        catalog.attention_check_answers().await.expect("answers")
    })
}

fn log(project: &Project) -> Vec<Value> {
    let told = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    let lines = told.out.lines().map(serde_json::from_str);
    lines.collect::<Result<_, _>>().expect("JSON lines")
}

fn set(project: &Project, args: &[&str]) -> Call {
    mocban(project.dir(), &[&["verdict", "set"], args].concat()).expect(0)
}

#[test]
fn page_and_command_line_write_the_same_events() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(
        &project,
        "lan",
        &["--attention-checks", "0", "--duplicates", "0"],
    );
    let item = page.deck().remove(0);
    let mut body = answer("e1", &item, "fail");
    body["reason"] = json!("strokes_lost");
    body["note"] = json!(" mờ ở góc ");
    body["angle_read_deg"] = json!(-4.5);
    for is_new in [true, false] {
        let reply = page.post("/api/answer", &body).expect("a reply");
        assert_eq!((reply.status, &reply.json()["new"]), (200, &json!(is_new)));
    }
    let written = log(&project);
    assert!((1..=4).contains(&written.len()), "{written:?}");
    for event in &written {
        assert_eq!(event["pair"], item["pair"]);
        assert_eq!(event["reason"], "strokes_lost");
        assert_eq!(event["note"], "mờ ở góc");
        assert_eq!(event["angle_read_deg"], -4.5);
        assert_eq!(event["shown_ms"], 1200);
        assert_eq!(event["review_order"], "random");
        assert_eq!(event["current"], true);
        assert!(event["seen"].is_string());
    }
    let answered = |page: &Page| page.deck()[0]["answer"]["verdict"].clone();
    assert_eq!(answered(&page), "fail");
    mocban(project.dir(), &["verdict", "undo", "--reviewer", "lan"]).expect(0);
    assert_eq!(answered(&page), Value::Null);
    let pair = item["pair"].as_str().expect("a name");
    set(&project, &[pair, "pass", "--reviewer", "lan"]);
    assert_eq!(answered(&page), "pass");
    let event = page.deck()[0]["answer"]["event"].clone();
    let undone = page
        .post("/api/undo", &json!({ "event": event }))
        .expect("a reply");
    assert_eq!(undone.status, 200);
    assert_eq!(answered(&page), Value::Null);
}

#[test]
fn order_names_and_pictures_are_the_same_after_a_restart_and_others_for_another_reviewer() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let untested = ["--attention-checks", "0", "--duplicates", "0"];
    let first = Page::open(&project, "lan", &untested);
    let again = Page::open(&project, "lan", &untested);
    let other = Page::open(&project, "minh", &untested);
    assert_eq!(first.deck(), again.deck());
    let ids = |page: &Page| -> BTreeSet<String> {
        let deck = page.deck();
        deck.iter().map(|item| item["id"].to_string()).collect()
    };
    assert!(ids(&first).is_disjoint(&ids(&other)));
    let pairs = |page: &Page| -> Vec<Value> {
        page.deck()
            .iter()
            .map(|item| item["pair"].clone())
            .collect()
    };
    assert_ne!(pairs(&first), pairs(&other));
}

#[test]
fn results_that_look_the_same_are_one_card() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(
        &project,
        "lan",
        &["--attention-checks", "0", "--duplicates", "0"],
    );
    let deck = page.deck();
    for (i, item) in deck.iter().enumerate() {
        let reply = page.post("/api/answer", &answer(&format!("e{i}"), item, "pass"));
        assert_eq!(reply.expect("a reply").status, 200);
    }
    // Every result has its verdict though some were shown together.
    let report = mocban(project.dir(), &["report", "--format", "json"])
        .expect(0)
        .json();
    let rows = report["rows"].as_array().expect("rows");
    for row in rows {
        assert_eq!(row["judged"], 15, "{row}");
    }
    assert!(deck.len() < 15 * rows.len(), "{} cards", deck.len());
}

#[test]
fn planted_faults_are_stored_apart_and_nothing_in_the_page_tells_them() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(
        &project,
        "lan",
        &["--attention-checks", "50", "--duplicates", "20"],
    );
    let deck = page.deck();
    let mut shapes: BTreeMap<bool, BTreeSet<String>> = BTreeMap::new();
    for (i, item) in deck.iter().enumerate() {
        let before = controls(&project).len();
        let reply = page.post("/api/answer", &answer(&format!("e{i}"), item, "pass"));
        let is_control = controls(&project).len() > before;
        // No pair, which would be known again; the same fields of the same form, whatever it is.
        assert_eq!(item["pair"], Value::Null);
        let keys: Vec<_> = item.as_object().expect("fields").keys().cloned().collect();
        let mut told = reply.expect("a reply").json();
        told["stored"] = json!("");
        shapes
            .entry(is_control)
            .or_default()
            .insert(format!("{keys:?} {told}"));
        if i % 9 == 0 {
            let id = item["id"].as_str().expect("an id");
            let about = page.get(&format!("/api/about/{id}")).json();
            let fields: Vec<_> = about.as_object().expect("fields").keys().cloned().collect();
            assert_eq!(fields, ["dice", "iou", "metrics", "others", "pair"]);
            assert_eq!(about["others"], json!([]));
        }
    }
    assert_eq!(shapes[&true], shapes[&false]);
    let controls = controls(&project);
    let faults = controls
        .iter()
        .filter(|answer| answer.check.is_fault())
        .count();
    assert!(
        faults > 5 && controls.len() > faults,
        "{faults} of {}",
        controls.len()
    );
    assert_eq!(
        log(&project)
            .iter()
            .filter(|event| event["current"] == false)
            .count(),
        0
    );
    let whole = [
        page.get("/").body,
        page.get("/api/deck").body,
        page.get("/api/boot").body,
    ]
    .concat();
    let whole = String::from_utf8(whole).expect("UTF-8");
    for word in [
        "control",
        "planted",
        "repeat",
        "turned\"",
        "nl_ssim",
        "ensemble",
        "confidence",
    ] {
        assert!(!whole.contains(word), "the page says {word}");
    }
    // Read again, everything is answered: controls and repeats as well.
    assert!(
        page.deck()
            .iter()
            .all(|item| item["answer"]["verdict"] == "pass")
    );
}

#[test]
fn what_others_said_is_told_to_none_but_who_settles_it_and_then_after_the_answer() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let first = Page::open(
        &project,
        "lan",
        &["--attention-checks", "0", "--duplicates", "0"],
    );
    let item = first.deck().remove(0);
    first
        .post("/api/answer", &answer("e1", &item, "pass"))
        .expect("a reply");
    let pair = item["pair"].as_str().expect("a name");
    set(
        &project,
        &[pair, "fail", "--reviewer", "minh", "--reason", "angle"],
    );
    let idle = |reviewer: &str| {
        let told = mocban(
            project.dir(),
            &["review", "--reviewer", reviewer, "--adjudicate"],
        );
        let told = told.expect(0);
        assert!(told.err.contains("nothing to adjudicate"), "{}", told.err);
        assert_eq!(told.out, "", "no address");
    };
    // Who is party cannot settle.
    idle("lan");
    let third = Page::open(&project, "hoa", &["--adjudicate"]);
    let deck = third.deck();
    assert_eq!(deck.len(), 1);
    let about = format!("/api/about/{}", deck[0]["id"].as_str().expect("an id"));
    assert_eq!(third.get(&about).status, 403);
    third
        .post("/api/answer", &answer("h1", &deck[0], "fail"))
        .expect("a reply");
    let told = third.get(&about).json();
    let said: BTreeSet<String> = told["others"]
        .as_array()
        .expect("others")
        .iter()
        .map(|other| format!("{} {}", other["reviewer"], other["verdict"]))
        .collect();
    let wanted = ["\"lan\" \"pass\"", "\"minh\" \"fail\""].map(str::to_owned);
    assert_eq!(said, BTreeSet::from(wanted));
    // It is settled.
    idle("dung");
    let log = log(&project);
    let word = log.iter().filter(|event| event["reviewer"] == "hoa");
    assert!(word.clone().count() > 0);
    for event in word {
        assert_eq!(event["review_order"], "adjudicate");
    }
    assert!(
        log.iter()
            .any(|event| event["reviewer"] == "lan" && event["undone_at"] == Value::Null)
    );
}

#[test]
fn a_jump_leads_to_the_first_picture_of_a_pair_alone() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let many = [
        "--attention-checks",
        "50",
        "--duplicates",
        "50",
        "--metric",
        "density",
    ];
    let page = Page::open(&project, "lan", &many);
    let told = page.get("/api/deck").json();
    let pairs = told["pairs"].as_array().expect("names");
    assert_eq!(pairs.len(), 15);
    let cards = told["items"].as_array().expect("cards");
    assert!(cards.len() > pairs.len(), "{}", cards.len());
    let place = |id: &Value| cards.iter().position(|card| card["id"] == *id);
    let pair_of = |card: &Value, event: &str| {
        page.post("/api/answer", &answer(event, card, "pass"))
            .expect("a reply");
        let id = card["id"].as_str().expect("an id");
        page.get(&format!("/api/about/{id}")).json()["pair"].clone()
    };
    let of_card: Vec<Value> = (0..cards.len())
        .map(|i| pair_of(&cards[i], &format!("e{i}")))
        .collect();
    for pair in pairs {
        let name = pair.as_str().expect("a name");
        let found = page.get(&format!("/api/find/{name}")).json();
        let first = of_card.iter().position(|of| of == pair);
        assert_eq!(place(&found["id"]), first, "{name}");
    }
    assert_eq!(page.get("/api/find/nobody").status, 404);
}

#[test]
fn a_result_that_changed_meanwhile_is_not_shown_but_what_was_seen_is_stored() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(&project, "lan", &["--attention-checks", "0"]);
    let item = page.deck().remove(0);
    let smaller = ["--set", "depth.longest_px=80", "run", "--rerun", "stale"];
    mocban(project.dir(), &smaller).expect(0);
    let id = item["id"].as_str().expect("an id");
    assert_eq!(page.get(&format!("/picture/{id}/print")).status, 410);
    let mut body = answer("e1", &item, "fail");
    body["reason"] = json!("wrong_pair");
    assert_eq!(
        page.post("/api/answer", &body).expect("a reply").status,
        200
    );
    let log = log(&project);
    assert!(!log.is_empty() && log.iter().all(|event| event["current"] == false));
    let detail = ask(&project, async |catalog| {
        let events = catalog.verdict_log(None).await.expect("a log");
        events
            .into_iter()
            .map(|event| (event.verdict, event.reason))
            .next()
    });
    assert_eq!(detail, Some((Verdict::Fail, Some(Reason::WrongPair))));
    assert_ne!(page.deck()[0]["id"], item["id"]);
}
