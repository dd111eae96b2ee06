//! About how large an export for each purpose will be, and whether the disk has room for it.

use std::sync::Arc;

use axum::extract::{Path, State};
use axum::response::Html;
use maud::{Markup, html};

use super::components::number_table;
use super::exports::{PURPOSES, Purpose, exports_dir, pictures_side};
use super::failure::AppResult;
use super::state::AppState;
use super::visit::Visit;
use mocban_project::backup_checks::free_beside;
use mocban_project::blocking::blocking;
use mocban_project::export_forecast::ExportForecast;

/// Returns the card with the sizes, which are loaded when the page is shown.
pub(super) fn size_card(visit: &Visit) -> Markup {
    html! {
        section.card {
            h2 { (visit.t("Size before the export", "Dung lượng trước khi xuất")) }
            div #export-size data-load="export/size" aria-live="polite" {
                p { (visit.t("Estimating…", "Đang ước tính…")) }
                progress aria-label=(visit.t("Estimating", "Đang ước tính")) {}
            }
        }
    }
}

/// Responds with the sizes, and with the free space of the disk.
pub(super) async fn part(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let limits = open.settings()?.config.limits.image;
    let forecast = ExportForecast::read(&open.project, &open.catalog, limits).await?;
    let folder = exports_dir(&open.dir);
    let free = blocking(move || free_beside(&folder)).await?;
    let of_purpose = |purpose: &Purpose| forecast.bytes(purpose.1, pictures_side(purpose.0));
    let sizes = PURPOSES.each_ref().map(of_purpose);
    Ok(Html(sizes_part(&visit, &sizes, free).into_string()))
}

/// Shows the sizes in the order of the purposes. A size is `None` if it is not known.
fn sizes_part(visit: &Visit, sizes: &[Option<u64>], free: Option<u64>) -> Markup {
    let titles = [
        visit.t("Purpose", "Mục đích"),
        visit.t("about", "khoảng"),
        visit.t("room", "chỗ trống"),
    ];
    let has_room = |bytes: u64| free.is_none_or(|free| bytes <= free);
    let rows = html! {
        @for ((name, _, texts), size) in PURPOSES.iter().zip(sizes) {
            tr data-purpose=(name) {
                th scope="row" { (texts[visit.index()]) }
                @if let Some(bytes) = *size {
                    td.number data-bytes=(bytes) { (visit.file_size(bytes)) }
                    td.number { @if has_room(bytes) { (visit.t("enough", "đủ")) } @else { b.bad { (visit.t("not enough room", "không đủ chỗ")) } } }
                } @else {
                    td.number { "–" } td.number { "–" }
                }
            }
        }
    };
    let is_tight = sizes.iter().flatten().any(|bytes| !has_room(*bytes));
    html! {
        p { (visit.t(
            "An export of all pairs with a result needs about this much room; fewer results need less. An earlier export for the same purpose is replaced only when the new one is whole, so until then both need room.",
            "Bản xuất của tất cả các cặp có kết quả cần khoảng chừng này; ít kết quả hơn thì cần ít hơn. Bản xuất trước cho cùng mục đích chỉ được thay khi bản mới đã xong, nên đến lúc đó cả hai đều chiếm chỗ.",
        )) }
        @if let Some(free) = free {
            p.notice.bad[is_tight] #free-space { (visit.t("Free on the disk: ", "Đĩa còn trống: ")) b { (visit.file_size(free)) } }
        }
        (number_table(visit.t("Sizes", "Dung lượng"), &titles, &rows))
    }
}

#[cfg(test)]
mod tests {
    use super::{PURPOSES, sizes_part};
    use crate::app::visit::Visit;
    use crate::review::Language;

    #[test]
    fn a_purpose_for_which_the_disk_has_no_room_is_marked() {
        let mut sizes = [Some(2_000_000); PURPOSES.len()];
        sizes[0] = Some(3_000_000_000);
        sizes[1] = None;
        for (language, size, room, free_space) in [
            (
                Language::English,
                "3.0 GB",
                "not enough room",
                "Free on the disk: <b>1.0 GB</b>",
            ),
            (
                Language::Vietnamese,
                "3,0 GB",
                "không đủ chỗ",
                "Đĩa còn trống: <b>1,0 GB</b>",
            ),
        ] {
            let visit = Visit::in_language(language);
            let shown = sizes_part(&visit, &sizes, Some(1_000_000_000)).into_string();
            assert!(
                shown.contains(size) && shown.contains(free_space),
                "{shown}"
            );
            assert_eq!(shown.matches(room).count(), 1, "{shown}");
            assert!(shown.contains("notice bad"), "{shown}");
            let unknown = sizes_part(&visit, &sizes, None).into_string();
            assert!(
                !unknown.contains(room) && !unknown.contains("free-space"),
                "{unknown}"
            );
        }
    }
}
