//! The parts that pages are made of: the frame with its navigation, notices, progress, tables and fields.

use axum::response::Html;
use maud::{Markup, html};
use serde_json::{Map, Value};

use super::address::encoded;
pub(super) use super::number_text::grouped;
use super::sentence::without_commands;
use super::visit::Visit;
use crate::local_server::document;
use crate::messages;
use crate::review::Language;
use mocban_core::domain::{LengthUnit, one_line, value_text};

/// A page in the navigation of a project.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NavSection {
    /// A page that is not in the navigation.
    None,
    /// Run, and the state of the project.
    Run,
    /// The list of pairs.
    Pairs,
    /// The list of whole blocks.
    Blocks,
    /// Reviews.
    Review,
    /// The report.
    Report,
    /// Exports.
    Export,
    /// Import of pairs.
    Import,
    /// Settings.
    Settings,
    /// Check and backup.
    Health,
}

/// Address, and name in English and Vietnamese, of the pages in the navigation.
const SECTIONS: [(NavSection, &str, [&str; 2]); 8] = [
    (NavSection::Run, "", ["Run", "Căn chỉnh"]),
    (NavSection::Pairs, "pairs", ["Pairs", "Các cặp"]),
    (NavSection::Blocks, "blocks", ["Blocks", "Các ván"]),
    (NavSection::Review, "review", ["Review", "Đánh giá"]),
    (NavSection::Report, "report", ["Report", "Báo cáo"]),
    (NavSection::Export, "export", ["Export", "Xuất dữ liệu"]),
    (NavSection::Settings, "settings", ["Settings", "Thiết lập"]),
    (NavSection::Health, "health", ["Health", "Tình trạng"]),
];

/// Returns a whole page. `project` is the name of the project that it belongs to.
pub(super) fn frame(
    visit: &Visit,
    title: &str,
    project: Option<&str>,
    section: NavSection,
    body: &Markup,
) -> Html<String> {
    let root = &visit.root;
    let other = visit.language.other();
    let change = visit.query.with("language", other.name()).text();
    let head = html! {
        meta name="csrf-token" content=(visit.csrf_token);
        link rel="stylesheet" href={ (root) "assets/tokens.css" };
        link rel="stylesheet" href={ (root) "assets/app.css" };
        script type="module" src={ (root) "assets/app.js" } {}
    };
    let body = html! {
        body {
            a.skip href="#main" { (visit.t("To the content", "Đến nội dung")) }
            header.bar {
                a.brand href=(root) { "mocban" }
                @if let Some(project) = project {
                    nav aria-label=(visit.t("Pages of the project", "Các trang của dự án")) {
                        span.project title=(one_line(project)) { (one_line(project)) }
                        @for (known, page, names) in SECTIONS {
                            a href=(visit.project_page(project, page)) aria-current=[(known == section).then_some("page")] {
                                (visit.t(names[0], names[1]))
                            }
                        }
                        a href={ (root) "import?project=" (encoded(project)) } aria-current=[(section == NavSection::Import).then_some("page")] {
                            (visit.t("Import", "Nhập dữ liệu"))
                        }
                    }
                }
                span.spacer {}
                a href={ (visit.here) (change) } hreflang=(other.name()) lang=(other.name()) {
                    (match other { Language::English => "English", Language::Vietnamese => "Tiếng Việt" })
                }
            }
            main #main tabindex="-1" {
                h1 { (title) }
                @if let Some(place) = visit.read_only {
                    p #read-only.notice.warn role="status" { (place.sentence().text(visit.language)) }
                }
                (body)
            }
            p #offline.notice.bad role="status" hidden {
                (visit.t("The program does not answer, so this page may be old. If it was ended, start it again.", "Chương trình không trả lời nên trang này có thể đã cũ. Nếu chương trình đã dừng, hãy mở lại."))
            }
        }
    };
    let title = match project {
        Some(project) => format!("{title} · {}", one_line(project)),
        None => format!("{title} · mocban"),
    };
    Html(document(visit.language.name(), &title, &head, &body).into_string())
}

/// Returns a form that posts its fields as JSON to an action and shows what the action replies.
pub(super) fn action_form(action: &str, class: &str, content: &Markup) -> Markup {
    html! {
        form class={ "action " (class) } data-post=(action) {
            (content)
            p.problem role="alert" hidden {}
        }
    }
}

/// Returns a table of a name and numbers, which scrolls sideways on a narrow screen.
pub(super) fn number_table(label: &str, titles: &[&str], rows: &Markup) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label=(label) {
            table {
                thead { tr { @for (index, title) in titles.iter().enumerate() { th.number[index > 0] scope="col" { (title) } } } }
                tbody { (rows) }
            }
        }
    }
}

/// Returns the part of a page that is shown while there is nothing yet.
pub(super) fn empty(text: &str, next: &Markup) -> Markup {
    html! {
        div.empty { p { (text) } (next) }
    }
}

/// Returns a number with its name below it, and a link to what is counted.
pub(super) fn figure(number: u64, name: &str, href: Option<&str>, tone: &str) -> Markup {
    let content = html! { b { (grouped(number)) } span { (name) } };
    html! {
        @match href {
            Some(href) if number > 0 => a class={ "figure " (tone) } href=(href) { (content) },
            _ => span class={ "figure " (tone) } { (content) },
        }
    }
}

/// Returns the rows of a list of files with a scan and its unit.
pub(super) fn scan_file(visit: &Visit, path: &str, unit: Option<LengthUnit>) -> Markup {
    html! {
        dt { (visit.t("Scan", "Bản quét")) } dd { code { (one_line(path)) } @if let Some(unit) = unit { " (" (unit_name(visit, unit)) ")" } }
    }
}

/// Returns the other columns of a list, as rows of a list of files.
pub(super) fn metadata(columns: &Map<String, Value>) -> Markup {
    html! {
        @for (name, value) in columns {
            dt { (one_line(name)) } dd { (one_line(&value_text(value))) }
        }
    }
}

/// Returns the name of a unit. In Vietnamese, `in` means to print.
pub(super) fn unit_name(visit: &Visit, unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::In => visit.t("in", "inch"),
        _ => unit.name(),
    }
}

/// Returns the message of a stored failure without its commands. It is in English, unless its Vietnamese text is known.
pub(super) fn stored_message(visit: &Visit, message: &str) -> Markup {
    let plain = without_commands(message);
    let known = match visit.language {
        Language::English => None,
        Language::Vietnamese => messages::vietnamese(&plain),
    };
    html! {
        @match known {
            Some(text) => (one_line(&text)),
            None => span lang="en" { (one_line(&plain)) },
        }
    }
}

/// Returns a score with three digits, or a dash.
pub(super) fn score(visit: &Visit, value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| visit.decimal(value, 3))
}

/// Returns a number minus another one with its sign, or a dash if one is missing. It is the difference of the numbers as they are
/// shown with the same digits.
pub(super) fn difference(
    visit: &Visit,
    value: Option<f64>,
    other: Option<f64>,
    digits: usize,
) -> String {
    let Some((value, other)) = value.zip(other) else {
        return "–".to_owned();
    };
    let unit = 10_f64.powi(digits as i32);
    let [value, other] = [value, other].map(|number| (number * unit).round());
    let text = visit.decimal((value - other) / unit, digits);
    if value > other {
        format!("+{text}")
    } else {
        text
    }
}

/// Returns an option of a choice.
pub(super) fn choice(value: &str, text: &str, selected: Option<&str>) -> Markup {
    html! {
        option value=(value) selected[selected.unwrap_or_default() == value] { (text) }
    }
}

#[cfg(test)]
mod tests {
    use super::{difference, score, stored_message};
    use crate::app::visit::Visit;
    use crate::review::Language;

    #[test]
    fn scores_and_their_differences_have_the_decimal_sign_of_the_page() {
        let english = Visit::in_language(Language::English);
        let of = |value, other, digits| difference(&english, value, other, digits);
        assert_eq!(score(&english, Some(0.98765)), "0.988");
        assert_eq!(score(&english, None), "–");
        assert_eq!(of(Some(0.5), Some(0.75), 3), "−0.250");
        assert_eq!(of(Some(9.0), Some(2.5), 1), "+6.5");
        assert_eq!(of(Some(1.0), Some(1.0001), 2), "0.00");
        assert_eq!(of(None, Some(1.0), 2), "–");
        assert_eq!(of(Some(0.7336), Some(0.7244), 3), "+0.010", "0.734 − 0.724");
        let vietnamese = Visit::in_language(Language::Vietnamese);
        assert_eq!(score(&vietnamese, Some(0.98765)), "0,988");
        assert_eq!(difference(&vietnamese, Some(0.5), Some(0.75), 3), "−0,250");
    }

    #[test]
    fn a_stored_message_is_translated_or_marked_as_english() {
        let of = |language, message| {
            stored_message(&Visit::in_language(language), message).into_string()
        };
        let known = "1.stl: the mesh has no faces";
        assert_eq!(
            of(Language::English, known),
            "<span lang=\"en\">1.stl: the mesh has no faces</span>"
        );
        assert_eq!(
            of(Language::Vietnamese, known),
            "1.stl: bản quét không có mặt tam giác"
        );
        assert_eq!(
            of(Language::Vietnamese, "odd"),
            "<span lang=\"en\">odd</span>"
        );
    }
}
