//! A person's judgement of one result.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::enum_names;

/// Pass, fail or unsure.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Angle within about 5 degrees and all strokes present (the paper's criterion).
    Pass,
    /// The criterion is not met.
    Fail,
    /// The reviewer cannot decide. This verdict is counted separately, never as a pass or a fail.
    Unsure,
}

enum_names! { pub Verdict, "a verdict":
    Pass = "pass", Fail = "fail", Unsure = "unsure",
}

/// Why a result failed.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Rotated by more than about 5 degrees.
    Angle,
    /// The threshold removes strokes.
    StrokesLost,
    /// The threshold includes background.
    BackgroundIn,
    /// Wrong shift or scale.
    ShiftOrScale,
    /// The relief is mirrored.
    Mirrored,
    /// Mesh and print are of different characters, or one is unusable.
    WrongPair,
}

enum_names! { pub Reason, "a reason":
    Angle = "angle", StrokesLost = "strokes_lost", BackgroundIn = "background_in", ShiftOrScale = "shift_or_scale",
    Mirrored = "mirrored", WrongPair = "wrong_pair",
}

impl Reason {
    /// Returns the name for tables and messages.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::StrokesLost => "strokes lost",
            Self::BackgroundIn => "background included",
            Self::ShiftOrScale => "shift or scale",
            Self::Mirrored => "mirrored",
            Self::WrongPair => "wrong pair",
        }
    }
}
