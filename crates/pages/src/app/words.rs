//! Names of states, classes and metrics, and what helps after a failure, in both languages.

use super::visit::Visit;
use crate::messages::stage_in_vietnamese;
use mocban_catalog::JointVerdict;
use mocban_core::domain::{
    BlockCharacterState, BlockStage, FailureClass, JobStatus, Reason, Stage, ThresholdMetric,
    Verdict,
};

impl Visit {
    /// Returns the name of the state of a pair.
    pub(super) const fn status(&self, status: JobStatus) -> &'static str {
        match status {
            JobStatus::Ready => self.t("waiting", "đang chờ"),
            JobStatus::Leased => self.t("running", "đang chạy"),
            JobStatus::Backoff => self.t("will be tried again", "sẽ thử lại"),
            JobStatus::Done => self.t("aligned", "đã căn chỉnh"),
            JobStatus::Quarantined => self.t("failed", "lỗi"),
        }
    }

    /// Returns the name of a verdict.
    pub(super) const fn verdict(&self, verdict: Verdict) -> &'static str {
        match verdict {
            Verdict::Pass => self.t("passed", "đạt"),
            Verdict::Fail => self.t("failed", "không đạt"),
            Verdict::Unsure => self.t("unsure", "chưa chắc"),
        }
    }

    /// Says that at least one reviewer gave a verdict, whatever others gave.
    pub(super) const fn given_by_somebody(&self, verdict: Verdict) -> &'static str {
        match verdict {
            Verdict::Pass => self.t("passed by somebody", "có người cho đạt"),
            Verdict::Fail => self.t("failed by somebody", "có người cho không đạt"),
            Verdict::Unsure => self.t("somebody was unsure", "có người chưa chắc"),
        }
    }

    /// Returns the name of the joint verdict of all reviewers, which the report counts.
    pub(super) const fn joint_verdict(&self, verdict: JointVerdict) -> &'static str {
        match verdict {
            JointVerdict::Passed => self.t("passed, as the report counts", "đạt, như báo cáo tính"),
            JointVerdict::Failed => self.t(
                "failed, as the report counts",
                "không đạt, như báo cáo tính",
            ),
            JointVerdict::Decided => self.t(
                "passed or failed, as the report counts",
                "đạt hoặc không đạt, như báo cáo tính",
            ),
            JointVerdict::Conflict => self.t("reviewers disagree", "người đánh giá bất đồng"),
            JointVerdict::Unsure => self.t("all were unsure", "mọi người đều chưa chắc"),
            JointVerdict::Stale => self.t(
                "only an earlier result was judged",
                "chỉ có đánh giá cho lần tính trước",
            ),
        }
    }

    /// Returns a reason to fail a result, as the review page names it.
    pub(super) fn reason(&self, reason: Reason) -> &'static str {
        self.language.translate(reason.name())
    }

    /// Returns the name of a stage.
    pub(super) const fn stage(&self, stage: Stage) -> &'static str {
        let english = match stage {
            Stage::Fit => "fit of the carved face",
            Stage::Depth => "depth map",
            Stage::Normalize => "separation of the strokes",
            Stage::Register => "registration with the print",
        };
        self.t(english, stage_in_vietnamese(stage))
    }

    /// Returns the name of a stage of a block.
    pub(super) const fn block_stage(&self, stage: BlockStage) -> &'static str {
        match stage {
            BlockStage::Face => self.t("carved face of the scan", "mặt khắc của bản quét"),
            BlockStage::Align => self.t("registration with the page", "căn chỉnh với trang in"),
            BlockStage::Boxes => self.t("places of the characters", "vị trí các chữ"),
            BlockStage::Cut => self.t("cutting into pairs", "cắt thành các cặp"),
        }
    }

    /// Returns what became of a character of a block.
    pub(super) const fn character_state(&self, state: BlockCharacterState) -> &'static str {
        match state {
            BlockCharacterState::Cut => self.t("is a pair", "là một cặp"),
            BlockCharacterState::Left => self.t("left out", "bỏ qua"),
            BlockCharacterState::Retired => {
                self.t("not on the page any more", "không còn trên trang in")
            }
        }
    }

    /// Returns what helps after a stage of a block failed.
    pub(super) const fn block_remedy(
        &self,
        stage: BlockStage,
        class: FailureClass,
    ) -> &'static str {
        match (stage, class) {
            (BlockStage::Align, FailureClass::NoSolution) => self.t(
                "The page may be that of another block, or the scan may show only a part. If they belong together, align them by places you choose.",
                "Trang in có thể của ván khác, hoặc bản quét chỉ có một phần. Nếu chúng cùng một ván, hãy căn chỉnh theo các điểm tự chọn.",
            ),
            (_, FailureClass::BadInput | FailureClass::NoSolution) => self.t(
                "Replace the file that is named; the next run notices that by itself.",
                "Hãy thay tệp được nêu; lần chạy sau sẽ tự nhận ra.",
            ),
            (_, class) => self.remedy(class),
        }
    }

    /// Returns the name of a metric.
    pub(super) const fn metric(&self, metric: ThresholdMetric) -> &'static str {
        match metric {
            ThresholdMetric::NlSsim => self.t("Non-luminous SSIM", "SSIM không độ sáng"),
            ThresholdMetric::Density => self.t("Pixel density", "Mật độ điểm ảnh"),
            ThresholdMetric::Ensemble => self.t("Ensemble", "Kết hợp"),
            ThresholdMetric::Relief => self.t("Relief", "Mặt khắc"),
        }
    }

    /// Returns the name of a class of failures.
    pub(super) const fn class(&self, class: FailureClass) -> &'static str {
        match class {
            FailureClass::BadInput => self.t("a file cannot be used", "tệp không dùng được"),
            FailureClass::NoSolution => {
                self.t("no alignment was found", "không tìm được cách căn chỉnh")
            }
            FailureClass::Io => self.t(
                "a file could not be read or written",
                "không đọc hoặc ghi được tệp",
            ),
            FailureClass::Resource => self.t("memory or time ran out", "hết bộ nhớ hoặc thời gian"),
            FailureClass::Bug => self.t("a fault of the program", "lỗi của chương trình"),
        }
    }

    /// Returns what helps after a failure of a class.
    pub(super) const fn remedy(&self, class: FailureClass) -> &'static str {
        match class {
            FailureClass::BadInput => self.t(
                "Each pair says what is wrong with its file. Replace the file; the next run notices that by itself.",
                "Mỗi cặp cho biết tệp của nó bị gì. Hãy thay tệp đó; lần chạy sau sẽ tự nhận ra.",
            ),
            FailureClass::NoSolution => self.t(
                "The scan and the print may not belong together, the unit may be wrong, or the scan may show the back. Look at the pictures of the pair first.",
                "Bản quét và bản in có thể không cùng một cặp, đơn vị có thể sai, hoặc bản quét là mặt sau. Trước hết hãy xem hình của cặp.",
            ),
            FailureClass::Io => self.t(
                "Check that the disk or the network folder is connected and has free space, and try again.",
                "Hãy kiểm tra ổ đĩa hoặc thư mục mạng đã được kết nối và còn chỗ trống, rồi thử lại.",
            ),
            FailureClass::Resource => self.t(
                "Close other programs or run fewer pairs at a time, and try again.",
                "Hãy đóng các chương trình khác hoặc chạy ít cặp hơn cùng lúc, rồi thử lại.",
            ),
            FailureClass::Bug => self.t(
                "Try again once. If it stays, send the message and the files of the pair to the developers.",
                "Hãy thử lại một lần. Nếu vẫn lỗi, hãy gửi thông báo và các tệp của cặp cho nhóm phát triển.",
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Visit;
    use crate::messages::report_text;
    use crate::review::Language;
    use mocban_core::domain::{FailureClass, ThresholdMetric};

    #[test]
    fn the_report_names_metrics_as_the_pages_do() {
        let visit = Visit::in_language(Language::Vietnamese);
        for metric in ThresholdMetric::ALL {
            assert_eq!(report_text(metric.title()), visit.metric(metric));
        }
    }

    #[test]
    fn reasons_and_remedies_in_both_languages() {
        let mut lines = Vec::new();
        for language in Language::ALL {
            let visit = Visit::in_language(language);
            for class in FailureClass::ALL {
                lines.push(format!(
                    "{class}: {}\n  {}",
                    visit.class(class),
                    visit.remedy(class)
                ));
            }
        }
        insta::assert_snapshot!(lines.join("\n"));
    }
}
