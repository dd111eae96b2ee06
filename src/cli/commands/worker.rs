//! `plan` and `worker`: the two parts of a run, for runs on several machines.

use clap::Args;
use serde_json::json;

use super::metrics::MetricsArgs;
use super::run::{self, RunArgs};
use crate::cli::input::signals;
use crate::cli::output::context::Context;
use crate::cli::output::table::pairs_and_blocks;
use crate::cli::output::terminal::Terminal;
use mocban_catalog::RerunPolicy;
use mocban_core::domain::Stage;
use mocban_project::run::PreparedRun;
use mocban_project::{ExitCode, ProjectResult};
use mocban_runner::{RunPart, Stop};

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub(crate) struct PlanArgs {
    /// Only these pairs, and these blocks with their pairs [default: all]
    #[arg(value_name = "NAME")]
    pub(crate) names: Vec<String>,
    /// Also plan these pairs again: failed, stale (settings or files changed, which every plan includes) or all
    #[arg(long, value_name = "WHICH", value_parser = run::rerun)]
    pub(crate) rerun: Option<RerunPolicy>,
}

/// Arguments of `worker`.
#[derive(Debug, Args)]
pub(crate) struct WorkerArgs {
    /// Number of pairs to process at the same time [default: one per core]
    #[arg(short = 'j', long = "jobs", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Memory for the pairs and the block processed at the same time, such as 4G or 512M [default: most of the free
    /// memory]
    #[arg(long, value_name = "SIZE", value_parser = run::bytes)]
    pub(crate) memory: Option<u64>,
    /// Stop after this many pairs and blocks have failed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) max_failures: Option<u64>,
    /// Run only this stage and earlier ones
    #[arg(long, value_name = "STAGE")]
    pub(crate) stage: Option<Stage>,
    #[command(flatten)]
    pub(crate) metrics: MetricsArgs,
}

pub(crate) async fn plan(args: PlanArgs, context: &Context) -> ProjectResult<ExitCode> {
    let args = RunArgs {
        names: args.names,
        rerun: args.rerun,
        ..RunArgs::default()
    };
    let options = run::options(&args, &context.location.settings()?.config, RunPart::Plan);
    let terminal = Terminal::new(context);
    let (names, location) = (&args.names, &context.location);
    let prepared = PreparedRun::new(names, options, false, location, &terminal).await?;
    let retired = prepared.all_retired().await?;
    let stop = Stop::new();
    let watch = signals::watch(&stop)?;
    let planned = prepared.run(&stop, &()).await;
    watch.abort();
    let planned = planned?.summary;
    let blocks = planned.blocks.left;
    context.print_json(&json!({
        "schema": 1, "pairs": planned.left, "blocks": blocks, "status": planned.status,
    }))?;
    let numbers = pairs_and_blocks(planned.left, blocks);
    context.info(&format!("{numbers} to run"));
    if let Some(retired) = retired {
        context.info(&retired);
    }
    if planned.left + blocks > 0 {
        context.next("worker");
    }
    Ok(ExitCode::Done)
}

pub(crate) async fn worker(args: WorkerArgs, context: &Context) -> ProjectResult<ExitCode> {
    let args = RunArgs {
        jobs: args.jobs,
        memory: args.memory,
        max_failures: args.max_failures,
        stage: args.stage,
        metrics: args.metrics,
        ..RunArgs::default()
    };
    run::execute(args, RunPart::Work, context).await
}
