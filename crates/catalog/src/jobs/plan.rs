//! The plan of a run, and its reasons as text.

use std::fmt;

use serde::Serialize;
use serde_json::Value;

use crate::queue::provenance::FingerprintId;
use mocban_core::domain::{JobStatus, Stage};

/// Name of the setting that is part of every stage's fingerprint.
pub(crate) const METHOD: &str = "pipeline.method";

/// Why a pair has work to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case", tag = "reason")]
pub enum StaleReason {
    /// The pair has never run.
    New,
    /// An earlier run ended before the pair was done, or `retry` requeued the pair.
    Unfinished,
    /// The pair waits for its next attempt after a transient failure.
    BackingOff,
    /// The pair failed permanently, but its settings or inputs have changed since.
    FailedBefore,
    /// The settings of `stage`, or its revision in this program, changed.
    Settings {
        /// First stage whose settings changed.
        stage: Stage,
        /// Fingerprint of the old settings.
        #[serde(skip)]
        old: FingerprintId,
    },
    /// The mesh file's bytes changed.
    Mesh,
    /// The print file's bytes changed.
    Print,
    /// An import changed the unit or the scanned side.
    Manifest,
    /// A rerun was requested (`--rerun`).
    Requested,
}

/// A changed setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldChange {
    /// Name such as `register.max_scale`.
    pub field: String,
    /// Old value. `None` if the setting is new.
    pub old: Option<Value>,
    /// New value. `None` if the setting was removed.
    pub new: Option<Value>,
}

/// Pairs with the same first stage and the same reason.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanEntry {
    /// First stage to run.
    pub from: Stage,
    /// Why.
    #[serde(flatten)]
    pub why: StaleReason,
    /// Which settings changed, for [`StaleReason::Settings`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub changes: Option<Vec<FieldChange>>,
    /// Number of pairs.
    pub pairs: u64,
}

/// The plan of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Plan {
    /// Work by first stage and reason.
    pub entries: Vec<PlanEntry>,
    /// Pairs with nothing left to do.
    pub done: u64,
    /// Quarantined pairs that the run leaves in quarantine.
    pub quarantined: u64,
    /// Pairs leased by another process.
    pub leased: u64,
}

impl Plan {
    /// Returns the number of pairs that would run.
    pub fn pairs(&self) -> u64 {
        self.entries.iter().map(|entry| entry.pairs).sum()
    }

    /// Returns the number of pairs that would run although a run has finished or refused them before.
    pub fn again(&self) -> u64 {
        let waits = [
            StaleReason::New,
            StaleReason::Unfinished,
            StaleReason::BackingOff,
        ];
        let again = self
            .entries
            .iter()
            .filter(|entry| !waits.contains(&entry.why));
        again.map(|entry| entry.pairs).sum()
    }

    /// Returns whether pairs would run with another method than before.
    pub fn changes_method(&self) -> bool {
        let mut changes = self
            .entries
            .iter()
            .filter_map(|entry| entry.changes.as_ref());
        changes.any(|found| found.iter().any(|change| change.field == METHOD))
    }

    /// Counts pairs that would not run.
    pub(crate) const fn add_unchanged(&mut self, status: JobStatus, pairs: u64) {
        match status {
            JobStatus::Done => self.done += pairs,
            JobStatus::Quarantined => self.quarantined += pairs,
            JobStatus::Leased => self.leased += pairs,
            // These always have work to do.
            JobStatus::Ready | JobStatus::Backoff => {}
        }
    }
}

impl fmt::Display for FieldChange {
    /// Writes `register.max_scale: 1.2 -> 1.3`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let none = || "none".to_owned();
        let [old, new] =
            [&self.old, &self.new].map(|value| value.as_ref().map_or_else(none, Value::to_string));
        write!(f, "{}: {old} -> {new}", self.field)
    }
}

impl fmt::Display for PlanEntry {
    /// Writes the reason, such as `the print changed`. If settings changed, lists the first few of them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 4;
        let changes = self.changes.as_deref().unwrap_or_default();
        f.write_str(match self.why {
            StaleReason::New => "not run yet",
            StaleReason::Unfinished => "not finished yet",
            StaleReason::BackingOff => "waits to be tried again",
            StaleReason::FailedBefore => "failed before with other settings or inputs",
            StaleReason::Mesh => "the mesh changed",
            StaleReason::Print => "the print changed",
            StaleReason::Manifest => "the manifest has another unit or side",
            StaleReason::Requested => "requested",
            StaleReason::Settings { stage, .. } if changes.is_empty() => {
                return write!(f, "{stage} follows a stage with other settings");
            }
            StaleReason::Settings { .. } => {
                let shown = changes.iter().take(SHOWN).map(ToString::to_string);
                f.write_str(&shown.collect::<Vec<_>>().join(", "))?;
                return match changes.len().saturating_sub(SHOWN) {
                    0 => Ok(()),
                    more => write!(f, " and {more} more"),
                };
            }
        })
    }
}
