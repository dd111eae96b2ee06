//! Every word of the page, in English and Vietnamese, from one table.

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
    /// Every language.
    pub const ALL: [Self; 2] = [Self::English, Self::Vietnamese];

    /// Its code in HTML and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::Vietnamese => "vi",
        }
    }

    /// The other one.
    #[must_use]
    pub(super) const fn other(self) -> Self {
        match self {
            Self::English => Self::Vietnamese,
            Self::Vietnamese => Self::English,
        }
    }

    /// The words for a key; the key itself where the table lacks it, which a test rules out.
    pub(super) fn say(self, key: &'static str) -> &'static str {
        let found = WORDS.iter().find(|(known, ..)| *known == key);
        found.map_or(key, |row| self.of(row))
    }

    /// The whole table in this language, for the script.
    pub(super) fn words(self) -> BTreeMap<&'static str, &'static str> {
        WORDS.iter().map(|row| (row.0, self.of(row))).collect()
    }

    const fn of(self, row: &Row) -> &'static str {
        match self {
            Self::English => row.1,
            Self::Vietnamese => row.2,
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

/// Key, English, Vietnamese. What stands in braces is filled in by the script.
type Row = (&'static str, &'static str, &'static str);

const WORDS: &[Row] = &[
    ("title", "Review", "Duyệt"),
    ("reviewer", "Reviewer", "Người đọc"),
    ("skip", "To the stage", "Đến khung chính"),
    (
        "no_script",
        "This page needs JavaScript; all of it comes from your own machine.",
        "Trang này cần JavaScript; mọi thứ đều từ máy của bạn.",
    ),
    ("onward", "One moment", "Xin chờ"),
    (
        "refused",
        "This address was used already. Start the review again for a new one.",
        "Địa chỉ này đã được dùng. Hãy mở lại lệnh duyệt để có địa chỉ mới.",
    ),
    ("other_language", "Tiếng Việt", "English"),
    ("help", "Keys", "Phím"),
    ("close", "Close", "Đóng"),
    ("print", "Print", "Bản in"),
    ("print_mask", "Ink", "Nét mực"),
    ("relief", "Relief in raking light", "Khối nổi dưới ánh xiên"),
    ("depth_mask", "Strokes of the relief", "Nét của khối nổi"),
    ("stage", "Stage", "Khung chính"),
    (
        "question",
        "Within 5°, and the character whole?",
        "Lệch dưới 5° và chữ còn nguyên?",
    ),
    ("pass", "Pass", "Đạt"),
    ("fail", "Fail", "Không đạt"),
    ("unsure", "Unsure", "Chưa chắc"),
    ("undo", "Undo", "Hoàn tác"),
    ("note", "Note", "Ghi chú"),
    (
        "note_hint",
        "Enter keeps it, Escape drops it",
        "Enter để giữ, Escape để bỏ",
    ),
    ("why", "or fail for", "hoặc không đạt vì"),
    ("angle", "Angle", "Góc lệch"),
    ("strokes_lost", "Strokes lost", "Mất nét"),
    ("background_in", "Ground in", "Lẫn nền"),
    ("shift_or_scale", "Shift or scale", "Lệch chỗ hoặc cỡ"),
    ("mirrored", "Mirrored", "Bị lật gương"),
    (
        "wrong_pair",
        "Wrong pair or bad input",
        "Sai cặp hoặc dữ liệu hỏng",
    ),
    ("modes", "Ways to look", "Cách xem"),
    ("edges", "Edges", "Viền"),
    ("overlay", "Overlay", "Chồng màu"),
    ("two_up", "Side by side", "Cạnh nhau"),
    ("onion", "Onion skin", "Mờ dần"),
    ("checker", "Checkerboard", "Ô cờ"),
    ("difference", "Difference", "Khác biệt"),
    ("reveal", "Reveal", "Soi"),
    ("flicker", "Flicker (hold)", "Nháy (giữ phím)"),
    ("rock", "Auto flicker", "Tự nháy"),
    ("protractor", "Edges ±5°", "Viền ±5°"),
    ("strokes", "Stroke map", "Bản đồ nét"),
    ("zoom", "Zoom", "Phóng to"),
    ("turn_left", "Turn left", "Xoay trái"),
    ("turn_right", "Turn right", "Xoay phải"),
    ("less", "Less", "Bớt"),
    ("more", "More", "Thêm"),
    ("reset", "As it was", "Như cũ"),
    ("next", "Next", "Tiếp"),
    ("previous", "Back", "Trước"),
    ("jump", "Jump to a pair", "Đến một cặp"),
    (
        "jump_hint",
        "Id of a pair, or #7 for the seventh picture",
        "Mã của cặp, hoặc #7 cho hình thứ bảy",
    ),
    (
        "no_such_pair",
        "There is no such pair here",
        "Không có cặp này ở đây",
    ),
    ("info", "About this result", "Về kết quả này"),
    ("correct", "Correct by hand", "Chỉnh bằng tay"),
    ("mirror", "Mirror", "Lật gương"),
    ("save", "Save", "Lưu"),
    ("leave", "Leave", "Thoát"),
    ("larger", "Larger", "Lớn hơn"),
    ("smaller", "Smaller", "Nhỏ hơn"),
    (
        "correct_hint",
        "arrows or drag: shift · [ ] or Shift and wheel: turn · − = or wheel: scale · Shift and key: finer · M: mirror · 0: as it was · Enter: save · Escape: leave",
        "mũi tên hoặc kéo: dời · [ ] hoặc Shift và bánh xe: xoay · − = hoặc bánh xe: cỡ · Shift và phím: tinh hơn · M: lật gương · 0: như cũ · Enter: lưu · Escape: thoát",
    ),
    (
        "correct_first",
        "First save the correction (Enter) or leave it (Escape)",
        "Hãy lưu bản chỉnh (Enter) hoặc thoát (Escape) trước",
    ),
    (
        "corrected",
        "Saved as an alignment by hand",
        "Đã lưu bản chỉnh tay",
    ),
    (
        "corrected_by",
        "corrected by hand by {reviewer}: turned {deg}°, shifted {px} px, scaled {scale}{mirrored}, IoU {iou}",
        "{reviewer} đã chỉnh tay: xoay {deg}°, dời {px} px, cỡ {scale}{mirrored}, IoU {iou}",
    ),
    ("and_mirrored", ", mirrored", ", lật gương"),
    ("iou", "IoU", "IoU"),
    ("dice", "Dice", "Dice"),
    ("metrics", "Threshold by", "Ngưỡng theo"),
    ("others", "Other reviewers", "Người đọc khác"),
    (
        "answer_first",
        "Answer first; then it is told",
        "Hãy trả lời trước",
    ),
    (
        "progress",
        "{done} of {all} pictures",
        "{done} trên {all} hình",
    ),
    ("picture_n", "Picture {n}", "Hình {n}"),
    (
        "tested",
        "Some pictures test the reviewer: results spoilt on purpose, and some that come a second time. \
         So there are more pictures than results, and a picture tells its pair only when it is answered (I).",
        "Một số hình dùng để thử người đọc: kết quả bị làm hỏng có chủ ý, và kết quả xuất hiện lần thứ hai. \
         Vì vậy số hình nhiều hơn số kết quả, và mã của cặp chỉ hiện sau khi trả lời (I).",
    ),
    ("median", "{s} s median", "trung vị {s} giây"),
    ("painted", "picture after {ms} ms", "hiện hình sau {ms} ms"),
    ("saved", "saved", "đã lưu"),
    ("not_saved", "{n} not saved", "{n} chưa lưu"),
    (
        "blocked",
        "3 answers are not saved: waiting for the connection",
        "3 câu trả lời chưa lưu: đang chờ kết nối",
    ),
    (
        "lost",
        "No connection to mocban; what you answered is kept here and sent again",
        "Mất kết nối với mocban; câu trả lời được giữ lại và sẽ gửi lại",
    ),
    (
        "restarted",
        "mocban was started again: open its new address in this browser, then this page goes on",
        "mocban đã khởi động lại: hãy mở địa chỉ mới trong trình duyệt này, trang này sẽ tiếp tục",
    ),
    ("was_refused", "Not stored: {why}", "Không lưu được: {why}"),
    ("history", "Last answers", "Các câu trả lời gần đây"),
    (
        "nothing_to_undo",
        "Nothing to undo",
        "Không có gì để hoàn tác",
    ),
    ("undone", "Taken back", "Đã hoàn tác"),
    ("done", "All is read. Thank you.", "Đã đọc hết. Xin cảm ơn."),
    (
        "done_not_saved",
        "All is read, but {n} not saved yet: keep this page open",
        "Đã đọc hết, nhưng {n} chưa lưu: hãy giữ trang này mở",
    ),
    (
        "empty",
        "There is nothing to judge: no pair has a result yet",
        "Chưa có gì để duyệt: chưa cặp nào có kết quả",
    ),
    (
        "empty_adjudicate",
        "No conflict waits for you",
        "Không có bất đồng nào chờ bạn",
    ),
    ("loading", "Loading", "Đang tải"),
    (
        "no_picture",
        "The picture cannot be shown: {why}",
        "Không hiển thị được hình: {why}",
    ),
    (
        "risk_label",
        "Least confident first: a hunt for failures, not an estimate",
        "Nghi ngờ nhất trước: để tìm lỗi, không phải để ước lượng",
    ),
    (
        "adjudicate_label",
        "Conflicts of others: judge first, then see what they said",
        "Bất đồng của người khác: hãy tự đánh giá trước",
    ),
    ("print_only", "print only", "chỉ bản in"),
    ("depth_only", "relief only", "chỉ khối nổi"),
    ("both", "both", "cả hai"),
    ("lost_strokes", "ink without relief", "mực không có nét nổi"),
    (
        "extra_strokes",
        "relief without ink",
        "nét nổi không có mực",
    ),
    ("turned_by", "turned by {deg}°", "xoay {deg}°"),
    ("too_soon", "Look first", "Hãy xem đã"),
    ("verdicts", "Verdicts", "Đánh giá"),
    ("looking", "Looking", "Cách xem"),
    ("going", "Going", "Di chuyển"),
    ("by_hand", "Correction by hand", "Chỉnh bằng tay"),
];

#[cfg(test)]
mod tests {
    use super::{Language, WORDS};

    /// Keys in calls such as `say("pass")`.
    fn used(text: &str, call: &str) -> Vec<String> {
        let after = text.split(call).skip(1);
        after
            .map(|rest| rest.split('"').next().unwrap_or_default().to_owned())
            .collect()
    }

    #[test]
    fn every_word_that_is_said_is_in_the_table_once_and_in_both_languages() {
        let page = include_str!("page.rs");
        let mut wanted = used(page, "say(\"");
        for script in [
            "main",
            "deck",
            "outbox",
            "stage",
            "screen",
            "correction",
            "keys",
        ] {
            let (_, text) = crate::review::assets::find(&format!("{script}.js")).expect(script);
            wanted.extend(used(text, "say(\""));
        }
        assert!(wanted.len() > 40, "{}", wanted.len());
        for key in wanted {
            assert!(WORDS.iter().any(|row| row.0 == key), "{key}");
        }
        for (i, (key, english, vietnamese)) in WORDS.iter().enumerate() {
            assert!(WORDS[..i].iter().all(|row| row.0 != *key), "{key} twice");
            assert!(!english.is_empty() && !vietnamese.is_empty(), "{key}");
            let holes = |text: &str| text.matches('{').count();
            assert_eq!(holes(english), holes(vietnamese), "{key}");
        }
    }

    #[test]
    fn every_action_has_its_words() {
        for action in crate::review::keys::ACTIONS {
            assert!(WORDS.iter().any(|row| row.0 == action), "{action}");
        }
        assert_eq!(Language::Vietnamese.say("pass"), "Đạt");
    }
}
