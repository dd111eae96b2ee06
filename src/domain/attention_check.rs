//! What is shown to a reviewer only to test the reviewer.

use serde::{Deserialize, Serialize};

/// A planted fault, or a result shown a second time. Answers to them are no verdicts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum AttentionCheck {
    /// A good result turned by so much, degrees clockwise on the screen.
    Turned {
        /// How far.
        angle_deg: f64,
    },
    /// A good result with the relief in mirror writing.
    Mirrored,
    /// A good result cut at another level of the depth map.
    Threshold {
        /// Depth-map levels from this one up were shown as stroke.
        level: u16,
    },
    /// A result that the reviewer had judged before.
    Duplicate,
}

impl AttentionCheck {
    /// Name in JSON and in the catalog.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Turned { .. } => "turned",
            Self::Mirrored => "mirrored",
            Self::Threshold { .. } => "threshold",
            Self::Duplicate => "duplicate",
        }
    }

    /// Whether it is a fault, so that a reviewer who fails it has caught it.
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
    fn name_is_the_one_in_json() {
        for control in [
            AttentionCheck::Turned { angle_deg: -9.5 },
            AttentionCheck::Mirrored,
            AttentionCheck::Threshold { level: 7 },
            AttentionCheck::Duplicate,
        ] {
            let value = json!(control);
            assert_eq!(value["kind"], control.name());
            assert_eq!(
                serde_json::from_value::<AttentionCheck>(value).ok(),
                Some(control)
            );
        }
    }
}
