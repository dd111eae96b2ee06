//! The logs of the reviewers: verdicts, answers to attention checks and manual alignments.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;

use super::export_folder::SharedFile;
use super::exporter_error::ExportError;
use mocban_catalog::Catalog;
use mocban_core::domain::PairName;

/// The logs with their meaning.
pub(super) const LOG_FILES: [[&str; 2]; 3] = [
    [
        "verdicts.jsonl",
        "all verdicts with reviewer, time and hash of the judged result, oldest first, including undone ones",
    ],
    [
        "attention_checks.jsonl",
        "answers to attention checks and duplicates, if any",
    ],
    ["manual_alignments.jsonl", "manual alignments, if any"],
];

/// Lines in memory at a time.
const PAGE: usize = 1000;

/// Returns values as JSON lines.
pub(super) fn json_lines<T: Serialize>(values: &[T]) -> String {
    let line = |value| {
        let text = serde_json::to_string(value);
        text.expect("lines hold only strings, finite numbers, lists and fields") + "\n"
    };
    values.iter().map(line).collect()
}

/// Writes the logs page by page, oldest first, including undone entries. With `pairs`, they have only lines of these pairs.
/// Leaves out empty logs except that of verdicts. Returns the names of the files.
pub(super) async fn write_logs(
    catalog: &Catalog,
    root: &Path,
    pairs: Option<&BTreeSet<PairName>>,
) -> Result<Vec<&'static str>, ExportError> {
    let is_exported = |pair: &PairName| pairs.is_none_or(|pairs| pairs.contains(pair));
    let [[verdicts, _], [checks, _], [alignments, _]] = LOG_FILES;
    let mut written = vec![verdicts];
    let (mut file, mut after) = (SharedFile::create(root, verdicts)?, 0);
    while let mut page = catalog.verdict_log_page(after, PAGE).await?
        && let Some(last) = page.last()
    {
        after = last.id;
        page.retain(|event| is_exported(&event.pair));
        file.append(json_lines(&page).as_bytes())?;
    }
    file.flush()?;
    let (mut file, mut after) = (None, 0);
    while let mut page = catalog.attention_check_page(after, PAGE).await?
        && let Some(last) = page.last()
    {
        after = last.id;
        page.retain(|answer| is_exported(&answer.pair));
        append(&mut file, root, checks, &page)?;
    }
    written.extend(flush(file)?.then_some(checks));
    let (mut file, mut after) = (None, 0);
    while let mut page = catalog.manual_alignment_page(after, PAGE).await?
        && let Some(last) = page.last()
    {
        after = last.id;
        page.retain(|alignment| is_exported(&alignment.made.pair));
        append(&mut file, root, alignments, &page)?;
    }
    written.extend(flush(file)?.then_some(alignments));
    Ok(written)
}

/// Appends lines to a file, which is created for the first ones. Does nothing if there are none.
fn append<T: Serialize>(
    file: &mut Option<SharedFile>,
    root: &Path,
    name: &str,
    lines: &[T],
) -> Result<(), ExportError> {
    if lines.is_empty() {
        return Ok(());
    }
    if file.is_none() {
        *file = Some(SharedFile::create(root, name)?);
    }
    if let Some(file) = file {
        file.append(json_lines(lines).as_bytes())?;
    }
    Ok(())
}

/// Flushes a file. Returns whether there is one.
fn flush(file: Option<SharedFile>) -> Result<bool, ExportError> {
    match file {
        None => Ok(false),
        Some(mut file) => Ok(file.flush().map(|()| true)?),
    }
}
