//! Corrections by hand as the server takes and tells them: beside the result, in the same measure, to no repeat.

use mocban::catalog::StoredAlignment;
use mocban::store::Project;
use serde_json::{Value, json};

use crate::cli::mocban;
use crate::page::{Page, answer, read_project};
use crate::review_page::ask;

fn alignments(project: &Project) -> Vec<StoredAlignment> {
    ask(project, async |catalog| {
        catalog.manual_alignments().await.expect("alignments")
    })
}

#[test]
fn an_alignment_by_hand_is_stored_beside_the_result_and_exported() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(
        &project,
        "lan",
        &["--attention-checks", "0", "--duplicates", "0"],
    );
    let item = page.deck().remove(0);
    let id = item["id"].as_str().expect("an id");
    let begin = || page.get(&format!("/api/correction/{id}")).json();
    let start = begin();
    assert_eq!(
        [&item["corrected"], &start["laid"]],
        [&Value::Null, &Value::Null]
    );
    let mut map = start["view_from_depth"].clone();
    let body = |event: &str, map: &Value| json!({ "event": event, "item": id, "view_from_depth": map, "note": "x" });
    let unmoved = page
        .post("/api/align", &body("a0", &map))
        .expect("a reply")
        .json();
    for flat in [
        json!([[0, 0, 0], [0, 0, 0]]),
        json!([[1, 0, 1e30], [0, 1, 0]]),
    ] {
        let refused = page
            .post("/api/align", &body("a9", &flat))
            .expect("a reply");
        assert_eq!(refused.status, 422, "{flat}");
    }
    map[0][2] = json!(map[0][2].as_f64().expect("a number") + 40.0);
    for _ in 0..2 {
        let moved = page
            .post("/api/align", &body("a1", &map))
            .expect("a reply")
            .json();
        assert!(
            moved["iou"].as_f64() < unmoved["iou"].as_f64(),
            "{moved} {unmoved}"
        );
    }
    let stored = alignments(&project);
    assert_eq!(stored.len(), 2);
    let [first, second] = [&stored[0].made, &stored[1].made];
    assert!(
        stored
            .iter()
            .all(|alignment| alignment.holds && alignment.on_current_depth)
    );
    let [a, b] = [first, second].map(|made| made.print_from_depth.apply([10.0, 20.0]));
    assert!(
        b[0] > a[0] + 1.0 && (a[1] - b[1]).abs() < 1e-9,
        "{a:?} {b:?}"
    );
    mocban(project.dir(), &["export", "-o", "out"]).expect(0);
    let log =
        std::fs::read_to_string(project.dir().join("out/manual_alignments.jsonl")).expect("a log");
    assert_eq!(log.lines().count(), 2);
    // An export with all it may hold is replaced as any other.
    mocban(project.dir(), &["export", "-o", "out"]).expect(0);
    let lines = std::fs::read_to_string(project.dir().join("out/pairs.jsonl")).expect("lines");
    let lines = lines
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    for line in lines {
        if line["id"] != item["pair"] {
            assert_eq!(line["manual_alignment"], Value::Null);
            continue;
        }
        let by_hand = &line["manual_alignment"];
        assert_eq!(by_hand["reviewer"], "lan");
        assert_eq!(by_hand["print_from_mesh"], json!(second.print_from_mesh));
        assert_ne!(by_hand["print_from_mesh"], line["print_from_mesh"]);
    }
    // The page tells it and begins there; so does `show`.
    let near = |a: &Value, b: f64| (a.as_f64().expect("a number") - b).abs() < 1e-6;
    let told = &page.deck()[0]["corrected"];
    assert!(near(&told["turned_deg"], 0.0), "{told}");
    assert!(near(&told["shifted_px"][0], b[0] - a[0]), "{told}");
    assert!(near(
        &begin()["laid"][0][2],
        map[0][2].as_f64().expect("a number")
    ));
    let pair = item["pair"].as_str().expect("a name");
    let shown = mocban(project.dir(), &["--json", "show", pair])
        .expect(0)
        .json();
    assert_eq!(shown["manual_alignments"][1]["reviewer"], "lan");
    let words = mocban(project.dir(), &["show", pair]).expect(0).out;
    assert!(words.contains("lan: rotated 0.0°, shifted"), "{words}");
    let undone = page
        .post("/api/undo", &json!({ "event": "a1" }))
        .expect("a reply");
    assert_eq!(undone.status, 200);
    assert!(alignments(&project)[1].undone_at.is_some());
    assert!(near(&page.deck()[0]["corrected"]["shifted_px"][0], 0.0));
}

#[test]
fn a_correction_is_told_of_no_repeat_before_it_is_answered() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(
        &project,
        "lan",
        &["--attention-checks", "0", "--duplicates", "100"],
    );
    let deck = page.deck();
    let start = |item: &Value| {
        let id = item["id"].as_str().expect("an id");
        page.get(&format!("/api/correction/{id}")).json()
    };
    let item = &deck[0];
    let body = json!({
        "event": "a1", "item": item["id"], "view_from_depth": start(item)["view_from_depth"], "note": null,
    });
    assert_eq!(page.post("/api/align", &body).expect("a reply").status, 200);
    let corrected = |page: &Page| {
        let deck = page.deck();
        let told = deck.iter().filter(|item| !item["corrected"].is_null());
        told.map(|item| item["id"].clone()).collect::<Vec<_>>()
    };
    assert!(corrected(&page).is_empty());
    assert!(deck.iter().all(|item| start(item)["laid"].is_null()));
    page.post("/api/answer", &answer("e1", item, "pass"))
        .expect("a reply");
    assert_eq!(corrected(&page), [item["id"].clone()]);
    assert!(!start(item)["laid"].is_null());
}

#[test]
fn scores_are_the_same_in_the_page_by_hand_and_in_show() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let plain = [
        "--attention-checks",
        "0",
        "--duplicates",
        "0",
        "--metric",
        "density",
    ];
    let page = Page::open(&project, "lan", &plain);
    let item = page.deck().remove(0);
    let id = item["id"].as_str().expect("an id");
    page.post("/api/answer", &answer("e1", &item, "pass"))
        .expect("a reply");
    let about = page.get(&format!("/api/about/{id}")).json();
    let map = page.get(&format!("/api/correction/{id}")).json()["view_from_depth"].clone();
    let body = json!({ "event": "a1", "item": id, "view_from_depth": map, "note": null });
    let laid = page.post("/api/align", &body).expect("a reply").json();
    let pair = item["pair"].as_str().expect("a name");
    let shown = mocban(project.dir(), &["--json", "show", pair])
        .expect(0)
        .json();
    let metrics = shown["metrics"].as_array().expect("metrics");
    let density = metrics.iter().find(|found| found["metric"] == "density");
    for score in ["iou", "dice"] {
        let number = |value: &Value| (value.as_f64().expect("a number") * 1e4).round();
        let shown = number(&density.expect("a result")["scores"][score]);
        assert_eq!([number(&about[score]), number(&laid[score])], [shown; 2]);
    }
}
