//! `demo`: creates the built-in dataset or a whole block, imports it, runs it and prints the report.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::Args;

use super::config::{ConfigShowArgs, as_toml};
use super::demo_block;
use super::demo_data::replace_data;
use super::import;
use super::import_blocks;
use super::report;
use super::review::review_step;
use super::run::{code, drive};
use super::run_text;
use crate::cli::output::busy::Busy;
use crate::cli::output::context::Context;
use crate::cli::output::screen::Palette;
use crate::cli::output::table::count;
use crate::cli::output::terminal::Terminal;
use mocban_config::{Origin, Tree};
use mocban_core::domain::JobStatus;
use mocban_demo::block::{BlockKind, BlockOptions};
use mocban_demo::{DatasetFiles, DemoOptions, Tier, find_dataset, write_dataset};
use mocban_export::ContactSheetOptions;
use mocban_project::demo_folder::{DemoContent, STOPPED, check_directory};
use mocban_project::error::WithContext as _;
use mocban_project::files;
use mocban_project::import_blocks::import_blocks;
use mocban_project::import_pairs::{AllowedChanges, PairImport, PairSource, import_pairs};
use mocban_project::new_project::name_warning;
use mocban_project::pair_choices::PairChoices;
use mocban_project::run::{PreparedRun, options};
use mocban_project::sheets::contact_sheet;
use mocban_project::{ExitCode, ProjectResult};
use mocban_runner::{Stop, StopLevel};
use mocban_store::{SETTINGS_FILE, TargetLock, create_folders, write_atomic};

/// Smallest and largest distance of the vertices of a block. A mesh of the smallest has 60 million triangles.
const SPACING_MM: RangeInclusive<f64> = 0.05..=2.0;

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// The project directory to create [default: that of -C, or mocban-demo]
    pub(crate) dir: Option<PathBuf>,
    /// Number of pairs; the real tier has 20
    #[arg(long, value_name = "N", default_value = "24", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) pairs: u64,
    /// Seed of the dataset; the same seed gives the same bytes
    #[arg(long, value_name = "S", default_value = "1")]
    pub(crate) seed: u64,
    /// Kind of pairs: upright, pose, hard, real, all, or another of the page "Generate pairs" of `mocban docs`
    #[arg(long, default_value = "upright")]
    pub(crate) tier: Tier,
    /// Create a whole block with its page instead of pairs; a kind of the page "Generate pairs", or mixed
    #[arg(long, value_name = "KIND", num_args = 0..=1, require_equals = true, default_missing_value = "mixed", conflicts_with_all = ["pairs", "tier"])]
    pub(crate) block: Option<BlockKind>,
    /// Let the characters of the block be found without their boxes
    #[arg(long, requires = "block")]
    pub(crate) no_labels: bool,
    /// Distance between the vertices of the block's mesh, mm
    #[arg(long, value_name = "MM", default_value = "0.2", requires = "block", value_parser = spacing)]
    pub(crate) spacing: f64,
    /// Create and import the dataset without running it
    #[arg(long)]
    pub(crate) no_run: bool,
}

pub(crate) async fn demo(args: DemoArgs, context: &Context) -> ProjectResult<ExitCode> {
    let dir = demo_dir(&args, context);
    let content = content(&args);
    let context = context.at(&dir);
    // Before settings and data are written there.
    check_directory(&dir, &dir.join("data"), &content)?;
    if let Some(warning) = name_warning(&dir) {
        context.warn(&warning);
    }
    context.location.require_local("the demo")?;
    context.location.data_locations()?;
    let context = &save_settings(&dir, &context)?;
    let options = match content {
        DemoContent::Block(options) => return block_demo(&dir, options, &args, context).await,
        DemoContent::Pairs(options) => options,
    };
    let Some(files) = create_dataset(&dir, options, context).await? else {
        context.info(STOPPED);
        return Ok(ExitCode::Stopped);
    };
    let source = PairSource::List {
        file: files.manifest,
        bytes: None,
    };
    let import = PairImport {
        source,
        truth: Some(files.truth),
        allowed: AllowedChanges::default(),
        choices: PairChoices::default(),
    };
    let outcome = import_pairs(import, &context.location, &()).await?;
    import::print_outcome(&outcome, context);
    if args.no_run {
        context.next("run");
        return Ok(ExitCode::Done);
    }
    align(&dir, None, context).await
}

/// Returns what the demo is to contain.
fn content(args: &DemoArgs) -> DemoContent {
    if let Some(kind) = args.block {
        return DemoContent::Block(BlockOptions {
            kind,
            seed: args.seed,
            spacing_mm: args.spacing,
        });
    }
    let options = DemoOptions {
        pairs: args.pairs,
        seed: args.seed,
        tier: args.tier,
    };
    DemoContent::Pairs(options.limited())
}

/// Creates a whole block, imports and runs it.
async fn block_demo(
    dir: &Path,
    options: BlockOptions,
    args: &DemoArgs,
    context: &Context,
) -> ProjectResult<ExitCode> {
    let Some(files) = demo_block::create_files(dir, options, context).await? else {
        context.info(STOPPED);
        return Ok(ExitCode::Stopped);
    };
    let source = demo_block::import_source(&files, !args.no_labels);
    let allowed = AllowedChanges::default();
    let outcome = import_blocks(&source, allowed, &context.location, &()).await?;
    import_blocks::print_outcome(&outcome, context);
    if args.no_run {
        context.next("run");
        return Ok(ExitCode::Done);
    }
    align(dir, Some(&files.truth), context).await
}

/// Runs the pairs, prints the report, draws the contact sheet, and prints where the files are. `block_truth` is the
/// file with the true alignment of a whole block.
async fn align(
    dir: &Path,
    block_truth: Option<&Path>,
    context: &Context,
) -> ProjectResult<ExitCode> {
    let options = options(&context.location.settings()?.config);
    let terminal = Terminal::new(context);
    let prepared = PreparedRun::new(&[], options, false, &context.location, &terminal).await?;
    let outcome = drive(prepared, context).await?;
    run_text::print_outcome(&outcome, context);
    let code = code(&outcome.summary);
    let done = outcome.summary.status.jobs.get(&JobStatus::Done).copied();
    if outcome.summary.stopped || done.unwrap_or(0) == 0 {
        for command in run_text::next_steps(&outcome) {
            context.next(&command);
        }
        return Ok(code);
    }
    if let Some(file) = block_truth {
        let (_, catalog) = context.location.open().await?;
        let stored = demo_block::store_truths(file, &catalog).await;
        catalog.close().await;
        let stored = count(stored?, "true alignment");
        context.info(&format!("{stored} of the cut pairs stored"));
    }
    report::print_summary(context).await?;
    let (sheet, location) = (ContactSheetOptions::default(), &context.location);
    let drawn = contact_sheet(&[], sheet, None, false, location, &terminal);
    let (picture, _) = drawn.await?;
    let (data, picture) = (dir.join("data"), picture.display());
    context.info(&format!("meshes, prints and truth: {}", data.display()));
    context.info(&format!("results in one image, worst first: {picture}"));
    if let Some(review) = review_step(&outcome.summary.status) {
        context.next(&review);
    }
    context.next("report");
    context.next("export -o export");
    Ok(code)
}

/// Parses the distance of a block's vertices.
fn spacing(text: &str) -> Result<f64, String> {
    let range = SPACING_MM;
    let spacing = text.parse().ok().filter(|spacing| range.contains(spacing));
    spacing.ok_or_else(|| format!("not a number from {} to {} mm", range.start(), range.end()))
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
) -> ProjectResult<Option<DatasetFiles>> {
    let data = dir.join("data");
    check_directory(dir, &data, &DemoContent::Pairs(options))?;
    let found = find_dataset(&data, &options);
    let action = ["creating", "found"][usize::from(found.is_some())];
    let DemoOptions { tier, seed, .. } = options;
    let pairs = count(
        found.as_ref().map_or(options.pairs, |files| files.pairs),
        "pair",
    );
    let shown = data.display();
    context.info(&format!(
        "{action} {pairs} of tier {tier}, seed {seed}, in {shown}"
    ));
    match found {
        Some(files) => Ok(Some(files)),
        None => replace_dataset(&data, options, context).await,
    }
}

/// Writes the dataset next to `data` and then replaces `data`. Returns `None` if a signal stopped the command.
async fn replace_dataset(
    data: &Path,
    options: DemoOptions,
    context: &Context,
) -> ProjectResult<Option<DatasetFiles>> {
    let busy = Busy::of_pairs(context, "creating demo data", options.pairs);
    let write = move |folder: &Path, stop: &Stop| {
        let is_stopped = || {
            busy.begin_pair();
            stop.level() != StopLevel::Go
        };
        write_dataset(folder, &options, &is_stopped)
    };
    let Some(mut files) = replace_data(data, context, write).await? else {
        return Ok(None);
    };
    for file in [&mut files.manifest, &mut files.truth] {
        *file = data.join(file.file_name().unwrap_or_default());
    }
    Ok(Some(files))
}

/// Saves the settings of `--config` and `--set` in the project's settings file, for later commands.
///
/// A file with other settings is not changed. In that case the flags apply to this call only.
fn save_settings(dir: &Path, context: &Context) -> ProjectResult<Context> {
    let global = &context.global;
    if global.config.is_none() && global.set.is_empty() {
        return Ok(context.clone());
    }
    let text = changed_settings(&context.location.settings()?.tree);
    let file = dir.join(SETTINGS_FILE);
    let shown = file.display();
    create_folders(dir).with_context(|| format!("cannot create {}", dir.display()))?;
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
    use super::changed_settings;
    use mocban_config::{BaseLayer, Preset, Sources, load};

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
