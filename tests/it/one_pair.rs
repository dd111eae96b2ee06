//! One pair end to end, as in the README.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::cli::{binary, mocban};
use crate::waiting::until;

fn lines(file: &Path) -> Vec<Value> {
    std::fs::read_to_string(file)
        .expect("a readable file")
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

#[test]
fn readme_walk_from_demo_to_export() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "demo"], args].concat());

    let demo = mocban(dir.path(), &["demo", "demo", "--pairs", "1"]).expect(0);
    assert!(demo.out.contains("Ensemble"), "{}", demo.out);
    assert!(dir.path().join("demo/sheet.png").is_file());
    assert!(dir.path().join("demo/data/truth.jsonl").is_file());
    let again = mocban(dir.path(), &["demo", "demo", "--pairs", "1"]).expect(0);
    assert!(again.err.contains("nothing left to do"), "{}", again.err);

    let status = at(&["status", "--json"]).expect(0).json();
    assert_eq!(status["jobs"]["done"], 1);
    assert_eq!(status["stages"]["register"]["done"], 1);

    let id = "upright-0000";
    let shown = at(&["show", id, "--json"]).expect(0).json();
    assert_eq!(shown["name"], id);
    let metrics = shown["metrics"].as_array().expect("a list");
    let names: Vec<_> = metrics.iter().map(|metric| &metric["metric"]).collect();
    assert_eq!(names, ["nl_ssim", "density", "ensemble", "relief"]);
    let depth = shown["files"]["depth.png"].as_str().expect("a path");
    assert!(dir.path().join(depth).is_file(), "{depth}");

    verdicts_count_until_they_are_undone(&at, id);
    only_the_changed_stage_runs_again(&at);

    let compared = at(&["report", "--compare", "demo", "--json"])
        .expect(0)
        .json();
    let there = &compared["compared_with"]["report"];
    assert_eq!(there["rows"], compared["rows"]);
    at(&["report", "--compare", "demo", "--format", "latex"]).expect(2);

    at(&["export", "--to", "jsonl", "-o", "out"]).expect(0);
    let exported = lines(&dir.path().join("out/pairs.jsonl"));
    assert_eq!(exported.len(), 4);
    for line in &exported {
        assert_eq!(line["id"], id);
        for file in line["files"].as_object().expect("files").values() {
            let path = dir.path().join("out").join(file.as_str().expect("a path"));
            assert!(path.is_file(), "{}", path.display());
        }
    }
}

fn verdicts_count_until_they_are_undone(at: &dyn Fn(&[&str]) -> crate::cli::Call, id: &str) {
    let acc = || {
        let report = at(&["report", "--format", "json"]).expect(0).json();
        assert_eq!(report["rows"][0]["metric"], "nl_ssim");
        report["rows"][0]["acc"].clone()
    };
    assert_eq!(acc(), Value::Null);
    at(&["report", "--require-complete"]).expect(21);
    at(&[
        "verdict",
        "set",
        id,
        "fail",
        "--reviewer",
        "lan",
        "--reason",
        "angle",
    ])
    .expect(0);
    assert_eq!(acc(), 0.0);
    at(&["report", "--fail-under", "0.5"]).expect(20);
    // `--reader` is an alias of `--reviewer`.
    at(&["verdict", "undo", "--reader", "lan"]).expect(0);
    assert_eq!(acc(), Value::Null);
    at(&["verdict", "set", id, "pass", "--reviewer", "lan"]).expect(0);
    assert_eq!(acc(), 1.0);
    at(&["report", "--require-complete", "--fail-under", "0.98"]).expect(0);
    let log = at(&["verdict", "log", id, "--json"]).expect(0);
    assert_eq!(log.out.lines().count(), 8);
}

fn only_the_changed_stage_runs_again(at: &dyn Fn(&[&str]) -> crate::cli::Call) {
    let set = ["--set", "register.window=uniform7"];
    let plan = at(&[&set[..], &["run", "--dry-run"]].concat()).expect(0);
    let wanted = "1  from register  register.window: \"gaussian\" -> \"uniform7\"";
    assert!(plan.out.contains(wanted), "{}", plan.out);
    let ran = at(&[&set[..], &["run", "--json"]].concat())
        .expect(0)
        .json();
    assert_eq!(ran["stages"], 1);
    let back = at(&["run", "--json"]).expect(0).json();
    assert_eq!(back["stages"], 1);
}

#[test]
fn paper_preset_has_only_its_three_metrics() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "demo"], args].concat());
    mocban(
        dir.path(),
        &["demo", "demo", "--pairs", "1", "--config", "paper"],
    )
    .expect(0);
    let id = "upright-0000";
    let metrics = |value: &Value| -> Vec<String> {
        let rows = value.as_array().expect("a list").iter();
        rows.map(|row| row["metric"].as_str().expect("a name").to_owned())
            .collect()
    };
    let paper = ["nl_ssim", "density", "ensemble"];
    let shown = at(&["show", id, "--json"]).expect(0).json();
    assert_eq!(metrics(&shown["metrics"]), paper);
    assert!(shown["metrics"][0]["confidence"].is_null());

    at(&["verdict", "set", id, "pass", "--reviewer", "lan"]).expect(0);
    let report = at(&["report", "--require-complete", "--json"]).expect(0);
    let report = report.json();
    assert_eq!(metrics(&report["rows"]), paper);
    let warnings = report["warnings"].as_array().expect("a list");
    let is_of_one_pair = |warning: &Value| {
        let text = warning.as_str().expect("a sentence");
        text.ends_with("needs at least 10 blocks, and there is 1.")
    };
    assert!(warnings.iter().all(is_of_one_pair), "{warnings:?}");
    assert_eq!(report["risk_coverage"], serde_json::json!([]));

    at(&["export", "--to", "jsonl", "-o", "out"]).expect(0);
    let exported = Value::Array(lines(&dir.path().join("out/pairs.jsonl")));
    assert_eq!(metrics(&exported), paper);
    let none = at(&["contact-sheet", "--metric", "relief"]).expect(4);
    assert!(none.err.contains("has a result of relief"), "{}", none.err);
}

#[test]
fn first_signal_drains_and_the_next_run_continues() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    mocban(dir.path(), &["demo", "demo", "--pairs", "2", "--no-run"]).expect(0);
    let hold = dir.path().join("hold");
    let mut child = binary()
        .current_dir(dir.path())
        .env("MOCBAN_HOLD_AT", "fit:computed")
        .env("MOCBAN_HOLD_FILE", &hold)
        .args([
            "-C",
            "demo",
            "--progress",
            "json",
            "run",
            "--json",
            "-j",
            "1",
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let stderr = child.stderr.take().expect("it is piped");
    let mut events = BufReader::new(stderr).lines().map_while(Result::ok);
    assert!(events.any(|line| line.contains("stage_started")));
    // The stage does not end before the signal arrives.
    until(&mut child, || hold.exists());
    let pid = child.id().to_string();
    let sent = Command::new("kill").args(["-TERM", &pid]).status();
    assert!(sent.expect("kill is there").success());
    assert!(events.any(|line| line.contains("stopping")));
    std::fs::remove_file(&hold).expect("released");
    let rest: Vec<String> = events.collect();
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{rest:?}");
    let first: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(first["stopped"], true);
    let done = first["stages"].as_u64().expect("a number");
    assert!((1..8).contains(&done), "{first}");

    let second = mocban(dir.path(), &["-C", "demo", "run", "--json"])
        .expect(0)
        .json();
    assert_eq!(second["stages"], 8 - done);
    assert_eq!(second["status"]["jobs"]["done"], 2);
}
