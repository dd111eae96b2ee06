//! Imports whole blocks with their pages into a project, which is created if there is none.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::block_files;
use crate::block_scale;
use crate::empty_import;
use crate::error::ProjectResult;
use crate::events::{Listener, LongWork};
use crate::exit::Refusal;
use crate::files::{self, HEAD_BYTES, ListFile};
use crate::import_pairs::{AllowedChanges, PairSource};
use crate::input_paths::{find_on_disk, in_existing_form};
use crate::location::{Location, now};
use crate::lost_values::lost_values;
use crate::manifest_file::{is_below_root, refuse};
use crate::missing_files::{MissingFiles, locate_file};
use crate::new_project::{import_with, warn_about_name};
use crate::renamed_columns::renamed_columns;
use crate::repeated_files::RepeatedFiles;
use crate::unusable_files::FileSearches;
use mocban_catalog::{BlockAttributes, BlockImportSummary, SameFiles};
use mocban_core::domain::{BlockName, BlockSide, FileKind, LengthUnit};
use mocban_lists::manifest::{
    BlockRow, ListKind, ReadBlocks, is_named_like_mesh, read_block_json, read_blocks,
};
use mocban_store::Project;

/// What an import of blocks changed.
#[derive(Debug)]
pub struct BlockImportOutcome {
    /// Blocks by what happened to them.
    pub summary: BlockImportSummary,
    /// Files that do not exist.
    pub missing: MissingFiles,
    /// Warnings about the list, one line each.
    pub warnings: Vec<String>,
    /// Which columns of the list were read under other names.
    pub renamed: Option<String>,
}

/// Blocks to import.
struct BlockListing {
    rows: Vec<BlockRow>,
    /// Whether the source can have metadata. If not, known blocks keep theirs.
    has_metadata: bool,
    /// Label of row numbers in messages: `blocks.csv: line`, or `block` for a single one.
    label: String,
    warnings: Vec<String>,
    /// Which columns were read under other names.
    renamed: Option<String>,
}

/// Where the blocks of an import are named.
#[derive(Debug)]
pub enum BlockSource {
    /// By its files.
    One(ImportedBlock),
    /// In a list.
    List {
        /// Its path.
        file: PathBuf,
        /// Its content. It is read once, because it may be a pipe.
        bytes: Vec<u8>,
    },
}

/// The files of one block.
#[derive(Debug, Clone)]
pub struct ImportedBlock {
    /// The scan.
    pub mesh: PathBuf,
    /// The image of the printed page.
    pub page: PathBuf,
    /// Boxes of the characters on the page; a run finds them otherwise.
    pub labels: Option<PathBuf>,
    /// The side of the block that the page shows; a run finds it otherwise.
    pub side: Option<BlockSide>,
    /// Id of the block; by default the file name of the mesh without extension.
    pub name: Option<String>,
    /// Unit of the mesh.
    pub unit: Option<LengthUnit>,
}

/// What a list names.
#[derive(Debug)]
pub enum ListedItems {
    /// Whole blocks.
    Blocks(BlockSource),
    /// Pairs.
    Pairs(PairSource),
}

impl ListedItems {
    /// Reads a list, or a sheet of a workbook, and decides from its columns and rows what it names. Returns a warning about
    /// other sheets, values that are left out, and a decision that the columns alone do not say, too.
    pub fn of(file: &Path, sheet: Option<&str>) -> ProjectResult<(Self, Option<String>)> {
        let file = &*in_existing_form(file);
        let pairs = |bytes| PairSource::List {
            file: file.to_owned(),
            bytes,
        };
        if file.is_dir() {
            return Ok((Self::Pairs(pairs(None)), None));
        }
        let ListFile { bytes, warning } = files::read_list(file, sheet)?;
        refuse_input(file, &bytes)?;
        let kind = if files::is_jsonl(file, &bytes) {
            ListKind::of_json(&bytes)
        } else {
            ListKind::of_csv(&bytes)
        };
        let items = if kind.is_of_blocks {
            Self::Blocks(BlockSource::List {
                file: file.to_owned(),
                bytes,
            })
        } else {
            Self::Pairs(pairs(Some(bytes)))
        };
        let warning = match (warning, kind.note) {
            (Some(warning), Some(note)) => Some(format!("{warning}; {note}")),
            (None, Some(note)) => Some(format!("{}: {note}", file.display())),
            (warning, None) => warning,
        };
        Ok((items, warning))
    }
}

/// Refuses a mesh or an image in place of a list.
fn refuse_input(file: &Path, bytes: &[u8]) -> Result<(), Refusal> {
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    let what = match FileKind::of(head) {
        kind @ (FileKind::Ply
        | FileKind::OtherMesh(_)
        | FileKind::Png
        | FileKind::Jpeg
        | FileKind::Tiff
        | FileKind::OtherImage(_)) => kind.description(),
        FileKind::Text | FileKind::Binary if is_named_like_mesh(file) => "a mesh",
        _ => return Ok(()),
    };
    let shown = file.display();
    Err(Refusal::Usage(format!(
        "{shown} is {what}, not a list; name folders with --meshes DIR --prints DIR, or a list of pairs"
    )))
}

/// Imports blocks. If the import fails, no block is imported.
pub async fn import_blocks(
    source: &BlockSource,
    allowed: AllowedChanges,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<BlockImportOutcome> {
    let _work = LongWork::begin(listener, "importing");
    let (storage, url) = location.data_locations()?;
    let project = Project::at(&location.dir).with_storage(storage);
    warn_about_name(project.dir(), listener);
    let mut listing = listing(source, &project)?;
    let (mut missing, mut searches) = (MissingFiles::default(), FileSearches::default());
    for row in &mut listing.rows {
        locate(row, &listing.label, &project, &mut missing, &mut searches);
    }
    if missing.count > 0 && !allowed.missing {
        return Err(missing.refusal().into());
    }
    if missing.count == 0 {
        block_files::check(&listing.rows, &listing.label, &project)?;
    }
    listing.warnings.extend(searches.warnings());
    let limits = location.settings()?.config.limits;
    let doubts = block_scale::doubts(&listing.rows, &listing.label, &project, &limits);
    listing.warnings.extend(doubts);
    let has_metadata = listing.has_metadata;
    let rows = listing.rows.into_iter();
    let rows = rows.map(|row| stored_row(row, has_metadata, &project));
    let rows: Arc<[BlockAttributes]> = rows.collect::<ProjectResult<_>>()?;
    let summary = import_with(&project, url.as_deref(), async |catalog| {
        let rows = Arc::clone(&rows);
        Ok(catalog.import_blocks(rows, allowed.files, now()).await?)
    });
    let summary = summary.await?;
    let same_files = summary.same_files.as_ref().map(
        |SameFiles { id, known, count }| {
            format!("blocks with the same scan and page as one of the project: {count}, first {id}, as {known}")
        },
    );
    listing.warnings.extend(same_files);
    let lost = lost_values(&summary.lost, "block");
    listing.warnings.extend(lost);
    // Pairs are cut from blocks by a run.
    listing.warnings.extend(empty_import::note(&project, now()));
    Ok(BlockImportOutcome {
        summary,
        missing,
        warnings: listing.warnings,
        renamed: listing.renamed,
    })
}

/// Parses a list of blocks in CSV or JSON. Returns the warnings of an import, too.
///
/// # Errors
/// Returns an error if an import would refuse the list.
pub fn listed_blocks(file: &Path, bytes: &[u8]) -> ProjectResult<ReadBlocks> {
    let read = if files::is_jsonl(file, bytes) {
        read_block_json(bytes)
    } else {
        read_blocks(bytes)
    };
    let mut read = read.map_err(|problems| refuse(file, &problems))?;
    let mut repeated = RepeatedFiles::default();
    for row in &read.rows {
        repeated.add(row.line, row.name.as_str(), &row.mesh, &row.page);
    }
    let repeated = repeated.warning("blocks with the same scan and page");
    read.warnings.extend(repeated);
    Ok(read)
}

/// Returns the blocks to import. Paths start with the folder of the list, except those below a named root of the project.
fn listing(source: &BlockSource, project: &Project) -> ProjectResult<BlockListing> {
    let (file, bytes) = match source {
        BlockSource::List { file, bytes } => (file, bytes),
        BlockSource::One(files) => {
            return Ok(BlockListing {
                rows: vec![BlockRow {
                    line: 1,
                    name: name(files.name.as_deref(), &files.mesh)?,
                    mesh: files.mesh.clone(),
                    page: files.page.clone(),
                    labels: files.labels.clone(),
                    unit: files.unit,
                    side: files.side,
                    meta: BTreeMap::new(),
                }],
                has_metadata: false,
                label: "block".to_owned(),
                warnings: Vec::new(),
                renamed: None,
            });
        }
    };
    let ReadBlocks {
        mut rows,
        renamed,
        warnings,
    } = listed_blocks(file, bytes)?;
    let folder = file.parent().unwrap_or(Path::new(""));
    for path in rows.iter_mut().flat_map(|row| local_paths(row, project)) {
        *path = folder.join(&*path);
    }
    Ok(BlockListing {
        rows,
        has_metadata: true,
        label: format!("{}: line", file.display()),
        warnings,
        renamed: renamed_columns(&renamed),
    })
}

/// Returns the paths of the files of a row that are not below a named root of the project.
fn local_paths<'r>(
    row: &'r mut BlockRow,
    project: &Project,
) -> impl Iterator<Item = &'r mut PathBuf> + use<'r> {
    let BlockRow {
        mesh, page, labels, ..
    } = row;
    let paths = [Some(mesh), Some(page), labels.as_mut()];
    let is_local = |path: &&mut PathBuf| !is_below_root(path, project);
    paths
        .map(|path| path.filter(is_local))
        .into_iter()
        .flatten()
}

/// Returns the given name, or the name of the mesh file without its extension.
fn name(given: Option<&str>, mesh: &Path) -> ProjectResult<BlockName> {
    let stem = mesh.file_stem().unwrap_or_default().to_string_lossy();
    BlockName::new(given.unwrap_or(&stem)).map_err(|error| {
        let text = format!("{}: {error}; give another one with --name", mesh.display());
        Refusal::Usage(text).into()
    })
}

/// Replaces the paths of a row by those on disk, and records missing files.
fn locate(
    row: &mut BlockRow,
    label: &str,
    project: &Project,
    missing: &mut MissingFiles,
    searches: &mut FileSearches,
) {
    let (line, name) = (row.line, row.name.clone());
    let required = [("mesh", &mut row.mesh), ("page", &mut row.page)].into_iter();
    for (kind, path) in required.chain(row.labels.as_mut().map(|path| ("labels", path))) {
        if let Err(line) = locate_file((label, line), kind, path, &name, project, searches) {
            missing.add(line);
        }
    }
}

/// Returns blocks as an import into a project would store them. Without a list, they have no metadata. Files need not exist.
///
/// # Errors
/// Returns an error if a path cannot be stored.
pub fn rows_as_stored(
    rows: Vec<BlockRow>,
    list: Option<&Path>,
    project: &Project,
) -> ProjectResult<Vec<BlockAttributes>> {
    let folder = list.and_then(Path::parent).unwrap_or(Path::new(""));
    let rows = rows.into_iter().map(|mut row| {
        for path in local_paths(&mut row, project) {
            *path = folder.join(&*path);
            // What cannot be found has the path of the list.
            let _ = find_on_disk(path);
        }
        stored_row(row, list.is_some(), project)
    });
    rows.collect()
}

fn stored_row(
    row: BlockRow,
    has_metadata: bool,
    project: &Project,
) -> ProjectResult<BlockAttributes> {
    let stored = |path: &PathBuf| project.stored_path(path);
    Ok(BlockAttributes {
        name: row.name,
        mesh_path: stored(&row.mesh)?,
        page_path: stored(&row.page)?,
        labels_path: row.labels.as_ref().map(stored).transpose()?,
        unit: row.unit,
        side: row.side,
        meta: has_metadata.then(|| row.meta.into_iter().collect()),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::{BlockSource, ListedItems, listed_blocks, listing, rows_as_stored};
    use mocban_store::{Project, ProjectStorage, StorageOptions};

    #[test]
    fn paths_below_a_named_root_do_not_depend_on_the_folder_of_the_list() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let within = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
        let options = StorageOptions {
            artifacts: String::new(),
            roots: BTreeMap::from([("nas".to_owned(), within("nas"))]),
            cache: within("cache"),
            cache_bytes: 1,
        };
        let storage = ProjectStorage::open(&options).expect("valid settings");
        let project = Project::at(&dir.path().join("p")).with_storage(storage);
        let (file, bytes) = (
            dir.path().join("lists/b.csv"),
            b"block,mesh,page\nb,nas:b.stl,b.png\n".to_vec(),
        );
        let read = listed_blocks(&file, &bytes).expect("a list");
        let stored = rows_as_stored(read.rows, Some(&file), &project).expect("paths");
        assert_eq!(stored[0].mesh_path, "nas:b.stl");
        let listed = listing(&BlockSource::List { file, bytes }, &project).expect("a list");
        assert_eq!(listed.rows[0].mesh, Path::new("nas:b.stl"));
        assert_eq!(listed.rows[0].page, dir.path().join("lists/b.png"));
    }

    #[test]
    fn the_same_files_under_the_ids_of_two_blocks_are_counted_with_the_first() {
        let warnings = |rows: &str| {
            let list = format!("block,mesh,page\n{rows}");
            let read = listed_blocks(Path::new("blocks.csv"), list.as_bytes());
            read.expect("valid").warnings
        };
        let sentence =
            "blocks with the same scan and page as an earlier one: 1, first b, as on line 2";
        assert_eq!(warnings("a,a.stl,a.png\nb,./a.stl,a.png\n"), [sentence]);
        assert_eq!(warnings("a,a.stl,a.png\nb,a.stl,b.png\n"), [""; 0]);
    }

    #[test]
    fn a_decision_between_pairs_and_blocks_is_said() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("list.csv");
        for (list, is_of_blocks, expected) in [
            (
                "Nr,Ván,Bản quét,Bản in,Trang in\n1,b,1.stl,1.png,b.jpg\n",
                false,
                "a list of pairs",
            ),
            (
                "id,block,mesh,page\n1,b,1.stl,b.jpg\n",
                true,
                "a list of blocks",
            ),
        ] {
            std::fs::write(&file, list).expect("written");
            let (items, warning) = ListedItems::of(&file, None).expect("a list");
            assert_eq!(
                matches!(items, ListedItems::Blocks(_)),
                is_of_blocks,
                "{list}"
            );
            let warning = warning.expect("a note");
            assert!(
                warning.contains(&format!("list.csv: this is read as {expected}")),
                "{warning}"
            );
        }
    }

    #[test]
    fn other_files_in_place_of_a_list_are_named() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let advice = "not a list; name folders with --meshes DIR --prints DIR, or a list of pairs";
        for (name, bytes, expected) in [
            ("a.ply", &b"ply\nformat ascii 1.0\n"[..], format!("a.ply is a PLY mesh, {advice}")),
            ("a.stl", b"solid a", format!("a.stl is a mesh, {advice}")),
            (
                "b.csv",
                b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
                "b.csv is a pointer of Git LFS and does not hold the file; fetch the file with `git lfs pull`".to_owned(),
            ),
            ("a.csv", b"\x89PNG\r\n\x1a\n", format!("a.csv is a PNG image, {advice}")),
            (
                "a.xls",
                b"<html><table></table></html>",
                "a.xls is an HTML table; save it as XLSX or as \"CSV UTF-8\" in the spreadsheet program".to_owned(),
            ),
        ] {
            let file = dir.path().join(name);
            std::fs::write(&file, bytes).expect("written");
            let refused = ListedItems::of(&file, None).expect_err("no list").to_string();
            assert!(refused.ends_with(&expected), "{refused}");
        }
    }
}
