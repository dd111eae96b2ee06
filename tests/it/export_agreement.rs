//! All formats of an export have the same pairs, labels and parts, whichever results are selected; and pictures on a
//! canvas show the same pixels.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use mocban::export::ExportFormat;
use mocban::raster::{Grid, decode_grey8, decode_grey16};
use mocban::store::Project;
use serde_json::{Value, json};
use tiff::decoder::{Decoder, DecodingResult};

use crate::check::at;
use crate::cli::mocban;
use crate::export_readback::{
    agreeing_lines, every_format, images_of_parquet, lines, members, parts,
};
use crate::resume::copy;

/// Returns whether an export with certain options must hold a line.
type IsWanted<'a> = &'a dyn Fn(&&Value) -> bool;

/// Pairs of the demo. Two more are added: one with the print of another pair, one with a broken mesh.
const PAIRS: usize = 9;
/// Characters and blocks of the pairs, in turn.
const CHARACTERS: [&str; 4] = ["一", "𠃅", "", "\"na\", m"];
const BLOCKS: [&str; 5] = ["b 1", "b,2", "b3", "b4", "b5"];

/// A project that was run and judged, created once. Each test works on a copy.
static JUDGED: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let count = PAIRS.to_string();
    mocban(dir.path(), &["demo", "data", "--pairs", &count, "--no-run"]).expect(0);
    let data = dir.path().join("data/data");
    fs::write(data.join("broken.stl"), "no mesh").expect("written");
    let file = |folder: &str, number: usize| {
        let entries = fs::read_dir(data.join(folder)).expect("a folder");
        let mut names: Vec<_> = entries
            .map(|entry| entry.expect("an entry").file_name())
            .collect();
        names.sort();
        format!("{folder}/{}", names[number].to_string_lossy())
    };
    let list = File::create(data.join("pairs.csv")).expect("a file");
    let mut list = csv::Writer::from_writer(list);
    list.write_record(["id", "mesh", "print", "character", "block"])
        .expect("written");
    let mut add = |id: &str, mesh: &str, print: &str, number: usize| {
        let character = CHARACTERS[number % CHARACTERS.len()];
        let block = BLOCKS[number % BLOCKS.len()];
        list.write_record([id, mesh, print, character, block])
            .expect("written");
    };
    for number in 0..PAIRS {
        let [mesh, print] = ["meshes", "prints"].map(|folder| file(folder, number));
        add(&format!("p{number}"), &mesh, &print, number);
    }
    add("wrong", &file("meshes", 0), &file("prints", 3), PAIRS);
    add("broken", "broken.stl", &file("prints", 0), PAIRS + 1);
    list.flush().expect("written");
    drop(list);
    mocban(
        dir.path(),
        &["-C", "judged", "import", "data/data/pairs.csv"],
    )
    .expect(0);
    let project = Project::open(&dir.path().join("judged")).expect("a project");
    // Otherwise, the wrong pair fails.
    let lenient = "[register]\nmin_confidence = 0.0\n";
    fs::write(project.settings_path(), lenient).expect("written");
    at(&project, &["run"]).expect(3);
    for set in [
        "p1 pass --reviewer lan",
        "p2 pass --reviewer lan --metric relief",
        "p3 fail --reviewer lan",
        "p4 pass --reviewer lan",
        "p4 fail --reviewer minh",
    ] {
        let set: Vec<&str> = "verdict set".split(' ').chain(set.split(' ')).collect();
        at(&project, &set).expect(0);
    }
    dir
});

/// Copies the judged project to a folder.
fn judged(dir: &Path) -> Project {
    let original = Project::open(&JUDGED.path().join("judged")).expect("a project");
    copy(&original, &dir.join("p"))
}

/// Exports with these options to a folder beside the project. Returns the folder.
fn export(project: &Project, name: &str, options: &[&str]) -> PathBuf {
    let out = project.dir().with_file_name(name);
    let args = [
        "export",
        "--to",
        &every_format(),
        "-o",
        out.to_str().expect("UTF-8"),
    ];
    at(project, &[&args[..], options].concat()).expect(0);
    out
}

/// Returns id and metric of lines.
fn results(lines: &[Value]) -> BTreeSet<(String, String)> {
    let text = |line: &Value, name: &str| line[name].as_str().expect("a text").to_owned();
    lines
        .iter()
        .map(|line| (text(line, "id"), text(line, "metric")))
        .collect()
}

#[test]
fn all_formats_select_the_same_results() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = judged(dir.path());
    let all = agreeing_lines(&export(&project, "all", &[]));
    assert_eq!(all.len(), (PAIRS + 2) * 4);
    let failed = all.iter().filter(|line| line["status"] == "failed");
    assert_eq!(failed.filter(|line| line["id"] == "broken").count(), 4);
    let confidence = |line: &&Value| line["confidence"].as_f64();
    let mut found: Vec<f64> = all.iter().filter_map(|line| confidence(&line)).collect();
    found.sort_by(f64::total_cmp);
    assert!(found[0] < 0.5, "no pair is doubtful: {found:?}");
    let median = found[found.len() / 2];
    let text = median.to_string();
    let cases: [(&[&str], IsWanted<'_>); 5] = [
        (&["--only", "confident"], &|line| {
            confidence(line) >= Some(0.5)
        }),
        (&["--min-confidence", &text], &|line| {
            confidence(line) >= Some(median)
        }),
        (&["--only", "passed"], &|line| line["verdict"] == "pass"),
        (
            &["--only", "passed", "--metric", "density,nl_ssim"],
            &|line| {
                line["verdict"] == "pass"
                    && ["density", "nl_ssim"].contains(&line["metric"].as_str().expect("a metric"))
            },
        ),
        (&["--metric", "relief"], &|line| line["metric"] == "relief"),
    ];
    for (options, is_wanted) in cases {
        let wanted: Vec<Value> = all.iter().filter(is_wanted).cloned().collect();
        let found = agreeing_lines(&export(&project, "out", options));
        assert_eq!(results(&found), results(&wanted), "{options:?}");
        assert!(!found.is_empty() && found.len() < all.len(), "{options:?}");
    }
    let passed = lines(&export(&project, "out", &["--only", "passed"]).join("jsonl"));
    let ids: Vec<_> = passed.iter().map(|line| &line["id"]).collect();
    assert_eq!(ids, ["p1", "p1", "p1", "p1", "p2"]);
    assert!(dir.path().join("out/mesh/pairs/p2/scan.ply").is_file());
    assert!(!dir.path().join("out/mesh/pairs/p4").exists());
}

#[test]
fn parts_of_a_split_are_the_same_in_all_formats() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = judged(dir.path());
    let mut splits = BTreeSet::new();
    // The first export shows that all metrics of a pair have one part.
    for (by, seed, metrics) in [
        ("block", "1", &[] as &[&str]),
        ("block", "2", &["--metric", "ensemble"]),
        ("character", "1", &["--metric", "ensemble"]),
        ("pair", "1", &["--metric", "ensemble"]),
    ] {
        let split = ["--split", "60/20/20", "--by", by, "--seed", seed];
        let options = [&split[..], metrics].concat();
        let found = agreeing_lines(&export(&project, "out", &options));
        let mut parts: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for line in &found {
            let text = |name: &str| line[name].as_str().unwrap_or_default();
            // A pair without a character is a group of its own.
            let group = Some(text(by)).filter(|group| !group.is_empty() && by != "pair");
            let group = group.unwrap_or(text("id"));
            parts.entry(group).or_default().insert(text("split"));
        }
        assert!(parts.values().all(|names| names.len() == 1), "{parts:?}");
        let used: BTreeSet<&&str> = parts.values().flatten().collect();
        assert!(
            used.into_iter().eq(&["test", "train", "validation"]),
            "{parts:?}"
        );
        let texts = parts
            .iter()
            .map(|(group, parts)| format!("{group} {parts:?}"));
        splits.insert((by, texts.collect::<Vec<_>>()));
    }
    assert_eq!(splits.len(), 4, "the seed changes nothing: {splits:?}");
}

/// A picture of a line, and the value of a pixel with the given place.
fn grey8(export: &Path, line: &Value, role: &str) -> Grid<u8> {
    let path = export.join(line["files"][role].as_str().expect(role));
    decode_grey8(&fs::read(path).expect(role)).expect(role)
}

/// Returns the share of pixels of the picture on the canvas that equal the nearest pixel of the picture in the frame of
/// the print, and the number of compared pixels. Leaves out pixels next to another value, where warping rounds.
fn agreement<T: PartialEq + Copy>(
    native: &Grid<T>,
    canvas: &Grid<T>,
    line: &Value,
) -> (f64, usize) {
    let m = |row: usize, column: usize| {
        line["picture_from_print"][row][column]
            .as_f64()
            .expect("a number")
    };
    assert_eq!([m(0, 1), m(1, 0)], [0.0, 0.0], "the canvas turns the print");
    let (mut equal, mut compared) = (0, 0);
    for v in 0..canvas.height() {
        for u in 0..canvas.width() {
            let x = ((u as f64 - m(0, 2)) / m(0, 0)).round() as i64;
            let y = ((v as f64 - m(1, 2)) / m(1, 1)).round() as i64;
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            let values: Option<Vec<T>> = around.map(|(x, y)| native.get(x, y)).collect();
            if let Some(values) = values.filter(|values| values.iter().all(|one| *one == values[0]))
            {
                compared += 1;
                equal += usize::from(canvas.at(u, v) == values[0]);
            }
        }
    }
    (equal as f64 / compared as f64, compared)
}

/// Returns the last channel of a stack, the strokes, as 255 and 0.
fn mask_of_stack(path: &Path) -> Grid<u8> {
    let stack = File::open(path).expect("a stack");
    let mut stack = Decoder::new(stack).expect("a TIFF");
    while stack.more_images() {
        stack.next_image().expect("a channel");
    }
    let (width, height) = stack.dimensions().expect("a size");
    let DecodingResult::F32(values) = stack.read_image().expect("a channel") else {
        unreachable!("a stack has floats");
    };
    let is_stroke = values.iter().map(|value| u8::from(*value > 0.0) * 255);
    Grid::from_vec(width as usize, height as usize, is_stroke.collect()).expect("a channel")
}

/// Returns the strokes on the print of each pair in a format as 255 and 0, or `None` if it has no pictures in the frame of
/// the print.
fn aligned_masks(export: &Path, format: ExportFormat) -> Option<BTreeMap<String, Grid<u8>>> {
    const ROLE: &str = "aligned_mask";
    let folder = export.join(format.name());
    let id = |line: &Value| line["id"].as_str().expect("an id").to_owned();
    let files: BTreeMap<String, Vec<u8>> = match format {
        ExportFormat::Jsonl => {
            let of_pairs = lines(&folder).into_iter();
            let masks = of_pairs.map(|line| (id(&line), grey8(&folder, &line, ROLE)));
            return Some(masks.collect());
        }
        ExportFormat::Fiji => {
            let of_pairs = lines(&folder).into_iter();
            let masks = of_pairs.map(|line| {
                let stack = line["files"]["stack"].as_str().expect("a stack");
                (id(&line), mask_of_stack(&folder.join(stack)))
            });
            return Some(masks.collect());
        }
        ExportFormat::Parquet => images_of_parquet(&folder.join("pairs.parquet"), ROLE),
        ExportFormat::HuggingFace => {
            let tables = parts(&folder.join("data"), "parquet").into_iter();
            let images = tables.flat_map(|(_, table)| images_of_parquet(&table, ROLE));
            images.collect()
        }
        ExportFormat::WebDataset => {
            let shards = parts(&folder, "tar").into_iter();
            let files = shards.flat_map(|(_, shard)| members(&shard));
            let ending = format!(".{ROLE}.png");
            let masks = files
                .filter_map(|(name, file)| Some((name.strip_suffix(&ending)?.to_owned(), file)));
            masks.collect()
        }
        ExportFormat::Csv
        | ExportFormat::Mesh
        | ExportFormat::Annotations
        | ExportFormat::Viewer => return None,
    };
    let decoded = files.into_iter();
    let decoded = decoded.map(|(id, file)| (id, decode_grey8(&file).expect("a mask")));
    Some(decoded.collect())
}

#[test]
fn pictures_on_a_canvas_show_the_same_pixels() {
    const PX: usize = 200;
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = judged(dir.path());
    let args = ["--only", "confident", "--metric", "ensemble"];
    let native = export(&project, "native", &args).join("jsonl");
    let whole = export(
        &project,
        "canvas",
        &[&args[..], &["--canvas", "200", "--images"]].concat(),
    );
    let canvas = whole.join("jsonl");
    let pairs = lines(&native);
    assert!(pairs.len() > 5);
    for (before, line) in pairs.iter().zip(lines(&canvas)) {
        for role in ["print_mask", "aligned_mask"] {
            let [old, new] = [grey8(&native, before, role), grey8(&canvas, &line, role)];
            assert_eq!([new.width(), new.height()], [PX, PX]);
            let (share, compared) = agreement(&old, &new, &line);
            assert!(
                share > 0.99 && compared > PX * PX / 4,
                "{role} {share} of {compared}: {line}"
            );
        }
        let picture = fs::read(canvas.join(line["files"]["print"].as_str().expect("a print")));
        let picture = image::load_from_memory(&picture.expect("a file")).expect("a picture");
        assert_eq!([picture.width(), picture.height()], [PX as u32; 2]);
        let levels = |export: &Path, line: &Value| {
            let path = export.join(
                line["files"]["aligned_depth"]
                    .as_str()
                    .expect("a depth map"),
            );
            let levels = decode_grey16(&fs::read(path).expect("a file")).expect("a depth map");
            levels.map(|level| *level > 0)
        };
        let (share, compared) = agreement(&levels(&native, before), &levels(&canvas, &line), &line);
        assert!(
            share > 0.99 && compared > PX * PX / 4,
            "{share} of {compared}: {line}"
        );
    }
    let masks = aligned_masks(&whole, ExportFormat::Jsonl).expect("pictures");
    assert_eq!(masks.len(), pairs.len());
    for format in ExportFormat::ALL {
        let found = aligned_masks(&whole, format);
        let name = format.name();
        assert_eq!(found.is_some(), format.writes_pictures(), "{name}");
        assert!(found.is_none_or(|found| found == masks), "{name}");
    }
}

#[test]
fn an_export_without_a_selected_result_keeps_the_earlier_one() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = judged(dir.path());
    let out = export(&project, "out", &["--only", "passed"]);
    let before = lines(&out.join("jsonl"));
    let path = out.to_str().expect("UTF-8");
    let none = ["export", "-o", path, "--min-confidence", "1"];
    let refused = at(&project, &none).expect(4);
    assert!(
        refused
            .err
            .contains("no result is selected: 1 without a result, 10 below confidence 1;"),
        "{}",
        refused.err
    );
    assert_eq!(lines(&out.join("jsonl")), before);
    let passed = ["export", "-o", path, "--only", "passed"];
    let said = at(&project, &passed).expect(0).err;
    let reasons = "9 left out (1 without a result, 6 without a verdict, 1 unsure or in conflict, 1 failed by reviewers)";
    assert!(said.contains(reasons), "{said}");
    let (_, numbers) = said.split_once(" exported to ").expect("a summary");
    assert_eq!(numbers.matches("without a result").count(), 1, "{said}");
    let readme = fs::read_to_string(out.join("README.md")).expect("a file");
    let reasons = reasons.replace("left out (", "left out by the selection (");
    assert!(readme.contains(&reasons), "{readme}");
    let json = at(&project, &[&passed[..], &["--json"]].concat())
        .expect(0)
        .json();
    let counts = json!({"without_result": 1, "without_verdict": 6, "unsure": 1, "failed": 1});
    assert_eq!(json["left_out_by"], counts);
}
