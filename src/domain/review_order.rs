//! Order of the review queue.

use serde::{Deserialize, Serialize};

/// Order in which results are reviewed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReviewOrder {
    /// Seeded shuffle; the results reviewed so far are a random sample.
    Random,
    /// Least confident first, to find failures; the results reviewed so far are not a representative sample.
    LeastConfident,
    /// Only results on which other reviewers disagree.
    Adjudicate,
}

impl ReviewOrder {
    /// All orders.
    pub const ALL: [Self; 3] = [Self::Random, Self::LeastConfident, Self::Adjudicate];

    /// Returns the name in JSON and in the catalog.
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
