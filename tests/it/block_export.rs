//! Exports of whole blocks: the origins of pairs, the map of the scan to the page, and the page with its boxes.

use std::fs;
use std::path::Path;

use mocban::catalog::Catalog;
use mocban::domain::{BlockName, TrueBox};
use mocban::raster::{ImageLimits, decode};
use mocban::store::Project;
use nalgebra::{Matrix3, Matrix3x2, RowVector2, Vector3};
use serde_json::{Value, json};

use crate::block_view::finished_block;
use crate::cli::{Call, mocban};

/// Greatest error of a mapped landmark, pixels of the page: a fifth of a millimetre, or 2 % of a character.
const MAX_ERROR_PX: f64 = 2.0;
/// Nodes of the grid from which a point is interpolated.
const NEAREST: usize = 6;

fn project(dir: &Path, args: &[&str]) -> Call {
    mocban(dir, &[&["-C", "p"], args].concat())
}

fn lines(file: &Path) -> Vec<Value> {
    let text = fs::read_to_string(file).expect("the lines");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let list = value.as_array().expect("a list").iter();
    let list: Vec<f64> = list.map(|one| one.as_f64().expect("a number")).collect();
    list.try_into().expect("the length")
}

fn matrix<const R: usize, const C: usize>(value: &Value) -> [[f64; C]; R] {
    let rows = value.as_array().expect("rows").iter().map(numbers);
    rows.collect::<Vec<_>>().try_into().expect("the rows")
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Returns the landmarks of the character at a box: points of the scan and pixels of the page.
fn landmarks(truth: &Value, bounds: [f64; 4]) -> Vec<([f64; 3], [f64; 2])> {
    let middle = |b: [f64; 4]| [f64::midpoint(b[0], b[2]), f64::midpoint(b[1], b[3])];
    let characters = truth["characters"].as_array().expect("characters").iter();
    let shown = characters.filter(|one| one["on_page"] == true);
    let at = |one: &&Value| distance(middle(numbers(&one["box_px"])), middle(bounds));
    let nearest = shown.min_by(|a, b| at(a).total_cmp(&at(b)));
    let nearest = nearest.expect("a character");
    assert!(at(&nearest) < 20.0, "no character is at {bounds:?}");
    let points = nearest["landmarks"].as_array().expect("landmarks").iter();
    points
        .map(|point| (numbers(&point["mesh"]), numbers(&point["page"])))
        .collect()
}

/// Checks the fields of pairs that were cut from the block, against the truth and the exported print.
fn check_pairs(out: &Path, truth: &Value) {
    let all = lines(&out.join("pairs.jsonl"));
    let pairs = all.iter().filter(|line| line["metric"] == "ensemble");
    let mut checked = 0;
    for pair in pairs {
        let label = pair["label"].as_str().expect("a label");
        assert_eq!(pair["id"], format!("b1_{label}"));
        assert_eq!(pair["block"], "b1");
        let bounds: [f64; 4] = numbers(&pair["box"]);
        let page_from_mesh: [[f64; 4]; 3] = matrix(&pair["page_from_mesh"]);
        for (mesh, page) in landmarks(truth, bounds) {
            let [x, y, height] =
                page_from_mesh.map(|[a, b, c, d]| a * mesh[0] + b * mesh[1] + c * mesh[2] + d);
            let error = distance([x, y], page);
            assert!(error < MAX_ERROR_PX, "{label}: {error} px");
            let height_mm = height * pair["mm_per_mesh_unit"].as_f64().expect("a unit");
            assert!(height_mm.abs() < 0.4, "{label}: {height_mm} mm");
            checked += 1;
        }
        // The print contains the box, with a small margin.
        let page_from_crop: [[f64; 3]; 3] = matrix(&pair["page_from_crop"]);
        assert_eq!(page_from_crop[2], [0.0, 0.0, 1.0]);
        let print = pair["files"]["print"].as_str().expect("a path");
        let print = fs::read(out.join(print)).expect("the print");
        let print = decode(&print, &ImageLimits::SUGGESTED)
            .expect("an image")
            .rgb;
        let last = [print.width() - 1, print.height() - 1].map(|side| side as f64);
        let corner = |[i, j]: [f64; 2]| {
            [0, 1].map(|k: usize| {
                let [a, b, c] = page_from_crop[k];
                a * i + b * j + c
            })
        };
        let (first, last) = (corner([0.0; 2]), corner(last));
        for k in 0..2 {
            let margins = [
                bounds[k] - first[k].min(last[k]),
                first[k].max(last[k]) - bounds[k + 2],
            ];
            assert!(
                margins.iter().all(|m| (0.0..20.0).contains(m)),
                "{label}: {margins:?}"
            );
        }
    }
    assert!(checked >= 6 * 8, "{checked} landmarks");
}

/// Interpolates a point from the nearest nodes by an affine map in the plane of the face. `across` and `down` span it.
fn interpolated(
    mesh: &[[f64; 3]],
    page: &[[f64; 2]],
    [across, down]: [Vector3<f64>; 2],
    point: [f64; 3],
) -> [f64; 2] {
    let point = Vector3::from(point);
    let offset = |k: usize| Vector3::from(mesh[k]) - point;
    let mut nodes: Vec<usize> = (0..mesh.len()).collect();
    nodes.sort_by(|a, b| offset(*a).norm().total_cmp(&offset(*b).norm()));
    let (mut normal, mut right) = (Matrix3::zeros(), Matrix3x2::zeros());
    for k in nodes.into_iter().take(NEAREST) {
        let row = Vector3::new(offset(k).dot(&across), offset(k).dot(&down), 1.0);
        normal += row * row.transpose();
        right += row * RowVector2::from(page[k]);
    }
    let solved = normal
        .cholesky()
        .expect("nodes around the point")
        .solve(&right);
    [solved[(2, 0)], solved[(2, 1)]]
}

/// Checks the grid of a block against the landmarks of all characters of the page.
fn check_grid(block: &Value, truth: &Value) {
    assert_eq!(
        [&block["status"], &block["unit"]],
        [&Value::from("done"), &truth["unit"]]
    );
    assert_eq!(block["accepted"], true);
    assert_eq!(block["characters"], 6);
    assert!(
        block["agreement"].as_f64() > Some(0.8),
        "{}",
        block["agreement"]
    );
    let list = |name: &str| block["map"][name].as_array().expect("a list").clone();
    let mesh: Vec<[f64; 3]> = list("mesh").iter().map(numbers).collect();
    let page: Vec<[f64; 2]> = list("page").iter().map(numbers).collect();
    assert_eq!(mesh.len(), page.len());
    // A node every 5 mm.
    let area_mm2: f64 = numbers::<2>(&truth["block_mm"]).into_iter().product();
    let share = mesh.len() as f64 * 25.0 / area_mm2;
    assert!((0.6..1.4).contains(&share), "{share} of the face");
    let normal = Vector3::from(numbers(&truth["normal"]));
    let across = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let plane = [across, normal.cross(&across)];
    let characters = truth["characters"].as_array().expect("characters").iter();
    let mut errors = Vec::new();
    for one in characters.filter(|one| one["on_page"] == true) {
        for point in one["landmarks"]
            .as_array()
            .expect("landmarks")
            .iter()
            .step_by(2)
        {
            let found = interpolated(&mesh, &page, plane, numbers(&point["mesh"]));
            errors.push(distance(found, numbers(&point["page"])));
        }
    }
    assert!(errors.len() > 200);
    errors.sort_by(f64::total_cmp);
    let worst = errors[errors.len() - 1];
    assert!(worst < 2.0 * MAX_ERROR_PX, "{worst} px");
    let usual = errors[errors.len() * 95 / 100];
    assert!(usual < MAX_ERROR_PX, "{usual} px");
}

/// Checks that the boxes on the exported page can be imported as labels, and leave all pairs as they are.
fn check_page_labels(dir: &Path) {
    project(dir, &["export", "--to", "annotations", "-o", "boxes"]).expect(0);
    let labels = fs::read_to_string(dir.join("boxes/pages/b1.json")).expect("VIA");
    let coco = fs::read(dir.join("boxes/pages/b1.coco.json")).expect("COCO");
    let coco: Value = serde_json::from_slice(&coco).expect("JSON");
    assert_eq!(coco["annotations"].as_array().map(Vec::len), Some(6));
    let page = fs::read(dir.join("boxes/pages/b1.jpg")).expect("the page");
    assert_eq!(
        page,
        fs::read(dir.join("d/data/page.jpg")).expect("the page")
    );
    assert!(labels.contains(&format!("\"b1.jpg{}\"", page.len())));
    let import = [
        "import",
        "--block",
        "d/data/block.ply",
        "--page",
        "d/data/page.jpg",
        "--labels",
        "boxes/pages/b1.json",
        "--name",
        "b1",
        // The project was made in another folder, where its files are.
        "--allow-changed-files",
    ];
    project(dir, &import).expect(0);
    let before = project(dir, &["report", "--json"]).expect(0).out;
    let run = project(dir, &["run", "--json"]).expect(0).json();
    assert_eq!(run["blocks"]["done"], 1, "{run}");
    assert_eq!(project(dir, &["report", "--json"]).expect(0).out, before);
    // Fractions of the page are no whole pixels.
    let line = |one: &Value| {
        let [x, y, width, height]: [f64; 4] = numbers(&one["bbox"]);
        let side = |name: &str| coco["images"][0][name].as_f64().expect("pixels");
        let [x, width] = [x + width / 2.0, width].map(|at| at / side("width"));
        let [y, height] = [y + height / 2.0, height].map(|at| at / side("height"));
        format!("0 {x:.5} {y:.5} {width:.5} {height:.5}\n")
    };
    let boxes = coco["annotations"].as_array().expect("a list").iter();
    fs::write(
        dir.join("fractions.txt"),
        boxes.map(line).collect::<String>(),
    )
    .expect("written");
    let run_with = |labels: &'static str| {
        let mut import = import;
        import[6] = labels;
        project(dir, &import).expect(0);
        project(dir, &["run"]).expect(0).err
    };
    run_with("fractions.txt");
    project(dir, &["export", "--to", "annotations", "-o", "boxes"]).expect(0);
    let run = run_with("boxes/pages/b1.json");
    let unchanged = "block b1: 0 pairs added, 0 changed, 0 retired";
    assert!(run.contains(unchanged), "{run}");
}

#[test]
fn exports_of_a_block_lead_from_its_scan_to_its_page() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let truth = fs::read(dir.path().join("d/data/truth.json")).expect("the truth");
    let truth: Value = serde_json::from_slice(&truth).expect("JSON");
    for out in ["out", "again"] {
        project(dir.path(), &["export", "-o", out]).expect(0);
    }
    let out = dir.path().join("out");
    for file in ["pairs.jsonl", "blocks.jsonl"] {
        let [first, second] = ["out", "again"].map(|name| dir.path().join(name).join(file));
        assert!(
            fs::read(first).ok() == fs::read(second).ok(),
            "{file} differs"
        );
    }
    check_pairs(&out, &truth);
    let blocks = lines(&out.join("blocks.jsonl"));
    assert_eq!(blocks.len(), 1);
    check_grid(&blocks[0], &truth);
    let readme = fs::read_to_string(out.join("README.md")).expect("a README");
    assert!(
        readme.contains("| `agreement` | number or null | 0-1 |"),
        "{readme}"
    );
    check_report(dir.path());
    check_page_labels(dir.path());
    check_refused_block(dir.path());
    check_damage(dir.path());
}

/// Checks that the report has no precision and recall of boxes that come from labels.
fn check_report(dir: &Path) {
    let without = project(dir, &["report", "--json"]).expect(0).json();
    assert!(without.get("blocks").is_none());
    let truth = vec![TrueBox {
        bounds: [1.0, 2.0, 30.0, 40.5],
        is_partial: false,
    }];
    let set = async {
        let catalog = Catalog::open(&Project::at(&dir.join("p")).catalog_path()).await;
        let catalog = catalog.expect("a catalog");
        let name = BlockName::new("b1").expect("a name");
        let set = catalog.set_true_boxes(&name, &truth).await;
        catalog.close().await;
        set.expect("stored")
    };
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    assert!(runtime.block_on(set));
    let with = project(dir, &["report", "--json"]).expect(0).json();
    let expected = json!([{
        "block": "b1", "characters": 1, "found": 0, "right": 0, "tight": 0, "boxes": null,
    }]);
    assert_eq!(with["blocks"], expected);
    project(dir, &["check"]).expect(0);
}

/// Checks that a block that failed has a line, unless results are selected.
fn check_refused_block(dir: &Path) {
    fs::write(dir.join("b0.stl"), "solid a\nendsolid a\n").expect("written");
    fs::write(dir.join("b0.png"), "no image").expect("written");
    let list = "block,mesh,page,shelfmark\nb0,b0.stl,b0.png,R.12\n";
    fs::write(dir.join("b0.csv"), list).expect("written");
    project(dir, &["import", "b0.csv"]).expect(0);
    project(dir, &["run"]).expect(3);
    project(dir, &["export", "-o", "out"]).expect(0);
    let all = lines(&dir.join("out/blocks.jsonl"));
    let names: Vec<&Value> = all.iter().map(|line| &line["block"]).collect();
    assert_eq!(names, ["b0", "b1"]);
    assert_eq!(all[0]["status"], "failed");
    assert_eq!(all[0]["meta"], json!({ "shelfmark": "R.12" }));
    assert_eq!(all[1]["meta"], json!({}));
    assert!(
        all[0]["error"]
            .as_str()
            .is_some_and(|why| why.contains("b0")),
        "{}",
        all[0]
    );
    for name in ["side", "accepted", "agreement", "map"] {
        assert_eq!(all[0][name], Value::Null, "{name}");
    }
    let only = ["export", "--min-confidence", "0", "-o", "some"];
    project(dir, &only).expect(0);
    let some = lines(&dir.join("some/blocks.jsonl"));
    assert_eq!((some.len(), &some[0]["block"]), (1, &Value::from("b1")));
    let of_metric = ["contact-sheet", "--block", "b1", "--metric"];
    project(dir, &[&of_metric[..], &["relief"]].concat()).expect(0);
}

/// Checks that an earlier export is kept if the heights of a block are lost.
fn check_damage(dir: &Path) {
    let shown = project(dir, &["show", "b1", "--json"]).expect(0).json();
    let artifacts = Path::new(shown["artifacts_dir"].as_str().expect("a path")).to_owned();
    let files = shown["stages"][0]["files"].as_object().expect("files");
    for file in files.values() {
        let hash = file["hash"].as_str().expect("a hash");
        let folder = dir.join(&artifacts).join(&hash[..2]);
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.to_string_lossy().contains(hash) {
                fs::remove_file(path).expect("removed");
            }
        }
    }
    let earlier = fs::read(dir.join("out/blocks.jsonl")).expect("the lines");
    let failed = project(dir, &["export", "-o", "out"]).expect(3);
    assert!(
        failed.err.contains("the export lacks files of block b1: "),
        "{}",
        failed.err
    );
    assert!(
        failed.err.contains("the files of 1 block"),
        "{}",
        failed.err
    );
    assert_eq!(
        fs::read(dir.join("out/blocks.jsonl")).expect("the lines"),
        earlier
    );
    project(dir, &["export", "-o", "new", "--json"]).expect(3);
    let lines = lines(&dir.join("new/blocks.jsonl"));
    assert_eq!(
        (&lines[1]["status"], &lines[1]["map"]),
        (&Value::from("failed"), &Value::Null)
    );
}
