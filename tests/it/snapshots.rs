//! Snapshots of what the command line prints. `INSTA_UPDATE=always cargo test --test it snapshots` rewrites them.

use std::path::Path;

use mocban::catalog::Catalog;
use mocban::store::Project;

use crate::check::{done, sql};
use crate::cli::{binary, call, empty, mocban};

/// Patterns of text that differs between calls, each with the text that replaces it in snapshots.
const VARYING: [(&str, &str); 7] = [
    (r"\S*/debug/mocban|\S*/release/mocban", "mocban"),
    (r"/\S*/\.tmp[A-Za-z0-9]+", "[DIR]"),
    (r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d", "[TIME]"),
    (r"\b\d+ ms\b|\b\d+\.\d s\b|\b\d+ min \d\d s\b", "[DURATION]"),
    (r"pid \d+", "pid [PID]"),
    (r"artifacts/[0-9a-f]{2}/[0-9a-f]{64}", "artifacts/[HASH]"),
    (r"\b[0-9a-f]{12,64}\b", "[HASH]"),
];

/// Patterns of measured numbers, whose width may differ too.
const NUMBERS: [(&str, &str); 6] = [
    (r"-?\d+\.\d, -?\d+\.\d", "[X, Y]"),
    (r"-?\d+\.\d{2,}", "[N]"),
    (r"\b\d+\.\d MB", "[SIZE] MB"),
    (
        r"\d+ vertices, \d+ triangles",
        "[N] vertices, [N] triangles",
    ),
    (r"\d+ x \d+ px|\d+ % covered|\d+ of 65535", "[N]"),
    (r" {2,}", "  "),
];

fn assert_text(name: &str, text: &str, filters: &[(&str, &str)]) {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    for (pattern, replacement) in VARYING.iter().chain(filters) {
        settings.add_filter(pattern, *replacement);
    }
    settings.bind(|| insta::assert_snapshot!(name, text));
}

/// Runs the binary. Returns both streams and the exit code as one text.
pub(crate) fn transcript(dir: &Path, args: &[&str]) -> String {
    let mut command = binary();
    command.current_dir(dir).args(args);
    command.env("COLUMNS", "100").env("USER", "lan");
    for name in ["NO_COLOR", "LANG", "LC_ALL", "LC_MESSAGES", "DISPLAY"] {
        command.env_remove(name);
    }
    let output = command.output().expect("the binary starts");
    let mut text = format!("$ mocban {}\n", args.join(" "));
    for (stream, bytes) in [("stdout", &output.stdout), ("stderr", &output.stderr)] {
        if !bytes.is_empty() {
            let printed = String::from_utf8_lossy(bytes);
            text = format!("{text}--- {stream}\n{printed}");
        }
    }
    let code = output.status.code().expect("no signal");
    format!("{text}--- exit code {code}\n")
}

pub(crate) fn assert_call(name: &str, dir: &Path, args: &[&str]) {
    assert_text(name, &transcript(dir, args), &[]);
}

/// As [`assert_call`], for output with measured numbers.
fn assert_measured(name: &str, dir: &Path, args: &[&str]) {
    assert_text(name, &transcript(dir, args), &NUMBERS);
}

pub(crate) fn write(dir: &Path, name: &str, text: &str) {
    std::fs::write(dir.join(name), text).expect("a small file");
}

pub(crate) const TWO_PAIRS: &str = "id,mesh,print\na,a.stl,a.png\nb,b.stl,b.png\n";

/// Creates a directory with a project `p` of two pairs whose files do not exist.
pub(crate) fn imported() -> tempfile::TempDir {
    let dir = empty();
    write(dir.path(), "pairs.csv", TWO_PAIRS);
    mocban(
        dir.path(),
        &["-C", "p", "-q", "import", "pairs.csv", "--allow-missing"],
    )
    .expect(0);
    dir
}

#[test]
fn help_of_every_command() {
    let dir = empty();
    assert_call("help", dir.path(), &["--help"]);
    let commands = "demo align import run status show retry retire check backup db_init restore \
        verdict verdict_set verdict_import verdict_log verdict_undo review \
        view agreement report export contact-sheet config_show completions \
        man";
    for command in commands.split(' ') {
        let words: Vec<&str> = command.split('_').collect();
        let name = format!("help_{}", command.replace('-', "_"));
        let args = [&["help"], &*words].concat();
        // The global options are in the snapshot of `--help`.
        let text = transcript(dir.path(), &args);
        let (own, _) = text
            .split_once("\nGlobal options, such")
            .expect("a reference");
        assert_text(&name, own, &[]);
    }
}

/// Only the section `run` of `config show` is compared; other tests check the other sections.
#[test]
fn settings_with_origins_and_explanations() {
    let dir = empty();
    write(dir.path(), "mocban.toml", "[run]\nworkers = 2\n");
    for flag in ["--origin", "--explain"] {
        let args = ["config", "show", flag, "--set", "run.memory_mib=512"];
        let text = transcript(dir.path(), &args);
        let section = text.split("\n\n").find(|part| part.contains("[run]"));
        let name = format!("config_show{}", flag.replace("--", "_"));
        assert_text(&name, section.expect("a section"), &[(r" {2,}", "  ")]);
    }
}

#[test]
fn project_without_pairs() {
    let dir = empty();
    let project = Project::create(&dir.path().join("p")).expect("a project");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let catalog = Catalog::create(&project.catalog_path()).await;
        catalog.expect("a catalog").close().await;
    });
    assert_call("status_empty", dir.path(), &["-C", "p", "status"]);
    assert_call("run_empty", dir.path(), &["-C", "p", "run"]);
}

#[test]
fn pairs_that_wait_and_pairs_that_failed() {
    let dir = imported();
    let at = |name: &str, args: &[&str]| {
        assert_call(name, dir.path(), &[&["-C", "p"], args].concat());
    };
    at("status_new", &["status"]);
    at("show_names", &["show"]);
    at("show_new", &["show", "a"]);
    at("run_dry_new", &["run", "--dry-run"]);
    at("retry_nothing", &["retry"]);
    at("error_unknown_pair", &["show", "aa"]);
    at(
        "error_no_result_to_judge",
        &["verdict", "set", "a", "pass", "--reviewer", "lan"],
    );
    at("verdict_log_empty", &["verdict", "log"]);
    at("error_nothing_to_undo", &["verdict", "undo"]);
    at("error_nothing_to_draw", &["contact-sheet"]);
    at(
        "error_nothing_to_review",
        &["review", "--reviewer", "lan", "--no-open"],
    );
    at("run_failed", &["--progress", "none", "run", "-j", "1"]);
    at("status_failed", &["status"]);
    at("status_failed_json", &["status", "--failed", "--json"]);
    at("show_failed", &["show", "a"]);
    at("run_dry_failed", &["run", "--dry-run"]);
    at("retry_class", &["retry", "--class", "bug"]);
    at("retry", &["retry"]);
}

/// Calls the binary on the project `p` below the working directory.
fn at(dir: &Path, name: &str, args: &[&str]) {
    let quiet = ["-C", "p", "--progress", "none"];
    assert_measured(name, dir, &[&quiet[..], args].concat());
}

#[test]
fn finished_project() {
    let dir = empty();
    done(dir.path());
    let at = |name: &str, args: &[&str]| at(dir.path(), name, args);
    at("status_done", &["status"]);
    assert_call(
        "status_done_json",
        dir.path(),
        &["-C", "p", "status", "--json"],
    );
    at("run_nothing_left", &["run"]);
    at("show_done", &["show", "upright-0000"]);
    let changed = ["--set", "register.window=uniform7"];
    at(
        "run_dry_changed",
        &[&changed[..], &["run", "--dry-run"]].concat(),
    );
    at("status_stale", &[&changed[..], &["status"]].concat());
    at(
        "error_compare_latex",
        &["report", "--compare", "p", "--format", "latex"],
    );
    at(
        "report_incomplete",
        &[
            "-q",
            "report",
            "--format",
            "json",
            "-o",
            "p/report.json",
            "--require-complete",
        ],
    );
    at("report_as_html", &["report", "-o", "p/report.html"]);
    let page = std::fs::read_to_string(dir.path().join("p/report.html")).expect("a report");
    assert!(page.starts_with("<!DOCTYPE html>"), "{page:.100}");
    at("error_report_as_pdf", &["report", "-o", "p/report.PDF"]);
    at("contact_sheet", &["contact-sheet", "--limit", "1"]);
    assert_call(
        "contact_sheet_json",
        dir.path(),
        &["-C", "p", "sheet", "--json"],
    );
    at("status_pairs", &["status", "--pairs"]);
    at("show_low_none", &["show", "--low"]);
    at("export", &["export", "-o", "out"]);
    at("export_csv", &["export", "--to", "csv", "-o", "csv"]);
    at("agreement_without_pairs_in_common", &["agreement"]);
    at(
        "adjudicate_nothing",
        &["review", "--reviewer", "an", "--adjudicate", "--no-open"],
    );
}

#[test]
fn verdicts() {
    let dir = empty();
    done(dir.path());
    let at = |name: &str, args: &[&str]| at(dir.path(), name, args);
    at(
        "verdict_set",
        &[
            "verdict",
            "set",
            "upright-0001",
            "fail",
            "--reviewer",
            "Trần Lan",
            "--metric",
            "density",
            "--reason",
            "angle",
            "--angle",
            "-2.5",
            "--note",
            "nghiêng",
        ],
    );
    let undo = ["verdict", "undo", "--reviewer", "Trần Lan"];
    at("verdict_undo", &undo);
    at("verdict_log", &["verdict", "log"]);
    write(
        dir.path(),
        "verdicts.csv",
        "pair,verdict,reviewer\nupright-0000,fail,an\nupright-0001,pass,an\n",
    );
    at("verdict_import", &["verdict", "import", "verdicts.csv"]);
    at("status_judged", &["status"]);
    at("error_undo_of_several", &["verdict", "undo"]);
    let similar = ["verdict", "set", "upright-0001", "đạt", "--reviewer", "Ân"];
    at("error_similar_reviewer", &similar);
    let insisted = [&similar[..], &["--new-reviewer"]].concat();
    at("verdict_set_in_vietnamese", &insisted);
    let placeholder = [
        "verdict",
        "set",
        "upright-0001",
        "pass",
        "--reviewer",
        "NAME",
    ];
    at("error_reviewer_of_example", &placeholder);
    for (name, text) in [
        ("pair", "pair,verdict,reviewer\nz,pass,an\n"),
        ("word", "pair,verdict,reviewer\nupright-0000,good,an\n"),
        ("column", "pair,verdict,reveiwer\nupright-0000,pass,an\n"),
        ("columns", "id,result,who\nupright-0000,pass,an\n"),
        (
            "rows",
            "pair,verdict,reviewer\nupright-0000,good,an\nz,pass,an\nupright-0001,pass,\n",
        ),
        (
            "time",
            "pair,verdict,reviewer,at\nupright-0000,pass,an,today\n",
        ),
    ] {
        write(dir.path(), "verdicts.csv", text);
        let name = format!("error_verdict_file_{name}");
        at(&name, &["verdict", "import", "verdicts.csv"]);
    }
}

#[test]
fn check_and_repair() {
    let dir = empty();
    let project = done(dir.path());
    let at = |name: &str, args: &[&str]| at(dir.path(), name, args);
    at("check_clean", &["check"]);
    let detail = crate::resume::pairs(&project).remove(0);
    let record = detail.results.stage(mocban::domain::Stage::Register);
    let files = &record.expect("a result").files;
    let first = files.values().next().expect("a file");
    std::fs::remove_file(project.artifact_path(first)).expect("removed");
    sql(
        &project,
        "UPDATE counter SET n = n + 1 WHERE stage = 0 AND status = 0",
    );
    std::fs::write(project.artifacts_dir().join("notes.txt"), "mine").expect("written");
    at("check_damaged", &["check"]);
    at("check_repair", &["check", "--repair"]);
    at("run_after_repair", &["run"]);
    std::fs::write(project.catalog_path(), "id,mesh,print\n").expect("written");
    at("check_not_a_catalog", &["check"]);
}

#[test]
fn backup() {
    let dir = empty();
    done(dir.path());
    let at = |name: &str, args: &[&str]| at(dir.path(), name, args);
    at("backup", &["backup", "b.sqlite"]);
    write(dir.path(), "thesis.docx", "ten years");
    at("error_backup_target", &["backup", "thesis.docx"]);
    at("error_backup_directory", &["backup", "p"]);
    assert_call("restore", dir.path(), &["restore", "b.sqlite", "q"]);
    assert_call("check_restored", dir.path(), &["-C", "q", "check"]);
}

#[test]
fn documentation() {
    let dir = empty();
    assert_call("docs", dir.path(), &["docs"]);
    let index = dir.path().join("mocban-docs/index.html");
    let first = std::fs::read_to_string(&index).expect("a page");
    assert!(first.contains("tutorial/first-hour.html"), "{first}");
    assert!(dir.path().join("mocban-docs/pictures/viewer.jpg").exists());
    // An earlier version of the pages is replaced; anything else is kept.
    let old = "<meta name=\"generator\" content=\"mocban docs\">old";
    write(dir.path(), "mocban-docs/index.html", old);
    assert_call("docs", dir.path(), &["docs"]);
    assert_eq!(std::fs::read_to_string(&index).expect("a page"), first);
    write(dir.path(), "mocban-docs/guides/notes.txt", "mine");
    assert_call("error_docs_directory", dir.path(), &["docs"]);
    std::fs::create_dir_all(dir.path().join("material/pictures")).expect("a folder");
    write(dir.path(), "material/pictures/scan.jpg", "mine");
    crate::cli::mocban(dir.path(), &["docs", "material"]).expect(2);
    assert!(dir.path().join("material/pictures/scan.jpg").exists());
}

#[test]
fn demo() {
    let dir = empty();
    let demo = ["demo", "d", "--pairs", "1", "--no-run"];
    assert_measured("demo", dir.path(), &demo);
    let other = [&demo[..], &["--tier", "pose"]].concat();
    assert_measured("error_other_demo", dir.path(), &other);
    let set = [&demo[..], &["--set", "run.workers=1"]].concat();
    assert_measured("demo_with_settings", dir.path(), &set);
}

#[test]
fn progress_of_a_run() {
    let dir = imported();
    // A line of a slow run, at most one a second.
    let in_between = (r"(?m)^\d+ % · .*\n", "");
    for mode in ["plain", "json"] {
        let args = ["-C", "p", "--progress", mode, "run", "-j", "1"];
        let args = [&args[..], &["--rerun", "failed"]].concat();
        let text = transcript(dir.path(), &args);
        assert_text(&format!("progress_{mode}"), &text, &[in_between]);
    }
}

#[test]
fn colour_where_it_is_wanted() {
    let dir = imported();
    let mut command = binary();
    let args = ["-C", "p", "--color", "always", "status"];
    let shown = call(command.current_dir(dir.path()).args(args));
    assert_text("status_in_colour", &shown.out.replace('\u{1b}', "ESC"), &[]);
}
