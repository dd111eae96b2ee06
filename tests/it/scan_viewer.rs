//! The 3D view in a browser: `view`, the review page, and exported pages.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use mocban::mesh::MeshLimits;
use mocban::raster::{Grid, ImageLimits, decode};
use serde_json::{Value, json};

use crate::app::app;
use crate::app_browser;
use crate::app_choice::import_more;
use crate::browser::{Browser, Tab};
use crate::cli::{binary, mocban};
use crate::made_once::copy_of;
use crate::page::{Page, read_project, send};
use crate::review_browser::{PLAIN, enter, judge};

/// Chooses visible vertices over the whole scan, and returns for each its position in the frame of exported
/// meshes, the print pixel that the view finds there, and the colour that the canvas shows.
const VISIBLE_VERTICES: &str = "(() => {
    const view = mocbanViewer, found = [];
    view.draw();
    const step = Math.floor(view.header.vertices / 97);
    for (let vertex = 0; vertex < view.header.vertices; vertex += step) {
        const { x, y } = view.project(vertex);
        const hit = view.pick(x, y);
        if (!hit?.pixel || Math.abs(hit.height - view.height(vertex)) > 0.05) continue;
        found.push({ position: view.position(vertex), pixel: hit.pixel, colour: view.pixel(x, y) });
    }
    return found;
})()";

/// Creates a project `p` with one finished pair.
fn one_pair(dir: &Path) -> &'static str {
    copy_of("a pair to view", dir, |dir| {
        let demo = ["demo", "p", "--tier", "pose", "--pairs", "1", "--seed", "5"];
        mocban(dir, &demo).expect(0);
    });
    "pose-0000"
}

/// Returns the print of a pair.
fn print_file(dir: &Path, pair: &str) -> PathBuf {
    let files = std::fs::read_dir(dir.join("p/data/prints")).expect("a folder");
    let mut files = files.map(|entry| entry.expect("an entry").path());
    let is_of_pair = |path: &PathBuf| path.file_stem().is_some_and(|stem| stem == pair);
    files.find(is_of_pair).expect("a print")
}

/// Starts `view`.
fn view(dir: &Path, pair: &str) -> Page {
    let args = ["-C", "p", "--json", "view", "--no-open", pair];
    Page::of(binary().current_dir(dir).args(args))
}

fn mounted<'a>(browser: &'a Browser, url: &str, size: [u32; 2]) -> Tab<'a> {
    let tab = browser.tab(size[0], size[1]);
    tab.open(url);
    tab.wait("window.mocbanViewer");
    tab
}

/// Returns the canvas as a data URL. It must be read in the same task in which it is drawn.
fn canvas(tab: &Tab<'_>) -> String {
    tab.eval("mocbanViewer.draw(), document.querySelector('.scan-canvas canvas').toDataURL()")
        .to_string()
}

fn numbers(value: &Value) -> Vec<f64> {
    let all = value.as_array().expect("a list").iter();
    all.map(|number| number.as_f64().expect("a number"))
        .collect()
}

/// Returns the colour of the print around a pixel; `None` if the colours there differ.
fn uniform_colour(print: &Grid<[u16; 3]>, [u, v]: [f64; 2]) -> Option<[f64; 3]> {
    let (x, y) = (u.round() as i64, v.round() as i64);
    let around = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (x + dx, y + dy)));
    let colours: Option<Vec<[u16; 3]>> = around.map(|(x, y)| print.get(x, y)).collect();
    let colours: Vec<[f64; 3]> = colours?
        .into_iter()
        .map(|colour| colour.map(|c| f64::from(c) / 257.0))
        .collect();
    let middle = colours[12];
    let is_uniform = colours
        .iter()
        .all(|colour| (0..3).all(|k| (colour[k] - middle[k]).abs() < 16.0));
    is_uniform.then_some(middle)
}

/// The map from the frame of exported meshes to print pixels, by the files of other formats.
struct ExportedMap {
    /// Rows of the similarity from the mesh to the frame.
    frame_from_mesh: Vec<Vec<f64>>,
    print_from_mesh: Vec<Vec<f64>>,
}

impl ExportedMap {
    fn read(dir: &Path, pair: &str) -> Self {
        mocban(
            dir,
            &["-C", "p", "export", "--to", "jsonl,mesh", "-o", "out"],
        )
        .expect(0);
        let matrix = dir.join(format!("out/mesh/pairs/{pair}/matrix.txt"));
        let matrix = std::fs::read_to_string(matrix).expect("the matrix");
        let row = |line: &str| {
            let words = line.split_whitespace();
            words.map(|word| word.parse().expect("a number")).collect()
        };
        let lines = std::fs::read_to_string(dir.join("out/jsonl/pairs.jsonl")).expect("the lines");
        let lines = lines
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        let mut ensemble = lines.filter(|line| line["metric"] == "ensemble");
        let line = ensemble.next().expect("a result");
        let rows = line["print_from_mesh"].as_array().expect("rows");
        Self {
            frame_from_mesh: matrix.lines().map(row).collect(),
            print_from_mesh: rows.iter().map(numbers).collect(),
        }
    }

    /// Returns the print pixel of a point of the frame.
    fn pixel(&self, point: &[f64]) -> [f64; 2] {
        let m = &self.frame_from_mesh;
        let square = (0..3).map(|i| m[i][0] * m[i][0]).sum::<f64>();
        // The inverse of a similarity is its transpose divided by the square of its scale.
        let mesh_point =
            [0, 1, 2].map(|k| (0..3).map(|i| m[i][k] * (point[i] - m[i][3])).sum::<f64>() / square);
        [0, 1].map(|i| {
            let row = &self.print_from_mesh[i];
            row[3] + (0..3).map(|k| row[k] * mesh_point[k]).sum::<f64>()
        })
    }
}

#[test]
fn the_print_registers_with_the_relief() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pair = one_pair(dir.path());
    let map = ExportedMap::read(dir.path(), pair);
    let print = std::fs::read(print_file(dir.path(), pair)).expect("the print");
    let print = decode(&print, &ImageLimits::SUGGESTED).expect("an image");
    let print = print.rgb.to_rgb16();
    let page = view(dir.path(), pair);
    let tab = mounted(&browser, &page.url, [900, 700]);
    for (as_printed, turn) in [(true, "0, 0"), (false, "25, -12")] {
        tab.eval(&format!(
            "mocbanViewer.orbit.turn({turn}), mocbanViewer.set({{ ink: 1, shading: 0, asPrinted: {as_printed} }}), null"
        ));
        let found = tab.eval(VISIBLE_VERTICES);
        let (mut dark, mut light) = (0, 0);
        for vertex in found.as_array().expect("a list") {
            let expected = map.pixel(&numbers(&vertex["position"]));
            let pixel = numbers(&vertex["pixel"]);
            let distance = (pixel[0] - expected[0]).hypot(pixel[1] - expected[1]);
            assert!(distance < 1.0, "{vertex}: {expected:?}");
            let Some(colour) = uniform_colour(&print, expected) else {
                continue;
            };
            let shown = numbers(&vertex["colour"]);
            for k in 0..3 {
                assert!((shown[k] - colour[k]).abs() < 20.0, "{vertex}: {colour:?}");
            }
            dark += usize::from(colour[1] < 110.0);
            light += usize::from(colour[1] > 150.0);
        }
        assert!(dark >= 5 && light >= 10, "{dark} dark, {light} light");
    }
}

/// Opens the view of one pair; skips if there is no browser.
fn on_a_view(size: [u32; 2], test: impl FnOnce(&Tab<'_>)) {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pair = one_pair(dir.path());
    let page = view(dir.path(), pair);
    test(&mounted(&browser, &page.url, size));
}

#[test]
fn every_control_changes_the_picture() {
    on_a_view([900, 600], |tab| {
        let start = canvas(tab);
        tab.screenshot("scan-start");
        let mut seen = BTreeSet::from([start.clone()]);
        for (name, settings) in [
            ("wood", "ink: 0"),
            ("ink", "ink: 1"),
            ("raking", "ink: 0, lightDirection: 315, lightHeight: 8"),
            ("threshold", "showsThreshold: true"),
            ("lower", "threshold: mocbanViewer.settings.threshold - 0.5"),
            ("strokes", "showsThreshold: false, showsStrokes: true"),
            ("outline", "showsInkOutline: true"),
            ("plane", "showsPlane: true"),
            ("exaggerated", "exaggeration: 4"),
            ("block", "asPrinted: false"),
        ] {
            tab.eval(&format!("mocbanViewer.set({{ {settings} }}), null"));
            assert!(seen.insert(canvas(tab)), "{name}");
            tab.screenshot(&format!("scan-{name}"));
        }
        for code in ["ArrowLeft", "ArrowUp", "Equal", "KeyW", "BracketLeft"] {
            tab.key(code);
            assert!(seen.insert(canvas(tab)), "{code}");
        }
        tab.drag([200.0, 300.0], [280.0, 340.0]);
        assert!(seen.insert(canvas(tab)), "drag");
        tab.key("Digit0");
        assert_eq!(canvas(tab), start);
        // Arrow keys on a slider move the slider, not the scan.
        tab.eval("document.querySelector('[data-setting=ink]').focus()");
        tab.key("ArrowLeft");
        assert_eq!(tab.eval("mocbanViewer.orbit.azimuth"), 0);
        tab.dark(true);
        tab.screenshot("scan-dark");
        let labels = "[...document.querySelectorAll('.scan-viewer input')].every((input) => input.labels.length === 1)";
        assert_eq!(tab.eval(labels), true);
    });
}

#[test]
fn fingers_turn_zoom_and_move_the_scan() {
    on_a_view([400, 800], |tab| {
        let orbit = |tab: &Tab<'_>| {
            let orbit = tab.eval(
                "[mocbanViewer.orbit.azimuth, mocbanViewer.orbit.tilt, mocbanViewer.orbit.zoom]",
            );
            numbers(&orbit)
        };
        tab.touch(&[[150.0, 200.0]], &[[190.0, 220.0]]);
        let turned = orbit(tab);
        assert!(turned[0] < -5.0 && turned[1] > 2.0, "{turned:?}");
        assert_eq!(turned[2], 1.0);
        tab.touch(
            &[[150.0, 200.0], [200.0, 200.0]],
            &[[120.0, 200.0], [220.0, 200.0]],
        );
        let zoomed = orbit(tab);
        assert!((1.8..2.2).contains(&zoomed[2]), "{zoomed:?}");
        assert_eq!(zoomed[..2], turned[..2], "two fingers do not turn");
    });
}

#[test]
fn a_point_set_is_shown() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pair = one_pair(dir.path());
    let meshes = std::fs::read_dir(dir.path().join("p/data/meshes")).expect("a folder");
    let mesh = meshes
        .map(|entry| entry.expect("an entry").path())
        .next()
        .expect("a mesh");
    let bytes = std::fs::read(&mesh).expect("readable");
    let name = mesh.to_string_lossy();
    let scan = mocban::mesh::read(&bytes, &name, &MeshLimits::SUGGESTED).expect("a mesh");
    let lines = scan
        .vertices
        .iter()
        .map(|[x, y, z]| format!("{x} {y} {z}\n"));
    std::fs::write(dir.path().join("scan.xyz"), lines.collect::<String>()).expect("written");
    let print = print_file(dir.path(), pair);
    let list = format!("id,mesh,print\npoints,scan.xyz,{}\n", print.display());
    std::fs::write(dir.path().join("points.csv"), list).expect("written");
    mocban(dir.path(), &["-C", "q", "import", "points.csv"]).expect(0);
    mocban(dir.path(), &["-C", "q", "run"]).expect(0);
    let args = ["-C", "q", "--json", "view", "--no-open", "points"];
    let page = Page::of(binary().current_dir(dir.path()).args(args));
    let tab = mounted(&browser, &page.url, [600, 500]);
    tab.screenshot("scan-points");
    let wood = canvas(&tab);
    tab.eval("mocbanViewer.set({ ink: 1 }), null");
    assert_ne!(canvas(&tab), wood, "the print colours the points");
    let colours = tab.eval(
        "(() => {
            mocbanViewer.draw();
            const seen = new Set();
            for (let x = 200; x < 400; x += 3) seen.add(mocbanViewer.pixel(x, 250).join());
            return seen.size;
        })()",
    );
    assert!(colours.as_u64() > Some(10), "{colours} colours");
}

#[test]
fn a_pair_without_a_result_shows_its_scan_alone() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    import_more(dir.path(), ["late".to_owned()]);
    let page = Page::of(app(dir.path()).args(["--lang", "vi"]));
    let (tab, home) = app_browser::enter(&browser, &page, [900, 600]);
    let address = format!("{home}p/p/pair/late/3d/");
    tab.open(&address);
    tab.wait("window.mocbanViewer");
    let note = tab.eval("document.querySelector('.scan-note').textContent");
    let expected = "Cặp này chưa có kết quả: chỉ hiện bản quét, chưa có mặt phẳng và bản in.";
    assert_eq!(note, expected);
    let controls = "[...document.querySelectorAll('.scan-controls input')].map((input) => input.dataset.setting)";
    assert_eq!(
        tab.eval(controls),
        json!(["lightDirection", "lightHeight", "shading"])
    );
    tab.screenshot("scan-alone");
    let mut seen = BTreeSet::from([canvas(&tab)]);
    tab.eval("mocbanViewer.set({ lightDirection: 315, lightHeight: 8 }), null");
    assert!(seen.insert(canvas(&tab)), "the scan is drawn");
    // Keys of what is not there do nothing.
    for (code, is_drawn) in [("ArrowLeft", true), ("KeyG", false), ("KeyW", false)] {
        tab.key(code);
        assert_eq!(seen.insert(canvas(&tab)), is_drawn, "{code}");
    }
    let scan = project.dir().join("data/meshes/upright-0000.ply");
    std::fs::write(scan, "solid x").expect("written");
    tab.open(&address);
    let said = "document.getElementById('scan-viewer').textContent";
    tab.wait(&format!(
        "{said}.includes('Không hiển thị được bản quét: ')"
    ));
    let said = tab.eval(said);
    assert!(!said.to_string().contains('{'), "{said}");
}

#[test]
fn an_exported_page_opens_from_the_disk() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pair = one_pair(dir.path());
    let export = ["-C", "p", "export", "--to", "viewer", "-o", "out"];
    mocban(dir.path(), &export).expect(0);
    let file = dir.path().join(format!("out/pairs/{pair}/viewer.html"));
    let file = file.canonicalize().expect("the page");
    let tab = mounted(&browser, &format!("file://{}", file.display()), [800, 600]);
    assert_eq!(tab.eval("mocbanViewer.header.pair"), pair);
    let from_disk = canvas(&tab);
    let page = view(dir.path(), pair);
    let served = mounted(&browser, &page.url, [800, 600]);
    assert!(from_disk == canvas(&served), "the same picture");
    let narrow = mounted(&browser, &format!("file://{}", file.display()), [400, 800]);
    assert_eq!(narrow.eval("document.documentElement.scrollWidth"), 400);
    narrow.screenshot("scan-narrow");
}

#[test]
fn the_review_page_shows_the_scan_and_continues() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let page = Page::start(&read_project(&dir), "lan", &PLAIN);
    let tab = enter(&browser, &page, [1200, 800]);
    let shown = tab.eval("document.body.dataset.shown");
    tab.key("KeyB");
    tab.wait("window.mocbanViewer");
    tab.screenshot("scan-review");
    // The view does not name the pair, which may be an attention check.
    assert_eq!(tab.eval("mocbanViewer.header.pair"), Value::Null);
    tab.key("KeyP");
    assert_eq!(tab.eval("document.body.dataset.shown"), shown);
    tab.key("Escape");
    tab.wait("!window.mocbanViewer && !document.getElementById('scan').open");
    assert_eq!(tab.eval("document.body.dataset.shown"), shown);
    judge(&tab, "KeyP");
}

#[test]
fn what_cannot_be_shown_is_refused_in_one_line() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pair = one_pair(dir.path());
    let call = |args: &[&str]| {
        let refused = mocban(
            dir.path(),
            &[&["-C", "p", "view", "--no-open"], args].concat(),
        );
        assert_eq!(refused.out, "");
        assert_eq!(refused.err.trim_end().lines().count(), 1, "{}", refused.err);
        (refused.code, refused.err)
    };
    let (code, text) = call(&["pose-0009"]);
    assert!(
        code == 4 && text.contains("there is no pair pose-0009"),
        "{text}"
    );
    std::fs::write(print_file(dir.path(), pair), b"another file").expect("written");
    let (code, text) = call(&[pair]);
    assert!(
        code == 1 && text.contains("has changed since it was aligned"),
        "{text}"
    );
    mocban(dir.path(), &["demo", "q", "--pairs", "1", "--no-run"]).expect(0);
    let refused = mocban(dir.path(), &["-C", "q", "view", "upright-0000"]);
    assert_eq!(refused.code, 4, "{}", refused.err);
    assert!(
        refused.err.contains("has no result to show"),
        "{}",
        refused.err
    );
}

#[test]
fn only_the_browser_with_the_token_sees_the_scan() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pair = one_pair(dir.path());
    let page = view(dir.path(), pair);
    for path in ["/", "/scan", "/assets/scan-viewer.js", "/assets/view.js"] {
        assert_eq!(page.get(path).status, 401, "{path}");
        let host = [("host", "evil.example".to_owned())];
        let reply = send(page.address(), "GET", path, &host, b"").expect("a reply");
        assert_eq!(reply.status, 421, "{path}");
    }
    let page = page.entered();
    assert_eq!(page.get_path(page.start_path()).status, 403);
    for path in ["/", "/scan", "/assets/scan-viewer.js", "/assets/view.js"] {
        assert_eq!(page.get(path).status, 200, "{path}");
        assert_eq!(
            page.get_path(path).status,
            401,
            "{path} with the cookie alone"
        );
    }
}
