//! Laying relief on ink: a search over every angle and a band of scales, then refinement of the best few.
//!
//! Neither boxes nor centroids are trusted: neighbours, specks and broken ends decide those. What is compared is
//! soft relief with soft ink, each with its slow variation taken out, and only where it is known.

mod duel;
mod find;
mod ground;
mod layer;
mod overlap;
mod refine;
mod search;
mod step;

pub(super) use find::{Pass, find};
pub(super) use ground::Surroundings;
pub(super) use layer::{Base, Layer, Sizer, Soft};
pub(super) use overlap::Overlap;
pub(super) use refine::Refiner;
pub(super) use search::{Found, Keep, Limits};
pub(super) use step::Loss;
