//! The numbers of a pair with their meaning, under one metric or two.

use maud::{Markup, html};

use super::components::difference;
use super::visit::Visit;
use mocban_catalog::MetricRecord;
use mocban_core::domain::{MetricOutcome, one_line};

/// A number of a result.
struct PairNumber {
    /// In both languages.
    name: [&'static str; 2],
    /// In both languages.
    meaning: [&'static str; 2],
    /// Digits behind the point.
    digits: usize,
    unit: &'static str,
    read: fn(&MetricOutcome) -> Option<f64>,
}

const NUMBERS: [PairNumber; 8] = [
    PairNumber {
        name: ["Confidence", "Độ tin cậy"],
        meaning: [
            "Calibrated probability that this alignment is right. If it is low, look at the pictures yourself.",
            "Xác suất đã hiệu chuẩn rằng cách căn chỉnh này đúng. Nếu thấp, hãy tự xem hình.",
        ],
        digits: 3,
        unit: "",
        read: |outcome| outcome.confidence,
    },
    PairNumber {
        name: ["IoU", "IoU"],
        meaning: [
            "Common part of the two stroke masks, divided by all of both. Ink spreads, so the true alignment stays below 1.",
            "Phần chung của hai mặt nạ nét chia cho toàn bộ hai mặt nạ. Mực loang nên căn chỉnh đúng vẫn dưới 1.",
        ],
        digits: 3,
        unit: "",
        read: |outcome| Some(outcome.scores.iou),
    },
    PairNumber {
        name: ["Dice", "Dice"],
        meaning: [
            "The same comparison, in which the common part counts twice.",
            "Phép so sánh tương tự, trong đó phần chung được tính hai lần.",
        ],
        digits: 3,
        unit: "",
        read: |outcome| Some(outcome.scores.dice),
    },
    PairNumber {
        name: ["SSIM", "SSIM"],
        meaning: [
            "Structural similarity of the two masks.",
            "Độ tương đồng cấu trúc của hai mặt nạ.",
        ],
        digits: 3,
        unit: "",
        read: |outcome| Some(outcome.scores.ssim),
    },
    PairNumber {
        name: ["Rotation", "Góc xoay"],
        meaning: [
            "How far the relief is turned to lie on the print, clockwise.",
            "Mặt khắc được xoay bao nhiêu để khớp bản in, theo chiều kim đồng hồ.",
        ],
        digits: 1,
        unit: "°",
        read: |outcome| Some(outcome.angle_deg),
    },
    PairNumber {
        name: ["Scale", "Tỉ lệ"],
        meaning: [
            "Pixels of the print per pixel of the depth map.",
            "Số điểm ảnh của bản in trên một điểm ảnh của bản đồ độ sâu.",
        ],
        digits: 3,
        unit: "",
        read: |outcome| Some(outcome.scale),
    },
    PairNumber {
        name: ["Threshold", "Ngưỡng"],
        meaning: [
            "Height over the carved face from which on the relief counts as stroke, in the unit of the scan.",
            "Độ cao so với mặt ván mà từ đó mặt khắc được tính là nét, theo đơn vị của bản quét.",
        ],
        digits: 3,
        unit: "",
        read: |outcome| Some(outcome.threshold_depth),
    },
    PairNumber {
        name: ["Margin", "Khoảng cách điểm"],
        meaning: [
            "Score of this pose minus that of the best other pose. A small margin means a close decision.",
            "Điểm của tư thế này trừ điểm của tư thế tốt nhất còn lại. Khoảng cách nhỏ nghĩa là khó phân định.",
        ],
        digits: 3,
        unit: "",
        read: |outcome| Some(outcome.margin),
    },
];

impl PairNumber {
    fn text(&self, visit: &Visit, outcome: &MetricOutcome) -> String {
        let value = (self.read)(outcome);
        value.map_or_else(
            || "–".to_owned(),
            |value| visit.decimal(value, self.digits) + self.unit,
        )
    }

    /// Returns the number of one result minus that of another. Angles differ by half a turn at most.
    fn difference(&self, visit: &Visit, outcome: &MetricOutcome, other: &MetricOutcome) -> String {
        let [mut value, other] = [outcome, other].map(self.read);
        if let (Some(angle), Some(other), "°") = (&mut value, other, self.unit) {
            *angle -= 360.0 * ((*angle - other) / 360.0).round();
        }
        difference(visit, value, other, self.digits) + self.unit
    }
}

/// Returns the numbers of a result and its verdicts. With another result, there is a column for each and one for the difference.
pub(super) fn numbers(
    visit: &Visit,
    record: &MetricRecord,
    other: Option<&MetricRecord>,
) -> Markup {
    let title = visit.t("Numbers", "Các con số");
    html! {
        section #numbers {
            h2 { (title) }
            @match other {
                None => (table(visit, title, &record.outcome, None)),
                Some(other) => {
                    @let outcomes = [&record.outcome, &other.outcome];
                    (compared_numbers(visit, title, outcomes, outcomes.map(|outcome| visit.metric(outcome.metric))))
                }
            }
            @for record in [Some(record), other].into_iter().flatten() { (verdicts(visit, record, other.is_some())) }
        }
    }
}

/// Returns the table of the numbers of two results with their titles, and their differences. `label` names the table.
pub(super) fn compared_numbers(
    visit: &Visit,
    label: &str,
    [outcome, other]: [&MetricOutcome; 2],
    titles: [&str; 2],
) -> Markup {
    table(visit, label, outcome, Some((other, titles)))
}

/// Returns the table of the numbers of a result, or of two with their titles.
fn table(
    visit: &Visit,
    label: &str,
    outcome: &MetricOutcome,
    other: Option<(&MetricOutcome, [&str; 2])>,
) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label=(label) {
            table.meanings {
                @if let Some((_, titles)) = other {
                    thead { tr {
                        th scope="col" { (visit.t("Number", "Con số")) }
                        @for title in titles { th.number scope="col" { (title) } }
                        th.number scope="col" { (visit.t("Difference", "Chênh lệch")) }
                        th scope="col" { (visit.t("Meaning", "Ý nghĩa")) }
                    } }
                }
                tbody { @for number in &NUMBERS {
                    tr {
                        th scope="row" { (number.name[visit.index()]) }
                        td.number { (number.text(visit, outcome)) }
                        @if let Some((other, _)) = other {
                            td.number { (number.text(visit, other)) }
                            td.number { (number.difference(visit, outcome, other)) }
                        }
                        td.muted { (number.meaning[visit.index()]) }
                    }
                } }
            }
        }
    }
}

/// Returns the verdicts on a result, with its metric if there are two.
fn verdicts(visit: &Visit, record: &MetricRecord, has_other: bool) -> Markup {
    html! {
        @for given in &record.verdicts {
            p {
                @if has_other { (visit.metric(record.outcome.metric)) ": " }
                span.verdict.(given.verdict.name()) { (visit.verdict(given.verdict)) }
                " " (one_line(&given.reviewer))
                @if let Some(reason) = given.reason { ": " (visit.reason(reason)) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::NUMBERS;
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_core::domain::ThresholdMetric;
    use mocban_results::test_fixtures;

    #[test]
    fn numbers_and_their_difference_have_a_sign_and_a_unit() {
        let mut first = test_fixtures::metric(ThresholdMetric::Density, 0.5, &[]).outcome;
        let mut second = first;
        (first.angle_deg, second.angle_deg) = (-179.0, 178.5);
        (first.confidence, second.confidence) = (Some(0.25), None);
        let visit = Visit::in_language(Language::English);
        let of = |name: &str| NUMBERS.iter().find(|number| number.name[0] == name);
        let rotation = of("Rotation").expect("an angle");
        assert_eq!(rotation.text(&visit, &first), "−179.0°");
        assert_eq!(rotation.difference(&visit, &first, &second), "+2.5°");
        let confidence = of("Confidence").expect("a confidence");
        assert_eq!(confidence.text(&visit, &first), "0.250");
        assert_eq!(confidence.difference(&visit, &first, &second), "–");
        let iou = of("IoU").expect("a score");
        assert_eq!(iou.difference(&visit, &first, &second), "0.000");
        let vietnamese = Visit::in_language(Language::Vietnamese);
        assert_eq!(rotation.text(&vietnamese, &first), "−179,0°");
    }
}
