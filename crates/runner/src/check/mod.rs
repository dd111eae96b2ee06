//! Checks a project for damage. Compares the rows of the database with each other and with the files.
//!
//! Pairs are read in pages, so that memory use does not grow with the number of pairs. A repair makes the next run
//! compute damaged results again. It never changes verdicts, answers, manual alignments or the log of attempts; damaged ones
//! are set apart where they are.

mod blocks;
mod damaged_jobs;
mod finding;
mod pairs;
mod summary;

pub use finding::{Finding, Kind};
pub use summary::{CheckSummary, Found, Notes, Repaired, Unreferenced};

use std::time::Duration;

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};

use crate::{RunError, claim_artifacts};
use damaged_jobs::{DamagedJobs, repair_jobs};
use mocban_catalog::{
    AuditedPair, Catalog, CatalogError, CatalogErrorKind, ChecksummedTable, Drift, FaultyRow,
    SetApart,
};
use mocban_core::domain::{BlockId, BlockStage, UnixMillis, explained_by_cause};
use mocban_store::{ArtifactError, PlaceError, Project, ReferencedArtifacts, UnreferencedKind};
use pairs::PairCheck;

/// Number of pairs in memory at a time.
const PAGE: usize = 500;

/// Options of a check.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a choice of its own, with a name"
)]
pub struct CheckOptions {
    /// Compare files by length instead of hash. Do not compare indexes with tables, nor the fingerprints and dirty
    /// marks of jobs with their results.
    pub quick: bool,
    /// Repair what can be repaired. The caller holds the exclusive run lock.
    pub repair: bool,
    /// Repair although most result files are missing. Otherwise a repair changes no results then, because a disk may
    /// not be mounted.
    pub accept_missing: bool,
    /// Whether a run may be writing artifacts. If so, unreferenced files are not reported.
    pub in_use: bool,
    /// The current time.
    pub now: UnixMillis,
    /// Remove unreferenced files and packs of at least this age, also while a run may be writing artifacts.
    pub collect: Option<Duration>,
    /// Make the catalog the owner of its artifacts, in place of any other catalog.
    pub take_over: bool,
}

/// Why a check could not be completed. Damage is not an error, because the summary lists it.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The catalog returned an error.
    #[error("{0}")]
    Catalog(#[from] CatalogError),
    /// The artifacts belong to another catalog, or their owner cannot be read or written.
    #[error("{0}")]
    Claim(#[from] RunError),
    /// The folder or the object store of the artifacts cannot be read.
    #[error("{0}; no result was changed")]
    Unreadable(ArtifactError),
    /// The folder or the object store failed while unreferenced artifacts were removed.
    #[error("{0}")]
    Collect(#[from] ArtifactError),
    /// A worker thread panicked or was cancelled.
    #[error("the check stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

explained_by_cause! { CheckError: Catalog, Claim }

/// Checks a project and, with `repair`, repairs it.
///
/// A damaged database is not written to, with one exception: if only indexes are damaged, a repair rebuilds them.
pub async fn check(
    project: &Project,
    catalog: &Catalog,
    options: CheckOptions,
) -> Result<CheckSummary, CheckError> {
    let mut summary = CheckSummary::new(options.quick);
    let readable = project.clone();
    let looked = tokio::task::spawn_blocking(move || readable.check_artifacts_place()).await?;
    looked.map_err(CheckError::Unreadable)?;
    let sound = database(catalog, options, &mut summary).await?;
    let options = CheckOptions {
        repair: options.repair && sound,
        // The artifacts of rows that a damaged database does not return would look unreferenced.
        collect: options.collect.filter(|_| sound),
        ..options
    };
    if sound {
        claim(project, catalog, options, &mut summary).await?;
    }
    let rest = rows_and_files(project, catalog, options, &mut summary).await;
    match rest {
        Err(CheckError::Catalog(error)) if is_damage(&error) => {
            // SQLite's integrity check can miss an invalid value, which is found only when its row is read.
            summary.note(Finding::new(
                Kind::Database,
                format!("not read to its end: {error}"),
            ));
            Ok(summary)
        }
        Err(error) => Err(error),
        Ok(()) => Ok(summary),
    }
}

/// Makes the catalog the owner of its artifacts before any of them is removed. Otherwise notes if another catalog is the
/// owner.
async fn claim(
    project: &Project,
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    if options.repair || options.collect.is_some() || options.take_over {
        return Ok(claim_artifacts(project, catalog, options.take_over).await?);
    }
    let (identity, project) = (catalog.identity().await?, project.clone());
    match tokio::task::spawn_blocking(move || project.check_places(&identity)).await? {
        Err(PlaceError::Failed(error)) => return Err(CheckError::Unreadable(error)),
        Err(error) => summary.foreign_artifacts = Some(error.to_string()),
        Ok(()) => {}
    }
    Ok(())
}

fn is_damage(error: &CatalogError) -> bool {
    use CatalogErrorKind::{Damaged, NotADatabase, Statement};
    let is_invalid_row = matches!(error, CatalogError::Corrupt(_) | CatalogError::Json(_));
    is_invalid_row || matches!(error.kind(), Some(Damaged | NotADatabase | Statement))
}

/// Checks the database file; returns whether it may be written to.
async fn database(
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<bool, CheckError> {
    let faults = catalog.integrity(options.quick).await?;
    let indexes_alone = !faults.is_empty() && faults.iter().all(|line| is_of_index(line));
    for line in &faults {
        summary.note(Finding::new(Kind::Database, line.clone()));
    }
    if faults.is_empty() {
        return Ok(true);
    }
    if !(options.repair && indexes_alone && catalog.rebuild_indexes().await?.is_empty()) {
        return Ok(false);
    }
    summary.mark_repaired(Kind::Database, 0);
    summary.repaired.indexes = true;
    Ok(true)
}

/// Returns whether a line of SQLite's integrity check reports an index that does not match its table.
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
        summary.note(Finding::new(Kind::Reference, line));
    }
    counters(catalog, options, summary).await?;
    fingerprints(catalog, options, summary).await?;
    let faulty = damaged_rows(catalog, options, summary).await?;
    let mut is_readable = true;
    let mut named = ReferencedArtifacts::default();
    let mut back = DamagedJobs::default();
    let mut after = None;
    loop {
        let page = catalog.audit_page(after, PAGE).await?;
        let Some(last) = page.last else { break };
        after = Some(last);
        is_readable &= page.unreadable.is_empty();
        for (pair, reason) in &page.unreadable {
            let is_listed =
                |row: &FaultyRow| (row.table, row.row) == (ChecksummedTable::Pair, pair.0);
            if !faulty.iter().any(is_listed) {
                summary.note(Finding::unreadable(*pair, reason));
            }
        }
        for check in check_page(project, page.pairs, options.quick).await? {
            for artifact in &check.named {
                named.add(artifact);
            }
            is_readable &= check.names_all;
            let stage = check.back_to();
            back.pairs.extend(stage.map(|stage| (check.pair, stage)));
            summary.count(check, options.repair);
        }
    }
    summary.same_contents = catalog.same_contents().await?;
    back.blocks = check_blocks(project, catalog, options.quick, &mut named, summary).await?;
    let is_withheld =
        options.repair && !repair_jobs(catalog, options.accept_missing, back, summary).await?;
    if options.repair {
        catalog.remove_stale_files();
    }
    // The files of a pair that cannot be read would look unreferenced.
    if !is_readable || is_withheld {
        return Ok(());
    }
    if let Some(age) = options.collect {
        collect(project, named, (age, !options.in_use), summary).await?;
    } else if !options.in_use {
        unreferenced_files(project, named, options.repair, summary).await?;
    }
    Ok(())
}

/// Checks the checksums of rows. With `repair`, sets apart the damaged rows of append-only tables, if the user may. Returns
/// all damaged rows.
async fn damaged_rows(
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<Vec<FaultyRow>, CheckError> {
    let faulty = catalog.faulty_rows().await?;
    let (known, new): (Vec<_>, Vec<_>) = faulty.iter().partition(|row| row.is_set_apart);
    summary.set_apart = SetApart::of(known);
    if new.is_empty() {
        return Ok(faulty);
    }
    let may_set_apart = catalog.may_set_apart().await?;
    let mut apart = Vec::new();
    for row in new {
        let is_repairable = may_set_apart && row.table.is_append_only();
        summary.add_row(Finding::row(row, may_set_apart), is_repairable);
        apart.extend(is_repairable.then(|| row.clone()));
    }
    if options.repair && !apart.is_empty() {
        summary.set_rows_apart(apart.len() as u64);
        catalog.set_apart(apart, options.now).await?;
    }
    Ok(faulty)
}

/// Checks all blocks, and adds their artifacts to `named`. Returns the damaged blocks, each with its first damaged
/// stage.
async fn check_blocks(
    project: &Project,
    catalog: &Catalog,
    quick: bool,
    named: &mut ReferencedArtifacts,
    summary: &mut CheckSummary,
) -> Result<Vec<(BlockId, BlockStage)>, CheckError> {
    let blocks = catalog.audited_blocks().await?;
    let results = blocks.iter().flat_map(|block| &block.results);
    let files = results.flat_map(|result| result.files.values());
    files.for_each(|artifact| named.add(artifact));
    let project = project.clone();
    let work = move || {
        let checked = blocks.into_par_iter();
        let checked = checked.map(|block| blocks::check_block(&project, &block, quick));
        checked.collect::<Result<Vec<_>, _>>()
    };
    let checked = tokio::task::spawn_blocking(work).await?;
    let mut back = Vec::new();
    for check in checked.map_err(CheckError::Unreadable)? {
        summary.files += check.files;
        for finding in check.damage {
            let is_repairable = finding.kind.is_repairable();
            summary.add(finding, is_repairable);
        }
        back.extend(check.from.map(|stage| (check.block, stage)));
    }
    Ok(back)
}

async fn schema(
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let found = catalog.schema_differences().await?;
    for line in &found {
        summary.note(Finding::new(Kind::Schema, line.clone()));
    }
    if options.repair && !found.is_empty() {
        catalog.restore_schema().await?;
        let left = catalog.schema_differences().await?;
        summary.mark_repaired(Kind::Schema, left.len() as u64);
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
        summary.note(Finding::counter(drift));
    }
    for line in drift.marks {
        summary.note(Finding::new(Kind::Counter, line));
    }
    if options.repair && is_off {
        catalog.rebuild_counters().await?;
        summary.mark_repaired(Kind::Counter, 0);
        summary.repaired.counters = true;
    }
    Ok(())
}

async fn fingerprints(
    catalog: &Catalog,
    options: CheckOptions,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let faulty = catalog.faulty_fingerprints().await?;
    for fingerprint in &faulty {
        summary.note(Finding::fingerprint(fingerprint));
    }
    if options.repair && !faulty.is_empty() {
        catalog.retire_fingerprints(faulty).await?;
        summary.mark_repaired(Kind::Fingerprint, 0);
    }
    Ok(())
}

/// Checks the rows and files of a page of pairs on all cores.
async fn check_page(
    project: &Project,
    page: Vec<AuditedPair>,
    quick: bool,
) -> Result<Vec<PairCheck>, CheckError> {
    let project = project.clone();
    let work = move || {
        page.into_par_iter()
            .map(|pair| pairs::check_pair(&project, &pair, quick))
            .collect::<Result<Vec<_>, _>>()
    };
    let checked = tokio::task::spawn_blocking(work).await?;
    checked.map_err(CheckError::Unreadable)
}

/// Counts unreferenced files and packs, and removes those of at least this age. With `is_idle`, also objects of
/// characters in an object store.
async fn collect(
    project: &Project,
    named: ReferencedArtifacts,
    (age, is_idle): (Duration, bool),
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let project = project.clone();
    let work = move || {
        let mut found = Unreferenced::default();
        let collected = named.collect(&project, age, is_idle, |file, removed| {
            found.count(file, removed);
        });
        collected.map(|()| found)
    };
    summary.unreferenced = Some(tokio::task::spawn_blocking(work).await??);
    Ok(())
}

/// Counts unreferenced files. With `remove`, also deletes the files that this program wrote.
async fn unreferenced_files(
    project: &Project,
    named: ReferencedArtifacts,
    remove: bool,
    summary: &mut CheckSummary,
) -> Result<(), CheckError> {
    let folder = project.clone();
    let walk = move || {
        let mut found = Unreferenced::default();
        let walked = named.for_each_unreferenced(&folder, |file| {
            let ours = file.kind != UnreferencedKind::UnknownFile;
            // The next check reports a file again that cannot be deleted.
            let removed = remove && ours && std::fs::remove_file(&file.path).is_ok();
            found.count(&file, removed);
        });
        walked.map(|()| found)
    };
    match tokio::task::spawn_blocking(walk).await? {
        Ok(found) => {
            summary.unreferenced = Some(found);
            Ok(())
        }
        Err(source) => Err(CheckError::Collect(ArtifactError::Io {
            path: project.artifacts_dir(),
            source,
        })),
    }
}

#[cfg(test)]
mod tests {
    use super::is_of_index;

    #[test]
    fn only_index_faults_are_rebuilt() {
        assert!(is_of_index("row 3 missing from index job_ready"));
        assert!(is_of_index("wrong # of entries in index job_ready"));
        assert!(!is_of_index(
            "Tree 5 page 7: btreeInitPage() returns error code 11"
        ));
        assert!(!is_of_index("CHECK constraint failed in job"));
    }
}
