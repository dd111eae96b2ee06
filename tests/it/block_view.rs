//! Pictures of a whole block, and its page in the browser.

use std::fs;
use std::path::Path;

use mocban::raster::{Grid, ImageLimits, decode};
use serde_json::json;

use crate::browser::{Browser, Tab};
use crate::cli::{binary, mocban};
use crate::made_once::copy_of;
use crate::page::Page;
use crate::small_block::{demo_block, demo_page, few_labels};

/// The page of a block is shown.
pub(crate) const BLOCK_SHOWN: &str =
    "window.mocbanBlock && mocbanBlock.overview.naturalWidth > 100";
/// Vermillion and blue of the overlays.
const STROKE_ONLY: [u8; 3] = [213, 94, 0];
const INK_ONLY: [u8; 3] = [0, 114, 178];

/// Keeps the browser from asking for the layer of the relief until `releaseRelief` is called.
const HOLD_RELIEF: &str = "(() => {
    const { get, set } = Object.getOwnPropertyDescriptor(HTMLImageElement.prototype, 'src');
    Object.defineProperty(HTMLImageElement.prototype, 'src', {
        get,
        set(address) {
            if (address !== 'layer/relief' || window.releaseRelief) set.call(this, address);
            else window.releaseRelief = () => set.call(this, address);
        },
    });
})()";

/// Creates a project `p` with a finished block `b1` of six characters. The truth is in `d/data/truth.json`.
pub(crate) fn finished_block(dir: &Path) {
    copy_of("a finished block", dir, |dir| {
        import_block(dir);
        mocban(dir, &["-C", "p", "run"]).expect(0);
    });
}

/// Like [`finished_block`], with a block of a whole page.
pub(crate) fn finished_page(dir: &Path) {
    copy_of("a finished block of a page", dir, |dir| {
        demo_page(dir);
        import(dir);
        mocban(dir, &["-C", "p", "run"]).expect(0);
    });
}

/// Makes the project of [`finished_block`] with its inputs in this folder, before its run.
pub(crate) fn import_block(dir: &Path) {
    demo_block(dir);
    import(dir);
}

fn import(dir: &Path) {
    few_labels(dir, &dir.join("few.json"));
    let import = [
        "-C",
        "p",
        "import",
        "--block",
        "d/data/block.ply",
        "--page",
        "d/data/page.jpg",
        "--labels",
        "few.json",
        "--name",
        "b1",
    ];
    mocban(dir, &import).expect(0);
}

fn picture(file: &Path) -> Grid<[u8; 3]> {
    let bytes = fs::read(file).expect("a picture");
    let image = decode(&bytes, &ImageLimits::SUGGESTED).expect("an image");
    image
        .rgb
        .map(|colour| colour.map(|value| (value / 257) as u8))
}

/// Counts the pixels that are near to a colour.
fn pixels(picture: &Grid<[u8; 3]>, colour: [u8; 3]) -> usize {
    let is_near = |at: &&[u8; 3]| (0..3).all(|k| at[k].abs_diff(colour[k]) < 12);
    picture.data().iter().filter(is_near).count()
}

/// Checks both pictures of `contact-sheet --block`.
fn check_pictures(dir: &Path) {
    let args = ["-C", "p", "--json", "contact-sheet", "--block", "b1"];
    let written = mocban(dir, &args).expect(0).json();
    assert_eq!(written["characters"], 6);
    let page = dir.join("p/page-b1-boxes.png");
    let file = written["file"].as_str();
    assert!(
        file.is_some_and(|file| file.ends_with("page-b1-boxes.png")),
        "{file:?}"
    );
    let page = picture(&page);
    let outlines = pixels(&page, INK_ONLY);
    assert!(outlines > 6 * 4 * 60 * 3, "{outlines} pixels of outlines");
    let overlay = [&args[..], &["--overlay", "-o", "relief.png"]].concat();
    mocban(dir, &overlay).expect(0);
    let overlay = picture(&dir.join("relief.png"));
    // The page of 9 px/mm is drawn with 12 and with 6 px/mm.
    let ratio = page.width() as f64 / overlay.width() as f64;
    assert!((1.99..2.01).contains(&ratio), "{ratio}");
    let both = pixels(&overlay, [40; 3]);
    let apart = pixels(&overlay, STROKE_ONLY) + pixels(&overlay, INK_ONLY);
    assert!(both > 3 * apart, "{both} pixels agree, {apart} do not");
}

/// Checks the routes of the page without a browser.
fn check_routes(page: Page) {
    for path in [
        "/",
        "/block.json",
        "/layer/page",
        "/region/page/0/0/9/9",
        "/scan/0",
    ] {
        assert_eq!(page.get(path).status, 401, "{path}");
    }
    let page = page.entered();
    let get = |path: &str| page.get(path);
    let block = get("/block.json").json();
    assert_eq!(block["characters"].as_array().map(Vec::len), Some(6));
    for one in block["characters"].as_array().expect("characters") {
        let expected = (&json!(true), &json!(true));
        let is_known = one["status"] == "done" || one["status"] == "low_confidence";
        assert_eq!((&one["has_scan"], &json!(is_known)), expected, "{one}");
    }
    let size = |reply: crate::page::Reply| {
        let image = decode(&reply.body, &ImageLimits::SUGGESTED).expect("an image");
        [image.rgb.width(), image.rgb.height()]
    };
    for layer in ["page", "relief", "overlay"] {
        assert_eq!(
            size(get(&format!("/region/{layer}/400/300/200/100"))),
            [200, 100]
        );
    }
    for path in [
        "/region/page/99999/0/9/9",
        "/region/other/0/0/9/9",
        "/scan/6",
        "/layer/x",
    ] {
        assert_eq!(get(path).status, 404, "{path}");
    }
    assert!(get("/scan/0").body.len() > 10_000);
}

/// Checks the language of the pages of a block, by flag and by locale.
fn check_languages(dir: &Path) {
    for (args, lang, expected) in [
        (&["--lang", "vi"][..], "C", Some("vi")),
        (&["--lang", "en"], "vi_VN.UTF-8", Some("en")),
        (&[], "vi_VN.UTF-8", Some("vi")),
        (&[], "C", None),
    ] {
        let mut command = binary();
        command.current_dir(dir).env("LANG", lang);
        command.env_remove("LC_ALL").env_remove("LC_MESSAGES");
        command.args(["-C", "p", "--json", "view", "--no-open", "b1"]);
        let page = Page::of(command.args(args)).entered();
        for path in ["/", "/boxes", "/correct"] {
            let html = String::from_utf8(page.get(path).body).expect("UTF-8");
            let given = html.split("name=\"page-language\" content=\"").nth(1);
            let given = given.and_then(|rest| rest.split('"').next());
            assert_eq!(given, expected, "{path} {args:?} {lang}");
        }
    }
}

fn number(tab: &Tab<'_>, expression: &str) -> f64 {
    let value = tab.eval(expression);
    value
        .as_f64()
        .unwrap_or_else(|| unreachable!("{expression}: {value}"))
}

/// Returns where the middle of the third box is on the screen.
pub(crate) fn third_box(tab: &Tab<'_>) -> [f64; 2] {
    tab.point(
        "(() => {
            const { camera, canvas, block } = mocbanBlock, [x0, y0, x1, y1] = block.characters[2].box;
            const { left, top } = canvas.getBoundingClientRect();
            return [left + camera.x + camera.zoom * (x0 + x1) / 2, top + camera.y + camera.zoom * (y0 + y1) / 2];
        })()",
    )
}

/// Uses the page as a person does.
fn use_page(tab: &Tab<'_>) {
    let zoom = |tab: &Tab<'_>| number(tab, "mocbanBlock.camera.zoom");
    tab.screenshot("block-page");
    // The first layer has loaded: its end would hide what is said of the next one, whose address is held back.
    tab.wait("mocbanBlock.work.hidden");
    for (key, layer) in [("KeyR", "relief"), ("KeyO", "overlay"), ("KeyP", "page")] {
        tab.key(key);
        if layer == "relief" {
            // Drawing takes a while, and the page says so. The browser does not ask for this layer yet.
            tab.wait("window.releaseRelief");
            tab.wait(
                "!mocbanBlock.work.hidden && mocbanBlock.work.innerText === 'Drawing the relief …'",
            );
            tab.wait("mocbanBlock.overview.classList.contains('block-loading')");
            tab.eval("releaseRelief(), null");
        }
        tab.wait("mocbanBlock.work.hidden");
        tab.wait(&format!(
            "mocbanBlock.overview.complete && mocbanBlock.overview.naturalWidth > 100 && mocbanBlock.layer === '{layer}'"
        ));
        tab.screenshot(&format!("block-{layer}"));
    }
    // The layout of the page may have changed while the layers were loaded.
    tab.key("Digit0");
    let whole = zoom(tab);
    tab.key("Equal");
    assert!((zoom(tab) / whole - 1.4).abs() < 0.01);
    tab.eval(
        "mocbanBlock.canvas.dispatchEvent(new WheelEvent('wheel', { deltaY: -400, clientX: 300, clientY: 300, cancelable: true })), null",
    );
    assert!(zoom(tab) > 2.0 * whole);
    let before = number(tab, "mocbanBlock.camera.x");
    tab.drag([400.0, 300.0], [340.0, 300.0]);
    assert!((number(tab, "mocbanBlock.camera.x") - before + 60.0).abs() < 1.0);
    tab.key("Digit0");
    assert!((zoom(tab) - whole).abs() < 1e-9);
    let [x, y] = third_box(tab);
    let label = tab.eval("mocbanBlock.block.characters[2].label");
    let label = label.as_str().expect("a label");
    tab.eval(&format!(
        "mocbanBlock.canvas.dispatchEvent(new PointerEvent('pointermove', {{ clientX: {x}, clientY: {y} }})), null"
    ));
    tab.wait(&format!(
        "!mocbanBlock.tip.hidden && mocbanBlock.tip.textContent.includes('{label}')"
    ));
    tab.screenshot("block-tip");
    tab.drag([x, y], [x, y]);
    tab.wait("window.mocbanViewer && mocbanBlock.dialog.open");
    assert_eq!(tab.eval("mocbanViewer.header.pair"), format!("b1_{label}"));
    for [width, height] in [[900, 750], [1000, 900], [900, 900], [1000, 750]] {
        tab.resize([width, height]);
        tab.wait(&format!(
            "innerWidth === {width} && innerHeight === {height}"
        ));
        // The layout follows the window in a later frame.
        tab.wait(
            "(() => {
                const [view, dialog] = ['dialog .scan-viewer', 'dialog'].map((one) => document.querySelector(one).getBoundingClientRect());
                const isInside = view.bottom <= dialog.bottom + 0.5 && view.right <= dialog.right + 0.5;
                const isOnScreen = dialog.bottom <= innerHeight + 0.5 && dialog.right <= innerWidth + 0.5;
                return isInside && isOnScreen;
            })()",
        );
    }
    tab.screenshot("block-dialog");
    tab.key("Escape");
    tab.wait("!window.mocbanViewer && !mocbanBlock.dialog.open");
    tab.key("KeyB");
    assert_eq!(
        number(tab, &format!("mocbanBlock.characterAt({x}, {y})")),
        -1.0
    );
    tab.dark(true);
    tab.screenshot("block-dark");
}

#[test]
fn a_block_is_drawn_and_shown_in_the_browser() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    check_pictures(dir.path());
    let args = ["-C", "p", "--json", "view", "--no-open", "b1"];
    let start = || Page::of(binary().current_dir(dir.path()).args(args));
    check_routes(start());
    check_languages(dir.path());
    let Some(browser) = Browser::start() else {
        return;
    };
    let page = start();
    let tab = browser.tab(1000, 750);
    tab.before_scripts(HOLD_RELIEF);
    tab.open(&page.url);
    tab.wait(BLOCK_SHOWN);
    use_page(&tab);
}

#[test]
fn a_block_without_alignment_is_refused_in_one_sentence() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let triangle = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 300 0 0\nvertex 0 200 0\nendloop\nendfacet\nendsolid a\n";
    fs::write(dir.path().join("b1.stl"), triangle).expect("written");
    fs::write(dir.path().join("b1.png"), "no image").expect("written");
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "p"], args].concat());
    at(&["import", "--block", "b1.stl", "--page", "b1.png"]).expect(0);
    let new = at(&["contact-sheet", "--block", "b1"]).expect(4);
    assert!(
        new.err.contains("it has not run yet; use `run` first"),
        "{}",
        new.err
    );
    at(&["run"]).expect(3);
    for args in [
        &["contact-sheet", "--block", "b1", "--overlay"][..],
        &["view", "--no-open", "b1"],
    ] {
        let refused = at(args).expect(4);
        let expected =
            "block b1 is not aligned with its page, so there is nothing to show: align failed: ";
        assert!(refused.err.contains(expected), "{}", refused.err);
        assert_eq!(refused.err.trim_end().lines().count(), 1, "{}", refused.err);
    }
    let unknown = at(&["contact-sheet", "--block", "b2"]).expect(4);
    assert!(
        unknown
            .err
            .contains("there is no block b2; similar ids: b1"),
        "{}",
        unknown.err
    );
    at(&["contact-sheet", "--overlay"]).expect(2);
    at(&["contact-sheet", "b1", "--block", "b1"]).expect(2);
    let metric = ["--overlay", "--metric", "relief"];
    at(&[&["contact-sheet", "--block", "b1"][..], &metric].concat()).expect(2);
}
