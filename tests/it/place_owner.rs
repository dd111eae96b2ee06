//! A place of artifacts belongs to one catalog: copies, restored backups and linked folders do not remove files of the
//! original.

use std::path::Path;

use mocban::store::Project;

use crate::check::{at, below, done};
use crate::cli::mocban;
use crate::made_once::copy_folder;

/// The commands that write or remove artifacts.
const CHANGING: [&[&str]; 4] = [
    &["run", "--rerun", "all"],
    &["plan"],
    &["check", "--repair"],
    &["check", "--collect=1"],
];

#[track_caller]
fn assert_refused(project: &Project, owner: &Project) {
    let before = below(&owner.artifacts_dir());
    for args in CHANGING {
        let refused = at(project, args).expect(2);
        let name = owner.catalog_path();
        let name = name.canonicalize().expect("a path");
        assert!(
            refused.err.contains(&*name.to_string_lossy()),
            "{}",
            refused.err
        );
        assert!(refused.err.contains("check --take-over"), "{}", refused.err);
    }
    // Reading only warns.
    let read = at(project, &["check", "--quick"]);
    assert!(read.err.contains("warning: "), "{}", read.err);
    assert!(below(&owner.artifacts_dir()) == before, "files changed");
    at(owner, &["check"]).expect(0);
}

#[cfg(unix)]
fn link_artifacts(project: &Project, of: &Project) {
    let own = project.artifacts_dir();
    if own.exists() {
        std::fs::remove_dir_all(&own).expect("removed");
    }
    std::os::unix::fs::symlink(of.artifacts_dir(), &own).expect("a link");
}

fn open(path: &Path) -> Project {
    Project::open(path).expect("a project")
}

#[cfg(unix)]
#[test]
fn a_restored_backup_that_shares_the_folder_of_the_original_is_refused_until_it_takes_over() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let original = done(dir.path());
    at(&original, &["check", "--repair"]).expect(0);
    mocban(original.dir(), &["backup", "../b.sqlite"]).expect(0);
    mocban(dir.path(), &["restore", "b.sqlite", "restored"]).expect(0);
    let restored = open(&dir.path().join("restored"));
    copy_folder(&original.dir().join("data"), &restored.dir().join("data"));
    link_artifacts(&restored, &original);
    assert_refused(&restored, &original);
    // The original is given up.
    let taken = at(&restored, &["check", "--take-over"]).expect(0);
    assert!(
        taken.err.contains("now belongs to this catalog"),
        "{}",
        taken.err
    );
    at(&restored, &["run"]).expect(0);
    let refused = at(&original, &["check", "--repair"]).expect(2);
    assert!(refused.err.contains("restored"), "{}", refused.err);
    std::fs::remove_dir_all(restored.dir()).expect("removed");
    // Nothing uses the folder any more but the original.
    at(&original, &["check", "--repair"]).expect(0);
}

#[cfg(unix)]
#[test]
fn a_copied_project_folder_has_a_place_of_its_own_unless_its_artifacts_are_a_link() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let original = done(dir.path());
    let copied = dir.path().join("copy");
    copy_folder(original.dir(), &copied);
    let copied = open(&copied);
    at(&original, &["check", "--repair"]).expect(0);
    for project in [&copied, &original, &copied] {
        let ended = at(project, &["run"]).expect(0);
        assert!(!ended.err.contains("warning"), "{}", ended.err);
        at(project, &["check", "--repair"]).expect(0);
    }
    link_artifacts(&copied, &original);
    assert_refused(&copied, &original);
}

#[test]
fn a_moved_project_and_a_moved_folder_of_artifacts_go_on() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let original = done(dir.path());
    at(&original, &["check", "--repair"]).expect(0);
    let moved = dir.path().join("moved");
    std::fs::rename(original.dir(), &moved).expect("moved");
    let moved = open(&moved);
    let ended = at(&moved, &["check", "--repair"]).expect(0);
    assert!(!ended.err.contains("warning"), "{}", ended.err);
    // A catalog copied by `copy`, to which the folder is moved.
    let copied = mocban(dir.path(), &["copy", "moved", "other"]).expect(0);
    let next = copied.next();
    assert!(
        next.len() == 1 && next[0].ends_with(" -C other status"),
        "{next:?}"
    );
    let other = open(&dir.path().join("other"));
    copy_folder(&moved.dir().join("data"), &other.dir().join("data"));
    std::fs::rename(moved.artifacts_dir(), other.artifacts_dir()).expect("moved");
    let taken = at(&other, &["check", "--repair"]).expect(0);
    assert!(
        taken.err.contains("does not use it any more"),
        "{}",
        taken.err
    );
    assert!(!at(&other, &["check"]).expect(0).err.contains("warning"));
}

/// The note was lost, or the folder is that of a project whose catalog is gone.
#[test]
fn a_folder_without_an_owner_is_taken_if_it_holds_results_of_the_catalog() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let note = project.artifacts_dir().join("owner.json");
    std::fs::remove_file(&note).expect("a note");
    at(&project, &["check", "--repair"]).expect(0);
    assert!(note.exists());
    let demo = ["demo", "new", "--pairs", "1", "--no-run"];
    mocban(dir.path(), &demo).expect(0);
    let new = open(&dir.path().join("new"));
    copy_folder(&project.artifacts_dir(), &new.artifacts_dir());
    std::fs::remove_file(new.artifacts_dir().join("owner.json")).expect("a note");
    let refused = at(&new, &["check", "--repair"]).expect(2);
    assert!(
        refused
            .err
            .contains("holds results, but none of this catalog"),
        "{}",
        refused.err
    );
    std::fs::write(new.artifacts_dir().join("owner.json"), "{}").expect("written");
    let refused = at(&new, &["run"]).expect(2);
    assert!(
        refused.err.contains("owner.json does not name"),
        "{}",
        refused.err
    );
    at(&new, &["check", "--take-over"]).expect(0);
    at(&new, &["check", "--repair"]).expect(0);
}
