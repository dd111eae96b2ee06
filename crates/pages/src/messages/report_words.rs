//! Sentences of the HTML report in Vietnamese. The report is made in English, so they are recognised by their wording.

use super::message_words::{filled_by, parts_of};
use super::report_answers::REPORT_ANSWERS;
use super::report_captions::REPORT_CAPTIONS;
use super::report_table::{REPORT_COUNTED, REPORT_FRAME, REPORT_TERMS};

/// Returns a text of the report in Vietnamese: a term, or sentences. Words that are not known stay as they are.
pub(super) fn report_text(text: &str) -> String {
    if let Some(known) = found(REPORT_TERMS, text) {
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
    match ends.first() {
        Some(end) => format!("{}. {}", part(&text[..*end]), report_text(&text[end + 2..])),
        None => match text.strip_suffix('.') {
            Some(words) => format!("{}.", part(words)),
            None => part(text),
        },
    }
}

/// Returns a verdict of a reviewer, such as `lan: fail, angle (“note”)`, in Vietnamese. `None` if it is none.
pub(super) fn verdict_text(text: &str) -> Option<String> {
    const VERDICTS: [(&str, &str); 3] = [
        ("pass", "đạt"),
        ("fail", "không đạt"),
        ("unsure", "chưa chắc"),
    ];
    let (reviewer, given) = text.split_once(": ")?;
    let mut verdicts = VERDICTS.into_iter();
    let (verdict, rest) = verdicts.find_map(|(english, vietnamese)| {
        let rest = given.strip_prefix(english)?;
        Some((vietnamese, rest))
    })?;
    let (reason, note) = rest.split_at(rest.find(" (“").unwrap_or(rest.len()));
    let reason = match reason.strip_prefix(", ") {
        Some(reason) => format!(", {}", found(REPORT_TERMS, reason)?),
        None => String::new(),
    };
    Some(format!("{reviewer}: {verdict}{reason}{note}"))
}

/// Returns a sentence with its stop in Vietnamese, if it is known.
fn sentence(text: &str) -> Option<String> {
    let tables = [REPORT_FRAME, REPORT_ANSWERS, REPORT_CAPTIONS];
    tables
        .into_iter()
        .flatten()
        .find_map(|(english, vietnamese)| {
            let parts = parts_of(text, english)?;
            let parts: Vec<String> = parts.into_iter().map(part).collect();
            Some(filled_by(vietnamese, |index| parts.get(index).cloned()))
        })
}

/// Returns a part of a sentence in Vietnamese: a term, a day, a count, a clause, a list, or other text with numbers.
fn part(text: &str) -> String {
    let known = found(REPORT_TERMS, text).map(str::to_owned);
    let known = known.or_else(|| day_first(text)).or_else(|| counted(text));
    if let Some(known) = known {
        return known;
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
        rest.starts_with(' ')
            .then(|| format!("{vietnamese}{}", numbers(rest)))
    });
    with_number.unwrap_or_else(|| numbers(text))
}

fn found(table: &[(&str, &'static str)], text: &str) -> Option<&'static str> {
    let mut rows = table.iter();
    rows.find_map(|(english, vietnamese)| (*english == text).then_some(*vietnamese))
}

/// Returns a day, perhaps with a time, with the day before the month.
fn day_first(text: &str) -> Option<String> {
    let (day, time) = text.split_at_checked("2026-11-21".len())?;
    let numbers: Vec<&str> = day.split('-').collect();
    let [year, month, of_month] = numbers[..] else {
        return None;
    };
    let are_digits = numbers
        .iter()
        .all(|number| number.bytes().all(|byte| byte.is_ascii_digit()));
    let is_day = are_digits && [year, month, of_month].map(str::len) == [4, 2, 2];
    let is_alone = time.is_empty() || time.starts_with(' ');
    (is_day && is_alone).then(|| format!("{of_month}/{month}/{year}{time}"))
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

/// Returns a number such as `1,024.5` with a decimal comma and thin spaces between thousands. `None` if it is none.
fn vietnamese_number(text: &str) -> Option<String> {
    let (whole, decimals) = text.split_once('.').unwrap_or((text, "0"));
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
            ("-0.050, 0.050", "-0,050; 0,050"),
            ("2026-11-21 10:00:00 UTC", "21/11/2026 10:00:00 UTC"),
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
            ("not drawn: x.png is not there", None),
        ] {
            assert_eq!(verdict_text(english).as_deref(), expected);
        }
    }
}
