//! Why an export leaves out pairs, in Vietnamese.

use super::message_numbers::number_text;

/// Reasons as `OmissionCounts::text` writes them, without that of a low confidence.
const REASONS: [(&str, &str); 6] = [
    ("without a result", "chưa có kết quả"),
    ("without a verdict", "chưa có đánh giá"),
    (
        "judged only on an earlier result",
        "chỉ có đánh giá cho kết quả trước",
    ),
    ("unsure or in conflict", "chưa chắc hoặc bất đồng"),
    ("failed by reviewers", "bị đánh giá là không đạt"),
    ("without a confidence", "không có độ tin cậy"),
];

/// Returns a list of reasons with their numbers, such as `12 without a verdict, 3 below confidence 0.5`, in Vietnamese. `None`
/// if it is something else.
pub(crate) fn left_out_reasons(list: &str) -> Option<String> {
    let one = |text: &str| {
        let (number, why) = text.split_once(' ')?;
        let number = number_text(number)?;
        if let Some(least) = why.strip_prefix("below confidence ") {
            let least = number_text(least)?;
            return Some(format!("{number} có độ tin cậy dưới {least}"));
        }
        let (_, vietnamese) = REASONS.iter().find(|(english, _)| *english == why)?;
        Some(format!("{number} {vietnamese}"))
    };
    let all: Option<Vec<String>> = list.split(", ").map(one).collect();
    Some(all?.join(", "))
}

#[cfg(test)]
mod tests {
    use mocban_export::{OmissionCounts, OmissionReason};

    use super::{REASONS, left_out_reasons};

    #[test]
    fn every_reason_of_an_export_is_translated() {
        for reason in OmissionReason::ALL {
            let mut counts = OmissionCounts::default();
            counts.add(reason);
            counts.add(reason);
            let english = counts.text(Some(0.5));
            let translated = left_out_reasons(&english);
            match reason {
                OmissionReason::NotChosen => assert_eq!((english.as_str(), translated), ("", None)),
                OmissionReason::LowConfidence => {
                    let wanted = "2 có độ tin cậy dưới 0,5".to_owned();
                    assert_eq!(translated, Some(wanted));
                }
                _ => {
                    let mut known = REASONS.iter();
                    let (_, wanted) = known
                        .find(|(text, _)| english == format!("2 {text}"))
                        .expect("a reason");
                    assert_eq!(translated, Some(format!("2 {wanted}")));
                }
            }
        }
        assert_eq!(left_out_reasons("2 without a hat"), None);
    }
}
