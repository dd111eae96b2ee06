//! A connection to either database.

use std::ops::{Deref, DerefMut};
use std::pin::Pin;

use sqlx::pool::PoolConnection;
use sqlx::{Database, Postgres, Sqlite, Transaction};

/// A connection to a catalog.
pub(crate) enum Conn {
    Sqlite(ConnectionKind<Sqlite>),
    Postgres(ConnectionKind<Postgres>),
}

/// A connection that is owned or belongs to a pool. A snapshot ends when it is dropped.
pub(crate) enum ConnectionKind<D: Database> {
    Owned(D::Connection),
    Pooled(PoolConnection<D>),
    Snapshot(Transaction<'static, D>),
}

impl<D: Database> Deref for ConnectionKind<D> {
    type Target = D::Connection;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Owned(conn) => conn,
            Self::Pooled(conn) => conn,
            Self::Snapshot(conn) => conn,
        }
    }
}

impl<D: Database> DerefMut for ConnectionKind<D> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Owned(conn) => conn,
            Self::Pooled(conn) => conn,
            Self::Snapshot(conn) => conn,
        }
    }
}

/// A future that borrows a connection.
pub(crate) type Work<'c, T> = Pin<Box<dyn Future<Output = T> + Send + 'c>>;

#[cfg(test)]
impl Conn {
    /// Opens an empty SQLite database in memory.
    pub(crate) async fn in_memory() -> Self {
        let options = sqlx::sqlite::SqliteConnectOptions::new().in_memory(true);
        let conn = sqlx::ConnectOptions::connect(&options).await;
        Self::Sqlite(ConnectionKind::Owned(conn.expect("a database")))
    }
}
