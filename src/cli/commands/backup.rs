//! `backup`: copies catalog, verdicts and settings to one file, and scans and prints to a folder beside it.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use crate::cli::output::terminal::Terminal;
use mocban_core::domain::one_line;
use mocban_project::backup::{self, Backup};
use mocban_project::backup_inputs::{LeftOutReason, SavedInputs};
use mocban_project::byte_size::byte_size;
use mocban_project::input_list::InputCopies;
use mocban_project::{ExitCode, ProjectResult};

/// Most inputs that are named because they were not copied.
const MAX_NAMED: usize = 10;

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
    /// Also copy scans, prints, pages and labels to the folder FILE.inputs, from which `restore` copies them into the new
    /// project; equal files that are there already stay
    #[arg(long)]
    pub(crate) with_inputs: bool,
}

pub(crate) async fn backup(args: BackupArgs, context: &Context) -> ProjectResult<ExitCode> {
    let file = &args.file.or(args.output).unwrap_or_default();
    let shown = file.display();
    let terminal = Terminal::new(context);
    let Backup {
        bytes,
        pairs,
        verdicts,
        inputs,
    } = backup::backup(file, args.with_inputs, &context.location, &terminal).await?;
    // The verdicts have no file of their own.
    context.print_json(&json!({
        "schema": 1, "file": file, "bytes": bytes, "pairs": pairs, "verdicts": verdicts,
        "verdicts_file": Value::Null, "inputs": inputs.as_ref().map(inputs_json),
    }))?;
    let (pairs, verdicts) = (count(pairs, "pair"), count(verdicts, "verdict"));
    let size = bytes as f64 / 1e6;
    let Some(inputs) = inputs else {
        context.info(&format!(
            "{pairs} and {verdicts} saved to {shown}, {size:.1} MB; your scans and prints are not in it, nor depth maps and masks, which `run` computes again"
        ));
        return Ok(ExitCode::Done);
    };
    let InputCopies {
        folder,
        files,
        bytes,
    } = &inputs.copies;
    let (folder, copied) = (folder.display(), inputs.copied);
    context.info(&format!(
        "{pairs} and {verdicts} saved to {shown}, {size:.1} MB, and {} of scans and prints, {}, to {folder} ({copied} copied now); depth maps and masks, which `run` computes again, are not in it",
        count(*files, "file"),
        byte_size(*bytes)
    ));
    if inputs.remote > 0 {
        context.info(&format!(
            "{} in an object store: not copied, the store keeps them",
            count(inputs.remote, "input")
        ));
    }
    if inputs.left_out == 0 {
        return Ok(ExitCode::Done);
    }
    context.warn(&left_out_text(&inputs));
    Ok(ExitCode::SomeFailed)
}

fn inputs_json(inputs: &SavedInputs) -> Value {
    json!({
        "folder": inputs.copies.folder, "files": inputs.copies.files, "bytes": inputs.copies.bytes,
        "copied": inputs.copied, "left_out": inputs.left_out, "first_left_out": inputs.first_left_out,
        "remote": inputs.remote,
    })
}

/// Names the first inputs that were not copied, and says what to do.
fn left_out_text(inputs: &SavedInputs) -> String {
    let named = inputs.first_left_out.iter().take(MAX_NAMED).map(|input| {
        let what = match input.reason {
            LeftOutReason::Missing => "is missing",
            LeftOutReason::Changed => "has changed since it was read",
            LeftOutReason::Unreadable => "cannot be read",
            LeftOutReason::Unwritable => {
                "cannot be written there, because of its name or size or what is in its place"
            }
        };
        format!("{} {what}", one_line(&input.path))
    });
    let named: Vec<String> = named.collect();
    let more = inputs.left_out.saturating_sub(named.len() as u64);
    let more = if more > 0 {
        format!(", and {more} more")
    } else {
        String::new()
    };
    format!(
        "{} not saved: {}{more}; put missing files back, let `run` read changed ones, then back up again",
        count(inputs.left_out, "input"),
        named.join(", ")
    )
}
