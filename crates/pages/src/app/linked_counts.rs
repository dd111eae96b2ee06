//! Counts in sentences of the report, with links to the lists of the pairs that they count.

use std::ops::Range;

use maud::{Markup, html};

use super::pair_query::{
    ALIGNED_PAIRS, ALL_PAIRS, FAILED_PAIRS, LOW_CONFIDENCE_PAIRS, RETIRED_PAIRS, UNFINISHED_PAIRS,
};
use crate::review::Language;
use mocban_core::domain::ThresholdMetric;
use mocban_report::Report;
use mocban_results::number_format::format_count;

/// A count that a sentence of the report has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ReportCount {
    Pairs,
    Done,
    LowConfidence,
    Failed,
    Pending,
    /// Pairs without a result.
    Missing,
    /// Results that reviewers passed.
    Passed,
    /// Results that reviewers passed or failed.
    Decided,
    Retired,
}

/// The words around counts in English and Vietnamese. `#` is the count that is linked; others are in braces.
const PHRASES: [(ReportCount, [&str; 2]); 19] = [
    (
        ReportCount::Done,
        [
            "# of {pairs} pairs are aligned",
            "# trên {pairs} cặp đã được căn chỉnh",
        ],
    ),
    (
        ReportCount::Done,
        [
            "# of {pairs} pairs is aligned",
            "# trên {pairs} cặp đã được căn chỉnh",
        ],
    ),
    (
        ReportCount::Pairs,
        [
            "{done} of # pairs are aligned",
            "{done} trên # cặp đã được căn chỉnh",
        ],
    ),
    (
        ReportCount::Pairs,
        [
            "{done} of # pairs is aligned",
            "{done} trên # cặp đã được căn chỉnh",
        ],
    ),
    (
        ReportCount::Pairs,
        ["None of the # pairs", "Chưa cặp nào trong # cặp"],
    ),
    (
        ReportCount::Done,
        ["All # pairs are aligned", "Cả # cặp đã được căn chỉnh"],
    ),
    (
        ReportCount::LowConfidence,
        [", # with a confidence below", ", # cặp có độ tin cậy dưới"],
    ),
    (ReportCount::Failed, ["# failed", "# bị lỗi"]),
    (ReportCount::Pending, ["# is not finished", "# chưa xong"]),
    (ReportCount::Pending, ["# are not finished", "# chưa xong"]),
    (ReportCount::Pending, ["# not finished", "# chưa xong"]),
    (
        ReportCount::Missing,
        [
            "# of {pairs} pairs are in no row",
            "# trên {pairs} cặp không có trong bảng nào",
        ],
    ),
    (
        ReportCount::Missing,
        [
            "# of {pairs} pairs is in no row",
            "# trên {pairs} cặp không có trong bảng nào",
        ],
    ),
    (
        ReportCount::Pairs,
        [
            "{missing} of # pairs are in no row",
            "{missing} trên # cặp không có trong bảng nào",
        ],
    ),
    (
        ReportCount::Pairs,
        [
            "{missing} of # pairs is in no row",
            "{missing} trên # cặp không có trong bảng nào",
        ],
    ),
    (
        ReportCount::Passed,
        ["reviewers passed # of", "người đánh giá cho đạt # trên"],
    ),
    (
        ReportCount::Decided,
        [
            "reviewers passed {passed} of # decided",
            "người đánh giá cho đạt {passed} trên # kết quả",
        ],
    ),
    (
        ReportCount::Retired,
        [
            "all # pairs of the project are retired",
            "cả # cặp của dự án đã được đưa ra khỏi thống kê",
        ],
    ),
    (
        ReportCount::Done,
        [": of # results, ", ": trong # kết quả, "],
    ),
];

impl ReportCount {
    /// Returns the count, and the address of the list of exactly these pairs. `None` if there is no such list.
    fn of(self, report: &Report) -> Option<(u64, String)> {
        let progress = report.progress;
        let (count, list) = match self {
            Self::Pairs => (report.pairs, ALL_PAIRS),
            Self::Done => (progress.done, ALIGNED_PAIRS),
            Self::LowConfidence => {
                let row = report.row(ThresholdMetric::DEFAULT)?;
                (row.low_confidence?, LOW_CONFIDENCE_PAIRS)
            }
            Self::Failed => (progress.failed, FAILED_PAIRS),
            Self::Pending => (progress.pending, UNFINISHED_PAIRS),
            Self::Missing => match (progress.failed, progress.pending) {
                (failed, 0) => (failed, FAILED_PAIRS),
                (0, pending) => (pending, UNFINISHED_PAIRS),
                _ => return None,
            },
            Self::Passed => {
                let row = report.row_with_acc()?;
                let list = format!("pairs?verdict=joint-pass&metric={}", row.metric.name());
                return Some((row.passed, list));
            }
            Self::Decided => {
                let row = report.row_with_acc().filter(|row| row.unsure == 0)?;
                let list = format!("pairs?verdict=judged&metric={}", row.metric.name());
                return Some((row.judged, list));
            }
            Self::Retired => (report.retired, RETIRED_PAIRS),
        };
        Some((count, list.to_owned()))
    }
}

/// A count with the words around it.
#[derive(Debug)]
struct LinkedCount {
    before: String,
    count: String,
    after: String,
    address: String,
}

impl LinkedCount {
    /// Returns where a text has the count.
    fn find(&self, text: &str) -> Option<Range<usize>> {
        let phrase = [&*self.before, &*self.count, &*self.after].concat();
        let mut places = text.match_indices(&*phrase).map(|(at, _)| {
            let start = at + self.before.len();
            start..start + self.count.len()
        });
        places.find(|place| is_whole(text, place))
    }
}

/// Returns whether a part of a text is a whole number.
fn is_whole(text: &str, place: &Range<usize>) -> bool {
    let is_of_number = |c: char| c.is_alphanumeric() || ",.\u{202f}".contains(c);
    let before = text[..place.start].chars().next_back();
    let mut behind = text[place.end..].chars();
    let (first, second) = (behind.next(), behind.next());
    // A sentence goes on behind a comma or a stop.
    let is_end = first.is_none_or(|c| !is_of_number(c))
        || matches!(first, Some(',' | '.')) && !second.is_some_and(|c| c.is_ascii_digit());
    is_end && !before.is_some_and(is_of_number)
}

/// The counts of a report that have lists of their pairs.
#[derive(Debug)]
pub(super) struct LinkedCounts(Vec<LinkedCount>);

impl LinkedCounts {
    /// Finds the counts of a report as sentences in a language have them.
    pub(super) fn of(report: &Report, language: Language) -> Self {
        let shown = |count: u64| match language {
            Language::English => format_count(count),
            Language::Vietnamese => format_count(count).replace(',', "\u{202f}"),
        };
        let progress = report.progress;
        let passed = report.row_with_acc().map_or(0, |row| row.passed);
        let others = [
            ("{pairs}", report.pairs),
            ("{done}", progress.done),
            ("{missing}", progress.failed + progress.pending),
            ("{passed}", passed),
        ];
        let filled = |words: &str| {
            let others = others.into_iter();
            others.fold(words.to_owned(), |words, (name, count)| {
                words.replace(name, &shown(count))
            })
        };
        let counts = PHRASES.iter().filter_map(|(count, phrases)| {
            let [english, vietnamese] = phrases;
            let phrase = match language {
                Language::English => english,
                Language::Vietnamese => vietnamese,
            };
            let (before, after) = phrase.split_once('#')?;
            let (count, address) = count.of(report)?;
            (count > 0).then(|| LinkedCount {
                before: filled(before),
                count: shown(count),
                after: filled(after),
                address,
            })
        });
        Self(counts.collect())
    }

    /// Returns a text with its counts as links.
    pub(super) fn markup(&self, text: &str) -> Markup {
        let counts = self.0.iter();
        let found = counts.filter_map(|count| Some((count.find(text)?, count.address.as_str())));
        let mut found: Vec<(Range<usize>, &str)> = found.collect();
        found.sort_by_key(|(place, _)| place.start);
        let (mut parts, mut end) = (Vec::new(), 0);
        for (place, address) in found {
            if place.start >= end {
                parts.push((&text[end..place.start], &text[place.clone()], address));
                end = place.end;
            }
        }
        let rest = &text[end..];
        html! {
            @for (words, count, address) in parts { (words) a href=(address) { (count) } }
            (rest)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::LinkedCounts;
    use crate::messages::report_text;
    use crate::review::Language;
    use mocban_core::domain::{FailureClass, Verdict};
    use mocban_report::{Report, ReportAccumulator};
    use mocban_results::TruthEvaluation;
    use mocban_results::test_fixtures::{done, failed, pending, with_confidence};

    fn report(pairs: &[mocban_catalog::PairResults]) -> Report {
        let mut report = ReportAccumulator::default();
        for pair in pairs {
            report.add(pair, &TruthEvaluation::default());
        }
        report.finish()
    }

    /// Returns a sentence of a report in both languages with its links.
    fn linked(report: &Report, sentence: &str) -> [String; 2] {
        let texts = [
            (Language::English, sentence.to_owned()),
            (Language::Vietnamese, report_text(sentence)),
        ];
        texts.map(|(language, text)| {
            let markup = LinkedCounts::of(report, language).markup(&text);
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
            linked(&report, &report.headline[0]),
            [
                "[?state=aligned\">2] of [\">4] pairs are aligned, [?confidence=low&sort=confidence\">1] with a confidence \
                 below 0.5; [?state=failed&view=table\">1] failed and [?state=unfinished\">1] is not finished.",
                "[?state=aligned\">2] trên [\">4] cặp đã được căn chỉnh, [?confidence=low&sort=confidence\">1] cặp có độ tin \
                 cậy dưới 0,5; [?state=failed&view=table\">1] bị lỗi và [?state=unfinished\">1] chưa xong.",
            ]
        );
        assert_eq!(
            linked(
                &report,
                "2 of 4 pairs are in no row: 1 failed, 1 not finished."
            ),
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
        let judged = [
            done("a", 0.75, &[pass]),
            done("b", 0.75, &[pass]),
            done("c", 0.75, &[fail]),
        ];
        for (pairs, decided) in [
            (judged.to_vec(), "[?verdict=judged&metric=ensemble\">3]"),
            // Some results are judged, and not decided.
            (
                [&judged[..], &[done("d", 0.75, &[Verdict::Unsure])]].concat(),
                "3",
            ),
        ] {
            let report = report(&pairs);
            let found = linked(&report, &report.headline[1]);
            let passed = "[?verdict=joint-pass&metric=ensemble\">2]";
            for (text, said) in found.iter().zip([
                format!("reviewers passed {passed} of {decided} decided"),
                format!("người đánh giá cho đạt {passed} trên {decided} kết quả"),
            ]) {
                assert!(text.contains(&said), "{said}: {text}");
            }
        }
    }

    #[test]
    fn numbers_of_other_things_have_no_links() {
        let report = report(&[failed("a", FailureClass::Io, "gone"), pending("b")]);
        for text in [
            "11 failed.",
            "1,1 failed.",
            "Characters are missing: 1 block failed.",
            "2 of 3 pairs are aligned.",
        ] {
            assert_eq!(linked(&report, text)[0], text);
        }
        let mut retired = ReportAccumulator::default();
        retired.set_retired(1_234);
        let retired = retired.finish();
        let sentence = "There is nothing to report: all 1,234 pairs of the project are retired.";
        let [english, vietnamese] = linked(&retired, sentence);
        assert!(
            english.contains("all [?state=retired\">1,234] pairs"),
            "{english}"
        );
        let said = "cả [?state=retired\">1\u{202f}234] cặp";
        assert!(vietnamese.contains(said), "{vietnamese}");
    }
}
