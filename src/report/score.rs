//! The scores of the paper's table, whose means are told and compared.

use serde::Serialize;

use crate::domain::Scores;

/// A score of two masks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Score {
    /// Structural similarity.
    Ssim,
    /// Intersection over union by pixel.
    Iou,
    /// Intersection over union of the bounding boxes.
    IouBox,
    /// Dice coefficient by pixel.
    Dice,
}

impl Score {
    /// Every one, in the order of the table.
    pub const ALL: [Self; 4] = [Self::Ssim, Self::Iou, Self::IouBox, Self::Dice];
    /// Those by which metrics are compared.
    pub const COMPARED: [Self; 3] = [Self::Ssim, Self::Iou, Self::Dice];

    /// Name in JSON and CSV.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ssim => "ssim",
            Self::Iou => "iou",
            Self::IouBox => "iou_box",
            Self::Dice => "dice",
        }
    }

    /// What stands over a column of it.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Ssim => "SSIM",
            Self::Iou => "IoU",
            Self::IouBox => "IoU box",
            Self::Dice => "Dice",
        }
    }

    /// Its value, 0..=1 but for SSIM, which may lie below 0.
    pub const fn of(self, scores: &Scores) -> f64 {
        match self {
            Self::Ssim => scores.ssim,
            Self::Iou => scores.iou,
            Self::IouBox => scores.iou_box,
            Self::Dice => scores.dice,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Score;
    use serde_json::json;

    #[test]
    fn name_is_the_one_in_json() {
        for score in Score::ALL {
            assert_eq!(json!(score), score.name());
        }
    }
}
