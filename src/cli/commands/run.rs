//! `run`: aligns the pairs that are not aligned yet and reports the outcome.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::metrics::{MetricsArgs, MetricsServer};
use super::run_text::{block_plan_text, next_steps, plan_text, print_outcome};
use crate::cli::input::signals;
use crate::cli::output::context::Context;
use crate::cli::output::missing_results;
use crate::cli::output::terminal::Terminal;
use mocban_catalog::RerunPolicy;
use mocban_config::Config;
use mocban_core::domain::shell::shell_quoted;
use mocban_core::domain::{Stage, any_case};
use mocban_project::files;
use mocban_project::run::{self, PlannedRun, PreparedRun, RunOutcome, TWO_METHODS};
use mocban_project::{ExitCode, ProjectResult, Refusal};
use mocban_runner::{RunOptions, RunPart, RunSummary, Stop};

/// Arguments of `run`.
#[derive(Debug, Default, Args)]
pub(crate) struct RunArgs {
    /// Only these pairs, and these blocks with their pairs [default: all]
    #[arg(value_name = "NAME")]
    pub(crate) names: Vec<String>,
    /// Also the names in this file, one a line; - reads them from the standard input
    #[arg(long, value_name = "FILE")]
    pub(crate) names_from: Option<PathBuf>,
    /// Number of pairs to process at the same time [default: one per core]
    #[arg(short = 'j', long = "jobs", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Memory for the pairs and the block processed at the same time, such as 4G or 512M, estimated from the file sizes
    /// of meshes and the image sizes of prints and pages; one that needs more runs alone [default: most of the free
    /// memory]
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub(crate) memory: Option<u64>,
    /// Print what would run and why, without running it
    #[arg(short = 'n', long, conflicts_with = "metrics")]
    pub(crate) dry_run: bool,
    /// Join a run in another process as additional workers
    #[arg(long)]
    pub(crate) join: bool,
    /// Stop after this many pairs and blocks have failed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) max_failures: Option<u64>,
    /// Also run these pairs again: failed, stale (settings or files changed, which every run includes) or all
    #[arg(long, value_name = "WHICH", value_parser = rerun)]
    pub(crate) rerun: Option<RerunPolicy>,
    /// Run only this stage, and earlier stages where their results are missing; later stages wait for another run
    #[arg(long, value_name = "STAGE", value_parser = any_case::<Stage>)]
    pub(crate) stage: Option<Stage>,
    #[command(flatten)]
    pub(crate) metrics: MetricsArgs,
}

/// Parses which pairs to run again.
pub(crate) fn rerun(text: &str) -> Result<RerunPolicy, String> {
    match text {
        "failed" => Ok(RerunPolicy::Failed),
        "stale" => Ok(RerunPolicy::Changed),
        "all" => Ok(RerunPolicy::All(Stage::Fit)),
        _ => Err("the pairs to run again are failed, stale or all".to_owned()),
    }
}

pub(crate) async fn run(args: RunArgs, context: &Context) -> ProjectResult<ExitCode> {
    execute(args, RunPart::All, context).await
}

/// Runs one part of a run or all.
pub(crate) async fn execute(
    args: RunArgs,
    part: RunPart,
    context: &Context,
) -> ProjectResult<ExitCode> {
    let server = MetricsServer::bind(&args.metrics).await?;
    let options = options(&args, &context.location.settings()?.config, part);
    let (names, location) = (all_names(&args)?, &context.location);
    let metrics = options.metrics.clone();
    let terminal = Terminal::new(context);
    let prepared = PreparedRun::new(&names, options, args.dry_run, location, &terminal).await?;
    if args.dry_run {
        let retired = prepared.all_retired().await?;
        let planned = prepared.plan().await?;
        let command = command_without_dry_run(&args, &names);
        return print_plan(&planned, (&command, retired), context);
    }
    let serving = server.map(|server| server.serve(metrics, context));
    let outcome = drive(prepared, context).await;
    drop(serving);
    let outcome = outcome?;
    let mut json = serde_json::to_value(&outcome.summary)?;
    json["schema"] = json!(1);
    context.print_json(&json)?;
    print_outcome(&outcome, context);
    if outcome.are_results_missing {
        context.warn(missing_results::TEXT);
        context.next(missing_results::NEXT);
    }
    if let Some(missing) = &outcome.missing_inputs {
        context.warn(&missing.to_string());
        context.next("check");
    }
    for command in next_steps(&outcome) {
        let command = match (part, command.as_str()) {
            (RunPart::Work, "run") => "worker",
            (_, command) => command,
        };
        context.next(command);
    }
    Ok(code(&outcome.summary))
}

/// Returns the names of the command line and those of its file.
///
/// # Errors
/// Refuses a file without a name, which would otherwise run all pairs.
fn all_names(args: &RunArgs) -> ProjectResult<Vec<String>> {
    let mut names = args.names.clone();
    let Some(file) = &args.names_from else {
        return Ok(names);
    };
    let (shown, bytes) = if file == Path::new("-") {
        ("the standard input".to_owned(), files::read_stdin()?)
    } else {
        (file.display().to_string(), files::read(file)?)
    };
    let Ok(text) = String::from_utf8(bytes) else {
        return Err(Refusal::Usage(format!("{shown} is not UTF-8; write it as UTF-8")).into());
    };
    let before = names.len();
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    names.extend(lines.filter(|line| !line.is_empty()).map(str::to_owned));
    if names.len() == before {
        let text = format!("{shown} has no names; write one a line");
        return Err(Refusal::NothingSelected(text).into());
    }
    Ok(names)
}

/// Parses a number of bytes with an optional unit: 4G, 512M, 900K.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let units = [('K', 10), ('M', 20), ('G', 30), ('T', 40)];
    let split = |(unit, shift): (char, u32)| {
        let number = text.strip_suffix([unit, unit.to_ascii_lowercase()])?;
        Some((number, shift))
    };
    let (number, shift) = units.into_iter().find_map(split).unwrap_or((text, 0));
    let number: Option<u64> = number.parse().ok();
    if let Some(bytes) = number.filter(|bytes| shift == 0 && (1..1 << 20).contains(bytes)) {
        return Err(format!(
            "{bytes} without K, M, G or T are {bytes} bytes; write a size such as {bytes}G"
        ));
    }
    number
        .and_then(|number| number.checked_mul(1 << shift))
        .filter(|bytes| *bytes > 0)
        .ok_or_else(|| "a size is a whole number with K, M, G or T, such as 4G".to_owned())
}

/// Returns the word that [`rerun`] parses.
const fn rerun_text(rerun: RerunPolicy) -> &'static str {
    match rerun {
        RerunPolicy::Failed => "failed",
        RerunPolicy::Changed => "stale",
        RerunPolicy::All(_) => "all",
    }
}

/// Returns a number of bytes as [`bytes`] parses it.
fn size_text(bytes: u64) -> String {
    let units = [(40, "T"), (30, "G"), (20, "M"), (10, "K")];
    let whole = units
        .into_iter()
        .find(|(shift, _)| bytes.is_multiple_of(1 << shift));
    let (shift, unit) = whole.unwrap_or((0, ""));
    format!("{}{unit}", bytes >> shift)
}

/// Returns the options of a run from the arguments and the settings.
pub(crate) fn options(args: &RunArgs, config: &Config, part: RunPart) -> RunOptions {
    let plain = run::options(config);
    RunOptions {
        workers: args.jobs.map_or(plain.workers, usize::from),
        memory: args.memory.or(plain.memory),
        part,
        join: args.join,
        max_failures: args.max_failures,
        rerun: match (args.rerun, args.stage) {
            (Some(RerunPolicy::All(_)), Some(stage)) => RerunPolicy::All(stage),
            (rerun, _) => rerun.unwrap_or(plain.rerun),
        },
        until: args.stage.unwrap_or(plain.until),
        ..plain
    }
}

/// Runs the pairs, shows the progress on stderr and handles signals.
pub(crate) async fn drive(prepared: PreparedRun, context: &Context) -> ProjectResult<RunOutcome> {
    let stop = Stop::new();
    let watch = signals::watch(&stop)?;
    let outcome = prepared.run(&stop, &Terminal::of_run(context)).await;
    watch.abort();
    outcome
}

/// Returns the exit code of a run.
pub(crate) const fn code(summary: &RunSummary) -> ExitCode {
    if summary.stopped {
        ExitCode::Stopped
    } else if summary.failed_in_all > 0
        || summary.blocks.failed_in_all > 0
        || summary.too_many_failures
    {
        ExitCode::SomeFailed
    } else {
        ExitCode::Done
    }
}

/// Prints what `command` would run. `retired` says that all pairs are retired.
fn print_plan(
    planned: &PlannedRun,
    (command, retired): (&str, Option<String>),
    context: &Context,
) -> ProjectResult<ExitCode> {
    let (blocks, plan, running) = (
        &planned.plan.blocks,
        &planned.plan.pairs,
        planned.is_running,
    );
    let json = json!({"schema": 1, "pairs": plan.pairs(), "plan": plan, "blocks": blocks});
    context.print(&json, || {
        plan_text(plan, running) + &block_plan_text(blocks)
    })?;
    if let Some(retired) = retired {
        context.info(&retired);
    }
    if plan.changes_method() {
        context.info(TWO_METHODS);
    }
    if planned.are_results_missing {
        context.warn(missing_results::TEXT);
    }
    if let Some(missing) = &planned.missing_inputs {
        context.warn(&missing.to_string());
    }
    if plan.pairs() > 0 || !blocks.is_empty() || plan.leased > 0 && !running {
        context.next(command);
    }
    Ok(ExitCode::Done)
}

/// Returns the command that runs what was planned: with all arguments but `--dry-run`. Names from the standard input cannot
/// be read again, so they are arguments.
fn command_without_dry_run(args: &RunArgs, names: &[String]) -> String {
    let RunArgs {
        names: typed,
        names_from,
        jobs,
        memory,
        dry_run: _,
        join,
        max_failures,
        rerun,
        stage,
        // Conflicts with `--dry-run`.
        metrics: _,
    } = args;
    let file = names_from.as_deref().filter(|file| *file != Path::new("-"));
    let option = |name: &str, value: String| format!("{name} {}", shell_quoted(&value));
    let options = [
        file.map(|file| option("--names-from", file.to_string_lossy().into_owned())),
        jobs.map(|jobs| format!("-j {jobs}")),
        memory.map(|memory| format!("--memory {}", size_text(memory))),
        join.then(|| "--join".to_owned()),
        max_failures.map(|number| format!("--max-failures {number}")),
        rerun.map(|rerun| format!("--rerun {}", rerun_text(rerun))),
        stage.map(|stage| format!("--stage {stage}")),
    ];
    let names = if file.is_some() { typed } else { names };
    let mut words = vec!["run".to_owned()];
    words.extend(options.into_iter().flatten());
    if names.iter().any(|name| name.starts_with('-')) {
        words.push("--".to_owned());
    }
    words.extend(names.iter().map(|name| shell_quoted(name)));
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::{RunArgs, bytes, command_without_dry_run, size_text};

    #[derive(Debug, clap::Parser)]
    struct RunLine {
        #[command(flatten)]
        args: RunArgs,
    }

    #[test]
    fn the_command_of_a_plan_asks_for_the_same() {
        for line in [
            "run",
            "run b01",
            "run --names-from names.txt -j 4 --memory 512M --join --max-failures 3 --rerun all --stage fit b01",
            "run --rerun stale",
        ] {
            let words = line.split(' ').chain(["-n"]);
            let RunLine { args } = RunLine::try_parse_from(words).expect("valid");
            // Those of the file are not repeated.
            let mut names = args.names.clone();
            names.extend(args.names_from.is_some().then(|| "b02".to_owned()));
            assert_eq!(command_without_dry_run(&args, &names), line);
        }
        let words = ["run", "-n", "--names-from", "-", "--", "-a"];
        let RunLine { args } = RunLine::try_parse_from(words).expect("valid");
        let names = ["-a", "lê văn"].map(str::to_owned);
        let command = command_without_dry_run(&args, &names);
        assert_eq!(command, "run -- -a 'lê văn'");
    }

    #[test]
    fn sizes_are_written_as_they_are_read() {
        for size in [1 << 10, 3 << 20, 4 << 30, (4 << 30) + 1, 5 << 40] {
            assert_eq!(bytes(&size_text(size)), Ok(size));
        }
        assert_eq!(size_text(4 << 30), "4G");
    }

    #[test]
    fn sizes_may_have_a_unit() {
        assert_eq!(bytes("4G"), Ok(4 << 30));
        assert_eq!(bytes("512m"), Ok(512 << 20));
        assert_eq!(bytes("4000000"), Ok(4_000_000));
        let refused = bytes("8").expect_err("8 bytes");
        assert!(refused.ends_with("such as 8G"), "{refused}");
        for wrong in ["", "G", "0", "-1G", "1.5G", "99999999999T", "4Gé"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }
}
