//! Makes the catalog the owner of the places of its artifacts, before anything is written or removed there.

use super::blocking::run_blocking;
use super::error::RunError;
use super::retry::retried;
use mocban_catalog::Catalog;
use mocban_store::Project;

/// Results whose files are looked for in a place without the name of an owner.
const SAMPLES: usize = 20;

/// Makes the catalog the owner of the places of its artifacts, or checks that it is. With `take_over`, replaces another
/// owner. Warns if the owner changes.
///
/// # Errors
/// Returns an error if a place belongs to another catalog, or if the catalog or a place cannot be read or written.
pub async fn claim_artifacts(
    project: &Project,
    catalog: &Catalog,
    take_over: bool,
) -> Result<(), RunError> {
    let identity = retried!(catalog.identity())?;
    let known = retried!(catalog.first_artifacts(SAMPLES))?;
    let project = project.clone();
    for message in run_blocking(move || project.claim_places(&identity, &known, take_over)).await? {
        tracing::warn!("{message}");
    }
    Ok(())
}
