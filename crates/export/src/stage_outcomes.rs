//! The parsed outcomes of all stages of a finished pair.

use mocban_core::domain::{
    DepthOutcome, FitOutcome, InkHypothesis, NormalizeOutcome, RegisterOutcome, Stage,
};
use mocban_results::pair_artifacts::{PairArtifacts, PairArtifactsError};

/// The outcomes of the stages of a finished pair.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StageOutcomes {
    pub(super) fit: FitOutcome,
    pub(super) depth: DepthOutcome,
    pub(super) normalize: NormalizeOutcome,
    pub(super) register: RegisterOutcome,
}

impl StageOutcomes {
    /// Parses the stored outcomes.
    ///
    /// # Errors
    /// Returns an error if a stage has no result, or its outcome has another form.
    pub(super) fn read(artifacts: &PairArtifacts<'_>) -> Result<Self, PairArtifactsError> {
        Ok(Self {
            fit: artifacts.outcome(Stage::Fit)?,
            depth: artifacts.outcome(Stage::Depth)?,
            normalize: artifacts.outcome(Stage::Normalize)?,
            register: artifacts.outcome(Stage::Register)?,
        })
    }

    /// Returns the interpretation of the print that was used.
    pub(super) fn ink(&self) -> Option<&InkHypothesis> {
        self.normalize.inks.get(self.register.ink)
    }
}
