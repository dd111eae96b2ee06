//! `backup` through the real binary: backs up during a run, can be restored, and is never incomplete.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use mocban::domain::Stage;
use mocban::store::Project;

use crate::check::{at, done, exported, sql};
use crate::cli::mocban;
use crate::made_once::copy_folder;
use crate::resume::{pairs_done, project, run};
use crate::waiting::until;

pub(crate) fn files(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir).expect("a folder");
    let name = |entry: std::io::Result<std::fs::DirEntry>| {
        let name = entry.expect("an entry").file_name();
        name.into_string().expect("UTF-8")
    };
    let mut names: Vec<_> = entries.map(name).collect();
    names.sort();
    names
}

#[test]
fn backup_taken_during_a_run_restores_to_the_same_export() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let original = project(dir.path(), "original", "8");
    std::fs::write(original.settings_path(), "[depth]\nlongest_px = 96\n").expect("written");
    let blank = dir.path().join("blank");
    copy_folder(&original.dir().join("data"), &blank.join("data"));
    let file = dir.path().join("b.sqlite");
    let backup = ["backup", file.to_str().expect("UTF-8")];

    // The run waits at its last pair until the backup is there.
    let hold = dir.path().join("hold");
    let mut child = run(&original, &["-j", "1"])
        .env("MOCBAN_HOLD_AT", "fit:computed:8")
        .env("MOCBAN_HOLD_FILE", &hold)
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts");
    // `fit` writes no files, `depth` does.
    until(&mut child, || pairs_done(&original, Stage::Depth) > 0);
    at(&original, &backup).expect(0);
    until(&mut child, || hold.exists());
    std::fs::remove_file(&hold).expect("released");
    assert!(child.wait().expect("a child").success());
    let expected = exported(&original, "expected");

    // The inputs are unchanged; the artifacts are lost with the old project.
    restore(&file, &blank);
    let blank = Project::open(&blank).expect("a project");
    let settings = std::fs::read(original.settings_path()).expect("settings");
    assert!(std::fs::read(blank.settings_path()).expect("settings") == settings);
    let accept = ["check", "--repair", "--accept-missing", "--json"];
    let repaired = at(&blank, &accept).expect(0).json();
    assert_eq!(repaired["pairs"], 8);
    assert!(
        repaired["damage"]["file_missing"]["found"].as_u64() >= Some(1),
        "{repaired}"
    );
    at(&blank, &["run"]).expect(0);
    at(&blank, &["check"]).expect(0);
    assert!(exported(&blank, "restored") == expected, "another export");
}

/// The meshes and prints lie in another folder than before, some below other folders of the same names.
#[test]
fn restore_finds_inputs_in_another_directory() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let expected = exported(&project, "expected");
    let file = dir.path().join("b.sqlite");
    at(&project, &["backup", file.to_str().expect("UTF-8")]).expect(0);
    let moved = dir.path().join("bản quét");
    std::fs::rename(project.dir().join("data"), &moved).expect("moved");
    let text = |path: &Path| path.to_str().expect("UTF-8").to_owned();
    let restore = |name: &str, inputs: &Path| {
        let (file, inputs) = (text(&file), text(inputs));
        let args = ["restore", &file, name, "--inputs", &inputs, "--json"];
        mocban(dir.path(), &args)
    };
    let refused = restore("new", &dir.path().join("nowhere")).expect(2);
    assert!(
        refused.err.contains("there is no directory"),
        "{}",
        refused.err
    );
    assert!(!dir.path().join("new").exists());

    let other = dir.path().join("other");
    std::fs::create_dir(&other).expect("a folder");
    let told = restore("without", &other).expect(0);
    let paths = told.json()["inputs_missing"].as_u64();
    assert!(paths > Some(1), "{paths:?}");
    assert!(
        told.err.contains("neither at the old place nor in"),
        "{}",
        told.err
    );

    let told = restore("new", &moved).expect(0);
    assert_eq!(told.json()["inputs_missing"], 0);
    let restored = Project::open(&dir.path().join("new")).expect("a project");
    for command in ["status", "run"] {
        let told = at(&restored, &[command]).expect(0);
        let text = format!("{}{}", told.out, told.err);
        assert!(
            text.contains("the depth maps and masks of the results are not here"),
            "{text}"
        );
        assert!(!text.contains("have another size"), "{text}");
        assert!(
            told.next()[0].ends_with("check --repair --accept-missing"),
            "{text}"
        );
    }
    let plan = at(&restored, &["run", "--dry-run"]).expect(0);
    assert!(
        plan.err
            .contains("the depth maps and masks of the results are not here"),
        "{}",
        plan.err
    );
    at(&restored, &["check", "--repair", "--accept-missing"]).expect(0);
    at(&restored, &["run"]).expect(0);
    let told = at(&restored, &["status"]).expect(0);
    assert!(!told.out.contains("not here"), "{}", told.out);
    at(&restored, &["check"]).expect(0);
    let found = exported(&restored, "restored");
    assert!(
        without_source_paths(&found) == without_source_paths(&expected),
        "another export"
    );
}

/// Returns the files of an export with lines that do not name the mesh and the print, and without the checksums, which
/// include the lines.
fn without_source_paths(files: &[(PathBuf, Vec<u8>)]) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = files.to_vec();
    files.retain(|(path, _)| !path.ends_with("checksums.txt"));
    for (_, bytes) in files
        .iter_mut()
        .filter(|(path, _)| path.ends_with("pairs.jsonl"))
    {
        let text = String::from_utf8_lossy(bytes).into_owned();
        let lines = text.lines().map(|line| {
            let mut line: serde_json::Value = serde_json::from_str(line).expect("JSON");
            line["mesh"].take();
            line["print"].take();
            line.to_string() + "\n"
        });
        *bytes = lines.collect::<String>().into_bytes();
    }
    files
}

/// A repair would remove results that no run can compute again.
#[test]
fn check_keeps_the_results_of_pairs_whose_inputs_are_missing() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let moved = dir.path().join("away");
    let data = project.dir().join("data");
    std::fs::rename(&data, &moved).expect("moved");
    let sound = at(&project, &["check"]).expect(0);
    assert!(
        sound.out.contains("but inputs are missing"),
        "{}",
        sound.out
    );

    std::fs::remove_dir_all(project.artifacts_dir()).expect("removed");
    let before = at(&project, &["status", "--json"]).expect(0).out;
    let kept = at(&project, &["check", "--repair"]).expect(12);
    let reason = "not queued again, because a mesh or print is missing or cannot be read";
    assert!(kept.out.contains(reason), "{}", kept.out);
    assert_eq!(at(&project, &["status", "--json"]).expect(0).out, before);

    std::fs::rename(&moved, &data).expect("moved back");
    at(&project, &["check", "--repair", "--accept-missing"]).expect(0);
    at(&project, &["run"]).expect(0);
    at(&project, &["check"]).expect(0);
}

/// Restores a backup to a directory.
fn restore(file: &Path, dir: &Path) {
    let [file, dir] = [file, dir].map(|path| path.to_str().expect("UTF-8"));
    mocban(Path::new("/"), &["restore", file, dir]).expect(0);
}

#[test]
fn verdicts_survive_a_restore() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let file = dir.path().join("blocks.sqlite");
    let backup = ["backup", file.to_str().expect("UTF-8"), "--json"];
    let told = at(&project, &backup).expect(0).json();
    assert_eq!(told["verdicts"], 4);
    let log = at(&project, &["verdict", "log", "--json"]).expect(0).out;

    let other = dir.path().join("q");
    copy_folder(&project.dir().join("data"), &other.join("data"));
    restore(&file, &other);
    let restored = Project::open(&other).expect("a project");
    at(&restored, &["check", "--repair", "--accept-missing"]).expect(0);
    at(&restored, &["run"]).expect(0);
    at(&restored, &["check"]).expect(0);
    // The results are the same, so the verdicts apply to them again.
    assert_eq!(
        at(&restored, &["verdict", "log", "--json"]).expect(0).out,
        log
    );
    let status = at(&restored, &["status", "--json"]).expect(0).json();
    assert_eq!(status["verdicts"]["pass"], 4);
    // A project is never overwritten.
    let args = ["restore", file.to_str().expect("UTF-8"), "q"];
    let refused = mocban(dir.path(), &args).expect(2);
    assert!(
        refused.err.contains("q is a project already"),
        "{}",
        refused.err
    );
}

#[test]
fn backup_is_one_file_and_touches_no_other() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    std::fs::write(project.settings_path(), "[depth]\nlongest_px = 96\n").expect("written");
    let foreign = ["blocks-v1.mocban.toml", "blocks-v1.verdicts.jsonl"];
    for name in foreign {
        std::fs::write(dir.path().join(name), "mine").expect("written");
    }
    let versions = ["blocks-v1.0", "blocks-v1.1"];
    let before = files(dir.path());
    let backup = |name: &str| at(&project, &["backup", &format!("../{name}")]).expect(0);
    backup(versions[0]);
    sql(&project, "UPDATE pair SET block = 'b1'");
    let first = std::fs::read(dir.path().join(versions[0])).expect("read");
    std::fs::remove_file(project.settings_path()).expect("settings");
    backup(versions[1]);
    let mut expected = [&before[..], &versions.map(ToOwned::to_owned)].concat();
    expected.sort();
    assert_eq!(files(dir.path()), expected);
    assert!(std::fs::read(dir.path().join(versions[0])).expect("read") == first);
    for name in foreign {
        assert_eq!(std::fs::read(dir.path().join(name)).expect("read"), b"mine");
    }
    // Each backup holds its own settings, or none.
    for (name, has_settings) in versions.into_iter().zip([true, false]) {
        let restored = dir.path().join(format!("of-{name}"));
        restore(&dir.path().join(name), &restored);
        assert_eq!(restored.join("mocban.toml").exists(), has_settings);
        at(&Project::at(&restored), &["status"]).expect(0);
    }
}

#[test]
fn restore_refuses_other_files_and_keeps_other_settings() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    std::fs::write(project.settings_path(), "[depth]\nlongest_px = 96\n").expect("written");
    at(&project, &["backup", "../b"]).expect(0);
    std::fs::write(dir.path().join("thesis.docx"), "ten years").expect("written");
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
    std::fs::write(dir.path().join("pointer"), pointer).expect("written");
    std::fs::create_dir(dir.path().join("mine")).expect("a folder");
    std::fs::write(dir.path().join("mine/mocban.toml"), "[run]\n").expect("written");
    for (args, code, says) in [
        (["thesis.docx", "q"], 2, "thesis.docx is not a backup"),
        (
            ["pointer", "q"],
            2,
            "pointer is a pointer of Git LFS and does not hold the backup",
        ),
        (["none", "q"], 2, "there is no file none"),
        (["b", "mine"], 2, "mine/mocban.toml exists and differs"),
    ] {
        let refused = mocban(dir.path(), &[&["restore"], &args[..]].concat()).expect(code);
        assert!(refused.err.contains(says), "{}", refused.err);
    }
    assert!(!dir.path().join("q").exists());
    assert_eq!(files(&dir.path().join("mine")), ["mocban.toml"]);
    // A restore that was killed before the catalog was renamed is completed.
    std::fs::copy(project.settings_path(), dir.path().join("mine/mocban.toml")).expect("copied");
    mocban(dir.path(), &["restore", "b", "mine"]).expect(0);
    assert_eq!(
        files(&dir.path().join("mine")),
        ["catalog.sqlite", "mocban.toml"]
    );
}

#[test]
fn exported_verdicts_can_be_imported_into_another_project() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let log = at(&project, &["verdict", "log", "--json"]).expect(0).out;
    let first: serde_json::Value = log
        .lines()
        .next()
        .and_then(|line| serde_json::from_str(line).ok())
        .expect("a line");
    let pair = first["pair"].as_str().expect("a name");
    let to_undo = ["verdict", "set", pair, "fail", "--reviewer", "lan"];
    at(&project, &to_undo).expect(0);
    at(&project, &["verdict", "undo", "--reviewer", "lan"]).expect(0);
    let out = dir.path().join("out");
    at(&project, &["export", "-o", out.to_str().expect("UTF-8")]).expect(0);
    let lines = out.join("verdicts.jsonl");
    let file = lines.to_str().expect("UTF-8");

    let demo = ["demo", "other", "--pairs", "2", "--no-run"];
    let small = ["--set", "depth.longest_px=96"];
    mocban(dir.path(), &[&demo[..], &small].concat()).expect(0);
    let other = Project::open(&dir.path().join("other")).expect("a project");
    at(&other, &["run"]).expect(0);
    let taken = at(&other, &["verdict", "import", file, "--json"]).expect(0);
    assert_eq!(taken.json()["recorded"], 4);
    // Neither project records a verdict twice.
    for project in [&other, &project] {
        let again = at(project, &["verdict", "import", file, "--json"]).expect(0);
        assert_eq!(
            (&again.json()["recorded"], &again.json()["known"]),
            (&0.into(), &4.into())
        );
    }
    let of = |project| {
        let log = at(project, &["verdict", "log", "--json"]).expect(0).out;
        let lines = log.lines().map(serde_json::from_str::<serde_json::Value>);
        let lines = lines.map(|line| line.expect("JSON"));
        let lines = lines.filter(|line| line["undone_at"].is_null());
        let keys = [
            "pair",
            "metric",
            "result_hash",
            "verdict",
            "reviewer",
            "reason",
            "note",
        ];
        let told = |line: &serde_json::Value| keys.map(|key| line[key].to_string());
        lines.map(|line| told(&line)).collect::<Vec<_>>()
    };
    assert_eq!(of(&other), of(&project));
    assert_eq!(of(&other).len(), 4);

    // A verdict on another result is not recorded.
    let text = std::fs::read_to_string(&lines).expect("read");
    let first = text.lines().next().expect("a line");
    let hash = "0".repeat(64);
    let mut line: serde_json::Value = serde_json::from_str(first).expect("JSON");
    line["result_hash"] = hash.into();
    std::fs::write(&lines, line.to_string()).expect("written");
    let taken = at(&other, &["verdict", "import", file, "--json"]).expect(0);
    assert_eq!(
        (&taken.json()["recorded"], &taken.json()["left_out"]),
        (&0.into(), &1.into())
    );
    assert!(taken.err.contains("1 verdict left out"), "{}", taken.err);
}

#[test]
fn failed_backup_leaves_the_previous_one_and_no_partial_files() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let file = dir.path().join("b.sqlite");
    let backup = ["backup", file.to_str().expect("UTF-8")];
    at(&project, &backup).expect(0);
    let (good, names) = (std::fs::read(&file).expect("read"), files(dir.path()));
    let intact = crate::odd::corrupt_catalog(&project, 5, 7);
    let refused = at(&project, &backup).expect(1);
    assert!(refused.err.contains("is damaged"), "{}", refused.err);
    assert!(std::fs::read(&file).expect("read") == good);
    assert_eq!(files(dir.path()), names);
    std::fs::write(project.catalog_path(), intact).expect("restored");
    sql(&project, "UPDATE pair SET block = 'b1'");
    at(&project, &backup).expect(0);
    assert!(std::fs::read(&file).expect("read") != good);
    assert_eq!(files(dir.path()), names);
}

#[test]
fn backup_overwrites_only_a_backup() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let thesis = dir.path().join("thesis.docx");
    std::fs::write(&thesis, "ten years").expect("written");
    for (place, says) in [
        ("../thesis.docx", "not a backup"),
        ("catalog.sqlite", "is a file of a project"),
        ("mocban.toml", "is a file of a project"),
        ("artifacts", "belongs to the results of a project"),
    ] {
        let refused = mocban(project.dir(), &["backup", place]).expect(2);
        assert!(refused.err.contains(says), "{place}: {}", refused.err);
    }
    assert_eq!(std::fs::read(&thesis).expect("read"), b"ten years");
    mocban(project.dir(), &["backup", "in/new/folders/b.sqlite"]).expect(0);
    assert!(project.dir().join("in/new/folders/b.sqlite").is_file());
    at(&project, &["check"]).expect(0);
}
