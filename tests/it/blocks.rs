//! Whole blocks on the command line: import, status, show, retry, check and backup.

use std::fs;
use std::path::Path;

use mocban::mesh::write::MeshFormat;
use mocban::mesh::{self, MeshLimits};
use serde_json::Value;

use crate::cli::{Call, mocban};
use crate::small_block::{demo_block, demo_page, few_labels, few_labels_with};

/// A file that is a mesh of one triangle, which no page belongs to.
const TRIANGLE: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 300 0 0\nvertex 0 200 0\nendloop\nendfacet\nendsolid a\n";

/// Writes the files of some blocks, and a list of them.
pub(crate) fn write_blocks(dir: &Path, names: &[&str]) {
    let mut list = "block,mesh,page,labels,unit,side\n".to_owned();
    for name in names {
        fs::write(dir.join(format!("{name}.stl")), TRIANGLE).expect("written");
        fs::write(dir.join(format!("{name}.png")), "no image").expect("written");
        list.extend([name, ",", name, ".stl,", name, ".png,,mm,front\n"]);
    }
    fs::write(dir.join("blocks.csv"), list).expect("written");
}

fn project(dir: &Path, args: &[&str]) -> Call {
    mocban(dir, &[&["-C", "project"], args].concat())
}

#[test]
fn one_block_and_a_list_are_imported_and_an_import_is_idempotent() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_blocks(dir.path(), &["b1", "b2"]);
    let import = [
        "import", "--block", "b1.stl", "--page", "b1.png", "--unit", "mm", "--json",
    ];
    let first = project(dir.path(), &import).expect(0).json();
    assert_eq!(first["blocks"]["added"], 1);
    let list = project(dir.path(), &["import", "blocks.csv", "--json"])
        .expect(0)
        .json();
    assert_eq!(list["blocks"]["added"], 1);
    assert_eq!(list["blocks"]["changed"][0]["id"], "b1");
    assert_eq!(list["blocks"]["changed"][0]["fields"][0], "side");
    let again = project(dir.path(), &["import", "blocks.csv"]).expect(0);
    assert!(
        again.err.contains("0 blocks added, 0 changed, 2 unchanged"),
        "{}",
        again.err
    );
    let named = [
        "import", "--block", "b1.stl", "--page", "b1.png", "--name", "Kiều 1",
    ];
    project(dir.path(), &named).expect(0);
    let status = project(dir.path(), &["status", "--json"]).expect(0).json();
    assert_eq!(status["blocks"]["total"], 3);
    assert_eq!(status["blocks"]["jobs"]["ready"], 3);
    let text = project(dir.path(), &["status"]).expect(0);
    assert!(
        text.out.contains("blocks       3 blocks · 3 waiting"),
        "{}",
        text.out
    );
    assert!(
        text.next().iter().any(|next| next.ends_with("run")),
        "{}",
        text.err
    );
}

#[test]
fn a_list_with_a_wrong_column_or_a_missing_file_imports_nothing() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_blocks(dir.path(), &["b1"]);
    for (list, expected) in [
        (
            "block,mesh,pages,labels\nb1,b1.stl,b1.png,\n",
            "rename \"pages\" to \"page\"",
        ),
        (
            "block,mesh,page\nb1,b1.stl,gone.png\n",
            "page gone.png of b1 does not exist",
        ),
    ] {
        fs::write(dir.path().join("list.csv"), list).expect("written");
        let refused = project(dir.path(), &["import", "list.csv"]).expect(2);
        assert!(refused.err.contains(expected), "{}", refused.err);
    }
    let missing = ["import", "--block", "gone.stl", "--page", "b1.png"];
    let refused = project(dir.path(), &missing).expect(2);
    assert!(
        refused.err.contains("mesh gone.stl of gone does not exist"),
        "{}",
        refused.err
    );
    let alone = project(dir.path(), &["import", "--block", "b1.stl"]).expect(2);
    assert!(alone.err.contains("--page"), "{}", alone.err);
    assert!(!dir.path().join("project").exists());
    let list = "block,mesh,page,lables\nb1,b1.stl,b1.png,b1.json\n";
    fs::write(dir.path().join("list.csv"), list).expect("written");
    let imported = project(dir.path(), &["import", "list.csv"]).expect(0);
    let warning = "column \"lables\" is kept as metadata; rename it to \"labels\" if it is meant, and import again";
    assert!(imported.err.contains(warning), "{}", imported.err);
}

#[test]
fn a_refused_block_is_named_by_run_status_show_and_retry() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_blocks(dir.path(), &["b1"]);
    project(dir.path(), &["import", "blocks.csv"]).expect(0);
    let sheet = project(dir.path(), &["contact-sheet", "b1"]).expect(4);
    let reason = "block b1 has no pairs yet";
    assert!(sheet.err.contains(reason), "{}", sheet.err);
    let plan = project(dir.path(), &["run", "--dry-run", "--json"])
        .expect(0)
        .json();
    assert_eq!(plan["blocks"][0]["block"], "b1");
    assert_eq!(plan["blocks"][0]["why"], "new");
    let run = project(dir.path(), &["run", "--json"]).expect(3).json();
    assert_eq!(run["blocks"]["failed"], 1);
    let status = project(dir.path(), &["status", "--json"]).expect(0).json();
    let failure = &status["blocks"]["failures"][0];
    assert_eq!(failure["block"], "b1");
    let sentence = failure["error"].as_str().expect("a sentence").to_owned();
    assert!(sentence.contains("b1."), "{sentence}");
    let text = project(dir.path(), &["status"]).expect(0);
    assert!(text.out.contains(&sentence), "{}", text.out);
    let shown = project(dir.path(), &["show", "b1"]).expect(0);
    assert!(shown.out.contains(&sentence), "{}", shown.out);
    assert_eq!(shown.next().len(), 1);
    let json = project(dir.path(), &["show", "b1", "--json"])
        .expect(0)
        .json();
    assert_eq!(json["status"], "quarantined");
    assert_eq!(json["name"], "b1");
    // Nothing changed, so the next run does not try again.
    let again = project(dir.path(), &["run", "--json"]).expect(3).json();
    assert_eq!(
        (
            &again["blocks"]["failed"],
            &again["blocks"]["failed_in_all"]
        ),
        (&0.into(), &1.into())
    );
    let retried = project(dir.path(), &["retry", "b1"]).expect(0);
    assert!(
        retried.err.contains("1 block will run again"),
        "{}",
        retried.err
    );
    project(dir.path(), &["retry", "b2"]).expect(4);
    let run = project(dir.path(), &["run", "--json"]).expect(3).json();
    assert_eq!(run["blocks"]["failed"], 1);
    // There is nothing to keep of a block without pairs.
    let retired = project(dir.path(), &["retire", "b1"]).expect(0);
    assert!(
        retired.err.contains("block b1 is removed"),
        "{}",
        retired.err
    );
    assert_eq!(retired.next(), [""; 0]);
    project(dir.path(), &["run"]).expect(0);
    project(dir.path(), &["check"]).expect(0);
    project(dir.path(), &["show", "b1"]).expect(4);
    let again = project(dir.path(), &["import", "blocks.csv", "--json"]).expect(0);
    assert_eq!(again.json()["blocks"]["added"], 1);
}

#[test]
fn a_block_whose_missing_file_is_back_runs_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_blocks(dir.path(), &["b1"]);
    let (mesh, away) = (dir.path().join("b1.stl"), dir.path().join("away"));
    fs::rename(&mesh, &away).expect("moved");
    project(dir.path(), &["import", "blocks.csv", "--allow-missing"]).expect(0);
    let failed_now = || {
        let run = project(dir.path(), &["run", "--json"]).expect(3).json();
        run["blocks"]["failed"].as_u64()
    };
    let error = || {
        let status = project(dir.path(), &["status", "--json"]).expect(0).json();
        status["blocks"]["failures"][0]["error"].to_string()
    };
    assert_eq!([failed_now(), failed_now()], [Some(1), Some(0)]);
    assert!(error().contains("is not there"), "{}", error());
    fs::create_dir(&mesh).expect("a folder in place of the file");
    project(dir.path(), &["retry", "b1"]).expect(0);
    assert_eq!([failed_now(), failed_now()], [Some(1), Some(0)]);
    assert!(error().contains("is a directory"), "{}", error());
    fs::remove_dir(&mesh).expect("removed");
    fs::rename(&away, &mesh).expect("moved back");
    assert_eq!(failed_now(), Some(1));
    assert!(!error().contains("is not there"), "{}", error());
}

#[test]
fn a_backup_holds_blocks_and_finds_their_files_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_blocks(dir.path(), &["b1"]);
    project(dir.path(), &["import", "blocks.csv"]).expect(0);
    project(dir.path(), &["run"]).expect(3);
    project(dir.path(), &["check"]).expect(0);
    project(dir.path(), &["backup", "copy.sqlite"]).expect(0);
    fs::create_dir(dir.path().join("moved")).expect("a folder");
    for file in ["b1.stl", "b1.png"] {
        fs::rename(dir.path().join(file), dir.path().join("moved").join(file)).expect("moved");
    }
    let restore = ["restore", "copy.sqlite", "restored", "--inputs", "moved"];
    mocban(dir.path(), &restore).expect(0);
    let shown = mocban(dir.path(), &["-C", "restored", "show", "b1", "--json"]);
    let shown = shown.expect(0).json();
    let mesh = shown["mesh_path"].as_str().expect("a path");
    assert!(mesh.ends_with("moved/b1.stl"), "{mesh}");
    assert!(shown["failure"]["class"].is_string());
    // Artifacts are not in a backup, so the next run computes the stages again.
    mocban(
        dir.path(),
        &["-C", "restored", "check", "--repair", "--accept-missing"],
    )
    .expect(0);
    mocban(dir.path(), &["-C", "restored", "check"]).expect(0);
}

/// Runs a project, and returns the exported lines of its pairs without the times.
fn exported(dir: &Path, project: &str) -> Vec<Value> {
    mocban(dir, &["-C", project, "run", "-j", "2"]).expect(0);
    let folder = format!("{project}-export");
    mocban(
        dir,
        &["-C", project, "export", "--to", "jsonl", "-o", &folder],
    )
    .expect(0);
    let lines = fs::read_to_string(dir.join(folder).join("pairs.jsonl")).expect("the lines");
    let lines = lines.lines().map(|line| {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        line["seconds"] = Value::Null;
        line
    });
    lines.collect()
}

#[test]
fn boxes_that_are_left_out_are_told_by_run_and_kept_in_show() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    demo_block(dir);
    few_labels_with(dir, &dir.join("bad.json"), |few| {
        few[1] = few[0].clone();
        few[1]["region_attributes"] = serde_json::json!({});
        few[2]["shape_attributes"]["width"] = 0.into();
    });
    let files = ["--block", "d/data/block.ply", "--page", "d/data/page.jpg"];
    let labels = ["--labels", "bad.json", "--name", "b", "--unit", "mm"];
    project(dir, &[&["import"], &files[..], &labels].concat()).expect(0);
    let run = project(dir, &["run", "-q"]).expect(0);
    let shown = project(dir, &["show", "b"]).expect(0);
    let json = project(dir, &["show", "b", "--json"]).expect(0).json();
    let warnings = json["warnings"].as_array().expect("a list");
    assert_eq!(warnings.len(), 2, "{json}");
    for (warning, part) in warnings
        .iter()
        .zip(["smaller than a pixel", "repeats another"])
    {
        let warning = warning.as_str().expect("a text");
        assert!(warning.contains(part), "{warning}");
        assert!(
            run.err.contains(&format!("warning: block b: {warning}")),
            "{}",
            run.err
        );
        assert!(shown.out.contains(warning), "{}", shown.out);
    }
    let size = " px/mm: characters of about ";
    assert!(shown.out.contains(size), "{}", shown.out);
}

#[test]
fn replaced_labels_give_the_results_of_a_new_import() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    demo_block(dir);
    let moved = |few: &mut [Value]| {
        let x = &mut few[0]["shape_attributes"]["x"];
        *x = (x.as_i64().expect("pixels") + 4).into();
    };
    few_labels(dir, &dir.join("first.json"));
    few_labels_with(dir, &dir.join("moved.json"), moved);
    let import = |project: &str, labels: &str| {
        let files = ["--block", "d/data/block.ply", "--page", "d/data/page.jpg"];
        let labels = ["--labels", labels, "--name", "b", "--unit", "mm"];
        mocban(
            dir,
            &[&["-C", project, "import"], &files[..], &labels].concat(),
        )
        .expect(0)
    };
    import("p", "first.json");
    let first = exported(dir, "p");
    import("p", "moved.json");
    let replaced = exported(dir, "p");
    import("new", "moved.json");
    assert!(replaced == exported(dir, "new"));
    import("p", "first.json");
    assert!(first == exported(dir, "p"));
    assert!(first != replaced);
}

#[test]
fn doubts_about_the_unit_and_the_colours_of_a_block_are_told_by_run_and_kept() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    // A small block would be too short for a block in this unit.
    demo_page(dir);
    few_labels(dir, &dir.join("few.json"));
    let bytes = fs::read(dir.join("d/data/block.ply")).expect("the scan");
    let mesh = mesh::read(&bytes, "block.ply", &MeshLimits::SUGGESTED);
    let mut mesh = mesh.expect("a mesh");
    let scaled = mesh.vertices.iter().map(|vertex| vertex.map(|x| 0.2 * x));
    mesh.vertices = scaled.collect();
    fs::write(
        dir.join("block.ply"),
        MeshFormat::PlyLittleEndian.encode(&mesh),
    )
    .expect("written");
    let page = fs::read(dir.join("d/data/page.jpg")).expect("the page");
    let profile = b"\xff\xe2\0\x1aICC_PROFILE\0\x01\x01no profile";
    let (start, rest) = page.split_at(2);
    fs::write(dir.join("page.jpg"), [start, profile, rest].concat()).expect("written");
    let files = ["--block", "block.ply", "--page", "page.jpg"];
    let labels = ["--labels", "few.json", "--name", "b1", "--unit", "mm"];
    project(dir, &[&["import"], &files[..], &labels].concat()).expect(0);
    let run = project(dir, &["--progress", "none", "run", "--stage", "fit"]).expect(0);
    let doubt = " mm, but most have 6 to 30 mm; is the unit cm?";
    let profile =
        "the image's colour profile (an ICC profile that cannot be read) cannot be applied";
    let shown = project(dir, &["show", "b1", "--json"]).expect(0).json();
    for warning in [doubt, profile] {
        assert_eq!(run.err.matches(warning).count(), 1, "{}", run.err);
        assert!(shown["warnings"].to_string().contains(warning), "{shown}");
    }
    let status = project(dir, &["status", "--json"]).expect(0).json();
    assert_eq!(status["ignored_profiles"]["blocks"]["id"], "b1", "{status}");
}

/// A scan of a block is read without its vertices that have no position and its faces that have two corners, and says so.
#[test]
fn what_is_left_out_of_the_scan_of_a_block_is_told_by_run_and_kept() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    demo_block(dir);
    few_labels(dir, &dir.join("few.json"));
    let bytes = fs::read(dir.join("d/data/block.ply")).expect("the scan");
    let mesh = mesh::read(&bytes, "block.ply", &MeshLimits::SUGGESTED);
    let mut mesh = mesh.expect("a mesh");
    mesh.vertices.extend([[f64::NAN; 3]; 3]);
    let faces = |number: usize| format!("element face {number}\n");
    let text = String::from_utf8(MeshFormat::PlyAscii.encode(&mesh)).expect("text");
    let count = mesh.triangles.len();
    let text = text.replace(&faces(count), &faces(count + 2)) + "2 0 1\n2 1 2\n";
    fs::write(dir.join("block.ply"), text).expect("written");
    let import = [
        "import",
        "--block",
        "block.ply",
        "--page",
        "d/data/page.jpg",
        "--labels",
        "few.json",
        "--name",
        "b1",
    ];
    project(dir, &import).expect(0);
    let run = project(dir, &["--progress", "none", "run"]).expect(0);
    for sentence in [
        "vertices without a position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside) were left out with their faces: 3",
        "faces with fewer than three corners were left out: 2",
    ] {
        assert_eq!(run.err.matches(sentence).count(), 1, "{}", run.err);
        let shown = project(dir, &["show", "b1"]).expect(0).out;
        assert!(shown.contains(sentence), "{shown}");
    }
    let shown = project(dir, &["show", "b1", "--json"]).expect(0).json();
    let outcome = &shown["stages"][0]["outcome"];
    assert_eq!(
        (&outcome["missing_vertices"], &outcome["incomplete_faces"]),
        (&3.into(), &2.into()),
        "{outcome}"
    );
}
