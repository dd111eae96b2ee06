//! The pages of whole blocks in `mocban app`.

use serde_json::Value;

use crate::accessible::axe;
use crate::app::{app, html, open_app, text};
use crate::app_browser::{enter, looks_right};
use crate::block_correction::{CorrectionSession, printed_side, refused_block, true_points};
use crate::block_view::finished_block;
use crate::browser::Browser;
use crate::check::sql;
use crate::cli::mocban;
use crate::page::Page;
use mocban::store::Project;

const BLOCKS: &str = "/p/p/blocks";
const BLOCK: &str = "/p/p/block/b1/";

#[test]
fn a_finished_block_is_listed_described_and_drawn() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = open_app(dir.path());
    let list = html(&page, BLOCKS);
    assert!(list.contains("href=\"block/b1/\""), "{list}");
    assert!(list.contains("href=\"pairs?block=b1\">6<"), "{list}");
    let failed = html(&page, &format!("{BLOCKS}?state=failed"));
    assert!(!failed.contains("href=\"block/b1/\""), "{failed}");
    let block = html(&page, BLOCK);
    for part in [
        "href=\"view/\"",
        "href=\"view/correct\"",
        "registration with the page",
        "few.json",
        "href=\"../../pair/b1_",
    ] {
        assert!(block.contains(part), "{part}: {block}");
    }
    let view = format!("{BLOCK}view/");
    let back = "<nav class=\"scan-back\"><a href=\"../\">← b1</a></nav>";
    for path in [view.clone(), format!("{view}correct")] {
        assert!(html(&page, &path).contains(back), "{path}");
    }
    assert!(html(&page, &view).contains("block-view.js"));
    let described = page.get(&format!("{view}block.json")).json();
    assert_eq!(described["characters"].as_array().map(Vec::len), Some(6));
    for part in ["layer/page", "layer/overlay", "assets/block-view.js"] {
        assert_eq!(page.get(&format!("{view}{part}")).status, 200, "{part}");
    }
    for path in [
        "/p/p/block/b2/",
        "/p/p/block/b2/view/",
        "/p/p/block/..%2Fb1/view/",
        "/p/p/block/b1/view/layer/x",
    ] {
        assert_eq!(page.get(path).status, 404, "{path}");
    }
}

#[test]
fn the_pictures_of_a_block_open_before_their_files_are_read() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    // The copied project still reads the files of the one that all tests share.
    let image = dir.path().join("other.jpg");
    std::fs::write(&image, "another image").expect("written");
    let project = Project::open(&dir.path().join("p")).expect("a project");
    let path = image.display();
    sql(&project, &format!("UPDATE block SET page_path = '{path}'"));
    let page = open_app(dir.path());
    let view = format!("{BLOCK}view/");
    // The page opens, and the parts of it that need the file say why they are missing.
    assert!(html(&page, &view).contains("href=\"layer/page\""));
    for part in ["block.json", "layer/page", "region/relief/0/0/9/9"] {
        let refused = page.get(&format!("{view}{part}"));
        assert_eq!(refused.status, 503, "{part}");
        let why = text(&refused);
        assert!(
            why.contains("has changed since it was aligned"),
            "{part}: {why}"
        );
    }
    // Without the file there is nothing to open.
    std::fs::remove_file(&image).expect("removed");
    let refused = page.get(&view);
    assert_ne!(refused.status, 200);
    assert!(text(&refused).contains("other.jpg"), "{}", text(&refused));
}

#[test]
fn a_refused_block_is_aligned_by_places_chosen_on_its_page() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    refused_block(dir.path());
    let page = open_app(dir.path());
    let list = html(&page, &format!("{BLOCKS}?state=failed"));
    assert!(list.contains("does not belong to this block"), "{list}");
    let before = html(&page, BLOCK);
    assert!(
        before.contains("align them by places you choose"),
        "{before}"
    );
    assert!(!before.contains("href=\"view/\""), "{before}");
    let opened = page.get(&format!("{BLOCK}view/"));
    assert_eq!(opened.header("location"), Some("correct"));
    let session = CorrectionSession::of(page, "/p/p/block/b1/view");
    let block = session.block();
    let side = &block["sides"][printed_side(dir.path())]["side"];
    let tried = session.tried(side, &true_points(dir.path(), &block));
    let saved = session.save(tried, &Value::Null);
    assert_eq!(saved.status, 200, "{}", text(&saved));
    assert_eq!(saved.json()["next"], Value::Null, "the page has a button");
    assert!(html(&session.page, BLOCK).contains("places were chosen by a person"));
    let run = html(&session.page, "/p/p/");
    for part in ["Align 1 block<", "1 block has other control points"] {
        assert!(run.contains(part), "{part}: {run}");
    }
    mocban(dir.path(), &["-C", "p", "run"]).expect(0);
    // The block is read again, and is aligned now.
    let view = html(&session.page, &format!("{BLOCK}view/"));
    assert!(view.contains("block-view.js"), "{view}");
}

#[test]
fn a_project_without_blocks_says_how_they_come_in() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    crate::page::read_project(&dir);
    let page = open_app(dir.path());
    let list = html(&page, BLOCKS);
    assert!(list.contains("Import a list of blocks"), "{list}");
    let sample = "block,mesh,page,labels,unit\nb04,scans/b04.ply,pages/b04.jpg";
    assert!(list.contains(sample), "{list}");
}

#[test]
fn pages_of_blocks_fit_every_size_and_are_accessible() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1440, 900]);
    for (name, path) in [("blocks", "p/p/blocks"), ("block", "p/p/block/b1/")] {
        let url = format!("{home}{path}");
        looks_right(&browser, &tab, name, &url, axe().as_deref());
    }
    tab.eval("document.querySelector('a[href=\"view/\"]').click(), null");
    tab.wait("location.pathname.endsWith('/view/') && document.querySelector('.block-overview')?.naturalWidth > 100");
    tab.screenshot("app_block_view");
}
