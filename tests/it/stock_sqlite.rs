//! Catalogs opened with the SQLite of the system, which may be older than the one that is compiled in.

use std::process::{Command, Output};

use mocban::store::Project;

use crate::check::{done, sql};
use crate::skipped::say_skipped;

/// A block of which every column that may be NULL is NULL.
const BLOCK: &str = "
INSERT INTO block (id, name, mesh_path, page_path, meta, attributes, imported) VALUES (1, 'b', 'b.stl', 'b.jpg', '{}', '{}', 1);
INSERT INTO block_job (block, stage, status) VALUES (1, 0, 0);
INSERT INTO block_character (block, label, place, box, state) VALUES (1, 'a', 0, '[]', 'left');
INSERT INTO worker (host, pid, started, heartbeat) VALUES ('h', 1, 1, 1);";

/// Runs SQLite's check with Python's module or the program `sqlite3`. Returns `None` if neither is installed.
fn integrity_check(project: &Project) -> Option<Output> {
    let script = "import sqlite3, sys; \
        [print(*row) for row in sqlite3.connect(sys.argv[1]).execute('PRAGMA integrity_check')]";
    let mut python = Command::new("python3");
    let mut program = Command::new("sqlite3");
    python.args(["-c", script]).arg(project.catalog_path());
    program
        .arg(project.catalog_path())
        .arg("PRAGMA integrity_check");
    [python, program]
        .iter_mut()
        .find_map(|command| command.output().ok().filter(|found| found.status.success()))
}

#[test]
fn an_older_sqlite_finds_no_fault_in_a_sound_catalog() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    sql(&project, BLOCK);
    let Some(found) = integrity_check(&project) else {
        return say_skipped(
            "neither python3 nor sqlite3 is installed, so no other SQLite reads a catalog",
        );
    };
    assert_eq!(String::from_utf8_lossy(&found.stdout), "ok\n");
}
