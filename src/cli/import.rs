//! `import`: takes pairs of meshes and prints into the project, and makes it where there is none.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use serde_json::{Value, json};
use tokio::sync::mpsc;

use super::context::{Context, now};
use super::exit::{ExitCode, Refusal};
use super::files;
use super::manifest_file::Listing;
use super::output;
use super::table::count;
use super::truth_file::{self, refusal};
use crate::catalog::{Catalog, ImportChunk, ImportRow, ImportSummary};
use crate::domain::{LengthUnit, PairName};
use crate::manifest::{Ids, ManifestRow};
use crate::store::Project;

/// Rows handed to the catalog at a time, and how many times it may be behind.
const CHUNK: usize = 2_000;
const CHUNKS_AHEAD: usize = 2;

/// Arguments of `import`.
#[derive(Debug, Default, Args)]
pub(super) struct ImportArgs {
    /// A CSV or JSON Lines file with the columns id, mesh, print and if wanted character, block, unit,
    /// `scanned_face_down`; paths are relative to the file
    #[arg(required_unless_present = "meshes", conflicts_with = "meshes")]
    pub(super) file: Option<PathBuf>,
    /// A folder of meshes, paired with --prints by file stem
    #[arg(long, value_name = "DIR", requires = "prints")]
    pub(super) meshes: Option<PathBuf>,
    /// A folder of prints
    #[arg(long, value_name = "DIR", requires = "meshes")]
    pub(super) prints: Option<PathBuf>,
    /// Unit of the meshes of a folder: mm, cm, m or in
    #[arg(long, requires = "meshes")]
    pub(super) unit: Option<LengthUnit>,
    /// True alignments, one JSON object a line; the report then tells how far results are from them
    #[arg(long, value_name = "FILE")]
    pub(super) truth: Option<PathBuf>,
}

pub(super) async fn import(args: ImportArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let taken = take(&args, context).await?;
    if context.global.json {
        output::print_json(&as_json(&taken))?;
    }
    tell(&taken, context);
    context.output.next(&context.command("run"));
    Ok(ExitCode::Done)
}

/// What an import did.
#[derive(Debug)]
pub(super) struct Taken {
    pub(super) summary: ImportSummary,
    pub(super) truths: u64,
    missing: Vec<String>,
    remarks: Vec<String>,
}

/// Imports: everything is read and checked before anything is written.
///
/// # Errors
/// When a list is refused, or catalog or disk refuse.
pub(super) async fn take(args: &ImportArgs, context: &Context) -> anyhow::Result<Taken> {
    let mut listing = listing(args)?;
    let remarks = std::mem::take(&mut listing.remarks);
    let dir = context.dir();
    let truths = match &args.truth {
        Some(file) => read_truths(file, &listing.ids, &dir).await?,
        None => Vec::new(),
    };
    let project = Project::at(&dir);
    let truths = stored_truths(truths, &project)?;
    let before = Before::of(&project);
    let stored = store(&project, listing, truths).await;
    if stored.is_err() {
        before.restore(&project);
    }
    let (summary, truths, missing) = stored?;
    Ok(Taken {
        summary,
        truths,
        missing,
        remarks,
    })
}

/// Stores the list; gives what changed, how many true alignments were stored, and a line for each file that is not
/// there.
async fn store(
    project: &Project,
    listing: Listing,
    truths: Vec<(PairName, Value)>,
) -> anyhow::Result<(ImportSummary, u64, Vec<String>)> {
    Project::create(project.dir())?;
    let catalog = Catalog::create(&project.catalog_path()).await?;
    let (sender, rows) = mpsc::channel(CHUNKS_AHEAD);
    let of = project.clone();
    let fed = tokio::task::spawn_blocking(move || feed(listing, &of, &sender));
    let stored = catalog.import_all(rows, truths, now()).await;
    catalog.close().await;
    // Where a row cannot be made, that says more than that the import was cut short.
    let missing = fed.await.context("the list's reader stopped")??;
    let (summary, truths) = stored?;
    Ok((summary, truths, missing))
}

/// Makes the rows and hands them on, some at a time; gives a line for each file that is not there.
fn feed(
    listing: Listing,
    project: &Project,
    sender: &mpsc::Sender<ImportChunk>,
) -> anyhow::Result<Vec<String>> {
    let (mut missing, mut chunk) = (Vec::new(), Vec::new());
    let mut outcome = Ok(());
    listing.rows(|row, lines| {
        missing.extend(lines);
        match stored_row(&row, project) {
            Ok(row) => chunk.push(row),
            Err(error) if outcome.is_ok() => outcome = Err(error),
            Err(_) => {}
        }
        if chunk.len() == CHUNK {
            // The catalog hears no more after an error of its own, which is told there.
            let _ = sender.blocking_send(ImportChunk::Rows(std::mem::take(&mut chunk)));
        }
    });
    outcome?;
    for last in [ImportChunk::Rows(chunk), ImportChunk::End] {
        let _ = sender.blocking_send(last);
    }
    Ok(missing)
}

/// What was there before an import, so that one that fails leaves no half-made project.
struct Before {
    dir: bool,
    catalog: bool,
}

impl Before {
    fn of(project: &Project) -> Self {
        Self {
            dir: project.dir().exists(),
            catalog: project.catalog_path().exists(),
        }
    }

    /// Takes away what was not there. What cannot be removed is an empty project, which harms nobody.
    fn restore(&self, project: &Project) {
        if !self.catalog {
            for ending in ["", "-wal", "-shm", "-journal"] {
                let mut name = project.catalog_path().into_os_string();
                name.push(ending);
                let _ = std::fs::remove_file(name);
            }
        }
        if !self.dir {
            // Only where it is empty.
            let _ = std::fs::remove_dir(project.dir());
        }
    }
}

fn listing(args: &ImportArgs) -> anyhow::Result<Listing> {
    match (&args.file, &args.meshes, &args.prints) {
        (Some(file), ..) => Listing::from_file(file),
        (None, Some(meshes), Some(prints)) => Listing::from_folders(meshes, prints, args.unit),
        (None, ..) => anyhow::bail!("give a manifest, or --meshes and --prints"),
    }
}

/// Reads true alignments and refuses those of pairs that are neither in the list nor in the project.
async fn read_truths(
    file: &Path,
    listed: &Ids,
    dir: &Path,
) -> anyhow::Result<Vec<truth_file::Row>> {
    let text = String::from_utf8(files::read(file)?)
        .map_err(|error| Refusal::Usage(format!("{}: {error}", file.display())))?;
    let truths = truth_file::parse(file, &text)?;
    let others: Vec<PairName> = truths
        .iter()
        .map(|truth| truth.name.clone())
        .filter(|name| !listed.contains(name))
        .collect();
    if others.is_empty() {
        return Ok(truths);
    }
    let unknown = match Project::open(dir) {
        Ok(project) => {
            let catalog = Catalog::open_read_only(&project.catalog_path()).await?;
            let unknown = catalog.unknown_names(&others).await?;
            catalog.close().await;
            unknown
        }
        Err(_) => others,
    };
    match truths.iter().find(|truth| unknown.contains(&truth.name)) {
        Some(truth) => {
            let reason = format!("there is no pair {}", truth.name);
            Err(refusal(file, truth.line, &reason).into())
        }
        None => Ok(truths),
    }
}

/// `tops_mask` is kept as inputs are: relative to the project when it lies below it.
fn stored_truths(
    truths: Vec<truth_file::Row>,
    project: &Project,
) -> anyhow::Result<Vec<(PairName, Value)>> {
    truths
        .into_iter()
        .map(|mut truth| {
            if let Some(mask) = &truth.tops_mask {
                truth.value["tops_mask"] = json!(project.stored_path(mask)?);
            }
            Ok((truth.name, truth.value))
        })
        .collect()
}

fn stored_row(row: &ManifestRow, project: &Project) -> anyhow::Result<ImportRow> {
    Ok(ImportRow {
        name: row.name.clone(),
        mesh_path: project.stored_path(&row.mesh)?,
        print_path: project.stored_path(&row.print)?,
        unit: row.unit,
        scanned_face_down: row.scanned_face_down,
        character: row.character.clone(),
        block: row.block.clone(),
        meta: row.meta.clone().into_iter().collect(),
    })
}

/// Says what an import did; warnings first.
pub(super) fn tell(taken: &Taken, context: &Context) {
    const WARNED: usize = 20;
    const NAMED: usize = 10;
    let output = &context.output;
    for line in taken.missing.iter().take(WARNED) {
        output.warn(line);
    }
    if let Some(more) = taken.missing.len().checked_sub(WARNED + 1) {
        output.warn(&format!("{} more files are not there", more + 1));
    }
    for line in &taken.remarks {
        output.warn(line);
    }
    let summary = &taken.summary;
    output.say(&format!(
        "{} added, {} changed, {} unchanged{}",
        count(summary.added, "pair"),
        summary.changed.len(),
        summary.unchanged,
        match taken.truths {
            0 => String::new(),
            truths => format!("; {} stored", count(truths, "true alignment")),
        }
    ));
    for change in summary.changed.iter().take(NAMED) {
        output.say(&format!(
            "  {}: {} changed",
            change.name,
            change.fields.join(", ")
        ));
    }
    if let Some(more) = summary.changed.len().checked_sub(NAMED + 1) {
        output.say(&format!("  and {} more", more + 1));
    }
}

fn as_json(taken: &Taken) -> Value {
    let changed: Vec<Value> = taken
        .summary
        .changed
        .iter()
        .map(|change| json!({"id": change.name, "fields": change.fields}))
        .collect();
    json!({
        "schema": 1,
        "added": taken.summary.added,
        "changed": changed,
        "unchanged": taken.summary.unchanged,
        "truths": taken.truths,
        "missing_files": taken.missing,
        "left_out": taken.remarks,
    })
}
