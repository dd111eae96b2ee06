//! The write connection of a catalog. Before and after each commit, it checks whether another program deleted, replaced
//! or cut the write-ahead log.

use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;

use sqlx::Connection as _;

use crate::catalog::db::busy_retry::retry_while_busy;
use crate::catalog::db::conn::{Conn, Held};
use crate::catalog::db::dialect::Sql;
use crate::catalog::db::error::Result;
use crate::catalog::db::log_watch::LogWatch;
use crate::catalog::db::postgres::LOCK;
use crate::catalog::db::query::query;

/// Begins a transaction.
pub(crate) const BEGIN: Sql = Sql::pair("BEGIN IMMEDIATE", "BEGIN");

/// A future that borrows the write connection.
pub(crate) type Work<'c, T> = Pin<Box<dyn Future<Output = T> + Send + 'c>>;

/// The write connection, and for SQLite the log that its commits go to.
pub(crate) struct WriteConnection {
    pub(crate) conn: Conn,
    pub(crate) path: Arc<Path>,
    log: Option<LogWatch>,
}

impl WriteConnection {
    pub(crate) fn new(conn: Conn, path: Arc<Path>) -> Self {
        let log = match &conn {
            Conn::Sqlite(_) => Some(LogWatch::new(&path)),
            Conn::Postgres(_) => None,
        };
        Self { conn, path, log }
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
        let Self { conn, path, .. } = self;
        retry_while_busy!(path, begin(conn).await)?;
        let mut outcome = work(&mut *conn).await;
        if outcome.is_ok()
            && let Err(error) = execute(conn, "COMMIT").await
        {
            outcome = Err(error);
        }
        if outcome.is_err() {
            rollback(conn).await;
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
            Conn::Sqlite(Held::Owned(conn)) if is_lost => {
                std::mem::forget(conn);
                return;
            }
            Conn::Sqlite(Held::Owned(conn)) => conn.close().await,
            Conn::Postgres(Held::Owned(conn)) => conn.close().await,
            Conn::Sqlite(_) | Conn::Postgres(_) => return,
        };
        if let Err(error) = closed {
            tracing::warn!(%error, "the catalog did not close cleanly");
        }
    }
}

/// Begins a transaction that no other such transaction runs beside.
async fn begin(conn: &mut Conn) -> Result<()> {
    let is_sqlite = matches!(conn, Conn::Sqlite(_));
    execute(conn, BEGIN).await?;
    if is_sqlite {
        return Ok(());
    }
    execute(conn, LOCK).await
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
