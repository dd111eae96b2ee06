//! Looks at the files of an import before anything is stored: what each says of itself, or why it cannot be used.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::failure::{AppFailure, AppResult};
use super::folder_picker::PickerRoots;
use super::import_choice::{ImportChoice, Planned, SHOWN_PAIRS};
use super::plan_cache::KEPT_PAIRS;
use super::sentence::Sentence;
use super::state::AppState;
use crate::on_thread::read_on_thread;
use mocban_core::InputLimits;
use mocban_core::domain::LengthUnit;
use mocban_core::mesh::MeshExtent;
use mocban_lists::labels::LabelFormat;
use mocban_project::ProjectError;
use mocban_project::file_heads::{ScanKind, image_size, page_labels, scan_extent};
use mocban_project::input_paths::find_on_disk;
use mocban_project::location::Location;

/// The files of a pair or of a whole block that would be imported.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlannedFiles {
    pub(super) name: String,
    pub(super) kind: ScanKind,
    pub(super) scan: PathBuf,
    /// The print, or the page of a block.
    pub(super) print: PathBuf,
    pub(super) labels: Option<PathBuf>,
    pub(super) unit: Option<LengthUnit>,
}

/// What the files of a pair or of a block say of themselves.
#[derive(Debug)]
pub(super) struct FileHeads {
    pub(super) files: PlannedFiles,
    pub(super) scan: Result<MeshExtent, Sentence>,
    /// Width and height in pixels.
    pub(super) print: Result<[u32; 2], Sentence>,
    /// The number of boxes of the labels, and their format. `None` without labels, or if the page cannot be used.
    pub(super) labels: Option<Result<(u64, LabelFormat), Sentence>>,
}

/// Some files of an import.
#[derive(Debug)]
pub(super) struct PlannedPart {
    pub(super) files: Vec<PlannedFiles>,
    /// Number of pairs or blocks whose files can be looked at.
    pub(super) total: u64,
}

impl ImportChoice {
    /// Returns up to `most` pairs or blocks that would be imported, from a position on. `None` if nothing would be.
    fn planned_files(
        &self,
        state: &AppState,
        roots: &PickerRoots,
        start: u64,
        most: usize,
    ) -> Option<PlannedPart> {
        // A page of the preview starts with whole groups.
        let from = start / SHOWN_PAIRS * SHOWN_PAIRS;
        let known = (start - from) as usize;
        let preview = self.preview(&state.options.folder, roots, from, &state.plans)?;
        let of_form = self.unit.parse::<LengthUnit>().ok();
        // Past the end, the preview has the last ones.
        let is_there = preview.from == from;
        let (files, total) = match preview.planned.ok()? {
            Planned::Pairs(plan, at) => {
                let shown = plan.shown.iter().skip(at + known).take(most);
                let files = shown.map(|pair| PlannedFiles {
                    name: pair.name.to_string(),
                    kind: ScanKind::Character,
                    scan: pair.mesh.clone(),
                    print: pair.print.clone(),
                    labels: None,
                    unit: if self.list.is_empty() {
                        of_form
                    } else {
                        pair.unit
                    },
                });
                (files.collect::<Vec<_>>(), plan.pairs.min(KEPT_PAIRS))
            }
            Planned::Blocks(rows, _) => {
                let total = rows.len() as u64;
                let folder = Path::new(&self.list).parent().unwrap_or(Path::new(""));
                let rows = rows.into_iter().skip(start as usize).take(most);
                let files = rows.map(|row| PlannedFiles {
                    name: row.name.to_string(),
                    kind: ScanKind::Block,
                    scan: on_disk(folder, &row.mesh),
                    print: on_disk(folder, &row.page),
                    labels: row.labels.map(|labels| on_disk(folder, &labels)),
                    unit: row.unit,
                });
                (files.collect(), total)
            }
        };
        Some(PlannedPart {
            files: if is_there { files } else { Vec::new() },
            total,
        })
    }

    /// Returns the block at a place in the list that would be imported.
    pub(super) fn planned_block(
        &self,
        state: &AppState,
        roots: &PickerRoots,
        place: u64,
    ) -> Option<PlannedFiles> {
        let part = self.planned_files(state, roots, place, 1)?;
        let found = part.files.into_iter().next()?;
        (found.kind == ScanKind::Block).then_some(found)
    }

    /// Returns the limits that the files of this import will have.
    pub(super) fn limits(&self, folder: &Path) -> InputLimits {
        let dir = self.dir(folder).unwrap_or_else(|_| folder.join("new"));
        let settings = Location::new(dir).settings();
        settings.map_or(InputLimits::SUGGESTED, |settings| settings.config.limits)
    }
}

/// What was looked at for a request.
#[derive(Debug)]
pub(super) struct LookedAtFiles {
    pub(super) heads: Vec<FileHeads>,
    pub(super) total: u64,
}

/// Looks at the files of up to `most` pairs or blocks from a position on. If that takes longer than `time`, looks at fewer, but
/// at least at those of one. Ends when the caller leaves.
pub(super) async fn look(
    state: &Arc<AppState>,
    chosen: ImportChoice,
    from: u64,
    most: usize,
    time: Duration,
) -> AppResult<LookedAtFiles> {
    let state = Arc::clone(state);
    let work = async move || {
        let roots = PickerRoots::new(&state.options.folder);
        let limits = chosen.limits(&state.options.folder);
        let planned = chosen.planned_files(&state, &roots, from, most);
        let (files, total) = planned.map_or((Vec::new(), 0), |part| (part.files, part.total));
        let until = Instant::now() + time;
        let mut heads = Vec::new();
        for files in files {
            if !heads.is_empty() && Instant::now() >= until {
                break;
            }
            heads.push(files.look(&roots, &limits));
            // The caller may have left.
            tokio::task::yield_now().await;
        }
        Ok::<_, ProjectError>(LookedAtFiles { heads, total })
    };
    Ok(read_on_thread(work).await?)
}

impl PlannedFiles {
    fn look(self, roots: &PickerRoots, limits: &InputLimits) -> FileHeads {
        let scan = allowed(roots, &self.scan).and_then(|path| {
            scan_extent(&path, &limits.mesh).map_err(|why| Sentence::of_program(&why))
        });
        let print = allowed(roots, &self.print).and_then(|path| {
            image_size(&path, &limits.image).map_err(|why| Sentence::of_program(&why))
        });
        let labels = self.labels.as_deref().zip(print.as_ref().ok());
        let labels = labels.map(|(labels, size)| self.label_count(labels, *size, roots));
        FileHeads {
            scan,
            print,
            labels,
            files: self,
        }
    }

    /// Returns the number of boxes that labels have for the page.
    fn label_count(
        &self,
        labels: &Path,
        size: [u32; 2],
        roots: &PickerRoots,
    ) -> Result<(u64, LabelFormat), Sentence> {
        let labels = allowed(roots, labels)?;
        let found = page_labels(&labels, &self.print, size);
        let found = found.map_err(|why| Sentence::of_program(&why))?;
        Ok((found.boxes.len() as u64, found.format))
    }
}

/// Returns the path of a file of a list of blocks, whose name may be written differently.
fn on_disk(folder: &Path, file: &Path) -> PathBuf {
    let mut path = folder.join(file);
    // If this cannot be found out, opening the file says why.
    let _ = find_on_disk(&mut path);
    path
}

/// Returns the path of a file that may be looked at.
///
/// # Errors
/// Returns the reason if there is no such file in the folders of the user and of the app.
pub(super) fn allowed(roots: &PickerRoots, path: &Path) -> Result<PathBuf, Sentence> {
    let found = roots.allowed(path);
    found.map_err(AppFailure::into_sentence)
}
