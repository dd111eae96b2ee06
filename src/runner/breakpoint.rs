//! Named points at which a test build dies as a killed process does.
//!
//! `MOCBAN_BREAK_AT=STAGE:POINT[:N]`, for example `depth:filed:2`, ends the process the N-th time (1 when left out)
//! that a pair reaches the point at that stage. Only builds with debug assertions look.

use crate::domain::Stage;

/// Where a process may be made to die.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Point {
    /// The pair is leased, nothing is computed.
    Claimed,
    /// The stage is computed, nothing is on disk.
    Computed,
    /// Its files are on disk, no row names them.
    Filed,
    /// Its row is stored.
    Stored,
}

impl Point {
    #[cfg(debug_assertions)]
    const fn name(self) -> &'static str {
        match self {
            Self::Claimed => "claimed",
            Self::Computed => "computed",
            Self::Filed => "filed",
            Self::Stored => "stored",
        }
    }
}

/// Dies here if a test asks for it.
#[cfg(debug_assertions)]
pub(super) fn reach(stage: Stage, point: Point) {
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicU64, Ordering};

    static WANTED: OnceLock<Option<(String, u64)>> = OnceLock::new();
    static REACHED: AtomicU64 = AtomicU64::new(0);
    let wanted = WANTED.get_or_init(|| wanted(&std::env::var("MOCBAN_BREAK_AT").ok()?));
    let Some((name, nth)) = wanted else { return };
    if *name == format!("{stage}:{}", point.name())
        && REACHED.fetch_add(1, Ordering::SeqCst) + 1 == *nth
    {
        std::process::abort();
    }
}

/// Stage and point with the number of times.
#[cfg(debug_assertions)]
fn wanted(text: &str) -> Option<(String, u64)> {
    let mut parts = text.splitn(3, ':');
    let (stage, point) = (parts.next()?, parts.next()?);
    let nth = parts.next().map_or(Some(1), |nth| nth.parse().ok())?;
    Some((format!("{stage}:{point}"), nth))
}

/// Nothing to reach in a release build.
#[cfg(not(debug_assertions))]
pub(super) const fn reach(_stage: Stage, _point: Point) {}
