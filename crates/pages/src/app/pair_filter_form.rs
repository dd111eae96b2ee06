//! The form that filters and sorts the list of pairs.

use maud::{Markup, html};

use super::components::choice;
use super::number_text::with_decimal_sign;
use super::pair_query::{DIFFERENCES, RETIRED};
use super::retired_pairs::filter_name;
use super::visit::Visit;
use mocban_catalog::{JointVerdict, PairOrder};
use mocban_core::domain::{FailureClass, JobStatus, ThresholdMetric, Verdict, one_line};

/// Most blocks from which one is chosen without typing.
const LISTED_BLOCKS: usize = 30;

/// Returns a choice of the filter with its label.
fn field(visit: &Visit, name: &str, label: &str, options: &[(&str, &str)]) -> Markup {
    let chosen = visit.query.get(name);
    html! {
        label { span { (label) }
            select name=(name) { @for (value, text) in options { (choice(value, text, chosen)) } }
        }
    }
}

/// Returns the form that filters and sorts a list.
pub(super) fn filter_form(visit: &Visit, blocks: &[String], retired: u64) -> Markup {
    let any = visit.t("any", "bất kỳ");
    let retired = filter_name(visit, retired);
    let classes = FailureClass::ALL.map(|class| (class.name(), visit.class(class)));
    let mut classes = classes.to_vec();
    classes.insert(0, ("", any));
    let mut verdicts = vec![("", any)];
    verdicts.extend(JointVerdict::ALL.map(|one| (one.name(), visit.joint_verdict(one))));
    verdicts.extend(Verdict::ALL.map(|one| (one.name(), visit.given_by_somebody(one))));
    verdicts.push(("judged", visit.t("judged", "đã đánh giá")));
    verdicts.push(("none", visit.t("not judged", "chưa đánh giá")));
    let metrics = ThresholdMetric::ALL.map(|metric| (metric.name(), visit.metric(metric)));
    let metric = visit
        .query
        .get("metric")
        .unwrap_or(ThresholdMetric::DEFAULT.name());
    html! {
        form.filter method="get" action=(visit.here) aria-label=(visit.t("Filter", "Bộ lọc")) {
            @if let Some(view) = visit.query.get("view") { input type="hidden" name="view" value=(view); }
            (field(visit, "state", visit.t("State", "Trạng thái"), &[
                ("", any), ("aligned", visit.status(JobStatus::Done)), ("failed", visit.status(JobStatus::Quarantined)),
                ("waiting", visit.status(JobStatus::Ready)), ("running", visit.status(JobStatus::Leased)),
                ("unfinished", visit.t("not finished", "chưa xong")), (RETIRED, &retired),
            ]))
            (field(visit, "class", visit.t("Why failed", "Lý do lỗi"), &classes))
            (field(visit, "confidence", visit.t("Confidence", "Độ tin cậy"), &[("", any), ("low", visit.t("low", "thấp"))]))
            (field(visit, "verdict", visit.t("Verdict", "Đánh giá"), &verdicts))
            (block_field(visit, blocks))
            label { span { (visit.t("Character", "Chữ")) }
                input.short name="character" value=[visit.query.get("character")] autocomplete="off";
            }
            (field(visit, "sort", visit.t("Order", "Thứ tự"), &[
                (PairOrder::Imported.name(), visit.t("as imported", "như khi nhập")),
                (PairOrder::LeastConfident.name(), visit.t("least confident first", "độ tin cậy thấp trước")),
                (PairOrder::MostConfident.name(), visit.t("most confident first", "độ tin cậy cao trước")),
                (PairOrder::LowestIou.name(), visit.t("lowest IoU first", "IoU thấp trước")),
                (PairOrder::HighestIou.name(), visit.t("highest IoU first", "IoU cao trước")),
            ]))
            label { span { (visit.t("Metric", "Độ đo")) }
                select name="metric" { @for (value, text) in metrics { (choice(value, text, Some(metric))) } }
            }
            (comparison_fields(visit, &metrics))
            button.primary { (visit.t("Show", "Hiện")) }
            a href=(visit.here) { (visit.t("Reset", "Đặt lại")) }
        }
    }
}

/// Returns the choice of a block: from a list if there are few, or else by its name, of which the first are suggested.
fn block_field(visit: &Visit, blocks: &[String]) -> Markup {
    let chosen = visit.query.get("block");
    let is_listed = chosen.is_none_or(|chosen| blocks.iter().any(|block| block == chosen));
    html! {
        label { span { (visit.t("Block", "Ván")) }
            @if is_listed && (1..=LISTED_BLOCKS).contains(&blocks.len()) {
                select name="block" {
                    (choice("", visit.t("any", "bất kỳ"), chosen))
                    @for block in blocks { (choice(block, &one_line(block), chosen)) }
                }
            } @else {
                input name="block" value=[chosen] list="blocks" autocomplete="off";
                datalist #blocks { @for block in blocks { option value=(block) {} } }
            }
        }
    }
}

/// Returns the choices of another metric, and of a difference of IoU.
fn comparison_fields(visit: &Visit, metrics: &[(&str, &str)]) -> Markup {
    let none = [("", visit.t("none", "không"))];
    let others: Vec<_> = none.iter().chain(metrics).copied().collect();
    let any = [("", visit.t("any", "bất kỳ"))];
    let shown = DIFFERENCES.map(|text| with_decimal_sign(visit.language, text.to_owned()));
    let differences = DIFFERENCES.iter().zip(&shown);
    let differences = differences.map(|(value, text)| (*value, text.as_str()));
    let differences: Vec<_> = any.into_iter().chain(differences).collect();
    html! {
        (field(visit, "compare", visit.t("Compare with", "So sánh với"), &others))
        (field(visit, "differs", visit.t("IoU differs by at least", "IoU lệch ít nhất"), &differences))
    }
}

#[cfg(test)]
mod tests {
    use super::{LISTED_BLOCKS, block_field};
    use crate::app::address::PageQuery;
    use crate::app::visit::Visit;
    use crate::review::Language;

    #[test]
    fn a_block_is_chosen_from_a_list_of_few_and_suggested_from_many() {
        let mut visit = Visit::in_language(Language::English);
        visit.query = PageQuery::parse("block=b+03");
        let shown = |visit: &Visit, count: usize| {
            let blocks: Vec<String> = (0..count).map(|block| format!("b {block:02}")).collect();
            block_field(visit, &blocks).into_string()
        };
        let few = shown(&visit, LISTED_BLOCKS);
        assert!(few.contains("<option value=\"b 03\" selected>"), "{few}");
        assert!(!few.contains("<input"), "{few}");
        for count in [0, 3, LISTED_BLOCKS + 1] {
            let typed = shown(&visit, count);
            assert!(typed.contains("value=\"b 03\" list=\"blocks\""), "{typed}");
            assert_eq!(typed.matches("<option").count(), count);
        }
    }
}
