//! The exit code and the message of an error.

use std::error::Error;
use std::path::{Path, PathBuf};

use super::exit::{ExitCode, Refusal};
use super::time_text::local;
use mocban_catalog::{CatalogError, CatalogErrorKind, LockOwner, LogLoss, lock_owner};
use mocban_config::ConfigError;
use mocban_export::FolderError;
use mocban_runner::RunError;
use mocban_store::{CATALOG_FILE, StorageError, StoreError, TargetLockError};
use mocban_system::platform;

/// Returns the exit code of an error.
pub fn exit_code(error: &anyhow::Error) -> ExitCode {
    let code = error.chain().find_map(code_of_cause);
    code.unwrap_or(ExitCode::Error)
}

fn code_of_cause(cause: &(dyn Error + 'static)) -> Option<ExitCode> {
    if let Some(refusal) = cause.downcast_ref::<Refusal>() {
        return Some(refusal.code());
    }
    if cause.is::<ConfigError>() {
        return Some(ExitCode::Usage);
    }
    if let Some(error) = cause.downcast_ref::<StorageError>() {
        return Some(if error.is_unavailable() {
            ExitCode::Error
        } else {
            ExitCode::Usage
        });
    }
    if let Some(TargetLockError::InUse { .. }) = cause.downcast_ref() {
        return Some(ExitCode::InUse);
    }
    if let Some(FolderError::NotAnExport(_) | FolderError::IsFile(_)) = cause.downcast_ref() {
        return Some(ExitCode::Usage);
    }
    match cause.downcast_ref() {
        Some(RunError::InUse(_)) => return Some(ExitCode::InUse),
        Some(RunError::OtherSettings(_) | RunError::OtherPlan(_) | RunError::Place(_)) => {
            return Some(ExitCode::Usage);
        }
        Some(RunError::NoSuchPair(_) | RunError::NoSuchBlock(_)) => {
            return Some(ExitCode::NothingSelected);
        }
        Some(_) | None => {}
    }
    match cause.downcast_ref() {
        Some(StoreError::NoProject(_)) => return Some(ExitCode::NoProject),
        Some(StoreError::NotAFolder(_) | StoreError::NotUtf8(_)) => return Some(ExitCode::Usage),
        Some(_) | None => {}
    }
    match cause.downcast_ref()? {
        CatalogError::Missing(_) => Some(ExitCode::NoProject),
        CatalogError::NetworkFileSystem { .. }
        | CatalogError::TransactionPooler(_)
        | CatalogError::MayNotCreateRoles(_)
        | CatalogError::MayNotReview(_)
        | CatalogError::OtherReviewer { .. }
        | CatalogError::NotEmpty(_)
        | CatalogError::SimilarName { .. }
        | CatalogError::SameFiles { .. }
        | CatalogError::ChangedFiles { .. }
        | CatalogError::SameCatalog(_)
        | CatalogError::FinishedCopy { .. } => Some(ExitCode::Usage),
        error if error.is_of_pooler() => Some(ExitCode::Usage),
        error if error.is_of_server() && error.kind() == Some(CatalogErrorKind::ReadOnly) => {
            Some(ExitCode::Usage)
        }
        CatalogError::Corrupt(_) | CatalogError::Json(_) | CatalogError::ForeignSchema { .. } => {
            Some(ExitCode::Damaged)
        }
        error if error.log_loss().is_some() => Some(ExitCode::Damaged),
        CatalogError::UnknownPair(_)
        | CatalogError::NoResult(_)
        | CatalogError::NoMetricResult(..)
        | CatalogError::NothingToUndo(_) => Some(ExitCode::NothingSelected),
        _ => None,
    }
}

/// Context of an error that names the project folder of its catalog, if that is not the folder of the command.
#[derive(Debug)]
pub struct ErrorPlace {
    dir: PathBuf,
    text: String,
}

impl ErrorPlace {
    /// Makes the context of an error of a catalog in a folder. The text precedes errors without an explanation.
    pub fn new(dir: impl Into<PathBuf>, text: String) -> Self {
        let dir = dir.into();
        Self { dir, text }
    }
}

impl std::fmt::Display for ErrorPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

/// Returns the message for an error: the explanation of a catalog error, or otherwise the chain of causes.
pub fn describe(error: &anyhow::Error, project: &Path) -> String {
    if is_out_of_files(error) {
        return format!(
            "this process may open only {} files at a time; raise the limit with `ulimit -n 256` and try again",
            platform::max_open_files()
        );
    }
    let place = error.downcast_ref::<ErrorPlace>();
    let project = place.map_or(project, |place| &place.dir);
    let explained = catalog_error(error).and_then(|found| explain_catalog(found, project));
    let text = explained.unwrap_or_else(|| {
        let mut text = join_causes(error);
        if is_disk_full(error) {
            text += "; ";
            text += FREE_SPACE;
        }
        text
    });
    without_error_numbers(&text)
}

/// Returns the sentence that explains an error of the catalog.
pub fn catalog_text(error: &CatalogError, project: &Path) -> String {
    let explained = explain_catalog(error, project);
    without_error_numbers(&explained.unwrap_or_else(|| error.to_string()))
}

/// Removes the numbers that the standard library adds to the system's messages, such as `(os error 2)`.
pub fn without_error_numbers(text: &str) -> String {
    const START: &str = " (os error ";
    let mut parts = text.split(START);
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let rest = part.trim_start_matches(|c: char| c.is_ascii_digit());
        match rest.strip_prefix(')') {
            Some(rest) if rest.len() + 1 < part.len() => plain += rest,
            _ => plain.extend([START, part]),
        }
    }
    plain
}

/// What to do when a disk is full.
const FREE_SPACE: &str = "free some space and try again, everything stored so far is safe";

/// Returns whether a command failed because a disk or a quota is full.
fn is_disk_full(error: &anyhow::Error) -> bool {
    use std::io::ErrorKind::{QuotaExceeded, StorageFull};
    error.chain().any(|cause| {
        let system_error = cause.downcast_ref::<std::io::Error>();
        system_error.is_some_and(|error| matches!(error.kind(), StorageFull | QuotaExceeded))
    })
}

/// Most files that a command needs open at the same time, rounded up.
const FILES_NEEDED: u64 = 64;

/// Returns whether a command failed because its limit of open files is reached. `SQLite` does not say why it cannot
/// open a file. In that case, a limit below `FILES_NEEDED` counts as the reason.
fn is_out_of_files(error: &anyhow::Error) -> bool {
    let mut system_errors = error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>());
    if system_errors.any(platform::is_out_of_files) {
        return true;
    }
    let is_unopened = catalog_error(error).is_some_and(|error| {
        use CatalogErrorKind::{CannotOpen, ReadOnly};
        matches!(error, CatalogError::NotWritable(_))
            || matches!(error.kind(), Some(CannotOpen | ReadOnly))
    });
    is_unopened && platform::max_open_files() < FILES_NEEDED
}

/// Joins the chain of causes. A cause that the text already quotes is left out.
fn join_causes(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let part = cause.to_string();
        if text.is_empty() {
            text = part;
        } else if !text.contains(&part) {
            text = format!("{text}: {part}");
        }
    }
    text
}

/// Returns whether the reader of the output closed it, as in `mocban report | head`. This is not a failure.
pub fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<std::io::Error>()
            .is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
    })
}

/// Returns whether another process runs the project.
pub fn is_run_in_use(error: &anyhow::Error) -> bool {
    let is_target = <dyn Error>::is::<TargetLockError>;
    exit_code(error) == ExitCode::InUse && !error.chain().any(is_target)
}

/// Returns the first error of the catalog in a chain of causes.
pub fn catalog_error(error: &anyhow::Error) -> Option<&CatalogError> {
    error.chain().find_map(|cause| cause.downcast_ref())
}

/// Returns whether the catalog's file or folder cannot be written to.
pub fn is_not_writable(error: &anyhow::Error) -> bool {
    use CatalogErrorKind::{CannotOpen, Full, ReadOnly};
    catalog_error(error).is_some_and(|error| {
        matches!(error, CatalogError::NotWritable(_))
            || !error.is_of_server() && matches!(error.kind(), Some(CannotOpen | Full | ReadOnly))
    })
}

/// Returns whether the catalog's content is damaged, empty or not a catalog.
pub fn is_damage(error: &CatalogError) -> bool {
    use CatalogError::{Corrupt, Empty, Foreign, ForeignSchema, Json};
    matches!(
        error,
        Empty(_) | Foreign { .. } | ForeignSchema { .. } | Corrupt(_) | Json(_)
    ) || is_damaged_file(error)
}

/// Returns whether the pages of the catalog's file are inconsistent.
pub fn is_damaged_file(error: &CatalogError) -> bool {
    matches!(error, CatalogError::Damaged(_))
        || matches!(
            error.kind(),
            Some(CatalogErrorKind::Damaged | CatalogErrorKind::NotADatabase)
        )
}

/// Returns the path of the catalog's file as messages show it.
pub fn catalog_path(project: &Path) -> String {
    project.join(CATALOG_FILE).display().to_string()
}

/// Explains a catalog error: names the file and what the user can do. Returns `None` if the error's own message already
/// explains it.
pub fn explain_catalog(error: &CatalogError, project: &Path) -> Option<String> {
    let path = if error.is_of_server() {
        "the catalog in PostgreSQL".to_owned()
    } else {
        catalog_path(project)
    };
    if let Some(loss) = error.log_loss() {
        return Some(log_lost(&path, loss));
    }
    if let Some(reason) = error.refused_connection() {
        return Some(format!(
            "the database server of the catalog refused the connection: {reason}"
        ));
    }
    if error.is_of_pooler() {
        return Some(
            "a connection pooler such as PgBouncer changes the connection between transactions; set pool_mode = session there, or connect to PostgreSQL directly".to_owned(),
        );
    }
    let kind = match error.kind() {
        // SQLite does not say why it could not create or write one of its files.
        Some(CatalogErrorKind::CannotOpen | CatalogErrorKind::Disk)
            if !error.is_of_server() && platform::is_disk_full(project) =>
        {
            Some(CatalogErrorKind::Full)
        }
        kind => kind,
    };
    Some(match kind {
        Some(CatalogErrorKind::Damaged | CatalogErrorKind::NotADatabase) => {
            CatalogError::Damaged(path.into()).to_string()
        }
        Some(CatalogErrorKind::ReadOnly) if error.is_of_server() => format!(
            "the user of the database may not do this ({}); connect as a user with more rights, or ask the administrator for another role of the catalog",
            root_cause(error)
        ),
        Some(CatalogErrorKind::ReadOnly | CatalogErrorKind::CannotOpen) => {
            CatalogError::NotWritable(path.into()).to_string()
        }
        Some(CatalogErrorKind::Full) if error.is_of_server() => format!(
            "{path} cannot grow because the disk of the database server is full; {FREE_SPACE}"
        ),
        Some(CatalogErrorKind::Full) => {
            format!("{path} cannot grow because the disk is full; {FREE_SPACE}")
        }
        Some(CatalogErrorKind::Busy) => locked(&path, lock_owner(Path::new(&path))),
        Some(CatalogErrorKind::Disk) => format!(
            "{path}: the disk reported an error ({}), or another program changed the catalog's files; check the disk, then run `check`",
            root_cause(error)
        ),
        Some(CatalogErrorKind::Unavailable)
            if matches!(error, CatalogError::NotConnected { .. }) =>
        {
            return None;
        }
        Some(CatalogErrorKind::Unavailable) => format!(
            "the database server of the catalog is unavailable ({}); check that it runs, and start the command again: nothing stored is lost",
            root_cause(error)
        ),
        Some(CatalogErrorKind::Contradiction) => format!(
            "{path} contains rows or counters that contradict each other; `check` lists them, `check --repair` repairs them"
        ),
        Some(CatalogErrorKind::Statement) | None => match error {
            CatalogError::Corrupt(_) | CatalogError::Json(_) => {
                // Without this file, the catalog is on a server.
                let is_file = project.join(CATALOG_FILE).exists();
                let path = if is_file { &*path } else { "the catalog" };
                format!("{path} contains an invalid value: {error}; `check` gives details")
            }
            _ => return None,
        },
    })
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

    use super::without_error_numbers;
    use super::{ExitCode, Refusal};
    use super::{catalog_error, exit_code, explain_catalog, is_damage, join_causes, locked};
    use mocban_catalog::{CatalogError, LockOwner};
    use mocban_export::ExportError;

    #[test]
    fn refusal_keeps_its_code_under_context() {
        let error =
            anyhow::Error::new(Refusal::NothingSelected("no pair".to_owned())).context("run");
        assert_eq!(exit_code(&error), ExitCode::NothingSelected);
        assert_eq!(join_causes(&error), "run: no pair");
    }

    #[test]
    fn numbers_of_system_errors_are_not_shown() {
        for (text, plain) in [
            (
                "a: No such file (os error 2); b (os error 13)",
                "a: No such file; b",
            ),
            (
                "a (os error ) and b (os error x",
                "a (os error ) and b (os error x",
            ),
            ("a", "a"),
        ] {
            assert_eq!(without_error_numbers(text), plain);
        }
    }

    #[test]
    fn quoted_cause_is_not_repeated() {
        let io = std::io::Error::other("disk on fire");
        let error = anyhow::Error::new(io).context("a.png: disk on fire");
        assert_eq!(join_causes(&error), "a.png: disk on fire");
    }

    #[cfg(unix)]
    #[test]
    fn full_disk_or_quota_is_explained() {
        use super::describe;
        use rustix::io::Errno;
        for code in [Errno::NOSPC, Errno::DQUOT, Errno::IO] {
            let io = std::io::Error::from_raw_os_error(code.raw_os_error());
            let text = describe(&anyhow::Error::new(io).context("a.png"), Path::new("p"));
            assert!(text.starts_with("a.png: "), "{text}");
            let says_safe = text.ends_with("everything stored so far is safe");
            assert_eq!(says_safe, code != Errno::IO, "{text}");
        }
    }

    #[test]
    fn wrapped_catalog_error_is_found_and_explained() {
        let error = CatalogError::Corrupt("stage 9 is unknown".into());
        let error = anyhow::Error::new(ExportError::Catalog(error));
        let found = catalog_error(&error).expect("the catalog's error");
        assert_eq!(join_causes(&error), found.to_string());
        assert!(is_damage(found));
        let dir = tempfile::tempdir().expect("a temporary directory");
        let text = explain_catalog(found, dir.path()).expect("a sentence");
        assert!(text.starts_with("the catalog contains"), "{text}");
        std::fs::write(dir.path().join("catalog.sqlite"), "").expect("written");
        let text = explain_catalog(found, dir.path()).expect("a sentence");
        assert!(
            text.contains("catalog.sqlite contains") && text.contains("`check`"),
            "{text}"
        );
        let plain = CatalogError::Missing("p/catalog.sqlite".into());
        assert_eq!(explain_catalog(&plain, Path::new("p")), None);
        assert!(!is_damage(&plain));
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
