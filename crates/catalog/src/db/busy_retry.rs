//! Retries operations while another process has the catalog locked. Waits longer than SQLite's busy timeout.

use std::path::Path;
use std::time::Duration;

use tokio::time::{Sleep, sleep};

use crate::db::error::Result;
use crate::db::error_kind::CatalogErrorKind;
use crate::db::lock_owner::{OwnerWork, lock_owner, owner_work};
use mocban_system::platform::ActiveClock;

/// Longest wait while the process that holds the lock does not work.
const LONGEST_WAIT: Duration = Duration::from_mins(1);
/// Wait after which the lock's owner is logged.
const QUIET_WAIT: Duration = Duration::from_secs(5);
/// Time between two looks at the process that holds the lock.
const LOOK_EVERY: Duration = Duration::from_secs(5);
/// Least fraction of a processor that a working process uses: it writes a long list, for example. A program with an
/// open transaction that waits for a person uses less.
const WORKING_PERCENT: u64 = 1;
/// Time between two attempts: SQLite refuses some locks at once.
const RETRY_EVERY: Duration = Duration::from_millis(5);

/// Longest time of one attempt: SQLite's busy timeout and a margin. If more time passes, the process was suspended.
const LONGEST_ATTEMPT: Duration = Duration::from_secs(15);

/// Retries an operation while the catalog is locked: as long as the process that holds the lock works, and for
/// `LONGEST_WAIT` while it does not, or is unknown.
pub(crate) struct BusyRetry<'p> {
    catalog: &'p Path,
    clock: ActiveClock,
    is_logged: bool,
    look: fn(&Path) -> Option<OwnerWork>,
    /// The last look, and when it was.
    seen: (Duration, Option<OwnerWork>),
    /// Until when the process that held the lock worked.
    worked_until: Duration,
}

impl<'p> BusyRetry<'p> {
    /// Starts to wait for this catalog.
    pub(crate) fn begin(catalog: &'p Path) -> Self {
        Self {
            catalog,
            clock: ActiveClock::start(LONGEST_ATTEMPT),
            is_logged: false,
            look: owner_work,
            seen: (Duration::ZERO, None),
            worked_until: Duration::ZERO,
        }
    }

    /// Looks from time to time whether the process that holds the lock works.
    fn observe_owner(&mut self, now: Duration) {
        let (looked_at, before) = self.seen;
        if now < looked_at + LOOK_EVERY {
            return;
        }
        let found = (self.look)(self.catalog);
        self.seen = (now, found);
        let Some((found, before)) = found.zip(before) else {
            return;
        };
        let cpu_cs = found.cpu_cs.saturating_sub(before.cpu_cs);
        let passed_cs = now.saturating_sub(looked_at).as_millis() as u64 / 10;
        if found.pid != before.pid || cpu_cs * 100 >= passed_cs * WORKING_PERCENT {
            self.worked_until = now;
        }
    }

    /// Returns whether the wait may go on after this time: whether less than `LONGEST_WAIT` has passed since the process
    /// that holds the lock worked.
    fn may_wait(&mut self, waited: Duration) -> bool {
        self.observe_owner(waited);
        waited < self.worked_until + LONGEST_WAIT
    }

    /// Returns the pause before the next attempt. Returns `None` if the outcome is not a lock error, or if
    /// `LONGEST_WAIT` has passed since the process that holds the lock worked.
    pub(crate) fn wait<T>(&mut self, outcome: &Result<T>) -> Option<Sleep> {
        let error = outcome.as_ref().err()?;
        let waited = self.clock.now();
        if error.kind() != Some(CatalogErrorKind::Busy) || !self.may_wait(waited) {
            return None;
        }
        tracing::debug!(%error, "the catalog is busy, waiting");
        if waited >= QUIET_WAIT && !self.is_logged {
            self.is_logged = true;
            let owner = lock_owner(self.catalog);
            let owner =
                owner.map_or_else(|| "another process".to_owned(), |owner| owner.to_string());
            tracing::warn!("{} is locked by {owner}; waiting", self.catalog.display());
        }
        Some(sleep(RETRY_EVERY))
    }
}

/// Evaluates a fallible expression again while it fails with a lock error, for as long as [`BusyRetry`] waits. The value is
/// the last result.
macro_rules! retry_while_busy {
    ($catalog:expr, $attempt:expr) => {{
        let mut retry = $crate::db::busy_retry::BusyRetry::begin($catalog);
        loop {
            let outcome = $attempt;
            match retry.wait(&outcome) {
                Some(moment) => moment.await,
                None => break outcome,
            }
        }
    }};
}
pub(crate) use retry_while_busy;

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    use sqlx::sqlite::SqliteConnectOptions;
    use sqlx::{ConnectOptions as _, Connection as _, SqliteConnection};
    use tracing::span::{Attributes, Id, Record};
    use tracing::{Event, Level, Metadata, Subscriber, subscriber};

    use super::{
        ActiveClock, BusyRetry, LONGEST_ATTEMPT, LONGEST_WAIT, LOOK_EVERY, OwnerWork, QUIET_WAIT,
    };
    use crate::{CatalogError, Result};

    async fn connect(path: &Path) -> SqliteConnection {
        let options = SqliteConnectOptions::new().filename(path);
        let options = options.create_if_missing(true).busy_timeout(Duration::ZERO);
        options.connect().await.expect("a connection")
    }

    /// Returns the error of a write to a locked database.
    async fn busy() -> Result<()> {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("catalog.sqlite");
        let (mut first, mut second) = (connect(&path).await, connect(&path).await);
        let begin = sqlx::query("BEGIN IMMEDIATE").execute(&mut first).await;
        begin.expect("the lock");
        let refused = sqlx::query("BEGIN IMMEDIATE").execute(&mut second).await;
        first.close().await.expect("closed");
        Err(refused.expect_err("locked").into())
    }

    /// Returns a retry that has waited this long already.
    fn after(waited: Duration) -> BusyRetry<'static> {
        let mut retry = BusyRetry::begin(Path::new("catalog.sqlite"));
        retry.clock = ActiveClock::continued(LONGEST_ATTEMPT, waited);
        retry
    }

    /// A subscriber that counts warnings.
    #[derive(Default)]
    struct Warnings(Arc<AtomicUsize>);

    impl Subscriber for Warnings {
        fn enabled(&self, metadata: &Metadata<'_>) -> bool {
            *metadata.level() == Level::WARN
        }

        fn event(&self, _: &Event<'_>) {
            self.0.fetch_add(1, Ordering::SeqCst);
        }

        fn new_span(&self, _: &Attributes<'_>) -> Id {
            Id::from_u64(1)
        }

        fn record(&self, _: &Id, _: &Record<'_>) {}

        fn record_follows_from(&self, _: &Id, _: &Id) {}

        fn enter(&self, _: &Id) {}

        fn exit(&self, _: &Id) {}
    }

    #[tokio::test]
    async fn lock_owner_is_logged_once_and_the_wait_ends() {
        let busy = busy().await;
        let warnings = Warnings::default();
        let logged = Arc::clone(&warnings.0);
        let _log = subscriber::set_default(warnings);
        assert!(after(Duration::ZERO).wait(&busy).is_some());
        assert_eq!(logged.load(Ordering::SeqCst), 0);
        let mut retry = after(QUIET_WAIT);
        for _ in 0..3 {
            assert!(retry.wait(&busy).is_some());
            assert_eq!(logged.load(Ordering::SeqCst), 1);
        }
        assert!(after(LONGEST_WAIT).wait(&busy).is_none());
    }

    #[test]
    fn a_wait_lasts_as_long_as_the_owner_of_the_lock_works() {
        static CPU_CS: AtomicUsize = AtomicUsize::new(0);
        let mut retry = BusyRetry::begin(Path::new("catalog.sqlite"));
        retry.look = |_| {
            Some(OwnerWork {
                pid: 7,
                cpu_cs: CPU_CS.load(Ordering::SeqCst) as u64,
            })
        };
        let mut waits_until = |waited, cpu_cs| {
            CPU_CS.fetch_add(cpu_cs, Ordering::SeqCst);
            retry.may_wait(waited)
        };
        let (mut now, mut idle_from) = (LOOK_EVERY, LOOK_EVERY);
        while now < 10 * LONGEST_WAIT {
            assert!(waits_until(now, 100), "{now:?}");
            idle_from = now;
            now += LOOK_EVERY;
        }
        while now < idle_from + LONGEST_WAIT {
            assert!(waits_until(now, 0), "{now:?}");
            now += LOOK_EVERY;
        }
        assert!(!waits_until(idle_from + LONGEST_WAIT, 0));
    }

    #[tokio::test]
    async fn success_and_other_errors_are_not_retried() {
        assert!(after(Duration::ZERO).wait(&Ok(())).is_none());
        let closed: Result<()> = Err(CatalogError::Closed);
        assert!(after(Duration::ZERO).wait(&closed).is_none());
    }
}
