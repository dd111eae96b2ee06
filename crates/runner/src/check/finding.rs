//! Findings of a check.

use serde::Serialize;

use mocban_catalog::{ChecksummedTable, CounterDrift, FaultyFingerprint, FaultyRow};
use mocban_core::domain::{PairId, PairName, Stage};

/// What the user can do about a damaged pair.
const IMPORT: &str = "import its list or its folders again, or restore a backup";

/// Kind of damage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The database file is damaged.
    Database,
    /// A table, index or trigger differs from the schema.
    Schema,
    /// A row that a run cannot restore. It is missing, differs from its checksum, has no checksum, or has an invalid
    /// value.
    Row,
    /// The hash of a fingerprint does not follow from its settings.
    Fingerprint,
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
    /// The metrics of a completed pair differ from its result.
    Metrics,
    /// A file of a result is missing.
    FileMissing,
    /// The content of a result file has changed.
    FileChanged,
    /// A file of a result cannot be read.
    FileUnreadable,
}

impl Kind {
    /// Returns whether computing a result again repairs this damage of a pair or block. A file that cannot be read may be
    /// sound.
    pub(super) const fn is_repairable(self) -> bool {
        !matches!(self, Self::FileUnreadable)
    }

    /// Returns the label of a number of findings of this kind.
    pub const fn heading(self) -> &'static str {
        match self {
            Self::Database => "faults of the database",
            Self::Schema => "tables, indexes or triggers that differ from the schema",
            Self::Row => "damaged rows that no run can compute again",
            Self::Fingerprint => "fingerprints that differ from their settings",
            Self::Reference => "rows that reference a missing row",
            Self::Counter => "wrong counters",
            Self::JobMissing => "pairs without a job",
            Self::ReasonMissing => "failed pairs without a reason",
            Self::ResultMissing => "missing results",
            Self::ResultChanged => "changed results",
            Self::Metrics => "pairs whose metrics differ from their result",
            Self::FileMissing => "missing files",
            Self::FileChanged => "changed files",
            Self::FileUnreadable => "unreadable files",
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
    /// Returns a finding that concerns no single pair.
    pub(super) const fn new(kind: Kind, what: String) -> Self {
        Self {
            kind,
            pair: None,
            stage: None,
            what,
        }
    }

    /// Describes a row that does not agree with its checksum, and what the user can do. `may_set_apart` is whether a repair
    /// by this user may set apart rows.
    pub(super) fn row(faulty: &FaultyRow, may_set_apart: bool) -> Self {
        let remedy = match faulty.table {
            ChecksummedTable::Pair => IMPORT,
            ChecksummedTable::Block => "import the block again",
            ChecksummedTable::Truth => "import the true alignments again, or restore a backup",
            ChecksummedTable::Verdict
            | ChecksummedTable::VerdictUndo
            | ChecksummedTable::Answer
            | ChecksummedTable::AnswerUndo
            | ChecksummedTable::ManualAlignment
            | ChecksummedTable::ManualAlignmentUndo => {
                if may_set_apart {
                    "it is not counted, and `check --repair` sets it apart; a backup may hold what was there before"
                } else {
                    "it is not counted, and the owner of the catalog can set it apart with `check --repair`"
                }
            }
        };
        let name = faulty.pair.as_ref();
        Self {
            pair: name.and_then(|name| name.parse().ok()),
            ..Self::new(Kind::Row, format!("{faulty}; {remedy}"))
        }
    }

    /// Describes a faulty fingerprint.
    pub(super) fn fingerprint(faulty: &FaultyFingerprint) -> Self {
        let stage = faulty.stage.map_or("unknown", Stage::name);
        let what = format!(
            "row {} of the table fingerprint (stage {stage}) differs from its hash; `check --repair` and `run` compute its results again",
            faulty.row
        );
        Self::new(Kind::Fingerprint, what)
    }

    /// Describes a pair with an invalid value.
    pub(super) fn unreadable(pair: PairId, reason: &str) -> Self {
        let what = format!(
            "row {} of the table pair has an invalid value: {reason}; {IMPORT}",
            pair.0
        );
        Self::new(Kind::Row, what)
    }

    /// Describes a wrong counter.
    pub(super) fn counter(drift: &CounterDrift) -> Self {
        let kept = match drift.kept {
            Some(kept) => format!("is {kept}"),
            None => "is missing".to_owned(),
        };
        let stage = usize::try_from(drift.cursor)
            .ok()
            .and_then(Stage::from_index);
        let at = stage.map_or("the end", Stage::name);
        let what = format!(
            "the counter of {} pairs at {at} {kept}, there are {}",
            drift.status, drift.counted
        );
        Self::new(Kind::Counter, what)
    }
}
