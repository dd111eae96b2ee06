//! The log of a run that nobody watches.

use std::fmt::Write as _;
use std::path::Path;

use crate::cli::{empty, mocban};

/// Pairs of the run, which all fail.
const PAIRS: usize = 20;

/// Runs a project whose scans are damaged, and returns the log file.
fn log_of_failures(root: &Path, flags: &[&str]) -> String {
    std::fs::write(root.join("a.stl"), "x").expect("written");
    std::fs::write(root.join("a.png"), "x").expect("written");
    let mut list = "id,mesh,print\n".to_owned();
    for row in 0..PAIRS {
        // Writing to a string does not fail.
        let _ = writeln!(list, "r{row},a.stl,a.png");
    }
    std::fs::write(root.join("list.csv"), list).expect("written");
    mocban(root, &["-C", "p", "import", "list.csv"]).expect(0);
    let run = ["-C", "p", "--log-file", "run.log", "run", "-j", "1"];
    mocban(root, &[&run[..], flags].concat()).expect(3);
    std::fs::read_to_string(root.join("run.log")).expect("a log")
}

#[test]
fn a_log_file_has_the_start_each_failure_and_the_end_of_a_run() {
    let dir = empty();
    let log = log_of_failures(dir.path(), &[]);
    let lines = |text: &str| log.lines().filter(|line| line.contains(text)).count();
    assert_eq!(lines("the run starts"), 1, "{log}");
    assert_eq!(lines("the pair failed"), PAIRS, "{log}");
    assert_eq!(lines("the run ends"), 1, "{log}");
    assert_eq!(lines("a pair is leased"), 0, "{log}");
}

#[test]
fn vv_also_logs_claims_and_a_few_lines_for_each_pair() {
    let dir = empty();
    let log = log_of_failures(dir.path(), &["-vv"]);
    let lines = |text: &str| log.lines().filter(|line| line.contains(text)).count();
    assert_eq!(lines("a pair is leased"), PAIRS, "{log}");
    assert_eq!(lines("the pair failed"), PAIRS, "{log}");
    assert!(log.lines().count() < 6 * PAIRS + 100, "{log}");
}
