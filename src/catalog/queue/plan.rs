//! The plan of a run, and the reasons as text.

use serde::Serialize;
use serde_json::Value;

use crate::domain::{JobStatus, Stage};

/// Why a pair has work to do.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "reason")]
pub enum StaleReason {
    /// It has never run.
    New,
    /// An earlier run ended before it was done, or `retry` requeued it.
    Unfinished,
    /// It waits for its next attempt after a transient failure.
    BackingOff,
    /// It failed permanently, but with other settings or inputs than the current ones.
    FailedBefore,
    /// The settings of `stage` or the program's revision of it changed.
    Settings {
        /// First stage with other settings.
        stage: Stage,
        /// What changed.
        changes: Vec<FieldChange>,
    },
    /// The mesh file's bytes changed.
    Mesh,
    /// The print file's bytes changed.
    Print,
    /// An import changed the unit or the scanned side.
    Manifest,
    /// It was requested (`--rerun`).
    Asked,
}

/// A changed setting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldChange {
    /// Name such as `register.max_scale`.
    pub field: String,
    /// Old value; `None` when the setting is new.
    pub old: Option<Value>,
    /// New value; `None` when the setting was removed.
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
    /// Quarantined pairs that stay so.
    pub quarantined: u64,
    /// Pairs leased by another process.
    pub leased: u64,
}

impl Plan {
    /// Returns the number of pairs that would run.
    pub fn pairs(&self) -> u64 {
        self.entries.iter().map(|entry| entry.pairs).sum()
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

impl std::fmt::Display for FieldChange {
    /// Writes `register.max_scale: 1.2 -> 1.3`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let show = |value: &Option<Value>| match value {
            Some(value) => value.to_string(),
            None => "none".to_owned(),
        };
        write!(
            f,
            "{}: {} -> {}",
            self.field,
            show(&self.old),
            show(&self.new)
        )
    }
}

impl std::fmt::Display for StaleReason {
    /// Writes a fragment such as `the print changed`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = match self {
            Self::New => "not run yet",
            Self::Unfinished => "not finished yet",
            Self::BackingOff => "waits to be tried again",
            Self::FailedBefore => "failed before with other settings or inputs",
            Self::Mesh => "the mesh changed",
            Self::Print => "the print changed",
            Self::Manifest => "the manifest tells another unit or side",
            Self::Asked => "asked for",
            Self::Settings { stage, changes } => return settings(f, *stage, changes),
        };
        f.write_str(text)
    }
}

/// Writes the first few changes.
fn settings(
    f: &mut std::fmt::Formatter<'_>,
    stage: Stage,
    changes: &[FieldChange],
) -> std::fmt::Result {
    const SHOWN: usize = 4;
    if changes.is_empty() {
        return write!(f, "{stage} follows a stage that was computed otherwise");
    }
    let shown: Vec<_> = changes
        .iter()
        .take(SHOWN)
        .map(ToString::to_string)
        .collect();
    f.write_str(&shown.join(", "))?;
    match changes.len().saturating_sub(SHOWN) {
        0 => Ok(()),
        more => write!(f, " and {more} more"),
    }
}
