//! The stages of pairs in Vietnamese, for all pages and the report.

use mocban_core::domain::Stage;

/// Returns the name of a stage in Vietnamese.
pub(crate) const fn stage_in_vietnamese(stage: Stage) -> &'static str {
    match stage {
        Stage::Fit => "khớp mặt khắc",
        Stage::Depth => "bản đồ độ sâu",
        Stage::Normalize => "tách nét",
        Stage::Register => "căn chỉnh với bản in",
    }
}

/// Returns the Vietnamese name of a stage that a text names, and `None` for another text.
pub(super) fn stage_text(text: &str) -> Option<&'static str> {
    text.parse().ok().map(stage_in_vietnamese)
}
