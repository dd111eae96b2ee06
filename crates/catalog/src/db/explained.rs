//! What an error of the catalog means for its user.

use std::error::Error;
use std::path::Path;

use super::error::{CatalogError, LogLoss};
use super::error_kind::CatalogErrorKind;
use super::lock_owner::{LockOwner, lock_owner};
use mocban_core::domain::{CATALOG_FILE, ErrorCode, Explained, FREE_SPACE, moved_away};
use mocban_system::platform;
use mocban_system::time_text::local;

impl Explained for CatalogError {
    fn code(&self) -> ErrorCode {
        match self {
            Self::Shared(error) => error.code(),
            Self::Missing(_) | Self::NoSchema(_) => ErrorCode::NoProject,
            Self::NetworkFileSystem { .. }
            | Self::TransactionPooler(_)
            | Self::NotEmpty(_)
            | Self::SimilarName { .. }
            | Self::SameFiles { .. }
            | Self::ChangedFiles { .. }
            | Self::SameCatalog(_)
            | Self::FinishedCopy { .. } => ErrorCode::Usage,
            Self::MayNotCreateRoles(_) | Self::MayNotReview(_) | Self::OtherReviewer { .. } => {
                ErrorCode::NotPermitted
            }
            Self::Empty(_) | Self::Foreign { .. } => ErrorCode::NotACatalog,
            Self::OtherVersion { .. } => ErrorCode::OtherVersion,
            Self::Corrupt(_) | Self::Json(_) | Self::ForeignSchema { .. } => ErrorCode::Damaged,
            Self::Damaged(_) => ErrorCode::DamagedFile,
            Self::NotWritable(_) => ErrorCode::NotWritable,
            Self::LogLost { .. } => ErrorCode::LogLost,
            Self::UnknownPair(_)
            | Self::NoResult(_)
            | Self::NoMetricResult(..)
            | Self::NothingToUndo(_) => ErrorCode::NothingSelected,
            error if error.is_of_pooler() => ErrorCode::Usage,
            error => error
                .kind()
                .map_or(ErrorCode::Unexpected, |kind| error.code_of(kind)),
        }
    }

    fn advice(&self, project: &Path) -> Option<String> {
        let path = if self.is_of_server() {
            "the catalog in PostgreSQL".to_owned()
        } else {
            project.join(CATALOG_FILE).display().to_string()
        };
        if let Some(loss) = self.log_loss() {
            return Some(log_lost(&path, loss));
        }
        if let Some(reason) = self.refused_connection() {
            return Some(format!(
                "the database server of the catalog refused the connection: {reason}"
            ));
        }
        if self.is_of_pooler() {
            return Some(
                "a connection pooler such as PgBouncer changes the connection between transactions; set pool_mode = session there, or connect to PostgreSQL directly".to_owned(),
            );
        }
        self.advice_on(&path, project)
    }
}

impl CatalogError {
    /// Returns the code of an error of the database.
    fn code_of(&self, kind: CatalogErrorKind) -> ErrorCode {
        match kind {
            CatalogErrorKind::Damaged | CatalogErrorKind::NotADatabase => ErrorCode::DamagedFile,
            CatalogErrorKind::ReadOnly if self.is_of_server() => ErrorCode::NotPermitted,
            CatalogErrorKind::ReadOnly | CatalogErrorKind::CannotOpen => ErrorCode::NotWritable,
            CatalogErrorKind::Full => ErrorCode::DiskFull,
            CatalogErrorKind::Busy => ErrorCode::Locked,
            CatalogErrorKind::Unavailable => ErrorCode::Unavailable,
            CatalogErrorKind::Disk
            | CatalogErrorKind::Contradiction
            | CatalogErrorKind::Statement => ErrorCode::Unexpected,
        }
    }

    /// Returns the advice on an error of the database, or on an invalid value in it. `path` is how messages name the catalog.
    fn advice_on(&self, path: &str, project: &Path) -> Option<String> {
        let kind = match self.kind() {
            // SQLite does not say why it could not create or write one of its files.
            Some(CatalogErrorKind::CannotOpen | CatalogErrorKind::Disk)
                if !self.is_of_server() && platform::is_disk_full(project) =>
            {
                Some(CatalogErrorKind::Full)
            }
            kind => kind,
        };
        Some(match kind {
            Some(CatalogErrorKind::Damaged | CatalogErrorKind::NotADatabase) => {
                Self::Damaged(path.into()).to_string()
            }
            Some(CatalogErrorKind::ReadOnly) if self.is_of_server() => format!(
                "the user of the database may not do this ({}); connect as a user with more rights, or ask the administrator for another role of the catalog",
                root_cause(self)
            ),
            // SQLite does not write to a file that was renamed.
            Some(CatalogErrorKind::ReadOnly)
                if matches!(project.join(CATALOG_FILE).try_exists(), Ok(false)) =>
            {
                moved_away(project)
            }
            Some(CatalogErrorKind::ReadOnly | CatalogErrorKind::CannotOpen) => {
                Self::NotWritable(path.into()).to_string()
            }
            Some(CatalogErrorKind::Full) if self.is_of_server() => format!(
                "{path} cannot grow because the disk of the database server is full; {FREE_SPACE}"
            ),
            Some(CatalogErrorKind::Full) => {
                format!("{path} cannot grow because the disk is full; {FREE_SPACE}")
            }
            Some(CatalogErrorKind::Busy) => locked(path, lock_owner(Path::new(path))),
            Some(CatalogErrorKind::Disk) => format!(
                "{path}: the disk reported an error ({}), or another program changed the catalog's files; check the disk, then run `check`",
                root_cause(self)
            ),
            Some(CatalogErrorKind::Unavailable) if matches!(self, Self::NotConnected { .. }) => {
                return None;
            }
            Some(CatalogErrorKind::Unavailable) => format!(
                "the database server of the catalog is unavailable ({}); check that it runs, and start the command again: nothing stored is lost",
                root_cause(self)
            ),
            Some(CatalogErrorKind::Contradiction) => format!(
                "{path} contains rows or counters that contradict each other; `check` lists them, `check --repair` repairs them"
            ),
            Some(CatalogErrorKind::Statement) | None => match self {
                Self::Corrupt(_) | Self::Json(_) => {
                    // Without this file, the catalog is on a server.
                    let is_file = project.join(CATALOG_FILE).exists();
                    let path = if is_file { path } else { "the catalog" };
                    format!("{path} contains an invalid value: {self}; `check` gives details")
                }
                _ => return None,
            },
        })
    }
}

fn log_lost(path: &str, loss: LogLoss) -> String {
    let what = format!("another program deleted, replaced or cut {path}-wal during this command");
    match loss {
        LogLoss::Nothing => format!(
            "{what}; nothing stored is lost, but no more can be stored: start the command again"
        ),
        LogLoss::Since(at) => format!(
            "{what}; results and verdicts stored since {} may be lost: `check` tells whether the catalog is whole, \
             `run` computes missing results again, a backup replaces a damaged catalog",
            local(at)
        ),
    }
}

fn locked(path: &str, owner: Option<LockOwner>) -> String {
    match owner {
        Some(owner) => format!(
            "{path} was locked by {owner} for too long; try again when that process has finished"
        ),
        None => format!("{path} was locked by another process for too long; try again"),
    }
}

fn root_cause(error: &CatalogError) -> String {
    let mut last: &dyn Error = error;
    while let Some(next) = last.source() {
        last = next;
    }
    last.to_string()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{CATALOG_FILE, CatalogError, ErrorCode, Explained as _, LockOwner, locked};

    #[cfg(unix)]
    #[tokio::test]
    async fn a_catalog_whose_folder_was_renamed_is_not_called_read_only() {
        use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
        use sqlx::{Connection as _, query};

        let dir = tempfile::tempdir().expect("a temporary directory");
        let [old, new] = ["old", "new"].map(|name| dir.path().join(name));
        std::fs::create_dir(&old).expect("a folder");
        let options = SqliteConnectOptions::new()
            .filename(old.join(CATALOG_FILE))
            .create_if_missing(true);
        let mut conn = SqliteConnection::connect_with(&options)
            .await
            .expect("a database");
        let created = query("CREATE TABLE t (a)").execute(&mut conn).await;
        created.expect("a table");
        std::fs::rename(&old, new).expect("renamed");
        let refused = query("INSERT INTO t VALUES (1)").execute(&mut conn).await;
        let error = CatalogError::from(refused.expect_err("another path"));
        let advice = error.advice(&old).expect("advice");
        let said = format!("{} was renamed, moved or removed", old.display());
        assert!(advice.starts_with(&said), "{error}: {advice}");
    }

    #[test]
    fn a_message_that_says_what_to_do_needs_no_advice() {
        let missing = CatalogError::Missing("p/catalog.sqlite".into());
        assert_eq!(missing.advice(Path::new("p")), None);
        assert_eq!(missing.code(), ErrorCode::NoProject);
        let empty = CatalogError::NoSchema("postgresql://server/empty".into());
        assert_eq!(empty.code(), ErrorCode::NoProject);
    }

    #[test]
    fn owner_of_the_lock_is_named_with_the_command_that_resumes_it() {
        let (pid, is_stopped) = (12, true);
        let text = locked("p/catalog.sqlite", Some(LockOwner { pid, is_stopped }));
        assert!(
            text.contains("pid 12, which is stopped") && text.contains("kill -CONT 12"),
            "{text}"
        );
        let is_stopped = false;
        let text = locked("p/catalog.sqlite", Some(LockOwner { pid, is_stopped }));
        assert!(
            text.contains("by pid 12 for too long") && !text.contains("CONT"),
            "{text}"
        );
    }
}
