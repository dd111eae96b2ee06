//! `restore`: makes a project of a backup.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use crate::cli::output::terminal::Terminal;
use mocban_project::byte_size::byte_size;
use mocban_project::restore::{self, RestoreRequest, Restored};
use mocban_project::{ExitCode, ProjectResult};
use mocban_store::SETTINGS_FILE;

/// Arguments of `restore`.
#[derive(Debug, Args)]
pub(crate) struct RestoreArgs {
    /// The backup
    pub(crate) backup: PathBuf,
    /// The project directory to create; it may hold meshes and prints already
    pub(crate) dir: PathBuf,
    /// A directory where meshes and prints are looked for that are no longer at their old places. Without it, those beside
    /// the backup (BACKUP.inputs) are copied into the project
    #[arg(long, value_name = "DIR")]
    pub(crate) inputs: Option<PathBuf>,
}

pub(crate) async fn restore(args: RestoreArgs, context: &Context) -> ProjectResult<ExitCode> {
    let request = RestoreRequest {
        backup: args.backup,
        dir: args.dir,
        inputs: args.inputs,
    };
    let terminal = Terminal::new(context);
    let restored = restore::restore(&request, &context.location, &terminal).await?;
    let RestoreRequest { dir, inputs, .. } = request;
    let (pairs, verdicts) = (restored.pairs, restored.verdicts);
    let copied = restored.copied.as_ref();
    context.print_json(&json!({
        "schema": 1, "project": dir, "pairs": pairs, "verdicts": verdicts,
        "settings": restored.settings.is_some(), "inputs_missing": restored.missing.len(),
        "inputs_copied": copied.map(|copied| copied.files), "inputs_elsewhere": restored.elsewhere,
        "settings_removed": restored.settings.as_ref().map_or(&[][..], |settings| &settings.removed),
    }))?;
    let (pairs, verdicts) = (count(pairs, "pair"), count(verdicts, "verdict"));
    let shown = dir.display();
    let inputs_text = inputs_text(&restored, inputs.as_deref());
    context.info(&format!(
        "{pairs} and {verdicts} restored to {shown}; {inputs_text}"
    ));
    if let Some(first) = restored.missing.first() {
        let missing = count(restored.missing.len() as u64, "path");
        let folder = inputs.as_deref().or(copied.map(|copied| &*copied.folder));
        let folder = folder.map_or_else(String::new, |folder| folder.display().to_string());
        context.warn(&format!(
            "{missing} neither at the old place nor in {folder}, first {first}; put meshes and prints there before `check --repair --accept-missing`"
        ));
    }
    if let Some(copied) = copied.filter(|_| restored.elsewhere > 0) {
        context.warn(&format!(
            "{} read at the old place, because {} has no whole copy; keep these files there",
            count(restored.elsewhere, "input"),
            copied.folder.display()
        ));
    }
    if let Some(missing) = &restored.not_in_place {
        context.warn(&format!(
            "{}; `restore --inputs DIR` looks for them in another folder",
            missing.found()
        ));
    }
    if let Some(removed) = restored.settings.map(|settings| settings.removed)
        && !removed.is_empty()
    {
        context.warn(&format!(
            "the restored project uses only its own folder: in {}, `restore` commented out {}; that file says how to use a server again",
            dir.join(SETTINGS_FILE).display(),
            removed.join(", ")
        ));
    }
    let context = context.at(&dir);
    context.next("check --repair --accept-missing");
    context.next("run");
    Ok(ExitCode::Done)
}

/// Says where scans and prints are, or have to be put.
fn inputs_text(restored: &Restored, inputs: Option<&Path>) -> String {
    match (&restored.copied, &restored.copied_to) {
        (Some(copied), Some(place)) => {
            let needs = if restored.elsewhere == 0 {
                ", so the project does not need that folder"
            } else {
                ""
            };
            format!(
                "{} of scans and prints, {}, copied from {} to {}{needs}; the next two commands compute depth maps and masks again",
                count(copied.files, "file"),
                byte_size(copied.bytes),
                copied.folder.display(),
                place.display()
            )
        }
        (Some(copied), None) => format!(
            "nothing was copied from {}; the next two commands compute depth maps and masks again",
            copied.folder.display()
        ),
        (None, _) => {
            let places = match inputs {
                None => "their old places".to_owned(),
                Some(inputs) => format!("their old places or in {}", inputs.display()),
            };
            format!(
                "a backup has no scans, prints, depth maps and masks: put scans and prints at {places}, and the next two commands compute the rest again"
            )
        }
    }
}
