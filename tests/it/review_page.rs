//! The review server stores a verdict only for the result that was shown, and does not reveal the metric of an item.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader};
use std::process::Stdio;

use mocban::catalog::{AttentionCheckAnswer, Catalog};
use mocban::domain::artifact_role::DEPTH;
use mocban::domain::{PairName, Reason, Stage, Verdict};
use mocban::store::Project;
use serde_json::{Value, json};

use crate::cli::{Call, mocban};
use crate::page::{NO_CHECKS, Page, answer, open_review, read_project, review};

/// Opens a project's catalog and reads from it.
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

/// Returns the answers to attention checks and duplicates.
pub(crate) fn check_answers(project: &Project) -> Vec<AttentionCheckAnswer> {
    ask(project, async |catalog| {
        catalog.attention_check_answers().await.expect("answers")
    })
}

fn log(project: &Project) -> Vec<Value> {
    let output = mocban(project.dir(), &["--json", "verdict", "log"]).expect(0);
    let lines = output.out.lines().map(serde_json::from_str);
    lines.collect::<Result<_, _>>().expect("JSON lines")
}

fn set(project: &Project, args: &[&str]) -> Call {
    mocban(project.dir(), &[&["verdict", "set"], args].concat()).expect(0)
}

#[test]
fn page_and_command_line_write_the_same_events() {
    let (_dir, project, page) = open_review(&NO_CHECKS);
    let item = page.queue().remove(0);
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
    let answered = |page: &Page| page.queue()[0]["answer"]["verdict"].clone();
    assert_eq!(answered(&page), "fail");
    mocban(project.dir(), &["verdict", "undo", "--reviewer", "lan"]).expect(0);
    assert_eq!(answered(&page), Value::Null);
    let pair = item["pair"].as_str().expect("a name");
    set(&project, &[pair, "pass", "--reviewer", "lan"]);
    assert_eq!(answered(&page), "pass");
    let event = page.queue()[0]["answer"]["event"].clone();
    let undone = page
        .post("/api/undo", &json!({ "event": event }))
        .expect("a reply");
    assert_eq!(undone.status, 200);
    assert_eq!(answered(&page), Value::Null);
}

#[test]
fn order_and_ids_survive_a_restart_and_differ_between_reviewers() {
    let (_dir, project, first) = open_review(&NO_CHECKS);
    let again = Page::open(&project, "lan", &NO_CHECKS);
    let other = Page::open(&project, "minh", &NO_CHECKS);
    assert_eq!(first.queue(), again.queue());
    let ids = |page: &Page| -> BTreeSet<String> {
        let queue = page.queue();
        queue.iter().map(|item| item["id"].to_string()).collect()
    };
    assert!(ids(&first).is_disjoint(&ids(&other)));
    let pairs = |page: &Page| -> Vec<Value> {
        page.queue()
            .iter()
            .map(|item| item["pair"].clone())
            .collect()
    };
    assert_ne!(pairs(&first), pairs(&other));
}

#[test]
fn results_that_look_the_same_are_one_item() {
    let (_dir, project, page) = open_review(&NO_CHECKS);
    let queue = page.queue();
    for (i, item) in queue.iter().enumerate() {
        let reply = page.post("/api/answer", &answer(&format!("e{i}"), item, "pass"));
        assert_eq!(reply.expect("a reply").status, 200);
    }
    // Every result has a verdict, although some were shown together.
    let report = mocban(project.dir(), &["report", "--format", "json"])
        .expect(0)
        .json();
    let rows = report["rows"].as_array().expect("rows");
    for row in rows {
        assert_eq!(row["judged"], 15, "{row}");
    }
    assert!(queue.len() < 15 * rows.len(), "{} items", queue.len());
}

#[test]
fn attention_checks_are_stored_apart_and_not_revealed_by_the_page() {
    let (_dir, project, page) = open_review(&["--attention-checks", "50", "--duplicates", "20"]);
    let queue = page.queue();
    let mut shapes: BTreeMap<bool, BTreeSet<String>> = BTreeMap::new();
    for (i, item) in queue.iter().enumerate() {
        let before = check_answers(&project).len();
        let reply = page.post("/api/answer", &answer(&format!("e{i}"), item, "pass"));
        let is_check = check_answers(&project).len() > before;
        // The pair is hidden, and all kinds of items have the same fields.
        assert_eq!(item["pair"], Value::Null);
        let keys: Vec<_> = item.as_object().expect("fields").keys().cloned().collect();
        let mut output = reply.expect("a reply").json();
        output["stored"] = json!("");
        shapes
            .entry(is_check)
            .or_default()
            .insert(format!("{keys:?} {output}"));
        if i % 9 == 0 {
            let id = item["id"].as_str().expect("an id");
            let details = page.get(&format!("/api/details/{id}")).json();
            let fields: Vec<_> = details
                .as_object()
                .expect("fields")
                .keys()
                .cloned()
                .collect();
            assert_eq!(fields, ["dice", "iou", "metrics", "others", "pair"]);
            assert_eq!(details["others"], json!([]));
        }
    }
    assert_eq!(shapes[&true], shapes[&false]);
    let checks = check_answers(&project);
    let faults = checks
        .iter()
        .filter(|answer| answer.check.is_fault())
        .count();
    assert!(
        faults > 5 && checks.len() > faults,
        "{faults} of {}",
        checks.len()
    );
    assert_eq!(
        log(&project)
            .iter()
            .filter(|event| event["current"] == false)
            .count(),
        0
    );
    let text = [
        page.get("/").body,
        page.get("/api/queue").body,
        page.get("/api/config").body,
    ]
    .concat();
    let text = String::from_utf8(text).expect("UTF-8");
    for word in [
        "control",
        "planted",
        "repeat",
        "duplicate",
        "turned\"",
        "threshold\"",
        "nl_ssim",
        "ensemble",
        "confidence",
    ] {
        assert!(!text.contains(word), "the page contains {word}");
    }
    // After a reload everything is answered, attention checks included.
    assert!(
        page.queue()
            .iter()
            .all(|item| item["answer"]["verdict"] == "pass")
    );
}

/// Removes the artifact files of a project.
fn remove_artifacts(project: &Project) {
    std::fs::remove_dir_all(project.artifacts_dir()).expect("removed");
}

#[test]
fn attention_checks_that_were_planted_stay_although_files_are_lost() {
    let (_dir, project, page) = open_review(&[]);
    let ids = || {
        let queue = page.queue();
        let ids = queue.iter().map(|item| item["id"].to_string());
        ids.collect::<Vec<_>>()
    };
    let before = ids();
    remove_artifacts(&project);
    assert_eq!(ids(), before);
    let queue = page.get("/api/queue").json();
    assert_eq!(queue["fault_shortage"], Value::Null);
}

#[test]
fn attention_checks_that_cannot_be_planted_are_told() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    remove_artifacts(&project);
    let mut command = review(&project, "lan");
    command.stderr(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().expect("the binary starts");
    let lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let mut lines = lines.map(|line| line.expect("a line"));
    let warning = lines.find(|line| line.starts_with("warning: only "));
    child.kill().expect("killed");
    child.wait().expect("dead");
    let warning = warning.expect("a warning");
    let start = "warning: only 0 of 5 attention checks could be planted, because files of results cannot be read (";
    assert!(warning.starts_with(start), "{warning}");
    let page = Page::open(&project, "lan", &[]);
    let queue = page.get("/api/queue").json();
    assert_eq!(queue["fault_shortage"], json!({ "made": 0, "wanted": 5 }));
}

/// Answers every item. Returns the pairs in which faults were planted.
fn pairs_with_faults(project: &Project, page: &Page) -> BTreeSet<PairName> {
    for (number, item) in page.queue().iter().enumerate() {
        let body = answer(
            &format!("{}-{number}", page.pid().as_raw_nonzero()),
            item,
            "fail",
        );
        let reply = page.post("/api/answer", &body).expect("a reply");
        assert_eq!(reply.status, 200);
    }
    let answers = check_answers(project).into_iter();
    let faults = answers.filter(|answer| answer.check.is_fault());
    faults.map(|answer| answer.pair).collect()
}

#[test]
fn another_result_takes_the_place_of_one_that_cannot_be_read() {
    let options = ["--attention-checks", "1", "--duplicates", "0"];
    let (_dir, project, page) = open_review(&options);
    let first = pairs_with_faults(&project, &page);
    drop(page);
    for pair in &first {
        let depth = ask(&project, async |catalog| {
            let detail = catalog.pair(pair).await.expect("the pair");
            let results = detail.expect("the pair").results;
            results.stage(Stage::Depth).expect("a result").files[DEPTH].clone()
        });
        std::fs::remove_file(project.artifact_path(&depth)).expect("removed");
    }
    let page = Page::open(&project, "lan", &options);
    let queue = page.get("/api/queue").json();
    assert_eq!(queue["fault_shortage"], Value::Null);
    let both = pairs_with_faults(&project, &page);
    assert!(both.len() > first.len(), "{first:?} {both:?}");
}

#[test]
fn a_finished_review_stays_finished_when_others_judge() {
    let (_dir, project, page) = open_review(&[]);
    let planted = pairs_with_faults(&project, &page);
    assert!(!planted.is_empty());
    for pair in planted {
        set(
            &project,
            &[pair.as_str(), "không đạt", "--reviewer", "binh"],
        );
    }
    drop(page);
    let queue = Page::open(&project, "lan", &[]).queue();
    assert!(!queue.is_empty());
    let open = queue.iter().filter(|item| item["answer"].is_null()).count();
    assert_eq!(open, 0, "of {}", queue.len());
}

#[test]
fn a_decomposed_name_is_of_the_same_reviewer() {
    let (_dir, project, page) = open_review(&NO_CHECKS);
    let pair = page.queue()[0]["pair"].as_str().expect("a pair").to_owned();
    let [decomposed, composed] = ["Bi\u{300}nh", "B\u{ec}nh"];
    set(&project, &[&pair, "pass", "--reviewer", decomposed]);
    set(&project, &[&pair, "pass", "--reviewer", composed]);
    let log = log(&project);
    assert!(log.len() <= 4, "{log:?}");
    assert!(log.iter().all(|event| event["reviewer"] == composed));
    let queue = Page::open(&project, decomposed, &NO_CHECKS).queue();
    assert!(queue.iter().any(|item| item["answer"]["verdict"] == "pass"));
}

#[test]
fn verdicts_of_others_are_shown_to_an_adjudicator_after_the_answer() {
    let (_dir, project, first) = open_review(&NO_CHECKS);
    let item = first.queue().remove(0);
    first
        .post("/api/answer", &answer("e1", &item, "pass"))
        .expect("a reply");
    let pair = item["pair"].as_str().expect("a name");
    set(
        &project,
        &[pair, "fail", "--reviewer", "minh", "--reason", "angle"],
    );
    let idle = |reviewer: &str| {
        let output = mocban(
            project.dir(),
            &["review", "--reviewer", reviewer, "--adjudicate"],
        );
        let output = output.expect(0);
        assert!(
            output.err.contains("nothing to adjudicate"),
            "{}",
            output.err
        );
        assert_eq!(output.out, "", "no address");
    };
    // A reviewer who is party to the conflict cannot settle it.
    idle("lan");
    let third = Page::open(&project, "hoa", &["--adjudicate"]);
    let queue = third.queue();
    assert_eq!(queue.len(), 1);
    let details = format!("/api/details/{}", queue[0]["id"].as_str().expect("an id"));
    assert_eq!(third.get(&details).status, 403);
    third
        .post("/api/answer", &answer("h1", &queue[0], "fail"))
        .expect("a reply");
    let output = third.get(&details).json();
    let verdicts: BTreeSet<String> = output["others"]
        .as_array()
        .expect("others")
        .iter()
        .map(|other| format!("{} {}", other["reviewer"], other["verdict"]))
        .collect();
    let wanted = ["\"lan\" \"pass\"", "\"minh\" \"fail\""].map(str::to_owned);
    assert_eq!(verdicts, BTreeSet::from(wanted));
    // The conflict is settled.
    idle("dung");
    let log = log(&project);
    let adjudications = log.iter().filter(|event| event["reviewer"] == "hoa");
    assert!(adjudications.clone().count() > 0);
    for event in adjudications {
        assert_eq!(event["review_order"], "adjudicate");
    }
    assert!(
        log.iter()
            .any(|event| event["reviewer"] == "lan" && event["undone_at"] == Value::Null)
    );
}

#[test]
fn a_jump_finds_only_the_first_item_of_a_pair() {
    let many = "--attention-checks 50 --duplicates 50 --metric density";
    let (_dir, _, page) = open_review(&many.split(' ').collect::<Vec<_>>());
    let output = page.get("/api/queue").json();
    let pairs = output["pairs"].as_array().expect("names");
    assert_eq!(pairs.len(), 15);
    let items = output["items"].as_array().expect("items");
    assert!(items.len() > pairs.len(), "{}", items.len());
    let place = |id: &Value| items.iter().position(|item| item["id"] == *id);
    let pair_of = |item: &Value, event: &str| {
        page.post("/api/answer", &answer(event, item, "pass"))
            .expect("a reply");
        let id = item["id"].as_str().expect("an id");
        page.get(&format!("/api/details/{id}")).json()["pair"].clone()
    };
    let pairs_of_items: Vec<Value> = (0..items.len())
        .map(|i| pair_of(&items[i], &format!("e{i}")))
        .collect();
    for pair in pairs {
        let name = pair.as_str().expect("a name");
        let found = page.get(&format!("/api/find/{name}")).json();
        let first = pairs_of_items.iter().position(|of| of == pair);
        assert_eq!(place(&found["id"]), first, "{name}");
    }
    assert_eq!(page.get("/api/find/nobody").status, 404);
}

#[test]
fn a_changed_result_is_not_shown_but_the_answer_is_stored() {
    let (_dir, project, page) = open_review(&["--attention-checks", "0"]);
    let item = page.queue().remove(0);
    let smaller = ["--set", "depth.longest_px=80", "run", "--rerun", "stale"];
    mocban(project.dir(), &smaller).expect(0);
    let id = item["id"].as_str().expect("an id");
    assert_eq!(page.get(&format!("/image/{id}/print")).status, 410);
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
    assert_ne!(page.queue()[0]["id"], item["id"]);
}
