//! The size that the app shows before an export, compared with the export.

use serde_json::json;

use crate::app::{html, with_project};
use crate::app_export_zip::export;
use crate::report::contents;

/// Largest ratio of the size that is shown to that of the export, or the other way round.
const FACTOR: f64 = 1.3;

/// Returns the purposes of a page with the sizes that it shows.
fn shown_sizes(part: &str) -> Vec<(String, u64)> {
    let rows = part.split("data-purpose=\"").skip(1);
    let sizes = rows.map(|row| {
        let (name, rest) = row.split_once('"').expect("a purpose");
        let size = rest.split("data-bytes=\"").nth(1);
        let size = size.and_then(|size| size.split('"').next());
        let size = size.expect("a size").parse().expect("a number");
        (name.to_owned(), size)
    });
    sizes.collect()
}

#[test]
fn the_size_of_every_purpose_is_about_that_of_its_export() {
    let (dir, page) = with_project();
    let shown = html(&page, "/p/p/export");
    assert!(shown.contains("data-load=\"export/size\""), "{shown}");
    let part = html(&page, "/p/p/export/size");
    assert!(!part.contains("not enough room"), "{part}");
    let sizes = shown_sizes(&part);
    let purposes = shown.split("id=\"purpose\"").nth(1).expect("the question");
    let (purposes, _) = purposes.split_once("</select>").expect("its end");
    assert_eq!(sizes.len(), purposes.matches("<option").count());
    for (purpose, expected) in sizes {
        let body = json!({"purpose": purpose, "only": "all", "metric": ""});
        export(&page, &body);
        let files = contents(&dir.path().join("p/exports").join(&purpose));
        let written: usize = files.values().map(Vec::len).sum();
        let ratio = expected as f64 / written as f64;
        assert!(
            (1.0 / FACTOR..FACTOR).contains(&ratio),
            "{purpose}: {expected} bytes shown, {written} written"
        );
    }
}
