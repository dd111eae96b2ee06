//! `export`: writes the aligned pairs for other tools.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::context::Context;
use super::exit::ExitCode;
use super::table::count;
use crate::export::{ExportSummary, JsonlOptions, to_jsonl};

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// Format of the export
    #[arg(long, value_name = "FORMAT", default_value = "jsonl")]
    pub(super) to: ExportFormat,
    /// The directory to write; an earlier export there is replaced
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,
    /// Include computing times; the output then differs from run to run
    #[arg(long)]
    pub(super) with_times: bool,
}

/// Format of an export.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ExportFormat {
    /// One line per pair and metric, with masks and images in files.
    Jsonl,
}

pub(super) async fn export(args: ExportArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.open_read_only().await?;
    let config = context.settings()?.config;
    context.warn_about_stale(&catalog).await?;
    let options = JsonlOptions {
        metrics: config.stages.pipeline.method.metrics(),
        with_times: args.with_times,
        limits: config.limits.image,
    };
    let summary = match args.to {
        ExportFormat::Jsonl => to_jsonl(&catalog, &project, &args.output, options).await?,
    };
    catalog.close().await;
    print_summary(&summary, &args, context)?;
    Ok(if summary.unreadable.is_empty() {
        ExitCode::Done
    } else {
        ExitCode::SomeFailed
    })
}

fn print_summary(
    summary: &ExportSummary,
    args: &ExportArgs,
    context: &Context,
) -> anyhow::Result<()> {
    let unreadable = summary.unreadable.iter();
    let unreadable = unreadable.map(|(pair, why)| json!({"id": pair, "error": why}));
    context.print_json(&json!({
        "schema": 1,
        "done": summary.done,
        "without_result": summary.without_result,
        "unreadable": unreadable.collect::<Vec<_>>(),
        "kept_earlier": summary.kept_earlier,
    }))?;
    for (pair, why) in &summary.unreadable {
        context.warn(&format!("the export has no files of {pair}: {why}"));
    }
    let shown = args.output.display();
    if summary.kept_earlier {
        let lost = count(summary.unreadable.len() as u64, "pair");
        context.info(&format!(
            "the earlier export in {shown} was kept, because the new one would lack the files of {lost}; repair them, or export to a new directory"
        ));
    } else {
        print_done(summary, args, context);
    }
    if let Some((path, why)) = &summary.leftover {
        context.warn(&format!(
            "the earlier export was replaced but could not be removed from {}: {why}; the next export removes it",
            path.display()
        ));
    }
    if !summary.unreadable.is_empty() {
        // A run trusts the catalog, so the check must come first.
        context.next("check --repair");
        context.next("run");
    }
    Ok(())
}

fn print_done(summary: &ExportSummary, args: &ExportArgs, context: &Context) {
    let unreadable = match summary.unreadable.len() {
        0 => String::new(),
        lost => format!(", {lost} with missing or changed files"),
    };
    context.info(&format!(
        "{} exported to {}, {} without a result{unreadable}",
        count(summary.done, "pair"),
        args.output.display(),
        summary.without_result
    ));
}
