//! Laying relief on ink: a search over every angle and a band of scales, then refinement of the best few.
//!
//! Neither boxes nor centroids are trusted: neighbours, specks and broken ends decide those. What is compared is
//! soft relief with soft ink, each with its slow variation taken out, and only where it is known.

mod border_mask;
mod coarse_to_fine;
mod gauss_newton;
mod overlap;
mod pyramid;
mod refine;
mod search;
mod tiebreak;

pub(super) use border_mask::BorderStrokes;
pub(super) use coarse_to_fine::{RefinementPass, search_coarse_to_fine};
pub(super) use gauss_newton::Loss;
pub(super) use overlap::PoseOverlap;
pub(super) use pyramid::{ImagePyramid, LevelBuilder, PyramidLevel, SoftMask};
pub(super) use refine::Refiner;
pub(super) use search::{BeamWidth, PoseCandidate, SearchRange};
