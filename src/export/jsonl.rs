//! `export --to jsonl`: writes one line per pair and metric to `pairs.jsonl`, and files below `pairs/`.
//!
//! Equal results give equal bytes. Times differ from run to run, so they are left out unless requested.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;

use super::export_folder::{Folder, FolderError, at};
use super::export_line::{ExportLine, LineStatus, Outcomes, newest_manual_alignments};
use super::file_names::{ATTENTION_CHECKS, LINES, MANUAL_ALIGNMENTS, PAIRS, VERDICTS};
use super::pair_files::{EncodedImages, FilesError, PairFiles};
use crate::catalog::{Catalog, CatalogError, PairResults};
use crate::domain::{Failure, FailureClass, MetricOutcome, PairName, ThresholdMetric};
use crate::raster;
use crate::report::pair_artifacts::same_alignment;
use crate::store::Project;

/// Pairs in memory at a time.
const PAGE: usize = 64;

/// What to export.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JsonlOptions {
    /// Metrics of the current method. A pair without a result still has one line for each of these metrics.
    pub metrics: &'static [ThresholdMetric],
    /// Whether to write computing times, which make the bytes differ from run to run.
    pub with_times: bool,
    /// Limits on the print images.
    pub limits: raster::ImageLimits,
}

/// What was exported.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ExportSummary {
    /// Pairs with files.
    pub done: u64,
    /// Pairs without a result: failed or not finished.
    pub without_result: u64,
    /// Pairs whose result cannot be read, and why.
    pub unreadable: Vec<(PairName, String)>,
    /// Whether the new export was discarded, and the earlier one kept, because files of finished pairs cannot be read.
    pub kept_earlier: bool,
    /// The path of an earlier export that could not be removed after it was replaced, and why.
    pub leftover: Option<(PathBuf, String)>,
}

/// Why nothing was exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The catalog cannot be read.
    #[error("{0}")]
    Catalog(#[from] CatalogError),
    /// The folder cannot be used, or a file in it not written.
    #[error("{0}")]
    Folder(#[from] FolderError),
    /// A worker task panicked or was cancelled.
    #[error("the export stopped: {0}")]
    Stopped(#[from] tokio::task::JoinError),
}

/// Exports every pair of a project to a folder, which must be new, empty or an earlier export. Replaces an earlier
/// export.
///
/// If the files of a pair cannot be read, its lines and the summary state so, and the other pairs are exported. Such an
/// incomplete export never replaces an earlier export: the new one is discarded.
///
/// # Errors
/// Returns an error if the folder cannot be written, the catalog cannot be read or a worker task panics. If the error
/// occurs before the earlier export is replaced, that export is kept.
pub async fn to_jsonl(
    catalog: &Catalog,
    project: &Project,
    dir: &Path,
    options: JsonlOptions,
) -> Result<ExportSummary, ExportError> {
    catalog.verify_checksums().await?;
    let folder = Folder::begin(dir)?;
    let path = folder.path().join(LINES);
    let mut lines = BufWriter::new(File::create(&path).map_err(at(&path))?);
    let mut summary = ExportSummary::default();
    let manual_alignments = newest_manual_alignments(catalog).await?;
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        for mut pair in write_page(project, folder.path(), page, options).await? {
            for line in &mut pair.lines {
                line.manual_alignment = manual_alignments.get(&line.id).cloned();
            }
            let text = json_lines(&pair.lines);
            lines.write_all(text.as_bytes()).map_err(at(&path))?;
            summary.count(pair);
        }
    }
    lines.flush().map_err(at(&path))?;
    write_logs(catalog, folder.path()).await?;
    summary.kept_earlier = !summary.unreadable.is_empty() && folder.replaces()?;
    if !summary.kept_earlier {
        let leftover = folder.finish()?;
        summary.leftover = leftover.map(|(path, error)| (path, error.to_string()));
    }
    Ok(summary)
}

/// Returns values as JSON lines.
pub fn json_lines<T: Serialize>(values: &[T]) -> String {
    let line = |value| {
        let text = serde_json::to_string(value);
        text.expect("lines hold only strings, finite numbers, lists and fields") + "\n"
    };
    values.iter().map(line).collect()
}

/// Writes the logs of verdicts, attention checks and manual alignments, oldest first, including undone entries. Empty
/// logs of attention checks and manual alignments are left out.
async fn write_logs(catalog: &Catalog, root: &Path) -> Result<(), ExportError> {
    write_log(root, VERDICTS, &catalog.verdict_log(None).await?)?;
    let checks = catalog.attention_check_answers().await?;
    if !checks.is_empty() {
        write_log(root, ATTENTION_CHECKS, &checks)?;
    }
    let alignments = catalog.manual_alignments().await?;
    if !alignments.is_empty() {
        write_log(root, MANUAL_ALIGNMENTS, &alignments)?;
    }
    Ok(())
}

fn write_log<T: Serialize>(root: &Path, name: &str, log: &[T]) -> Result<(), FolderError> {
    let path = root.join(name);
    std::fs::write(&path, json_lines(log)).map_err(at(&path))
}

/// A pair's lines, and why its files are missing although it is finished.
struct PairLines {
    name: PairName,
    lines: Vec<ExportLine>,
    unreadable: Option<String>,
}

impl ExportSummary {
    fn count(&mut self, pair: PairLines) {
        if let Some(why) = pair.unreadable {
            self.unreadable.push((pair.name, why));
        } else if pair
            .lines
            .iter()
            .any(|line| line.status == LineStatus::Done)
        {
            self.done += 1;
        } else {
            self.without_result += 1;
        }
    }
}

/// Writes the files of a page of pairs on all cores.
async fn write_page(
    project: &Project,
    root: &Path,
    pairs: Vec<PairResults>,
    options: JsonlOptions,
) -> Result<Vec<PairLines>, ExportError> {
    let (project, root) = (project.clone(), root.to_owned());
    tokio::task::spawn_blocking(move || {
        pairs
            .par_iter()
            .map(|pair| pair_lines(&project, &root, pair, options))
            .collect()
    })
    .await?
}

fn pair_lines(
    project: &Project,
    root: &Path,
    pair: &PairResults,
    options: JsonlOptions,
) -> Result<PairLines, ExportError> {
    let name = pair.attributes.name.clone();
    let (lines, unreadable) = match written_lines(project, root, pair, options) {
        Ok(lines) => (lines, None),
        Err(FilesError::Folder(error)) => return Err(error.into()),
        Err(error) => {
            // An incomplete folder would look like a complete one.
            let _ = std::fs::remove_dir_all(root.join(PAIRS).join(name.as_str()));
            let failure = Failure::new(FailureClass::Io, error.to_string());
            let metrics = pair.metrics.iter().map(|record| record.outcome.metric);
            let lines = metrics.map(|metric| ExportLine::unreadable(pair, metric, &failure));
            (lines.collect(), Some(failure.message))
        }
    };
    Ok(PairLines {
        name,
        lines,
        unreadable,
    })
}

/// Writes the files of a pair and returns its lines.
fn written_lines(
    project: &Project,
    root: &Path,
    pair: &PairResults,
    options: JsonlOptions,
) -> Result<Vec<ExportLine>, FilesError> {
    if pair.metrics.is_empty() {
        let metrics = options.metrics.iter();
        let lines = metrics.map(|metric| ExportLine::without_result(pair, *metric));
        return Ok(lines.collect());
    }
    let files = PairFiles::read(project, pair, &options.limits)?;
    let outcomes = Outcomes::read(&files.artifacts)?;
    files.write_shared(root)?;
    let mut drawn: Vec<(&MetricOutcome, EncodedImages)> = Vec::new();
    let mut lines = Vec::new();
    for record in &pair.metrics {
        let outcome = &record.outcome;
        // Metrics often have the same alignment, which is drawn once.
        let mut known = drawn.iter();
        let same = known.position(|(other, _)| same_alignment(other, outcome));
        let index = same.unwrap_or(drawn.len());
        if same.is_none() {
            drawn.push((outcome, files.draw(outcome)));
        }
        let written = files.write_metric(root, outcome.metric, &drawn[index].1)?;
        lines.push(ExportLine {
            seconds: options.with_times.then(|| pair.seconds()),
            ..ExportLine::of(pair, record, &outcomes, written)
        });
    }
    Ok(lines)
}
