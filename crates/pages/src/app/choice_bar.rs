//! The bar below a list with which pairs are chosen, and what can be done with them. A script counts them.

use maud::{Markup, html};

use super::chosen_pairs::{MAX_CHOSEN, RESUMED, list_field, without_done};
use super::components::{action_form, choice, grouped};
use super::exports::PURPOSES;
use super::visit::Visit;
use mocban_catalog::PairResults;
use mocban_core::domain::one_line;

/// Returns the field that chooses a pair of the list. It says whether the pair waits or has failed.
pub(super) fn choice_box(visit: &Visit, pair: &PairResults) -> Markup {
    let name = pair.attributes.name.as_str();
    let is_open = RESUMED.contains(&pair.status);
    html! {
        label.pick {
            input type="checkbox" data-pair=(name) data-open[is_open] autocomplete="off"
                aria-label={ (visit.t("Choose", "Chọn")) " " (one_line(name)) };
        }
    }
}

/// Returns the bar of the list of a project. The browser keeps the chosen ids under a name with the project.
pub(super) fn choice_bar(visit: &Visit, key: &str) -> Markup {
    let kept = format!("mocban-chosen:{key}");
    let list = without_done(&visit.query).text();
    let most = visit.t(
        "At most this many pairs can be chosen",
        "Chỉ có thể chọn tối đa số cặp này",
    );
    html! {
        section #choice.choice-bar data-kept=(kept) data-max=(MAX_CHOSEN) aria-label=(visit.t("Chosen pairs", "Các cặp đã chọn")) {
            p #chosen role="status" data-text=(visit.t("Chosen: {n}, {here} of them on this page", "Đã chọn: {n}, trong đó {here} ở trang này"))
                data-none=(visit.t("Choose pairs to do something with them.", "Hãy chọn các cặp để thao tác với chúng.")) {}
            // A narrow window shows the list behind a low bar; the script folds this there.
            details #choice-more open {
                summary { (visit.t("Actions", "Thao tác")) }
                p.row {
                    button #choose-page type="button" { (visit.t("All on this page", "Tất cả ở trang này")) }
                    button #choose-all type="button" data-from={ "pairs/listed" (list) } { (visit.t("All that match", "Tất cả phù hợp")) }
                    button #choose-none type="button" hidden { (visit.t("None", "Bỏ chọn")) }
                }
                p.muted #choice-help { (visit.t(
                    "Shift with a click or an arrow key chooses a range.",
                    "Giữ Shift rồi bấm chuột hoặc phím mũi tên để chọn một dãy.",
                )) }
                div #choice-actions.row hidden { (changes(visit, &kept)) (export_form(visit, &kept)) }
            }
            p #choice-problem.problem role="alert" data-most={ (most) ": " (grouped(MAX_CHOSEN as u64)) } hidden {}
        }
        script type="module" src={ (visit.root) "assets/choose.js" } {}
    }
}

/// Returns the buttons that change pairs. `{n}` stands for their number.
fn changes(visit: &Visit, kept: &str) -> Markup {
    chosen_form(
        "actions/chosen",
        kept,
        &html! {
            (list_field(visit))
            button #compute name="change" value="compute" data-text=(visit.t("Compute again ({n})", "Tính lại ({n})"))
                data-ask=(visit.t("Pairs whose results are computed again: {n}. Continue?", "Số cặp sẽ được tính lại: {n}. Tiếp tục?")) {}
            button #resume name="change" value="resume" data-counts="open"
                data-text=(visit.t("Run the waiting and failed of them ({n})", "Chạy các cặp chờ hoặc lỗi trong đó ({n})")) {}
            button #judge name="change" value="review" data-text=(visit.t("Judge these ({n})", "Đánh giá các cặp này ({n})")) {}
            button #retire name="change" value="retire" data-text=(visit.t("Take out of every count ({n})", "Đưa ra khỏi thống kê ({n})"))
                data-ask=(visit.t(
                    "Pairs to take out of every count: {n}. Their results and verdicts are kept, and they can be brought back. Continue?",
                    "Số cặp sẽ được đưa ra khỏi mọi thống kê: {n}. Kết quả và đánh giá của chúng vẫn được giữ và có thể đưa trở lại. Tiếp tục?",
                )) {}
        },
    )
}

fn export_form(visit: &Visit, kept: &str) -> Markup {
    chosen_form(
        "actions/export",
        kept,
        &html! {
            input type="hidden" name="only" value="all";
            input type="hidden" name="metric" value="";
            select name="purpose" aria-label=(visit.t("What the export is for", "Mục đích xuất")) {
                @for (name, _, texts) in PURPOSES { (choice(name, texts[visit.index()], None)) }
            }
            button #export-chosen data-text=(visit.t("Export only these ({n})", "Chỉ xuất các cặp này ({n})")) {}
        },
    )
}

/// Returns a form that also sends the ids that are kept under a name.
fn chosen_form(action: &str, kept: &str, content: &Markup) -> Markup {
    html! {
        div data-chosen=(kept) { (action_form(action, "inline", content)) }
    }
}
