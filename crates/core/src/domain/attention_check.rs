//! Attention checks: items of the review queue that measure how reliable a reviewer is.

use serde::{Deserialize, Serialize};

/// A deliberate fault, or a result shown a second time. The reviewer's answer to a check is not counted as a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum AttentionCheck {
    /// A good result, rotated.
    Turned {
        /// Rotation in degrees, clockwise on the screen.
        angle_deg: f64,
    },
    /// A good result with the relief mirrored.
    Mirrored,
    /// A good result with another threshold.
    Threshold {
        /// Depth-map levels at or above this one were shown as stroke.
        level: u16,
    },
    /// A result that the reviewer has judged before.
    Duplicate,
}

impl AttentionCheck {
    /// Returns the name in JSON and in the catalog.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Turned { .. } => "turned",
            Self::Mirrored => "mirrored",
            Self::Threshold { .. } => "threshold",
            Self::Duplicate => "duplicate",
        }
    }

    /// Returns whether the check is a fault. An attentive reviewer fails it.
    pub const fn is_fault(&self) -> bool {
        match self {
            Self::Turned { .. } | Self::Mirrored | Self::Threshold { .. } => true,
            Self::Duplicate => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::AttentionCheck;
    use serde_json::json;

    #[test]
    fn name_equals_the_kind_in_json() {
        for check in [
            AttentionCheck::Turned { angle_deg: -9.5 },
            AttentionCheck::Mirrored,
            AttentionCheck::Threshold { level: 7 },
            AttentionCheck::Duplicate,
        ] {
            let value = json!(check);
            assert_eq!(value["kind"], check.name());
            assert_eq!(
                serde_json::from_value::<AttentionCheck>(value).ok(),
                Some(check)
            );
        }
    }
}
