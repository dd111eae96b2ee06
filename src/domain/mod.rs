//! Nouns of the project: small values without files, SQL, async or image buffers.

mod artifact;
mod control;
mod evidence;
mod failure;
mod file_kind;
mod hash;
mod ids;
mod job;
mod lots;
mod metric;
mod outcome;
mod plain;
mod queue;
pub mod role;
mod stage;
mod transform;
mod unit;
mod verdict;

pub use artifact::{ArtifactRef, ArtifactSet};
pub use control::Control;
pub use evidence::Evidence;
pub use failure::{Failure, FailureClass};
pub use file_kind::FileKind;
pub use hash::{ContentHash, ContentHashError};
pub use ids::{PairId, PairName, PairNameError, WorkerId};
pub use job::{CRASH_LIMIT, Event, JobState, JobStatus, Refused, is_condemned, transition};
pub use lots::Lots;
pub use metric::ThresholdMetric;
pub use outcome::{
    Bow, DepthOutcome, DepthScale, FitOutcome, MetricOutcome, NormalizeOutcome, Pose,
    RegisterOutcome, Scores, SideEvidence, ThresholdChoice,
};
pub use plain::plain;
pub use queue::Queue;
pub use stage::Stage;
pub use transform::{Affine2, PrintFromMesh, Rigid3};
pub use unit::LengthUnit;
pub use verdict::{Reason, Verdict};

/// Milliseconds since the Unix epoch. "Now" is always an argument.
pub type UnixMillis = i64;
