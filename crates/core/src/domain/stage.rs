//! The stages of the pipeline, in order.

use serde::{Deserialize, Serialize};

use super::{enum_names, stage_order};

/// A stage of the pipeline. Variants are in processing order.
///
/// ```
/// use mocban_core::domain::Stage;
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

stage_order!(Stage);

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
