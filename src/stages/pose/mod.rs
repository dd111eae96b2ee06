//! Laying relief on ink: a search over every angle and a band of scales, then refinement of the best few.
//!
//! Neither boxes nor centroids are trusted: neighbours, specks and broken ends decide those. What is compared is
//! soft relief with soft ink, each with its slow variation taken out, and only where it is known.

mod layer;
mod refine;
mod search;

pub(super) use layer::{Layer, Soft};
pub(super) use refine::refine;
pub(super) use search::{Found, Limits, SEARCH_PX, search};
