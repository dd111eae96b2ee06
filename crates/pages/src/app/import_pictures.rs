//! Pictures of the files of whole blocks before they are imported: the page with the boxes of its labels, and the scan.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use axum::body::Bytes;
use axum::extract::{Path as AddressPath, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use maud::{Markup, html};

use super::components::grouped;
use super::encoded_picture::{JPEG, jpeg};
use super::failure::{AppFailure, AppResult};
use super::import_choice::ImportChoice;
use super::import_headers::{FileHeaders, FilePlaces, PlannedFiles, UnreadFile};
use super::state::AppState;
use super::visit::Visit;
use mocban_core::InputLimits;
use mocban_core::domain::{enum_names, one_line};
use mocban_export::import_pictures::{page_with_boxes, points_from_above};
use mocban_export::pictures::Rgb;
use mocban_lists::labels::LabelBox;
use mocban_project::file_headers::{ScanKind, page_image, scan_points};

/// Longer side of a picture, pixels.
const SIDE: usize = 560;

/// A picture of a file of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ImportPicture {
    /// The page with the boxes of its labels.
    Page,
    /// Points of the scan as a relief.
    Scan,
}

enum_names! { pub ImportPicture, "a picture of an import":
    Page = "page", Scan = "scan",
}

/// Returns the pictures of blocks, which the browser loads when they are in sight.
pub(super) fn pictures_part(visit: &Visit, headers: &[FileHeaders], from: u64) -> Markup {
    let blocks = (from..).zip(headers);
    let blocks = blocks.filter(|(_, one)| one.files.kind == ScanKind::Block);
    html! {
        @for (place, one) in blocks { section.card.block-files {
            h3 { (one_line(&one.files.name)) }
            p { (labels_text(visit, one)) }
            div.row {
                @if one.print.is_ok() { (picture(visit, ImportPicture::Page, place, &one.files.name)) }
                @if has_positions(one) { (picture(visit, ImportPicture::Scan, place, &one.files.name)) }
            }
        } }
    }
}

/// Returns whether positions of a scan are known, so that there is a picture of it.
fn has_positions(one: &FileHeaders) -> bool {
    one.scan.as_ref().is_ok_and(|scan| scan.sides.is_some())
}

fn picture(visit: &Visit, picture: ImportPicture, place: u64, name: &str) -> Markup {
    let what = match picture {
        ImportPicture::Page => visit.t("Page with its labels", "Trang in với các nhãn"),
        ImportPicture::Scan => visit.t("Scan, seen from above", "Bản quét, nhìn từ trên"),
    };
    let query = visit.query.with("place", &place.to_string()).text();
    let address = format!("import/picture/{}{query}", picture.name());
    html! {
        figure {
            img loading="lazy" src=(address) alt={ (what) ": " (one_line(name)) };
            figcaption.muted { (what) }
        }
    }
}

/// Says how many characters the labels of a page have, or why they cannot be used.
fn labels_text(visit: &Visit, one: &FileHeaders) -> Markup {
    html! {
        @match &one.labels {
            Some(Ok((count, format))) => {
                (visit.t("Labels", "Nhãn")) ": " b { (grouped(*count)) } " "
                (visit.t("characters", "chữ")) " (" (format.name()) ")"
            },
            Some(Err(why)) => span.bad[matches!(why, UnreadFile::Unusable(_))] { (one_line(why.sentence().text(visit.language))) },
            None if one.files.labels.is_none() => (visit.t("No labels: a run looks for the characters on the page.", "Không có nhãn: lần chạy sẽ tìm các chữ trên trang in.")),
            None => (visit.t(
                "The labels are not counted, because the page cannot be used.",
                "Không đếm nhãn vì không dùng được trang in.",
            )),
        }
    }
}

/// Responds with a picture of a block that would be imported, by its place in the list.
pub(super) async fn draw(
    State(state): State<Arc<AppState>>,
    AddressPath(picture): AddressPath<String>,
    visit: Visit,
) -> AppResult<Response> {
    let picture: ImportPicture = picture
        .parse()
        .map_err(|_unknown: String| AppFailure::not_found())?;
    let place: u64 = visit.query.parsed("place").unwrap_or_default();
    let chosen = ImportChoice::of(&visit.query);
    let work = {
        let state = Arc::clone(&state);
        move || drawn(&state, &chosen, picture, place)
    };
    let picture = state.import_work.call(work).await??;
    Ok(([(header::CONTENT_TYPE, JPEG)], picture).into_response())
}

/// Returns a picture as JPEG. It is drawn only if no picture of the same files is kept.
fn drawn(
    state: &AppState,
    chosen: &ImportChoice,
    picture: ImportPicture,
    place: u64,
) -> AppResult<Bytes> {
    let places = FilePlaces::new(chosen, &state.options.folder);
    let files = chosen.planned_block(state, &places, place);
    let files = files.ok_or_else(AppFailure::not_found)?;
    let used: Vec<&Path> = match picture {
        ImportPicture::Page => std::iter::once(&files.print)
            .chain(&files.labels)
            .map(PathBuf::as_path)
            .collect(),
        ImportPicture::Scan => vec![files.scan.as_path()],
    };
    let key = versions(&used).map(|used| format!("import {} {used:?}", picture.name()));
    if let Some(kept) = key.as_deref().and_then(|key| state.thumbs.get(key)) {
        return Ok(kept);
    }
    let limits = places.limits();
    let drawn = match picture {
        ImportPicture::Page => draw_page(&files, &places, &limits),
        ImportPicture::Scan => draw_scan(&files, &places, &limits),
    };
    let drawn = drawn.map_err(|why| AppFailure::refused(why.sentence()))?;
    let (_, bytes) = jpeg(&drawn);
    let bytes = Bytes::from(bytes);
    if let Some(key) = key {
        state.thumbs.add(key, bytes.clone());
    }
    Ok(bytes)
}

/// Returns paths, each with length and time of its file. `None` if one is not known.
fn versions<'p>(paths: &[&'p Path]) -> Option<Vec<(&'p Path, u64, SystemTime)>> {
    let version = |path: &&'p Path| {
        let meta = std::fs::metadata(path).ok()?;
        Some((*path, meta.len(), meta.modified().ok()?))
    };
    paths.iter().map(version).collect()
}

/// Draws a page. Labels that cannot be used are left out; the page of imports says why.
fn draw_page(
    files: &PlannedFiles,
    places: &FilePlaces,
    limits: &InputLimits,
) -> Result<Rgb, UnreadFile> {
    let image = places.read(&files.print, |path| page_image(path, &limits.image))?;
    let size = [image.rgb.width() as u32, image.rgb.height() as u32];
    let labels = files.labels.as_deref();
    let found = labels.and_then(|labels| files.boxes(labels, size, places).ok());
    let boxes = found.map_or_else(Vec::new, |found| {
        found.boxes.iter().map(LabelBox::bounds).collect()
    });
    Ok(page_with_boxes(&image, &boxes, SIDE))
}

fn draw_scan(
    files: &PlannedFiles,
    places: &FilePlaces,
    limits: &InputLimits,
) -> Result<Rgb, UnreadFile> {
    let points = places.read(&files.scan, |path| scan_points(path, &limits.mesh))?;
    let picture = points_from_above(&points, SIDE);
    picture.ok_or_else(|| UnreadFile::of_program("the mesh has no vertices"))
}

#[cfg(test)]
mod tests {
    use super::labels_text;
    use crate::app::import_headers::{FileHeaders, PlannedFiles, UnreadFile};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_project::file_headers::ScanKind;

    #[test]
    fn labels_of_a_page_that_cannot_be_used_are_said_not_to_be_counted() {
        let one = FileHeaders {
            files: PlannedFiles {
                name: "b".to_owned(),
                kind: ScanKind::Block,
                scan: "b.stl".into(),
                print: "b.png".into(),
                labels: Some("b.json".into()),
                unit: None,
            },
            scan: Err(UnreadFile::Outside),
            print: Err(UnreadFile::Outside),
            page_mm: None,
            labels: None,
        };
        for (language, said) in [
            (Language::English, "The labels are not counted"),
            (Language::Vietnamese, "Không đếm nhãn"),
        ] {
            let shown = labels_text(&Visit::in_language(language), &one).into_string();
            assert!(shown.starts_with(said), "{shown}");
        }
    }
}
