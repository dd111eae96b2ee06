//! What a stored result is worth: its artifacts, the verdict that counts for it, its errors, and statistics over many.
//!
//! - `pair_artifacts.rs` reads the outcomes and artifacts of a pair, and groups results that look the same
//! - `consensus.rs` decides which verdict counts for a result; `reviewer_agreement.rs` and `attention_checks.rs` say how
//!   far reviewers can be trusted
//! - `ground_truth.rs` and `truth_evaluation.rs` measure results against true alignments, which follow a moved box in
//!   `truth_crop.rs`; `manual_alignment.rs` measures them against manual ones
//! - `gallery.rs` holds chosen results with their images
//! - [`stats`] has intervals and tests on plain numbers, [`number_format`] how numbers are shown
//!
//! **Invariant:** a verdict counts only for the result that was judged; statistics do not depend on the order of their
//! input.

pub mod attention_checks;
pub mod consensus;
pub mod gallery;
pub mod ground_truth;
pub mod manual_alignment;
pub mod number_format;
pub mod pair_artifacts;
mod reviewer_agreement;
pub mod stats;
#[cfg(any(test, feature = "test-helpers"))]
pub mod test_fixtures;
mod truth_crop;
mod truth_evaluation;

pub use attention_checks::{AttentionCheckRates, is_inattentive};
pub use consensus::Consensus;
pub use manual_alignment::{ManualAlignmentErrors, ManualCorrection, ManualErrors};
pub use reviewer_agreement::{
    MIN_RESULTS, ReviewerAgreement, ReviewerPair, ReviewerRecord, VerdictAgreement, agreement,
    agreement_of_verdicts,
};
pub use stats::{IntervalMethod, Rate, ResamplingUnit};
pub use truth_evaluation::{TruthEvaluation, evaluate_pairs, mask_iou, tops_iou};
