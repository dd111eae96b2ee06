//! A person's judgement of one result.

use serde::{Deserialize, Serialize};

/// Pass, fail or unsure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Angle within about 5 degrees and all strokes present (the paper's criterion).
    Pass,
    /// The criterion is not met.
    Fail,
    /// The reviewer cannot decide; counted separately, never as a pass or a fail.
    Unsure,
}

impl Verdict {
    /// All verdicts.
    pub const ALL: [Self; 3] = [Self::Pass, Self::Fail, Self::Unsure];

    /// Returns the name in JSON, in the catalog and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Unsure => "unsure",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Verdict {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|verdict| verdict.name() == text)
            .ok_or_else(|| format!("{text:?} is not a verdict (pass, fail, unsure)"))
    }
}

/// Why a result failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
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

impl Reason {
    /// All reasons, in the order of the keys 1 to 6.
    pub const ALL: [Self; 6] = [
        Self::Angle,
        Self::StrokesLost,
        Self::BackgroundIn,
        Self::ShiftOrScale,
        Self::Mirrored,
        Self::WrongPair,
    ];

    /// Returns the name in JSON, in the catalog and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::StrokesLost => "strokes_lost",
            Self::BackgroundIn => "background_in",
            Self::ShiftOrScale => "shift_or_scale",
            Self::Mirrored => "mirrored",
            Self::WrongPair => "wrong_pair",
        }
    }

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

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Reason {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|reason| reason.name() == text)
            .ok_or_else(|| {
                let known: Vec<_> = Self::ALL.iter().map(|reason| reason.name()).collect();
                format!("{text:?} is not a reason ({})", known.join(", "))
            })
    }
}
