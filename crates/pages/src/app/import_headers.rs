//! Inspects the files of an import before anything is stored: what each says of itself, or why it cannot be used.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::failure::AppResult;
use super::folder_picker::PickerRoots;
use super::import_choice::{ImportChoice, Planned, SHOWN_PAIRS};
use super::plan_cache::KEPT_PAIRS;
use super::project_places::ProjectPlaces;
use super::sentence::Sentence;
use super::state::AppState;
use mocban_core::InputLimits;
use mocban_core::domain::LengthUnit;
use mocban_core::domain::cancel::{CancelGuard, CancelToken, poll};
use mocban_core::mesh::MeshExtent;
use mocban_lists::labels::{LabelFormat, Labels};
use mocban_project::blocking::blocking;
use mocban_project::file_headers::{
    ScanKind, image_size, page_labels, page_length_mm, scan_extent,
};
use mocban_project::input_paths::find_on_disk;
use mocban_project::location::Location;
use mocban_store::Project;

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
pub(super) struct FileHeaders {
    pub(super) files: PlannedFiles,
    pub(super) scan: Result<MeshExtent, UnreadFile>,
    /// Width and height in pixels.
    pub(super) print: Result<[u32; 2], UnreadFile>,
    /// Length of the longer side of the page of a block in mm, if its file says so.
    pub(super) page_mm: Option<f64>,
    /// The number of boxes of the labels, and their format. `None` without labels, or if the page cannot be used.
    pub(super) labels: Option<Result<(u64, LabelFormat), UnreadFile>>,
}

/// Why nothing is known of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum UnreadFile {
    /// It cannot be used.
    Unusable(Sentence),
    /// It is outside the folders of the user and of the app, where only an import and a run look.
    Outside,
}

impl UnreadFile {
    /// Makes a reason of a message of the program.
    pub(super) fn of_program(why: &str) -> Self {
        Self::Unusable(Sentence::of_program(why))
    }

    /// Returns the reason.
    pub(super) fn sentence(&self) -> Sentence {
        match self {
            Self::Unusable(why) => why.clone(),
            Self::Outside => Sentence::new(
                "not looked at: it is outside your folders and disks",
                "không kiểm tra: tệp nằm ngoài các thư mục và ổ đĩa của bạn",
            ),
        }
    }
}

/// Some files of an import.
#[derive(Debug)]
pub(super) struct PlannedPart {
    pub(super) files: Vec<PlannedFiles>,
    /// Number of pairs or blocks whose files can be looked at.
    pub(super) reachable: u64,
    /// Number of all pairs or blocks.
    pub(super) total: u64,
}

impl ImportChoice {
    /// Returns up to `most` pairs or blocks that would be imported, from a position on. `None` if nothing would be.
    fn planned_files(
        &self,
        state: &AppState,
        places: &FilePlaces,
        start: u64,
        most: usize,
    ) -> Option<PlannedPart> {
        // A page of the preview starts with whole groups.
        let from = start / SHOWN_PAIRS * SHOWN_PAIRS;
        let known = (start - from) as usize;
        let dir = &places.dir;
        // Past the end, a preview has the last ones.
        let mut is_there = true;
        let planned = if let Some((plan, at)) = self.kept_plan(dir, from, &state.plans) {
            Planned::Pairs(plan, at)
        } else {
            let preview = self.preview(dir, &places.roots, from, &state.plans)?;
            is_there = preview.from == from;
            preview.planned.ok()?
        };
        let of_form = self.unit.parse::<LengthUnit>().ok();
        let (mut files, total): (Vec<_>, u64) = match planned {
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
                (files.collect(), plan.pairs)
            }
            Planned::Blocks(read, _) => {
                let total = read.rows.len() as u64;
                let folder = Path::new(&self.list).parent().unwrap_or(Path::new(""));
                let rows = read.rows.into_iter().skip(start as usize).take(most);
                let files = rows.map(|row| PlannedFiles {
                    name: row.name.to_string(),
                    kind: ScanKind::Block,
                    scan: places.on_disk(folder, row.mesh),
                    print: places.on_disk(folder, row.page),
                    labels: row.labels.map(|labels| places.on_disk(folder, labels)),
                    unit: row.unit,
                });
                (files.collect(), total)
            }
        };
        if !is_there {
            files.clear();
        }
        let reachable = total.min(KEPT_PAIRS);
        Some(PlannedPart {
            files,
            reachable,
            total,
        })
    }

    /// Returns the block at a place in the list that would be imported.
    pub(super) fn planned_block(
        &self,
        state: &AppState,
        places: &FilePlaces,
        place: u64,
    ) -> Option<PlannedFiles> {
        let part = self.planned_files(state, places, place, 1)?;
        let found = part.files.into_iter().next()?;
        (found.kind == ScanKind::Block).then_some(found)
    }
}

/// Where the files of an import are, and which of them may be opened.
#[derive(Debug)]
pub(super) struct FilePlaces {
    roots: PickerRoots,
    /// The folder of the project of the import.
    dir: PathBuf,
    /// The project of the import, which need not exist. Its settings may name folders and object stores.
    project: Project,
}

impl FilePlaces {
    pub(super) fn new(chosen: &ImportChoice, folder: &Path) -> Self {
        let dir = ProjectPlaces::find(folder).dir_or_new(&chosen.project);
        let location = Location::new(&dir);
        let storage = location
            .data_locations()
            .ok()
            .and_then(|(storage, _)| storage);
        Self {
            roots: PickerRoots::new(folder),
            dir,
            project: Project::at(&location.dir).with_storage(storage),
        }
    }

    /// Returns the limits that the files of this import will have.
    pub(super) fn limits(&self) -> InputLimits {
        let settings = Location::new(&self.dir).settings();
        settings.map_or(InputLimits::SUGGESTED, |settings| settings.config.limits)
    }

    /// Returns the stored path of a file below a folder or an object store of the settings.
    fn below_root<'p>(&self, path: &'p Path) -> Option<&'p str> {
        path.to_str()
            .filter(|path| self.project.is_below_root(path))
    }

    /// Returns the path of a file of a list of blocks, whose name may be written differently.
    fn on_disk(&self, folder: &Path, file: PathBuf) -> PathBuf {
        if self.below_root(&file).is_some() {
            return file;
        }
        let mut path = folder.join(file);
        // If this cannot be found out, opening the file says why.
        let _ = find_on_disk(&mut path);
        path
    }

    /// Returns the path of a file that may be looked at.
    ///
    /// # Errors
    /// Returns an error if there is no such file in the folders of the user and of the app.
    pub(super) fn allowed(&self, path: &Path) -> Result<PathBuf, UnreadFile> {
        if let Some(stored) = self.below_root(path) {
            let found = self.roots.allowed(&self.project.input_path(stored));
            return found.map_err(|_outside| UnreadFile::Outside);
        }
        self.roots
            .allowed(path)
            .map_err(|why| match path.try_exists() {
                Ok(true) => UnreadFile::Outside,
                Ok(false) | Err(_) => UnreadFile::Unusable(why.into_sentence()),
            })
    }

    /// Reads a file that may be looked at.
    ///
    /// # Errors
    /// Returns an error if there is no such file in the folders of the user and of the app, or if it cannot be used.
    pub(super) fn read<T>(
        &self,
        path: &Path,
        read: impl FnOnce(&Path) -> Result<T, String>,
    ) -> Result<T, UnreadFile> {
        read(&self.allowed(path)?).map_err(|why| UnreadFile::of_program(&why))
    }
}

/// What was inspected for a request.
#[derive(Debug, Default)]
pub(super) struct InspectedFiles {
    pub(super) headers: Vec<FileHeaders>,
    /// Number of pairs or blocks that the request asked for.
    pub(super) asked: usize,
    /// Number of pairs or blocks whose files can be looked at.
    pub(super) reachable: u64,
    /// Number of all pairs or blocks.
    pub(super) total: u64,
}

/// Inspects the files of up to `most` pairs or blocks from a position on: of fewer if that takes longer than `time`, but at
/// least of one. Ends when the caller leaves.
pub(super) async fn inspect(
    state: &Arc<AppState>,
    chosen: ImportChoice,
    from: u64,
    most: usize,
    time: Duration,
) -> AppResult<InspectedFiles> {
    let state = Arc::clone(state);
    let token = CancelToken::default();
    let _leaves = CancelGuard(token.clone());
    let work = move || {
        token
            .run(|| inspected(&state, &chosen, (from, most), time))
            .ok()
    };
    // It is cancelled only if the caller has left.
    Ok(blocking(work).await?.unwrap_or_default())
}

fn inspected(
    state: &AppState,
    chosen: &ImportChoice,
    (from, most): (u64, usize),
    time: Duration,
) -> InspectedFiles {
    let places = FilePlaces::new(chosen, &state.options.folder);
    let limits = places.limits();
    let Some(part) = chosen.planned_files(state, &places, from, most) else {
        return InspectedFiles::default();
    };
    let asked = part.files.len();
    let until = Instant::now() + time;
    let mut headers = Vec::new();
    for files in part.files {
        poll();
        if !headers.is_empty() && Instant::now() >= until {
            break;
        }
        headers.push(files.inspect(&places, &limits));
    }
    InspectedFiles {
        headers,
        asked,
        reachable: part.reachable,
        total: part.total,
    }
}

impl PlannedFiles {
    fn inspect(self, places: &FilePlaces, limits: &InputLimits) -> FileHeaders {
        let scan = places.read(&self.scan, |path| scan_extent(path, &limits.mesh));
        let is_page = self.kind == ScanKind::Block;
        let mut page_mm = None;
        let print = places.read(&self.print, |path| {
            let size = image_size(path, &limits.image)?;
            page_mm = is_page
                .then(|| page_length_mm(path, || Some(size)))
                .flatten();
            Ok(size)
        });
        let labels = self.labels.as_deref().zip(print.as_ref().ok());
        let labels = labels.map(|(labels, size)| {
            let found = self.boxes(labels, *size, places);
            found.map(|found| (found.boxes.len() as u64, found.format))
        });
        FileHeaders {
            scan,
            print,
            page_mm,
            labels,
            files: self,
        }
    }

    /// Returns the boxes that labels have for the page, which they know by its name in the list.
    pub(super) fn boxes(
        &self,
        labels: &Path,
        size: [u32; 2],
        places: &FilePlaces,
    ) -> Result<Labels, UnreadFile> {
        places.read(labels, |labels| page_labels(labels, &self.print, size))
    }
}
