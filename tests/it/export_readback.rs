//! Reads the labels of every format of an export back, so that tests can compare them.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use mocban::export::ExportFormat;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::{Field, Row};
use serde_json::Value;

/// Returns every format, as `--to` expects them.
pub(crate) fn every_format() -> String {
    ExportFormat::ALL.map(ExportFormat::name).join(",")
}

/// What a format says about one result. Missing texts are empty.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ResultLabel {
    pub(crate) id: String,
    pub(crate) metric: String,
    pub(crate) character: String,
    pub(crate) block: String,
    pub(crate) split: String,
}

impl ResultLabel {
    /// Reads the fields of a label by a function that returns the text of a field.
    fn of(text: impl Fn(&str) -> String) -> Self {
        let [id, metric, character, block, split] =
            ["id", "metric", "character", "block", "split"].map(text);
        Self {
            id,
            metric,
            character,
            block,
            split,
        }
    }

    fn of_json(value: &Value) -> Self {
        Self::of(|name| text(&value[name]))
    }
}

/// Returns a text or nothing.
fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// Returns the lines of `pairs.jsonl` of a format.
pub(crate) fn lines(folder: &Path) -> Vec<Value> {
    let text = fs::read_to_string(folder.join("pairs.jsonl")).expect("the lines");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

/// Returns the files of a folder with this extension, each with its part of the dataset. The part is the first word of
/// the name.
pub(crate) fn parts(folder: &Path, extension: &str) -> Vec<(String, PathBuf)> {
    let entries = fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let is_wanted = |path: &PathBuf| path.extension().is_some_and(|found| found == extension);
    let part = |path: &Path| {
        let name = path.file_name().expect("a name").to_string_lossy();
        name.split(['-', '.']).next().expect("a word").to_owned()
    };
    let named = paths.filter(is_wanted).map(|path| (part(&path), path));
    named.collect()
}

/// Returns the labels of a CSV table.
fn of_csv(path: &Path) -> Vec<ResultLabel> {
    let mut table = csv::Reader::from_path(path).expect("a table");
    let header = table.headers().expect("a header").clone();
    let place = |name: &str| {
        header
            .iter()
            .position(|found| found == name)
            .expect("a column")
    };
    let rows = table.records().map(|row| row.expect("a row"));
    rows.map(|row| ResultLabel::of(|name| row[place(name)].to_owned()))
        .collect()
}

/// Returns the rows of a Parquet table.
fn rows_of_parquet(path: &Path) -> Vec<Row> {
    let table = SerializedFileReader::new(File::open(path).expect("a file")).expect("a table");
    let rows = table.get_row_iter(None).expect("rows");
    rows.map(|row| row.expect("a row")).collect()
}

/// Returns the image files in a column of a Parquet table, by the ids of the pairs.
pub(crate) fn images_of_parquet(path: &Path, column: &str) -> BTreeMap<String, Vec<u8>> {
    let rows = rows_of_parquet(path).into_iter();
    rows.map(|row| {
        let cells: BTreeMap<_, _> = row.get_column_iter().collect();
        let (Field::Str(id), Field::Group(image)) =
            (cells[&"id".to_owned()], cells[&column.to_owned()])
        else {
            unreachable!("{column} is no image")
        };
        let bytes = image.get_column_iter().find_map(|(_, part)| match part {
            Field::Bytes(bytes) => Some(bytes.data().to_vec()),
            _ => None,
        });
        (id.clone(), bytes.expect("the bytes of an image"))
    })
    .collect()
}

/// Returns the labels of a Parquet table.
fn of_parquet(path: &Path) -> Vec<ResultLabel> {
    let rows = rows_of_parquet(path).into_iter();
    rows.map(|row| {
        let cells: BTreeMap<_, _> = row.get_column_iter().collect();
        ResultLabel::of(|name| match cells[&name.to_owned()] {
            Field::Str(text) => text.clone(),
            other => {
                assert_eq!(*other, Field::Null, "{name}");
                String::new()
            }
        })
    })
    .collect()
}

/// Returns the files of a tar shard by name.
pub(crate) fn members(shard: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut shard = tar::Archive::new(File::open(shard).expect("a shard"));
    for entry in shard.entries().expect("a shard") {
        let mut entry = entry.expect("an entry");
        let name = entry.path().expect("a name").to_string_lossy().into_owned();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).expect("content");
        let earlier = found.insert(name, content);
        assert!(earlier.is_none(), "a name is twice in a shard");
    }
    found
}

/// Returns the samples of all tar shards below a folder. The part of a sample is that of its shard.
fn of_shards(folder: &Path) -> Vec<ResultLabel> {
    let mut labels = Vec::new();
    for (part, shard) in parts(folder, "tar") {
        for (name, content) in members(&shard) {
            if Path::new(&name)
                .extension()
                .is_none_or(|kind| kind != "json")
            {
                continue;
            }
            let label = ResultLabel::of_json(&serde_json::from_slice(&content).expect("JSON"));
            assert_eq!(name, format!("{}.json", label.id));
            assert!(label.split == part || part == "pairs", "{name} in {part}");
            labels.push(label);
        }
    }
    labels
}

/// Returns the labels of the COCO files of a folder. The part of an annotation is that of its file. Pairs without a
/// character are in the category `stroke`.
fn of_coco(folder: &Path) -> Vec<ResultLabel> {
    let mut labels = Vec::new();
    for (_, path) in parts(folder, "json") {
        let name = path
            .file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let Some(part) = name.strip_prefix("coco") else {
            continue;
        };
        let coco: Value = serde_json::from_slice(&fs::read(&path).expect("a file")).expect("JSON");
        let categories = coco["categories"].as_array().expect("categories");
        for annotation in coco["annotations"].as_array().expect("annotations") {
            let is_its = |category: &&Value| category["id"] == annotation["category_id"];
            let category = categories.iter().find(is_its).expect("a category");
            let attributes = &annotation["attributes"];
            let label = ResultLabel {
                id: text(&annotation["pair"]),
                metric: text(&attributes["metric"]),
                character: text(&category["name"]).replace("stroke", ""),
                block: text(&attributes["block"]),
                split: text(&attributes["split"]),
            };
            assert_eq!(label.split, part.trim_start_matches('_'), "{label:?}");
            labels.push(label);
        }
    }
    labels
}

/// Returns all labels of the tables of `huggingface`. The part of a row is that of its file; without a split, it is
/// `train`.
fn of_huggingface(folder: &Path) -> Vec<ResultLabel> {
    let tables = parts(&folder.join("data"), "parquet");
    let rows = tables
        .iter()
        .flat_map(|(part, path)| of_parquet(path).into_iter().map(move |label| (part, label)));
    rows.map(|(part, label)| {
        assert!(label.split == *part || (label.split.is_empty() && part == "train"));
        label
    })
    .collect()
}

/// The exported results that a format contains.
enum ExportedResults {
    /// All of them.
    All,
    /// One per pair: that of `ensemble`, or else of the first metric.
    OnePerPair,
    /// One per pair that did not fail.
    OnePerDonePair,
}

/// Reads the labels of a format from its folder, sorted. Returns also which results they should be.
fn labels(folder: &Path, format: ExportFormat) -> (Vec<ResultLabel>, ExportedResults) {
    let of_lines = || lines(folder).iter().map(ResultLabel::of_json).collect();
    let (mut found, results): (Vec<_>, _) = match format {
        ExportFormat::Jsonl => (of_lines(), ExportedResults::All),
        ExportFormat::Csv => (of_csv(&folder.join("pairs.csv")), ExportedResults::All),
        ExportFormat::Parquet => {
            let table = of_parquet(&folder.join("pairs.parquet"));
            (table, ExportedResults::All)
        }
        ExportFormat::HuggingFace => (of_huggingface(folder), ExportedResults::OnePerDonePair),
        ExportFormat::WebDataset => (of_shards(folder), ExportedResults::OnePerDonePair),
        ExportFormat::Mesh
        | ExportFormat::Fiji
        | ExportFormat::Annotations
        | ExportFormat::Viewer => (of_lines(), ExportedResults::OnePerPair),
    };
    found.sort();
    (found, results)
}

/// Asserts that all formats of an export have the same pairs and labels. Returns the lines of `jsonl`.
pub(crate) fn agreeing_lines(export: &Path) -> Vec<Value> {
    let lines = lines(&export.join("jsonl"));
    let mut all: Vec<ResultLabel> = lines.iter().map(ResultLabel::of_json).collect();
    all.sort();
    let mut shown: BTreeMap<String, (ResultLabel, bool)> = BTreeMap::new();
    for line in &lines {
        let label = ResultLabel::of_json(line);
        let is_done = line["status"] == "done";
        if label.metric == "ensemble" || !shown.contains_key(&label.id) {
            shown.insert(label.id.clone(), (label, is_done));
        }
    }
    let every: Vec<ResultLabel> = shown.values().map(|(label, _)| label.clone()).collect();
    let done = shown.into_values().filter(|(_, is_done)| *is_done);
    let done: Vec<ResultLabel> = done.map(|(label, _)| label).collect();
    let assert_equal = |name: &str, found: &[ResultLabel], expected: &[ResultLabel]| {
        assert!(
            found == expected,
            "{name}: {found:#?}\njsonl: {expected:#?}"
        );
    };
    for format in ExportFormat::ALL {
        let (found, results) = labels(&export.join(format.name()), format);
        let expected = match results {
            ExportedResults::All => &all,
            ExportedResults::OnePerPair => &every,
            ExportedResults::OnePerDonePair => &done,
        };
        assert_equal(format.name(), &found, expected);
    }
    let mut coco = of_coco(&export.join(ExportFormat::Annotations.name()));
    coco.sort();
    assert_equal("COCO", &coco, &done);
    lines
}
