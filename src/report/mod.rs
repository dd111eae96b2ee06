//! From the catalog to a report as plain data, and from there to text, JSON, CSV, Markdown, LaTeX and HTML.
//!
//! [`gather()`] streams the pairs through a [`Tally`], [`agree()`] through counts of what reviewers say; everything else is
//! pure.

mod agree;
mod agreement;
pub mod aligned;
mod bootstrap;
mod by_hand;
mod compare;
mod controls;
pub mod coverage;
#[cfg(test)]
pub(crate) mod fixture;
pub mod gallery;
pub mod gate;
mod gather;
mod interval;
mod model;
mod rate;
mod reasons;
mod render;
mod rules;
mod samples;
mod score;
mod score_duels;
pub(crate) mod standing;
pub mod stats;
mod tally;
mod thresholds;
mod times;
pub mod truth;
mod truth_sums;
mod warnings;

pub use agree::{Agree, ReviewerPair, ReviewerRecord, agree};
pub use agreement::{Agreement, ENOUGH};
pub use by_hand::{ByHand, HandErrors, HandMove};
pub use controls::Caught;
pub use gather::{GatherError, PAGE, finding, gather, gather_with, with_truth};
pub use interval::Interval;
pub use model::{
    Basis, Comparison, Coverage, CoveragePoint, FailedPair, FailureGroup, Progress, Report, Row,
    SCHEMA, TruthBlock,
};
pub use rate::Rate;
pub use reasons::ReasonCount;
pub use render::{Cover, Format, MOST_BYTES, agree_text, page, render};
pub use rules::Rules;
pub use samples::{Bootstrap, FEWEST_UNITS, MeanIntervals, Unit};
pub use score::Score;
pub use score_duels::ScoreComparison;
pub use standing::Standing;
pub use tally::{Tally, TruthFinding};
pub use thresholds::{BINS, Thresholds};
pub use times::StageTime;
