//! The last lines of `review` in a terminal: how to go on with a queue that is not finished.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::Stdio;

use mocban::store::Project;
use rustix::process::{Pid, Signal, kill_process};

use crate::cli::binary;
use crate::page::{NO_CHECKS, Page, answer, read_project};

/// The options of the queue in these tests.
const QUEUE: [&str; 6] = ["--metric", "relief", "--sample", "2", "--seed", "7"];

/// Starts `review` as in a terminal, ends it once it serves its page, and returns its stderr.
fn closed_review(project: &Project, name: &str) -> String {
    let mut child = binary()
        .arg("-C")
        .arg(project.dir())
        .args(["review", "--no-open", "--reviewer", name])
        .args(QUEUE)
        .args(NO_CHECKS)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let mut line = String::new();
    let out = child.stdout.take().expect("a pipe");
    BufReader::new(out).read_line(&mut line).expect("a line");
    assert!(line.starts_with("http://"), "{line}");
    kill_process(Pid::from_child(&child), Signal::INT).expect("sent");
    let mut text = String::new();
    let mut err = child.stderr.take().expect("a pipe");
    err.read_to_string(&mut text).expect("UTF-8");
    assert!(child.wait().expect("an exit code").success(), "{text}");
    text
}

#[test]
fn an_unfinished_review_says_how_to_go_on() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let text = closed_review(&project, "lê văn");
    let lines: Vec<&str> = text.lines().collect();
    let closing = lines
        .iter()
        .position(|line| *line == "the page is closed; every answer is stored");
    let after = &lines[closing.expect("the closing line") + 1..];
    let next = "review --reviewer 'lê văn' --metric relief --sample 2 --seed 7 --attention-checks 0 --duplicates 0";
    for (line, command) in after.iter().zip([next, "report"]) {
        let is_shown = line.starts_with("next: ") && line.ends_with(&format!(" {command}"));
        assert!(is_shown, "{text}");
    }
    assert!(
        after[2].ends_with("review --reviewer NAME --metric relief --sample 2 --seed 7"),
        "{text}"
    );
}

#[test]
fn a_finished_review_is_not_offered_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let page = Page::open(&project, "lan", &[&QUEUE[..], &NO_CHECKS].concat());
    for (number, item) in page.queue().iter().enumerate() {
        let answer = answer(&format!("e{number}"), item, "pass");
        let reply = page.post("/api/answer", &answer).expect("a reply");
        assert_eq!(reply.status, 200);
    }
    drop(page);
    let text = closed_review(&project, "lan");
    assert!(text.contains("every answer is stored"), "{text}");
    assert!(!text.contains("review --reviewer lan"), "{text}");
    assert!(
        text.contains("next: ") && text.contains(" report\n"),
        "{text}"
    );
}
