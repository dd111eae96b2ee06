//! One rule of a page.

/// A straight rule.
#[derive(Debug, Clone, Copy)]
pub(super) struct PageRule {
    /// End points, mm.
    pub ends: [[f64; 2]; 2],
    /// Half the width, mm.
    pub half_width_mm: f64,
}
