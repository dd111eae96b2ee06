//! The blocks of a project: how many are done, and which failed.

use serde_json::{Value, json};

use mocban_catalog::BlockState;
use mocban_core::domain::{BlockName, BlockStage, JobStatus};

/// The blocks of a project.
#[derive(Debug, Clone, Default)]
pub struct BlockStatus(pub Vec<BlockState>);

impl BlockStatus {
    /// Returns whether the project has no blocks.
    pub const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the number of blocks with one of these statuses.
    pub fn number(&self, statuses: &[JobStatus]) -> u64 {
        let found = self.0.iter();
        found
            .filter(|state| statuses.contains(&state.status))
            .count() as u64
    }

    /// Returns the number of blocks that a run would work on.
    pub fn waiting(&self) -> u64 {
        self.number(&[JobStatus::Ready, JobStatus::Backoff])
    }

    /// Returns the number of blocks that a process works on or left.
    pub fn leased(&self) -> u64 {
        self.number(&[JobStatus::Leased])
    }

    /// Returns the blocks that a process works on or left, each with its stage.
    pub fn in_progress(&self) -> impl Iterator<Item = (&BlockName, BlockStage)> {
        let leased = self.0.iter();
        let leased = leased.filter(|state| state.status == JobStatus::Leased);
        leased.filter_map(|state| Some((&state.attributes.name, state.next_stage?)))
    }

    /// Returns the number of finished blocks of which an import changed the path of a file, which no run has read since.
    pub fn other_files(&self) -> u64 {
        self.0.iter().filter(|state| state.other_files).count() as u64
    }

    /// Returns the failed blocks.
    pub fn failed(&self) -> impl Iterator<Item = &BlockState> {
        let states = self.0.iter();
        states.filter(|state| state.status == JobStatus::Quarantined)
    }

    /// Returns the name of the first failed block.
    pub fn first_failed(&self) -> Option<String> {
        let first = self.failed().next()?;
        Some(first.attributes.name.to_string())
    }

    /// Returns the counts, and the failures with their sentences.
    pub fn json(&self) -> Value {
        let sum = |number: fn(&BlockState) -> u64| self.0.iter().map(number).sum::<u64>();
        let jobs = JobStatus::ALL.map(|status| (status.name().to_owned(), self.number(&[status])));
        let failures = self.failed().filter_map(|state| {
            let failed = state.failure.as_ref()?;
            Some(json!({
                "block": state.attributes.name, "stage": failed.stage, "class": failed.failure.class,
                "error": failed.failure.message,
            }))
        });
        json!({
            "total": self.0.len(),
            "jobs": jobs.into_iter().map(|(name, n)| (name, n.into())).collect::<serde_json::Map<_, Value>>(),
            "characters": sum(|state| state.characters),
            "left_out": sum(|state| state.left_out),
            "retired": sum(|state| state.retired),
            "other_files": self.other_files(),
            "low_confidence": sum(|state| state.low_confidence),
            "failures": failures.collect::<Value>(),
        })
    }
}
