//! Exports for other tools: scans, calibrated images and annotations agree with the results.

use std::collections::BTreeSet;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use mocban::mesh::{Mesh, MeshLimits, read};
use mocban::raster::decode_grey16;
use serde_json::Value;
use tiff::decoder::{Decoder, DecodingResult};

use crate::cli::mocban;

/// The formats that other tools open, and the lines to compare them with.
const FORMATS: &str = "jsonl,mesh,fiji,annotations";

/// Makes two pairs and a third with the print of the first, and exports them.
fn exported(dir: &Path) -> PathBuf {
    let demo = ["demo", "p", "--tier", "hard", "--pairs", "2", "--seed", "8"];
    mocban(dir, &demo).expect(0);
    let data = dir.join("p/data");
    let manifest = fs::read_to_string(data.join("manifest.csv")).expect("a manifest");
    let mut rows = manifest.lines();
    let (head, first) = (rows.next().expect("a head"), rows.next().expect("a row"));
    let again = first.replacen("hard-0000", "page-0001", 1);
    fs::write(data.join("again.csv"), format!("{head}\n{again}\n")).expect("written");
    mocban(dir, &["-C", "p", "import", "p/data/again.csv"]).expect(0);
    mocban(dir, &["-C", "p", "run"]).expect(0);
    mocban(dir, &["-C", "p", "export", "--to", FORMATS, "-o", "out"]).expect(0);
    dir.join("out")
}

fn lines(folder: &Path) -> Vec<Value> {
    let text = fs::read_to_string(folder.join("pairs.jsonl")).expect("the lines");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON")
}

fn file(folder: &Path, line: &Value, role: &str) -> PathBuf {
    folder.join(line["files"][role].as_str().expect(role))
}

fn mesh(path: &Path) -> Mesh {
    let bytes = fs::read(path).expect("a mesh");
    read(&bytes, &path.to_string_lossy(), &MeshLimits::SUGGESTED).expect("a mesh")
}

fn numbers(value: &Value) -> Vec<f64> {
    let all = value.as_array().expect("a list").iter();
    all.map(|number| number.as_f64().expect("a number"))
        .collect()
}

/// The matrix moves the vertices of the original onto those of the PLY, and their places in the print follow
/// `print_from_mesh`.
fn check_scan(data: &Path, folder: &Path, line: &Value) {
    let original = mesh(&data.join(line["mesh"].as_str().expect("a path")));
    let text = fs::read_to_string(file(folder, line, "matrix")).expect("a matrix");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .map(|row| {
            row.split(' ')
                .map(|cell| cell.parse().expect("a number"))
                .collect()
        })
        .collect();
    let at = |row: &[f64], [x, y, z]: [f64; 3]| row[0] * x + row[1] * y + row[2] * z + row[3];
    let mut seen = BTreeSet::new();
    let mut first = original.vertices.iter();
    let picture = image::open(file(&folder.with_file_name("jsonl"), line, "print")).ok();
    for placed in mesh(&file(folder, line, "ply")).vertices.iter() {
        let is_new = |p: &[f64; 3]| seen.insert(p.map(|c| (c + 0.0).to_bits()));
        let point = first
            .by_ref()
            .find(is_new)
            .expect("a vertex of the original");
        for (row, found) in rows.iter().zip(placed) {
            assert!((at(row, point) - found).abs() < 1e-3, "{line}");
        }
        if let Some(picture) = &picture {
            let px = |k: &str| line[k].as_f64().expect("a number");
            let mm_per_px = px("mesh_unit_per_px") * px("mm_per_mesh_unit") / px("scale");
            let sides = [picture.width(), picture.height()];
            for k in 0..2 {
                let expected = at(&numbers(&line["print_from_mesh"][k]), point);
                let found = (f64::from(sides[k]) - 1.0) / 2.0 - placed[k] / mm_per_px;
                assert!((found - expected).abs() < 1e-2, "{found} {expected}");
            }
        }
    }
    assert!(picture.is_some(), "{line}");
}

#[test]
fn files_for_other_tools_hold_the_results() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let out = exported(dir.path());
    let data = dir.path().join("p");
    let (scans, images) = (out.join("mesh"), out.join("fiji"));
    let depth_maps = lines(&out.join("jsonl"));
    for line in lines(&scans) {
        assert_eq!(line["metric"], "ensemble");
        let depth = depth_maps
            .iter()
            .find(|other| (&other["id"], &other["metric"]) == (&line["id"], &line["metric"]));
        let mut with_print = line.clone();
        with_print["files"]["print"] = depth.expect("a line")["files"]["print"].clone();
        check_scan(&data, &scans, &with_print);
    }
    for line in lines(&images) {
        let depth = depth_maps.iter().find(|other| other["id"] == line["id"]);
        let levels = file(&out.join("jsonl"), depth.expect("a line"), "depth");
        let levels = decode_grey16(&fs::read(levels).expect("a file")).expect("a PNG");
        let heights = fs::read(file(&images, &line, "heights")).expect("a file");
        let image = Decoder::new(Cursor::new(heights)).and_then(|mut file| file.read_image());
        let DecodingResult::F32(heights) = image.expect("a TIFF") else {
            panic!("no floats");
        };
        let number = |field: &str| line[field].as_f64().expect(field);
        for (level, found) in levels.data().iter().zip(heights) {
            let steps = f64::from(level.max(&1) - 1);
            let height = number("height_min") + steps * number("height_per_level");
            let height = (height * number("mm_per_mesh_unit")) as f32;
            assert!(if *level == 0 {
                found.is_nan()
            } else {
                found == height
            });
        }
    }
}

#[test]
fn pairs_of_one_print_share_its_image() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let folder = exported(dir.path()).join("annotations");
    let coco = json(&folder.join("coco.json"));
    let count = |field: &str| coco[field].as_array().expect(field).len();
    assert_eq!(
        [count("annotations"), count("images"), count("categories")],
        [3, 2, 2]
    );
    let image = |k: usize| &coco["annotations"][k]["image_id"];
    assert_eq!(image(0), image(2));
    assert_eq!(
        coco["annotations"][0]["segmentation"],
        coco["annotations"][2]["segmentation"]
    );
    let via = json(&folder.join("via.json"));
    let regions = via.as_object().expect("an object").values();
    let mut regions: Vec<usize> = regions
        .map(|image| image["regions"].as_array().expect("a list").len())
        .collect();
    regions.sort_unstable();
    assert_eq!(regions, [1, 2]);
    let prints = fs::read_dir(folder.join("images"))
        .expect("a folder")
        .count();
    assert_eq!(prints, 2);
    // The export is recognized and replaced, with equal bytes.
    let before = fs::read(folder.join("coco.json")).expect("a file");
    let again = ["-C", "p", "export", "--to", FORMATS, "-o", "out"];
    mocban(dir.path(), &again).expect(0);
    assert!(fs::read(folder.join("coco.json")).expect("a file") == before);
}
