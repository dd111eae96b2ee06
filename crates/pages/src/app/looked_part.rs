//! What the pages say after inputs were looked at.

use maud::{Markup, html};

use super::components::grouped;
use super::remedies::import_address;
use super::visit::Visit;
use mocban_core::domain::one_line;
use mocban_project::input_places::InputPlaces;

/// Says how many files were looked at, of how many.
pub(super) fn looked_at_text(places: &InputPlaces) -> [String; 2] {
    let [looked_at, known] = [places.looked_at, places.known].map(|number| grouped(number as u64));
    let [of, of_vi] = if places.has_more {
        ["of more than", "trên hơn"]
    } else {
        ["of", "trên"]
    };
    [
        format!("Files that were looked at: {looked_at} {of} {known}"),
        format!("Số tệp đã kiểm tra: {looked_at} {of_vi} {known}"),
    ]
}

/// Returns the paths of the first missing files, which are not all if dots follow.
pub(super) fn first_missing(places: &InputPlaces) -> String {
    let names = places.first.iter().map(|path| one_line(path).into_owned());
    let dots = (places.missing > places.first.len()).then(|| "…".to_owned());
    names.chain(dots).collect::<Vec<_>>().join(", ")
}

/// Says what a run has found that looked for changed files: missing files, or that nothing has changed. `key` names the project.
pub(super) fn looked_part(
    visit: &Visit,
    key: &str,
    places: &InputPlaces,
    is_unchanged: bool,
) -> Markup {
    let [english, vietnamese] = looked_at_text(places);
    let looked_at = visit.t(&english, &vietnamese);
    html! {
        @if places.missing > 0 {
            div.notice.warn #missing-files role="status" {
                p {
                    (visit.t("Missing files", "Số tệp bị thiếu")) ": " b { (grouped(places.missing as u64)) } " (" (first_missing(places)) "). "
                    (visit.t("Put them back, or import them again from where they are now.", "Hãy đưa chúng về chỗ cũ, hoặc nhập lại từ chỗ hiện có tệp."))
                    @if !places.is_of_all() { " " (looked_at) "." }
                }
                p.row { a href=(import_address(visit, key, None)) { (visit.t("Import", "Nhập dữ liệu")) } }
            }
        }
        @if is_unchanged {
            p.good #no-change role="status" {
                @if places.missing > 0 {
                    (visit.t("No other file has changed.", "Không có tệp nào khác thay đổi."))
                } @else if places.is_of_all() {
                    (visit.t("No file has changed, and none is missing.", "Không có tệp nào thay đổi hay bị thiếu."))
                } @else {
                    (visit.t("No file has changed.", "Không có tệp nào thay đổi.")) " "
                    (looked_at) ". "
                    @if places.looked_at > 0 { (visit.t("None of these is missing.", "Không thiếu tệp nào trong số này.")) }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::looked_part;
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_project::input_places::InputPlaces;

    /// Returns what was found of 12 files, of which some were looked at and the first are missing.
    fn found(looked_at: usize, missing: usize) -> InputPlaces {
        InputPlaces {
            known: 12,
            has_more: false,
            looked_at,
            missing,
            missing_inside: 0,
            first: (0..missing.min(3)).map(|i| format!("{i}.stl")).collect(),
        }
    }

    #[test]
    fn missing_files_are_named_although_nothing_has_changed() {
        for (places, is_unchanged, english, vietnamese) in [
            (
                found(12, 0),
                true,
                &["No file has changed, and none is missing."][..],
                &["Không có tệp nào thay đổi hay bị thiếu."][..],
            ),
            (
                found(12, 4),
                true,
                &[
                    "Missing files: <b>4</b> (0.stl, 1.stl, 2.stl, …). Put them back",
                    "href=\"./import?project=a%20b\"",
                    "No other file has changed.",
                ][..],
                &[
                    "Số tệp bị thiếu: <b>4</b> (0.stl, 1.stl, 2.stl, …). Hãy đưa chúng về",
                    "Không có tệp nào khác thay đổi.",
                ][..],
            ),
            (
                found(5, 1),
                false,
                &["<b>1</b> (0.stl). ", "Files that were looked at: 5 of 12."][..],
                &["<b>1</b> (0.stl). ", "Số tệp đã kiểm tra: 5 trên 12."][..],
            ),
            (
                found(5, 0),
                true,
                &["Files that were looked at: 5 of 12. None of these is missing."][..],
                &["Số tệp đã kiểm tra: 5 trên 12. Không thiếu tệp nào trong số này."][..],
            ),
        ] {
            for (language, parts) in Language::ALL.into_iter().zip([english, vietnamese]) {
                let visit = Visit::in_language(language);
                let shown = looked_part(&visit, "a b", &places, is_unchanged).into_string();
                for part in parts {
                    assert!(shown.contains(part), "{part}: {shown}");
                }
                assert_eq!(shown.contains("no-change"), is_unchanged, "{shown}");
            }
        }
    }
}
