//! One thing that is not as it should be.

use serde::Serialize;

use crate::catalog::CounterDrift;
use crate::domain::{PairName, Stage};

/// What kind of damage it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The file of the database is not what the database wrote.
    Database,
    /// A table, index or trigger is not as the program makes it.
    Schema,
    /// A row names a row that is not there.
    Reference,
    /// A counter does not say how many jobs there are.
    Counter,
    /// A pair has no job.
    JobMissing,
    /// A pair failed, and nothing says why.
    ReasonMissing,
    /// A pair is past a stage that has no result.
    ResultMissing,
    /// A stored result does not have its hash.
    ResultChanged,
    /// A pair is done, and its metrics are not those of its result.
    Metrics,
    /// A result names a file that is not there.
    FileMissing,
    /// A result's file is not what it was.
    FileChanged,
    /// A result's file cannot be read.
    FileUnreadable,
}

impl Kind {
    /// Every kind, in the order of a report.
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

    /// What a number of findings of it is called.
    pub const fn heading(self) -> &'static str {
        match self {
            Self::Database => "faults of the database",
            Self::Schema => "tables, indexes or triggers not as they were made",
            Self::Reference => "rows that name a row that is not there",
            Self::Counter => "counters that are off",
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

    /// Whether it is of a pair, which can be put back to be done.
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

/// One piece of damage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What kind it is.
    pub kind: Kind,
    /// The pair, where it is of one.
    pub pair: Option<PairName>,
    /// The stage to be done again, where it is of a pair.
    pub stage: Option<Stage>,
    /// The file, counter or row, in words.
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
