//! Numbers in reports and exports after a real run, recomputed from the exported files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mocban::catalog::{Catalog, ImportChunk, ImportRow, ImportTerms, NewVerdict, ReviewContext};
use mocban::config::{self, Sources};
use mocban::demo::{DemoOptions, Tier, write_dataset};
use mocban::domain::{PairName, ThresholdMetric, Verdict};
use mocban::export::pictures::SHEET_WIDTH;
use mocban::export::{
    ContactSheetOptions, ContactSheetOrder, ExportFormat, ExportOptions, draw_contact_sheet,
};
use mocban::manifest::parse_csv;
use mocban::mesh::MeshLimits;
use mocban::raster::{self, Grid, decode_grey8, decode_grey16};
use mocban::report::{Report, build};
use mocban::runner::{self, RunOptions, Stop};
use mocban::store::Project;
use mocban_core::InputLimits;
use serde_json::Value;

/// An arbitrary time.
const NOW: i64 = 1_700_000_000_000;

/// A finished run of three demo pairs, one of them with an empty mesh.
struct FinishedRun {
    dir: tempfile::TempDir,
    project: Project,
    catalog: Catalog,
}

impl FinishedRun {
    async fn new() -> Self {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let project = Project::create(&dir.path().join("project")).expect("a new project");
        let catalog = Catalog::create(&project.catalog_path())
            .await
            .expect("a new catalog");
        let run = Self {
            dir,
            project,
            catalog,
        };
        run.import().await;
        let settings = config::load(&Sources::default())
            .expect("the defaults are sound")
            .config
            .stages;
        let (options, stop) = (RunOptions::default(), Stop::new());
        runner::run(
            &run.project,
            &run.catalog,
            &settings,
            &options,
            &stop,
            |_| {},
        )
        .await
        .expect("the run ends by itself");
        run
    }

    async fn import(&self) {
        let data = self.project.dir().join("data");
        let options = DemoOptions {
            pairs: 3,
            seed: 11,
            tier: Tier::Upright,
        };
        let files = write_dataset(&data, &options, &|| false).expect("the demo is written");
        let manifest = std::fs::read(&files.manifest).expect("the demo has a manifest");
        let rows = parse_csv(&manifest).expect("the demo's manifest is sound");
        std::fs::write(data.join(&rows[2].mesh), "").expect("the third mesh can be emptied");
        let stored = |path: &Path| {
            self.project
                .stored_path(&data.join(path))
                .expect("below the project")
        };
        let rows = rows.iter().map(|row| ImportRow {
            name: row.name.clone(),
            mesh_path: stored(&row.mesh),
            print_path: stored(&row.print),
            unit: row.unit,
            scanned_face_down: row.scanned_face_down,
            character: None,
            block: None,
            meta: serde_json::Map::new(),
            prior: None,
        });
        let (sender, chunks) = tokio::sync::mpsc::channel(2);
        for chunk in [ImportChunk::Rows(rows.collect()), ImportChunk::End] {
            sender.try_send(chunk).expect("room for both");
        }
        let truth = std::fs::read_to_string(&files.truth).expect("the demo has truth");
        let truths = truth.lines().map(|line| {
            let mut value: Value = serde_json::from_str(line).expect("truth is JSON");
            let tops = value["tops_mask"]
                .as_str()
                .expect("the demo has tops masks");
            value["tops_mask"] = stored(Path::new(tops)).into();
            (name(value["id"].as_str().expect("an id")), value)
        });
        let terms = ImportTerms {
            truths: truths.collect(),
            ..ImportTerms::default()
        };
        let imported = self.catalog.import_all(chunks, terms, NOW).await;
        imported.expect("imported");
    }

    async fn report(&self) -> Report {
        build(&self.catalog, &self.project)
            .await
            .expect("the catalog is there")
    }

    async fn export(&self, to: &str) -> PathBuf {
        let target = self.dir.path().join(to);
        let limits = InputLimits {
            mesh: MeshLimits::SUGGESTED,
            image: raster::ImageLimits::SUGGESTED,
        };
        let options = ExportOptions::all_of(&ThresholdMetric::ALL, limits);
        let formats = [ExportFormat::Jsonl];
        let summary =
            mocban::export::export(&self.catalog, &self.project, &target, &formats, options)
                .await
                .expect("the folder is new");
        assert_eq!(
            (summary.pairs.done, summary.pairs.without_result),
            (2, 1),
            "{summary:?}"
        );
        target
    }
}

fn name(text: &str) -> PairName {
    PairName::new(text).expect("demo ids are ids")
}

fn lines(export: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(export.join("pairs.jsonl")).expect("the list is there");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("a line is JSON"))
        .collect()
}

fn grey8(export: &Path, line: &Value, role: &str) -> Grid<u8> {
    let path = export.join(line["files"][role].as_str().expect(role));
    decode_grey8(&std::fs::read(path).expect(role)).expect(role)
}

/// Returns every file below a folder with its bytes.
pub(crate) fn contents(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let below = path.strip_prefix(root).expect("below").to_owned();
                found.insert(below, std::fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

/// Computes `IoU`, Dice and bounding-box `IoU` of two masks by counting pixels with the value 255.
fn agreement(a: &Grid<u8>, b: &Grid<u8>) -> [f64; 3] {
    let set = |grid: &Grid<u8>, x, y| grid.at(x, y) == 255;
    let (mut both, mut either, mut sum) = (0.0, 0.0, 0.0);
    let mut boxes = [[
        f64::INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NEG_INFINITY,
    ]; 2];
    for y in 0..a.height() {
        for x in 0..a.width() {
            let (p, q) = (set(a, x, y), set(b, x, y));
            both += f64::from(u8::from(p && q));
            either += f64::from(u8::from(p || q));
            sum += f64::from(u8::from(p)) + f64::from(u8::from(q));
            for (bounds, _) in boxes.iter_mut().zip([p, q]).filter(|(_, set)| *set) {
                let (x, y) = (x as f64, y as f64);
                *bounds = [
                    bounds[0].min(x),
                    bounds[1].min(y),
                    bounds[2].max(x),
                    bounds[3].max(y),
                ];
            }
        }
    }
    let area = |b: [f64; 4]| (b[2] - b[0] + 1.0).max(0.0) * (b[3] - b[1] + 1.0).max(0.0);
    let [p, q] = boxes;
    let common = area([
        p[0].max(q[0]),
        p[1].max(q[1]),
        p[2].min(q[2]),
        p[3].min(q[3]),
    ]);
    [
        both / either,
        2.0 * both / sum,
        common / (area(p) + area(q) - common),
    ]
}

#[tokio::test(flavor = "multi_thread")]
async fn report_and_export_agree_with_the_exported_files() {
    let run = FinishedRun::new().await;
    let (report, export) = (run.report().await, run.export("first").await);
    scores_equal_those_of_the_exported_masks(&report, &export);
    maps_compose_to_the_product(&export);
    aligned_files_are_in_the_prints_frame(&export);
    failed_pair_is_in_both(&report, &export);
    truth_is_separate_from_verdicts(&report);
    let again = run.export("second").await;
    assert!(contents(&export) == contents(&again), "two exports differ");
    verdicts_make_acc(&run).await;
    sheet_shows_every_pair(&run).await;
}

fn scores_equal_those_of_the_exported_masks(report: &Report, export: &Path) {
    let mut sums: BTreeMap<String, [f64; 3]> = BTreeMap::new();
    for line in lines(export).iter().filter(|line| line["status"] == "done") {
        let print = grey8(export, line, "canvas_print_mask");
        let found = agreement(&print, &grey8(export, line, "canvas_depth_mask"));
        let metric = line["metric"].as_str().expect("a metric").to_owned();
        for ((sum, value), field) in sums
            .entry(metric)
            .or_default()
            .iter_mut()
            .zip(found)
            .zip(["iou", "dice", "iou_box"])
        {
            assert!(
                (line[field].as_f64().expect(field) - value).abs() < 1e-9,
                "{field}: {value}"
            );
            *sum += value;
        }
    }
    for row in &report.rows {
        assert_eq!(row.n, 2);
        let means = sums[row.metric.name()].map(|sum| sum / 2.0);
        for (mean, shown) in means.iter().zip([row.iou, row.dice, row.iou_box]) {
            assert!((mean - shown.expect("two pairs")).abs() < 1e-9);
        }
    }
}

fn maps_compose_to_the_product(export: &Path) {
    let list = lines(export);
    let line = list
        .iter()
        .find(|line| line["status"] == "done")
        .expect("two are done");
    let value = |field: &str, i: usize, j: usize| line[field][i][j].as_f64().expect(field);
    let point = [0.5, -1.25, 2.0, 1.0];
    let row = |field: &str, i: usize| (0..4).map(|j| value(field, i, j) * point[j]).sum::<f64>();
    let plane = [row("plane_from_mesh", 0), row("plane_from_mesh", 1), 1.0];
    let flat = |field: &str, p: [f64; 3]| {
        [0, 1].map(|i| (0..3).map(|j| value(field, i, j) * p[j]).sum::<f64>())
    };
    let [x, y] = flat("depth_from_plane", plane);
    let [u, v] = flat("print_from_depth", [x, y, 1.0]);
    let whole = [0, 1, 2].map(|i| row("print_from_mesh", i));
    for (a, b) in whole.iter().zip([u, v, row("plane_from_mesh", 2)]) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    assert_eq!(
        line["print_from_depth"][2],
        serde_json::json!([0.0, 0.0, 1.0])
    );
}

fn aligned_files_are_in_the_prints_frame(export: &Path) {
    for line in lines(export).iter().filter(|line| line["status"] == "done") {
        let size = |grid: &Grid<u8>| [grid.width(), grid.height()];
        let print = std::fs::read(export.join(line["files"]["print"].as_str().expect("a path")));
        let print = raster::decode(&print.expect("the print"), &raster::ImageLimits::SUGGESTED)
            .expect("an image");
        let wanted = [print.rgb.width(), print.rgb.height()];
        assert_eq!(size(&grey8(export, line, "print_mask")), wanted);
        assert_eq!(size(&grey8(export, line, "aligned_mask")), wanted);
        let depth = export.join(line["files"]["aligned_depth"].as_str().expect("a path"));
        let depth = decode_grey16(&std::fs::read(depth).expect("the depth")).expect("16 bits");
        assert_eq!([depth.width(), depth.height()], wanted);
        let masks = [
            "print_mask",
            "depth_mask",
            "aligned_mask",
            "canvas_print_mask",
            "canvas_depth_mask",
        ];
        for role in masks {
            let mask = grey8(export, line, role);
            assert!(
                mask.data().iter().all(|value| [0, 255].contains(value)),
                "{role}"
            );
            assert!(mask.data().contains(&255), "{role} is empty");
        }
        let folder = export
            .join(line["files"]["depth"].as_str().expect("a path"))
            .with_extension("json");
        let sidecar: Value =
            serde_json::from_slice(&std::fs::read(folder).expect("a sidecar")).expect("JSON");
        for field in ["height_min", "height_per_level", "mesh_unit_per_px"] {
            assert!(sidecar[field].is_f64(), "{field}");
        }
    }
}

fn failed_pair_is_in_both(report: &Report, export: &Path) {
    assert_eq!(report.progress.failed, 1);
    assert_eq!(report.failures[0].class.name(), "bad_input");
    let list = lines(export);
    assert_eq!(list.len(), 12);
    let failed: Vec<_> = list
        .iter()
        .filter(|line| line["status"] == "failed")
        .collect();
    assert_eq!(failed.len(), 4);
    for line in failed {
        assert_eq!(line["error_class"], "bad_input");
        assert!(line["files"].is_null() && line["iou"].is_null() && line["seconds"].is_null());
    }
}

fn truth_is_separate_from_verdicts(report: &Report) {
    for row in &report.rows {
        let truth = row.truth.as_ref().expect("the demo has truth");
        assert_eq!((truth.n, row.acc, row.judged), (2, None, 0));
        assert!(truth.mask_iou_median.is_some(), "{:?}", report.warnings);
    }
}

async fn verdicts_make_acc(run: &FinishedRun) {
    let names = run.catalog.pair_names().await.expect("names");
    let verdict = |pair: &PairName, verdict| NewVerdict {
        pair: pair.clone(),
        metric: None,
        verdict,
        reviewer: "lan".to_owned(),
        reason: None,
        note: None,
        context: ReviewContext::default(),
        at: None,
    };
    let set = vec![
        verdict(&names[0], Verdict::Pass),
        verdict(&names[1], Verdict::Fail),
    ];
    run.catalog
        .verdict_set(set, NOW)
        .await
        .expect("both have results");
    let report = run.report().await;
    for row in &report.rows {
        assert_eq!((row.judged, row.passed, row.failed), (2, 1, 1));
        assert_eq!(row.acc, Some(0.5));
    }
    assert!(report.comparisons.is_empty(), "two pairs are too few");
    let verdicts: Vec<Value> = lines(&run.export("judged").await)
        .into_iter()
        .map(|line| line["verdict"].clone())
        .collect();
    assert_eq!(verdicts[..5], ["pass", "pass", "pass", "pass", "fail"]);
    assert!(verdicts[8].is_null());
}

async fn sheet_shows_every_pair(run: &FinishedRun) {
    let options = ContactSheetOptions {
        metric: ThresholdMetric::Ensemble,
        pairs: None,
        order: ContactSheetOrder::Worst,
        limit: 50,
        columns: 5,
        limits: raster::ImageLimits::SUGGESTED,
    };
    let sheet = draw_contact_sheet(&run.catalog, &run.project, options)
        .await
        .expect("a sheet");
    assert_eq!((sheet.shown, sheet.of), (3, 3));
    assert_eq!(sheet.picture.width(), SHEET_WIDTH);
}
