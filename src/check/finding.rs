//! Findings of a check.

use serde::Serialize;

use crate::catalog::CounterDrift;
use crate::domain::{PairName, Stage};

/// Kind of damage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The database file is damaged.
    Database,
    /// A table, index or trigger differs from the schema.
    Schema,
    /// A row references a missing row.
    Reference,
    /// A counter differs from the number of jobs.
    Counter,
    /// A pair has no job.
    JobMissing,
    /// A pair failed, but the reason is missing.
    ReasonMissing,
    /// The result of a completed stage is missing.
    ResultMissing,
    /// A stored result differs from its hash.
    ResultChanged,
    /// A pair is done, but its metrics differ from those of its result.
    Metrics,
    /// A file of a result is missing.
    FileMissing,
    /// The content of a result file has changed.
    FileChanged,
    /// A file of a result cannot be read.
    FileUnreadable,
}

impl Kind {
    /// All kinds, in the order of the summary.
    pub const ALL: [Self; 12] = [
        Self::Database,
        Self::Schema,
        Self::Reference,
        Self::Counter,
        Self::JobMissing,
        Self::ReasonMissing,
        Self::ResultMissing,
        Self::ResultChanged,
        Self::Metrics,
        Self::FileMissing,
        Self::FileChanged,
        Self::FileUnreadable,
    ];

    /// Returns the label of a number of findings of this kind.
    pub const fn heading(self) -> &'static str {
        match self {
            Self::Database => "faults of the database",
            Self::Schema => "tables, indexes or triggers not as they were made",
            Self::Reference => "rows that name a row that is not there",
            Self::Counter => "wrong counters",
            Self::JobMissing => "pairs without a job",
            Self::ReasonMissing => "failed pairs without a reason",
            Self::ResultMissing => "results that are missing",
            Self::ResultChanged => "results that were changed",
            Self::Metrics => "pairs with other metrics than their result's",
            Self::FileMissing => "files that are missing",
            Self::FileChanged => "files that were changed",
            Self::FileUnreadable => "files that cannot be read",
        }
    }

    /// Returns whether it concerns a pair, which can be sent back to run again.
    pub const fn is_of_pair(self) -> bool {
        match self {
            Self::Database | Self::Schema | Self::Reference | Self::Counter => false,
            Self::JobMissing
            | Self::ReasonMissing
            | Self::ResultMissing
            | Self::ResultChanged
            | Self::Metrics
            | Self::FileMissing
            | Self::FileChanged
            | Self::FileUnreadable => true,
        }
    }
}

/// One damaged file, row or counter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Kind of damage.
    pub kind: Kind,
    /// The pair concerned, if any.
    pub pair: Option<PairName>,
    /// The stage to run again, if a pair is concerned.
    pub stage: Option<Stage>,
    /// Description of the file, counter or row.
    pub what: String,
}

impl Finding {
    pub(super) const fn database(what: String) -> Self {
        Self::bare(Kind::Database, what)
    }

    pub(super) const fn schema(what: String) -> Self {
        Self::bare(Kind::Schema, what)
    }

    pub(super) const fn reference(what: String) -> Self {
        Self::bare(Kind::Reference, what)
    }

    pub(super) fn counter(drift: &CounterDrift) -> Self {
        let kept = match drift.kept {
            Some(kept) => format!("says {kept}"),
            None => "is gone".to_owned(),
        };
        let at = usize::try_from(drift.cursor)
            .ok()
            .and_then(Stage::from_index)
            .map_or("the end", Stage::name);
        let what = format!(
            "the counter of {} pairs at {at} {kept}, there are {}",
            drift.status, drift.counted
        );
        Self::bare(Kind::Counter, what)
    }

    /// Jobs whose fingerprint or dirty mark is wrong.
    pub(super) const fn mark(line: String) -> Self {
        Self::bare(Kind::Counter, line)
    }

    const fn bare(kind: Kind, what: String) -> Self {
        Self {
            kind,
            pair: None,
            stage: None,
            what,
        }
    }
}
