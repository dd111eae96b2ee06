//! Opens a catalog in a PostgreSQL database.

use std::time::Duration;

use sqlx::postgres::{PgPool, PgPoolOptions};
use sqlx::{ConnectOptions as _, Connection as _, PgConnection, Row as _};

use crate::db::error::{CatalogError, Result};
use crate::db::error_kind::{CatalogErrorKind, connection_error};
use crate::db::open::SCHEMA_VERSION;
use crate::db::postgres_address::PostgresAddress;
use crate::db::query::limited;
use mocban_system::failpoint;
use mocban_system::platform::timeout_active;

/// Oldest supported major version of the server.
const OLDEST_SERVER: u32 = 15;
/// Read connections per process.
const READERS: u32 = 2;
/// Other clients of a pooler may take the process in between, so it is asked for several times.
const POOLER_ROUNDS: u32 = 3;
/// Longest time for one connection attempt.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// Settings of every connection. They are statements instead of parameters of the connection, because `PgBouncer` refuses
/// such parameters or ignores them. Compiling a plan (`jit`) takes longer than running most of our statements.
const SETTINGS: &str = "SET standard_conforming_strings = on;
SET default_transaction_isolation = 'read committed';
SET idle_in_transaction_session_timeout = '60s';
SET client_min_messages = warning;
SET jit = off;";
/// Settings of the write connection, for group commits. Each of their statements finds a few rows of large tables by an
/// index. The planner would read whole tables instead while it has no statistics about them, as after an import. The
/// plans do not depend on the parameters.
const BY_INDEX: &str = "SET plan_cache_mode = force_generic_plan;
SET enable_bitmapscan = off;
SET enable_hashjoin = off;
SET enable_mergejoin = off;
SET enable_seqscan = off;";
/// Setting of the read connections.
const READ_ONLY: &str = "SET default_transaction_read_only = on;";
/// Returns the server process that serves a connection.
const SERVER_PROCESS: &str = "SELECT pg_backend_pid()";

/// The statements that create the schema.
const CREATE: &str = include_str!("../../../../migrations/postgres/0001_initial.sql");

impl PostgresAddress {
    /// Opens a connection for writing.
    ///
    /// # Errors
    /// Returns an error if the server does not answer or refuses, if a connection pooler pools by transaction, or if the
    /// schema is missing or has another version.
    pub(crate) async fn connect(&self) -> Result<PgConnection> {
        let mut conn = self.connect_to_own_process().await?;
        self.configure(&mut conn, BY_INDEX).await?;
        self.require_current(&mut conn).await?;
        Ok(conn)
    }

    /// Opens a connection for writing. Creates a missing schema.
    ///
    /// # Errors
    /// As for [`Self::connect`].
    pub(crate) async fn connect_or_create(&self) -> Result<PgConnection> {
        let mut conn = self.connect_to_own_process().await?;
        self.configure(&mut conn, BY_INDEX).await?;
        if self.version(&mut conn).await?.is_none() {
            self.create_schema(&mut conn).await?;
        }
        self.require_current(&mut conn).await?;
        Ok(conn)
    }

    /// Opens the write connection again.
    ///
    /// # Errors
    /// As for [`Self::connect`], except that it asks for no pooler.
    pub(crate) async fn reconnect(&self) -> Result<PgConnection> {
        let mut conn = self.connect_unconfigured().await?;
        self.configure(&mut conn, BY_INDEX).await?;
        self.require_current(&mut conn).await?;
        Ok(conn)
    }

    /// Opens read connections. `asks_for_pooler` must be set if this process has no write connection.
    ///
    /// # Errors
    /// As for [`Self::connect`].
    pub(crate) async fn reader_pool(&self, asks_for_pooler: bool) -> Result<PgPool> {
        let mut conn = if asks_for_pooler {
            self.connect_to_own_process().await?
        } else {
            self.connect_unconfigured().await?
        };
        self.configure(&mut conn, READ_ONLY).await?;
        self.require_current(&mut conn).await?;
        conn.close().await?;
        let settings = self.settings(READ_ONLY);
        let pool = PgPoolOptions::new()
            .max_connections(READERS)
            .acquire_timeout(connect_timeout())
            .after_connect(move |conn, _| {
                let settings = settings.clone();
                Box::pin(async move { run_settings(conn, settings).await })
            });
        Ok(pool.connect_lazy_with(self.options.clone()))
    }

    /// Opens a connection, and checks that it keeps its server process to itself while it is idle. A pooler by transaction
    /// gives this process to the next statement of another connection. Therefore nothing is configured before the check.
    ///
    /// # Errors
    /// Returns an error if the process is shared, or if the server does not answer or refuses.
    async fn connect_to_own_process(&self) -> Result<PgConnection> {
        let mut conn = self.connect_unconfigured().await?;
        let mut other = self.connect_unconfigured().await?;
        // A pooler without a free connection to the server answers late.
        let is_kept = timeout_active(connect_timeout(), keep_processes(&mut conn, &mut other))
            .await
            .unwrap_or_else(|| Err(timed_out()))
            .map_err(|error| self.not_connected(&error))?;
        other.close().await?;
        if is_kept {
            return Ok(conn);
        }
        Err(CatalogError::TransactionPooler(self.text()))
    }

    /// Opens a connection, whether or not the database has a catalog.
    ///
    /// # Errors
    /// Returns an error if the server does not answer or refuses, or if a connection pooler pools by transaction.
    pub(crate) async fn connect_to_database(&self) -> Result<PgConnection> {
        let mut conn = self.connect_to_own_process().await?;
        self.configure(&mut conn, "").await?;
        Ok(conn)
    }

    /// Returns the statements that configure a connection.
    fn settings(&self, more: &str) -> String {
        // Lower-case letters, digits and `_` only.
        let schema = &self.schema;
        format!("SET search_path = {schema};\n{SETTINGS}\n{more}")
    }

    /// Sets the settings of every connection, and these.
    async fn configure(&self, conn: &mut PgConnection, settings: &str) -> Result<()> {
        let configuring = run_settings(conn, self.settings(settings));
        let configured = timeout_active(connect_timeout(), configuring).await;
        configured
            .unwrap_or_else(|| Err(timed_out()))
            .map_err(|error| self.not_connected(&error))
    }

    /// Opens a connection with the settings of the server.
    async fn connect_unconfigured(&self) -> Result<PgConnection> {
        let connected = timeout_active(connect_timeout(), self.options.connect()).await;
        let conn = connected
            .unwrap_or_else(|| Err(timed_out()))
            .map_err(|error| self.not_connected(&error))?;
        let version = conn.server_version_num().unwrap_or(0) / 10_000;
        if version < OLDEST_SERVER {
            return Err(CatalogError::NotConnected {
                address: self.text(),
                reason: format!("it is PostgreSQL {version}; {OLDEST_SERVER} or later is needed"),
                is_unavailable: false,
            });
        }
        Ok(conn)
    }

    /// Returns the error of a server that does not reply.
    pub(crate) fn no_reply(&self) -> CatalogError {
        CatalogError::NotConnected {
            address: self.text(),
            reason: "no reply".to_owned(),
            is_unavailable: true,
        }
    }

    fn not_connected(&self, error: &sqlx::Error) -> CatalogError {
        CatalogError::NotConnected {
            address: self.text(),
            reason: connection_error(error),
            is_unavailable: CatalogErrorKind::of(error) == Some(CatalogErrorKind::Unavailable),
        }
    }

    /// Returns the version of the schema, or `None` if there is no catalog.
    async fn version(&self, conn: &mut PgConnection) -> Result<Option<i64>> {
        let exists = "SELECT to_regclass($1 || '.catalog_version') IS NOT NULL";
        let exists = sqlx::query_scalar(exists)
            .bind(&self.schema)
            .fetch_one(&mut *conn);
        let exists: bool = limited(exists).await?;
        if !exists {
            return Ok(None);
        }
        let version = sqlx::query_scalar("SELECT version FROM catalog_version");
        Ok(limited(version.fetch_optional(conn)).await?)
    }

    /// # Errors
    /// Returns an error if there is no catalog, or if it has another version.
    pub(crate) async fn require_current(&self, conn: &mut PgConnection) -> Result<()> {
        match self.version(conn).await? {
            None => Err(CatalogError::NoSchema(self.text())),
            Some(SCHEMA_VERSION) => Ok(()),
            Some(found) => Err(CatalogError::OtherVersion {
                path: self.text().into(),
                found,
                known: SCHEMA_VERSION,
            }),
        }
    }

    /// Creates the schema. Other processes see the whole schema or none of it.
    async fn create_schema(&self, conn: &mut PgConnection) -> Result<()> {
        let mut transaction = conn.begin().await?;
        self.create_schema_in(&mut transaction).await?;
        Ok(transaction.commit().await?)
    }

    /// Creates the schema in the open transaction, and takes the lock of the catalog. Returns `false` if the schema exists.
    pub(crate) async fn create_schema_in(&self, conn: &mut PgConnection) -> Result<bool> {
        sqlx::query(LOCK).execute(&mut *conn).await?;
        // Another process may have created it before the lock was free.
        if self.version(conn).await?.is_some() {
            return Ok(false);
        }
        // Lower-case letters, digits and `_` only.
        let create = format!("CREATE SCHEMA IF NOT EXISTS {}", self.schema);
        sqlx::raw_sql(sqlx::AssertSqlSafe(create))
            .execute(&mut *conn)
            .await?;
        sqlx::raw_sql(CREATE).execute(conn).await?;
        Ok(true)
    }
}

/// Returns the longest time for one connection attempt, which tests can change.
fn connect_timeout() -> Duration {
    CONNECT_TIMEOUT * failpoint::time_scale("MOCBAN_CONNECT_FACTOR")
}

/// Returns the error of a connection attempt that took too long.
fn timed_out() -> sqlx::Error {
    sqlx::Error::Io(std::io::Error::from(std::io::ErrorKind::TimedOut))
}

/// Runs statements that configure a connection.
async fn run_settings(conn: &mut PgConnection, settings: String) -> sqlx::Result<()> {
    let statements = sqlx::raw_sql(sqlx::AssertSqlSafe(settings));
    statements.execute(conn).await.map(drop)
}

/// Returns whether each of two connections keeps a server process of its own.
async fn keep_processes(one: &mut PgConnection, other: &mut PgConnection) -> sqlx::Result<bool> {
    let (first, second) = (server_process(one).await?, server_process(other).await?);
    let mut is_kept = first != second;
    for _ in 0..POOLER_ROUNDS {
        // Twice, because a pooler may hand out two idle processes by turns.
        is_kept &= server_process(one).await? == first;
        is_kept &= server_process(one).await? == first;
        is_kept &= server_process(other).await? == second;
    }
    Ok(is_kept)
}

/// Returns the server process that serves a connection. Prepares no statement, which a pooler could refuse.
async fn server_process(conn: &mut PgConnection) -> sqlx::Result<i32> {
    let row = sqlx::raw_sql(SERVER_PROCESS).fetch_one(conn).await?;
    row.try_get(0)
}

/// Takes the lock of a catalog until the end of the transaction. All writes except group commits take it, so that they
/// run one after another, as in SQLite.
pub(crate) const LOCK: &str =
    "SELECT pg_advisory_xact_lock(hashtextextended(current_setting('search_path'), 1836016482))";

/// Takes the lock of a catalog, and permits all plans until the end of the transaction.
pub(crate) const LOCK_FOR_ANY_PLAN: &str = "
SELECT set_config(name, 'on', true) FROM (VALUES ('enable_bitmapscan'), ('enable_hashjoin'), ('enable_mergejoin'),
    ('enable_seqscan')) AS setting (name)
UNION ALL SELECT set_config('plan_cache_mode', 'auto', true)
UNION ALL SELECT CAST(pg_advisory_xact_lock(hashtextextended(current_setting('search_path'), 1836016482)) AS text)";
