//! `backup --with-inputs` through the real binary: scans and prints beside the backup, whatever happens to it, and the project
//! that is restored from them.

use std::collections::BTreeSet;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mocban::store::Project;
use serde_json::Value;

use crate::app_kills::UNTIL_KILLED;
use crate::backup::files as names;
use crate::check::{at, done};
use crate::cli::{Call, binary, call, mocban};
use crate::fault::{ENOSPC, Fault};
use crate::lab::Lab;
use crate::uninterrupted::files;
use crate::waiting::until;

/// Where copies are written before they have their names.
const STAGED: &str = "b.sqlite.inputs/.mocban-inputs.json.*/new";
/// Number of inputs of the demo project.
const DEMO_FILES: u64 = 4;

fn command(root: &Path) -> Command {
    let mut command = binary();
    command
        .arg("-C")
        .arg(root.join("p"))
        .args(["backup", "--with-inputs", "--json"])
        .arg(root.join("b.sqlite"));
    command
}

fn backup(root: &Path) -> Call {
    call(&mut command(root))
}

/// Restores the backup to the folder `q`.
fn restore(root: &Path) -> Value {
    let args = ["restore", "b.sqlite", "q", "--json"];
    mocban(root, &args).expect(0).json()
}

/// Returns the root of a temporary directory as the fault library sees it.
fn root_of(dir: &tempfile::TempDir) -> PathBuf {
    dir.path().canonicalize().expect("a path")
}

/// Adds pairs whose files are outside the project, with names that differ only in upper and lower case. No run has read them.
fn with_outside_pairs(root: &Path) -> Project {
    let project = done(root);
    let mut list = "id,mesh,print\n".to_owned();
    for (id, folder, demo) in [
        ("a", "Ván 1", "upright-0000"),
        ("b", "VÁN 1", "upright-0001"),
    ] {
        let folder = root.join("bản quét").join(folder);
        std::fs::create_dir_all(&folder).expect("a folder");
        let [mesh, print] = ["ply", "jpg"].map(|extension| {
            let kind = if extension == "ply" {
                "meshes"
            } else {
                "prints"
            };
            let from = format!("data/{kind}/{demo}.{extension}");
            let to = folder.join(format!("chữ.{extension}"));
            std::fs::copy(project.dir().join(from), &to).expect("copied");
            to.display().to_string()
        });
        list.extend([id, ",", &mesh, ",", &print, "\n"]);
    }
    let file = root.join("more.csv");
    std::fs::write(&file, list).expect("written");
    at(&project, &["import", file.to_str().expect("UTF-8")]).expect(0);
    project
}

#[test]
fn a_restored_project_needs_neither_the_old_project_nor_the_backup() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    let project = with_outside_pairs(&root);
    let saved = &backup(&root).expect(0).json()["inputs"];
    assert_eq!((&saved["files"], &saved["copied"]), (&8.into(), &8.into()));
    assert_eq!(saved["left_out"], 0);
    let again = &backup(&root).expect(0).json()["inputs"];
    assert_eq!((&again["files"], &again["copied"]), (&8.into(), &0.into()));
    let copies = files(&root.join("b.sqlite.inputs"));
    let lower = copies
        .keys()
        .map(|path| path.to_string_lossy().to_lowercase());
    assert_eq!(
        lower.collect::<BTreeSet<_>>().len(),
        9,
        "{:?}",
        copies.keys()
    );
    let is_named = |name: &str| copies.keys().any(|path| path.ends_with(name));
    assert!(is_named("Ván 1/chữ.ply") && is_named("VÁN 1 (2)/chữ.ply"));

    std::fs::remove_dir_all(project.dir()).expect("removed");
    std::fs::remove_dir_all(root.join("bản quét")).expect("removed");
    let told = mocban(&root, &["restore", "b.sqlite", "q"]).expect(0);
    let says = "copied from b.sqlite.inputs to q/inputs";
    assert!(told.err.contains(says), "{}", told.err);
    std::fs::remove_dir_all(root.join("b.sqlite.inputs")).expect("removed");
    let restored = Project::open(&root.join("q")).expect("a project");
    at(&restored, &["check", "--repair", "--accept-missing"]).expect(0);
    at(&restored, &["run"]).expect(0);
    at(&restored, &["check"]).expect(0);
    let status = at(&restored, &["status", "--json"]).expect(0).json();
    assert_eq!(status["pairs"], 4);
    assert_eq!(status["verdicts"]["pass"], 4);
}

#[test]
fn a_changed_and_a_missing_input_are_named_and_the_others_are_saved() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    let project = done(&root);
    let mesh = project.dir().join("data/meshes/upright-0000.ply");
    let whole = std::fs::read(&mesh).expect("read");
    std::fs::write(&mesh, "another scan").expect("written");
    std::fs::remove_file(project.dir().join("data/prints/upright-0001.jpg")).expect("removed");
    let told = backup(&root).expect(3);
    for part in [
        "2 inputs not saved",
        "upright-0000.ply has changed since it was read",
        "upright-0001.jpg is missing",
    ] {
        assert!(told.err.contains(part), "{part}: {}", told.err);
    }
    let saved = &told.json()["inputs"];
    assert_eq!(
        (&saved["files"], &saved["left_out"]),
        (&2.into(), &2.into())
    );
    assert_eq!(saved["first_left_out"][0]["reason"], "changed");
    let restored = restore(&root);
    assert_eq!(restored["inputs_copied"], 2);
    assert_eq!(restored["inputs_missing"], 2);

    // What was saved of a file stays if the file is changed later.
    std::fs::write(&mesh, &whole).expect("written");
    backup(&root).expect(3);
    std::fs::write(&mesh, "another scan").expect("written");
    let told = backup(&root).expect(3);
    assert_eq!(told.json()["inputs"]["files"], 3);
    let copy = root.join("b.sqlite.inputs/data/meshes/upright-0000.ply");
    assert!(std::fs::read(copy).expect("read") == whole);
}

#[test]
fn a_place_of_something_else_is_refused_before_the_backup_is_written() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    done(&root);
    let folder = root.join("b.sqlite.inputs");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::write(folder.join("thesis.docx"), "ten years").expect("written");
    let refused = backup(&root).expect(2);
    let says = "is not a folder of scans and prints of a backup";
    assert!(refused.err.contains(says), "{}", refused.err);
    assert_eq!(names(&root), ["b.sqlite.inputs", "p"]);
    std::fs::remove_dir_all(&folder).expect("removed");
    std::fs::write(&folder, "ten years").expect("written");
    let refused = backup(&root).expect(2);
    assert!(refused.err.contains("is a file"), "{}", refused.err);
    assert_eq!(names(&root), ["b.sqlite.inputs", "p"]);
}

/// Asserts that the next backup saves all inputs and leaves nothing else.
fn assert_completed(root: &Path) {
    let saved = &backup(root).expect(0).json()["inputs"];
    assert_eq!(saved["files"], DEMO_FILES);
    assert_eq!(names(root), ["b.sqlite", "b.sqlite.inputs", "p"]);
    let entries = names(&root.join("b.sqlite.inputs"));
    assert_eq!(entries, ["data", "mocban-inputs.json"]);
    let (copies, inputs) = (
        files(&root.join("b.sqlite.inputs/data")),
        files(&root.join("p/data")),
    );
    assert_eq!(copies.len() as u64, DEMO_FILES);
    let is_equal = |(name, bytes): (&PathBuf, &Vec<u8>)| inputs.get(name) == Some(bytes);
    assert!(copies.iter().all(is_equal));
    assert_eq!(restore(root)["inputs_copied"], DEMO_FILES);
}

#[test]
fn a_killed_backup_is_completed_by_the_next_one() {
    for (call, path, nth) in [
        ("write", STAGED, 2),
        ("write", STAGED, 4),
        ("rename", "b.sqlite.inputs/data/*", 2),
        ("rename", "b.sqlite.inputs/mocban-inputs.json", 2),
    ] {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (root, notes) = (
            root_of(&dir),
            tempfile::tempdir().expect("a temporary directory"),
        );
        done(&root);
        let mut held = command(&root);
        let fault = Fault::slow(call, path, UNTIL_KILLED);
        fault.inject(nth, &root, notes.path(), &mut held);
        let held = held.stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = held.spawn().expect("the binary starts");
        until(&mut child, || Fault::injected(notes.path()) > 0);
        child.kill().expect("killed");
        child.wait().expect("a child");
        // The backup itself is whole.
        mocban(&root, &["restore", "b.sqlite", "early"]).expect(0);
        std::fs::remove_dir_all(root.join("early")).expect("removed");
        assert_completed(&root);
    }
}

#[test]
fn a_full_disk_costs_no_backup() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (root, notes) = (
        root_of(&dir),
        tempfile::tempdir().expect("a temporary directory"),
    );
    done(&root);
    let mut full = command(&root);
    let fault = Fault::once("write", STAGED, ENOSPC).and_later();
    // The first file is the list of an empty folder.
    fault.inject(2, &root, notes.path(), &mut full);
    let told = call(&mut full).expect(1);
    let says = "is complete, but not its scans and prints";
    assert!(told.err.contains(says), "{}", told.err);
    assert!(Fault::injected(notes.path()) > 0);
    assert_completed(&root);
}

#[test]
fn a_full_disk_leaves_no_half_of_a_restored_project() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (root, notes) = (
        root_of(&dir),
        tempfile::tempdir().expect("a temporary directory"),
    );
    done(&root);
    backup(&root).expect(0);
    let mut full = binary();
    full.arg("restore")
        .args([root.join("b.sqlite"), root.join("q")]);
    let fault = Fault::once("write", "q/.new.*/new/*", ENOSPC).and_later();
    fault.inject(1, &root, notes.path(), &mut full);
    call(&mut full).expect(1);
    assert!(Fault::injected(notes.path()) > 0);
    assert!(!root.join("q").exists(), "nothing is left");
    assert_eq!(restore(&root)["inputs_copied"], DEMO_FILES);
}

#[test]
fn a_damaged_copy_is_not_restored() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    done(&root);
    backup(&root).expect(0);
    let copies = root.join("b.sqlite.inputs/data");
    std::fs::write(copies.join("meshes/upright-0000.ply"), "damaged").expect("written");
    std::fs::remove_file(copies.join("meshes/upright-0001.ply")).expect("removed");
    let restored = restore(&root);
    assert_eq!(restored["inputs_copied"], 2);
    assert_eq!(restored["inputs_missing"], 2);
    // So is a damaged list.
    std::fs::write(root.join("b.sqlite.inputs/mocban-inputs.json"), "{").expect("written");
    let refused = mocban(&root, &["restore", "b.sqlite", "again"]).expect(2);
    assert!(
        refused.err.contains("make the backup again"),
        "{}",
        refused.err
    );
    assert!(!root.join("again").exists());
    std::fs::remove_dir_all(root.join("q")).expect("removed");
    // A backup does not replace it, because it may name the only copies of lost files.
    let refused = backup(&root).expect(2);
    assert!(refused.err.contains("rename the folder"), "{}", refused.err);
    std::fs::remove_dir_all(root.join("b.sqlite.inputs")).expect("removed");
    assert_completed(&root);
}

/// With `--inputs`, files stay where they are.
#[test]
fn the_folder_beside_a_backup_can_be_used_without_copies() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    let project = with_outside_pairs(&root);
    backup(&root).expect(0);
    std::fs::remove_dir_all(project.dir()).expect("removed");
    std::fs::remove_dir_all(root.join("bản quét")).expect("removed");
    let args = ["restore", "b.sqlite", "q", "--inputs", "b.sqlite.inputs"];
    let told = mocban(&root, &[&args[..], &["--json"]].concat()).expect(0);
    assert_eq!(told.json()["inputs_missing"], 0);
    assert_eq!(names(&root.join("q")), ["catalog.sqlite", "mocban.toml"]);
    let restored = Project::open(&root.join("q")).expect("a project");
    at(&restored, &["check", "--repair", "--accept-missing"]).expect(0);
    at(&restored, &["run"]).expect(0);
}

#[test]
fn a_catalog_on_a_server_is_saved_with_its_scans_and_prints() {
    let Some(lab) = Lab::with_roles("2") else {
        return;
    };
    let told = lab.call("guest", "--json backup b.sqlite --with-inputs");
    let saved = &told.expect(0).json()["inputs"];
    assert!(saved["copied"].as_u64() > Some(1), "{saved}");
    assert_eq!(saved["left_out"], 0);
    assert_eq!(restore(lab.path())["inputs_copied"], saved["files"]);
}

#[test]
fn links_in_the_folder_are_refused() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    done(&root);
    backup(&root).expect(0);
    let (copies, elsewhere) = (root.join("b.sqlite.inputs/data"), root.join("elsewhere"));
    let mesh = copies.join("meshes/upright-0000.ply");
    std::fs::remove_file(&mesh).expect("removed");
    symlink(root.join("p/data/meshes/upright-0000.ply"), &mesh).expect("a link");
    let refused = backup(&root).expect(2);
    assert!(refused.err.contains("0.ply is a link"), "{}", refused.err);
    std::fs::remove_file(&mesh).expect("removed");
    std::fs::rename(&copies, &elsewhere).expect("renamed");
    symlink(&elsewhere, &copies).expect("a link");
    let refused = backup(&root).expect(2);
    assert!(refused.err.contains("data is a link"), "{}", refused.err);
    assert!(!elsewhere.join("meshes/upright-0000.ply").exists());
    std::fs::remove_file(&copies).expect("removed");
    std::fs::remove_dir_all(&elsewhere).expect("removed");
    assert_completed(&root);
}

#[test]
fn a_copy_that_cannot_be_written_costs_no_other() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    done(&root);
    let copy = root.join("b.sqlite.inputs/data/meshes/upright-0000.ply");
    backup(&root).expect(0);
    std::fs::remove_dir_all(root.join("b.sqlite.inputs/data")).expect("removed");
    std::fs::create_dir_all(copy.join("mine")).expect("a folder");
    let told = backup(&root).expect(3);
    let says = "upright-0000.ply cannot be written there";
    assert!(told.err.contains(says), "{}", told.err);
    let saved = &told.json()["inputs"];
    assert_eq!(
        (&saved["files"], &saved["left_out"]),
        (&3.into(), &1.into())
    );
    assert_eq!(saved["first_left_out"][0]["reason"], "unwritable");
    assert!(copy.join("mine").is_dir());
    std::fs::remove_dir_all(&copy).expect("removed");
    assert_completed(&root);
}

#[test]
fn a_lost_file_with_a_copy_is_in_later_backups() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let root = root_of(&dir);
    let project = done(&root);
    backup(&root).expect(0);
    std::fs::remove_dir_all(project.dir().join("data/meshes")).expect("removed");
    let saved = &backup(&root).expect(0).json()["inputs"];
    assert_eq!((&saved["files"], &saved["copied"]), (&4.into(), &0.into()));
    assert_eq!(restore(&root)["inputs_copied"], DEMO_FILES);
}

#[test]
fn a_disk_that_fails_costs_no_earlier_copy() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (root, notes) = (
        root_of(&dir),
        tempfile::tempdir().expect("a temporary directory"),
    );
    done(&root);
    backup(&root).expect(0);
    let folder = root.join("b.sqlite.inputs");
    std::fs::write(folder.join("data/meshes/upright-0000.ply"), "damaged").expect("written");
    let mut failing = command(&root);
    Fault::once("write", STAGED, ENOSPC).inject(1, &root, notes.path(), &mut failing);
    call(&mut failing).expect(1);
    assert!(Fault::injected(notes.path()) > 0);
    let list = std::fs::read_to_string(folder.join("mocban-inputs.json")).expect("a list");
    assert_eq!(list.matches("\"stored\"").count() as u64, DEMO_FILES);
    assert_completed(&root);
}
