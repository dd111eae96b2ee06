//! The page on which a person corrects the unit of scans, or which of their sides is carved: of one pair, or of a group of
//! failed ones.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::Html;
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::encoded;
use super::child_run;
use super::components::{NavSection, action_form, choice, frame, grouped, unit_name};
use super::failure::{AppFailure, AppResult};
use super::pictures::results;
use super::projects::OpenProject;
use super::run_actions::{refuse_during_run, runs};
use super::sentence::Sentence;
use super::state::AppState;
use super::visit::Visit;
use crate::on_thread::on_thread;
use mocban_catalog::ScanCorrection;
use mocban_core::domain::{FailureClass, LengthUnit, PairName, enum_names, one_line};
use mocban_project::scan_corrections::correct_scans;

/// Most pairs that are corrected at a time.
const MAX_CORRECTED: usize = 10_000;
/// Most failures of a class that are searched.
const MAX_SEARCHED: usize = 20_000;
/// Number of pairs that are named.
const NAMED: usize = 12;
/// Value of the field for a unit that is not known: an empty one asks for a choice.
const UNKNOWN_UNIT: &str = "unknown";

/// What is corrected of scans, in the order in which a page offers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ScanQuestion {
    /// Their unit.
    Unit,
    /// Which of their sides is carved.
    Side,
}

enum_names! { pub ScanQuestion, "a question about scans": Unit = "unit", Side = "side" }

impl ScanQuestion {
    /// Returns what the link to the page and its button say of a number of pairs.
    pub(super) const fn title(self, visit: &Visit, pairs: u64) -> &'static str {
        match self {
            Self::Unit => visit.form(
                pairs,
                ["Set the unit of the scan", "Set the unit of the scans"],
                "Đặt đơn vị của bản quét",
            ),
            Self::Side => visit.t(
                "The carved side is the other one",
                "Mặt khắc là mặt bên kia",
            ),
        }
    }
}

/// The fields of the form.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScanCorrectionBody {
    what: ScanQuestion,
    #[serde(default)]
    pair: Option<String>,
    #[serde(default)]
    class: Option<FailureClass>,
    #[serde(default)]
    unit: String,
    /// Number of pairs that the page showed.
    shown: String,
}

/// Returns the pairs that are corrected: the named one, or the failed ones of a class. If no alignment was found, the unit may be
/// wrong; of other failures, only the ones whose messages name the unit are in its group.
async fn corrected_pairs(
    open: &OpenProject,
    what: ScanQuestion,
    pair: Option<&str>,
    class: Option<FailureClass>,
) -> AppResult<Vec<PairName>> {
    if let Some(pair) = pair {
        return Ok(vec![results(open, pair).await?.attributes.name]);
    }
    let class = class.ok_or_else(AppFailure::not_found)?;
    let names_unit = what == ScanQuestion::Unit && class != FailureClass::NoSolution;
    let limits = [MAX_SEARCHED, MAX_CORRECTED];
    Ok(open.catalog.failed_scans(class, names_unit, limits).await?)
}

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let what = visit.query.parsed::<ScanQuestion>("what");
    let what = what.ok_or_else(AppFailure::not_found)?;
    let (pair, class) = (visit.query.get("pair"), visit.query.parsed("class"));
    let names = corrected_pairs(&open, what, pair, class).await?;
    let is_running = runs(&open).await?;
    let body = html! {
        (pairs_part(&visit, &names))
        (meaning(&visit, what))
        p { (visit.t(
            "All stages of these pairs are then computed again. A verdict counts again only if the result stays the same. A list that is imported later must say the same.",
            "Sau đó mọi giai đoạn của các cặp này được tính lại. Đánh giá chỉ được tính tiếp nếu kết quả không đổi. Danh sách được nhập sau này phải ghi như vậy.",
        )) }
        @if is_running { p.notice #running { (visit.t(
            "A run is in progress: wait for its end, or press Stop on the page Run.",
            "Đang có một lần chạy: hãy chờ, hoặc bấm Dừng ở trang Căn chỉnh.",
        )) } }
        (form(&visit, what, names.len() as u64, is_running))
    };
    let title = what.title(&visit, names.len() as u64);
    Ok(frame(&visit, title, Some(&key), NavSection::Run, &body))
}

/// Says how many pairs are corrected, and names the first.
fn pairs_part(visit: &Visit, names: &[PairName]) -> Markup {
    let count = names.len() as u64;
    html! {
        p #corrected { b { (grouped(count)) } " " (visit.form(count, ["pair", "pairs"], "cặp"))
            @for (at, name) in names.iter().take(NAMED).enumerate() {
                (if at == 0 { ": " } else { ", " })
                a href={ "pair/" (encoded(name.as_str())) "/" } { (one_line(name.as_str())) }
            }
            @if names.len() > NAMED { ", …" }
        }
        @if names.is_empty() { p.notice { (visit.t(
            "No pair failed for this reason. Pairs that were cut from a whole block have its unit and side: import the block again with the right ones.",
            "Không có cặp nào lỗi vì lý do này. Các cặp được cắt từ ván nguyên có đơn vị và mặt của ván: hãy nhập lại ván với đơn vị và mặt đúng.",
        )) } }
        @if names.len() == MAX_CORRECTED { p.notice { (visit.t(
            "These are the first of them: open this page again for the others.",
            "Đây là các cặp đầu tiên: hãy mở lại trang này cho các cặp còn lại.",
        )) } }
    }
}

/// Says what the correction means.
fn meaning(visit: &Visit, what: ScanQuestion) -> Markup {
    html! {
        p { @match what {
            ScanQuestion::Unit => (visit.t(
                "The unit is that of the coordinates in the files of the scans. It is stored as if the list had it in its column for units.",
                "Đơn vị là đơn vị của tọa độ trong tệp bản quét. Nó được lưu như thể danh sách ghi nó ở cột đơn vị.",
            )),
            ScanQuestion::Side => (visit.t(
                "The carved side of a scan faces up or down. It is stored, as if the list said so, that it faces the other way than the program found.",
                "Mặt khắc của bản quét hướng lên hoặc úp xuống. Như thể danh sách ghi, sẽ lưu rằng nó hướng ngược với điều chương trình đã tìm thấy.",
            )),
        } }
    }
}

fn form(visit: &Visit, what: ScanQuestion, count: u64, is_running: bool) -> Markup {
    let chosen = ["pair", "class"].map(|name| (name, visit.query.get(name)));
    let (pairs, again) = (
        visit.form(count, ["pair", "pairs"], "cặp"),
        visit.t("Compute again", "Tính lại"),
    );
    let question = format!(
        "{} ({again}: {} {pairs})?",
        what.title(visit, count),
        grouped(count)
    );
    action_form(
        "actions/correct",
        "fields",
        &html! {
            input type="hidden" name="what" value=(what.name());
            input type="hidden" name="shown" value=(count);
            @for (name, value) in chosen {
                @if let Some(value) = value { input type="hidden" name=(name) value=(value); }
            }
            @if what == ScanQuestion::Unit {
                label { span { (visit.t("Unit of the scans", "Đơn vị của bản quét")) }
                    select #unit name="unit" required {
                        (choice("", visit.t("choose", "chọn"), None))
                        @for unit in LengthUnit::ALL { option value=(unit.name()) { (unit_name(visit, unit)) } }
                        option value=(UNKNOWN_UNIT) { (visit.t("not known", "không rõ")) }
                    }
                }
            }
            button.primary #correct disabled[count == 0 || is_running] data-confirm=(question) {
                (what.title(visit, count)) " (" (grouped(count)) " " (pairs) ")"
            }
        },
    )
}

/// Corrects the scans that the page showed, and starts a run of their pairs.
pub(super) async fn correct(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<ScanCorrectionBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let correction = match body.what {
        ScanQuestion::Side => ScanCorrection::OtherSide,
        ScanQuestion::Unit if body.unit == UNKNOWN_UNIT => ScanCorrection::Unit(None),
        ScanQuestion::Unit => {
            let unit = body.unit.parse::<LengthUnit>().ok();
            ScanCorrection::Unit(Some(unit.ok_or_else(no_unit)?))
        }
    };
    let pair = body.pair.as_deref();
    let names = corrected_pairs(&open, body.what, pair, body.class).await?;
    if body.shown != names.len().to_string() {
        return Err(AppFailure::refused(Sentence::new(
            "other pairs have failed meanwhile, so nothing was changed: load the page again and look at them",
            "trong lúc đó đã có các cặp khác bị lỗi nên chưa thay đổi gì: hãy tải lại trang và xem các cặp đó",
        )));
    }
    refuse_during_run(&open).await?;
    let ids: Vec<String> = names.iter().map(PairName::to_string).collect();
    let location = open.location();
    let changed = on_thread(async move || correct_scans(names, correction, &location).await).await;
    if changed.map_err(|error| AppFailure::of(error, &open.dir))? == 0 {
        return Err(AppFailure::refused(Sentence::new(
            "nothing was changed: the scans have this unit or side already, or were cut from a whole block, which is then imported again",
            "chưa thay đổi gì: các bản quét đã có đơn vị hoặc mặt này, hoặc được cắt từ ván nguyên; khi đó hãy nhập lại ván",
        )));
    }
    child_run::start(&state, &open.dir, &[], &ids).await?;
    let go = match (&body.pair, ids.as_slice()) {
        (Some(_), [id]) => format!("pair/{}/", encoded(id)),
        _ => "./".to_owned(),
    };
    Ok(Json(json!({ "go": go })))
}

fn no_unit() -> AppFailure {
    AppFailure::refused(Sentence::new(
        "choose the unit of the scans first",
        "trước hết hãy chọn đơn vị của bản quét",
    ))
}

#[cfg(test)]
mod tests {
    use super::{NAMED, ScanQuestion, form, meaning, pairs_part};
    use crate::app::address::PageQuery;
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_core::domain::PairName;

    #[test]
    fn a_correction_says_how_many_pairs_it_changes_and_asks() {
        for (language, title, counted) in [
            (Language::English, "Set the unit of the scans", "2 pairs"),
            (Language::Vietnamese, "Đặt đơn vị của bản quét", "2 cặp"),
        ] {
            let mut visit = Visit::in_language(language);
            visit.query = PageQuery::parse("what=unit&class=bad_input");
            let shown = form(&visit, ScanQuestion::Unit, 2, false).into_string();
            for part in [
                title,
                counted,
                "data-confirm=",
                "name=\"class\" value=\"bad_input\"",
                "name=\"shown\" value=\"2\"",
                "<select id=\"unit\" name=\"unit\" required>",
            ] {
                assert!(shown.contains(part), "{part}: {shown}");
            }
            assert!(!shown.contains("disabled"), "{shown}");
            let shown = form(&visit, ScanQuestion::Side, 2, true).into_string();
            assert!(shown.contains("disabled"), "a run is in progress: {shown}");
            assert!(!shown.contains("<select"), "{shown}");
        }
    }

    #[test]
    fn only_the_first_pairs_of_a_group_are_named() {
        let name = |n| PairName::new(&format!("n{n:02}")).expect("a name");
        let names: Vec<PairName> = (0..=NAMED).map(name).collect();
        for language in Language::ALL {
            let visit = Visit::in_language(language);
            let shown = pairs_part(&visit, &names).into_string();
            assert_eq!(shown.matches("href=\"pair/").count(), NAMED, "{shown}");
            assert!(shown.contains(", …"), "{shown}");
            let none = pairs_part(&visit, &[]).into_string();
            assert!(none.contains("notice"), "{none}");
            let texts = ScanQuestion::ALL.map(|what| meaning(&visit, what).into_string());
            assert_ne!(texts[0], texts[1]);
        }
    }
}
