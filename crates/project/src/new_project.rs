//! Imports into a project, which is created if there is none.

use std::path::{Path, PathBuf};

use crate::error::ProjectResult;
use mocban_catalog::{Catalog, CatalogError, NewCatalog};
use mocban_store::Project;

/// Returns the missing directories of a path, the deepest first.
fn missing_dirs(dir: &Path) -> Vec<PathBuf> {
    let missing = dir.ancestors().take_while(|dir| !dir.exists());
    missing
        .filter(|dir| !dir.as_os_str().is_empty())
        .map(ToOwned::to_owned)
        .collect()
}

/// Calls `import` with the catalog of a project. A new project appears only when `import` has succeeded; a new catalog on a
/// server is created before.
pub async fn import_with<T>(
    project: &Project,
    url: Option<&str>,
    import: impl AsyncFn(&Catalog) -> ProjectResult<T>,
) -> ProjectResult<T> {
    let missing_dirs = missing_dirs(project.dir());
    let stored = store(project, url, import).await;
    if stored.is_err() {
        // Fails, as it should, if another process put something there.
        let _ = missing_dirs.iter().try_for_each(std::fs::remove_dir);
    }
    stored
}

async fn store<T>(
    project: &Project,
    url: Option<&str>,
    import: impl AsyncFn(&Catalog) -> ProjectResult<T>,
) -> ProjectResult<T> {
    if let Some(url) = url {
        Project::create(project.dir())?;
        let catalog = match Catalog::connect(url, false).await {
            Err(CatalogError::NoSchema(_)) => Catalog::connect(url, true).await?,
            catalog => catalog?,
        };
        let stored = import(&catalog).await;
        catalog.close().await;
        return stored;
    }
    while let Some(new) = begin(project).await? {
        let stored = import(new.catalog()).await;
        if stored.is_err() {
            new.discard().await;
            return stored;
        }
        if new.place().await? {
            return stored;
        }
        // Another process created the project meanwhile, so the list is imported into that project.
    }
    let catalog = Catalog::create(&project.catalog_path()).await?;
    let stored = import(&catalog).await;
    catalog.close().await;
    stored
}

/// Begins a catalog if the project has none. Tries again if a failing import removes the project directory meanwhile.
async fn begin(project: &Project) -> ProjectResult<Option<NewCatalog>> {
    const ATTEMPTS: usize = 20;
    for _ in 1..ATTEMPTS {
        let begun = try_begin(project).await;
        if begun.is_ok() || project.dir().exists() {
            return begun;
        }
    }
    try_begin(project).await
}

async fn try_begin(project: &Project) -> ProjectResult<Option<NewCatalog>> {
    Project::create(project.dir())?;
    Ok(NewCatalog::begin(&project.catalog_path()).await?)
}
