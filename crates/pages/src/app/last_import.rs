//! The undo of the newest import of pairs.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::Html;
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::{PageQuery, encoded};
use super::chosen_pairs::with_restored;
use super::components::{action_form, grouped};
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::on_thread::on_thread;
use mocban_catalog::LastImport;
use mocban_core::domain::UnixMillis;
use mocban_project::retire::{RetireChoice, retire, undo};

/// Largest number of pairs that is counted, so that an import of a million pairs is shown as soon as a small one.
const MAX_COUNTED: u64 = 10_000;

/// Responds with a part of the page of imports, which the page loads afterwards.
pub(super) async fn part(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let added = open.catalog.last_import_counts(MAX_COUNTED + 1).await?;
    let part = added.map(|added| undo_part(&visit, &key, added));
    Ok(Html(part.unwrap_or_default().into_string()))
}

fn undo_part(visit: &Visit, key: &str, added: LastImport) -> Markup {
    // Then the earlier pairs of the import were not counted.
    let is_cut = added.pairs > MAX_COUNTED;
    let has_jobs = added.jobs > 0;
    let (text, number) = if has_jobs {
        (
            visit.t(
                "Pairs of this import that are counted",
                "Số cặp của lần nhập này hiện được tính",
            ),
            added.jobs,
        )
    } else {
        (
            visit.t(
                "Pairs of this import that are in no count",
                "Số cặp của lần nhập này hiện không được tính",
            ),
            added.pairs,
        )
    };
    let count = |number: u64| {
        let number = grouped(number.min(MAX_COUNTED));
        html! { b { @if is_cut { (visit.t("at least", "ít nhất")) " " } (number) } }
    };
    html! {
        h2 { (visit.t("Newest import that added pairs", "Lần nhập gần nhất có thêm cặp")) }
        p { (text) " (" (visit.time(added.imported)) "): "
            (count(number)) ". "
            @if !has_jobs && added.retired_last < added.pairs {
                (visit.t("Pairs among them that were taken out last, and come back", "Số cặp trong đó bị đưa ra sau cùng và được đưa trở lại")) ": "
                (count(added.retired_last)) ". "
            }
            @if has_jobs && added.jobs < added.pairs {
                (visit.t("Pairs of this import that were in no count before", "Số cặp của lần nhập này đã không được tính từ trước")) ": "
                (count(added.pairs - added.jobs)) ". "
            }
            span.muted { (visit.t("Files, results and verdicts are kept.", "Tệp, kết quả và đánh giá vẫn được giữ.")) }
        }
        // The part stands on the page of imports, so the address is relative to that page.
        (action_form(
            &format!("p/{}/actions/last-import", encoded(key)),
            "inline",
            &html! {
                input type="hidden" name="at" value=(added.imported);
                @if has_jobs || is_cut {
                    button name="change" value="retire" { (visit.t("Undo this import", "Hoàn tác lần nhập này")) }
                }
                @if !has_jobs { button name="change" value="restore" { (visit.t("Bring them back", "Đưa trở lại")) } }
            },
        ))
    }
}

/// What is done to the pairs of the newest import.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ImportChange {
    Retire,
    Restore,
}

/// The fields of the button.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LastImportBody {
    /// Time of the import that the page showed.
    at: String,
    change: ImportChange,
}

/// Takes the pairs of the newest import out of every count, or brings them back.
pub(super) async fn change(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<LastImportBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let at: UnixMillis = body
        .at
        .parse()
        .map_err(|_invalid| AppFailure::not_found())?;
    // `retire` checks this again; the reason is given here in both languages.
    let newest = open.catalog.last_import_counts(1).await?;
    if newest.is_none_or(|newest| newest.imported != at) {
        return Err(AppFailure::refused(Sentence::new(
            "another import has added pairs meanwhile: reload the page and look at it first",
            "một lần nhập khác vừa thêm cặp: hãy tải lại trang và xem lần nhập đó trước",
        )));
    }
    let (choice, location) = (RetireChoice::LastImport(Some(at)), open.location());
    let changed = on_thread(async move || match body.change {
        ImportChange::Retire => retire(&choice, &location).await,
        ImportChange::Restore => undo(&choice, &location).await,
    });
    let changed = changed.await;
    let changed = changed.map_err(|error| AppFailure::of(error, &open.dir))?;
    if changed.warnings.is_empty() {
        return Ok(Json(json!({ "reload": true })));
    }
    // The list says that some pairs did not come back.
    let list = with_restored(&PageQuery::default(), &changed).text();
    Ok(Json(
        json!({ "go": format!("p/{}/pairs{list}", encoded(&key)) }),
    ))
}

#[cfg(test)]
mod tests {
    use super::{MAX_COUNTED, undo_part};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_catalog::LastImport;

    #[test]
    fn a_large_import_is_not_counted_to_its_end() {
        let visit = Visit::in_language(Language::Vietnamese);
        let more = MAX_COUNTED + 1;
        for (pairs, jobs, number, buttons) in [
            (MAX_COUNTED, MAX_COUNTED, "<b>10\u{202f}000</b>", "retire"),
            (more, more, "<b>ít nhất 10\u{202f}000</b>", "retire"),
            (more, 9_901, "<b>ít nhất 9\u{202f}901</b>", "retire"),
            (more, 0, "<b>ít nhất 10\u{202f}000</b>", "retire restore"),
            (3, 0, "<b>3</b>", "restore"),
        ] {
            let imported = 1;
            let counts = LastImport {
                imported,
                pairs,
                jobs,
                retired_last: pairs - jobs,
            };
            let shown = undo_part(&visit, "p", counts).into_string();
            assert!(shown.contains(number), "{shown}");
            let offered = ["retire", "restore"].into_iter();
            let offered = offered.filter(|change| shown.contains(&format!("value=\"{change}\"")));
            assert_eq!(offered.collect::<Vec<_>>().join(" "), buttons, "{shown}");
        }
    }

    #[test]
    fn pairs_that_were_retired_apart_from_the_undo_are_counted_apart() {
        let visit = Visit::in_language(Language::English);
        let shown = |jobs, retired_last| {
            let counts = LastImport {
                imported: 1,
                pairs: 6,
                jobs,
                retired_last,
            };
            undo_part(&visit, "p", counts).into_string()
        };
        let undone = shown(0, 5);
        assert!(undone.contains("in no count ("), "{undone}");
        assert!(undone.contains("<b>6</b>"), "{undone}");
        assert!(undone.contains("come back: <b>5</b>"), "{undone}");
        let added = shown(5, 1);
        assert!(added.contains("counted ("), "{added}");
        assert!(added.contains("<b>5</b>"), "{added}");
        assert!(added.contains("before: <b>1</b>"), "{added}");
        for simple in [shown(6, 0), shown(0, 6)] {
            assert_eq!(simple.matches("<b>").count(), 1, "{simple}");
        }
    }
}
