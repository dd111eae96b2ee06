//! Checks the consistency of a project, and repairs it on request.

use std::fs::File;
use std::io;
use std::path::Path;

use crate::error::{ProjectError, ProjectResult, WithContext as _};
use crate::events::{Listener, LongWork, warn};
use crate::exit::Refusal;
use crate::location::{Location, now};
use crate::missing_inputs::{MissingInputs, missing_of_all_after_failures};
use mocban_catalog::{Catalog, CatalogError};
use mocban_core::domain::ErrorCode;
use mocban_runner::check::{CheckOptions, CheckSummary, Kind, check as check_project};
use mocban_runner::{RunError, is_running};
use mocban_store::{CATALOG_FILE, LockError, Project, RunLock};

/// Checks a project. Without `repair`, nothing is changed and a run may be active. A repair holds the run's lock.
///
/// # Errors
/// Returns an error if the catalog cannot be read, or if a repair is requested while another process works on the project.
pub async fn check(
    options: CheckOptions,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<CheckSummary> {
    let work = LongWork::begin(listener, "checking the catalog and the files");
    let mut checked = once(options, location).await;
    if is_database_damage(&checked) {
        // SQLite reports some disk read errors as damage. Check again, and then test whether the file can be read.
        checked = once(options, location).await;
    }
    drop(work);
    let path = location.dir.join(CATALOG_FILE);
    if is_database_damage(&checked) && !is_readable(&path) {
        return Err(CatalogError::Unread(path).into());
    }
    let summary = checked.map_err(|error| unreadable(error, location))?;
    if let Some(reason) = &summary.foreign_artifacts {
        warn(listener, reason);
    }
    Ok(summary)
}

/// Inspects the inputs of a project in which a check has found missing ones, and returns what a run says of them. Returns
/// `None` if the catalog cannot be read.
pub async fn missing_inputs(location: &Location) -> Option<MissingInputs> {
    let (project, catalog) = location.open_read_only().await.ok()?;
    let found = missing_of_all_after_failures(&project, &catalog).await;
    catalog.close().await;
    found.ok().flatten()
}

async fn once(options: CheckOptions, location: &Location) -> ProjectResult<CheckSummary> {
    // What removes files or names an owner needs a project that can be written to, and says so at once.
    let writes = options.repair || options.take_over || options.collect.is_some();
    let (project, catalog) = if writes {
        location.open().await?
    } else {
        location.open_read_only().await?
    };
    // The lock of a repair excludes other processes, except on a server.
    let asks = !options.repair || catalog.is_shared();
    let running = asks && is_running(&project, &catalog, now()).await?;
    let lock = if options.repair {
        exclusive_lock(&project, &catalog, running)
            .with_context(|| "nothing was repaired".to_owned())?
    } else {
        None
    };
    let options = CheckOptions {
        in_use: !options.repair && running,
        now: now(),
        ..options
    };
    let summary = check_project(&project, &catalog, options).await;
    catalog.close().await;
    drop(lock);
    Ok(summary?)
}

/// Returns whether the database itself is reported as damaged.
fn is_database_damage(checked: &ProjectResult<CheckSummary>) -> bool {
    match checked {
        Ok(summary) => summary.damage.contains_key(&Kind::Database) && summary.left() > 0,
        Err(error) => error.code() == ErrorCode::DamagedFile,
    }
}

/// Returns whether every byte of a file can be read.
fn is_readable(path: &Path) -> bool {
    let read = File::open(path).and_then(|mut file| io::copy(&mut file, &mut io::sink()));
    read.is_ok()
}

/// Takes the run's lock if no other process works on the project. A shared catalog has no such lock.
fn exclusive_lock(
    project: &Project,
    catalog: &Catalog,
    running: bool,
) -> Result<Option<RunLock>, RunError> {
    let in_use = || RunError::from(LockError::InUse { pid: None });
    if catalog.is_shared() {
        return if running { Err(in_use()) } else { Ok(None) };
    }
    let lock = RunLock::acquire(project, false)?;
    if lock.is_exclusive() {
        Ok(Some(lock))
    } else {
        Err(in_use())
    }
}

/// Returns the error of a catalog that cannot be opened, as damage if it is.
fn unreadable(error: ProjectError, location: &Location) -> ProjectError {
    let text = match error.code() {
        ErrorCode::Damaged | ErrorCode::NotACatalog => error.text(&location.dir),
        ErrorCode::DamagedFile => format!(
            "{} is too damaged to be read; replace it with a backup, then run `check --repair`",
            location.dir.join(CATALOG_FILE).display()
        ),
        _ => return error,
    };
    Refusal::Damaged(text).into()
}
