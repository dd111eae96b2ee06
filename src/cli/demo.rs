//! `demo`: creates the built-in dataset, imports it, runs it and prints the report.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;

use super::busy::Busy;
use super::config::{ConfigShowArgs, as_toml};
use super::contact_sheet::{self, ContactSheetArgs};
use super::context::{Context, shell_quoted};
use super::exit::{ExitCode, Refusal};
use super::files;
use super::import::{self, ImportArgs};
use super::report;
use super::run::{self, drive};
use super::screen::Palette;
use super::signals;
use super::table::count;
use crate::config::{Origin, Tree};
use crate::demo::{DatasetError, DatasetFiles, DemoOptions, Tier, find_dataset, write_dataset};
use crate::domain::JobStatus;
use crate::runner::{Stop, StopLevel};
use crate::store::{CATALOG_FILE, ReplacementFolder, SETTINGS_FILE, TargetLock, write_atomic};

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// The project directory to create [default: that of -C, or mocban-demo]
    pub(super) dir: Option<PathBuf>,
    /// Number of pairs; the real tier has 20
    #[arg(long, value_name = "N", default_value = "24", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(super) pairs: u64,
    /// Seed of the dataset; the same seed gives the same bytes
    #[arg(long, value_name = "S", default_value = "1")]
    pub(super) seed: u64,
    /// Kind of pairs: upright, pose, hard, real, all, or another of docs/guides/demo.md
    #[arg(long, default_value = "upright")]
    pub(super) tier: Tier,
    /// Create and import the dataset without running it
    #[arg(long)]
    pub(super) no_run: bool,
}

pub(super) async fn demo(args: DemoArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let dir = demo_dir(&args, context);
    let context = &save_settings(&dir, &context.at(&dir))?;
    let options = DemoOptions {
        pairs: args.pairs,
        seed: args.seed,
        tier: args.tier,
    };
    let Some(files) = create_dataset(&dir, options, context).await? else {
        context.info(
            "stopped while the files were being written; nothing was imported, and the same command starts again",
        );
        return Ok(ExitCode::Stopped);
    };
    let manifest = ImportArgs {
        file: Some(files.manifest),
        truth: Some(files.truth),
        ..ImportArgs::default()
    };
    let outcome = import::import_pairs(&manifest, context).await?;
    import::print_outcome(&outcome, context);
    if args.no_run {
        context.next("run");
        return Ok(ExitCode::Done);
    }
    align(&dir, context).await
}

/// Runs the pairs, prints the report, draws the contact sheet, and prints where the files are.
async fn align(dir: &Path, context: &Context) -> anyhow::Result<ExitCode> {
    let config = context.settings()?.config;
    let (project, catalog) = context.open().await?;
    let options = run::from_config(&config);
    let (summary, failures) = drive(&project, catalog, &config, &options, context).await?;
    run::print_outcome(&summary, &failures, context);
    let done = summary.status.jobs.get(&JobStatus::Done).copied();
    if summary.stopped || done.unwrap_or(0) == 0 {
        for command in run::next_steps(&summary, &failures) {
            context.next(&command);
        }
        return Ok(run::code(&summary));
    }
    report::print(context).await?;
    let (picture, _) = contact_sheet::write(&ContactSheetArgs::default(), context).await?;
    let (data, picture) = (dir.join("data"), picture.display());
    context.info(&format!("meshes, prints and truth: {}", data.display()));
    context.info(&format!("contact sheet of all pairs: {picture}"));
    context.next("status");
    context.next("export -o export");
    Ok(run::code(&summary))
}

fn demo_dir(args: &DemoArgs, context: &Context) -> PathBuf {
    args.dir
        .clone()
        .or_else(|| context.global.directory.clone())
        .unwrap_or_else(|| PathBuf::from("mocban-demo"))
}

/// Creates the dataset below `DIR/data` unless it exists. Returns `None` if a signal stopped the command.
async fn create_dataset(
    dir: &Path,
    options: DemoOptions,
    context: &Context,
) -> anyhow::Result<Option<DatasetFiles>> {
    let data = dir.join("data");
    check_directory(dir, &data, &options)?;
    let files = match find_dataset(&data, &options) {
        Some(files) => files,
        None => match replace_dataset(&data, options, context).await? {
            Some(files) => files,
            None => return Ok(None),
        },
    };
    let pairs = count(files.pairs, "pair");
    let DemoOptions { tier, seed, .. } = options;
    let action = ["created", "found"][usize::from(files.already_existed)];
    let data = data.display();
    context.info(&format!(
        "{action} {pairs} of tier {tier}, seed {seed}, in {data}"
    ));
    Ok(Some(files))
}

/// Writes the dataset next to `data` and then replaces `data`, so that a project never sees half of it. Returns `None`
/// if a signal stopped the command.
async fn replace_dataset(
    data: &Path,
    options: DemoOptions,
    context: &Context,
) -> anyhow::Result<Option<DatasetFiles>> {
    let folder = ReplacementFolder::begin(data)?;
    let note = folder.path().join(NOTE);
    std::fs::write(&note, NOTE_TEXT).with_context(|| format!("cannot write {}", note.display()))?;
    let Some(mut files) = write_or_stop(folder.path().to_owned(), options, context).await? else {
        return Ok(None);
    };
    if let Some((path, error)) = folder.finish()? {
        context.warn(&format!(
            "the earlier data could not be removed from {}: {error}; the next demo that writes data removes them",
            path.display()
        ));
    }
    for file in [&mut files.manifest, &mut files.truth] {
        *file = data.join(file.file_name().unwrap_or_default());
    }
    Ok(Some(files))
}

/// Writes the dataset on another thread and watches for signals. Returns `None` if a signal stopped the writing.
async fn write_or_stop(
    data: PathBuf,
    options: DemoOptions,
    context: &Context,
) -> anyhow::Result<Option<DatasetFiles>> {
    let stop = Stop::default();
    let signals = signals::watch(&stop)?;
    let busy = Busy::of_pairs(context, "creating demo data", options.pairs);
    let is_stopped = move || {
        busy.begin_pair();
        stop.level() != StopLevel::Go
    };
    let writing = tokio::task::spawn_blocking(move || write_dataset(&data, &options, &is_stopped));
    let written = writing.await?;
    signals.abort();
    match written {
        Err(DatasetError::Stopped) => Ok(None),
        written => Ok(Some(written?)),
    }
}

const NOTE: &str = "README.txt";
const NOTE_TEXT: &str = "The built-in dataset of mocban: carved glyphs and their prints, with the true \
alignments.\nCreated by `mocban demo`, which creates it again if it is incomplete; do not put your own files here.\n";

/// Refuses a directory that holds another demo, another project or foreign data, so that nothing is overwritten.
fn check_directory(dir: &Path, data: &Path, options: &DemoOptions) -> anyhow::Result<()> {
    let refuse = |reason: &str| {
        let shown = dir.display();
        let text = format!("{shown} {reason}; name another directory for this demo");
        Err(Refusal::Usage(text).into())
    };
    let exists = |path: &Path| {
        let found = path.try_exists();
        found.with_context(|| format!("cannot read {}", path.display()))
    };
    let (is_project, has_data) = (exists(&dir.join(CATALOG_FILE))?, exists(data)?);
    let continue_hint = || {
        if !is_project {
            return String::new();
        }
        let dir = shell_quoted(&dir.to_string_lossy());
        format!("; `mocban -C {dir} run` continues it")
    };
    let stamp = files::small(&data.join("dataset.json"))?;
    let found = stamp.and_then(|bytes| serde_json::from_slice::<DemoOptions>(&bytes).ok());
    match found {
        Some(found) if found.tier != options.tier || found.seed != options.seed => {
            let DemoOptions { tier, seed, .. } = found;
            let hint = continue_hint();
            refuse(&format!(
                "holds the demo of tier {tier} and seed {seed}{hint}"
            ))
        }
        Some(DemoOptions { pairs, .. }) if pairs > options.pairs => {
            let hint = continue_hint();
            refuse(&format!("already holds a demo of {pairs} pairs{hint}"))
        }
        None if has_data && !has_note(data)? => refuse("has a data directory that no demo created"),
        None if is_project && !has_data => refuse("is another project"),
        Some(_) | None => Ok(()),
    }
}

/// Returns whether a directory has the note of a demo. Compares the text, because any project may have a `README.txt`.
fn has_note(data: &Path) -> anyhow::Result<bool> {
    let note = files::small(&data.join(NOTE))?;
    Ok(note.is_some_and(|text| text == NOTE_TEXT.as_bytes()))
}

/// Saves the settings of `--config` and `--set` in the project's settings file, for later commands.
///
/// A file with other settings is not changed. In that case the flags apply to this call only.
fn save_settings(dir: &Path, context: &Context) -> anyhow::Result<Context> {
    let global = &context.global;
    if global.config.is_none() && global.set.is_empty() {
        return Ok(context.clone());
    }
    let text = changed_settings(&context.settings()?.tree);
    let file = dir.join(SETTINGS_FILE);
    let shown = file.display();
    std::fs::create_dir_all(dir).with_context(|| format!("cannot create {}", dir.display()))?;
    let _lock = TargetLock::acquire(&file)?;
    match files::small(&file)? {
        Some(there) if there == text.as_bytes() => {}
        Some(_) => {
            context.warn(&format!(
                "{shown} exists and was not changed; the flags apply to this call only"
            ));
            return Ok(context.clone());
        }
        None => {
            write_atomic(&file, text.as_bytes())
                .with_context(|| format!("cannot write {shown}"))?;
            context.info(&format!("settings are saved in {shown}"));
        }
    }
    Ok(context.without_setting_flags())
}

/// Formats the settings that come from a preset, a file or flags as a settings file. Leaves out settings from
/// environment variables, because the environment does not belong to the project.
fn changed_settings(tree: &Tree) -> String {
    let mut preset = "";
    let mut changed = Vec::new();
    for setting in tree.settings() {
        match setting.origin {
            Origin::Default | Origin::Env(_) => {}
            Origin::Preset(_) => preset = "preset = \"paper\"\n\n",
            Origin::File(_) | Origin::Flag => changed.push(setting),
        }
    }
    let text = as_toml(&changed, &ConfigShowArgs::default(), Palette::PLAIN);
    format!("{preset}{text}")
}

#[cfg(test)]
mod tests {
    use super::{NOTE, NOTE_TEXT, changed_settings, check_directory};
    use crate::config::{BaseLayer, Preset, Sources, load};
    use crate::demo::{DemoOptions, Tier};

    const OPTIONS: DemoOptions = DemoOptions {
        pairs: 4,
        seed: 1,
        tier: Tier::Pose,
    };

    #[test]
    fn directory_with_other_files_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let data = dir.path().join("data");
        let check = |options| check_directory(dir.path(), &data, options).is_ok();
        assert!(check(&OPTIONS));
        std::fs::create_dir(&data).expect("a folder");
        assert!(!check(&OPTIONS));
        std::fs::write(data.join(NOTE), "my scans").expect("a small file");
        assert!(!check(&OPTIONS));
        std::fs::write(data.join(NOTE), NOTE_TEXT).expect("a small file");
        assert!(check(&OPTIONS));
        let stamp = serde_json::to_vec(&OPTIONS).expect("plain values");
        std::fs::write(data.join("dataset.json"), stamp).expect("a small file");
        assert!(check(&OPTIONS));
        assert!(check(&DemoOptions {
            pairs: 9,
            ..OPTIONS
        }));
        assert!(!check(&DemoOptions {
            pairs: 3,
            ..OPTIONS
        }));
        assert!(!check(&DemoOptions { seed: 2, ..OPTIONS }));
    }

    #[test]
    fn saved_settings_are_those_of_preset_and_flags() {
        let sources = Sources {
            base: BaseLayer::Preset(Preset::Paper),
            env: vec![("MOCBAN_RUN__WORKERS".into(), "3".into())],
            sets: vec!["fit.seed=9".into()],
        };
        let loaded = load(&sources).expect("valid settings");
        let text = changed_settings(&loaded.tree);
        assert_eq!(text, "preset = \"paper\"\n\n[fit]\nseed = 9\n");
    }
}
