//! `align`: one pair without a project gives the result and the files that a project gives.

use std::fs;
use std::path::Path;

use image::imageops::FilterType;
use mocban::export::ALIGNMENT_FILES;
use serde_json::Value;

use crate::cli::{Call, empty, mocban};

/// Fields of a result that both `align --json` and the export have.
const NUMBERS: [&str; 7] = [
    "threshold_depth",
    "ssim",
    "nl_ssim",
    "iou",
    "iou_box",
    "dice",
    "confidence",
];

/// Makes a demo project `d` of four pairs of a tier and exports it to `e`.
fn exported(dir: &Path, tier: &str) {
    let demo = ["demo", "d", "--tier", tier, "--pairs", "4"];
    mocban(dir, &demo).expect(0);
    mocban(dir, &["-C", "d", "export", "--to", "jsonl", "-o", "e"]).expect(0);
}

fn align(dir: &Path, line: &Value, more: &[&str]) -> Call {
    let [mesh, print] = ["mesh", "print"].map(|name| {
        let path = line[name].as_str().expect("a path");
        format!("d/{path}")
    });
    let face_down = line["scanned_face_down"]
        .as_bool()
        .map(|down| down.to_string());
    let mut args = vec!["--json", "align", &mesh, &print];
    if let Some(unit) = line["unit"].as_str() {
        args.extend(["--unit", unit]);
    }
    if let Some(face_down) = &face_down {
        args.extend(["--scanned-face-down", face_down]);
    }
    mocban(dir, &[&args, more].concat())
}

#[test]
fn a_pair_alone_gives_the_results_and_files_of_a_project() {
    assert_eq!(levelled_pairs_that_equal_a_project("pose"), 0);
}

#[test]
fn a_pair_alone_is_levelled_as_in_a_project() {
    assert!(levelled_pairs_that_equal_a_project("stitched") > 0);
}

/// Aligns each of four pairs of a tier alone, and compares results and files with those of a project. Returns the number
/// of pairs whose depth map was levelled.
fn levelled_pairs_that_equal_a_project(tier: &str) -> usize {
    let dir = empty();
    exported(dir.path(), tier);
    let lines = crate::export_readback::lines(&dir.path().join("e"));
    let firsts = lines.iter().filter(|line| line["metric"] == "relief");
    let (mut compared, mut levelled) = (0, 0);
    for first in firsts {
        let found = align(dir.path(), first, &["-o", "chữ/kết quả"])
            .expect(0)
            .json();
        assert_eq!(found["status"], "aligned");
        let same = [
            ("rotation_deg", "angle_deg"),
            ("scale", "scale"),
            ("shift_px", "shift_px"),
        ];
        for (ours, theirs) in same {
            assert_eq!(found[ours], first[theirs], "{ours}");
        }
        assert_eq!(found["print_from_mesh"], first["print_from_mesh"]);
        for line in lines.iter().filter(|line| line["id"] == first["id"]) {
            let metric = line["metric"].as_str().expect("a name");
            for name in NUMBERS {
                assert_eq!(
                    found["results"][metric][name], line[name],
                    "{metric} {name}"
                );
            }
        }
        let folder = dir.path().join("chữ/kết quả");
        for file in ALIGNMENT_FILES {
            let name = file.split('.').next().expect("a name");
            let path = match file {
                "depth.json" => first["files"]["depth"]
                    .as_str()
                    .map(|path| path.replace(".png", ".json")),
                _ => first["files"][name].as_str().map(ToOwned::to_owned),
            };
            let theirs =
                fs::read(dir.path().join("e").join(path.expect("a path"))).expect("a file");
            assert!(
                fs::read(folder.join(file)).expect("a file") == theirs,
                "{file}"
            );
        }
        let stored = fs::read_to_string(folder.join("alignment.json")).expect("the numbers");
        assert_eq!(serde_json::from_str::<Value>(&stored).expect("JSON"), found);
        let sidecar = fs::read_to_string(folder.join("depth.json")).expect("the scale");
        levelled += usize::from(sidecar.contains("levelling"));
        compared += 1;
    }
    assert_eq!(compared, 4);
    levelled
}

#[test]
fn a_large_print_is_aligned_like_a_small_one() {
    const TIMES: u32 = 7;
    let dir = empty();
    let demo = ["demo", "d", "--tier", "pose", "--pairs", "1", "--no-run"];
    mocban(dir.path(), &demo).expect(0);
    let (mesh, small) = ("d/data/meshes/pose-0000.stl", "d/data/prints/pose-0000.png");
    let print = image::open(dir.path().join(small))
        .expect("a print")
        .to_luma8();
    let [width, height] = [print.width(), print.height()].map(|side| side * TIMES);
    assert!(width * height > 2000 * 2000, "{width} x {height}");
    let large = image::imageops::resize(&print, width, height, FilterType::CatmullRom);
    large.save(dir.path().join("large.png")).expect("written");
    let align = |print: &str, to: &str| {
        let args = ["align", mesh, print, "--json", "-o", to];
        mocban(dir.path(), &args).expect(0).json()
    };
    let (one, other) = (align(small, "one"), align("large.png", "other"));
    let number = |found: &Value, name: &str| found[name].as_f64().expect("a number");
    let scales = number(&other, "scale") / number(&one, "scale");
    assert!((scales / f64::from(TIMES) - 1.0).abs() < 0.005, "{scales}");
    let turned = number(&other, "rotation_deg") - number(&one, "rotation_deg");
    assert!(turned.abs() < 0.3, "{turned}");
    // The stored masks are smaller than the print; the written ones are not.
    let mask = |of: &str| {
        let path = dir.path().join(of).join("print_mask.png");
        image::open(path).expect("a mask").to_luma8()
    };
    let (one, other) = (mask("one"), mask("other"));
    assert_eq!([other.width(), other.height()], [width, height]);
    let enlarged = image::imageops::resize(&one, width, height, FilterType::Nearest);
    let pixels = other.pixels().zip(enlarged.pixels());
    let (mut both, mut any) = (0, 0);
    for (a, b) in pixels {
        both += u32::from(a[0] > 127 && b[0] > 127);
        any += u32::from(a[0] > 127 || b[0] > 127);
    }
    assert!(f64::from(both) > 0.93 * f64::from(any), "{both} of {any}");
}

#[test]
fn vertices_without_a_position_are_told() {
    let dir = empty();
    exported(dir.path(), "pose");
    let (mesh, print) = ("d/data/meshes/pose-0000.stl", "d/data/prints/pose-0000.png");
    let whole = mocban(dir.path(), &["align", mesh, print, "--json"]).expect(0);
    assert_eq!(
        (whole.json()["warnings"].to_string(), whole.err.as_str()),
        ("[]".into(), "")
    );
    let mut bytes = fs::read(dir.path().join(mesh)).expect("a mesh");
    // The first coordinate of the first triangle.
    bytes[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(dir.path().join("holes.stl"), bytes).expect("a mesh");
    let found = mocban(dir.path(), &["align", "holes.stl", print, "--json"]).expect(0);
    let warning = found.json()["warnings"][0]
        .as_str()
        .expect("a warning")
        .to_owned();
    assert!(warning.starts_with("mesh: "), "{warning}");
    assert!(found.err.contains(&warning), "{}", found.err);
}

#[test]
fn what_is_said_of_a_scan_is_compared_with_what_was_found() {
    let dir = empty();
    mocban(dir.path(), &["demo", "d", "--pairs", "1", "--no-run"]).expect(0);
    let (mesh, print) = (
        "d/data/meshes/upright-0000.ply",
        "d/data/prints/upright-0000.jpg",
    );
    let found = mocban(dir.path(), &["align", mesh, print, "--json"])
        .expect(0)
        .json();
    let is_down = found["side"] == "-z";
    assert!(is_down || found["side"] == "+z", "{}", found["side"]);
    let wrong = (!is_down).to_string();
    let said = ["--unit", "in", "--scanned-face-down", &wrong];
    let args = [&["align", mesh, print, "--json"], &said[..]].concat();
    let warnings = mocban(dir.path(), &args).expect(0).json()["warnings"].to_string();
    let surface = "mm across, but most characters have 6 to 30 mm; is the unit mm?";
    for part in [
        "mm deep, but most blocks",
        "scanned_face_down says",
        surface,
    ] {
        assert!(warnings.contains(part), "{warnings}");
    }
    // Project: the same, when the pair is run and when it is shown.
    let list = format!("id,mesh,print,unit,scanned_face_down\na,{mesh},{print},in,{wrong}\n");
    fs::write(dir.path().join("list.csv"), list).expect("a list");
    mocban(dir.path(), &["-C", "p", "import", "list.csv"]).expect(0);
    let ran = mocban(dir.path(), &["-C", "p", "run"]).expect(0);
    // A warning of the log looks like one of the command.
    let is_warning = |line: &str| line.starts_with("warning: ") && line.ends_with(" (pair a)");
    let mut lines = ran.err.lines();
    let warned = lines.any(|line| line.contains("mm deep, but most blocks") && is_warning(line));
    assert!(warned, "{}", ran.err);
    assert!(ran.err.contains(surface), "{}", ran.err);
    let shown = mocban(dir.path(), &["-C", "p", "show", "a"]).expect(0);
    for part in ["scanned_face_down says", surface] {
        assert!(shown.out.contains(part), "{}", shown.out);
    }
    let shown = mocban(dir.path(), &["-C", "p", "show", "a", "--json"]).expect(0);
    let warnings = shown.json()["warnings"].to_string();
    assert!(warnings.contains(surface), "{warnings}");
}

#[test]
fn the_text_has_the_decimals_of_show() {
    let dir = empty();
    exported(dir.path(), "pose");
    let lines = crate::export_readback::lines(&dir.path().join("e"));
    let [mesh, print] = ["mesh", "print"].map(|name| {
        let path = lines[0][name].as_str().expect("a path");
        format!("d/{path}")
    });
    let text = mocban(dir.path(), &["align", &mesh, &print]).expect(0).out;
    let line = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name));
        line.unwrap_or_default()
    };
    let number = line("confidence").split_whitespace().nth(1);
    let decimals = number.and_then(|number| number.trim_end_matches(':').split_once('.'));
    assert_eq!(decimals.map(|(_, digits)| digits.len()), Some(3), "{text}");
    assert!(line("pose").contains("\u{b0}, shifted by "), "{text}");
}

#[test]
fn a_pair_of_two_characters_is_refused_and_writes_nothing() {
    let dir = empty();
    exported(dir.path(), "pose");
    let (mesh, print) = ("d/data/meshes/pose-0000.stl", "d/data/prints/pose-0001.png");
    let refused = mocban(dir.path(), &["align", mesh, print, "-o", "out"]).expect(3);
    assert!(refused.err.contains("not aligned: "), "{}", refused.err);
    assert!(!dir.path().join("out").exists());
    let json = mocban(dir.path(), &["align", mesh, print, "--json"])
        .expect(3)
        .json();
    assert_eq!(json["status"], "refused");
    assert_eq!(json["refusal"]["code"], "no_solution");
    let damaged = ["align", mesh, "d/data/manifest.csv", "--json"];
    let damaged = mocban(dir.path(), &damaged).expect(3).json();
    assert_eq!(damaged["refusal"]["code"], "bad_input");
}

#[test]
fn wrong_files_and_folders_are_named_before_anything_is_computed() {
    let dir = empty();
    fs::create_dir(dir.path().join("mine")).expect("a folder");
    fs::write(dir.path().join("mine/notes.txt"), "").expect("a file");
    // The files do not exist either, and are not looked at.
    let foreign = mocban(dir.path(), &["align", "a.stl", "a.png", "-o", "mine"]).expect(2);
    assert!(
        foreign.err.contains("mine holds notes.txt"),
        "{}",
        foreign.err
    );
    let missing = mocban(dir.path(), &["align", "a.stl", "a.png", "-o", "new"]).expect(2);
    assert!(
        missing.err.contains("a.stl is not there"),
        "{}",
        missing.err
    );
    assert!(!dir.path().join("new").exists());
}
