//! Opens the exports of a demo project in the programs that people use, by the scripts in `tests/readers/`. The Python
//! interpreter in `READERS_PYTHON` runs them; `tests/readers/requirements.txt` lists their modules. What is not
//! installed is skipped with a line on stderr.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

use crate::cli::{Call, call, mocban};
use crate::export_readback::every_format;
use crate::skipped::say_skipped;
use crate::source_text::package_dir;

/// Number of pairs of the project.
const PAIRS: usize = 12;
/// Number of blocks of the project; splits have whole blocks.
const BLOCKS: usize = 4;
/// Exit code of a script whose module or program is not installed.
const SKIPPED: i32 = 77;

/// A project, and its export in all formats.
pub(crate) struct ExportedDemo {
    dir: tempfile::TempDir,
}

impl ExportedDemo {
    /// Creates a project and exports it.
    fn create() -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let pairs = PAIRS.to_string();
        let demo = [
            "demo", "demo", "--tier", "hard", "--seed", "3", "--no-run", "--pairs", &pairs,
        ];
        mocban(dir.path(), &demo).expect(0);
        let made = Self { dir };
        made.write_list();
        made.call(&[
            "import",
            "demo/data/pairs.csv",
            "--truth",
            "demo/data/truth.jsonl",
        ]);
        made.call(&["run"]);
        for (pair, verdict, reviewer) in [
            ("hard-0003", "pass", "lan"),
            ("hard-0003", "fail", "minh"),
            ("hard-0005", "unsure", "lan"),
        ] {
            made.call(&["verdict", "set", pair, verdict, "--reviewer", reviewer]);
        }
        let split = ["--split", "50/25/25", "--by", "block", "--seed", "1"];
        made.call(
            &[
                &[
                    "export",
                    "--to",
                    &every_format(),
                    "--images",
                    "-o",
                    "export",
                ],
                &split[..],
            ]
            .concat(),
        );
        made
    }

    /// Calls the program on the project.
    pub(crate) fn call(&self, args: &[&str]) -> Call {
        mocban(self.dir.path(), &[&["-C", "project"], args].concat()).expect(0)
    }

    /// Returns a path beside the project.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Writes `pairs.csv` beside the list of the demo, with other blocks and a column of the user.
    fn write_list(&self) {
        let data = self.path("demo/data");
        let mut list = csv::Reader::from_path(data.join("manifest.csv")).expect("the demo's list");
        let mut text = "id,mesh,print,character,unit,block,page note\n".to_owned();
        let headers = list.headers().expect("headers").clone();
        for (k, row) in list.records().enumerate() {
            let row = row.expect("a row");
            for name in ["id", "mesh", "print", "character", "unit"] {
                let column = headers.iter().position(|header| header == name);
                let _ = write!(text, "{},", &row[column.expect(name)]);
            }
            let _ = writeln!(text, "block {},\"leaf {k}, \"\"recto\"\"\"", k % BLOCKS);
        }
        std::fs::write(data.join("pairs.csv"), text).expect("pairs.csv");
    }
}

/// Returns the project of all tests of exports, which is made once.
pub(crate) fn exported_demo() -> &'static ExportedDemo {
    static MADE: OnceLock<ExportedDemo> = OnceLock::new();
    MADE.get_or_init(ExportedDemo::create)
}

/// Returns a command that runs a script, given by its path in the package, in the Python interpreter that an environment
/// variable names. Returns `None`, with a line on stderr, if the variable is not set.
pub(crate) fn python(variable: &str, script: &str) -> Option<Command> {
    let Some(interpreter) = std::env::var_os(variable) else {
        say_skipped(&format!("{variable} names no Python interpreter"));
        return None;
    };
    let mut command = Command::new(interpreter);
    command.arg("-B").arg(package_dir().join(script));
    Some(command)
}

/// Returns a command that checks an export, that of the demo by default, by a script of `tests/readers/`. Returns `None`
/// without Python.
fn reader(script: &str, export: Option<&Path>) -> Option<Command> {
    let mut command = python("READERS_PYTHON", &format!("tests/readers/{script}"))?;
    let demo = exported_demo();
    let export = export.map_or_else(|| demo.path("export"), Path::to_owned);
    command.arg(export).arg(demo.path("demo/data"));
    Some(command)
}

/// Returns why a script was skipped, from its output.
fn reason(output: &str) -> &str {
    output.trim().trim_start_matches("skipped: ")
}

/// Calls a prepared script and returns its output. Returns `None`, with a line on stderr, if a module or a program that
/// it needs is not installed. Fails if the script fails.
#[track_caller]
pub(crate) fn output(command: &mut Command) -> Option<String> {
    let done = call(command);
    if done.code == SKIPPED {
        say_skipped(reason(&done.out));
        return None;
    }
    if let Some((_, module)) = done.err.split_once("ModuleNotFoundError: ") {
        say_skipped(module.trim());
        return None;
    }
    Some(done.expect(0).out)
}

/// Fails with the output of a script of `tests/readers/` unless it finds the export right or its reader is missing.
#[track_caller]
fn finds_the_export_right(script: &str) {
    if let Some(mut command) = reader(script, None) {
        output(&mut command);
    }
}

macro_rules! readers {
    ($($test:ident: $script:literal,)*) => {$(
        #[test]
        fn $test() {
            finds_the_export_right($script);
        }
    )*};
}

readers! {
    every_line_is_valid_by_the_schema_of_its_export: "jsonschema_lines.py",
    canvas_masks_give_the_scores_of_their_line: "numpy_scores.py",
    opencv_and_pillow_read_the_same_depths_which_lie_on_the_mesh: "opencv_depth.py",
    pandas_reads_the_csv_table: "pandas_csv.py",
    pyarrow_and_pandas_read_the_parquet_table: "pyarrow_parquet.py",
    datasets_loads_the_huggingface_folder: "datasets_huggingface.py",
    webdataset_reads_the_shards: "webdataset_shards.py",
    trimesh_reads_the_coloured_scan: "trimesh_ply.py",
    trimesh_samples_the_right_texels_of_the_textured_scan: "trimesh_glb.py",
    open3d_reads_the_coloured_scan: "open3d_ply.py",
    meshlab_opens_its_project: "pymeshlab_project.py",
    cloudcompare_moves_the_original_scan_by_the_matrix: "cloudcompare_matrix.py",
    the_gltf_validator_finds_no_error: "gltf_validator.py",
    tifffile_pillow_and_opencv_read_the_calibrated_images: "tifffile_images.py",
    imagej_opens_the_calibrated_images: "imagej_images.py",
    pycocotools_decodes_the_masks: "pycocotools_masks.py",
    via_has_the_boxes_of_the_masks: "via_boxes.py",
    the_measuring_example_finds_the_width_of_bars: "example_widths.py",
}

#[test]
fn a_script_fails_with_one_sentence_if_a_number_is_wrong() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let Some(mut command) = reader("numpy_scores.py", Some(dir.path())) else {
        return;
    };
    let right = exported_demo().path("export/jsonl");
    let lines = std::fs::read_to_string(right.join("pairs.jsonl")).expect("lines");
    let mut changed = String::new();
    for line in lines.lines() {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        line["iou"] = (line["iou"].as_f64().expect("a number") + 1e-6).into();
        for path in line["files"].as_object_mut().expect("files").values_mut() {
            *path = right
                .join(path.as_str().expect("a path"))
                .to_string_lossy()
                .into();
        }
        changed.extend([line.to_string(), "\n".to_owned()]);
    }
    std::fs::create_dir(dir.path().join("jsonl")).expect("a folder");
    std::fs::write(dir.path().join("jsonl/pairs.jsonl"), changed).expect("lines");
    let done = call(&mut command);
    if done.code == SKIPPED {
        say_skipped(reason(&done.out));
        return;
    }
    let done = done.expect(1);
    assert!(done.out.contains("iou is"), "{}", done.out);
    assert_eq!(done.out.lines().count(), 1, "{}", done.out);
}

#[test]
fn every_script_is_run_by_a_test() {
    let source = include_str!("readers.rs");
    let shared = ["common.py", "missing.py", "prints.py", "scans.py"];
    for entry in std::fs::read_dir(package_dir().join("tests/readers")).expect("a folder") {
        let name = entry.expect("an entry").file_name();
        let name = name.to_str().expect("UTF-8");
        let is_python = Path::new(name).extension().is_some_and(|kind| kind == "py");
        let is_script = is_python && !shared.contains(&name);
        assert!(
            !is_script || source.contains(&format!(": \"{name}\",")),
            "no test runs {name}"
        );
    }
}
