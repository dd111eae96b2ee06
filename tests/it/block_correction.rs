//! The page on which a person corrects the alignment of a block.

use std::fs;
use std::path::Path;

use mocban::raster::{ImageLimits, decode, png_rgb8};
use serde_json::{Value, json};

use crate::browser::{Browser, Tab};
use crate::cli::{binary, mocban};
use crate::made_once::copy_of;
use crate::page::{Page, Reply, send};
use crate::small_block::{demo_page, stored_block};

/// Part of the page's width and height that the fragment shows.
const FRAGMENT: f64 = 0.42;

/// Creates a project `p` with the block `b1` of a fragment of its page, which is too small for the search. The truth is in
/// `d/data/truth.json`.
pub(crate) fn refused_block(dir: &Path) {
    copy_of("a refused block", dir, refuse_block);
}

/// Makes the project of [`refused_block`] with its inputs in this folder.
fn refuse_block(dir: &Path) {
    demo_page(dir);
    let page = fs::read(dir.join("d/data/page.jpg")).expect("the page");
    let page = decode(&page, &ImageLimits::SUGGESTED)
        .expect("an image")
        .rgb;
    let size = [page.width(), page.height()].map(|side| (side as f64 * FRAGMENT) as usize);
    let narrow = |wide: u16| (wide / 257) as u8;
    let part = mocban::raster::Grid::from_fn(size[0], size[1], |x, y| page.at(x, y).map(narrow));
    fs::write(dir.join("part.png"), png_rgb8(&part)).expect("written");
    let import = [
        "-C",
        "p",
        "import",
        "--block",
        "d/data/block.ply",
        "--page",
        "part.png",
        "--name",
        "b1",
    ];
    mocban(dir, &import).expect(0);
    let run = mocban(dir, &["-C", "p", "run"]).expect(3);
    assert!(run.err.contains("b1"), "{}", run.err);
}

/// Returns the truth of the block.
fn truth(dir: &Path) -> Value {
    let truth = fs::read_to_string(dir.join("d/data/truth.json")).expect("the truth");
    serde_json::from_str(&truth).expect("JSON")
}

/// Returns the faces that were found, in the order of the page's sides.
fn faces(dir: &Path) -> Vec<Value> {
    let shown = stored_block(dir);
    let faces = shown["stages"][0]["outcome"]["faces"].as_array();
    faces.expect("faces").clone()
}

fn vector(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("numbers").iter();
    list.map(|one| one.as_f64().expect("a number")).collect()
}

/// Returns the index of the side that the page shows.
pub(crate) fn printed_side(dir: &Path) -> usize {
    let normal = vector(&truth(dir)["normal"]);
    let looks_there = |face: &Value| {
        let axis = vector(&face["heights"]["frame"]["axes"][2]);
        (0..3).map(|k| axis[k] * normal[k]).sum::<f64>() > 0.9
    };
    faces(dir)
        .iter()
        .position(looks_there)
        .expect("the printed side")
}

/// Returns true places of the fragment as pixels of the two pictures, far from each other.
pub(crate) fn true_points(dir: &Path, block: &Value) -> Vec<Value> {
    let index = printed_side(dir);
    let face = &faces(dir)[index];
    let frame = &face["heights"]["frame"];
    let (centre, mm) = (vector(&frame["centre"]), frame["mm"].as_f64().expect("mm"));
    let (origin, sides) = (
        vector(&face["heights"]["origin_mm"]),
        vector(&face["size_mm"]),
    );
    let size = vector(&block["sides"][index]["size"]);
    let truth = truth(dir);
    let characters = truth["characters"].as_array().expect("characters").iter();
    let places: Vec<[Vec<f64>; 2]> = characters
        .map(|one| {
            let landmark = &one["landmarks"][0];
            let mesh = vector(&landmark["mesh"]);
            let along = |axis: usize| -> f64 {
                let axis = vector(&frame["axes"][axis]);
                (0..3).map(|k| axis[k] * (mesh[k] - centre[k]) * mm).sum()
            };
            let pixel = |k: usize| (along(k) - origin[k]) / sides[k] * size[k];
            [vec![pixel(0), pixel(1)], vector(&landmark["page"])]
        })
        .collect();
    let part = vector(&block["page_size"]);
    let corners = [[0.1, 0.1], [0.9, 0.15], [0.85, 0.9]];
    let nearest = |corner: [f64; 2]| {
        let distance = |place: &[Vec<f64>; 2]| {
            (place[1][0] - corner[0] * part[0]).hypot(place[1][1] - corner[1] * part[1])
        };
        let inside = places
            .iter()
            .filter(|[_, page]| page[0] < part[0] && page[1] < part[1]);
        inside
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .expect("a place")
    };
    let points = corners.map(nearest);
    points
        .map(|[face, page]| json!({"face": face, "page": page}))
        .to_vec()
}

/// A page of the block whose session is open.
pub(crate) struct CorrectionSession {
    pub(crate) page: Page,
    /// Address of the block's pages.
    place: &'static str,
    pub(crate) token: String,
}

impl CorrectionSession {
    fn open(dir: &Path) -> Self {
        let words = ["-C", "p", "--json", "view", "--no-open", "b1"];
        Self::of(
            Page::of(binary().current_dir(dir).args(words)).entered(),
            "",
        )
    }

    /// Returns the session of a page of the block below an address.
    pub(crate) fn of(page: Page, place: &'static str) -> Self {
        let block = page.get(&format!("{place}/correct/block.json")).json();
        let token = block["csrf_token"].as_str().expect("a token").to_owned();
        Self { page, place, token }
    }

    pub(crate) fn block(&self) -> Value {
        let block = format!("{}/correct/block.json", self.place);
        self.page.get(&block).json()
    }

    /// Tries points, and returns the number of the alignment.
    pub(crate) fn tried(&self, side: &Value, points: &[Value]) -> u64 {
        let tried = self.post("/correct/try", &json!({"side": side, "points": points}));
        tried.json()["id"].as_u64().expect("a number")
    }

    /// Saves an alignment on a page that has shown points with a hash.
    pub(crate) fn save(&self, id: u64, saved_hash: &Value) -> Reply {
        self.post(
            "/correct/save",
            &json!({"id": id, "saved_hash": saved_hash}),
        )
    }

    fn post(&self, page: &str, body: &Value) -> Reply {
        self.post_with(&self.token, page, body)
    }

    fn post_with(&self, token: &str, page: &str, body: &Value) -> Reply {
        let mut headers = self.page.headers();
        headers.retain(|(name, _)| *name != "x-csrf-token");
        headers.push(("x-csrf-token", token.to_owned()));
        let path = format!("{}{}{page}", self.page.session, self.place);
        let body = body.to_string();
        send(
            self.page.address(),
            "POST",
            &path,
            &headers,
            body.as_bytes(),
        )
        .expect("a reply")
    }
}

fn error(reply: &Reply) -> String {
    reply.json()["error"]
        .as_str()
        .expect("a sentence")
        .to_owned()
}

/// Checks the routes. Stores the points at the end.
fn check_routes(dir: &Path) {
    let session = CorrectionSession::open(dir);
    let page = &session.page;
    assert_eq!(page.get_path("/correct/block.json").status, 401);
    assert_eq!(page.get("/").header("location"), Some("correct"));
    let block = session.block();
    let failure = block["failure"].as_str().expect("a sentence");
    assert!(
        failure.contains("does not belong to this block"),
        "{failure}"
    );
    let shown = &block["sides"][printed_side(dir)];
    let side = &shown["side"];
    assert_eq!(&block["side"], side, "the page opens on the carved side");
    let side_name = side.as_str().expect("a side");
    let image = page.get(&format!("/correct/face/{side_name}/1"));
    let image = decode(&image.body, &ImageLimits::SUGGESTED).expect("an image");
    assert_eq!(
        json!([image.rgb.height(), image.rgb.width()]),
        shown["size"]
    );
    let points = true_points(dir, &block);
    let body = |points: &[Value]| json!({"side": side, "points": points});
    let send = |points: &[Value]| session.post("/correct/try", &body(points));
    let guessed = session.post_with("guessed", "/correct/try", &body(&points));
    assert_eq!(guessed.status, 403);
    let few = send(&points[..2]);
    assert_eq!(
        (few.status, error(&few)),
        (
            422,
            "2 control points are too few: choose at least 3".to_owned()
        )
    );
    let mut beside = points.clone();
    beside[1]["face"] = json!([-5000.0, 0.0]);
    let beside = error(&send(&beside));
    assert!(
        beside.starts_with("point 2 lies beside the scanned face"),
        "{beside}"
    );
    let mut swapped = points.clone();
    let (a, b) = (points[0]["page"].clone(), points[1]["page"].clone());
    (swapped[0]["page"], swapped[1]["page"]) = (b, a);
    let swapped = error(&send(&swapped));
    assert!(swapped.contains("contradict each other"), "{swapped}");
    let save = |id: u64| session.save(id, &Value::Null);
    assert_eq!(save(1).status, 409);
    assert_eq!(page.get("/correct/overlay/1").status, 404);
    let tried = send(&points);
    assert_eq!(
        tried.status,
        200,
        "{}",
        String::from_utf8_lossy(&tried.body)
    );
    assert!(
        tried.json()["agreement"].as_f64() > Some(0.8),
        "{}",
        tried.json()
    );
    let first = tried.json()["id"].as_u64().expect("a number");
    assert!(page.get(&format!("/correct/overlay/{first}")).body.len() > 10_000);
    // Another tab tries points meanwhile.
    let second = session.tried(side, &points);
    assert_eq!(save(first).status, 409);
    let saved = save(second);
    assert_eq!(saved.status, 200);
    assert!(
        saved.json()["next"]
            .as_str()
            .expect("a command")
            .ends_with("run")
    );
    let again = session.block();
    assert_eq!(again["is_saved"], true);
    assert_eq!(again["saved_hash"], saved.json()["saved_hash"]);
    assert_eq!(again["points"].as_array().map(Vec::len), Some(3));
}

/// Checks that a server replaces neither points of another one nor saves points of a file that was replaced.
fn check_conflicts(dir: &Path) {
    let [one, other] = [CorrectionSession::open(dir), CorrectionSession::open(dir)];
    let [block, seen] = [&one, &other].map(CorrectionSession::block);
    let (seen, side) = (
        &seen["saved_hash"],
        &block["sides"][printed_side(dir)]["side"],
    );
    let points = true_points(dir, &block);
    let moved = {
        let mut points = points.clone();
        points[0]["page"][0] = json!(points[0]["page"][0].as_f64().expect("a number") + 0.5);
        points
    };
    let saved = one.save(one.tried(side, &moved), seen);
    assert_eq!(saved.status, 200);
    let hash = saved.json()["saved_hash"].clone();
    let id = other.tried(side, &points);
    let conflict = other.save(id, seen);
    assert_eq!(conflict.status, 409);
    assert!(error(&conflict).ends_with("reload the page to see them"));
    let removed = other.post("/correct/remove", &json!({ "saved_hash": seen }));
    assert_eq!(removed.status, 409);
    let shown = other.block();
    assert_eq!(shown["saved_hash"], hash, "those of the first server");
    // Another image, which is the same to the eye.
    let page = fs::read(dir.join("part.png")).expect("the page");
    let id = other.tried(side, &points);
    fs::write(dir.join("part.png"), [&page[..], b" "].concat()).expect("written");
    let replaced = other.save(id, &hash);
    assert_eq!(replaced.status, 409);
    let why = error(&replaced);
    assert!(why.contains("part.png was replaced"), "{why}");
    fs::write(dir.join("part.png"), page).expect("written");
    assert_eq!(other.save(id, &hash).status, 200);
}

/// Returns where a pixel of one of the two pictures is on the screen, once the page has its final layout.
pub(crate) fn on_picture(tab: &Tab<'_>, part: &str, at: &Value) -> [f64; 2] {
    tab.point_after_layout(&format!(
        "(() => {{
            const {{ camera, canvas }} = mocbanCorrection.{part}, {{ left, top }} = canvas.getBoundingClientRect();
            const [x, y] = mocbanCorrection.{part}.shown({at});
            return [left + camera.x + (x + 0.5) * camera.zoom, top + camera.y + (y + 0.5) * camera.zoom];
        }})()"
    ))
}

/// Chooses the points as a person does.
fn use_page(dir: &Path, tab: &Tab<'_>) {
    tab.wait("window.mocbanCorrection && mocbanCorrection.face.image.naturalWidth > 100");
    let block = tab.eval("mocbanCorrection.block");
    tab.screenshot("correct-start");
    assert_eq!(
        tab.eval("mocbanCorrection.points.length"),
        3,
        "the saved points"
    );
    let side = &block["sides"][printed_side(dir)]["side"];
    assert_eq!(
        &tab.eval("mocbanCorrection.side"),
        side,
        "of the saved points"
    );
    tab.eval("mocbanCorrection.clearButton.click(), null");
    // The block is carved upside down on this side.
    tab.key("KeyT");
    tab.key("KeyT");
    tab.wait("mocbanCorrection.face.image.complete && mocbanCorrection.face.turns === 2");
    for point in true_points(dir, &block) {
        for part in ["face", "page"] {
            let at = on_picture(tab, part, &point[part]);
            tab.drag(at, at);
        }
    }
    assert_eq!(tab.eval("mocbanCorrection.complete().length"), 3);
    tab.screenshot("correct-points");
    tab.eval("mocbanCorrection.tryButton.click(), null");
    tab.wait("mocbanCorrection.isTried && mocbanCorrection.page.image.naturalWidth > 100 && mocbanCorrection.layer === 'overlay'");
    tab.screenshot("correct-overlay");
    tab.eval("mocbanCorrection.saveButton.click(), null");
    tab.wait("mocbanCorrection.status.textContent.endsWith('run')");
    // A mark removes its point, and the alignment of other points cannot be saved.
    tab.eval("document.querySelector('.block-point').click(), null");
    assert_eq!(tab.eval("mocbanCorrection.points.length"), 2);
    assert_eq!(tab.eval("mocbanCorrection.saveButton.disabled"), true);
    tab.dark(true);
    tab.screenshot("correct-dark");
}

#[test]
fn a_fragment_of_a_page_is_aligned_from_points_that_a_person_chooses() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    refuse_block(dir);
    let start = || {
        Page::of(
            binary()
                .current_dir(dir)
                .args(["-C", "p", "--json", "view", "--no-open", "b1"]),
        )
    };
    check_routes(dir);
    check_conflicts(dir);
    let show = || stored_block(dir);
    assert_eq!(
        show()["control_points"]["points"].as_array().map(Vec::len),
        Some(3)
    );
    if let Some(browser) = Browser::start() {
        let page = start();
        let tab = browser.tab(1400, 800);
        tab.open(&page.url);
        use_page(dir, &tab);
    }
    let plan = mocban(dir, &["-C", "p", "run", "--dry-run"]).expect(0);
    assert!(
        plan.out.contains("b1") || plan.err.contains("b1"),
        "{} {}",
        plan.out,
        plan.err
    );
    // Some characters lie on the edge of the fragment, and their pairs may fail.
    let run = mocban(dir, &["-C", "p", "run"]);
    assert!([0, 3].contains(&run.code), "{}", run.err);
    let done = show();
    assert_eq!(done["status"], "done", "{done}");
    assert!(
        done["characters"].as_u64() > Some(15),
        "{}",
        done["characters"]
    );
    let again = mocban(dir, &["-C", "p", "check"]).expect(0);
    assert!(!again.out.contains("checksum"), "{}", again.out);
}
