//! Notices that another program deleted, replaced or cut the write-ahead log of an open catalog.
//!
//! SQLite does not notice this: the commits that follow go to a file without a name, or leave a hole in the log. The
//! functions here never open the log, and compare only its identity and length.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use sqlx::SqliteConnection;

use crate::db::error::{CatalogError, LogLoss, Result};
use crate::db::error_kind::CatalogErrorKind;
use crate::db::lock_owner::sidecar;
use mocban_core::domain::UnixMillis;
use mocban_system::platform::{FileId, stat};

/// Length of the log's header in bytes.
const LOG_HEADER: u64 = 32;
/// Length of the header of a frame in bytes. A frame holds one page.
const FRAME_HEADER: u64 = 24;
/// Result of a checkpoint: 1 if it was blocked, else 0; the pages in the log; the pages copied to the main file.
type LogState = (i64, i64, i64);

/// The log of the open write connection.
#[derive(Debug)]
pub(crate) struct LogWatch {
    catalog: WatchedFile,
    log: WatchedFile,
    /// Length of the log after the last commit, in bytes.
    length: u64,
    /// All commits before this time are in the catalog's main file.
    saved_until: UnixMillis,
    loss: Option<LogLoss>,
}

/// Path of a file, with its identity, or `None` if this could not be read.
#[derive(Debug)]
struct WatchedFile {
    path: PathBuf,
    id: Option<FileId>,
}

/// How a file compares with its earlier state.
enum FileState {
    /// The same file, with its length in bytes.
    Same(u64),
    Gone,
    /// The system does not say.
    Unknown,
}

impl WatchedFile {
    fn of(path: PathBuf) -> Self {
        let id = stat(&path).ok().map(|found| found.id);
        Self { path, id }
    }

    fn state(&self) -> FileState {
        match stat(&self.path) {
            Ok(found) if self.id.is_none_or(|id| id == found.id) => FileState::Same(found.len),
            Ok(_) => FileState::Gone,
            Err(error) if error.kind() == ErrorKind::NotFound && self.id.is_some() => {
                FileState::Gone
            }
            Err(_) => FileState::Unknown,
        }
    }
}

impl LogWatch {
    /// Notes the log of a catalog that has just been opened for writing.
    pub(crate) fn new(catalog: &Path) -> Self {
        let log = WatchedFile::of(sidecar(catalog, "-wal"));
        let length = match log.state() {
            FileState::Same(length) => length,
            FileState::Gone | FileState::Unknown => 0,
        };
        Self {
            catalog: WatchedFile::of(catalog.to_owned()),
            log,
            length,
            saved_until: now(),
            loss: None,
        }
    }

    /// Returns whether the log was found deleted, replaced or cut.
    pub(crate) const fn is_lost(&self) -> bool {
        self.loss.is_some()
    }

    /// Compares the log with its state after the last commit. Must be called outside of a transaction, before a commit
    /// begins and after it. While the log is the same file and not shorter, this costs one `stat` call.
    ///
    /// # Errors
    /// Returns an error if the log was deleted or replaced, or is too short for its pages. Later calls return the same
    /// error.
    pub(crate) async fn check(&mut self, conn: &mut SqliteConnection) -> Result<()> {
        if self.loss.is_none() {
            self.loss = self.find_loss(conn).await;
        }
        let Some(loss) = self.loss else {
            return Ok(());
        };
        let log = self.log.path.clone();
        Err(CatalogError::LogLost { log, loss })
    }

    async fn find_loss(&mut self, conn: &mut SqliteConnection) -> Option<LogLoss> {
        let since = LogLoss::Since(self.saved_until);
        match self.log.state() {
            FileState::Same(length) if length >= self.length => {
                self.length = length;
                None
            }
            FileState::Same(length) => {
                let is_cut = is_cut(conn, &self.log).await;
                self.length = length;
                is_cut.then_some(since)
            }
            FileState::Unknown => None,
            // A renamed or removed project is noticed where artifacts are written.
            FileState::Gone if matches!(self.catalog.state(), FileState::Gone) => None,
            // The connection still has the old log open, and can copy its content to the catalog.
            FileState::Gone => {
                let copied = checkpoint(conn, "PRAGMA wal_checkpoint(TRUNCATE)").await;
                let is_whole = matches!(copied, Ok((0, log, saved)) if log == saved);
                // SQLite would apply the content of another log at this path when it opens the catalog next.
                let is_clear =
                    std::fs::metadata(&self.log.path).map_or(true, |other| other.len() == 0);
                Some(if is_whole && is_clear {
                    LogLoss::Nothing
                } else {
                    since
                })
            }
        }
    }

    /// Copies the log to the main file, unless the log is lost. If a reader prevents it, a later call copies the rest.
    pub(crate) async fn checkpoint(&mut self, conn: &mut SqliteConnection, pragma: &'static str) {
        if self.check(conn).await.is_err() {
            return;
        }
        let begin = now();
        match checkpoint(conn, pragma).await {
            Ok((0, log, saved)) if log == saved => self.saved_until = begin,
            Ok(_) => {}
            Err(error) => tracing::debug!(%error, "the write-ahead log was not checkpointed"),
        }
        // A complete checkpoint may have cut the log, which is no loss.
        if let FileState::Same(length) = self.log.state() {
            self.length = length;
        }
    }
}

async fn checkpoint(conn: &mut SqliteConnection, pragma: &'static str) -> Result<LogState> {
    Ok(sqlx::query_as(pragma).fetch_one(conn).await?)
}

/// Returns whether a log that became shorter is too short for the pages that SQLite's index lists, or cannot be read any
/// more. Another process may have emptied the log properly, and then the index lists fewer pages.
async fn is_cut(conn: &mut SqliteConnection, log: &WatchedFile) -> bool {
    let page_bytes = sqlx::query_scalar::<_, i64>("PRAGMA page_size");
    let page_bytes = match page_bytes.fetch_one(&mut *conn).await {
        Ok(page_bytes) => page_bytes,
        Err(error) => return is_damage(&error.into()),
    };
    let noop = "PRAGMA wal_checkpoint(NOOP)";
    // The number of pages may change while the length is read.
    loop {
        let pages = checkpoint(conn, noop).await;
        let state = log.state();
        let (pages, same) = match (pages, checkpoint(conn, noop).await) {
            (Ok((_, pages, _)), Ok((_, same, _))) => (pages, same),
            (Err(error), _) | (_, Err(error)) => return is_damage(&error),
        };
        if pages == same {
            let frames = u64::try_from(pages).unwrap_or(0);
            let needed = match frames {
                0 => 0,
                frames => LOG_HEADER + frames * (FRAME_HEADER + page_bytes.unsigned_abs()),
            };
            return matches!(state, FileState::Same(length) if length < needed);
        }
    }
}

/// Returns whether SQLite read pages that cannot be right.
fn is_damage(error: &CatalogError) -> bool {
    error.kind() == Some(CatalogErrorKind::Damaged)
}

fn now() -> UnixMillis {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_millis() as UnixMillis)
}
