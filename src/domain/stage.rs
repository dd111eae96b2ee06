//! The four stages a pair goes through, in order.

use serde::{Deserialize, Serialize};

/// A stage of the pipeline. The order of the variants is the order of the work.
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
    /// Every stage in order.
    pub const ALL: [Self; 4] = [Self::Fit, Self::Depth, Self::Normalize, Self::Register];

    /// Position in the order, 0..4: the cursor value of a job whose next stage this is.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The stage at a cursor; `None` when all four are behind it.
    pub fn from_index(index: usize) -> Option<Self> {
        Self::ALL.get(index).copied()
    }

    /// The stage after this one, if there is one.
    pub fn next(self) -> Option<Self> {
        Self::from_index(self.index() + 1)
    }

    /// Lower-case name, as typed on the command line and written to JSON.
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
    fn index_and_name_lead_back_to_the_stage() {
        for stage in Stage::ALL {
            assert_eq!(Stage::from_index(stage.index()), Some(stage));
            assert_eq!(stage.name().parse(), Ok(stage));
        }
        assert_eq!(Stage::Register.next(), None);
    }
}
