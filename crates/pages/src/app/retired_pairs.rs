//! Retired pairs: their list, and what the page of one says. They are in no count, and most can be brought back.

use maud::{Markup, html};

use super::address::encoded;
use super::chosen_pairs::list_field;
use super::components::{action_form, empty, grouped};
use super::failure::AppResult;
use super::pair_query::{PairQuery, cursor_text};
use super::projects::OpenProject;
use super::visit::Visit;
use mocban_catalog::{ListedRetiredPair, PairCursor, RetiredPair};
use mocban_core::domain::{RetireCause, one_line};

/// Most retired pairs on a page.
const SHOWN: usize = 100;

/// Returns the list of retired pairs, of the block and the character of the filter.
pub(super) async fn retired_list(
    visit: &Visit,
    open: &OpenProject,
    query: &PairQuery,
) -> AppResult<Markup> {
    let filter = &query.filter;
    let of = (filter.block.as_deref(), filter.character.as_deref());
    let after = query.after.map_or(0, |after| after.id);
    let mut pairs = open.catalog.retired_page(of, after, SHOWN + 1).await?;
    let is_last = pairs.len() <= SHOWN;
    pairs.truncate(SHOWN);
    let next = pairs.last().filter(|_| !is_last).map(|last| {
        let next = PairCursor {
            key: 0.0,
            id: last.id,
        };
        visit.query.with("after", &cursor_text(next)).text()
    });
    Ok(html! {
        p.muted { (visit.t(
            "Retired pairs are in no count, report or export. Of the filter, only block and character apply to them.",
            "Các cặp này không có trong thống kê, báo cáo hay dữ liệu xuất. Trong bộ lọc, chỉ ván và chữ áp dụng cho chúng.",
        )) }
        @if pairs.is_empty() {
            (empty(visit.t("No pair matches.", "Không có cặp nào phù hợp."), &html! {}))
        } @else {
            (table(visit, &pairs))
        }
        nav.pager aria-label=(visit.t("Pages of the list", "Các trang của danh sách")) {
            @if query.after.is_some() {
                a.button href={ (visit.here) (visit.query.with("after", "").text()) } { (visit.t("First page", "Trang đầu")) } " "
            }
            @if let Some(next) = next {
                a.button rel="next" href={ (visit.here) (next) } { (visit.t("Next page", "Trang sau")) }
            }
        }
    })
}

fn table(visit: &Visit, pairs: &[ListedRetiredPair]) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label=(visit.t("Retired pairs", "Các cặp đã đưa ra khỏi thống kê")) {
            table #retired-pairs {
                thead { tr {
                    @for title in [
                        visit.t("Id", "Mã"), visit.t("Character", "Chữ"), visit.t("Block", "Ván"), visit.t("When", "Lúc"),
                        visit.t("Why", "Lý do"), visit.t("Back", "Đưa trở lại"),
                    ] { th scope="col" { (title) } }
                } }
                tbody { @for pair in pairs { (row(visit, pair)) } }
            }
        }
    }
}

fn row(visit: &Visit, pair: &ListedRetiredPair) -> Markup {
    let retired = &pair.retired;
    let name = retired.name.as_str();
    html! {
        tr {
            th scope="row" { a href={ "pair/" (encoded(name)) "/" } { (one_line(name)) } }
            td { (pair.character.as_deref().map(one_line).unwrap_or_default()) }
            td { (pair.block.as_deref().map(one_line).unwrap_or_default()) }
            td { (visit.time(retired.at)) }
            td.reason { (cause(visit, retired.cause)) }
            td { (way_back(visit, retired, "actions/restore", &list_field(visit))) }
        }
    }
}

/// Says who or what retired a pair.
const fn cause(visit: &Visit, cause: RetireCause) -> &'static str {
    match cause {
        RetireCause::Person => visit.t("a person took it out", "người dùng đã đưa ra"),
        RetireCause::List => visit.t(
            "a list that replaced the others does not have it",
            "danh sách thay thế các danh sách khác không có cặp này",
        ),
        RetireCause::Labels => visit.t(
            "its box is gone from the labels of its block",
            "khung của cặp không còn trong nhãn của ván",
        ),
    }
}

/// Returns the button that brings a pair back, or says how it comes back without one.
fn way_back(visit: &Visit, retired: &RetiredPair, action: &str, fields: &Markup) -> Markup {
    let name = retired.name.as_str();
    let text = visit.t("Bring it back", "Đưa trở lại");
    match retired.cause {
        RetireCause::Person | RetireCause::List => action_form(
            action,
            "inline",
            &html! {
                input type="hidden" name="pair" value=(name);
                (fields)
                button aria-label={ (text) ": " (one_line(name)) } { (text) }
            },
        ),
        RetireCause::Labels => html! { (visit.t(
            "It comes back when the labels have its box again and the block has run.",
            "Cặp sẽ trở lại khi nhãn có lại khung của nó và ván đã được chạy.",
        )) },
    }
}

/// Returns the band at the top of the page of a retired pair.
pub(super) fn retired_band(visit: &Visit, retired: &RetiredPair) -> Markup {
    html! {
        div #retired.notice.warn role="status" {
            p { b { (visit.t("This pair is retired.", "Cặp này đã được đưa ra khỏi thống kê.")) } " "
                (visit.t("It is in no count, report or export. Its results and verdicts are kept.", "Cặp không có trong thống kê, báo cáo hay dữ liệu xuất. Kết quả và đánh giá của nó vẫn được giữ.")) }
            p { (visit.time(retired.at)) ": " (cause(visit, retired.cause)) "." }
            (way_back(visit, retired, "../../actions/restore", &html! {}))
        }
    }
}

/// Returns the name of the filter of retired pairs, with their number.
pub(super) fn filter_name(visit: &Visit, count: u64) -> String {
    format!(
        "{} ({})",
        visit.t("retired", "đã đưa ra khỏi thống kê"),
        grouped(count)
    )
}
