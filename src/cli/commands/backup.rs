//! `backup`: copies catalog, verdicts and settings to one file.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use crate::cli::output::terminal::Terminal;
use mocban_project::backup::{self, Backup};
use mocban_project::{ExitCode, ProjectResult};

/// Arguments of `backup`.
#[derive(Debug, Args)]
pub(crate) struct BackupArgs {
    /// The file to write, such as blocks.sqlite; an existing backup is replaced only when the new one is complete. The
    /// file holds pairs, results, verdicts and the project's settings, but neither scans and prints nor depth maps and
    /// masks; `restore` makes a project of it
    #[arg(required_unless_present = "output")]
    pub(crate) file: Option<PathBuf>,
    /// The same as FILE
    #[arg(short, long, value_name = "FILE", conflicts_with = "file")]
    pub(crate) output: Option<PathBuf>,
}

pub(crate) async fn backup(args: BackupArgs, context: &Context) -> ProjectResult<ExitCode> {
    let file = &args.file.or(args.output).unwrap_or_default();
    let shown = file.display();
    let terminal = Terminal::new(context);
    let Backup {
        bytes,
        pairs,
        verdicts,
    } = backup::backup(file, &context.location, &terminal).await?;
    // The verdicts have no file of their own.
    context.print_json(&json!({
        "schema": 1, "file": file, "bytes": bytes, "pairs": pairs, "verdicts": verdicts,
        "verdicts_file": Value::Null,
    }))?;
    context.info(&format!(
        "{} and {} saved to {shown}, {:.1} MB; your scans and prints are not in it, nor depth maps and masks, which `run` computes again",
        count(pairs, "pair"),
        count(verdicts, "verdict"),
        bytes as f64 / 1e6
    ));
    Ok(ExitCode::Done)
}
