//! Order of the review queue.

use serde::{Deserialize, Serialize};

use super::enum_names;

/// Order in which results are reviewed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReviewOrder {
    /// Seeded shuffle; the results reviewed so far are a random sample.
    Random,
    /// Least confident results first, to find failures sooner. The reviewed results are then not a random sample.
    LeastConfident,
    /// Only results on which other reviewers disagree.
    Adjudicate,
}

enum_names! { pub ReviewOrder, "an order":
    Random = "random", LeastConfident = "least_confident", Adjudicate = "adjudicate",
}
