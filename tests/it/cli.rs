//! The real binary: exit codes, help, JSON. Most other modules use the helpers of this file.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Path of the binary.
const BINARY: &str = env!("CARGO_BIN_EXE_mocban");

/// The outcome of one call of the binary.
pub(crate) struct Call {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Call {
    /// Parses stdout as JSON.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).expect("JSON on stdout")
    }

    /// Returns the commands after `next:`, ready to be run.
    pub(crate) fn next(&self) -> Vec<String> {
        self.err
            .lines()
            .filter_map(|line| line.strip_prefix("next: "))
            .map(ToOwned::to_owned)
            .collect()
    }

    /// Checks the exit code; on failure shows both streams.
    #[track_caller]
    pub(crate) fn expect(self, code: i32) -> Self {
        assert_eq!(
            self.code, code,
            "stdout:\n{}\nstderr:\n{}",
            self.out, self.err
        );
        self
    }
}

/// Runs the binary in a directory, without environment variables that change its output.
pub(crate) fn mocban(dir: &Path, args: &[&str]) -> Call {
    call(binary().current_dir(dir).args(args))
}

/// Returns what `status --json` says of a project.
#[track_caller]
pub(crate) fn status(project: &Path) -> Value {
    mocban(project, &["status", "--json"]).expect(0).json()
}

/// Returns a command that calls the binary.
pub(crate) fn binary() -> Command {
    without_settings(Command::new(BINARY))
}

/// Returns a command that runs the binary through a hard link beside `path`, because another user may not be allowed to
/// enter the build folder. On another file system, runs a copy.
pub(crate) fn binary_beside(path: &Path) -> Command {
    let link = path.with_file_name("mocban-link");
    if !link.exists() && std::fs::hard_link(BINARY, &link).is_err() {
        std::fs::copy(BINARY, &link).expect("copied");
    }
    without_settings(Command::new(link))
}

/// Returns a command that runs a script in the shell. The script may call the binary.
pub(crate) fn shell(script: &str) -> Command {
    let mut command = without_settings(Command::new("sh"));
    command.args(["-c", script]);
    command
}

/// Removes the environment variables that change the binary's output, and sets the time zone to UTC.
fn without_settings(mut command: Command) -> Command {
    command.env("TZ", "UTC");
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("MOCBAN_") || name == "RUST_LOG" {
            command.env_remove(name);
        }
    }
    command
}

/// Calls a prepared command.
pub(crate) fn call(command: &mut Command) -> Call {
    let output = command.output().expect("the binary starts");
    Call {
        code: output.status.code().expect("no signal"),
        out: String::from_utf8(output.stdout).expect("UTF-8"),
        err: String::from_utf8(output.stderr).expect("UTF-8"),
    }
}

pub(crate) fn empty() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

#[test]
fn help_is_data_and_usage_errors_are_not() {
    let dir = empty();
    let help = mocban(dir.path(), &["--help"]).expect(0);
    assert!(help.out.contains("Exit codes:"), "{}", help.out);
    assert!(help.err.is_empty(), "{}", help.err);
    let wrong = mocban(dir.path(), &["staus"]).expect(2);
    assert!(wrong.out.is_empty(), "{}", wrong.out);
    assert!(wrong.err.contains("'status'"), "{}", wrong.err);
    mocban(dir.path(), &["run", "--jobs", "0"]).expect(2);
    mocban(
        dir.path(),
        &["verdict", "set", "a", "maybe", "--reviewer", "lan"],
    )
    .expect(2);
}

#[test]
fn directory_without_project_is_code_10_with_next_steps() {
    let dir = empty();
    for command in [
        &["run"] as &[&str],
        &["status"],
        &["show", "0001"],
        &["retry"],
        &["check"],
        &["check", "--repair"],
        &["backup", "b.sqlite"],
        &["verdict", "log"],
        &["review", "--reviewer", "lan"],
        &["agreement"],
        &["report"],
        &["export", "-o", "out"],
        &["contact-sheet", "-o", "sheet.png"],
    ] {
        let refused = mocban(dir.path(), command).expect(10);
        assert!(
            refused.err.starts_with("error: no project at ."),
            "{command:?}: {}",
            refused.err
        );
        assert!(!refused.next().is_empty(), "{command:?}");
    }
    let left: Vec<_> = std::fs::read_dir(dir.path()).expect("readable").collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn error_is_an_object_with_json() {
    let dir = empty();
    let refused = mocban(dir.path(), &["status", "--json"]).expect(10);
    let first = refused.err.lines().next().expect("a line");
    let object: Value = serde_json::from_str(first).expect("JSON");
    assert_eq!(object["message_type"], "exit_error");
    assert_eq!(object["code"], 10);
}

#[test]
fn invalid_settings_are_code_2_with_file_and_key() {
    let dir = empty();
    let file = dir.path().join("mocban.toml");
    std::fs::write(&file, "[run]\nwrokers = 2\n").expect("a small file");
    let refused = mocban(dir.path(), &["config", "show"]).expect(2);
    assert_eq!(
        refused.err,
        "error: ./mocban.toml: there is no setting run.wrokers; did you mean \"workers\"?\n"
    );
    let refused = mocban(dir.path(), &["config", "show", "--config", "papr.toml"]).expect(2);
    assert!(refused.err.contains("papr.toml"), "{}", refused.err);
}

#[test]
fn settings_show_their_origins_and_parse_to_the_same_values() {
    let dir = empty();
    std::fs::write(dir.path().join("mocban.toml"), "preset = \"paper\"\n").expect("a small file");
    let shown = call(
        binary()
            .current_dir(dir.path())
            .env("MOCBAN_RUN__WORKERS", "3")
            .args(["config", "show", "--origin", "--set", "fit.seed=9"]),
    )
    .expect(0);
    for wanted in [
        "# MOCBAN_RUN__WORKERS",
        "# --set",
        "# preset paper",
        "# default",
    ] {
        assert!(shown.out.contains(wanted), "{wanted}: {}", shown.out);
    }
    std::fs::write(dir.path().join("again.toml"), &shown.out).expect("a small file");
    let plain = |args: &[&str]| mocban(dir.path(), args).expect(0).json();
    let again = plain(&["config", "show", "--json", "--config", "again.toml"]);
    assert_eq!(again["settings"]["fit.seed"]["value"], 9);
    assert_eq!(again["settings"]["run.workers"]["value"], 3);
    let paper = plain(&["config", "show", "--json", "--config", "paper"]);
    let method = &paper["settings"]["pipeline.method"];
    assert_eq!(
        again["settings"]["pipeline.method"]["value"],
        method["value"]
    );
}

#[test]
fn colour_is_used_only_on_request_off_a_terminal() {
    let dir = empty();
    let plain = mocban(dir.path(), &["config", "show"]).expect(0);
    assert!(!plain.out.contains('\u{1b}'));
    let painted = mocban(dir.path(), &["config", "show", "--color", "always"]).expect(0);
    assert!(painted.out.contains('\u{1b}'));
    let help = mocban(dir.path(), &["--help", "--color", "never"]).expect(0);
    assert!(!help.out.contains('\u{1b}'));
}

#[test]
fn completions_and_manual_pages_are_written() {
    let dir = empty();
    for shell in ["bash", "zsh", "fish"] {
        let script = mocban(dir.path(), &["completions", shell]).expect(0);
        assert!(script.out.contains("verdict"), "{shell}");
    }
    mocban(dir.path(), &["man", "pages"]).expect(0);
    let page = std::fs::read_to_string(dir.path().join("pages/mocban.1")).expect("a page");
    assert!(page.contains(".TH mocban 1"), "{page}");
    assert!(dir.path().join("pages/mocban-verdict-set.1").is_file());
}

/// Creates a directory with a list `pairs.csv` and a project `p` of its two pairs. Their files do not exist.
fn imported() -> tempfile::TempDir {
    let dir = empty();
    let text = "id,mesh,print\na,a.stl,a.png\nb,b.stl,b.png\n";
    std::fs::write(dir.path().join("pairs.csv"), text).expect("a small file");
    mocban(
        dir.path(),
        &["-C", "p", "-q", "import", "pairs.csv", "--allow-missing"],
    )
    .expect(0);
    dir
}

#[test]
fn refused_manifest_names_its_lines_and_leaves_nothing_behind() {
    let dir = empty();
    let manifest = dir.path().join("pairs.csv");
    let import = ["-C", "p", "import", "pairs.csv"];
    for (text, wanted) in [
        ("id,mesh,print\na,a.stl,a.png\na,b.stl,b.png\n", "line 3: "),
        ("id,mesh,print\na/b,a.stl,a.png\n", "line 2: "),
        ("id,mesh\na,a.stl\n", "line 1: "),
    ] {
        std::fs::write(&manifest, text).expect("a small file");
        let refused = mocban(dir.path(), &import).expect(2);
        assert!(refused.err.contains(wanted), "{wanted}: {}", refused.err);
        assert!(
            refused.err.contains("nothing was imported"),
            "{}",
            refused.err
        );
        assert!(!dir.path().join("p").exists());
    }
    std::fs::write(&manifest, "id,mesh,print\na,a.stl,a.png\n").expect("a small file");
    std::fs::write(dir.path().join("truth.jsonl"), "{\"id\":\"z\"}\n").expect("a small file");
    let with_truth = [&import[..], &["--truth", "truth.jsonl"]].concat();
    let refused = mocban(dir.path(), &with_truth).expect(2);
    assert!(
        refused.err.contains("truth.jsonl: line 1: "),
        "{}",
        refused.err
    );
    assert!(!dir.path().join("p").exists());
}

#[test]
fn missing_files_cause_a_warning_by_line_and_fail_only_their_pairs() {
    let dir = empty();
    let text = "id,mesh,print\na,a.stl,a.png\nb,b.stl,b.png\n";
    std::fs::write(dir.path().join("pairs.csv"), text).expect("a small file");
    let import = [
        "-C",
        "p",
        "--json",
        "import",
        "pairs.csv",
        "--allow-missing",
    ];
    let first = mocban(dir.path(), &import).expect(0);
    assert_eq!(first.json()["added"], 2);
    assert!(
        first
            .err
            .contains("pairs.csv: line 3: mesh b.stl of b does not exist"),
        "{}",
        first.err
    );
    std::fs::write(dir.path().join("pairs.csv"), text.replace("b.png", "c.png")).expect("written");
    let second = mocban(dir.path(), &import).expect(0).json();
    assert_eq!(
        second["changed"],
        serde_json::json!([{"id": "b", "fields": ["print"]}])
    );
    assert_eq!(second["unchanged"], 1);

    let ran = mocban(dir.path(), &["-C", "p", "run"]).expect(3);
    assert!(ran.err.contains("2 pairs failed:"), "{}", ran.err);
    let one = mocban(dir.path(), &["-C", "p", "run", "b"]).expect(3).err;
    let heading = "1 pair failed in earlier runs:\n  io 1  b  at fit";
    assert!(one.contains(heading) && !one.contains("a.stl"), "{one}");
    assert!(one.contains(" show b\n"), "{one}");
    let status = mocban(dir.path(), &["-C", "p", "status", "--json"])
        .expect(0)
        .json();
    assert_eq!(status["schema"], 1);
    assert_eq!(status["jobs"]["quarantined"], 2);
    assert_eq!(
        status["stages"]["fit"],
        serde_json::json!({"done": 0, "pending": 0, "failed": 2})
    );
    let shown = mocban(dir.path(), &["-C", "p", "show", "a", "--json"])
        .expect(0)
        .json();
    assert_eq!(shown["failure"]["class"], "io");
    mocban(dir.path(), &["-C", "p", "retry", "--class", "bug"]).expect(4);
    let retried = mocban(dir.path(), &["-C", "p", "--json", "retry"])
        .expect(0)
        .json();
    assert_eq!(retried["retried"], 2);
}

#[test]
fn unknown_pair_is_code_4_with_similar_ids() {
    let dir = imported();
    let refused = mocban(dir.path(), &["-C", "p", "show", "aa"]).expect(4);
    assert_eq!(
        refused.err,
        "error: there is no pair or block aa; similar ids: a\n"
    );
    mocban(dir.path(), &["-C", "p", "run", "a/b"]).expect(4);
    let set = [
        "-C",
        "p",
        "verdict",
        "set",
        "a",
        "pass",
        "--reviewer",
        "lan",
    ];
    let refused = mocban(dir.path(), &set).expect(4);
    assert!(refused.err.contains("no result"), "{}", refused.err);
    mocban(dir.path(), &["-C", "p", "verdict", "undo"]).expect(4);
}

#[test]
fn refused_verdict_file_records_nothing() {
    let dir = imported();
    let file = dir.path().join("verdicts.csv");
    std::fs::write(&file, "pair,verdict,reviewer\na,pass,lan\nz,pass,lan\n").expect("written");
    let refused = mocban(
        dir.path(),
        &["-C", "p", "verdict", "import", "verdicts.csv"],
    )
    .expect(2);
    let wanted = "verdicts.csv: line 3: there is no pair z; no verdict was recorded";
    assert!(refused.err.contains(wanted), "{}", refused.err);
    let log = mocban(dir.path(), &["-C", "p", "verdict", "log", "--json"]).expect(0);
    assert!(log.out.is_empty(), "{}", log.out);
}

#[test]
fn every_next_line_can_be_run_unchanged() {
    let dir = empty();
    std::fs::create_dir(dir.path().join("my scans")).expect("a folder");
    let text = "id,mesh,print\nchữ số 1,a.stl,a.png\n";
    std::fs::write(dir.path().join("pairs.csv"), text).expect("a small file");
    let import = [
        "-C",
        "my scans",
        "--set",
        "run.workers=1",
        "import",
        "pairs.csv",
        "--allow-missing",
    ];
    let mut lines = mocban(dir.path(), &import).expect(0).next();
    for wanted in [3, 0] {
        let line = lines.first().expect("a next line");
        let ran = call(shell(line).current_dir(dir.path())).expect(wanted);
        lines = ran.next();
    }
}

#[test]
fn project_that_was_moved_finds_its_files() {
    let dir = empty();
    let scans = dir.path().join("p/scans");
    std::fs::create_dir_all(&scans).expect("folders");
    for name in ["a.stl", "a.png"] {
        std::fs::write(scans.join(name), "x").expect("a small file");
    }
    std::fs::write(scans.join("pairs.csv"), "id,mesh,print\na,a.stl,a.png\n").expect("written");
    mocban(dir.path(), &["-C", "p", "import", "p/scans/pairs.csv"]).expect(0);
    std::fs::rename(dir.path().join("p"), dir.path().join("q")).expect("moved");
    let shown = mocban(dir.path(), &["-C", "q", "show", "a"]).expect(0);
    assert!(shown.out.contains("q/scans/a.stl"), "{}", shown.out);
    assert!(!shown.out.contains("missing"), "{}", shown.out);
}

#[test]
fn project_in_use_is_code_11_and_can_still_be_read() {
    let dir = imported();
    let lock = std::fs::File::create(dir.path().join("p/run.lock")).expect("a lock file");
    lock.lock().expect("nobody else has it");
    let refused = mocban(dir.path(), &["-C", "p", "run"]).expect(11);
    assert!(
        refused.err.contains("the project is in use"),
        "{}",
        refused.err
    );
    mocban(dir.path(), &["-C", "p", "status"]).expect(0);
    mocban(dir.path(), &["-C", "p", "run", "--dry-run"]).expect(0);
}

#[test]
fn progress_as_json_is_one_line_per_event() {
    let dir = imported();
    let ran = mocban(dir.path(), &["-C", "p", "--progress", "json", "run"]).expect(3);
    let types: Vec<String> = ran
        .err
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .map(|event| event["message_type"].as_str().expect("a type").to_owned())
        .collect();
    assert_eq!(types.first().map(String::as_str), Some("started"));
    let failed = types.iter().filter(|kind| *kind == "pair_failed").count();
    assert_eq!(failed, 2, "{types:?}");
}
