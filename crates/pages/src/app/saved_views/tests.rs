//! Views are saved, renamed and removed, and none is lost.

use std::path::Path;

use super::{MAX_VIEWS, SavedView, VIEWS_FILE, ViewChange, change, read, view_name};
use crate::app::address::PageQuery;
use crate::app::failure::AppFailure;
use crate::review::Language;

fn view(name: &str, list: &str) -> SavedView {
    SavedView::new(name, &PageQuery::parse(list)).expect("a view")
}

fn names(dir: &Path) -> Vec<String> {
    let views = read(dir).expect("views").into_iter();
    views.map(|view| view.name).collect()
}

/// Changes the views in a way that is refused, and returns why.
fn refused(dir: &Path, refused: ViewChange) -> String {
    let failure: AppFailure = change(dir, refused).expect_err("it is refused");
    failure.text(Language::English).to_owned()
}

#[test]
fn views_are_saved_renamed_and_removed() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    assert!(names(dir).is_empty());
    let low = view(" Thấp ", "confidence=low&block=b+03");
    assert_eq!(
        (low.name.as_str(), low.list.as_str()),
        ("Thấp", "confidence=low&block=b%2003")
    );
    let failed = view("hỏng/1", "state=failed");
    for saved in [&low, &failed, &low] {
        change(dir, ViewChange::Save(saved.clone())).expect("saved");
    }
    assert_eq!(read(dir).expect("views"), [failed.clone(), low.clone()]);
    let why = refused(dir, ViewChange::Save(view("THẤP", "state=failed")));
    assert!(why.contains("there is a saved view \"Thấp\""), "{why}");
    let why = refused(dir, ViewChange::Rename(failed.clone(), "thấp".to_owned()));
    assert!(why.contains("there is a saved view \"Thấp\""), "{why}");
    let renamed = ViewChange::Rename(low.clone(), "thấp nhất".to_owned());
    change(dir, renamed).expect("renamed");
    assert_eq!(names(dir), ["hỏng/1", "thấp nhất"]);
    for stale in [
        ViewChange::Remove(low.clone()),
        ViewChange::Rename(low, "x".to_owned()),
        ViewChange::Remove(view("hỏng/1", "state=aligned")),
    ] {
        let why = refused(dir, stale);
        assert!(why.contains("there is no saved view"), "{why}");
    }
    change(dir, ViewChange::Remove(failed)).expect("removed");
    assert_eq!(names(dir), ["thấp nhất"]);
}

#[test]
fn changes_at_the_same_time_are_all_kept_up_to_the_limit() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    std::thread::scope(|scope| {
        for tab in 0..4 {
            scope.spawn(move || {
                for number in 0..MAX_VIEWS / 4 {
                    let new = view(&format!("{tab} {number:02}"), "state=failed");
                    change(dir, ViewChange::Save(new)).expect("saved");
                }
            });
        }
    });
    let saved = names(dir);
    assert_eq!(saved.len(), MAX_VIEWS);
    assert!(saved.is_sorted(), "{saved:?}");
    let why = refused(dir, ViewChange::Save(view("one more", "state=failed")));
    assert!(why.contains("at most 100 views"), "{why}");
}

#[test]
fn a_name_is_short_and_visible_in_any_script() {
    for name in ["低信心", "a", &"ữ".repeat(60), "số 1/2?"] {
        assert_eq!(view_name(&format!(" {name} ")).ok().as_deref(), Some(name));
    }
    for bad in ["", " ", "..", ".x", "a\nb", "a\u{202e}b", &"ữ".repeat(61)] {
        view_name(bad).expect_err(bad);
    }
    SavedView::new("all", &PageQuery::default()).expect_err("it is the list of all pairs");
    let long = PageQuery::default().with("block", &"x".repeat(3000));
    SavedView::new("long", &long).expect_err("it is too long");
}

#[test]
fn a_damaged_file_is_named_and_never_replaced() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (dir, file) = (dir.path(), dir.path().join(VIEWS_FILE));
    let many = view("x", "state=failed");
    let many = serde_json::json!({ "views": vec![many; MAX_VIEWS + 1] }).to_string();
    for text in [
        "",
        "{\"views\":[",
        "{\"views\":[{\"name\":\"..\",\"list\":\"state=failed\"}]}",
        &many,
    ] {
        std::fs::write(&file, text).expect("written");
        let why = refused(dir, ViewChange::Save(view("new", "state=failed")));
        assert!(why.contains(VIEWS_FILE), "{why}");
        assert_eq!(std::fs::read_to_string(&file).expect("the file"), text);
    }
}
