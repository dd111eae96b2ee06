//! The write connection of a catalog. In SQLite, it checks before and after each commit whether another program deleted,
//! replaced or cut the write-ahead log. In PostgreSQL, it reconnects when the server was unavailable, and remembers the leases
//! that this process has received, and the lock of its worker.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use sqlx::{Connection as _, PgConnection};

use crate::db::busy_retry::retry_while_busy;
use crate::db::conn::{Conn, ConnectionKind, Work};
use crate::db::dialect::Sql;
use crate::db::error::{CatalogError, Result};
use crate::db::log_watch::LogWatch;
use crate::db::postgres::LOCK_FOR_ANY_PLAN;
use crate::db::postgres_address::PostgresAddress;
use crate::db::query::{query, query_scalar};
use crate::db::retry_wait::RetryWait;
use crate::db::transaction::BEGIN;
use crate::queue::claim_tracker::ClaimTracker;
use crate::queue::lease::{Lease, leases};
use crate::queue::pair_job::PairJob;
use mocban_core::domain::{PairId, WorkerId};

/// Time after a connection was given up in which no other is tried.
const PAUSE_AFTER_GIVING_UP: Duration = Duration::from_secs(10);

/// The write connection.
pub(crate) struct WriteConnection {
    pub(crate) conn: Conn,
    pub(crate) path: Arc<Path>,
    /// The log that the commits go to, in SQLite.
    log: Option<LogWatch>,
    /// What is needed to connect again, in PostgreSQL.
    server: Option<Server>,
    /// Whether a statement got no reply, so that the state of the connection is unknown.
    is_broken: bool,
}

/// The server of a catalog in PostgreSQL.
struct Server {
    address: PostgresAddress,
    state: CatalogServerState,
    /// When a connection was last given up, because the server did not reply.
    given_up: Option<Instant>,
}

impl WriteConnection {
    pub(crate) fn new(conn: Conn, path: Arc<Path>) -> Self {
        let log = Some(LogWatch::new(&path));
        Self {
            conn,
            path,
            log,
            server: None,
            is_broken: false,
        }
    }

    /// A connection to a server.
    pub(crate) fn to_server(
        conn: PgConnection,
        address: PostgresAddress,
        retry_wait: Arc<RetryWait>,
    ) -> Self {
        Self {
            conn: Conn::Postgres(ConnectionKind::Owned(conn)),
            path: Path::new(&address.text()).into(),
            log: None,
            server: Some(Server {
                address,
                state: CatalogServerState {
                    retry_wait,
                    ..CatalogServerState::default()
                },
                given_up: None,
            }),
            is_broken: false,
        }
    }

    /// Returns the connection, the path, and the remembered state if the catalog is on a server.
    pub(crate) fn parts(&mut self) -> (&mut Conn, &Path, Option<&mut CatalogServerState>) {
        let state = self.server.as_mut().map(|server| &mut server.state);
        (&mut self.conn, &self.path, state)
    }

    /// Returns whether the catalog is on a server.
    pub(crate) const fn is_on_server(&self) -> bool {
        self.server.is_some()
    }

    /// Connects again if the state of the connection is unknown.
    ///
    /// # Errors
    /// Returns an error if waits were ended, or if the server refuses the connection.
    pub(crate) async fn reconnect_if_broken(&mut self) -> Result<()> {
        if self.is_broken {
            self.reconnect().await?;
        }
        Ok(())
    }

    /// Waits before a connection is opened for the `repeats`th time in a row, because a server may end every connection after
    /// its first statement. Returns `false` if waits were ended.
    pub(crate) async fn may_repeat(&self, repeats: u32, error: &CatalogError) -> bool {
        match &self.server {
            Some(server) if repeats > 0 => server.state.retry_wait.wait(repeats, error).await,
            _ => self.is_on_server(),
        }
    }

    /// Connects again after the server was unavailable, and waits until it is available. Does nothing if the catalog is a
    /// file.
    ///
    /// # Errors
    /// Returns an error if waits were ended, or if the server refuses the connection for a reason that waiting does not
    /// remove, such as a changed password. Does not try again soon after it gave up.
    pub(crate) async fn reconnect(&mut self) -> Result<()> {
        let Some(server) = &mut self.server else {
            return Ok(());
        };
        self.is_broken = true;
        if server
            .given_up
            .is_some_and(|at| at.elapsed() < PAUSE_AFTER_GIVING_UP)
        {
            return Err(server.address.no_reply());
        }
        let retry_wait = Arc::clone(&server.state.retry_wait);
        let mut attempt = 0;
        loop {
            match retry_wait.limit(server.address.reconnect()).await {
                Ok(conn) => {
                    self.conn = Conn::Postgres(ConnectionKind::Owned(conn));
                    self.is_broken = false;
                    server.state.leases.replies_may_be_lost();
                    server.state.has_folded_all = false;
                    server.state.worker_lock.session_ended();
                    let lock = server.state.worker_lock.take(&mut self.conn);
                    if let Err(error) = retry_wait.limit(lock).await {
                        self.is_broken = error.is_unavailable();
                        tracing::debug!(%error, "the worker's lock is taken later");
                    }
                    tracing::info!("connected to the database server again");
                    return Ok(());
                }
                Err(error) if error.is_unavailable() && retry_wait.wait(attempt, &error).await => {
                    attempt += 1;
                }
                Err(error) => {
                    server.given_up = retry_wait.is_silent().then(Instant::now);
                    return Err(error);
                }
            }
        }
    }

    /// Keeps the lock of a worker, over a new connection if the server was unavailable.
    pub(crate) async fn keep_worker_lock(&mut self, worker: WorkerId) -> Result<()> {
        self.reconnect_if_broken().await?;
        let mut repeats = 0;
        loop {
            let Some(server) = &mut self.server else {
                return Ok(());
            };
            server.state.worker_lock.set_worker(worker);
            let retry_wait = Arc::clone(&server.state.retry_wait);
            let lock = server.state.worker_lock.take(&mut self.conn);
            match retry_wait.limit(lock).await {
                Err(error) if error.is_unavailable() && self.may_repeat(repeats, &error).await => {
                    self.reconnect().await?;
                    repeats += 1;
                }
                outcome => {
                    self.note_outcome(&outcome);
                    return outcome;
                }
            }
        }
    }

    /// Records whether the outcome of the last statements leaves the connection in an unknown state.
    pub(crate) fn note_outcome<T>(&mut self, outcome: &Result<T>) {
        let is_unknown = outcome.as_ref().is_err_and(CatalogError::is_unavailable);
        self.is_broken |= self.is_on_server() && is_unknown;
    }

    /// Checks the log. Must be called before and after each commit, so that a reply is sent only for what is stored.
    ///
    /// # Errors
    /// Returns an error if another program deleted, replaced or cut the log.
    pub(crate) async fn check_log(&mut self) -> Result<()> {
        match (&mut self.conn, &mut self.log) {
            (Conn::Sqlite(conn), Some(log)) => log.check(conn).await,
            _ => Ok(()),
        }
    }

    /// Runs `work` in a separate transaction. Rolls it back if `work` or the commit fails.
    pub(crate) async fn run_transaction<T>(
        &mut self,
        work: impl for<'c> FnOnce(&'c mut Conn) -> Work<'c, Result<T>>,
    ) -> Result<T> {
        self.check_log().await?;
        self.reconnect_if_broken().await?;
        let mut repeats = 0;
        loop {
            let (conn, path, state) = self.parts();
            match retry_while_busy!(path, limit(state.as_deref(), begin(conn)).await) {
                Err(error) if error.is_unavailable() && self.may_repeat(repeats, &error).await => {
                    self.reconnect().await?;
                    repeats += 1;
                    tracing::debug!(%error, "the transaction begins again");
                }
                begun => {
                    self.note_outcome(&begun);
                    break begun?;
                }
            }
        }
        let (conn, _, state) = self.parts();
        let work = async {
            let done = work(&mut *conn).await?;
            execute(conn, "COMMIT").await?;
            Ok(done)
        };
        let outcome = limit(state.as_deref(), work).await;
        self.note_outcome(&outcome);
        if outcome.is_err() && !self.is_broken {
            rollback(&mut self.conn).await;
        }
        if let Some(server) = &mut self.server {
            server.state.claim_tracker.begin_again();
        }
        self.check_log().await?;
        outcome
    }

    /// Checkpoints the log, unless it is lost.
    pub(crate) async fn checkpoint_log(&mut self, pragma: &'static str) {
        if let (Conn::Sqlite(conn), Some(log)) = (&mut self.conn, &mut self.log) {
            log.checkpoint(conn, pragma).await;
        }
    }

    /// Checkpoints the log and closes the connection.
    pub(crate) async fn close(mut self) {
        self.checkpoint_log("PRAGMA wal_checkpoint(TRUNCATE)").await;
        let is_lost = self.log.as_ref().is_some_and(LogWatch::is_lost);
        let closed = match self.conn {
            // Closing would copy pages of the damaged log to the catalog. Exiting without closing does not.
            Conn::Sqlite(ConnectionKind::Owned(conn)) if is_lost => {
                std::mem::forget(conn);
                return;
            }
            Conn::Sqlite(ConnectionKind::Owned(conn)) => conn.close().await,
            Conn::Postgres(ConnectionKind::Owned(_)) if self.is_broken => return,
            Conn::Postgres(ConnectionKind::Owned(conn)) => conn.close().await,
            Conn::Sqlite(_) | Conn::Postgres(_) => return,
        };
        if let Err(error) = closed {
            tracing::warn!(%error, "the catalog did not close cleanly");
        }
    }
}

/// Runs an operation. On a server, gives it up if there is no reply after waits were ended.
async fn limit<T>(
    server: Option<&CatalogServerState>,
    operation: impl Future<Output = Result<T>>,
) -> Result<T> {
    match server {
        Some(server) => server.retry_wait.limit(operation).await,
        None => operation.await,
    }
}

/// Begins a transaction. On a server, waits until no other such transaction is open.
async fn begin(conn: &mut Conn) -> Result<()> {
    execute(conn, BEGIN).await?;
    match conn {
        Conn::Sqlite(_) => Ok(()),
        Conn::Postgres(_) => execute(conn, LOCK_FOR_ANY_PLAN).await,
    }
}

/// Rolls the current transaction back.
pub(crate) async fn rollback(conn: &mut Conn) {
    // SQLite has already rolled back after some errors, such as a full disk.
    if let Err(error) = execute(conn, "ROLLBACK").await {
        tracing::debug!(%error, "nothing to roll back");
    }
}

async fn execute(conn: &mut Conn, sql: impl Into<Sql>) -> Result<()> {
    query(sql).execute(conn).await
}

/// What this process remembers of its requests to a server.
#[derive(Debug, Default)]
pub(crate) struct CatalogServerState {
    pub(crate) leases: KnownLeases,
    pub(crate) claim_tracker: ClaimTracker,
    /// Whether the counters of all earlier slots were added up over this connection.
    pub(crate) has_folded_all: bool,
    worker_lock: WorkerLock,
    pub(crate) retry_wait: Arc<RetryWait>,
}

/// Time after a reconnection or a failed claim during which unknown leases are searched for. A server may execute a commit
/// of the broken connection until it notices that the connection is broken.
const SEARCH_TIME: Duration = Duration::from_mins(2);

/// Leases that this process has received from a server: their tokens by pair. The reply to a claim can be lost after its
/// commit. Then the catalog contains leases that this process has not received, and its heartbeats keep them valid.
#[derive(Debug, Default)]
pub(crate) struct KnownLeases {
    tokens: BTreeMap<PairId, i64>,
    search_until: Option<Instant>,
}

impl KnownLeases {
    /// Records that replies may have been lost.
    pub(crate) fn replies_may_be_lost(&mut self) {
        self.search_until = Some(Instant::now() + SEARCH_TIME);
    }

    /// Returns whether an earlier commit may have been stored although its reply was lost.
    pub(crate) fn is_searching(&self) -> bool {
        self.search_until
            .is_some_and(|until| Instant::now() <= until)
    }

    /// Adds leases that a claim returned.
    pub(crate) fn add(&mut self, leases: &[Lease]) {
        let tokens = leases.iter().map(|lease| (lease.unit, lease.token));
        self.tokens.extend(tokens);
    }

    /// Removes a lease that has ended. A later lease of the same pair stays.
    pub(crate) fn remove(&mut self, lease: &Lease) {
        if self.tokens.get(&lease.unit) == Some(&lease.token) {
            self.tokens.remove(&lease.unit);
        }
    }

    /// Returns the leases of a worker that this process has not received. Queries the server only for `SEARCH_TIME` after
    /// a reconnection or a failed claim.
    pub(crate) async fn unknown(&self, conn: &mut Conn, worker: WorkerId) -> Result<Vec<Lease>> {
        if !self.is_searching() {
            return Ok(Vec::new());
        }
        let mut leases = leases::<PairJob>(conn, worker).await?;
        leases.retain(|lease| self.tokens.get(&lease.unit) != Some(&lease.token));
        Ok(leases)
    }
}

/// Takes the lock of a worker until the end of the session. Returns `false` if another session holds it, such as a broken
/// connection of the same worker. `WORKER_LOCKS` in `lease_recovery.rs` has the same key.
const TRY_LOCK: &str = "
SELECT pg_try_advisory_lock(hashtext(current_setting('search_path')), CAST(?1 % 2147483648 AS integer))";

/// The lock of a worker, as far as its connection knows. It shows others that the worker is connected, and the server releases
/// it when the process dies. A lock that is free is only a hint: a connection may break while its worker lives.
#[derive(Debug, Default)]
struct WorkerLock {
    worker: Option<WorkerId>,
    is_held: bool,
}

impl WorkerLock {
    /// Sets the worker whose lock is taken from now on.
    fn set_worker(&mut self, worker: WorkerId) {
        if self.worker != Some(worker) {
            *self = Self {
                worker: Some(worker),
                is_held: false,
            };
        }
    }

    /// Records that the session has ended.
    const fn session_ended(&mut self) {
        self.is_held = false;
    }

    /// Takes the lock if it is not held. Otherwise, only finds out whether the connection works.
    async fn take(&mut self, conn: &mut Conn) -> Result<()> {
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
