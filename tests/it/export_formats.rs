//! Exports in several formats: what they hold, what is left out, and what is refused.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use mocban::raster::{ImageLimits, decode, decode_grey8};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use serde_json::Value;

use crate::cli::{Call, empty, mocban};
use crate::made_once::copy_of;
use crate::report::contents;

/// The formats that this file compares in detail.
const FORMATS: &str = "jsonl,csv,parquet,huggingface,webdataset";

/// Names that checks outside the repository rely on.
const FIXED_NAMES: &str = "id character block unit mesh print meta metric status error_class error threshold_depth \
    threshold_print angle_deg scale shift_px ssim nl_ssim iou iou_box dice density_print density_depth print_from_mesh \
    plane_from_mesh depth_from_plane print_from_depth files mesh_hash print_hash result_hash config_hash confidence margin \
    verdict seconds label box page_from_crop page_from_mesh manual_alignment disagreements missing_ink missing_wood";

/// Returns a folder with the finished project `p` of 30 pairs of three blocks.
fn project() -> tempfile::TempDir {
    let dir = empty();
    copy_of("thirty pairs", dir.path(), |dir| {
        let demo = [
            "demo", "p", "--tier", "upright", "--pairs", "30", "--seed", "2",
        ];
        mocban(dir, &demo).expect(0);
    });
    dir
}

fn export(dir: &Path, args: &[&str]) -> Call {
    let all: Vec<&str> = ["-C", "p", "export"]
        .into_iter()
        .chain(args.iter().copied())
        .collect();
    mocban(dir, &all)
}

fn lines(file: &Path) -> Vec<Value> {
    let text = fs::read_to_string(file).expect("the lines");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

/// Returns the files of the tar shards below a folder, by name.
fn samples(files: &BTreeMap<PathBuf, Vec<u8>>) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for (path, bytes) in files {
        if path.extension().is_none_or(|extension| extension != "tar") {
            continue;
        }
        let mut shard = tar::Archive::new(&bytes[..]);
        for entry in shard.entries().expect("a tar file") {
            let mut entry = entry.expect("an entry");
            assert_eq!(entry.header().mtime().expect("a time"), 0);
            let name = entry.path().expect("a name").to_string_lossy().into_owned();
            let mut content = Vec::new();
            std::io::Read::read_to_end(&mut entry, &mut content).expect("content");
            found.insert(name, content);
        }
    }
    found
}

#[test]
fn formats_agree_on_pairs_and_numbers() {
    let dir = project();
    let args = [
        "--to",
        FORMATS,
        "--images",
        "--shard-mib",
        "1",
        "--canvas",
        "96",
        "-o",
        "out",
    ];
    export(dir.path(), &args).expect(0);
    export(dir.path(), &[&args[..args.len() - 1], &["again"]].concat()).expect(0);
    let [out, again] = ["out", "again"].map(|name| dir.path().join(name));
    let files = contents(&out);
    assert!(files == contents(&again), "two exports differ");

    let rows = lines(&out.join("jsonl/pairs.jsonl"));
    let pairs: BTreeSet<&str> = rows.iter().filter_map(|line| line["id"].as_str()).collect();
    assert_eq!((pairs.len(), rows.len()), (30, 120));
    for name in FIXED_NAMES.split_whitespace() {
        assert!(rows[0].get(name).is_some(), "pairs.jsonl lacks {name}");
    }
    assert_eq!(rows[0]["meta"]["tier"], "upright");
    for name in ["label", "box", "page_from_crop", "page_from_mesh"] {
        assert_eq!(rows[0][name], Value::Null, "{name} of a pair from a list");
    }
    assert!(!out.join("jsonl/blocks.jsonl").exists());

    let [table, matrices] = ["pairs", "matrices"].map(|name| {
        let table = csv::Reader::from_path(out.join(format!("csv/{name}.csv"))).expect("a table");
        let rows: Result<Vec<BTreeMap<String, String>>, _> = table.into_deserialize().collect();
        rows.expect("rows")
    });
    assert_eq!([table.len(), matrices.len()], [rows.len(); 2]);
    for ((row, matrices), line) in table.iter().zip(&matrices).zip(&rows) {
        for table in [row, matrices] {
            assert_eq!(
                [&table["id"], &table["metric"]],
                [&line["id"], &line["metric"]]
            );
        }
        assert_eq!(row["meta_tier"], "upright");
        let number: f64 = matrices["print_from_mesh_2_4"].parse().expect("a number");
        assert_eq!(number, line["print_from_mesh"][1][3]);
    }

    let rows_below = |folder: &str| -> i64 {
        let tables = files.iter().filter(|(path, _)| {
            path.starts_with(folder) && path.extension().is_some_and(|found| found == "parquet")
        });
        let rows = tables.map(|(path, _)| {
            let file = fs::File::open(out.join(path)).expect("a file");
            let table = SerializedFileReader::new(file).expect("a Parquet file");
            table.metadata().file_metadata().num_rows()
        });
        rows.sum()
    };
    assert_eq!(
        (rows_below("parquet"), rows_below("huggingface")),
        (120, 30)
    );
    assert!(
        out.join("huggingface/data/train-00001.parquet").is_file(),
        "one shard"
    );

    let samples = samples(&files);
    assert_eq!(samples.len(), 30 * 6);
    for id in pairs {
        let fields: Value = serde_json::from_slice(&samples[&format!("{id}.json")]).expect("JSON");
        assert_eq!(
            (&fields["id"], &fields["metric"]),
            (&id.into(), &"ensemble".into())
        );
        assert_eq!(fields["metrics"].as_array().map(Vec::len), Some(4));
        for name in ["print", "print_mask", "aligned_depth", "aligned_mask"] {
            let picture = decode(
                &samples[&format!("{id}.{name}.png")],
                &ImageLimits::SUGGESTED,
            );
            let picture = picture.expect("a picture").rgb;
            assert_eq!((picture.width(), picture.height()), (96, 96), "{id} {name}");
        }
    }
}

/// The canvas of the scores has 256 pixels by default, so that its masks are those of the pictures.
#[test]
fn pictures_on_a_canvas_lie_on_the_masks_of_the_scores() {
    let dir = project();
    export(dir.path(), &["--canvas", "256", "-o", "out"]).expect(0);
    let out = dir.path().join("out");
    let grey = |line: &Value, name: &str| {
        let path = out.join(line["files"][name].as_str().expect(name));
        decode_grey8(&fs::read(path).expect(name)).expect(name)
    };
    for line in lines(&out.join("pairs.jsonl")) {
        for (picture, scored) in [
            ("aligned_mask", "canvas_depth_mask"),
            ("print_mask", "canvas_print_mask"),
        ] {
            let (picture, scored) = (grey(&line, picture), grey(&line, scored));
            let both = picture
                .zip_map(&scored, |a, b| a == 255 && b == 255)
                .count();
            let either = picture
                .zip_map(&scored, |a, b| a == 255 || b == 255)
                .count();
            assert!(
                both as f64 > 0.97 * either as f64,
                "{}: {both} of {either}",
                line["id"]
            );
        }
        let print = out.join(line["files"]["print"].as_str().expect("a print"));
        let print = decode(&fs::read(print).expect("a print"), &ImageLimits::SUGGESTED);
        let print = print.expect("a print").rgb;
        assert_eq!((print.width(), print.height()), (256, 256));
    }
}

#[test]
fn no_block_is_in_two_parts_of_a_split() {
    let dir = project();
    let split = ["--split", "60/20/20", "--by", "block", "--seed", "4"];
    export(
        dir.path(),
        &[&["--to", "csv,webdataset,jsonl", "-o", "out"][..], &split].concat(),
    )
    .expect(0);
    let rows = lines(&dir.path().join("out/jsonl/pairs.jsonl"));
    let mut parts: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for row in &rows {
        let text = |name: &str| row[name].as_str().expect(name).to_owned();
        parts
            .entry(text("block"))
            .or_default()
            .insert(text("split"));
    }
    assert!(parts.values().all(|names| names.len() == 1), "{parts:?}");
    let used: BTreeSet<&String> = parts.values().flatten().collect();
    assert_eq!(used.len(), 3, "{parts:?}");
    for part in used {
        assert!(
            dir.path()
                .join(format!("out/webdataset/{part}-000000.tar"))
                .is_file()
        );
    }
}

#[test]
fn results_are_selected_by_metric_confidence_and_verdict() {
    let dir = project();
    let said = [
        "-C",
        "p",
        "verdict",
        "set",
        "upright-0003",
        "pass",
        "--reviewer",
        "lan",
        "--metric",
        "relief",
    ];
    mocban(dir.path(), &said).expect(0);
    export(dir.path(), &["--only", "passed", "-o", "passed"]).expect(0);
    let rows = lines(&dir.path().join("passed/pairs.jsonl"));
    assert_eq!(rows.len(), 1);
    assert_eq!(
        (&rows[0]["metric"], &rows[0]["verdict"]),
        (&"relief".into(), &"pass".into())
    );
    assert_eq!(rows[0]["verdicts"][0]["reviewer"], "lan");

    export(
        dir.path(),
        &[
            "--metric",
            "relief,density",
            "--min-confidence",
            "0.9",
            "-o",
            "sure",
        ],
    )
    .expect(0);
    let rows = lines(&dir.path().join("sure/pairs.jsonl"));
    assert!(
        rows.iter()
            .all(|row| row["confidence"].as_f64() >= Some(0.9))
    );
    let metrics: BTreeSet<_> = rows
        .iter()
        .filter_map(|row| row["metric"].as_str())
        .collect();
    assert_eq!(metrics, BTreeSet::from(["density", "relief"]));
}

#[test]
fn wrong_names_and_useless_options_are_refused() {
    let dir = project();
    for (args, said) in [
        (
            &["--to", "jsonl,xlsx"][..],
            "possible values: jsonl, csv, parquet",
        ),
        (
            &["--metric", "iou"],
            "possible values: nl_ssim, density, ensemble, relief",
        ),
        (
            &["--to", "csv", "--canvas", "64"],
            "--canvas has no effect on csv",
        ),
        (&["--csv-bom"], "--csv-bom has no effect on jsonl"),
        (
            &["--to", "csv", "--shard-mib", "9"],
            "--shard-mib has no effect on csv",
        ),
        (&["--split", "80/10"], "percentages that sum to 100"),
        (&["--by", "pair"], "--split"),
        (&["--min-confidence", "2"], "a number from 0 to 1"),
    ] {
        let refused = export(dir.path(), &[args, &["-o", "out"]].concat()).expect(2);
        assert!(refused.err.contains(said), "{args:?}: {}", refused.err);
        assert!(!dir.path().join("out").exists(), "{args:?}");
    }
}

#[test]
fn an_export_replaces_one_of_another_format_and_nothing_else() {
    let dir = project();
    let out = dir.path().join("out");
    export(dir.path(), &["-o", "out"]).expect(0);
    export(dir.path(), &["--to", "csv,parquet", "-o", "out"]).expect(0);
    let names: BTreeSet<_> = fs::read_dir(&out)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    assert_eq!(
        names,
        BTreeSet::from(["checksums.txt", "csv", "export.json", "parquet"].map(Into::into))
    );
    fs::write(out.join("csv/notes.txt"), "mine").expect("written");
    let before = contents(&out);
    let refused = export(dir.path(), &["-o", "out"]).expect(2);
    assert!(
        refused
            .err
            .contains("csv/notes.txt is not part of an export"),
        "{}",
        refused.err
    );
    assert!(before == contents(&out), "the folder was changed");
}

#[test]
fn an_export_replaces_no_file_that_somebody_edited() {
    let dir = project();
    let out = dir.path().join("out");
    let args = ["--to", "csv", "-o", "out"];
    for _ in 0..2 {
        export(dir.path(), &args).expect(0);
    }
    let table = out.join("pairs.csv");
    let mut edited = fs::read(&table).expect("a table");
    let last = edited.len() - 2;
    edited[last] = b'7';
    fs::write(&table, &edited).expect("written");
    let before = contents(&out);
    let refused = export(dir.path(), &args).expect(2);
    let said = "out/pairs.csv was changed after it was written, so its folder is not replaced; move the file elsewhere";
    assert!(refused.err.contains(said), "{}", refused.err);
    assert!(before == contents(&out), "the folder was changed");
    fs::rename(&table, dir.path().join("mine.csv")).expect("moved");
    export(dir.path(), &args).expect(0);
    assert_eq!(
        fs::read(dir.path().join("mine.csv")).expect("a table"),
        edited
    );
}
