//! Settings in words: what each means, its range, and what a change costs before it is saved.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::Html;
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::PageQuery;
use super::components::{NavSection, action_form, frame, grouped};
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use super::setting_words::is_hidden;
use super::state::AppState;
use super::visit::Visit;
use crate::on_thread::{on_thread, read_on_thread};
use mocban_catalog::Catalog;
use mocban_config::{BaseLayer, Origin, Setting, Sources, load};
use mocban_project::ProjectResult;
use mocban_project::change_setting::{SettingChange, preview, save};
use mocban_project::location::Location;

/// Name of the sentence that says why a value is refused.
const REFUSED: &str = "refused";

/// A change, as the form sends it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SettingBody {
    key: String,
    value: String,
}

pub(super) async fn page(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    visit: Visit,
) -> AppResult<Html<String>> {
    let open = state.open(&key).await?;
    let current = open.settings()?.tree.settings();
    let change = match (visit.query.get("key"), visit.query.given("value")) {
        (Some(name), Some(_)) if is_hidden(name) => return Err(AppFailure::not_found()),
        (Some(name), Some(value)) => {
            let body = SettingBody {
                key: name.to_owned(),
                value: value.to_owned(),
            };
            Some(looked_at(body, open.catalog.clone(), open.location()).await)
        }
        _ => None,
    };
    let body = html! {
        p { (visit.t(
            "A change is saved in the settings file of the project. Before it is saved, you see how many pairs the next run would then compute again, also for other reasons.",
            "Thay đổi được lưu trong tệp thiết lập của dự án. Trước khi lưu, bạn thấy lần chạy sau sẽ tính lại bao nhiêu cặp, kể cả vì lý do khác.",
        )) }
        @match &change {
            None => {},
            Some(Ok(change)) => (change_part(&visit, change)),
            Some(Err(error)) => p.notice.bad id=(REFUSED) role="alert" { (Sentence::of_error(error, &open.dir).text(visit.language)) },
        }
        (saved_part(&visit, &current))
        (sections(&visit, &current, &defaults(&current), matches!(change, Some(Err(_)))))
    };
    let title = visit.t("Settings", "Thiết lập");
    Ok(frame(
        &visit,
        title,
        Some(&key),
        NavSection::Settings,
        &body,
    ))
}

/// Returns the settings of a project without a file, with the preset that its file names.
fn defaults(current: &[Setting]) -> Vec<Setting> {
    let preset = current.iter().find_map(|setting| match setting.origin {
        Origin::Preset(name) => name.parse().ok(),
        _ => None,
    });
    let sources = Sources {
        base: preset.map_or_else(BaseLayer::default, BaseLayer::Preset),
        ..Sources::default()
    };
    load(&sources).map_or_else(|_| Vec::new(), |loaded| loaded.tree.settings())
}

/// Says that a setting was saved, as the address has it.
fn saved_part(visit: &Visit, current: &[Setting]) -> Markup {
    let saved = visit.query.get("saved");
    let saved = current.iter().find(|setting| Some(&*setting.key) == saved);
    html! {
        @if let Some(setting) = saved.filter(|setting| !is_hidden(&setting.key)) {
            p #saved.notice.good role="status" {
                (visit.t("Saved", "Đã lưu")) ": " code { (setting.key) " = " (setting.value) } ". "
                (visit.t("The next run uses it.", "Lần chạy sau sẽ dùng giá trị này."))
            }
        }
    }
}

async fn looked_at(
    body: SettingBody,
    catalog: Catalog,
    location: Location,
) -> ProjectResult<SettingChange> {
    read_on_thread(async move || preview(&body.key, &body.value, &catalog, &location).await).await
}

fn change_part(visit: &Visit, change: &SettingChange) -> Markup {
    let (before, after) = (&change.before, &change.after);
    html! {
        section.card #change {
            h2 { (after.key) }
            @if before.value == after.value {
                p { (visit.t("This is the value that it has.", "Đây đã là giá trị hiện tại.")) }
            } @else {
                p { code { (before.value) } " → " code { (after.value) } }
                p { b { (grouped(change.stale)) } " " (visit.form(change.stale, ["pair would be computed again by the next run.", "pairs would be computed again by the next run."], "cặp sẽ được tính lại trong lần chạy sau.")) }
                @if change.changes_method { p.notice #two-methods { (two_methods(visit)) } }
                @if visit.read_only.is_none() { (action_form("actions/setting", "inline", &html! {
                    input type="hidden" name="key" value=(after.key);
                    input type="hidden" name="value" value=(visit.query.get("value").unwrap_or_default());
                    button.primary #save { (visit.t("Save", "Lưu")) }
                    a href=(visit.here) { (visit.t("Cancel", "Hủy")) }
                })) }
            }
        }
    }
}

/// Says that a run with another method replaces the results.
pub(super) const fn two_methods(visit: &Visit) -> &'static str {
    visit.t(
        "The results of the other method would be replaced. To keep both, import the pairs into a second project.",
        "Kết quả của phương pháp kia sẽ bị thay thế. Để giữ cả hai, hãy nhập các cặp vào một dự án thứ hai.",
    )
}

/// Returns the settings by section. Those with a value of their own are open. `is_refused` says that the value in the address
/// is.
fn sections(visit: &Visit, settings: &[Setting], defaults: &[Setting], is_refused: bool) -> Markup {
    let default_of = |setting: &Setting| defaults.iter().find(|default| default.key == setting.key);
    let section = |setting: &Setting| {
        let (section, _) = setting.key.rsplit_once('.').unwrap_or(("", ""));
        section.to_owned()
    };
    let mut names: Vec<String> = Vec::new();
    for setting in settings {
        let name = section(setting);
        if !names.contains(&name) && !is_hidden(&name) {
            names.push(name);
        }
    }
    let asked = visit.query.get("key").or_else(|| visit.query.get("saved"));
    html! {
        @for name in &names {
            @let of_section: Vec<&Setting> = settings.iter().filter(|setting| section(setting) == *name).collect();
            @let is_open = of_section.iter().any(|setting| setting.origin != Origin::Default || asked == Some(&setting.key));
            details.card open[is_open] {
                summary { h2 { (visit.setting_section(name)) } " " code { (name) } }
                @for setting in of_section { (setting_part(visit, setting, default_of(setting), is_refused)) }
            }
        }
    }
}

/// Returns the form of a setting. A value in the address stays in it, and has the focus if it is refused.
fn setting_part(
    visit: &Visit,
    setting: &Setting,
    default: Option<&Setting>,
    is_refused: bool,
) -> Markup {
    let (text, language) = visit.setting(&setting.key);
    let text_of = |setting: &Setting| setting.value.to_string().trim_matches('"').to_owned();
    let is_asked = visit.query.get("key") == Some(&*setting.key);
    let typed = visit.query.given("value").filter(|_| is_asked);
    let value = typed.map_or_else(|| text_of(setting), str::to_owned);
    let why = (typed.is_some() && is_refused).then_some(REFUSED);
    let default = default.filter(|default| default.value != setting.value);
    let id = format!("setting-{}", setting.key);
    html! {
        form.setting method="get" action=(visit.here) {
            input type="hidden" name="key" value=(setting.key);
            label for=(id) { (setting.key) }
            input id=(id) name="value" value=(value) autofocus[why.is_some()] aria-invalid=[why.map(|_| "true")] aria-describedby=[why] autocomplete="off" spellcheck="false";
            button { (visit.t("Look at the change", "Xem thay đổi")) }
            p.muted lang=(language.name()) {
                (text)
                @if let Some(origin) = visit.origin(&setting.origin) { " · " (origin) }
            }
        }
        @if let Some(default) = default {
            form.inline.put-back method="get" action=(visit.here) {
                input type="hidden" name="key" value=(setting.key);
                input type="hidden" name="value" value=(text_of(default));
                span { b { (visit.t("Changed", "Đã thay đổi")) } "; " (visit.t("the default is", "giá trị mặc định là")) " " code { (default.value) } }
                button aria-label={ (visit.t("Put back", "Đặt lại")) " " (setting.key) } { (visit.t("Put back", "Đặt lại")) }
            }
        }
    }
}

/// Saves a change.
pub(super) async fn store(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<SettingBody>,
) -> AppResult<Json<Value>> {
    if is_hidden(&body.key) {
        return Err(AppFailure::not_found());
    }
    let open = state.open(&key).await?;
    let (catalog, location) = (open.catalog.clone(), open.location());
    let go = PageQuery::default().with("saved", &body.key).text();
    let stored = on_thread(async move || {
        let change = preview(&body.key, &body.value, &catalog, &location).await?;
        save(&change, &location)
    });
    let stored = stored.await;
    stored.map_err(|error| AppFailure::of(error, &open.dir))?;
    Ok(Json(json!({ "go": format!("settings{go}") })))
}

#[cfg(test)]
mod tests {
    use super::{defaults, sections};
    use crate::app::address::PageQuery;
    use crate::app::visit::Visit;
    use crate::review::Language;

    #[test]
    fn a_value_that_is_not_saved_stays_in_its_field() {
        let settings = defaults(&[]);
        for (value, is_refused, part) in [
            (
                "x%22",
                true,
                "value=\"x&quot;\" autofocus aria-invalid=\"true\" aria-describedby=\"refused\"",
            ),
            ("", true, "value=\"\" autofocus"),
            ("3", false, "value=\"3\" autocomplete"),
        ] {
            for language in Language::ALL {
                let mut visit = Visit::in_language(language);
                visit.query = PageQuery::parse(&format!("key=run.workers&value={value}"));
                let shown = sections(&visit, &settings, &settings, is_refused).into_string();
                let part = format!("id=\"setting-run.workers\" name=\"value\" {part}");
                assert!(shown.contains(&part), "{part}: {shown}");
                let focused = shown.matches("autofocus").count();
                assert_eq!(focused, usize::from(is_refused));
            }
        }
    }
}
