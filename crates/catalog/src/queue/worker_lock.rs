//! Locks that show which workers are connected to a server. A lock belongs to the write connection of its worker, so the
//! server releases it when the process dies. A lock that is free is only a hint: a connection may break while its worker
//! lives.

use std::collections::BTreeSet;

use crate::Result;
use crate::db::conn::Conn;
use crate::db::query::query_scalar;
use mocban_core::domain::WorkerId;

/// Takes the lock of a worker until the end of the session. Returns `false` if another session holds it, such as a broken
/// connection of the same worker.
const TRY_LOCK: &str = "
SELECT pg_try_advisory_lock(hashtext(current_setting('search_path')), CAST(?1 % 2147483648 AS integer))";

/// Selects the numbers of all locks of workers in this catalog.
const LOCKS: &str = "
SELECT CAST(objid AS bigint) FROM pg_locks
WHERE locktype = 'advisory' AND objsubid = 2 AND granted
    AND database = (SELECT oid FROM pg_database WHERE datname = current_database())
    AND classid = CAST(hashtext(current_setting('search_path')) AS oid)";

/// The lock of a worker, as far as its connection knows.
#[derive(Debug, Default)]
pub(crate) struct WorkerLock {
    worker: Option<WorkerId>,
    is_held: bool,
}

impl WorkerLock {
    /// Sets the worker whose lock is taken from now on.
    pub(crate) fn set_worker(&mut self, worker: WorkerId) {
        if self.worker != Some(worker) {
            *self = Self {
                worker: Some(worker),
                is_held: false,
            };
        }
    }

    /// Records that the session has ended.
    pub(crate) const fn session_ended(&mut self) {
        self.is_held = false;
    }

    /// Takes the lock if it is not held. Otherwise, only finds out whether the connection works.
    pub(crate) async fn take(&mut self, conn: &mut Conn) -> Result<()> {
        let Some(worker) = self.worker else {
            return Ok(());
        };
        if self.is_held {
            let _: i64 = query_scalar("SELECT CAST(1 AS bigint)")
                .fetch_one(conn)
                .await?;
        } else {
            self.is_held = query_scalar(TRY_LOCK)
                .bind(worker.0)
                .fetch_one(conn)
                .await?;
        }
        Ok(())
    }
}

/// Returns which of the workers hold their locks.
pub(crate) async fn connected(
    conn: &mut Conn,
    workers: impl Iterator<Item = WorkerId>,
) -> Result<BTreeSet<WorkerId>> {
    let held: Vec<i64> = query_scalar(LOCKS).fetch_all(conn).await?;
    let held: BTreeSet<i64> = held.into_iter().collect();
    let number = |worker: &WorkerId| worker.0 % (1 << 31);
    Ok(workers
        .filter(|worker| held.contains(&number(worker)))
        .collect())
}
