//! `backup`: copies catalog, verdicts and settings. The copy is consistent even during a run.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use serde_json::json;

use super::context::Context;
use super::exit::{ExitCode, Refusal};
use super::files::remove_database;
use super::table::count;
use crate::catalog::{Catalog, VerdictEvent};
use crate::export::json_lines;
use crate::store::{
    CATALOG_FILE, Project, SETTINGS_FILE, partial_path, rename_into_place, write_synced,
};

/// Arguments of `backup`.
#[derive(Debug, Args)]
pub(super) struct BackupArgs {
    /// The file to write, such as blocks.sqlite; an existing backup is replaced only when the new one is complete. The
    /// verdicts are written to blocks.verdicts.jsonl, the project's settings to blocks.mocban.toml
    pub(super) file: PathBuf,
}

pub(super) async fn backup(args: BackupArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.open_read_only().await?;
    let file = &args.file;
    let shown = file.display();
    check_target(file, &project)?;
    let partial = PartialFile::of(file);
    catalog
        .copy_to(&partial.0)
        .await
        .with_context(|| format!("cannot write the backup {shown}"))?;
    catalog.close().await;
    let (log, pairs) = read_copy(&partial).await?;
    let verdicts = log.len() as u64;
    let log = prepare(&verdicts_file(file), json_lines(&log).as_bytes())?;
    let settings_file = file.with_extension("mocban.toml");
    let settings = match std::fs::read(project.settings_path()) {
        Ok(bytes) => Some(prepare(&settings_file, &bytes)?),
        Err(_) => None,
    };
    // Rename no file until all are written, and rename the catalog last. If a renaming fails, restore the other files
    // from the previous backup.
    let previous =
        [verdicts_file(file), settings_file.clone()].map(|file| PreviousFile::save(&file));
    let renamed = rename(&log, &verdicts_file(file))
        .and_then(|()| match &settings {
            Some(partial) => rename(partial, &settings_file),
            None => remove(&settings_file),
        })
        .and_then(|()| rename(&partial, file));
    if renamed.is_err() {
        previous.iter().flatten().for_each(PreviousFile::restore);
    }
    renamed?;
    let bytes = std::fs::metadata(file)?.len();
    context.print_json(&json!({
        "schema": 1, "file": file, "bytes": bytes, "pairs": pairs, "verdicts": verdicts,
        "verdicts_file": verdicts_file(file),
    }))?;
    context.info(&format!(
        "{} and {} saved to {shown}, {:.1} MB; images are not included, `run` computes them again",
        count(pairs, "pair"),
        count(verdicts, "verdict"),
        bytes as f64 / 1e6
    ));
    Ok(ExitCode::Done)
}

/// A file under a temporary name. The file is removed when the value is dropped.
struct PartialFile(PathBuf);

impl PartialFile {
    /// Starts without a file; removes what a killed process left.
    fn of(file: &Path) -> Self {
        let partial = Self(partial_path(file));
        partial.clear();
        partial
    }

    fn clear(&self) {
        // Usually no such file exists. If a file cannot be removed, writing the copy fails later.
        remove_database(&self.0);
    }
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        self.clear();
    }
}

/// A file of the previous backup, saved under a second name until the new backup is complete.
struct PreviousFile {
    file: PathBuf,
    saved: PartialFile,
    existed: bool,
}

impl PreviousFile {
    /// Saves a file so that it can be restored. Returns `None` if it cannot be saved.
    fn save(file: &Path) -> Option<Self> {
        let mut name = file.as_os_str().to_owned();
        name.push(".earlier");
        let saved = PartialFile::of(Path::new(&name));
        let existed = file.exists();
        let is_saved = !existed
            || std::fs::hard_link(file, &saved.0).is_ok()
            || std::fs::copy(file, &saved.0).is_ok();
        is_saved.then(|| Self {
            file: file.to_owned(),
            saved,
            existed,
        })
    }

    fn restore(&self) {
        // The caller reports the failed renaming. If restoring fails too, nothing can be done.
        let _ = if self.existed {
            std::fs::rename(&self.saved.0, &self.file)
        } else {
            std::fs::remove_file(&self.file)
        };
    }
}

/// Returns the verdicts and the number of pairs in a copy of the catalog.
async fn read_copy(partial: &PartialFile) -> anyhow::Result<(Vec<VerdictEvent>, u64)> {
    let copy = Catalog::open_read_only(&partial.0).await?;
    let log = copy.verdict_log(None).await?;
    let pairs = copy.counters().await?.values().sum();
    copy.close().await;
    Ok((log, pairs))
}

/// Writes a file under a temporary name.
fn prepare(file: &Path, bytes: &[u8]) -> anyhow::Result<PartialFile> {
    let partial = PartialFile::of(file);
    write_synced(&partial.0, bytes).with_context(|| format!("cannot write {}", file.display()))?;
    Ok(partial)
}

/// Gives a file its final name.
fn rename(partial: &PartialFile, file: &Path) -> anyhow::Result<()> {
    rename_into_place(&partial.0, file).with_context(|| format!("cannot write {}", file.display()))
}

/// Removes the settings file of the previous backup if the project has none. Otherwise a restored project would use the
/// old settings.
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

/// Refuses a target that exists and is not a backup.
fn check_target(file: &Path, project: &Project) -> Result<(), Refusal> {
    let shown = file.display();
    let refuse = |reason: &str| Err(Refusal::Usage(format!("{shown} {reason}")));
    if file.file_name().is_none() || file.is_dir() {
        return refuse("is a directory; name a file for the backup");
    }
    let is_named = |known: &str| file.file_name().is_some_and(|name| name == known);
    let here = is_same(file.parent(), project.dir());
    if is_named(CATALOG_FILE) && (here || file.exists())
        || is_named(SETTINGS_FILE) && here
        || is_same(Some(file), &project.catalog_path())
    {
        return refuse("is a file of a project; name another file for the backup");
    }
    match std::fs::metadata(file) {
        Err(_) => Ok(()),
        Ok(meta) if meta.len() == 0 || is_backup(file) => Ok(()),
        Ok(_) => refuse("exists and is not a backup; name another file"),
    }
}

/// Returns whether two paths name the same file.
fn is_same(one: Option<&Path>, other: &Path) -> bool {
    // The parent of a bare file name is empty.
    let canonical = one.and_then(|path| Path::new(".").join(path).canonicalize().ok());
    canonical.is_some() && canonical == other.canonicalize().ok()
}

/// Returns whether a file is an SQLite database with the catalog's application id (bytes 68 to 71).
fn is_backup(file: &Path) -> bool {
    use std::io::Read as _;
    let mut head = [0; 72];
    let read = std::fs::File::open(file).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head.starts_with(b"SQLite format 3\0") && head[68..].starts_with(b"mocb")
}
