//! Time of each part of a run on one core.

use rustix::time::{ClockId, clock_gettime};

/// A part of a run that is timed separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Bytes of a binary STL to a mesh.
    ReadMesh,
    /// Bytes of the print's file to a picture.
    ReadPrint,
    /// Mesh to plane.
    Fit,
    /// Mesh and plane to depth map.
    Depth,
    /// Depth map and print to ink masks and relief heights.
    Normalize,
    /// Ink and relief to alignments.
    Register,
}

impl Part {
    /// Every part, in order.
    pub(super) const ALL: [Self; 6] = [
        Self::ReadMesh,
        Self::ReadPrint,
        Self::Fit,
        Self::Depth,
        Self::Normalize,
        Self::Register,
    ];
    /// The parts that are stages.
    pub(super) const STAGES: [Self; 4] = [Self::Fit, Self::Depth, Self::Normalize, Self::Register];

    /// Name in tables.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::ReadMesh => "read STL",
            Self::ReadPrint => "read print",
            Self::Fit => "fit",
            Self::Depth => "depth",
            Self::Normalize => "normalize",
            Self::Register => "register",
        }
    }
}

/// Processor time of each part in milliseconds. It is 0 for parts that were not reached.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Times([f64; Part::ALL.len()]);

impl Times {
    /// Runs the work and adds its time to a part.
    pub(super) fn book<T>(&mut self, part: Part, work: impl FnOnce() -> T) -> T {
        let before = thread_ms();
        let done = work();
        self.0[part as usize] += thread_ms() - before;
        done
    }

    /// Returns the milliseconds of a part.
    pub(super) const fn ms(&self, part: Part) -> f64 {
        self.0[part as usize]
    }

    /// Returns the milliseconds of several parts.
    pub(super) fn sum_ms(&self, parts: &[Part]) -> f64 {
        parts.iter().map(|part| self.ms(*part)).sum()
    }
}

/// Returns the processor time of this thread in milliseconds. Other work on the machine does not count.
fn thread_ms() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 * 1e3 + now.tv_nsec as f64 / 1e6
}
