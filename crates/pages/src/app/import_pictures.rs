//! Pictures of the files of whole blocks before they are imported: the page with the boxes of its labels, and the scan.

use std::path::Path;
use std::sync::Arc;

use axum::extract::{Path as AddressPath, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use maud::{Markup, html};

use super::components::grouped;
use super::failure::{AppFailure, AppResult};
use super::folder_picker::PickerRoots;
use super::import_choice::ImportChoice;
use super::import_heads::{FileHeads, allowed};
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use mocban_core::InputLimits;
use mocban_core::domain::{enum_names, one_line};
use mocban_core::raster::jpeg_rgb8;
use mocban_export::import_pictures::{page_with_boxes, points_from_above};
use mocban_lists::labels::LabelBox;
use mocban_project::file_heads::{ScanKind, page_image, page_labels, scan_points};

/// Longer side of a picture, pixels.
const SIDE: usize = 560;
/// JPEG quality of pictures.
const QUALITY: u8 = 85;

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
pub(super) fn pictures_part(visit: &Visit, heads: &[FileHeads], from: u64) -> Markup {
    let blocks = (from..).zip(heads);
    let blocks = blocks.filter(|(_, one)| one.files.kind == ScanKind::Block);
    html! {
        @for (place, one) in blocks { section.card.block-files {
            h3 { (one_line(&one.files.name)) }
            p { (labels_text(visit, one)) }
            div.row {
                @if one.print.is_ok() { (picture(visit, ImportPicture::Page, place, &one.files.name)) }
                @if one.scan.is_ok() { (picture(visit, ImportPicture::Scan, place, &one.files.name)) }
            }
        } }
    }
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
fn labels_text(visit: &Visit, one: &FileHeads) -> Markup {
    html! {
        @match &one.labels {
            Some(Ok((count, format))) => {
                (visit.t("Labels", "Nhãn")) ": " b { (grouped(*count)) } " "
                (visit.t("characters", "chữ")) " (" (format.name()) ")"
            },
            Some(Err(why)) => span.bad { (one_line(why.text(visit.language))) },
            None if one.files.labels.is_none() => (visit.t("No labels: a run looks for the characters on the page.", "Không có nhãn: lần chạy sẽ tìm các chữ trên trang in.")),
            None => {},
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
    let jpeg = state.import_work.call(work).await??;
    Ok(([(header::CONTENT_TYPE, "image/jpeg")], jpeg).into_response())
}

fn drawn(
    state: &AppState,
    chosen: &ImportChoice,
    picture: ImportPicture,
    place: u64,
) -> AppResult<Vec<u8>> {
    let folder = &state.options.folder;
    let roots = PickerRoots::new(folder);
    let files = chosen.planned_block(state, &roots, place);
    let files = files.ok_or_else(AppFailure::not_found)?;
    let limits = chosen.limits(folder);
    let refused = |why: String| AppFailure::refused(Sentence::of_program(&why));
    let path = |path: &Path| allowed(&roots, path).map_err(AppFailure::refused);
    let drawn = match picture {
        ImportPicture::Page => {
            let page = path(&files.print)?;
            let labels = files.labels.as_deref().map(path).transpose()?;
            draw_page(&page, labels.as_deref(), &limits)
        }
        ImportPicture::Scan => {
            let points = scan_points(&path(&files.scan)?, &limits.mesh);
            points.and_then(|points| {
                let picture = points_from_above(&points, SIDE);
                picture.ok_or_else(|| "the mesh has no vertices".to_owned())
            })
        }
    };
    Ok(jpeg_rgb8(&drawn.map_err(refused)?, QUALITY))
}

/// Draws a page. Labels that cannot be used are left out; the page of imports says why.
fn draw_page(
    page: &Path,
    labels: Option<&Path>,
    limits: &InputLimits,
) -> Result<mocban_export::pictures::Rgb, String> {
    let image = page_image(page, &limits.image)?;
    let size = [image.rgb.width() as u32, image.rgb.height() as u32];
    let found = labels.and_then(|labels| page_labels(labels, page, size).ok());
    let boxes = found.map_or_else(Vec::new, |found| {
        found.boxes.iter().map(LabelBox::bounds).collect()
    });
    Ok(page_with_boxes(&image, &boxes, SIDE))
}
