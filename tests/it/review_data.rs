//! Snapshots of the JSON that the review server sends to its page.

use serde_json::{Value, json};

use crate::cli::mocban;
use crate::page::{NO_CHECKS, Page, answer, open_review};

/// Fields whose values differ between runs or depend on the images.
const REDACTED: [&str; 12] = [
    "csrf_token",
    "messages",
    "id",
    "pair",
    "pairs",
    "at",
    "iou",
    "dice",
    "shift_px",
    "view_from_depth",
    "previous",
    "canvas_from_view",
];

/// Replaces the value of each [`REDACTED`] field by the field's name, and rounds other floats to three decimals.
fn redacted(value: Value) -> Value {
    match value {
        Value::Object(object) => {
            let field = |(name, value): (String, Value)| {
                let is_shown = value.is_null() || !REDACTED.contains(&name.as_str());
                let shown = if is_shown {
                    redacted(value)
                } else {
                    json!(format!("[{name}]"))
                };
                (name, shown)
            };
            object.into_iter().map(field).collect()
        }
        Value::Array(values) => values.into_iter().map(redacted).collect(),
        Value::Number(number) if number.is_f64() => {
            let rounded = number
                .as_f64()
                .map(|number| (number * 1e3).round() / 1e3 + 0.0);
            json!(rounded)
        }
        other => other,
    }
}

/// Returns the path of an item's details.
fn details(item: &Value) -> String {
    format!("/api/details/{}", item["id"].as_str().expect("an id"))
}

fn post(page: &Page, path: &str, body: &Value) -> Value {
    page.post(path, body).expect("a reply").json()
}

#[test]
fn the_api_of_a_small_queue() {
    let small = ["--metric", "density", "--sample", "2"];
    let (_dir, _, page) = open_review(&[&NO_CHECKS[..], &small].concat());
    let config = page.get("/api/config").json();
    let mut body = answer("e1", &page.queue()[0], "fail");
    body["reason"] = json!("strokes_lost");
    body["note"] = json!("nét mờ");
    let stored = post(&page, "/api/answer", &body);
    let queue = page.get("/api/queue").json();
    insta::assert_json_snapshot!(redacted(json!({
        "config": config,
        "answer": stored,
        "queue": queue,
        "details": page.get(&details(&queue["items"][0])).json(),
        "missing": page.get("/api/details/none").json(),
        "undo": post(&page, "/api/undo", &json!({ "event": "e1" })),
    })));
}

#[test]
fn a_queue_with_attention_checks_hides_its_pairs() {
    let checks = "--attention-checks 100 --duplicates 0 --metric density --sample 2";
    let (_dir, _, page) = open_review(&checks.split(' ').collect::<Vec<_>>());
    post(
        &page,
        "/api/answer",
        &answer("e1", &page.queue()[0], "unsure"),
    );
    let queue = page.get("/api/queue").json();
    insta::assert_json_snapshot!(redacted(json!({
        "queue": queue,
        "details": page.get(&details(&queue["items"][0])).json(),
        "unanswered": page.get(&details(&queue["items"][1])).json(),
    })));
}

#[test]
fn an_adjudicator_sees_other_verdicts_in_the_details() {
    let small = ["--metric", "density", "--sample", "1"];
    let (_dir, project, page) = open_review(&[&NO_CHECKS[..], &small].concat());
    let item = page.queue().remove(0);
    post(&page, "/api/answer", &answer("e1", &item, "pass"));
    let pair = item["pair"].as_str().expect("a name");
    let fail = "--metric density --reviewer minh --reason angle --note nghiêng";
    let set = [
        &["verdict", "set", pair, "fail"],
        &fail.split(' ').collect::<Vec<_>>()[..],
    ];
    mocban(project.dir(), &set.concat()).expect(0);
    let third = Page::open(&project, "hoa", &["--adjudicate"]);
    let config = third.get("/api/config").json();
    let items = third.queue();
    let refused = third.get(&details(&items[0])).json();
    let stored = post(&third, "/api/answer", &answer("h1", &items[0], "fail"));
    insta::assert_json_snapshot!(redacted(json!({
        "review_order": config["review_order"],
        "items": items,
        "details_before": refused,
        "answer": stored,
        "details_after": third.get(&details(&items[0])).json(),
    })));
}

#[test]
fn a_manual_alignment_is_in_the_queue_and_in_the_editor() {
    let small = ["--metric", "density", "--sample", "1"];
    let (_dir, _, page) = open_review(&[&NO_CHECKS[..], &small].concat());
    let item = page.queue().remove(0);
    let editor = format!("/api/alignment/{}", item["id"].as_str().expect("an id"));
    let start = page.get(&editor).json();
    let body = json!({
        "event": "a1", "item": item["id"], "view_from_depth": start["view_from_depth"], "note": null,
    });
    let stored = post(&page, "/api/align", &body);
    insta::assert_json_snapshot!(redacted(json!({
        "start": start,
        "stored": stored,
        "items": page.queue(),
        "continued": page.get(&editor).json(),
    })));
}
