//! What a run does with a pair at each stage, apart from how the work is shared out.

use super::pair_context::PairContext;
use crate::domain::{Failure, FailureClass, MetricOutcome, Stage};
use crate::store::NewArtifact;

/// What a stage gives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StageOutput {
    /// The numbers as canonical JSON.
    pub(super) outcome: String,
    /// The files.
    pub(super) files: Vec<NewArtifact>,
    /// The metrics, for the last stage.
    pub(super) metrics: Vec<MetricOutcome>,
}

/// Why a stage gave nothing.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum ExecutionError {
    /// What an earlier stage left is gone or of another input: start again there.
    RerunFrom(Stage),
    /// It failed.
    Failed {
        /// Class and message.
        failure: Failure,
        /// Whether another try may go better.
        is_transient: bool,
    },
}

impl ExecutionError {
    /// A failure that another try will not mend.
    pub(super) fn failed(class: FailureClass, message: impl Into<String>) -> Self {
        Self::Failed {
            failure: Failure::new(class, message),
            is_transient: false,
        }
    }
}

/// The stages as a run calls them: blocking, on a thread of their own, with the pair between them in memory.
pub(super) trait StageExecutor: Send + Sync + 'static {
    /// Runs a stage on the pair and leaves in it what later stages need.
    fn run(&self, stage: Stage, pair: &mut PairContext) -> Result<StageOutput, ExecutionError>;
}
