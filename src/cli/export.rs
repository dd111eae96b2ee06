//! `export`: the aligned pairs for other tools.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::context::Context;
use super::exit::ExitCode;
use super::output;
use super::table::count;
use crate::export::{ExportSummary, JsonlOptions, to_jsonl};

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// Form of the export
    #[arg(long, value_name = "FORM", default_value = "jsonl")]
    pub(super) to: Form,
    /// The folder to write; an earlier export there is replaced
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,
    /// Write computing times too; the bytes then differ from run to run
    #[arg(long)]
    pub(super) with_times: bool,
}

/// Form of an export.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Form {
    /// One line a pair and metric, with masks and pictures beside it.
    Jsonl,
}

pub(super) async fn export(args: ExportArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.reader().await?;
    let config = context.settings()?.config;
    context.warn_of_stale(&catalog).await?;
    let options = JsonlOptions {
        metrics: config.stages.normalize.method.metrics(),
        with_times: args.with_times,
        limits: config.limits.image,
    };
    let summary = match args.to {
        Form::Jsonl => to_jsonl(&catalog, &project, &args.output, options).await?,
    };
    catalog.close().await;
    tell(&summary, &args, context)?;
    Ok(if summary.unreadable.is_empty() {
        ExitCode::Done
    } else {
        ExitCode::SomeFailed
    })
}

fn tell(summary: &ExportSummary, args: &ExportArgs, context: &Context) -> anyhow::Result<()> {
    if context.global.json {
        let unreadable: Vec<_> = summary
            .unreadable
            .iter()
            .map(|(pair, why)| json!({"id": pair, "error": why}))
            .collect();
        output::print_json(&json!({
            "schema": 1,
            "done": summary.done,
            "without_result": summary.without_result,
            "unreadable": unreadable,
            "kept_earlier": summary.kept_earlier,
        }))?;
    }
    for (pair, why) in &summary.unreadable {
        context
            .output
            .warn(&format!("{pair} has no files in the export: {why}"));
    }
    let shown = args.output.display();
    if summary.kept_earlier {
        let lost = count(summary.unreadable.len() as u64, "pair");
        context.output.say(&format!(
            "the earlier export in {shown} stays: the new one would lack the files of {lost}; mend them, or export to a new folder"
        ));
    } else {
        tell_done(summary, args, context);
    }
    if !summary.unreadable.is_empty() {
        // A run trusts what the catalog says is done; a check does not.
        context.output.next(&context.command("check --repair"));
        context.output.next(&context.command("run"));
    }
    Ok(())
}

fn tell_done(summary: &ExportSummary, args: &ExportArgs, context: &Context) {
    let unreadable = match summary.unreadable.len() {
        0 => String::new(),
        lost => format!(", {lost} whose files are gone or changed"),
    };
    context.output.say(&format!(
        "{} exported to {}, {} without result{unreadable}",
        count(summary.done, "pair"),
        args.output.display(),
        summary.without_result
    ));
}
