//! The paper's method (arXiv 2411.05524), stage by stage.

pub(super) mod fit;
pub(super) mod normalize;
pub(super) mod register;
