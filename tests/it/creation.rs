//! Processes that create, fill and read the same new project at the same time, and creators that are killed.
//! `MOCBAN_TRIALS` sets the number of rounds.

use std::ffi::OsStr;
use std::fs::File;
use std::os::unix::ffi::OsStrExt as _;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::cli::{binary, call, empty, mocban};
use crate::test_size::trials;

/// Imports that start at the same time.
const IMPORTS: usize = 16;

fn rounds() -> usize {
    trials(3)
}

/// Writes a manifest with one pair; returns the command that imports it into the project `new/p`.
fn import(root: &Path, name: &str) -> Command {
    let manifest = root.join(format!("{name}.csv"));
    std::fs::write(&manifest, format!("id,mesh,print\n{name},a.stl,a.png\n")).expect("written");
    let mut command = binary();
    command
        .args(["-C", "new/p", "-q", "import", "--allow-missing"])
        .arg(&manifest);
    command.current_dir(root);
    command
}

/// Returns an import that fails after it began to create the project: the mesh folder is not UTF-8.
fn failing_import(root: &Path) -> Command {
    let meshes = root.join(OsStr::from_bytes(b"m\xff"));
    for (dir, file) in [(&meshes, "z.stl"), (&root.join("prints"), "z.png")] {
        std::fs::create_dir_all(dir).expect("a folder");
        std::fs::write(dir.join(file), "x").expect("written");
    }
    let mut command = binary();
    command.args([
        "-C", "new/p", "-q", "import", "--prints", "prints", "--meshes",
    ]);
    command.arg(&meshes).current_dir(root);
    command
}

/// Returns the names in the project's directory that start with a dot.
fn hidden(root: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(root.join("new/p")).into_iter().flatten();
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    names.filter(|name| name.starts_with('.')).collect()
}

fn pairs(root: &Path) -> Vec<String> {
    let path = root.join("new/p/catalog.sqlite");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let catalog = mocban::catalog::Catalog::open_read_only(&path).await;
        let catalog = catalog.expect("a catalog");
        let names = catalog.pair_names().await.expect("names");
        catalog.close().await;
        names.iter().map(ToString::to_string).collect()
    })
}

#[test]
fn imports_into_a_new_project_at_the_same_time_are_all_stored() {
    for round in 0..rounds() {
        let dir = empty();
        let root = dir.path();
        let mut expected = Vec::new();
        let mut running = Vec::new();
        for number in 0..IMPORTS {
            let name = format!("p{number:02}");
            running.push((0, import(root, &name)));
            expected.push(name);
            if number % 4 == 0 {
                running.push((1, failing_import(root)));
                let mut report = binary();
                report.args(["-C", "new/p", "report"]).current_dir(root);
                running.push((10, report));
            }
        }
        let running: Vec<_> = running
            .into_iter()
            .map(|(code, mut command)| {
                command.stdout(Stdio::piped()).stderr(Stdio::piped());
                (code, command.spawn().expect("the binary starts"))
            })
            .collect();
        for (code, child) in running {
            let output = child.wait_with_output().expect("an exit code");
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            let found = output.status.code().expect("no signal");
            match code {
                // No project yet, or a whole one.
                10 => assert!([0, 10].contains(&found), "round {round}: {found} {text}"),
                1 => {
                    assert!([1, 2].contains(&found), "round {round}: {found} {text}");
                    assert!(text.contains("is not UTF-8"), "round {round}: {text}");
                }
                _ => assert_eq!(found, 0, "round {round}: {text}"),
            }
        }
        assert_eq!(pairs(root), expected, "round {round}");
        assert_eq!(hidden(root), [""; 0], "round {round}");
        mocban(root, &["-C", "new/p", "check"]).expect(0);
    }
}

#[test]
fn import_that_fails_leaves_no_project() {
    let dir = empty();
    let refused = call(&mut failing_import(dir.path()));
    assert!(refused.err.contains("is not UTF-8"), "{}", refused.err);
    assert!(!dir.path().join("new").exists());
    call(&mut import(dir.path(), "a")).expect(0);
    call(&mut failing_import(dir.path()));
    assert_eq!(pairs(dir.path()), ["a"]);
}

#[test]
fn killed_creators_leave_hidden_files_that_the_next_import_removes() {
    for _ in 0..rounds() {
        let dir = empty();
        let root = dir.path();
        let mut command = import(root, "killed");
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().expect("the binary starts");
        while hidden(root).is_empty() && child.try_wait().expect("a state").is_none() {
            std::thread::yield_now();
        }
        child.kill().expect("killed");
        child.wait().expect("an exit code");
        call(&mut import(root, "next")).expect(0);
        assert!(pairs(root).contains(&"next".to_owned()));
        assert_eq!(hidden(root), [""; 0]);
    }
}

#[test]
fn hidden_files_are_removed_only_when_no_process_creates_a_catalog() {
    let dir = empty();
    let root = dir.path();
    call(&mut import(root, "a")).expect(0);
    let stale = root.join("new/p/.catalog.sqlite.mocban-new-abc123");
    let other = root.join("new/p/.catalog.sqlite.notes");
    for file in [&stale, &other] {
        std::fs::write(file, "x").expect("written");
    }
    let creator = File::open(root.join("new/p")).expect("a folder");
    creator.lock_shared().expect("the lock of a creator");
    mocban(root, &["-C", "new/p", "check", "--repair"]).expect(0);
    assert!(stale.exists());
    drop(creator);
    mocban(root, &["-C", "new/p", "check"]).expect(0);
    assert!(stale.exists());
    mocban(root, &["-C", "new/p", "check", "--repair"]).expect(0);
    assert!(!stale.exists() && other.exists());
}

#[test]
fn log_of_a_removed_catalog_is_not_read_into_a_new_one() {
    let dir = empty();
    let root = dir.path();
    std::fs::create_dir_all(root.join("new/p")).expect("a folder");
    let log = root.join("new/p/catalog.sqlite-wal");
    std::fs::write(&log, "changes").expect("written");
    let refused = call(&mut import(root, "a")).expect(1);
    assert!(
        refused
            .err
            .contains("catalog.sqlite-wal holds changes of a catalog that is not there"),
        "{}",
        refused.err
    );
    assert!(log.exists());
    std::fs::remove_file(&log).expect("removed");
    call(&mut import(root, "a")).expect(0);
}
