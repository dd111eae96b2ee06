//! Counts in sentences of the report, with links to the lists of the pairs that they count.

use maud::{Markup, html};

use super::pair_query::{
    ALIGNED_PAIRS, ALL_PAIRS, FAILED_PAIRS, LOW_CONFIDENCE_PAIRS, RETIRED_PAIRS, UNFINISHED_PAIRS,
};
use super::sentence::without_commands;
use super::visit::Visit;
use crate::messages::{marked_count, marked_parts, report_text, unmarked};
use crate::review::Language;
use mocban_report::{CountedPairs, CountedText, TextPart};

/// Returns sentences of the report, which are in English, in the language of the page and without commands. A count is a link
/// to its pairs. If it counts as many pairs of each of several metrics, a link for each metric follows the sentences.
pub(super) fn linked_sentences(visit: &Visit, text: &CountedText) -> Markup {
    let (mut marked, mut counts) = (String::new(), Vec::new());
    for part in text.parts() {
        match part {
            TextPart::Words(words) => marked += &unmarked(words),
            TextPart::Count(count, pairs) => {
                marked += &marked_count(counts.len(), count);
                counts.push(pairs);
            }
        }
    }
    let plain = without_commands(&marked);
    let said = match visit.language {
        Language::English => plain,
        Language::Vietnamese => report_text(&plain),
    };
    let linked = marked_parts(&said).into_iter().map(|(words, index)| {
        let pairs = index.and_then(|index| counts.get(index).copied());
        (words, pairs.unwrap_or_default())
    });
    let of_metrics = counts.iter().filter(|pairs| pairs.len() > 1);
    html! {
        @for (words, pairs) in linked {
            @if let [pairs] = pairs { a href=(list_of(*pairs)) { (words) } } @else { (words) }
        }
        @for (i, pairs) in of_metrics.copied().flatten().enumerate() {
            (if i == 0 { " " } else { " · " })
            a href=(list_of(*pairs)) { (name_of(visit, *pairs)) }
        }
    }
}

/// Returns the address of a list, relative to the pages of a project.
fn list_of(pairs: CountedPairs) -> String {
    let list = match pairs {
        CountedPairs::All => ALL_PAIRS,
        CountedPairs::Aligned => ALIGNED_PAIRS,
        CountedPairs::LowConfidence => LOW_CONFIDENCE_PAIRS,
        CountedPairs::Failed => FAILED_PAIRS,
        CountedPairs::Unfinished => UNFINISHED_PAIRS,
        CountedPairs::Retired => RETIRED_PAIRS,
        CountedPairs::Judged(metric, joint) => {
            return format!("pairs?verdict={joint}&metric={}", metric.name());
        }
    };
    list.to_owned()
}

/// Returns the name of a list beside lists of other metrics.
const fn name_of(visit: &Visit, pairs: CountedPairs) -> &'static str {
    match pairs {
        CountedPairs::Judged(metric, _) => visit.metric(metric),
        _ => visit.t("Pairs", "Các cặp"),
    }
}

#[cfg(test)]
mod tests {
    use super::linked_sentences;
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_catalog::PairResults;
    use mocban_core::domain::{FailureClass, ThresholdMetric, Verdict};
    use mocban_report::{CountedText, Report, ReportAccumulator};
    use mocban_results::TruthEvaluation;
    use mocban_results::test_fixtures::{done, failed, pending, with_confidence};

    fn report(pairs: &[PairResults]) -> Report {
        let mut report = ReportAccumulator::default();
        for pair in pairs {
            report.add(pair, &TruthEvaluation::default());
        }
        report.finish()
    }

    /// Returns sentences of a report in both languages with their links.
    fn linked(text: &CountedText) -> [String; 2] {
        [Language::English, Language::Vietnamese].map(|language| {
            let markup = linked_sentences(&Visit::in_language(language), text);
            let plain = markup.into_string().replace("&amp;", "&");
            plain.replace("<a href=\"pairs", "[").replace("</a>", "]")
        })
    }

    #[test]
    fn counts_of_the_answer_lead_to_their_pairs() {
        let report = report(&[
            with_confidence("a", 0.4),
            with_confidence("b", 0.9),
            failed("c", FailureClass::BadInput, "c.stl is empty"),
            pending("d"),
        ]);
        assert_eq!(
            linked(&report.headline[0]),
            [
                "[?state=aligned\">2] of [\">4] pairs are aligned, [?confidence=low&sort=confidence\">1] with a confidence \
                 below 0.5; [?state=failed&view=table\">1] failed and [?state=unfinished\">1] is not finished.",
                "[?state=aligned\">2] trên [\">4] cặp đã được căn chỉnh, [?confidence=low&sort=confidence\">1] cặp có độ tin \
                 cậy dưới 0,5; [?state=failed&view=table\">1] bị lỗi và [?state=unfinished\">1] chưa xong.",
            ]
        );
        assert_eq!(
            linked(&report.warnings[0]),
            [
                "2 of [\">4] pairs are in no row: [?state=failed&view=table\">1] failed, [?state=unfinished\">1] not finished.",
                "2 trên [\">4] cặp không có trong bảng nào: [?state=failed&view=table\">1] bị lỗi, \
                 [?state=unfinished\">1] chưa xong.",
            ]
        );
    }

    #[test]
    fn counts_of_verdicts_lead_to_their_pairs() {
        let [pass, fail] = [Verdict::Pass, Verdict::Fail];
        let report = report(&[
            done("a", 0.75, &[pass]),
            done("b", 0.75, &[pass]),
            done("c", 0.75, &[fail]),
            done("d", 0.75, &[Verdict::Unsure]),
            done("e", 0.75, &[pass, fail]),
        ]);
        let found = linked(&report.headline[1]);
        let of =
            |verdict: &str, count: u64| format!("[?verdict={verdict}&metric=ensemble\">{count}]");
        let (passed, decided) = (of("joint-pass", 2), of("decided", 3));
        let (conflicts, unsure) = (of("conflict", 1), of("joint-unsure", 1));
        for (text, said) in found.iter().zip([
            [
                format!("reviewers passed {passed} of {decided} decided"),
                format!("Not counted: {conflicts} on which reviewers disagree and {unsure} about"),
            ],
            [
                format!("người đánh giá cho đạt {passed} trên {decided} kết quả"),
                format!("Không tính: {conflicts} kết quả có bất đồng và {unsure} kết quả chưa"),
            ],
        ]) {
            for said in said {
                assert!(text.contains(&said), "{said}: {text}");
            }
        }
    }

    #[test]
    fn results_with_a_conflict_or_an_earlier_verdict_are_listed_by_metric() {
        let mut pair = done("a", 0.75, &[Verdict::Pass, Verdict::Fail]);
        for record in &mut pair.metrics {
            if record.outcome.metric == ThresholdMetric::Density {
                record.verdicts.clear();
                record.older_verdicts = 1;
            }
        }
        let report = report(&[pair, done("b", 0.75, &[])]);
        let warnings: Vec<_> = report.warnings.iter().map(linked).collect();
        let stale = "[?verdict=stale&metric=density\">1]";
        let of_density = [
            format!(
                "Pixel density: of [?state=aligned\">2] results, {stale} has a verdict on an earlier result only."
            ),
            format!(
                "Mật độ điểm ảnh: trong [?state=aligned\">2] kết quả, {stale} kết quả chỉ có đánh giá cho lần tính trước."
            ),
        ];
        assert!(warnings.contains(&of_density), "{warnings:?}");
        let disagree = warnings
            .iter()
            .find(|texts| texts[0].contains("1 is unsure"));
        let [english, vietnamese] = disagree.expect("a conflict");
        let of = |metric: &str, name: &str| format!("[?verdict=conflict&metric={metric}\">{name}]");
        let ensemble = of("ensemble", "Ensemble");
        assert!(english.contains(&ensemble), "{english}");
        assert!(!english.contains("metric=density"), "{english}");
        let ensemble = of("ensemble", "Kết hợp");
        assert!(vietnamese.contains(&ensemble), "{vietnamese}");
    }

    #[test]
    fn numbers_of_other_things_have_no_links() {
        let text = CountedText::from("Characters are missing: 1 block failed.");
        assert_eq!(linked(&text)[0], &*text);
        let mut retired = ReportAccumulator::default();
        retired.set_retired(1_234);
        let [english, vietnamese] = linked(&retired.finish().headline[0]);
        assert!(
            english.contains("all [?state=retired\">1234] pairs"),
            "{english}"
        );
        let said = "cả [?state=retired\">1234] cặp";
        assert!(vietnamese.contains(said), "{vietnamese}");
    }
}
