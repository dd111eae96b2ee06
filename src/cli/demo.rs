//! `demo`: makes the built-in dataset, imports it like anybody's, runs it and prints the report.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;

use super::config::as_toml;
use super::contact_sheet::{self, ContactSheetArgs};
use super::context::{Context, quoted};
use super::exit::{ExitCode, Refusal};
use super::import::{self, ImportArgs};
use super::output::Palette;
use super::report;
use super::run::{self, drive};
use super::signals;
use crate::config::{Origin, Tree};
use crate::demo::{DatasetError, DatasetFiles, DemoOptions, Tier, write_dataset};
use crate::domain::JobStatus;
use crate::runner::{Stop, StopLevel};
use crate::store::{CATALOG_FILE, SETTINGS_FILE};

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// The project to make [default: that of -C, or mocban-demo]
    pub(super) dir: Option<PathBuf>,
    /// How many pairs; the real tier has 20
    #[arg(long, value_name = "N", default_value = "24", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(super) pairs: u64,
    /// Same seed, same bytes
    #[arg(long, value_name = "S", default_value = "1")]
    pub(super) seed: u64,
    /// How hard: upright, pose, hard or real
    #[arg(long, default_value = "upright")]
    pub(super) tier: Tier,
    /// Make and import the dataset only
    #[arg(long)]
    pub(super) no_run: bool,
}

impl DemoArgs {
    const fn options(&self) -> DemoOptions {
        DemoOptions {
            pairs: self.pairs,
            seed: self.seed,
            tier: self.tier,
        }
    }
}

pub(super) async fn demo(args: DemoArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let dir = demo_dir(&args, context);
    let context = &settled(&dir, &context.at(&dir))?;
    let Some(files) = make(&dir, args.options(), context).await? else {
        context.output.say(
            "stopped while the files were made; nothing is imported, and the same command makes them anew",
        );
        return Ok(ExitCode::Stopped);
    };
    let manifest = ImportArgs {
        file: Some(files.manifest),
        truth: Some(files.truth),
        ..ImportArgs::default()
    };
    let taken = import::take(&manifest, context).await?;
    import::tell(&taken, context);
    if args.no_run {
        context.output.next(&context.command("run"));
        return Ok(ExitCode::Done);
    }
    align(&dir, context).await
}

/// Runs, reports, lays out the sheet, and says where things lie.
async fn align(dir: &Path, context: &Context) -> anyhow::Result<ExitCode> {
    let config = context.settings()?.config;
    let (project, catalog) = context.writer().await?;
    let options = run::from_config(&config);
    let (summary, failures) = drive(&project, catalog, &config, &options, context).await?;
    run::tell_end(&summary, &failures, context);
    let done = summary.status.jobs.get(&JobStatus::Done).copied();
    if summary.stopped || done.unwrap_or(0) == 0 {
        for command in run::next_steps(&summary, &failures) {
            context.output.next(&context.command(&command));
        }
        return Ok(run::code(&summary));
    }
    report::print(context).await?;
    let (picture, _) = contact_sheet::write(&ContactSheetArgs::default(), context).await?;
    let output = &context.output;
    output.say(&format!(
        "meshes, prints and truth  {}",
        dir.join("data").display()
    ));
    output.say(&format!("all pairs on one picture  {}", picture.display()));
    for command in ["status", "export -o export"] {
        output.next(&context.command(command));
    }
    Ok(run::code(&summary))
}

fn demo_dir(args: &DemoArgs, context: &Context) -> PathBuf {
    args.dir
        .clone()
        .or_else(|| context.global.directory.clone())
        .unwrap_or_else(|| PathBuf::from("mocban-demo"))
}

/// Makes the dataset below `DIR/data`, unless it is there; `None` when it was stopped meanwhile.
async fn make(
    dir: &Path,
    options: DemoOptions,
    context: &Context,
) -> anyhow::Result<Option<DatasetFiles>> {
    let data = dir.join("data");
    check_place(dir, &data, &options)?;
    std::fs::create_dir_all(&data).with_context(|| format!("cannot make {}", data.display()))?;
    let note = data.join(NOTE);
    std::fs::write(&note, NOTE_TEXT).with_context(|| format!("cannot write {}", note.display()))?;
    let Some(files) = written(data.clone(), options).await? else {
        return Ok(None);
    };
    let made = if files.already_existed {
        "found"
    } else {
        "made"
    };
    context.output.say(&format!(
        "{made} {} of tier {}, seed {}, in {}",
        super::table::count(files.pairs, "pair"),
        options.tier,
        options.seed,
        data.display()
    ));
    Ok(Some(files))
}

/// Writes the dataset beside this thread, which listens for Ctrl-C; `None` when it came.
async fn written(data: PathBuf, options: DemoOptions) -> anyhow::Result<Option<DatasetFiles>> {
    let stop = Stop::default();
    let signals = signals::watch(&stop)?;
    let is_stopped = move || stop.level() != StopLevel::Go;
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
alignments.\nMade by `mocban demo`, which makes it anew where it is not whole; put no files of your own here.\n";

/// Refuses a place that holds something else, before anything there is overwritten.
fn check_place(dir: &Path, data: &Path, options: &DemoOptions) -> Result<(), Refusal> {
    let refuse = |what: &str| {
        let shown = dir.display();
        Err(Refusal::Usage(format!(
            "{shown} {what}; name another directory for this demo"
        )))
    };
    let go_on = || {
        if !dir.join(CATALOG_FILE).exists() {
            return String::new();
        }
        let dir = quoted(&dir.to_string_lossy());
        format!("; `mocban -C {dir} run` goes on with it")
    };
    let seal = std::fs::read(data.join("dataset.json")).ok();
    let found = seal.and_then(|bytes| serde_json::from_slice::<DemoOptions>(&bytes).ok());
    match found {
        Some(found) if found.tier != options.tier || found.seed != options.seed => {
            refuse(&format!(
                "holds the demo of tier {} and seed {}{}",
                found.tier,
                found.seed,
                go_on()
            ))
        }
        Some(found) if found.pairs > options.pairs => refuse(&format!(
            "holds a demo of {} pairs already{}",
            found.pairs,
            go_on()
        )),
        None if data.exists() && !data.join(NOTE).is_file() => {
            refuse("has a data folder that no demo made")
        }
        None if dir.join(CATALOG_FILE).exists() && !data.exists() => {
            refuse("is a project of its own")
        }
        Some(_) | None => Ok(()),
    }
}

/// Keeps settings given by flags in the project's own file, so that later commands agree with this one.
///
/// Where the project has a file already it stays, and the flags hold for this call alone.
fn settled(dir: &Path, context: &Context) -> anyhow::Result<Context> {
    let global = &context.global;
    if global.config.is_none() && global.set.is_empty() {
        return Ok(context.clone());
    }
    let text = own_settings(&context.settings()?.tree);
    let file = dir.join(SETTINGS_FILE);
    let shown = file.display();
    match std::fs::read_to_string(&file) {
        Ok(there) if there == text => {}
        Ok(_) => {
            context.output.warn(&format!(
                "{shown} stays as it is; the flags hold for this call alone"
            ));
            return Ok(context.clone());
        }
        Err(_) => {
            std::fs::create_dir_all(dir)
                .with_context(|| format!("cannot make {}", dir.display()))?;
            std::fs::write(&file, text).with_context(|| format!("cannot write {shown}"))?;
            context.output.say(&format!("settings are kept in {shown}"));
        }
    }
    Ok(context.with_own_settings())
}

/// What differs from the defaults by preset, file and flags, as a settings file. The environment is not the project's.
fn own_settings(tree: &Tree) -> String {
    let mut preset = "";
    let mut own = Vec::new();
    for setting in tree.settings() {
        match setting.origin {
            Origin::Default | Origin::Env(_) => {}
            Origin::Preset(_) => preset = "preset = \"paper\"\n\n",
            Origin::File(_) | Origin::Flag => own.push(setting),
        }
    }
    format!("{preset}{}", as_toml(&own, false, Palette::PLAIN))
}

#[cfg(test)]
mod tests {
    use super::{NOTE, check_place, own_settings};
    use crate::config::{Preset, Sources, Start, load};
    use crate::demo::{DemoOptions, Tier};

    const OPTIONS: DemoOptions = DemoOptions {
        pairs: 4,
        seed: 1,
        tier: Tier::Pose,
    };

    #[test]
    fn folder_of_somebody_else_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let data = dir.path().join("data");
        let check = |options| check_place(dir.path(), &data, options).is_ok();
        assert!(check(&OPTIONS));
        std::fs::create_dir(&data).expect("a folder");
        assert!(!check(&OPTIONS));
        std::fs::write(data.join(NOTE), "").expect("a small file");
        assert!(check(&OPTIONS));
        let seal = serde_json::to_vec(&OPTIONS).expect("plain values");
        std::fs::write(data.join("dataset.json"), seal).expect("a small file");
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
    fn kept_settings_are_those_of_preset_and_flags() {
        let sources = Sources {
            start: Start::Preset(Preset::Paper),
            env: vec![("MOCBAN_RUN__WORKERS".into(), "3".into())],
            sets: vec!["fit.seed=9".into()],
        };
        let loaded = load(&sources).expect("valid settings");
        let text = own_settings(&loaded.tree);
        assert_eq!(text, "preset = \"paper\"\n\n[fit]\nseed = 9\n");
    }
}
