//! `backup`: the catalog, the verdicts and the settings, copied whole while a run may be writing.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use serde_json::json;

use super::context::Context;
use super::exit::{ExitCode, Refusal};
use super::output;
use super::table::count;
use crate::catalog::{Catalog, VerdictEvent};
use crate::export::json_lines;
use crate::store::{
    CATALOG_FILE, Project, SETTINGS_FILE, partial_path, rename_into_place, write_synced,
};

/// Arguments of `backup`.
#[derive(Debug, Args)]
pub(super) struct BackupArgs {
    /// The file to write, such as blocks.sqlite; an earlier backup there stays until the new one is whole. The
    /// verdicts go beside it as blocks.verdicts.jsonl, the project's settings as blocks.mocban.toml
    pub(super) file: PathBuf,
}

pub(super) async fn backup(args: BackupArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.reader().await?;
    let file = &args.file;
    let shown = file.display();
    refuse_place(file, &project)?;
    let partial = Partial::of(file);
    catalog
        .copy_to(&partial.0)
        .await
        .with_context(|| format!("cannot write the backup {shown}"))?;
    catalog.close().await;
    let (log, pairs) = held_by(&partial).await?;
    let verdicts = log.len() as u64;
    let log = prepare(&verdicts_file(file), json_lines(&log).as_bytes())?;
    let settings_file = file.with_extension("mocban.toml");
    let settings = match std::fs::read(project.settings_path()) {
        Ok(bytes) => Some(prepare(&settings_file, &bytes)?),
        Err(_) => None,
    };
    // All of it is written before the first takes its name, and the catalog takes its name last. When one is refused
    // its name, those beside the catalog go back to what they were.
    let earlier = [verdicts_file(file), settings_file.clone()].map(|file| Earlier::keep(&file));
    let placed = place(&log, &verdicts_file(file))
        .and_then(|()| match &settings {
            Some(partial) => place(partial, &settings_file),
            None => remove(&settings_file),
        })
        .and_then(|()| place(&partial, file));
    if placed.is_err() {
        earlier.iter().flatten().for_each(Earlier::put_back);
    }
    placed?;
    let bytes = std::fs::metadata(file)?.len();
    if context.global.json {
        output::print_json(&json!({
            "schema": 1, "file": file, "bytes": bytes, "pairs": pairs, "verdicts": verdicts,
            "verdicts_file": verdicts_file(file),
        }))?;
    }
    context.output.say(&format!(
        "{} and {} are in {shown}, {:.1} MB; pictures are not in it, `run` makes them again",
        count(pairs, "pair"),
        count(verdicts, "verdict"),
        bytes as f64 / 1e6
    ));
    Ok(ExitCode::Done)
}

/// A file under way; what is left of it goes when it is dropped.
struct Partial(PathBuf);

impl Partial {
    /// Nothing yet, also where a killed process left half a file.
    fn of(file: &Path) -> Self {
        let partial = Self(partial_path(file));
        partial.clear();
        partial
    }

    fn clear(&self) {
        for ending in ["", "-wal", "-shm", "-journal"] {
            let mut name = self.0.as_os_str().to_owned();
            name.push(ending);
            // Mostly there is nothing; and what cannot be removed shows when the copy is written.
            let _ = std::fs::remove_file(PathBuf::from(name));
        }
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        self.clear();
    }
}

/// A file of an earlier backup, which has a second name until the new backup is whole.
struct Earlier {
    file: PathBuf,
    kept: Partial,
    was_there: bool,
}

impl Earlier {
    /// `None` where the file cannot be kept; then a refused name leaves the new one there.
    fn keep(file: &Path) -> Option<Self> {
        let mut name = file.as_os_str().to_owned();
        name.push(".earlier");
        let kept = Partial::of(Path::new(&name));
        let was_there = file.exists();
        let is_kept = !was_there
            || std::fs::hard_link(file, &kept.0).is_ok()
            || std::fs::copy(file, &kept.0).is_ok();
        is_kept.then(|| Self {
            file: file.to_owned(),
            kept,
            was_there,
        })
    }

    fn put_back(&self) {
        // What was refused is told already; more than trying cannot be done about this.
        let _ = if self.was_there {
            std::fs::rename(&self.kept.0, &self.file)
        } else {
            std::fs::remove_file(&self.file)
        };
    }
}

/// The verdicts and the number of pairs in a copy.
async fn held_by(partial: &Partial) -> anyhow::Result<(Vec<VerdictEvent>, u64)> {
    let copy = Catalog::open_read_only(&partial.0).await?;
    let log = copy.verdict_log(None).await?;
    let pairs = copy.counters().await?.values().sum();
    copy.close().await;
    Ok((log, pairs))
}

/// Writes what goes beside the backup, under another name.
fn prepare(file: &Path, bytes: &[u8]) -> anyhow::Result<Partial> {
    let partial = Partial::of(file);
    write_synced(&partial.0, bytes).with_context(|| format!("cannot write {}", file.display()))?;
    Ok(partial)
}

/// Gives a file its name.
fn place(partial: &Partial, file: &Path) -> anyhow::Result<()> {
    rename_into_place(&partial.0, file).with_context(|| format!("cannot write {}", file.display()))
}

/// Removes the settings that an earlier backup left, when the project has none any more: without them other results
/// would come of it.
fn remove(file: &Path) -> anyhow::Result<()> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove {}", file.display()))
        }
        _ => Ok(()),
    }
}

fn verdicts_file(file: &Path) -> PathBuf {
    file.with_extension("verdicts.jsonl")
}

/// Refuses a place where something lies that is not an earlier backup.
fn refuse_place(file: &Path, project: &Project) -> Result<(), Refusal> {
    let shown = file.display();
    let refuse = |what: &str| Err(Refusal::Usage(format!("{shown} {what}")));
    if file.file_name().is_none() || file.is_dir() {
        return refuse("is a directory; name a file for the backup");
    }
    let called = |known: &str| file.file_name().is_some_and(|name| name == known);
    let here = is_same(file.parent(), project.dir());
    if called(CATALOG_FILE) && (here || file.exists())
        || called(SETTINGS_FILE) && here
        || is_same(Some(file), &project.catalog_path())
    {
        return refuse("is a file of a project itself; name another file for the backup");
    }
    match std::fs::metadata(file) {
        Err(_) => Ok(()),
        Ok(meta) if meta.len() == 0 || is_backup(file) => Ok(()),
        Ok(_) => refuse("is there already and no backup; name another file"),
    }
}

/// Whether two paths lead to the same file.
fn is_same(one: Option<&Path>, other: &Path) -> bool {
    let one = one.map(|path| {
        if path == Path::new("") {
            Path::new(".")
        } else {
            path
        }
    });
    let whole = one.and_then(|path| path.canonicalize().ok());
    whole.is_some() && whole == other.canonicalize().ok()
}

/// Whether a file is a database with the catalog's mark: bytes 68 to 71 of an SQLite file.
fn is_backup(file: &Path) -> bool {
    use std::io::Read as _;
    let mut head = [0; 72];
    let read = std::fs::File::open(file).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head.starts_with(b"SQLite format 3\0") && head[68..].starts_with(b"mocb")
}
