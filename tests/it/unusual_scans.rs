//! Scans in which points are missing, in files that other programs wrote.

use std::path::{Path, PathBuf};

use mocban::mesh::write::MeshFormat;
use mocban::mesh::{Mesh, MeshLimits, read};

use crate::cli::{empty, mocban};

/// Returns the only scan of a demo.
fn scan(data: &Path) -> PathBuf {
    let files = std::fs::read_dir(data.join("meshes")).expect("a folder");
    files
        .map(|file| file.expect("an entry").path())
        .next()
        .expect("a scan")
}

/// Points that the scanner did not measure change no result, and the user learns of them.
#[test]
fn missing_points_are_counted_in_the_log_and_by_show() {
    let dir = empty();
    let at = |args: &[&str]| {
        mocban(
            dir.path(),
            &[&["-C", "demo", "--progress", "none"], args].concat(),
        )
    };
    mocban(dir.path(), &["demo", "demo", "--pairs", "1"]).expect(0);
    let scores = || {
        let shown = at(&["show", "upright-0000", "--json"]).expect(0).json();
        shown["metrics"][2]["scores"].clone()
    };
    let usual = scores();
    assert!(usual["iou"].as_f64().expect("a score") > 0.5, "{usual}");
    let path = scan(&dir.path().join("demo/data"));
    let name = path.file_name().expect("a name").to_str().expect("UTF-8");
    let bytes = std::fs::read(&path).expect("read");
    let mut mesh: Mesh = read(&bytes, name, &MeshLimits::SUGGESTED)
        .expect("a mesh")
        .welded();
    mesh.vertices.extend([[f64::NAN; 3], [0.0; 3], [0.0; 3]]);
    let format = MeshFormat::PlyLittleEndian;
    std::fs::write(&path, format.encode(&mesh)).expect("written");
    let sentence = "vertices without a position (NaN, infinite or repeated 0 0 0) were left out with their faces: 3";
    let run = at(&["run"]).expect(0);
    let warned = run
        .err
        .lines()
        .filter(|line| line.contains(sentence) && line.contains(name));
    assert_eq!(warned.count(), 1, "{}", run.err);
    assert!(
        at(&["show", "upright-0000"])
            .expect(0)
            .out
            .contains(sentence)
    );
    let of_welded = scores();
    let iou = |scores: &serde_json::Value| scores["iou"].as_f64().expect("a score");
    assert!(
        (iou(&of_welded) - iou(&usual)).abs() < 0.02,
        "{of_welded} {usual}"
    );
}
