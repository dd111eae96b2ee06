//! Where the catalogs of tests are: files, or schemas of a PostgreSQL server.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::db::conn::{Conn, ConnectionKind};
use crate::db::open;
use crate::db::postgres_address::PostgresAddress;
use crate::postgres_server;
use crate::queue::commit::writer::CommitDelay;
use crate::{Catalog, Result};

/// Where a catalog is.
#[derive(Debug)]
pub(crate) enum CatalogPlace {
    File {
        path: PathBuf,
        _dir: tempfile::TempDir,
    },
    Url(String),
}

impl CatalogPlace {
    /// Returns a place for a new catalog: in PostgreSQL in the module `tests_on_postgres`, if a server can be started.
    pub(super) fn new() -> Self {
        let wants_server = module_path!().contains("tests_on_postgres");
        match postgres_server::url().filter(|_| wants_server) {
            Some(url) => Self::in_new_schema(url),
            None => Self::in_new_file(),
        }
    }

    pub(crate) fn in_new_file() -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        Self::File {
            path: dir.path().join("catalog.sqlite"),
            _dir: dir,
        }
    }

    fn in_new_schema(url: &str) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let (process, next) = (std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        Self::Url(format!(
            "{url}&options=-c%20search_path%3Dt{process}_{next}"
        ))
    }

    pub(super) async fn create(&self) -> Result<Catalog> {
        match self {
            Self::File { path, .. } => Catalog::create(path).await,
            Self::Url(url) => Catalog::connect_or_create(url).await,
        }
    }

    /// Opens the catalog once more.
    pub(super) async fn open(&self) -> Result<Catalog> {
        match self {
            Self::File { path, .. } => Catalog::with_writer(path, false, CommitDelay::new()).await,
            Self::Url(url) => Catalog::connect(url).await,
        }
    }

    pub(super) async fn open_read_only(&self) -> Result<Catalog> {
        match self {
            Self::File { path, .. } => Catalog::open_read_only(path).await,
            Self::Url(url) => Catalog::connect_read_only(url).await,
        }
    }

    /// Opens a connection of its own, for statements of a test.
    pub(crate) async fn conn(&self) -> Conn {
        match self {
            Self::File { path, .. } => {
                let conn = open::write_conn(path, false).await;
                Conn::Sqlite(ConnectionKind::Owned(conn.expect("a connection")))
            }
            Self::Url(url) => {
                let place = PostgresAddress::parse(url).expect("a place");
                let conn = place.connect().await;
                Conn::Postgres(ConnectionKind::Owned(conn.expect("a connection")))
            }
        }
    }
}
