//! Named points at which a test can make the process die, stop, wait or panic.
//!
//! The environment variables below each name a point as `STAGE:POINT[:N][@PAIR]`, for example `depth:synced:2` or
//! `fit:claimed@0003`. The stages of blocks have the same points, with the name of a block after the `@`. The variable
//! takes effect the N-th time that the pair reaches the point; without `@PAIR`, any pair counts. N is 1 by default; 0
//! means every time.
//!
//! - `MOCBAN_BREAK_AT` aborts the process.
//! - `MOCBAN_STOP_AT` stops the process until it receives SIGCONT.
//! - `MOCBAN_HOLD_AT` creates the file that `MOCBAN_HOLD_FILE` names and blocks the thread until the file is removed.
//!   It must name a point on a thread for blocking code: `computed`, `written` or `synced`.
//! - `MOCBAN_PANIC_AT` panics. It can name the same points as `MOCBAN_HOLD_AT`.
//!
//! `MOCBAN_TIME_SCALE=N` divides intervals of heartbeats, leases, recovery and reconnection by N, `MOCBAN_STORE_TIME_SCALE=N`
//! the time limits of an object store, and `MOCBAN_COMMIT_TIME_SCALE=N` the longest wait of a commit.
//!
//! `MOCBAN_LIMIT_FACTOR=N` multiplies by N the time limits of requests to the local server, of their confirmation, of silent
//! uploads, of statements on a database server, and of names for a shell; `MOCBAN_CONNECT_FACTOR=N` those of connections to a
//! database server; `MOCBAN_SHUTDOWN_FACTOR=N` the time that the local server waits for responses when it ends;
//! `MOCBAN_STORE_FACTOR=N` the time that a pack waits for the next stages of its pair, and the time for which the local copy
//! of an object counts as current. With long limits, a test shows at any speed that nothing waits for them, or counts what is
//! done within them.
//!
//! Only builds with debug assertions read these variables.

use std::fmt::Display;

/// A failpoint, in the order in which a pair passes them at each stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Point {
    /// The claim is written but not committed. In PostgreSQL, it is committed and its reply is not used yet. `@PAIR` never
    /// matches here.
    Claiming,
    /// The pair is leased, nothing is computed.
    Claimed,
    /// The stage is computed, nothing is on the disk.
    Computed,
    /// One of the stage's files is written under its temporary name.
    Written,
    /// The stage's files are on the disk, no row names them.
    Synced,
    /// The stage's rows are written but not committed. In PostgreSQL, they are not sent yet. `@PAIR` never matches here.
    Recorded,
    /// The stage's rows are committed.
    Committed,
}

/// Dies, stops, waits or panics here if a test requests it.
#[cfg(debug_assertions)]
pub fn hit(stage: impl Display, point: Point, name: Option<&dyn Display>) {
    let is_at = |failpoint: &Option<test_build::Failpoint>| {
        let failpoint = failpoint.as_ref();
        failpoint.is_some_and(|failpoint| failpoint.fires(&stage, point, name))
    };
    if is_at(&test_build::BREAK_AT) {
        std::process::abort();
    }
    if is_at(&test_build::STOP_AT) {
        test_build::stop();
    }
    if is_at(&test_build::HOLD_AT) {
        test_build::hold();
    }
    let panics = is_at(&test_build::PANIC_AT);
    assert!(!panics, "requested by a test");
}

/// Does nothing in a release build.
#[cfg(not(debug_assertions))]
pub fn hit(_stage: impl Display, _point: Point, _name: Option<&dyn Display>) {}

/// Returns the divisor or factor of time limits that a variable of the environment sets for tests, or 1.
pub fn time_scale(variable: &str) -> u32 {
    let scale = cfg!(debug_assertions)
        .then(|| std::env::var(variable).ok()?.parse().ok())
        .flatten();
    scale.unwrap_or(1).max(1)
}

/// The failpoints that the environment configures.
#[cfg(debug_assertions)]
mod test_build {
    use std::sync::LazyLock;
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::{Display, Point};

    type Configured = LazyLock<Option<Failpoint>>;

    pub(super) static BREAK_AT: Configured = LazyLock::new(|| Failpoint::from("MOCBAN_BREAK_AT"));
    pub(super) static STOP_AT: Configured = LazyLock::new(|| Failpoint::from("MOCBAN_STOP_AT"));
    pub(super) static HOLD_AT: Configured = LazyLock::new(|| Failpoint::from("MOCBAN_HOLD_AT"));
    pub(super) static PANIC_AT: Configured = LazyLock::new(|| Failpoint::from("MOCBAN_PANIC_AT"));

    /// A failpoint from the environment.
    #[derive(Debug)]
    pub(super) struct Failpoint {
        place: String,
        pair: Option<String>,
        nth: u64,
        hits: AtomicU64,
    }

    /// Stops the process until it receives SIGCONT.
    #[cfg(unix)]
    pub(super) fn stop() {
        use rustix::process::{Signal, getpid, kill_process};
        // If the signal cannot be sent, the process runs on, and the test that waits for it to stop fails.
        let _ = kill_process(getpid(), Signal::STOP);
    }

    /// Does nothing: Windows has no signal that stops a process.
    #[cfg(windows)]
    pub(super) const fn stop() {}

    /// Creates the hold file and waits until it is removed.
    pub(super) fn hold() {
        let Some(file) = std::env::var_os("MOCBAN_HOLD_FILE") else {
            return;
        };
        let created = std::fs::write(&file, b"");
        while created.is_ok() && std::path::Path::new(&file).exists() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }

    impl Failpoint {
        fn from(variable: &str) -> Option<Self> {
            let text = std::env::var(variable).ok()?;
            let (place, pair) = match text.split_once('@') {
                Some((place, pair)) => (place, Some(pair.to_owned())),
                None => (text.as_str(), None),
            };
            let mut parts = place.splitn(3, ':');
            let (stage, point) = (parts.next()?, parts.next()?);
            Some(Self {
                place: format!("{stage}:{point}"),
                pair,
                nth: parts.next().map_or(Some(1), |nth| nth.parse().ok())?,
                hits: AtomicU64::new(0),
            })
        }

        /// Counts a hit; returns whether it is the one to act on.
        pub(super) fn fires(
            &self,
            stage: &dyn Display,
            point: Point,
            name: Option<&dyn Display>,
        ) -> bool {
            let is_pair = |wanted: &String| name.is_some_and(|name| name.to_string() == *wanted);
            self.place == format!("{stage}:{point:?}").to_lowercase()
                && self.pair.as_ref().is_none_or(is_pair)
                && (self.hits.fetch_add(1, Ordering::SeqCst) + 1 == self.nth || self.nth == 0)
        }
    }
}
