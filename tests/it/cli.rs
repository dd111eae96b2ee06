//! The binary: exit codes, help, JSON.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// What one call of the binary gave.
pub(crate) struct Call {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Call {
    /// stdout as JSON.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {}", self.out))
    }

    /// The commands after `next:`, ready to be run.
    pub(crate) fn next(&self) -> Vec<String> {
        self.err
            .lines()
            .filter_map(|line| line.strip_prefix("next: "))
            .map(ToOwned::to_owned)
            .collect()
    }

    /// Fails with both streams unless the code is as wanted.
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

/// Calls the binary in a directory, with nothing of our own environment that changes what it says.
pub(crate) fn mocban(dir: &Path, args: &[&str]) -> Call {
    call(binary().current_dir(dir).args(args))
}

/// The binary, ready to be called.
pub(crate) fn binary() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mocban"));
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

fn empty() -> tempfile::TempDir {
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
        &["verdict", "set", "a", "maybe", "--reader", "lan"],
    )
    .expect(2);
}

#[test]
fn directory_without_project_is_code_10_with_a_way_on() {
    let dir = empty();
    for command in [
        &["run"] as &[&str],
        &["status"],
        &["show", "0001"],
        &["retry"],
        &["verdict", "log"],
        &["report"],
        &["export", "-o", "out"],
        &["sheet", "-o", "sheet.png"],
    ] {
        let refused = mocban(dir.path(), command).expect(10);
        assert!(
            refused.err.starts_with("error: no project in ."),
            "{command:?}: {}",
            refused.err
        );
        assert!(!refused.next().is_empty(), "{command:?}");
    }
    let left: Vec<_> = std::fs::read_dir(dir.path()).expect("readable").collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn error_is_an_object_where_json_was_asked_for() {
    let dir = empty();
    let refused = mocban(dir.path(), &["status", "--json"]).expect(10);
    let first = refused.err.lines().next().expect("a line");
    let object: Value = serde_json::from_str(first).expect("JSON");
    assert_eq!(object["message_type"], "exit_error");
    assert_eq!(object["code"], 10);
}

#[test]
fn wrong_settings_are_code_2_and_name_file_and_key() {
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
fn settings_show_their_origins_and_read_back_the_same() {
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
    let method = &paper["settings"]["register.method"];
    assert_eq!(
        again["settings"]["register.method"]["value"],
        method["value"]
    );
}

#[test]
fn colour_is_for_those_who_ask() {
    let dir = empty();
    let plain = mocban(dir.path(), &["config", "show"]).expect(0);
    assert!(!plain.out.contains('\u{1b}'));
    let painted = mocban(dir.path(), &["config", "show", "--color", "always"]).expect(0);
    assert!(painted.out.contains('\u{1b}'));
    let help = mocban(dir.path(), &["--help", "--color", "never"]).expect(0);
    assert!(!help.out.contains('\u{1b}'));
}

#[test]
fn completions_and_manual_pages_are_made() {
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
