//! Sentences of the report in Vietnamese. The report is made in English, so they are recognised by their wording.

use super::count_marks::is_count_mark;
use super::message_patterns::{day_first, filled_by, parts_of};
use super::message_words::vietnamese;
use super::report_answers::REPORT_ANSWERS;
use super::report_captions::REPORT_CAPTIONS;
use super::report_table::{REPORT_COUNTED, REPORT_FRAME, REPORT_TERMS};
use super::stage_words::stage_text;

/// Returns a text of the report in Vietnamese: a term, or sentences. Words that are not known stay as they are, and so do marks
/// of counts.
pub(crate) fn report_text(text: &str) -> String {
    if let Some(known) = found(REPORT_TERMS, text).or_else(|| stage_text(text)) {
        return known.to_owned();
    }
    let is_end = |at: &usize| !text[..*at].ends_with(" v");
    let ends = text.match_indices(". ").map(|(at, _)| at);
    let ends: Vec<usize> = ends.filter(is_end).collect();
    for end in ends.iter().map(|at| at + 1).chain([text.len()]) {
        if let Some(known) = sentence(&text[..end]) {
            return match text[end..].strip_prefix(' ') {
                Some(rest) => format!("{known} {}", report_text(rest)),
                None => known,
            };
        }
    }
    if let Some(settings) = settings_text(text) {
        return settings;
    }
    match ends.first() {
        Some(end) => format!("{}. {}", part(&text[..*end]), report_text(&text[end + 2..])),
        None => match text.strip_suffix('.') {
            Some(words) => format!("{}.", part(words)),
            None => part(text),
        },
    }
}

/// Returns a message of the program in Vietnamese if it is known.
pub(super) fn message_text(message: &str) -> String {
    vietnamese(message).unwrap_or_else(|| message.to_owned())
}

/// Returns a verdict of a reviewer, such as `lan: fail, angle (“note”)`, in Vietnamese. `None` if it is none.
pub(super) fn verdict_text(text: &str) -> Option<String> {
    // The name of a reviewer may have a colon.
    let mut colons = text.match_indices(": ");
    colons.find_map(|(at, colon)| {
        let given = given_verdict(&text[at + colon.len()..])?;
        Some(format!("{}: {given}", &text[..at]))
    })
}

/// Returns a verdict with its reason and note.
fn given_verdict(text: &str) -> Option<String> {
    const VERDICTS: [(&str, &str); 3] = [
        ("pass", "đạt"),
        ("fail", "không đạt"),
        ("unsure", "chưa chắc"),
    ];
    VERDICTS.into_iter().find_map(|(english, verdict)| {
        let rest = text.strip_prefix(english)?;
        let (reason, note) = rest.split_at(rest.find(" (“").unwrap_or(rest.len()));
        let reason = match reason.strip_prefix(", ") {
            Some(reason) => format!(", {}", found(REPORT_TERMS, reason)?),
            None if reason.is_empty() => String::new(),
            None => return None,
        };
        Some(format!("{verdict}{reason}{note}"))
    })
}

/// Returns the fingerprint of settings and the values that differ from the default, with names and values unchanged. Returns
/// `None` if there are none.
fn settings_text(text: &str) -> Option<String> {
    if !text.contains(" (default ") {
        return None;
    }
    let items = text.split(", ").map(|item| {
        let pairs = counted(item);
        pairs.unwrap_or_else(|| item.replace(" (default ", " (mặc định "))
    });
    Some(items.collect::<Vec<String>>().join(", "))
}

/// Returns a sentence with its stop, or a phrase, in Vietnamese, if it is known.
fn sentence(text: &str) -> Option<String> {
    let tables = [REPORT_FRAME, REPORT_ANSWERS, REPORT_CAPTIONS];
    tables
        .into_iter()
        .flatten()
        .find_map(|(english, vietnamese)| {
            let parts = parts_of(text, english)?;
            Some(filled_by(vietnamese, |place| placed(place, &parts)))
        })
}

/// Returns what stands in a place of a sentence: for `0` the first part in Vietnamese, for `=0` the first part unchanged, because
/// it is a name, for `!0` its Vietnamese text as a message of the program.
fn placed(place: &str, parts: &[&str]) -> Option<String> {
    let part_at = |index: &str| parts.get(index.parse::<usize>().ok()?).copied();
    if let Some(index) = place.strip_prefix('=') {
        return part_at(index).map(str::to_owned);
    }
    if let Some(index) = place.strip_prefix('!') {
        return part_at(index).map(message_text);
    }
    part_at(place).map(part)
}

/// Returns a part of a sentence in Vietnamese: a term, a day, a count, a clause, a list, or other text with numbers.
fn part(text: &str) -> String {
    let known = found(REPORT_TERMS, text).map(str::to_owned);
    let known = known.or_else(|| day_first(text)).or_else(|| counted(text));
    if let Some(known) = known {
        return known;
    }
    if let Some(phrase) = sentence(text) {
        return phrase;
    }
    if let Some(clause) = sentence(&format!("{text}.")) {
        return clause.strip_suffix('.').unwrap_or(&clause).to_owned();
    }
    for (between, vietnamese) in [
        ("; ", "; "),
        (", ", ", "),
        (" and ", " và "),
        (" v. ", " so với "),
    ] {
        if text.contains(between) {
            let items: Vec<&str> = text.split(between).collect();
            // A comma is the decimal sign.
            let are_numbers = items.iter().all(|item| is_number(item));
            let between = if are_numbers { "; " } else { vietnamese };
            let items: Vec<String> = items.into_iter().map(part).collect();
            return items.join(between);
        }
    }
    if let Some(noun) = found(REPORT_COUNTED, text) {
        return noun.to_owned();
    }
    let with_number = REPORT_TERMS.iter().find_map(|(english, vietnamese)| {
        let rest = text.strip_prefix(english)?;
        let rest = rest.strip_prefix(' ')?;
        Some(format!("{vietnamese} {}", part(rest)))
    });
    with_number.unwrap_or_else(|| numbers(text))
}

fn found(table: &[(&str, &'static str)], text: &str) -> Option<&'static str> {
    let mut rows = table.iter();
    rows.find_map(|(english, vietnamese)| (*english == text).then_some(*vietnamese))
}

/// Returns a number with what it counts, such as `about 4,700 judged pairs`.
fn counted(text: &str) -> Option<String> {
    let estimates = [("about ", "khoảng "), ("more than ", "hơn ")];
    let mut estimates = estimates.into_iter();
    let estimate = estimates.find_map(|(english, vietnamese)| {
        let rest = text.strip_prefix(english)?;
        Some((vietnamese, rest))
    });
    let (estimate, rest) = estimate.unwrap_or(("", text));
    let (number, noun) = rest.split_once(' ')?;
    let noun = found(REPORT_COUNTED, noun)?;
    Some(format!("{estimate}{} {noun}", vietnamese_number(number)?))
}

/// Returns whether a text is a number with its sign.
fn is_number(text: &str) -> bool {
    vietnamese_number(text.trim_start_matches(['-', '\u{2212}'])).is_some()
}

/// Returns a text with its numbers as Vietnamese writes them. Numbers within words and versions stay as they are.
fn numbers(text: &str) -> String {
    let is_of_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    let (mut said, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let (before, tail) = rest.split_at(start);
        let is_other = |c: char| !(c.is_ascii_digit() || c == '.' || c == ',');
        let end = tail.find(is_other).unwrap_or(tail.len());
        let number = tail[..end].trim_end_matches(['.', ',']);
        rest = &tail[number.len()..];
        let is_word = is_of_word(before.chars().next_back()) || is_of_word(rest.chars().next());
        let written = vietnamese_number(number).filter(|_| !is_word);
        said.push_str(before);
        said.push_str(written.as_deref().unwrap_or(number));
    }
    said.push_str(rest);
    said
}

/// Returns a number such as `1,024.5` with a decimal comma and thin spaces between thousands. `None` if it is none. Marks of a
/// count stay around it.
fn vietnamese_number(text: &str) -> Option<String> {
    let plain = text.trim_matches(is_count_mark);
    let (whole, decimals) = plain.split_once('.').unwrap_or((plain, "0"));
    let are_digits =
        |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let groups: Vec<&str> = whole.split(',').collect();
    let is_grouped = groups.iter().skip(1).all(|group| group.len() == 3);
    let is_number =
        is_grouped && are_digits(decimals) && groups.iter().all(|group| are_digits(group));
    is_number.then(|| text.replace(',', "\u{202f}").replace('.', ","))
}

#[cfg(test)]
mod tests {
    use super::{report_text, verdict_text};

    #[test]
    fn sentences_are_translated_with_their_parts() {
        for (english, expected) in [
            (
                "All 1,024 pairs are aligned, 20 with a confidence below 0.5; 1 failed.",
                "Cả 1\u{202f}024 cặp đã được căn chỉnh, 20 cặp có độ tin cậy dưới 0,5; 1 bị lỗi.",
            ),
            (
                "By verdicts, Ensemble (p = 0.016) and Relief (p = 0.003) are right significantly more often than Pixel density.",
                "Theo đánh giá, Kết hợp (p = 0,016) và Mặt khắc (p = 0,003) đúng nhiều hơn Mật độ điểm ảnh một cách có ý nghĩa.",
            ),
            (
                "To show one between Relief and Ensemble, about 4,700 judged pairs would be needed. This assumes 80 % power and a 5 % level.",
                "Để thấy khác biệt giữa Mặt khắc và Kết hợp, cần khoảng 4\u{202f}700 cặp đã đánh giá. Giả định lực kiểm định 80 % và mức ý nghĩa 5 %.",
            ),
            (
                "Relief v. Ensemble: equal on all pairs (SSIM). No significant difference (IoU, Dice).",
                "Mặt khắc so với Kết hợp: bằng nhau ở mọi cặp (SSIM). Không có khác biệt có ý nghĩa (IoU, Dice).",
            ),
            (
                "The project has no pairs yet: 2 blocks failed and 1 block is not finished.",
                "Dự án chưa có cặp nào: 2 ván bị lỗi và 1 ván chưa xong.",
            ),
            (
                "There is nothing to report: all 2 pairs of the project are retired. In the app, the page Pairs has the reason.",
                "Không có gì để báo cáo: cả 2 cặp của dự án đã được đưa ra khỏi thống kê. Trong ứng dụng, trang Các cặp cho biết lý do.",
            ),
            (
                "Nobody has judged a result yet, so there is no Acc. In the app, results are judged on the page Review. \
                 Against ground truth, 1 of 2 results of Relief is right, 50.0 %.",
                "Chưa ai đánh giá kết quả nào, nên chưa có Acc. Trong ứng dụng, các kết quả được đánh giá ở trang Đánh giá. \
                 Theo dữ liệu đối chứng, 1 trên 2 kết quả của Mặt khắc là đúng, 50,0 %.",
            ),
            (
                "Means have no intervals, and metrics are not compared by score. There are more than 100,000 blocks, and \
                 sampling error is negligible.",
                "Trung bình không có khoảng tin cậy, và các độ đo không được so sánh theo điểm số. Có hơn 100\u{202f}000 ván \
                 nên sai số lấy mẫu không đáng kể.",
            ),
            (
                "all, Dr. 1.5 noticed 1 of 5 attention checks. Let another person judge the same results.",
                "all, Dr. 1.5 phát hiện 1 trên 5 lỗi cài sẵn. Hãy để người khác đánh giá cùng các kết quả đó.",
            ),
            (
                "1 ground truth record cannot be used and count nowhere. The first: all 1.5: a.png is not there.",
                "1 bản ghi đối chứng không dùng được và không được tính. Đầu tiên: all 1.5: không có tệp a.png.",
            ),
            (
                "0123456789ab, 4,700 pairs, fit.min_relief = 0.5 (default 0.3), run.x = \"all\" (default null)",
                "0123456789ab, 4\u{202f}700 cặp, fit.min_relief = 0.5 (mặc định 0.3), run.x = \"all\" (mặc định null)",
            ),
            (
                "Ensemble unknown of all results and 100.0 % of half of them.",
                "Kết hợp chưa biết của mọi kết quả và 100,0 % của một nửa số đó.",
            ),
            (
                "IoU 0.700, confidence 0.500, off the truth by 1.0° and 2.0 % of the height, IoU with the true stroke tops 0.9",
                "IoU 0,700, độ tin cậy 0,500, lệch 1,0° và 2,0 % chiều cao so với dữ liệu đối chứng, IoU với mặt nét đúng 0,9",
            ),
            ("-0.050, 0.050", "-0,050; 0,050"),
            ("2026-11-21 10:00:00 +00:00", "21/11/2026 10:00:00 +00:00"),
            ("mocban 0.1.0", "mocban 0.1.0"),
            ("p1.5.stl is here", "p1.5.stl is here"),
        ] {
            assert_eq!(report_text(english), expected);
        }
    }

    #[test]
    fn verdicts_keep_their_notes() {
        for (english, expected) in [
            (
                "lan: fail, strokes lost (“0.5 of it”)",
                Some("lan: không đạt, mất nét (“0.5 of it”)"),
            ),
            ("lan: pass", Some("lan: đạt")),
            (
                "dr: lan: pass (“a: fail”)",
                Some("dr: lan: đạt (“a: fail”)"),
            ),
            ("not drawn: failed to read", None),
            ("not drawn: x.png is not there", None),
        ] {
            assert_eq!(verdict_text(english).as_deref(), expected);
        }
    }
}
