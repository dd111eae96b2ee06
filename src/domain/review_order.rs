//! In which order results come to a reviewer.

use serde::{Deserialize, Serialize};

/// The order of a review.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReviewOrder {
    /// By lot from a seed: what was read so far stands for all.
    Random,
    /// the least confident first, to find failures: what was read so far does not stand for all.
    LeastConfident,
    /// Only what other reviewers contradict each other on.
    Adjudicate,
}

impl ReviewOrder {
    /// Every order.
    pub const ALL: [Self; 3] = [Self::Random, Self::LeastConfident, Self::Adjudicate];

    /// Name in JSON and in the catalog.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::LeastConfident => "least_confident",
            Self::Adjudicate => "adjudicate",
        }
    }
}

impl std::fmt::Display for ReviewOrder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for ReviewOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|order| order.name() == text)
            .ok_or_else(|| {
                format!("{text:?} is not an order (random, least_confident, adjudicate)")
            })
    }
}
