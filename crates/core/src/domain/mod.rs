//! Domain types: small values that do not use files, SQL, async code or image buffers.

mod address;
mod alignment_prior;
mod any_case;
mod artifact;
pub mod artifact_role;
mod attention_check;
mod block;
mod box_edge;
mod box_iou;
mod box_matching;
mod box_name;
pub mod cancel;
mod catalog_identity;
mod control_points;
mod displaced_part;
mod enum_names;
mod explained;
mod failure;
mod file_kind;
mod hash;
mod height_from_mesh;
mod ids;
mod input_version;
mod job;
mod levelling;
mod mask_scale;
mod mesh_losses;
mod metric;
mod outcome;
mod pair_name;
mod plain_path;
mod print_outline;
mod retire_cause;
mod review_order;
mod sanitize;
mod seeded_random;
mod separator_line;
pub mod shell;
mod significant;
pub mod spelling;
mod stage;
#[cfg(any(test, feature = "test-helpers"))]
pub mod test_values;
mod text_checksum;
mod transform;
mod unique_keys;
mod unit;
mod value_error;
mod verdict;
mod worker_metrics;
mod zeros;

pub use address::{has_password, is_address, without_password};
pub use alignment_prior::AlignmentPrior;
pub use any_case::any_case;
pub use artifact::{ARTIFACTS, ArtifactRef, ArtifactSet, PackLocation};
pub use attention_check::AttentionCheck;
pub use block::{
    BlockCharacterState, BlockId, BlockName, BlockSide, BlockStage, BlockStageRecord, TrueBox,
};
pub use box_edge::rounded_edge;
pub use box_iou::box_iou;
pub use box_matching::BoxMatches;
pub use box_name::{BoxName, NotABoxName, NotePart};
pub use catalog_identity::{CATALOG_FILE, CatalogIdentity, UNKNOWN_SERVER};
pub use control_points::{ControlPoint, ControlPoints};
pub use displaced_part::DisplacedPart;
pub use enum_names::enum_names;
use enum_names::stage_order;
pub use explained::{ErrorCode, Explained, FREE_SPACE, explained_by_cause, moved_away};
pub use failure::{Failure, FailureClass, NOT_THERE, UNIT_CLAUSES};
pub use file_kind::{FileKind, pointer_of};
pub use hash::{ContentHash, ContentHashError};
pub use height_from_mesh::HeightFromMesh;
pub use ids::{PairId, WorkerId};
pub use input_version::InputVersion;
pub use job::JobStatus;
pub use levelling::Levelling;
pub use mask_scale::{MaskReduction, MaskScale};
pub use mesh_losses::MeshLosses;
pub use metric::ThresholdMetric;
pub use outcome::{
    Curvature, DepthOutcome, DepthScale, Disagreement, FitOutcome, InkHypothesis, MetricOutcome,
    NormalizeOutcome, PoseFeatures, RegisterOutcome, ReliefHeights, ScanRegion, Scores,
    SideEvidence, ThresholdChoice,
};
pub use pair_name::{NO_BREAK_SPACES, PairName, PairNameError, is_device};
pub use plain_path::plain_path;
pub use print_outline::PrintOutline;
pub use retire_cause::RetireCause;
pub use review_order::ReviewOrder;
pub use sanitize::{first_names, is_hidden, one_line, sanitize, value_text, visible, visible_json};
pub use seeded_random::SeededRandom;
pub use separator_line::{SeparatorLines, named_separator};
pub use significant::{fixed, significant};
pub use stage::Stage;
pub use text_checksum::{is_text_changed, with_text_checksum};
pub use transform::{Affine2, PrintFromMesh, Rigid3};
pub use unique_keys::KEY_TWICE;
pub use unique_keys::UniqueKeys;
pub use unit::LengthUnit;
pub use value_error::value_error_text;
pub use verdict::{Reason, Verdict};
pub use worker_metrics::{ComputeTimes, WaitReason, WorkerMetrics};
pub use zeros::{ONLY_ZEROS, are_zeros, has_only_zeros};

/// Milliseconds since the Unix epoch. The current time is always passed as an argument.
pub type UnixMillis = i64;
