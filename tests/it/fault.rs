//! Disk faults that `tests/faults/faults.c` injects.

use std::collections::BTreeSet;
use std::fmt;
use std::path::Path;
use std::process::Command;

use crate::shim::FAULTS;

/// Input/output error.
pub(crate) const EIO: i32 = 5;
/// Another process holds the lock.
pub(crate) const EAGAIN: i32 = 11;
/// The disk is full.
pub(crate) const ENOSPC: i32 = 28;

/// System calls that fail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fault {
    call: &'static str,
    /// Which files, as a pattern.
    path: &'static str,
    /// The error number; 0 where the calls succeed in the end.
    error: i32,
    /// How many calls fail; 0 for all from the first one on.
    times: u32,
    /// The first call writes only half of its bytes.
    half: bool,
    delay_ms: u32,
}

impl Fault {
    /// One call that fails.
    pub(crate) const fn once(call: &'static str, path: &'static str, error: i32) -> Self {
        Self {
            call,
            path,
            error,
            times: 1,
            half: false,
            delay_ms: 0,
        }
    }

    /// One call that writes half of its bytes.
    pub(crate) const fn half(path: &'static str) -> Self {
        Self::once("write", path, 0).half_first()
    }

    /// Every call takes this long.
    pub(crate) const fn slow(call: &'static str, path: &'static str, delay_ms: u32) -> Self {
        Self {
            delay_ms,
            ..Self::once(call, path, 0).and_later()
        }
    }

    /// Also all calls after the first.
    pub(crate) const fn and_later(self) -> Self {
        self.times(0)
    }

    /// This many calls in a row.
    pub(crate) const fn times(self, times: u32) -> Self {
        Self { times, ..self }
    }

    /// The first call writes half of its bytes before the others fail.
    pub(crate) const fn half_first(self) -> Self {
        Self { half: true, ..self }
    }

    /// Makes the n-th matching call of a command fail, or no call if `nth` is 0. The fault's path pattern is relative
    /// to `root`. Matching calls and injected faults are logged in `notes`.
    pub(crate) fn inject<'c>(
        &self,
        nth: usize,
        root: &Path,
        notes: &Path,
        command: &'c mut Command,
    ) -> &'c mut Command {
        if self.half {
            command.env("FAULT_SHORT", "1");
        }
        FAULTS
            .load(command)
            .env("FAULT_CALL", self.call)
            .env("FAULT_PATH", root.join(self.path))
            .env("FAULT_NTH", nth.to_string())
            .env("FAULT_TIMES", self.times.to_string())
            .env("FAULT_ERROR", self.error.to_string())
            .env("FAULT_DELAY_MS", self.delay_ms.to_string())
            .env("FAULT_NO_SLEEP", "1")
            .env("FAULT_LOG", notes.join("calls"))
            .env("FAULT_MARK", notes.join("injected"))
    }

    /// Returns how many matching calls a command made.
    pub(crate) fn calls(notes: &Path) -> usize {
        lines(&notes.join("calls"))
    }

    /// Returns how many faults were injected.
    pub(crate) fn injected(notes: &Path) -> usize {
        lines(&notes.join("injected"))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.call, self.path)?;
        if self.half {
            write!(f, ", half of it")?;
        }
        match self.error {
            0 => {}
            EIO => write!(f, ", refused")?,
            EAGAIN => write!(f, ", locked")?,
            ENOSPC => write!(f, ", full")?,
            other => write!(f, ", error {other}")?,
        }
        if self.delay_ms > 0 {
            write!(f, ", {} ms", self.delay_ms)?;
        }
        match self.times {
            0 => write!(f, ", from then on"),
            1 => Ok(()),
            times => write!(f, ", {times} times"),
        }
    }
}

fn lines(file: &Path) -> usize {
    std::fs::read_to_string(file).map_or(0, |text| text.lines().count())
}

/// Returns `wanted` evenly spaced numbers from 1 to `last`, or the middle number if `wanted` is 1.
pub(crate) fn spread(last: usize, wanted: usize) -> BTreeSet<usize> {
    match wanted.min(last) {
        0 | 1 => BTreeSet::from([last.div_ceil(2)]),
        wanted => (0..wanted)
            .map(|i| 1 + i * (last - 1) / (wanted - 1))
            .collect(),
    }
}
