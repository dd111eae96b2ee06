//! Manual alignments are stored, exported and scored like results. Items with a duplicate hide them until answered.

use std::process::Stdio;

use mocban::catalog::StoredAlignment;
use mocban::store::Project;
use serde_json::{Value, json};

use crate::cli::mocban;
use crate::page::{NO_CHECKS, Page, answer, open_review};
use crate::resume::run;
use crate::review_page::ask;
use crate::waiting::wait_until;

fn alignments(project: &Project) -> Vec<StoredAlignment> {
    ask(project, async |catalog| {
        catalog.manual_alignments().await.expect("alignments")
    })
}

#[test]
fn a_manual_alignment_is_stored_with_the_result_and_exported() {
    let (_dir, project, page) = open_review(&NO_CHECKS);
    let item = page.queue().remove(0);
    let id = item["id"].as_str().expect("an id");
    let start_of_editor = || page.get(&format!("/api/alignment/{id}")).json();
    let start = start_of_editor();
    assert_eq!(
        [&item["manual_alignment"], &start["previous"]],
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
    // An export with an alignment log can be replaced.
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
        let manual = &line["manual_alignment"];
        assert_eq!(manual["reviewer"], "lan");
        assert_eq!(manual["print_from_mesh"], json!(second.print_from_mesh));
        assert_ne!(manual["print_from_mesh"], line["print_from_mesh"]);
    }
    // The page and `show` report the alignment. The editor starts with it.
    let near = |a: &Value, b: f64| (a.as_f64().expect("a number") - b).abs() < 1e-6;
    let summary = &page.queue()[0]["manual_alignment"];
    assert!(near(&summary["rotation_deg"], 0.0), "{summary}");
    assert!(near(&summary["shift_px"][0], b[0] - a[0]), "{summary}");
    assert!(near(
        &start_of_editor()["previous"][0][2],
        map[0][2].as_f64().expect("a number")
    ));
    let pair = item["pair"].as_str().expect("a name");
    let shown = mocban(project.dir(), &["--json", "show", pair])
        .expect(0)
        .json();
    assert_eq!(shown["manual_alignments"][1]["reviewer"], "lan");
    let text = mocban(project.dir(), &["show", pair]).expect(0).out;
    assert!(text.contains("lan: rotated 0.0°, shifted"), "{text}");
    let undone = page
        .post("/api/undo", &json!({ "event": "a1" }))
        .expect("a reply");
    assert_eq!(undone.status, 200);
    assert!(alignments(&project)[1].undone_at.is_some());
    assert!(near(
        &page.queue()[0]["manual_alignment"]["shift_px"][0],
        0.0
    ));
}

#[test]
fn an_alignment_is_hidden_on_a_duplicate_until_it_is_answered() {
    let (_dir, _, page) = open_review(&["--attention-checks", "0", "--duplicates", "100"]);
    let queue = page.queue();
    let start = |item: &Value| {
        let id = item["id"].as_str().expect("an id");
        page.get(&format!("/api/alignment/{id}")).json()
    };
    let item = &queue[0];
    let body = json!({
        "event": "a1", "item": item["id"], "view_from_depth": start(item)["view_from_depth"], "note": null,
    });
    assert_eq!(page.post("/api/align", &body).expect("a reply").status, 200);
    let aligned = |page: &Page| {
        let queue = page.queue();
        let items = queue
            .iter()
            .filter(|item| !item["manual_alignment"].is_null());
        items.map(|item| item["id"].clone()).collect::<Vec<_>>()
    };
    assert!(aligned(&page).is_empty());
    assert!(queue.iter().all(|item| start(item)["previous"].is_null()));
    page.post("/api/answer", &answer("e1", item, "pass"))
        .expect("a reply");
    assert_eq!(aligned(&page), [item["id"].clone()]);
    assert!(!start(item)["previous"].is_null());
}

#[test]
fn page_editor_and_show_report_equal_scores() {
    let (_dir, project, page) = open_review(&[&NO_CHECKS[..], &["--metric", "density"]].concat());
    let item = page.queue().remove(0);
    let id = item["id"].as_str().expect("an id");
    page.post("/api/answer", &answer("e1", &item, "pass"))
        .expect("a reply");
    let details = page.get(&format!("/api/details/{id}")).json();
    let map = page.get(&format!("/api/alignment/{id}")).json()["view_from_depth"].clone();
    let body = json!({ "event": "a1", "item": id, "view_from_depth": map, "note": null });
    let aligned = page.post("/api/align", &body).expect("a reply").json();
    let pair = item["pair"].as_str().expect("a name");
    let shown = mocban(project.dir(), &["--json", "show", pair])
        .expect(0)
        .json();
    let metrics = shown["metrics"].as_array().expect("metrics");
    let density = metrics.iter().find(|found| found["metric"] == "density");
    for score in ["iou", "dice"] {
        let number = |value: &Value| (value.as_f64().expect("a number") * 1e4).round();
        let shown = number(&density.expect("a result")["scores"][score]);
        assert_eq!(
            [number(&details[score]), number(&aligned[score])],
            [shown; 2]
        );
    }
}

/// A run that computes the pairs again and stops at a point, until it is let go.
struct HeldRun {
    process: std::process::Child,
    file: std::path::PathBuf,
}

impl HeldRun {
    fn start(project: &Project, point: &str, settings: &[&str]) -> Self {
        let file = project.dir().join("held");
        let mut command = run(
            project,
            &[&["-j", "1", "--rerun", "all"], settings].concat(),
        );
        command
            .env("MOCBAN_HOLD_AT", point)
            .env("MOCBAN_HOLD_FILE", &file);
        let command = command.stdout(Stdio::null()).stderr(Stdio::null());
        let process = command.spawn().expect("the binary starts");
        wait_until("the point is reached", || file.exists());
        Self { process, file }
    }

    fn finish(mut self) {
        std::fs::remove_file(&self.file).expect("removed");
        assert!(self.process.wait().expect("an exit code").success());
    }
}

#[test]
fn while_a_pair_is_computed_again_its_editor_says_so_and_then_shows_the_stored_result() {
    for (settings, code) in [(&[][..], 200), (&["--set", "depth.longest_px=80"], 410)] {
        let (_dir, project, page) = open_review(&NO_CHECKS);
        let item = page.queue().remove(0);
        let (pair, id) = (item["pair"].as_str(), item["id"].as_str());
        let (pair, id) = (pair.expect("a name"), id.expect("an id"));
        let editor = || page.get(&format!("/api/alignment/{id}"));
        let mask = || page.get(&format!("/image/{id}/depth-frame-mask"));
        let map = editor().json()["view_from_depth"].clone();
        let save = || {
            let body = json!({ "event": "a1", "item": id, "view_from_depth": map, "note": null });
            page.post("/api/align", &body).expect("a reply")
        };
        let held = HeldRun::start(&project, &format!("normalize:computed@{pair}"), settings);
        // The page sends an alignment again after a 503.
        for reply in [editor(), mask(), save()] {
            assert_eq!(reply.status, 503);
            let error = reply.json()["error"].to_string();
            assert!(error.contains("no complete result"), "{error}");
        }
        held.finish();
        for reply in [editor(), mask(), save()] {
            assert_eq!(reply.status, code, "{settings:?}");
        }
        assert_eq!(alignments(&project).len(), usize::from(code == 200));
    }
}
