//! Messages of the page in English and Vietnamese.

use std::collections::BTreeMap;

/// A language of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// English.
    English,
    /// Vietnamese.
    Vietnamese,
}

impl Language {
    /// All languages.
    pub const ALL: [Self; 2] = [Self::English, Self::Vietnamese];

    /// Returns the language code used in HTML and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::Vietnamese => "vi",
        }
    }

    /// Returns the other language.
    #[must_use]
    pub(super) const fn other(self) -> Self {
        match self {
            Self::English => Self::Vietnamese,
            Self::Vietnamese => Self::English,
        }
    }

    /// Returns the message of a key, or the key itself if there is none; a test rules that out.
    pub(super) fn translate(self, key: &'static str) -> &'static str {
        let found = MESSAGES.iter().find(|(known, ..)| *known == key);
        found.map_or(key, |message| self.of(message))
    }

    /// Returns all messages by key, for the script.
    pub(super) fn messages(self) -> BTreeMap<&'static str, &'static str> {
        let messages = MESSAGES.iter();
        messages
            .map(|message| (message.0, self.of(message)))
            .collect()
    }

    const fn of(self, message: &Translation) -> &'static str {
        match self {
            Self::English => message.1,
            Self::Vietnamese => message.2,
        }
    }
}

impl std::str::FromStr for Language {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|language| language.name() == text)
            .ok_or_else(|| format!("{text:?} is not a language of the page (en, vi)"))
    }
}

/// Key, English, Vietnamese. The script replaces `{name}` by a value.
type Translation = (&'static str, &'static str, &'static str);

#[rustfmt::skip]
const MESSAGES: &[Translation] = &[
    // The page.
    ("title", "Review", "Đánh giá"),
    ("reviewer", "Reviewer", "Người đánh giá"),
    ("skip", "Skip to the viewer", "Đến khung xem"),
    ("no_script", "This page needs JavaScript. All of it is served by your own computer.",
        "Trang này cần JavaScript. Toàn bộ mã được tải từ chính máy của bạn."),
    ("forward", "Opening the review", "Đang mở trang đánh giá"),
    ("token_used", "This address has already been used. Run the review command again to get a new one.",
        "Địa chỉ này đã được sử dụng. Hãy chạy lại lệnh đánh giá để nhận địa chỉ mới."),
    ("other_language", "Tiếng Việt", "English"),
    ("loading", "Loading", "Đang tải"),
    ("close", "Close", "Đóng"),
    ("progress_bar", "Progress", "Tiến độ"),
    ("progress", "{done} of {all} images", "{done}/{all} hình"),
    ("median", "median {s} s", "trung vị {s} giây"),
    ("image_n", "Image {n}", "Hình {n}"),
    ("least_confident_label", "Least confident first: good for finding failures, not a sample for estimating accuracy",
        "Kết quả kém chắc chắn nhất lên trước: để tìm lỗi, không dùng để ước lượng độ chính xác"),
    ("adjudicate_label", "Disagreements of other reviewers: judge first, then see their verdicts",
        "Bất đồng giữa những người đánh giá khác: hãy tự đánh giá trước rồi xem ý kiến của họ"),
    // Images.
    ("print", "Print", "Bản in"),
    ("print_mask", "Ink of the print", "Nét mực trên bản in"),
    ("relief", "3D scan, side lit", "Bản quét 3D, chiếu sáng xiên"),
    ("depth_mask", "Strokes of the 3D scan", "Nét khắc trên bản quét 3D"),
    ("viewer", "Viewer", "Khung xem"),
    ("print_only", "print only", "chỉ có ở bản in"),
    ("depth_only", "3D scan only", "chỉ có ở bản quét 3D"),
    ("both", "both", "có ở cả hai"),
    ("lost_strokes", "in the print, missing in the 3D scan", "có ở bản in, thiếu ở bản quét 3D"),
    ("extra_strokes", "in the 3D scan, missing in the print", "có ở bản quét 3D, thiếu ở bản in"),
    ("rotated_by", "rotated by {deg}°", "đã xoay {deg}°"),
    ("painted", "displayed after {ms} ms", "hiển thị sau {ms} ms"),
    // Verdicts.
    ("question", "Rotated by at most 5°, and the character complete?", "Lệch không quá 5° và chữ còn đủ nét?"),
    ("verdicts", "Verdicts", "Đánh giá"),
    ("pass", "Pass", "Đạt"),
    ("fail", "Fail", "Không đạt"),
    ("unsure", "Unsure", "Chưa chắc"),
    ("reasons", "Fail because of", "Không đạt vì"),
    ("angle", "Wrong angle", "Sai góc"),
    ("strokes_lost", "Missing strokes", "Mất nét"),
    ("background_in", "Background included", "Lẫn nền"),
    ("shift_or_scale", "Wrong position or scale", "Sai vị trí hoặc tỉ lệ"),
    ("mirrored", "Mirrored", "Bị lật gương"),
    ("wrong_pair", "Wrong pair or bad input", "Sai cặp hoặc dữ liệu hỏng"),
    ("note", "Note", "Ghi chú"),
    ("note_hint", "Enter saves the note, Escape discards it", "Enter để lưu ghi chú, Escape để bỏ"),
    ("undo", "Undo", "Hoàn tác"),
    ("undone", "Undone", "Đã hoàn tác"),
    ("nothing_to_undo", "There is nothing to undo", "Không có gì để hoàn tác"),
    ("too_soon", "Please look at the image first", "Hãy xem hình trước đã"),
    ("history", "Latest answers", "Các câu trả lời gần đây"),
    // Display modes.
    ("modes", "Display", "Cách hiển thị"),
    ("two_up", "Side by side", "Cạnh nhau"),
    ("overlay", "Overlay", "Chồng màu"),
    ("edges", "Edges", "Đường viền"),
    ("onion", "Onion skin", "Chồng mờ"),
    ("checker", "Checkerboard", "Ô bàn cờ"),
    ("difference", "Difference", "Khác biệt"),
    ("reveal", "Reveal lens", "Kính soi"),
    ("flicker", "Flicker (hold)", "Nhấp nháy (giữ phím)"),
    ("auto_flicker", "Automatic flicker", "Tự nhấp nháy"),
    ("angle_guides", "Edges at ±5°", "Đường viền lệch ±5°"),
    ("stroke_map", "Missing strokes map", "Bản đồ nét thiếu"),
    ("zoom", "Zoom", "Phóng to"),
    ("rotate_left", "Rotate left", "Xoay trái"),
    ("rotate_right", "Rotate right", "Xoay phải"),
    ("less", "Less (opacity, number of squares)", "Giảm (độ mờ, số ô)"),
    ("more", "More (opacity, number of squares)", "Tăng (độ mờ, số ô)"),
    ("reset", "Reset", "Đặt lại"),
    // Navigation.
    ("navigation", "Navigation", "Di chuyển"),
    ("next", "Next", "Tiếp theo"),
    ("previous", "Previous", "Quay lại"),
    ("jump", "Go to a pair", "Đến một cặp"),
    ("jump_hint", "Id of a pair, or #7 for the seventh image", "Mã của cặp, hoặc #7 cho hình thứ bảy"),
    ("go", "Go", "Đến"),
    ("no_such_pair", "There is no such pair in this review", "Không có cặp này trong lần đánh giá này"),
    ("details", "Details", "Chi tiết"),
    ("metrics", "Threshold metric", "Độ đo chọn ngưỡng"),
    ("iou", "IoU", "IoU"),
    ("dice", "Dice", "Dice"),
    ("other_reviewers", "Other reviewers", "Người đánh giá khác"),
    ("answer_first", "Details are shown after your answer", "Chi tiết được hiển thị sau khi bạn trả lời"),
    ("help", "Keys", "Phím tắt"),
    // Manual alignment.
    ("manual_alignment", "Manual alignment", "Căn chỉnh thủ công"),
    ("align", "Align manually", "Căn chỉnh thủ công"),
    ("mirror", "Mirror", "Lật gương"),
    ("larger", "Larger", "To hơn"),
    ("smaller", "Smaller", "Nhỏ hơn"),
    ("save", "Save", "Lưu"),
    ("cancel", "Cancel", "Hủy"),
    ("alignment_hint",
        "arrow keys or drag: move · [ ] or Shift + wheel: rotate · − = or wheel: scale · hold Shift for small steps · M: mirror · 0: reset · Enter: save · Escape: cancel",
        "phím mũi tên hoặc kéo chuột: di chuyển · [ ] hoặc Shift + con lăn: xoay · − = hoặc con lăn: đổi tỉ lệ · giữ Shift: bước nhỏ · M: lật gương · 0: đặt lại · Enter: lưu · Escape: hủy"),
    ("unsaved_alignment", "Save the alignment (Enter) or cancel it (Escape) first",
        "Hãy lưu (Enter) hoặc hủy (Escape) bản căn chỉnh trước"),
    ("alignment_saved", "Manual alignment saved", "Đã lưu bản căn chỉnh thủ công"),
    ("aligned_by", "aligned manually by {reviewer}: rotated {deg}°, moved {px} px, scaled {scale}{mirrored}, IoU {iou}",
        "{reviewer} đã căn chỉnh thủ công: xoay {deg}°, di chuyển {px} px, tỉ lệ {scale}{mirrored}, IoU {iou}"),
    ("and_mirrored", ", mirrored", ", lật gương"),
    // Attention checks.
    ("attention_checks",
        "Some images are attention checks: results with a fault added on purpose, and results shown a second time. This is why there are more images than results, and why the pair of an image is shown (in the details) only after your answer.",
        "Một số hình dùng để kiểm tra sự chú ý: kết quả bị cố ý làm sai và kết quả được đưa ra lần thứ hai. Vì vậy số hình nhiều hơn số kết quả, và mã của cặp chỉ hiển thị (trong phần chi tiết) sau khi bạn trả lời."),
    // Saving.
    ("saved", "saved", "đã lưu"),
    ("not_saved", "{n} not saved", "{n} chưa lưu"),
    ("blocked", "3 answers are not saved yet. Waiting for the connection.", "3 câu trả lời chưa được lưu. Đang chờ kết nối."),
    ("disconnected", "No connection to mocban. Your answers are kept in this page and will be sent again.",
        "Mất kết nối với mocban. Câu trả lời được giữ trong trang này và sẽ được gửi lại."),
    ("restarted", "mocban was restarted. Open its new address in this browser; this page will then continue.",
        "mocban đã khởi động lại. Hãy mở địa chỉ mới trong trình duyệt này, sau đó trang này sẽ tiếp tục."),
    ("rejected", "Not saved: {why}", "Không lưu được: {why}"),
    ("no_image", "The image cannot be displayed: {why}", "Không hiển thị được hình: {why}"),
    // The end.
    ("done", "All images are reviewed. Thank you.", "Đã đánh giá hết. Xin cảm ơn."),
    ("done_not_saved", "All images are reviewed, but {n} not saved yet. Keep this page open.",
        "Đã đánh giá hết, nhưng còn {n} chưa lưu. Hãy giữ trang này mở."),
    ("empty", "There is nothing to review: no pair has a result yet", "Chưa có gì để đánh giá: chưa cặp nào có kết quả"),
    ("empty_adjudicate", "There are no disagreements for you to settle", "Không có bất đồng nào cần bạn quyết định"),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{Language, MESSAGES};
    use crate::review::{assets, keys};

    /// Returns the keys in calls such as `translate("pass")`.
    fn used(text: &str) -> impl Iterator<Item = &str> {
        let after = text.split("translate(\"").skip(1);
        after.map(|rest| rest.split('"').next().unwrap_or_default())
    }

    /// Returns the placeholders of a message, such as `{n}`.
    fn placeholders(text: &str) -> BTreeSet<&str> {
        let after = text.split('{').skip(1);
        after
            .map(|rest| rest.split_once('}').expect("a closed brace").0)
            .collect()
    }

    #[test]
    fn messages_have_the_same_placeholders_in_both_languages() {
        for (i, (key, english, vietnamese)) in MESSAGES.iter().enumerate() {
            assert!(
                MESSAGES[..i].iter().all(|other| other.0 != *key),
                "{key} twice"
            );
            assert!(!english.is_empty() && !vietnamese.is_empty(), "{key}");
            assert_eq!(placeholders(english), placeholders(vietnamese), "{key}");
        }
        let keys = Language::ALL.map(|language| {
            let messages = language.messages();
            messages.into_keys().collect::<Vec<_>>()
        });
        assert_eq!(keys[0], keys[1]);
    }

    #[test]
    fn every_key_that_is_used_has_a_message() {
        let mut wanted: Vec<&str> = used(include_str!("page.rs")).collect();
        wanted.extend(assets::scripts().flat_map(used));
        assert!(wanted.len() > 60, "{}", wanted.len());
        wanted.extend(keys::actions());
        for key in wanted {
            assert!(MESSAGES.iter().any(|message| message.0 == key), "{key}");
        }
        assert_eq!(Language::Vietnamese.translate("pass"), "Đạt");
    }
}
