//! The four stages of the pipeline, in order.

use serde::{Deserialize, Serialize};

use super::enum_names;

/// A stage of the pipeline. Variants are in processing order.
///
/// ```
/// use mocban::domain::Stage;
///
/// assert_eq!(Stage::Fit.next(), Some(Stage::Depth));
/// assert_eq!(Stage::Register.next(), None);
/// assert_eq!("register".parse(), Ok(Stage::Register));
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

enum_names! { pub Stage, "a stage":
    Fit = "fit", Depth = "depth", Normalize = "normalize", Register = "register",
}

impl Stage {
    /// Returns the position of the stage in the processing order, 0 to 3. A job's cursor is the index of its next
    /// stage.
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
