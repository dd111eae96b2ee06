//! The saved views above the list of pairs, their addresses, and the actions that change them.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::response::Redirect;
use maud::{Markup, html};
use serde::Deserialize;
use serde_json::{Value, json};

use super::action_body::ActionBody;
use super::address::{PageQuery, encoded};
use super::chosen_pairs::metric_is_lacking;
use super::components::action_form;
use super::failure::{AppFailure, AppResult};
use super::pair_query::PairQuery;
use super::projects::OpenProject;
use super::saved_views::{self, NAME_CHARS, SavedView, ViewChange, gone, view_name};
use super::state::AppState;
use super::visit::Visit;
use mocban_core::domain::one_line;
use mocban_project::blocking::blocking;
use mocban_system::platform;

/// What is done with a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ViewAction {
    Save,
    Rename,
    Remove,
}

/// The fields of the forms about views.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ViewBody {
    action: ViewAction,
    /// The name of the view that is renamed or removed.
    #[serde(default)]
    view: String,
    /// The name that is given.
    #[serde(default)]
    name: String,
    /// The list of the view, as its address names it.
    list: String,
}

async fn read_views(open: &OpenProject) -> AppResult<Vec<SavedView>> {
    let dir = open.dir.clone();
    let read = blocking(move || saved_views::read(&dir)).await;
    let read = read.map_err(|stopped| AppFailure::of(stopped, &open.dir));
    read?
}

/// Leads from the address of a view to its list.
pub(super) async fn view(
    State(state): State<Arc<AppState>>,
    Path((key, name)): Path<(String, String)>,
) -> AppResult<Redirect> {
    let open = state.open(&key).await?;
    let views = read_views(&open).await?;
    let found = views.iter().find(|view| view.is_named(&name));
    let found = found.ok_or_else(|| AppFailure::missing(gone(&name)))?;
    let list = found.query().text();
    Ok(Redirect::to(&format!("../../pairs{list}")))
}

/// Saves, renames or removes a view.
pub(super) async fn change(
    State(state): State<Arc<AppState>>,
    Path(key): Path<String>,
    ActionBody(body): ActionBody<ViewBody>,
) -> AppResult<Json<Value>> {
    let open = state.open(&key).await?;
    let change = body.change()?;
    let dir = open.dir.clone();
    let changed = blocking(move || saved_views::change(&dir, change)).await;
    let changed = changed.map_err(|stopped| AppFailure::of(stopped, &open.dir));
    changed??;
    Ok(Json(json!({ "reload": true })))
}

impl ViewBody {
    fn change(self) -> AppResult<ViewChange> {
        let known = SavedView {
            name: self.view,
            list: self.list,
        };
        Ok(match self.action {
            ViewAction::Save => {
                let list = PairQuery::plain(&known.query());
                if PairQuery::of(&list).lacks_compared {
                    return Err(AppFailure::refused(metric_is_lacking()));
                }
                ViewChange::Save(SavedView::new(&self.name, &list)?)
            }
            ViewAction::Rename => ViewChange::Rename(known, view_name(&self.name)?),
            ViewAction::Remove => ViewChange::Remove(known),
        })
    }
}

/// Returns the saved views as links, and a form that saves the list of the page, or changes the view that it is.
pub(super) async fn view_bar(visit: &Visit, open: &OpenProject) -> Markup {
    let may_save = visit.read_only.is_none() && platform::may_write(&open.dir);
    match read_views(open).await {
        Ok(views) => bar(visit, &views, may_save),
        Err(failure) => html! {
            p.notice.bad #no-views role="alert" { (failure.text(visit.language)) }
        },
    }
}

fn bar(visit: &Visit, views: &[SavedView], may_save: bool) -> Markup {
    let list = PairQuery::plain(&visit.query);
    let is_shown = |view: &SavedView| PairQuery::plain(&view.query()) == list;
    let marked: Vec<(&SavedView, bool)> = views.iter().map(|view| (view, is_shown(view))).collect();
    let shown = marked.iter().filter(|(_, is_shown)| *is_shown);
    let shown: Vec<&SavedView> = shown.map(|(view, _)| *view).collect();
    let is_savable = list != PageQuery::default() && !PairQuery::of(&list).lacks_compared;
    html! {
        @if !views.is_empty() {
            p.views #saved-views {
                (visit.t("Saved views", "Danh sách đã lưu")) ": "
                @for (view, is_shown) in &marked {
                    a href={ "pairs/view/" (encoded(&view.name)) } aria-current=[is_shown.then_some("true")] { (one_line(&view.name)) } " "
                }
            }
        }
        @if may_save && shown.is_empty() && is_savable {
            details #save-view.not-on-paper {
                summary { (visit.t("Save this list as a view", "Lưu danh sách này")) }
                (save_form(visit, &list))
            }
        }
        @if may_save && !shown.is_empty() {
            details #change-view.not-on-paper {
                summary { (visit.t("Rename or delete this view", "Đổi tên hoặc xóa danh sách đã lưu này")) }
                @for view in shown { (change_forms(visit, view)) }
            }
        }
    }
}

fn save_form(visit: &Visit, list: &PageQuery) -> Markup {
    action_form(
        "actions/view",
        "inline",
        &html! {
            input type="hidden" name="list" value=(list.text().trim_start_matches('?'));
            (name_field(visit, ""))
            button name="action" value="save" { (visit.t("Save", "Lưu")) }
            p.muted { (visit.t("Everyone who opens this project sees the view.", "Mọi người mở dự án này đều thấy danh sách đã lưu.")) }
        },
    )
}

/// Returns the forms that rename and remove a view.
fn change_forms(visit: &Visit, view: &SavedView) -> Markup {
    let name = one_line(&view.name);
    let of_view = html! {
        input type="hidden" name="view" value=(view.name);
        input type="hidden" name="list" value=(view.list);
    };
    let [rename, remove] = [visit.t("Rename", "Đổi tên"), visit.t("Delete", "Xóa")];
    let ask = visit.t(
        "Delete this view? No pair is changed. View: ",
        "Xóa danh sách đã lưu này? Không cặp nào bị thay đổi. Danh sách: ",
    );
    html! {
        div.row {
            (action_form("actions/view", "inline", &html! {
                (of_view)
                (name_field(visit, &view.name))
                button name="action" value="rename" aria-label={ (rename) ": " (name) } { (rename) }
            }))
            (action_form("actions/view", "inline", &html! {
                (of_view)
                button name="action" value="remove" aria-label={ (remove) ": " (name) } data-confirm={ (ask) (name) } { (remove) }
            }))
        }
    }
}

fn name_field(visit: &Visit, name: &str) -> Markup {
    html! {
        label { (visit.t("Name", "Tên")) " "
            input name="name" value=(name) required maxlength=(NAME_CHARS) autocomplete="off";
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ViewBody, bar};
    use crate::app::address::PageQuery;
    use crate::app::saved_views::SavedView;
    use crate::app::visit::Visit;
    use crate::review::Language;

    fn shown(language: Language, address: &str, may_save: bool) -> String {
        let mut visit = Visit::in_language(language);
        visit.query = PageQuery::parse(address);
        let views = [
            ("Thấp", "confidence=low"),
            ("a/b", "state=failed&view=table"),
        ];
        let views = views.map(|(name, list)| SavedView {
            name: name.to_owned(),
            list: list.to_owned(),
        });
        bar(&visit, &views, may_save).into_string()
    }

    #[test]
    fn views_are_links_and_the_list_of_the_page_is_saved_or_changed() {
        let links = [
            "href=\"pairs/view/Th%E1%BA%A5p\"",
            "href=\"pairs/view/a%2Fb\"",
        ];
        for (address, has_save, has_change) in [
            ("", false, false),
            ("after=0,7", false, false),
            ("sort=iou", true, false),
            ("differs=0.1", false, false),
            ("confidence=low&sort=imported", false, true),
            ("view=table&state=failed&after=0,7", false, true),
        ] {
            let html = shown(Language::English, address, true);
            for link in links {
                assert!(html.contains(link), "{address}: {html}");
            }
            assert_eq!(html.contains("id=\"save-view\""), has_save, "{address}");
            assert_eq!(html.contains("id=\"change-view\""), has_change, "{address}");
            let current = usize::from(has_change);
            assert_eq!(html.matches("aria-current").count(), current, "{address}");
            let read = shown(Language::English, address, false);
            assert!(read.contains(links[0]), "{read}");
            assert!(!read.contains("<form"), "{read}");
        }
        let vietnamese = shown(Language::Vietnamese, "sort=iou", true);
        for part in [
            "Danh sách đã lưu",
            "Lưu danh sách này",
            "Mọi người mở dự án",
        ] {
            assert!(vietnamese.contains(part), "{part}: {vietnamese}");
        }
    }

    #[test]
    fn only_a_list_that_can_be_shown_is_saved() {
        let body = |list: &str| {
            let body = serde_json::json!({ "action": "save", "name": "x", "list": list });
            let body: ViewBody = serde_json::from_value(body).expect("the fields");
            body.change()
        };
        body("state=failed").expect("a view");
        for list in ["", "after=0,7", "differs=0.1"] {
            let failure = body(list).expect_err(list);
            for language in Language::ALL {
                assert!(!failure.text(language).is_empty(), "{list}");
            }
        }
    }
}
