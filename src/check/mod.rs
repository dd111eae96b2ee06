//! A project held against itself: the database's own checks, counters and states against rows, files against rows.
//!
//! Read in pages, so that memory stays the same whatever the number of pairs. What is damaged can be put back to be
//! done; verdicts and the history of results are never touched.

mod finding;
mod pairs;
mod summary;

pub use finding::{Finding, Kind};
pub use summary::{CheckSummary, Found, Notes, Repaired, Spare};

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use crate::catalog::{AuditedPair, Catalog, CatalogError, CatalogErrorKind, Drift};
use crate::store::{Project, ReferencedArtifacts, UnreferencedKind};
use pairs::Look;

/// Pairs in memory at a time.
const PAGE: usize = 500;

/// How to check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CheckOptions {
    /// Compare lengths of files in place of their hashes, and leave out whether indexes agree with tables.
    pub quick: bool,
    /// Mend what can be mended. The caller holds the lock of the run, alone.
    pub repair: bool,
    /// Whether a run may be writing artifacts; then files that no row names cannot be told.
    pub in_use: bool,
}

/// Why a check could not be made. Damage is no error: it is in the summary.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// The folder of artifacts refused.
    #[error("{path}: {source}")]
    Artifacts {
        /// The folder.
        path: std::path::PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A thread was lost.
    #[error("the check stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

/// Checks a project, and mends it when asked to.
///
/// A damaged database is never written to, except that indexes are made anew where they alone are wrong.
///
/// # Errors
/// When catalog or disk refuse.
pub async fn check(
    project: &Project,
    catalog: &Catalog,
    options: CheckOptions,
) -> Result<CheckSummary, CheckError> {
    let mut summary = CheckSummary::new(options.quick);
    let sound = database(catalog, options, &mut summary).await?;
    let options = CheckOptions {
        repair: options.repair && sound,
        ..options
    };
    let rest = rows_and_files(project, catalog, options, &mut summary).await;
    match rest {
        Err(CheckError::Catalog(error)) if is_damage(&error) => {
            // The database's own check may have passed over a value that is not what its column holds.
            summary.add(Finding::database(format!("not read to its end: {error}")));
            Ok(summary)
        }
        Err(error) => Err(error),
        Ok(()) => Ok(summary),
    }
}

fn is_damage(error: &CatalogError) -> bool {
    let told = matches!(error, CatalogError::Corrupt(_) | CatalogError::Json(_));
    told || matches!(
        error.kind(),
        Some(CatalogErrorKind::Damaged | CatalogErrorKind::NotADatabase)
    )
}

/// The database by itself; says whether it may be written to.
async fn database(
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<bool, CheckError> {
    let faults = catalog.integrity(options.quick).await?;
    let indexes_alone = !faults.is_empty() && faults.iter().all(|line| is_of_index(line));
    for line in &faults {
        summary.add(Finding::database(line.clone()));
    }
    if faults.is_empty() {
        return Ok(true);
    }
    if !(options.repair && indexes_alone && catalog.rebuild_indexes().await?.is_empty()) {
        return Ok(false);
    }
    summary.mended(Kind::Database);
    summary.repaired.indexes = true;
    Ok(true)
}

/// Whether a line of SQLite's check speaks of an index that does not agree with its table.
fn is_of_index(line: &str) -> bool {
    line.contains("missing from index") || line.contains("wrong # of entries in index")
}

async fn rows_and_files(
    project: &Project,
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    schema(catalog, options, summary).await?;
    for line in catalog.broken_references().await? {
        summary.add(Finding::reference(line));
    }
    counters(catalog, options, summary).await?;
    let mut named = ReferencedArtifacts::default();
    let mut after = None;
    loop {
        let page = catalog.audit_page(after, PAGE).await?;
        let Some(last) = page.last() else { break };
        after = Some(last.inputs.pair);
        let looks = look_at(project, page, options.quick).await?;
        mend_pairs(catalog, options, &looks, summary).await?;
        for look in looks {
            for hash in &look.named {
                named.add(hash);
            }
            summary.count(look, options.repair);
        }
    }
    if !options.in_use {
        spare_files(project, named, options.repair, summary).await?;
    }
    Ok(())
}

async fn schema(
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let found = catalog.schema_differences().await?;
    for line in &found {
        summary.add(Finding::schema(line.clone()));
    }
    if options.repair && !found.is_empty() {
        catalog.restore_schema().await?;
        let left = catalog.schema_differences().await?;
        summary.mended_but(Kind::Schema, left.len() as u64);
        summary.repaired.schema = left.len() < found.len();
    }
    Ok(())
}

async fn counters(
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let drift = catalog.drift(options.quick).await?;
    let is_off = drift != Drift::default();
    for drift in &drift.counters {
        summary.add(Finding::counter(drift));
    }
    for line in drift.marks {
        summary.add(Finding::mark(line));
    }
    if options.repair && is_off {
        catalog.rebuild_counters().await?;
        summary.mended(Kind::Counter);
        summary.repaired.counters = true;
    }
    Ok(())
}

/// Looks at a page's rows and files on all cores.
async fn look_at(
    project: &Project,
    page: Vec<AuditedPair>,
    quick: bool,
) -> Result<Vec<Look>, CheckError> {
    let project = project.clone();
    let look = move || {
        page.into_par_iter()
            .map(|pair| pairs::look(&project, &pair, quick))
            .collect()
    };
    Ok(tokio::task::spawn_blocking(look).await?)
}

async fn mend_pairs(
    catalog: &Catalog,
    options: CheckOptions,
    looks: &[Look],
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let back = looks
        .iter()
        .filter_map(|look| Some((look.pair, look.back_to()?)));
    let back: Vec<_> = back.collect();
    if options.repair && !back.is_empty() {
        summary.repaired.put_back += back.len() as u64;
        catalog.restore(back).await?;
    }
    Ok(())
}

/// Files that no row names; removes those that are ours.
async fn spare_files(
    project: &Project,
    named: ReferencedArtifacts,
    remove: bool,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let folder = project.clone();
    let walk = move || {
        let mut spare = Spare::default();
        let walked = named.for_each_unreferenced(&folder, |unnamed| {
            let ours = unnamed.kind != UnreferencedKind::UnknownFile;
            // One that cannot be removed is told again by the next check.
            let removed = remove && ours && std::fs::remove_file(&unnamed.path).is_ok();
            spare.count(&unnamed, removed);
        });
        walked.map(|()| spare)
    };
    match tokio::task::spawn_blocking(walk).await? {
        Ok(spare) => {
            summary.spare = Some(spare);
            Ok(())
        }
        Err(source) => Err(CheckError::Artifacts {
            path: project.artifacts_dir(),
            source,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::is_of_index;

    #[test]
    fn only_indexes_are_made_anew() {
        assert!(is_of_index("row 3 missing from index job_ready"));
        assert!(is_of_index("wrong # of entries in index job_ready"));
        assert!(!is_of_index(
            "Tree 5 page 7: btreeInitPage() returns error code 11"
        ));
        assert!(!is_of_index("CHECK constraint failed in job"));
    }
}
