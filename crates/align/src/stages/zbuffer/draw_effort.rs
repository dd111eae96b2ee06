//! Limit on the pixels that large triangles are tested at, so that repeated faces and fans of long slivers cannot make a
//! rendering take minutes.
//!
//! Small triangles are not counted, because each takes a fixed time. In ordinary scans, few triangles are large, and
//! surfaces overlap a few times.

use std::sync::atomic::{AtomicBool, Ordering};

use super::viewport::Viewport;

/// Large triangles may be tested at this many pixels for each pixel of the view, for each triangle, and in any case.
const TESTS_PER_PIXEL: u64 = 64;
const TESTS_PER_TRIANGLE: u64 = 8;
const FREE_TESTS: u64 = 1 << 24;

/// The pixels that large triangles may still be tested at in one rendering.
#[derive(Debug)]
pub(super) struct DrawEffort {
    left: u64,
}

impl DrawEffort {
    /// Returns the effort of a rendering of `triangles` triangles.
    pub(super) fn new(view: &Viewport, triangles: usize) -> Self {
        let pixels = (view.width as u64).saturating_mul(view.height as u64);
        let per_pixel = pixels.saturating_mul(TESTS_PER_PIXEL);
        let per_triangle = (triangles as u64).saturating_mul(TESTS_PER_TRIANGLE);
        Self {
            left: FREE_TESTS
                .saturating_add(per_pixel)
                .saturating_add(per_triangle),
        }
    }

    /// Counts tested pixels.
    #[inline(always)]
    pub(super) const fn spend(&mut self, tests: usize) {
        self.left = self.left.saturating_sub(tests as u64);
    }

    /// Returns whether more pixels may be tested.
    #[inline(always)]
    pub(super) const fn is_left(&self) -> bool {
        self.left > 0
    }
}

/// Whether a rendering of a surface was given up. Later renderings of the surface draw nothing.
#[derive(Debug, Default)]
pub(super) struct GivenUp(AtomicBool);

impl GivenUp {
    pub(super) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    pub(super) fn get(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// How often surfaces of a refused scan overlap at least, for messages.
pub(crate) const LARGEST_OVERLAP: u64 = TESTS_PER_PIXEL;
