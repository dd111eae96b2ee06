//! Pose of a relief on a print: exhaustive search over rotation, scale and shift, then sub-pixel refinement.
//!
//! Soft strokes of the relief are compared with soft ink of the print, on the pixels where both have data. Both images
//! are high-pass filtered first. Bounding boxes and centroids of strokes are not used, because neighbouring characters,
//! specks and broken strokes change them.
//!
//! There are two frames: image pixels (of the depth map or the print) and working pixels (of a pyramid level). The
//! print is the fixed image, and the relief is the moving image.

mod border_mask;
mod candidate;
mod coarse_to_fine;
mod fft_correlation;
mod gauss_newton;
mod overlap;
mod pyramid;
mod refine;
mod search;
mod tiebreak;
mod top_hat;

pub(super) use border_mask::BorderStrokes;
pub(super) use candidate::{BeamWidth, PoseCandidate, SearchRange};
pub(super) use coarse_to_fine::{RefinementPass, search_coarse_to_fine};
pub(super) use gauss_newton::Loss;
pub(super) use overlap::PoseOverlap;
pub(super) use pyramid::{ImagePyramid, LevelBuilder, PyramidLevel, SoftMask};
pub(super) use refine::Refiner;
