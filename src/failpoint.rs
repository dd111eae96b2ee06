//! Named points at which a test build dies as a killed process does, is stopped, or is held up.
//!
//! `MOCBAN_BREAK_AT=STAGE:POINT[:N][@PAIR]`, for example `depth:filed:2` or `fit:claimed@0003`, ends the process the
//! N-th time (1 when left out, 0 for each time) that a pair, or that pair, reaches the point at that stage.
//! `MOCBAN_STOP_AT` stops the process there instead, until it is sent SIGCONT. `MOCBAN_HOLD_AT` holds the thread up:
//! it makes the file that `MOCBAN_HOLD_FILE` names and goes on when somebody has removed it; such a point must be one
//! that a thread of its own reaches: `computed`, `written` or `filed`. At `MOCBAN_PANIC_AT`, of the same kind, that
//! thread panics. Only builds with debug assertions look.

use crate::domain::{PairName, Stage};

/// Where a process may be made to die, in the order in which a pair comes by at each stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Point {
    /// The claim's row is written, not committed. Pairs have no names here.
    Claiming,
    /// The pair is leased, nothing is computed.
    Claimed,
    /// The stage is computed, nothing is on disk.
    Computed,
    /// A file of it is written under a temporary name, and has not got its own.
    Written,
    /// Its files are on disk, no row names them.
    Filed,
    /// Its job's step is written, not committed. Pairs have no names here.
    Rowed,
    /// Its rows are committed.
    Stored,
}

/// Dies, stops or waits here if a test asks for it.
#[cfg(debug_assertions)]
pub(crate) fn hit(stage: Stage, point: Point, pair: Option<&PairName>) {
    use test_build::{Wanted, asked};

    if asked(&test_build::BREAK_AT, "MOCBAN_BREAK_AT").is_some_and(|at| at.is(stage, point, pair)) {
        std::process::abort();
    }
    let stop: Option<&Wanted> = asked(&test_build::STOP_AT, "MOCBAN_STOP_AT");
    if stop.is_some_and(|at| at.is(stage, point, pair)) {
        let me = rustix::process::getpid();
        // A signal that cannot be sent leaves the process running, and the test that waits for it fails.
        let _ = rustix::process::kill_process(me, rustix::process::Signal::STOP);
    }
    let hold = asked(&test_build::HOLD_AT, "MOCBAN_HOLD_AT");
    if hold.is_some_and(|at| at.is(stage, point, pair)) {
        test_build::hold();
    }
    let panic = asked(&test_build::PANIC_AT, "MOCBAN_PANIC_AT");
    let panics = panic.is_some_and(|at| at.is(stage, point, pair));
    assert!(!panics, "asked for by a test");
}

/// Nothing to reach in a release build.
#[cfg(not(debug_assertions))]
pub(crate) const fn hit(_stage: Stage, _point: Point, _pair: Option<&PairName>) {}

/// What only a build with debug assertions looks at.
#[cfg(debug_assertions)]
mod test_build {
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::Point;
    use crate::domain::{PairName, Stage};

    pub(super) static BREAK_AT: OnceLock<Option<Wanted>> = OnceLock::new();
    pub(super) static STOP_AT: OnceLock<Option<Wanted>> = OnceLock::new();
    pub(super) static HOLD_AT: OnceLock<Option<Wanted>> = OnceLock::new();
    pub(super) static PANIC_AT: OnceLock<Option<Wanted>> = OnceLock::new();

    /// A place that a test names.
    #[derive(Debug)]
    pub(super) struct Wanted {
        place: String,
        pair: Option<String>,
        nth: u64,
        reached: AtomicU64,
    }

    pub(super) fn asked(
        place: &'static OnceLock<Option<Wanted>>,
        variable: &str,
    ) -> Option<&'static Wanted> {
        let wanted = place.get_or_init(|| Wanted::parse(&std::env::var(variable).ok()?));
        wanted.as_ref()
    }

    /// Waits until the file that tells of it is gone.
    pub(super) fn hold() {
        let Some(file) = std::env::var_os("MOCBAN_HOLD_FILE") else {
            return;
        };
        let made = std::fs::write(&file, b"");
        while made.is_ok() && std::path::Path::new(&file).exists() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }

    impl Wanted {
        fn parse(text: &str) -> Option<Self> {
            let (place, pair) = match text.split_once('@') {
                Some((place, pair)) => (place, Some(pair.to_owned())),
                None => (text, None),
            };
            let mut parts = place.splitn(3, ':');
            let (stage, point) = (parts.next()?, parts.next()?);
            Some(Self {
                place: format!("{stage}:{point}"),
                pair,
                nth: parts.next().map_or(Some(1), |nth| nth.parse().ok())?,
                reached: AtomicU64::new(0),
            })
        }

        /// Whether this is the place, for the N-th time.
        pub(super) fn is(&self, stage: Stage, point: Point, pair: Option<&PairName>) -> bool {
            let pair_is = |wanted: &String| pair.is_some_and(|pair| pair.as_str() == wanted);
            self.place == format!("{stage}:{}", name(point))
                && self.pair.as_ref().is_none_or(pair_is)
                && (self.reached.fetch_add(1, Ordering::SeqCst) + 1 == self.nth || self.nth == 0)
        }
    }

    const fn name(point: Point) -> &'static str {
        match point {
            Point::Claiming => "claiming",
            Point::Claimed => "claimed",
            Point::Computed => "computed",
            Point::Written => "written",
            Point::Filed => "filed",
            Point::Rowed => "rowed",
            Point::Stored => "stored",
        }
    }
}
