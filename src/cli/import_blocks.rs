//! `import --block` and `import` of a list of blocks: adds whole blocks with their pages to the project.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use super::context::{Context, now};
use super::exit::Refusal;
use super::files;
use super::manifest_file::{locate_file, refuse};
use super::missing_files::MissingFiles;
use super::new_project::import_with;
use super::table::count;
use mocban_catalog::{BlockAttributes, BlockImportSummary};
use mocban_core::domain::{BlockName, BlockSide, LengthUnit};
use mocban_lists::manifest::{BlockRow, is_block_list, parse_blocks};
use mocban_store::Project;

/// What an import of blocks changed.
#[derive(Debug)]
pub(super) struct BlockImportOutcome {
    summary: BlockImportSummary,
    missing: MissingFiles,
}

/// Blocks to import.
struct BlockListing {
    rows: Vec<BlockRow>,
    /// Label of row numbers in messages: `blocks.csv: line`, or `block` for a single one.
    label: String,
}

/// Arguments of an import of one block.
#[derive(Debug, Default, Args)]
pub(super) struct BlockArgs {
    /// The scan of a whole block, from which `run` cuts the characters as pairs
    #[arg(
        long,
        value_name = "MESH",
        requires = "page",
        conflicts_with = "meshes"
    )]
    pub(super) block: Option<PathBuf>,
    /// The image of the printed page of --block
    #[arg(long, value_name = "IMAGE", requires = "block")]
    pub(super) page: Option<PathBuf>,
    /// Boxes of the characters on --page, such as a project of the VGG Image Annotator [default: found by `run`]
    #[arg(long, value_name = "FILE", requires = "block")]
    pub(super) labels: Option<PathBuf>,
    /// The side of --block that the page shows: front (towards the positive direction of the nearest axis of the mesh)
    /// or back [default: found by `run`]
    #[arg(long, requires = "block")]
    pub(super) side: Option<BlockSide>,
    /// Id of --block [default: the file name of the mesh without extension]
    #[arg(long, requires = "block")]
    pub(super) name: Option<String>,
}

/// Where the blocks of an import are named.
#[derive(Debug)]
pub(super) enum BlockSource<'a> {
    /// On the command line.
    One {
        /// The arguments.
        args: &'a BlockArgs,
        /// Unit of the mesh.
        unit: Option<LengthUnit>,
    },
    /// In a list.
    List {
        /// Its path.
        file: &'a Path,
        /// Its content. It is read once, because it may be a pipe.
        bytes: Vec<u8>,
    },
}

/// What an import adds.
#[derive(Debug)]
pub(super) enum Imported<'a> {
    /// Whole blocks.
    Blocks(BlockSource<'a>),
    /// Pairs, with the content of their list, if they have one.
    Pairs(Option<Vec<u8>>),
}

impl<'a> Imported<'a> {
    /// Decides from the arguments and the header of the list what is imported.
    ///
    /// # Errors
    /// Returns an error if the list cannot be read.
    pub(super) fn of(
        file: Option<&'a Path>,
        args: &'a BlockArgs,
        unit: Option<LengthUnit>,
    ) -> anyhow::Result<Self> {
        if args.block.is_some() {
            return Ok(Self::Blocks(BlockSource::One { args, unit }));
        }
        let Some(file) = file.filter(|file| !file.is_dir()) else {
            return Ok(Self::Pairs(None));
        };
        let bytes = files::read(file)?;
        let is_list = !files::is_jsonl(file, &bytes) && is_block_list(&bytes);
        Ok(if is_list {
            Self::Blocks(BlockSource::List { file, bytes })
        } else {
            Self::Pairs(Some(bytes))
        })
    }
}

/// Imports blocks. If the import fails, no block is imported.
///
/// # Errors
/// Returns an error if the list is refused, files are missing, or the catalog or the disk fails.
pub(super) async fn import_blocks(
    source: &BlockSource<'_>,
    allow_missing: bool,
    context: &Context,
) -> anyhow::Result<BlockImportOutcome> {
    let mut listing = listing(source)?;
    let (storage, url) = context.data_locations()?;
    let project = Project::at(&context.dir()).with_storage(storage);
    let mut missing = MissingFiles::default();
    for row in &mut listing.rows {
        locate(row, &listing.label, &project, &mut missing);
    }
    if missing.count > 0 && !allow_missing {
        return Err(missing.refusal().into());
    }
    let rows = listing.rows.iter().map(|row| stored_row(row, &project));
    let rows: Vec<BlockAttributes> = rows.collect::<Result<_, _>>()?;
    let checked = async || Ok(());
    let summary = import_with(&project, url.as_deref(), checked, async |catalog| {
        Ok(catalog.import_blocks(rows.clone(), now()).await?)
    });
    Ok(BlockImportOutcome {
        summary: summary.await?,
        missing,
    })
}

fn listing(source: &BlockSource<'_>) -> anyhow::Result<BlockListing> {
    let (file, bytes) = match source {
        BlockSource::List { file, bytes } => (file, bytes),
        BlockSource::One { args, unit } => {
            let (Some(mesh), Some(page)) = (&args.block, &args.page) else {
                anyhow::bail!("give --block and --page");
            };
            return Ok(BlockListing {
                rows: vec![BlockRow {
                    line: 1,
                    name: name(args.name.as_deref(), mesh)?,
                    mesh: mesh.clone(),
                    page: page.clone(),
                    labels: args.labels.clone(),
                    unit: *unit,
                    side: args.side,
                }],
                label: "block".to_owned(),
            });
        }
    };
    let mut rows = parse_blocks(bytes).map_err(|problems| refuse(file, &problems))?;
    let folder = file.parent().unwrap_or(Path::new(""));
    for row in &mut rows {
        let paths = [&mut row.mesh, &mut row.page].into_iter();
        for path in paths.chain(row.labels.as_mut()) {
            *path = folder.join(&*path);
        }
    }
    Ok(BlockListing {
        rows,
        label: format!("{}: line", file.display()),
    })
}

/// Returns the given name, or the name of the mesh file without its extension.
fn name(given: Option<&str>, mesh: &Path) -> anyhow::Result<BlockName> {
    let stem = mesh.file_stem().unwrap_or_default().to_string_lossy();
    BlockName::new(given.unwrap_or(&stem)).map_err(|error| {
        let text = format!("{}: {error}; give another one with --name", mesh.display());
        Refusal::Usage(text).into()
    })
}

/// Replaces the paths of a row by those on disk, and records missing files.
fn locate(row: &mut BlockRow, label: &str, project: &Project, missing: &mut MissingFiles) {
    let (line, name) = (row.line, row.name.clone());
    let required = [("mesh", &mut row.mesh), ("page", &mut row.page)].into_iter();
    for (kind, path) in required.chain(row.labels.as_mut().map(|path| ("labels", path))) {
        if let Some(line) = locate_file((label, line), kind, path, &name, project) {
            missing.add(line);
        }
    }
}

fn stored_row(row: &BlockRow, project: &Project) -> anyhow::Result<BlockAttributes> {
    let stored = |path: &PathBuf| project.stored_path(path);
    Ok(BlockAttributes {
        name: row.name.clone(),
        mesh_path: stored(&row.mesh)?,
        page_path: stored(&row.page)?,
        labels_path: row.labels.as_ref().map(stored).transpose()?,
        unit: row.unit,
        side: row.side,
    })
}

/// Prints what an import changed.
pub(super) fn print_outcome(outcome: &BlockImportOutcome, context: &Context) {
    for line in &outcome.missing.lines {
        context.warn(line);
    }
    let summary = &outcome.summary;
    context.info(&format!(
        "{} added, {} changed, {} unchanged",
        count(summary.added, "block"),
        summary.changed.len(),
        summary.unchanged
    ));
    for (name, fields) in &summary.changed {
        context.info(&format!("  {name}: {} changed", fields.join(", ")));
    }
}

pub(super) fn as_json(outcome: &BlockImportOutcome) -> Value {
    let summary = &outcome.summary;
    let changed = summary.changed.iter();
    let changed = changed.map(|(name, fields)| json!({"id": name, "fields": fields}));
    json!({
        "schema": 1,
        "blocks": {
            "added": summary.added,
            "changed": changed.collect::<Value>(),
            "unchanged": summary.unchanged,
        },
        "missing_files": outcome.missing.lines,
    })
}
