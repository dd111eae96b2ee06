//! The four stages of the pipeline, in order.

use serde::{Deserialize, Serialize};

/// A stage of the pipeline. Variants are in processing order.
///
/// ```
/// use mocban::domain::Stage;
///
/// assert_eq!(Stage::Fit.next(), Some(Stage::Depth));
/// assert_eq!(Stage::Register.next(), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Mesh to character plane (paper III-A).
    Fit,
    /// Mesh and plane to depth map (paper III-B).
    Depth,
    /// Depth map and print to masks (paper III-C).
    Normalize,
    /// Masks to alignment and scores (paper III-D).
    Register,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Self; 4] = [Self::Fit, Self::Depth, Self::Normalize, Self::Register];

    /// Returns the position in the order, 0 to 3: the cursor of a job whose next stage this is.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Returns the stage at a cursor; `None` after the last stage.
    pub fn from_index(index: usize) -> Option<Self> {
        Self::ALL.get(index).copied()
    }

    /// Returns the next stage, or `None` after the last.
    pub fn next(self) -> Option<Self> {
        Self::from_index(self.index() + 1)
    }

    /// Returns the lower-case name used on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Depth => "depth",
            Self::Normalize => "normalize",
            Self::Register => "register",
        }
    }
}

impl std::fmt::Display for Stage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Stage {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|stage| stage.name() == text)
            .ok_or_else(|| format!("{text:?} is not a stage (fit, depth, normalize, register)"))
    }
}

#[cfg(test)]
mod tests {
    use super::Stage;

    #[test]
    fn index_and_name_round_trip() {
        for stage in Stage::ALL {
            assert_eq!(Stage::from_index(stage.index()), Some(stage));
            assert_eq!(stage.name().parse(), Ok(stage));
        }
        assert_eq!(Stage::Register.next(), None);
    }
}
