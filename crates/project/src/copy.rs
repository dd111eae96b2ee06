//! Copies a catalog between a project folder and PostgreSQL.

use std::path::Path;

use crate::error::{ProjectError, ProjectResult};
use crate::events::{Listener, LongWork, warn};
use crate::exit::Refusal;
use crate::location::{Location, now, refuse_password, settings_of};
use crate::missing_inputs;
use crate::new_project::{check_new_folder, warn_about_name};
use mocban_catalog::{Catalog, CatalogCopy, CatalogError};
use mocban_core::domain::is_address;
use mocban_runner::is_running;
use mocban_store::{Project, SETTINGS_FILE};

/// Copies a catalog. Each place is a project folder or an address of PostgreSQL. Nothing is left of an interrupted copy.
///
/// # Errors
/// Returns an error if an address has a password, the settings of a folder name a catalog elsewhere, or the target holds
/// another catalog.
pub async fn copy(from: &str, to: &str, listener: &dyn Listener) -> ProjectResult<CatalogCopy> {
    // Before these addresses are part of any message.
    for place in [from, to] {
        if is_address(place) {
            refuse_password(place)?;
        } else {
            require_own_catalog(Path::new(place))?;
        }
    }
    let source = open(from, listener).await;
    let source = source.map_err(|error| of_source(error, from))?;
    if !is_address(to) {
        warn_about_name(Path::new(to), listener);
    }
    let work = LongWork::begin(listener, "copying the catalog");
    let copied = write(&source, from, to).await;
    drop(work);
    source.close().await;
    if copied.is_ok() && !is_address(to) {
        warn_about_inputs(to, listener).await;
    }
    copied
}

/// Warns about input files that a copy in a project folder lacks, such as those below the folder of the original.
async fn warn_about_inputs(dir: &str, listener: &dyn Listener) {
    // The copy is there already, so what cannot be looked up is no error.
    let find = async {
        let (storage, _) = Location::new(dir).data_locations()?;
        let project = Project::open(Path::new(dir))?.with_storage(storage);
        let catalog = Catalog::open_read_only(&project.catalog_path()).await?;
        let found = missing_inputs::missing_of_all(&project, &catalog).await;
        catalog.close().await;
        found
    };
    if let Ok(Some(missing)) = find.await {
        let found = missing.found();
        warn(listener, format!("{found}; put them there as well"));
    }
}

fn of_source(error: impl Into<ProjectError>, from: &str) -> ProjectError {
    let error = error.into().context(format!("cannot copy {from}"));
    error.of_project(from)
}

fn of_target(error: impl Into<ProjectError>, to: &str) -> ProjectError {
    let error = error.into().context(format!("cannot copy to {to}"));
    error.of_project(to)
}

/// Opens the catalog of a project folder or an address for reading. Warns if a run is active.
async fn open(place: &str, listener: &dyn Listener) -> ProjectResult<Catalog> {
    let (catalog, is_running) = if is_address(place) {
        let catalog = Catalog::connect_read_only(place).await?;
        let workers = catalog.active_workers(now()).await?;
        (catalog, workers > 0)
    } else {
        let project = Project::open(Path::new(place))?;
        let catalog = Catalog::open_read_only(&project.catalog_path()).await?;
        let is_running = is_running(&project, &catalog, now()).await?;
        (catalog, is_running)
    };
    if is_running {
        warn(
            listener,
            format!(
                "a run is active on {place}: the copy has what is stored now, and not what the run stores from now on"
            ),
        );
    }
    Ok(catalog)
}

/// Copies the catalog to a project folder or an address, and creates what is missing there.
async fn write(source: &Catalog, from: &str, to: &str) -> ProjectResult<CatalogCopy> {
    let progress = |table, rows| tracing::info!(table, rows, "copied");
    let failed = |error| match error {
        CatalogError::Original(error) => of_source(*error, from),
        error => of_target(error, to),
    };
    if is_address(to) {
        return source.copy_to_server(to, progress).await.map_err(failed);
    }
    let dir = Path::new(to);
    check_new_folder(dir)?;
    let existed = dir.exists();
    let project = Project::create(dir).map_err(|error| of_target(error, to))?;
    let copied = source.copy_to_file(&project.catalog_path(), progress).await;
    if copied.is_err() && !existed {
        // Fails unless the directory is empty.
        let _ = std::fs::remove_dir(dir);
    }
    copied.map_err(failed)
}

/// Refuses a folder whose settings name a catalog on a server, because commands in it do not use its file.
fn require_own_catalog(dir: &Path) -> ProjectResult<()> {
    let url = settings_of(dir)?.config.storage.catalog;
    if url.is_empty() {
        return Ok(());
    }
    let file = dir.join(SETTINGS_FILE);
    Err(Refusal::Usage(format!(
        "{} names the catalog {url}, so commands in this folder do not use the file catalog.sqlite; give that address instead of the folder, or another folder",
        file.display()
    ))
    .into())
}
