//! Statistics on the agreement of reviewers in `agreement` and `report`.

use mocban::store::Project;
use serde_json::{Value, json};

use crate::cli::mocban;
use crate::page::{Page, answer, open_review, read_project};

fn json_output(project: &Project, args: &[&str]) -> Value {
    mocban(project.dir(), args).expect(0).json()
}

/// Answers every item of a queue with the same verdict.
fn judge_all(page: &Page, queue: &[Value], verdict: &str) {
    for (i, item) in queue.iter().enumerate() {
        let reply = page.post("/api/answer", &answer(&format!("e{i}"), item, verdict));
        assert_eq!(reply.expect("a reply").status, 200);
    }
}

fn set(project: &Project, pair: &Value, verdict: &str, reviewer: &str) {
    let pair = pair.as_str().expect("a name");
    let args = ["verdict", "set", pair, verdict, "--reviewer", reviewer];
    mocban(project.dir(), &args).expect(0);
}

/// Stores verdicts. `lan` fails all items on the page, attention checks too. `minh` passes all pairs but the first.
fn reviewer_pairs(project: &Project) -> Vec<Value> {
    let page = Page::open(
        project,
        "lan",
        &["--attention-checks", "50", "--duplicates", "20"],
    );
    let queue = page.queue();
    judge_all(&page, &queue, "fail");
    let queue = page.get("/api/queue").json();
    let pairs = queue["pairs"].as_array().expect("names").clone();
    for (i, pair) in pairs.iter().enumerate() {
        set(project, pair, if i == 0 { "fail" } else { "pass" }, "minh");
    }
    pairs
}

#[test]
fn two_reviewers_are_compared_and_a_third_settles_a_conflict() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    assert_eq!(
        json_output(&project, &["agreement", "--json"])["reviewers"],
        json!([])
    );
    let pairs = reviewer_pairs(&project);
    let found = json_output(&project, &["agreement", "--json"]);
    let two = &found["reviewer_pairs"][0];
    assert_eq!((&two["a"], &two["b"]), (&json!("lan"), &json!("minh")));
    let count = |value: &Value| value.as_u64().expect("a count");
    let (n, agreed) = (count(&two["n"]), count(&two["agreed"]));
    assert!(n > agreed && (1..=4).contains(&agreed), "{two}");
    assert_eq!(
        (count(&two["failed_by_any"]), count(&two["failed_by_both"])),
        (n, agreed)
    );
    // One reviewer always gives the same verdict and the other does not, so agreement is at the level of chance.
    assert!(
        two["kappa"]
            .as_f64()
            .expect("chance agreement is below 1")
            .abs()
            < 1e-12
    );
    assert_eq!(two["sufficient"], json!(n >= 30));
    assert_eq!(count(&found["conflicts"]), n - agreed);
    let [lan, minh] = [0, 1].map(|i| &found["reviewers"][i]);
    assert_eq!((count(&lan["judged"]), count(&minh["judged"])), (n, n));
    let (checks, duplicates) = (&lan["attention_checks"], &lan["duplicates"]);
    assert!(
        count(&checks["n"]) > 5 && count(&duplicates["n"]) > 0,
        "{lan}"
    );
    assert_eq!(
        (&checks["share"], &duplicates["share"]),
        (&json!(1.0), &json!(1.0))
    );
    assert_eq!(minh["attention_checks"]["n"], 0);
    report_has_the_same_rates(&project, checks);

    let page = Page::open(&project, "ba", &["--adjudicate"]);
    let settled = page.queue().remove(0);
    let reply = page.post("/api/answer", &answer("s1", &settled, "pass"));
    assert_eq!(reply.expect("a reply").status, 200);
    assert_ne!(settled["pair"], pairs[0], "on which they agree");
    let after = json_output(&project, &["agreement", "--json"]);
    assert_eq!(count(&after["conflicts"]), n - agreed - 1);
    assert_eq!(after["reviewer_pairs"], found["reviewer_pairs"]);
    let settling = &after["reviewers"][0];
    assert_eq!(
        (&settling["reviewer"], &settling["judged"]),
        (&json!("ba"), &json!(1))
    );
    let pair = settled_by_a_command(&project, &after);
    let after = json_output(&project, &["agreement", "--json"]);
    let waiting = count(&after["conflicts"]);
    assert!(waiting < n - agreed - 1, "{after}");
    let pairs = after["conflicting_pairs"].as_array().expect("ids");
    assert!(!pairs.is_empty() && !pairs.contains(&pair), "{after}");
    let text = mocban(project.dir(), &["agreement"]).expect(0).out;
    let waiting = format!("Conflicts waiting: {waiting}\n");
    assert!(
        text.contains(&waiting) && text.contains("lan, minh"),
        "{text}"
    );
}

/// Settles the conflicts of the first pair by `verdict set`, which a party to them cannot do. Returns the pair.
fn settled_by_a_command(project: &Project, agreement: &Value) -> Value {
    let conflicting = &agreement["conflicting_pairs"][0];
    let pair = conflicting.as_str().expect("an id");
    let args = ["verdict", "set", pair, "fail", "--adjudicate", "--reviewer"];
    let party = mocban(project.dir(), &[&args[..], &["lan"]].concat()).expect(4);
    let why = format!("{pair} has no open conflict that lan may settle");
    assert!(party.err.contains(&why), "{}", party.err);
    let settled = mocban(project.dir(), &[&args[..], &["chi"]].concat()).expect(0);
    assert!(
        settled.err.contains(": fail settles the conflict;"),
        "{}",
        settled.err
    );
    conflicting.clone()
}

fn report_has_the_same_rates(project: &Project, checks: &Value) {
    let report = json_output(project, &["report", "-f", "json"]);
    for name in ["n", "count", "share", "ci95"] {
        assert_eq!(report["attention_checks"][name], checks[name], "{name}");
    }
    for row in report["rows"].as_array().expect("rows") {
        let rules = &row["rules"];
        assert_eq!(rules["double_read"], 15);
        assert_eq!(rules["either_fails"]["count"], 0);
        assert_eq!(
            (&rules["adjudicated"]["n"], &row["failed"]),
            (&json!(1), &json!(1))
        );
        assert_eq!(rules["both_fail"]["count"], 14);
    }
    let exact = json_output(project, &["report", "-f", "json", "--ci", "exact"]);
    assert_ne!(exact["attention_checks"]["ci95"], checks["ci95"]);
    let csv = mocban(project.dir(), &["report", "-f", "csv"])
        .expect(0)
        .out;
    let both_fail = csv.lines().filter(|line| line.contains(",both_fail_acc,"));
    let rows = report["rows"].as_array().map_or(0, Vec::len);
    assert_eq!(both_fail.count(), rows, "{csv}");
    let page = mocban(project.dir(), &["report", "-f", "html"])
        .expect(0)
        .out;
    for part in [
        "Failed by reviewers",
        "Reviewers disagree",
        "Random sample",
        "Attention checks",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(page.len() < 10_000_000 && page.contains("data:image/jpeg;base64,/9j/"));
}

#[test]
fn results_are_measured_against_the_newest_manual_alignment() {
    let ensemble = ["--attention-checks", "0", "--metric", "ensemble"];
    let (_dir, project, page) = open_review(&ensemble);
    let manual =
        || json_output(&project, &["report", "-f", "json"])["rows"][2]["manual_alignment"].clone();
    assert_eq!(manual(), Value::Null);
    let item = page.queue().remove(0);
    let id = item["id"].as_str().expect("an id");
    let start = page.get(&format!("/api/alignment/{id}")).json();
    let number = |value: &Value| value.as_f64().expect("a number");
    let [[a, b, c], [d, e, f]] =
        [0, 1].map(|i| [0, 1, 2].map(|j| number(&start["view_from_depth"][i][j])));
    let align = |event: &str, map: &Value| {
        let body = json!({ "event": event, "item": id, "view_from_depth": map, "note": null });
        let reply = page.post("/api/align", &body).expect("a reply");
        assert_eq!(reply.status, 200, "{event}");
    };
    let assert_near = |found: &Value, name: &str, wanted: f64| {
        assert!(
            (number(&found[name]) - wanted).abs() < 1e-6,
            "{name}: {found}"
        );
    };
    align("h1", &start["view_from_depth"]);
    let same = manual();
    assert_eq!(
        (&same["n"], &same["angle_le_5deg"]),
        (&json!(1), &json!(1.0))
    );
    for name in ["angle_median_deg", "shift_median_pct", "scale_p95_pct"] {
        assert_near(&same, name, 0.0);
    }
    // Rotated by 12 degrees about the image's corner and enlarged by 25 %.
    let (sin, cos) = 12.0_f64.to_radians().sin_cos();
    let rotate = |x: f64, y: f64| [1.25 * (cos * x - sin * y), 1.25 * (sin * x + cos * y)];
    let columns = [rotate(a, d), rotate(b, e), rotate(c, f)];
    let rows = [0, 1].map(|i| columns.map(|column| column[i]));
    align("h2", &json!(rows));
    let rotated = manual();
    assert_eq!(
        (&rotated["n"], &rotated["angle_le_5deg"]),
        (&json!(1), &json!(0.0))
    );
    assert_near(&rotated, "angle_median_deg", 12.0);
    assert_near(&rotated, "scale_median_pct", 25.0);
    assert!(number(&rotated["shift_p95_pct"]) > 1.0, "{rotated}");
    let text = mocban(project.dir(), &["report"]).expect(0).out;
    assert!(
        text.contains("\nManual ") && text.contains("  12.00  12.00  "),
        "{text}"
    );
}
