//! Exports the pairs of a project in one or several formats: reads them page by page, encodes each page on all cores,
//! and appends the pairs in the order of the catalog.
//!
//! Equal results give equal bytes. Times differ from run to run, so they are left out unless requested.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::block_lines::{BLOCKS_FILE, write_blocks};
use super::checksums::{CHECKSUMS, refuse_edited, write_checksums};
use super::export_folder::{Folder, FolderError, write_below};
use super::export_logs::write_logs;
use super::exporter_error::ExportError;
use super::format::ExportFormat;
use super::format_writer::{ExportContext, FormatFolder};
use super::formats;
use super::left_out::{OmissionCounts, OmissionReason};
use super::manifest::{ExportManifest, MANIFEST, PairCounts};
use super::options::ExportOptions;
use super::page_labels::write_page_labels;
use super::pair_writer::{FormatOutput, PairWriter, WrittenPair};
use super::readme;
use super::record::ManualAlignmentFields;
use super::split::{SplitCounts, SplitPlan};
use mocban_catalog::{Catalog, CatalogError, CutOrigin, PairResults, SetApart, StoredAlignment};
use mocban_core::domain::cancel::{ThreadToken, poll};
use mocban_core::domain::{BlockName, PairName};
use mocban_store::{Project, create_folders};
use mocban_system::failpoint::{self, Point};

/// Pairs whose rows are in memory at a time.
const PAGE: usize = 32;
/// Pairs for each core whose pictures are in memory at a time.
const ENCODED_PER_CORE: usize = 2;

/// What was exported.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ExportSummary {
    /// Numbers of pairs.
    pub pairs: PairCounts,
    /// Why pairs were left out.
    pub left_out: OmissionCounts,
    /// Damaged rows that the export does not include.
    pub set_apart: SetApart,
    /// How the exported pairs were divided, if a split was requested.
    pub split: Option<SplitCounts>,
    /// Pairs whose result cannot be read, and why.
    pub unreadable: Vec<(PairName, String)>,
    /// Blocks whose map cannot be read although their page was accepted, and why.
    pub unreadable_blocks: Vec<(BlockName, String)>,
    /// Whether the new export was discarded, and the earlier one kept, because files of finished pairs or blocks cannot be
    /// read.
    pub kept_earlier: bool,
    /// Whether nothing was written, because the options select no result. A folder at the target is kept.
    pub is_nothing_selected: bool,
    /// The path of an earlier export that could not be removed after it was replaced, and why.
    pub leftover: Option<(PathBuf, String)>,
}

impl ExportSummary {
    /// Returns whether all files of the exported pairs and blocks could be read.
    pub const fn is_complete(&self) -> bool {
        self.unreadable.is_empty() && self.unreadable_blocks.is_empty()
    }
}

/// Exports the pairs of a project to a folder, which must be new, empty or an earlier export. Replaces an earlier
/// export, unless somebody edited a file of it. One format is written to the folder itself; of several, each is written to a
/// folder of its name in it.
///
/// If the files of a pair cannot be read, its record and the summary state so, and the other pairs are exported. Such an
/// incomplete export never replaces an earlier export: the new one is discarded. Nothing is written if the options
/// select no result.
///
/// # Errors
/// Returns an error if the folder cannot be written, the catalog or the place of the artifacts cannot be read, or a worker
/// task panics. If the error occurs before the earlier export is replaced, or the future is dropped before, that export is
/// kept. Each few pairs poll for a cancellation.
pub async fn export(
    catalog: &Catalog,
    project: &Project,
    dir: &Path,
    formats: &[ExportFormat],
    options: ExportOptions,
) -> Result<ExportSummary, ExportError> {
    let (catalog, damaged) = &catalog.without_faulty_rows().await?;
    let readable = project.clone();
    tokio::task::spawn_blocking(move || readable.check_artifacts_place()).await??;
    let plan = match options.split {
        Some(split) => Some(SplitPlan::new(
            &split,
            &catalog.pair_groups(split.by.name()).await?,
        )),
        None => None,
    };
    let context = ExportContext {
        program: format!("mocban {}", env!("CARGO_PKG_VERSION")),
        metrics: options.metrics.clone(),
        meta_columns: catalog.meta_columns().await?,
        shared_prints: if formats.contains(&ExportFormat::Annotations) {
            catalog.shared_prints().await?
        } else {
            BTreeMap::new()
        },
        options,
    };
    let mut run = {
        let (project, dir, formats) = (project.clone(), dir.to_owned(), formats.to_vec());
        let token = ThreadToken::current();
        let begin = move || ExportRun::begin(&project, &dir, &formats, context, plan);
        tokio::task::spawn_blocking(move || token.scope(begin)).await??
    };
    run.summary.set_apart = SetApart::of(damaged);
    run.summary.pairs.set_apart = run.summary.set_apart.count;
    let mut pages = catalog.result_pages(PAGE);
    while let Some(page) = pages.next().await? {
        let page = ExportedPage::read(catalog, page).await?;
        let token = ThreadToken::current();
        let task = move || token.scope(|| run.add_page(page).map(|()| run));
        run = tokio::task::spawn_blocking(task).await??;
    }
    run.write_unpaired(catalog, project).await?;
    Ok(tokio::task::spawn_blocking(move || run.finish()).await??)
}

/// A page of pairs with what is exported of them.
struct ExportedPage {
    pairs: Vec<PairResults>,
    manual_alignments: BTreeMap<PairName, StoredAlignment>,
    /// From where pairs were cut out of whole blocks.
    origins: BTreeMap<PairName, CutOrigin>,
}

impl ExportedPage {
    /// Reads what belongs to pairs, which are sorted by name.
    async fn read(catalog: &Catalog, pairs: Vec<PairResults>) -> Result<Self, CatalogError> {
        let (manual_alignments, origins) = match (pairs.first(), pairs.last()) {
            (Some(first), Some(last)) => {
                let [first, last] = [first, last].map(|pair| &pair.attributes.name);
                let manual = catalog.newest_manual_alignments_between(first, last);
                (
                    manual.await?,
                    catalog.cut_origins_between(first, last).await?,
                )
            }
            _ => Default::default(),
        };
        Ok(Self {
            pairs,
            manual_alignments,
            origins,
        })
    }
}

/// An export in progress.
struct ExportRun {
    project: Project,
    folder: Folder,
    outputs: Vec<FormatOutput>,
    context: Arc<ExportContext>,
    plan: Option<SplitPlan>,
    /// Paths of files below the folder, with `*` in place of ids.
    files: BTreeSet<String>,
    /// Whole blocks from which exported pairs were cut.
    blocks: BTreeSet<String>,
    summary: ExportSummary,
}

impl ExportRun {
    fn begin(
        project: &Project,
        dir: &Path,
        formats: &[ExportFormat],
        context: ExportContext,
        plan: Option<SplitPlan>,
    ) -> Result<Self, FolderError> {
        let folder = Folder::begin(dir)?;
        // The folder is locked, so no other export replaces its target meanwhile.
        refuse_edited(folder.target())?;
        let context = Arc::new(context);
        let mut outputs = Vec::new();
        for format in formats {
            let prefix = match formats {
                [_] => String::new(),
                _ => format!("{format}/"),
            };
            let root = folder.path().join(&prefix);
            create_folders(&root).map_err(super::export_folder::at(&root))?;
            let context = Arc::clone(&context);
            outputs.push(FormatOutput {
                format: *format,
                prefix,
                writer: formats::begin(*format, FormatFolder { root, context })?,
            });
        }
        Ok(Self {
            project: project.clone(),
            folder,
            outputs,
            files: BTreeSet::new(),
            blocks: BTreeSet::new(),
            summary: ExportSummary {
                split: context
                    .options
                    .split
                    .map(|split| SplitCounts::new(split.shares)),
                ..ExportSummary::default()
            },
            context,
            plan,
        })
    }

    /// Encodes a page of pairs on all cores, then appends them in order.
    fn add_page(&mut self, mut page: ExportedPage) -> Result<(), FolderError> {
        let pairs: Vec<_> = page
            .pairs
            .into_iter()
            .map(|pair| {
                let name = &pair.attributes.name;
                let alignment = page.manual_alignments.remove(name);
                let origin = page.origins.remove(name);
                (pair, alignment.map(ManualAlignmentFields::from), origin)
            })
            .collect();
        for pairs in pairs.chunks(ENCODED_PER_CORE * rayon::current_num_threads()) {
            poll();
            let writer = PairWriter {
                project: &self.project,
                root: self.folder.path(),
                outputs: &self.outputs,
                context: &self.context,
                plan: self.plan.as_ref(),
            };
            let written: Result<Vec<Result<WrittenPair, OmissionReason>>, FolderError> = pairs
                .par_iter()
                .map(|(pair, alignment, origin)| {
                    writer.write(pair, alignment.as_ref(), origin.as_ref())
                })
                .collect();
            for pair in written? {
                match pair {
                    Err(reason) => {
                        self.summary.pairs.left_out += 1;
                        self.summary.left_out.add(reason);
                    }
                    Ok(pair) => {
                        let name = pair.record.pair.id.clone();
                        self.append(pair)?;
                        failpoint::hit("export", Point::Written, Some(&name));
                    }
                }
            }
        }
        Ok(())
    }

    fn append(&mut self, mut pair: WrittenPair) -> Result<(), FolderError> {
        for (output, shared) in self.outputs.iter_mut().zip(pair.shared) {
            output.writer.append(&pair.record, shared)?;
        }
        if let (Some(counts), Some(part)) = (&mut self.summary.split, pair.record.pair.split) {
            counts.add(part);
        }
        self.files.append(&mut pair.files);
        let fields = &pair.record.pair;
        let is_cut = fields.label.is_some();
        self.blocks.extend(fields.block.clone().filter(|_| is_cut));
        if let Some(why) = pair.unreadable {
            self.summary.unreadable.push((pair.record.pair.id, why));
        } else if pair.record.metrics.is_empty() {
            self.summary.pairs.without_result += 1;
        } else {
            self.summary.pairs.done += 1;
        }
        Ok(())
    }

    /// Writes what does not belong to one pair: the logs of the reviewers, and whole blocks. If results are selected, only
    /// blocks of exported pairs are written.
    async fn write_unpaired(
        &mut self,
        catalog: &Catalog,
        project: &Project,
    ) -> Result<(), ExportError> {
        let options = &self.context.options;
        let only = options.is_filtered().then_some(&self.blocks);
        for output in &self.outputs {
            let (format, prefix) = (output.format, &output.prefix);
            let root = self.folder.path().join(prefix);
            let mut files = BTreeSet::new();
            let mut unreadable = Vec::new();
            if format == ExportFormat::Jsonl {
                let logs = write_logs(catalog, &root, options.pairs.as_ref()).await?;
                files.extend(logs.into_iter().map(str::to_owned));
                let (is_written, lost) = write_blocks(catalog, project, &root, only).await?;
                files.extend(is_written.then(|| BLOCKS_FILE[0].to_owned()));
                unreadable = lost;
            } else if format == ExportFormat::Annotations {
                let limits = options.limits.image;
                let pages = write_page_labels(catalog, project, &root, only, limits).await?;
                files = pages.files;
                unreadable = pages.unreadable;
            }
            let files = files.iter().map(|name| format!("{prefix}{name}"));
            self.files.extend(files);
            self.summary.unreadable_blocks.extend(unreadable);
        }
        Ok(())
    }

    /// Completes the shared files, writes the READMEs, the manifest and the checksums, and replaces the target.
    fn finish(mut self) -> Result<ExportSummary, FolderError> {
        let root = self.folder.path().to_owned();
        let mut summary = self.summary;
        let is_empty = summary.pairs.done == 0 && summary.unreadable.is_empty();
        if is_empty && self.context.options.is_filtered() {
            summary.is_nothing_selected = true;
            return Ok(summary);
        }
        for output in &mut self.outputs {
            let mut names = output.writer.finish()?;
            let guide = output.writer.guide();
            let text = readme::render(
                &guide,
                output.format,
                &self.context,
                summary.pairs,
                &summary.left_out,
            );
            let mut own = vec![(readme::README, text)];
            own.extend(
                guide
                    .schema
                    .map(|schema| (readme::SCHEMA, format!("{schema:#}\n"))),
            );
            for (name, text) in own {
                write_below(&root, &format!("{}{name}", output.prefix), text.as_bytes())?;
                names.push(name.to_owned());
            }
            let paths = names.iter().map(|name| format!("{}{name}", output.prefix));
            self.files.extend(paths);
        }
        self.files.extend([CHECKSUMS, MANIFEST].map(str::to_owned));
        let formats: Vec<_> = self.outputs.iter().map(|output| output.format).collect();
        let (context, files) = (&self.context, &self.files);
        let manifest = ExportManifest::new(
            &context.program,
            &formats,
            &context.options,
            summary.pairs,
            files,
        );
        write_below(&root, MANIFEST, manifest.text().as_bytes())?;
        // Open files would keep the folder from being removed on some file systems.
        self.outputs.clear();
        summary.kept_earlier = !summary.is_complete() && self.folder.replaces()?;
        if !summary.kept_earlier {
            write_checksums(&root)?;
            // Somebody may have edited the target while the export was written.
            refuse_edited(self.folder.target())?;
            let leftover = self.folder.finish()?;
            summary.leftover = leftover.map(|(path, error)| (path, error.to_string()));
        }
        Ok(summary)
    }
}
