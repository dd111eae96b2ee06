//! Commands that write the same output at the same time, or were killed while they wrote it. The output is always that
//! of one command, whole, and nothing else is left. `MOCBAN_TRIALS` sets the number of races of each kind.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use mocban::store::Project;

use crate::backup::files as names;
use crate::check::{at, done};
use crate::cli::{binary, mocban};
use crate::resume::copy;
use crate::test_size::trials;
use crate::uninterrupted::files;
use crate::waiting::until;

/// Calls of one command that start at the same time.
const AT_ONCE: usize = 3;

/// Returns the binary for a project, with arguments, ready to be started.
fn command(project: &Project, args: &[&str]) -> Command {
    let mut command = binary();
    command.current_dir(project.dir()).args(args);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Starts all commands at once. Asserts that at least one succeeds, and that the others succeed or report that the
/// output is in use. Returns the number of successes.
fn race(commands: &mut [Command]) -> usize {
    let start = |command: &mut Command| command.spawn().expect("the binary starts");
    let children: Vec<Child> = commands.iter_mut().map(start).collect();
    let mut successes = 0;
    for child in children {
        let output = child.wait_with_output().expect("a child");
        let err = String::from_utf8_lossy(&output.stderr);
        let code = output.status.code();
        if code == Some(0) {
            successes += 1;
            continue;
        }
        assert_eq!(code, Some(11), "{err}");
        assert!(err.contains("is being written by another process"), "{err}");
    }
    assert!(successes > 0);
    successes
}

/// Returns two projects with the same pairs and different results.
fn two_projects(dir: &Path) -> [Project; 2] {
    let one = done(dir);
    let other = copy(&one, &dir.join("other"));
    at(&other, &["run", "--set", "depth.longest_px=80"]).expect(0);
    [one, other]
}

#[test]
fn exports_of_two_projects_to_one_folder_leave_one_whole_export() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let projects = two_projects(dir.path());
    let whole: Vec<_> = (projects.iter().zip(["a", "b"]))
        .map(|(project, name)| {
            let out = format!("../{name}");
            at(project, &["export", "-o", &out]).expect(0);
            files(&dir.path().join(name))
        })
        .collect();
    assert!(whole[0] != whole[1]);
    let mut expected = [&names(dir.path())[..], &["out".to_owned()]].concat();
    expected.sort();
    for _ in 0..trials(3) {
        let out = ["export", "-o", "../out"];
        let mut commands: Vec<_> = (0..AT_ONCE)
            .map(|index| command(&projects[index % 2], &out))
            .collect();
        race(&mut commands);
        assert!(whole.contains(&files(&dir.path().join("out"))));
        assert_eq!(names(dir.path()), expected);
    }
}

#[test]
fn backups_to_one_name_leave_one_whole_backup() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let projects = two_projects(dir.path());
    let expected = [&["b".to_owned()][..], &names(dir.path())].concat();
    for round in 0..trials(3) {
        let mut commands: Vec<_> = (0..AT_ONCE)
            .map(|index| command(&projects[index % 2], &["backup", "../b"]))
            .collect();
        race(&mut commands);
        assert_eq!(names(dir.path()), expected);
        let restored = format!("restored-{round}");
        mocban(dir.path(), &["restore", "b", &restored]).expect(0);
        at(&Project::at(&dir.path().join(&restored)), &["status"]).expect(0);
        std::fs::remove_dir_all(dir.path().join(restored)).expect("removed");
    }
}

#[test]
fn reports_to_one_file_all_succeed_and_leave_one_whole_file() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let calls = [
        &["report", "-o", "../r"] as &[&str],
        &["report", "-f", "csv", "-o", "../r"],
        &["report", "-f", "json", "-o", "../r"],
    ];
    let result = dir.path().join("r");
    let whole = calls.map(|args| {
        at(&project, args).expect(0);
        std::fs::read(&result).expect("read")
    });
    let expected = names(dir.path());
    for _ in 0..trials(3) {
        let mut commands = calls.map(|args| command(&project, args));
        assert_eq!(race(&mut commands), calls.len());
        assert!(whole.contains(&std::fs::read(&result).expect("read")));
        assert_eq!(names(dir.path()), expected);
    }
}

#[test]
fn demos_in_one_directory_leave_one_whole_project() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let demo = ["demo", "d", "--pairs", "2", "--no-run"];
    mocban(dir.path(), &demo).expect(0);
    let project = Project::open(&dir.path().join("d")).expect("a project");
    let whole = files(&project.dir().join("data"));
    for round in 0..trials(3) {
        let name = format!("d{round}");
        let mut commands: Vec<_> = (0..AT_ONCE)
            .map(|_| {
                let mut command = command(&project, &["demo", &name, "--pairs", "2", "--no-run"]);
                command.current_dir(dir.path());
                command
            })
            .collect();
        race(&mut commands);
        let made = dir.path().join(&name);
        assert!(files(&made.join("data")) == whole);
        let status = ["-C", &name, "status", "--json"];
        assert_eq!(mocban(dir.path(), &status).expect(0).json()["pairs"], 2);
        assert!(names(&made).iter().all(|name| !name.starts_with('.')));
    }
}

#[test]
fn an_output_in_use_is_refused_with_the_pid_and_unchanged() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let calls: [(&str, &[&str]); 2] = [
        ("out", &["export", "-o", "../out"]),
        ("b.sqlite", &["backup", "../b.sqlite"]),
    ];
    for (target, args) in calls {
        at(&project, args).expect(0);
        let before = names(dir.path());
        let path = dir.path().join(format!(".{target}.mocban-lock"));
        std::fs::write(&path, "4711").expect("written");
        let lock = File::open(&path).expect("a lock file");
        lock.lock().expect("nobody else has it");
        let refused = at(&project, args).expect(11);
        let wanted = format!("{target} is being written by another process (pid 4711); wait");
        assert!(refused.err.contains(&wanted), "{}", refused.err);
        assert!(refused.next().is_empty(), "{}", refused.err);
        drop(lock);
        // A lock file that a killed process left is no obstacle.
        at(&project, args).expect(0);
        assert_eq!(names(dir.path()), before);
    }
}

#[test]
fn what_a_killed_export_left_is_removed_by_the_next() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let export = ["export", "-o", "../out"];
    at(&project, &export).expect(0);
    let (before, expected) = (files(&dir.path().join("out")), names(dir.path()));
    let held = tempfile::tempdir().expect("a temporary directory");
    let hold = held.path().join("hold");
    let mut child = command(&project, &export)
        .env("MOCBAN_HOLD_AT", "export:written")
        .env("MOCBAN_HOLD_FILE", &hold)
        .spawn()
        .expect("the binary starts");
    let staging = format!(".out.{}-0.mocban-partial", child.id());
    until(&mut child, || hold.exists());
    assert!(dir.path().join(&staging).join("lock").exists());
    child.kill().expect("killed");
    child.wait().expect("a child");
    assert!(names(dir.path()).contains(&staging));
    assert!(files(&dir.path().join("out")) == before);
    at(&project, &export).expect(0);
    assert!(files(&dir.path().join("out")) == before);
    assert_eq!(names(dir.path()), expected);
}

#[test]
fn an_export_replaces_no_foreign_folder_with_a_file_of_the_same_name() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let mine = dir.path().join("mine");
    std::fs::create_dir(&mine).expect("a folder");
    std::fs::write(mine.join("verdicts.jsonl"), "guilty\n").expect("written");
    let refused = at(&project, &["export", "-o", "../mine"]).expect(2);
    let wanted = "mine/verdicts.jsonl is not part of an export";
    assert!(refused.err.contains(wanted), "{}", refused.err);
    assert_eq!(
        std::fs::read(mine.join("verdicts.jsonl")).expect("read"),
        b"guilty\n"
    );
    at(&project, &["export", "-o", "../out"]).expect(0);
    std::fs::write(dir.path().join("out/pairs/notes.txt"), "mine").expect("written");
    let refused = at(&project, &["export", "-o", "../out"]).expect(2);
    assert!(
        refused.err.contains("out/pairs/notes.txt is not part"),
        "{}",
        refused.err
    );
}

#[test]
fn an_output_replaces_no_file_of_a_project_and_no_backup() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let backup = dir.path().join("b.sqlite");
    let link = dir.path().join("link");
    let settings = project.settings_path();
    std::fs::write(&settings, "").expect("written");
    std::os::unix::fs::symlink(project.catalog_path(), &link).expect("a link");
    at(&project, &["backup", backup.to_str().expect("UTF-8")]).expect(0);
    for file in [project.catalog_path(), settings, backup, link] {
        let before = std::fs::read(&file).expect("a file");
        let name = file.to_str().expect("UTF-8");
        for args in [
            &["report", "-o", name][..],
            &["contact-sheet", "-o", name],
            &["--log-file", name, "-v", "check"],
        ] {
            let refused = at(&project, args).expect(2);
            let wanted = "name another file for the output";
            assert!(refused.err.contains(wanted), "{args:?}: {}", refused.err);
        }
        assert!(before == std::fs::read(&file).expect("a file"), "{name}");
    }
    at(&project, &["check"]).expect(0);
}

#[test]
fn an_output_replaces_no_input_of_the_project() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let data = project.dir().join("data");
    let of_pair = |path: &std::path::PathBuf| path.to_string_lossy().contains("upright-0001");
    let paths = files(&data).into_keys().filter(of_pair);
    let mut inputs: Vec<_> = paths.map(|path| data.join(path)).collect();
    // The mesh, the print and the true mask.
    assert_eq!(inputs.len(), 3);
    let link = dir.path().join("link");
    std::os::unix::fs::symlink(&inputs[0], &link).expect("a link");
    inputs.push(link);
    for file in inputs {
        let before = std::fs::read(&file).expect("a file");
        let name = file.to_str().expect("UTF-8");
        for args in [&["report", "-o", name][..], &["contact-sheet", "-o", name]] {
            let refused = at(&project, args).expect(2);
            let is_picture = [".png", ".jpg"].iter().any(|end| name.ends_with(end));
            let wanted = if args[0] == "report" && is_picture {
                "a report cannot be written as"
            } else {
                "is an input of upright-0001; name another file"
            };
            assert!(refused.err.contains(wanted), "{args:?}: {}", refused.err);
        }
        if !name.ends_with("link") {
            let log = at(&project, &["--log-file", name, "-v", "check"]).expect(2);
            assert!(
                log.err.contains("is not a log file of this program"),
                "{}",
                log.err
            );
        }
        assert!(before == std::fs::read(&file).expect("a file"), "{name}");
    }
    // The same file name elsewhere is no input.
    for (command, output) in [
        ("report", "../upright-0001.ply"),
        ("contact-sheet", "../upright-0001.png"),
    ] {
        at(&project, &[command, "-o", output]).expect(0);
    }
}

#[test]
fn outputs_with_the_longest_names_are_written_and_longer_ones_refused_with_the_reason() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let calls: [&[&str]; 4] = [
        &["export", "-o"],
        &["backup"],
        &["report", "-o"],
        &["contact-sheet", "-o"],
    ];
    for args in calls {
        for (length, code) in [(250, 0), (255, 0), (256, 1)] {
            let before = names(dir.path()).len();
            let path = format!("../{}", "a".repeat(length));
            let called = at(&project, &[args, &[&path]].concat()).expect(code);
            let has_reason = called.err.contains("File name too long");
            assert_eq!(has_reason, code != 0, "{args:?}: {}", called.err);
            let output = project.dir().join(&path);
            assert_eq!(names(dir.path()).len(), before + usize::from(code == 0));
            if output.is_dir() {
                std::fs::remove_dir_all(output).expect("removed");
            } else if code == 0 {
                std::fs::remove_file(output).expect("removed");
            }
        }
    }
}
