//! `import`: adds pairs of meshes and prints, or whole blocks, to the project, and creates the project if there is
//! none.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::import_blocks::{self, BlockArgs};
use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use crate::cli::output::terminal::Terminal;
use mocban_core::domain::LengthUnit;
use mocban_project::import_blocks::{ListedItems, import_blocks};
use mocban_project::import_pairs::{
    AllowedChanges, ImportOutcome, PairImport, PairSource, import_pairs,
};
use mocban_project::pair_choices::PairChoices;
use mocban_project::{ExitCode, ProjectResult, Refusal};

/// The three ways to name what is imported.
const USAGE: &str = "mocban import [OPTIONS] FILE
       mocban import [OPTIONS] --meshes DIR --prints DIR
       mocban import [OPTIONS] --block MESH --page IMAGE";

/// Arguments of `import`.
#[derive(Debug, Default, Args)]
#[command(override_usage = USAGE)]
pub(crate) struct ImportArgs {
    /// A CSV, XLSX or JSON Lines file with the columns id, mesh, print and optionally character, block, unit,
    /// `scanned_face_down`; or such a file of whole blocks with the columns block, mesh, page and optionally labels, unit,
    /// side; paths are relative to the file
    #[arg(required_unless_present_any = ["meshes", "block"], conflicts_with_all = ["meshes", "block"])]
    pub(crate) file: Option<PathBuf>,
    /// Sheet of an XLSX file [default: the first one]
    #[arg(long, value_name = "NAME", requires = "file")]
    pub(crate) sheet: Option<String>,
    /// A directory of meshes, paired with --prints by file stem; in folders, also by their names, and ids are `FOLDER_STEM`
    #[arg(long, value_name = "DIR", requires = "prints")]
    pub(crate) meshes: Option<PathBuf>,
    /// A directory of prints; it may be that of --meshes
    #[arg(long, value_name = "DIR", requires = "meshes")]
    pub(crate) prints: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) block: BlockArgs,
    /// Unit of the meshes in --meshes or of --block: mm, cm, m or in
    #[arg(long, conflicts_with = "file", value_parser = LengthUnit::named)]
    pub(crate) unit: Option<LengthUnit>,
    /// True alignments, one JSON object per line; the report then gives the errors against them
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Import pairs whose files do not exist yet; they fail if they are run before
    #[arg(long)]
    pub(crate) allow_missing: bool,
    /// Let most of the pairs that the project has get another mesh and another print, because the files have moved; or
    /// blocks another scan and another page
    #[arg(long)]
    pub(crate) allow_changed_files: bool,
    /// Retire the pairs that the list does not have, except for those cut from blocks: they are in no count, and their
    /// results and verdicts are kept; a list that has them brings them back
    #[arg(long)]
    pub(crate) replace: bool,
}

pub(crate) async fn import(args: ImportArgs, context: &Context) -> ProjectResult<ExitCode> {
    let (items, warning) = items(&args)?;
    if matches!(items, ListedItems::Blocks(_)) {
        let refused = refuse_options_of_pairs(&args);
        if let (Err(_), Some(warning)) = (&refused, &warning) {
            // It may say why this is a list of blocks.
            context.warn(warning);
        }
        refused?;
    }
    let allowed = AllowedChanges {
        missing: args.allow_missing,
        files: args.allow_changed_files,
        replace: args.replace,
    };
    let (location, terminal) = (&context.location, Terminal::new(context));
    match items {
        ListedItems::Blocks(source) => {
            let outcome = import_blocks(&source, allowed, location, &terminal).await;
            if let (Err(_), Some(warning)) = (&outcome, &warning) {
                // The table may be on another sheet.
                context.warn(warning);
            }
            let mut outcome = outcome?;
            outcome.warnings.extend(warning);
            context.print_json(&import_blocks::as_json(&outcome))?;
            import_blocks::print_outcome(&outcome, context);
        }
        ListedItems::Pairs(source) => {
            let import = PairImport {
                source,
                truth: args.truth,
                allowed,
                choices: PairChoices::default(),
            };
            let outcome = import_pairs(import, location, &terminal).await;
            if let (Err(_), Some(warning)) = (&outcome, &warning) {
                // The table may be on another sheet.
                context.warn(warning);
            }
            let mut outcome = outcome?;
            outcome.warnings.extend(warning);
            context.print_json(&as_json(&outcome))?;
            print_outcome(&outcome, context);
        }
    }
    context.next("run");
    Ok(ExitCode::Done)
}

/// Returns what the arguments name, and a warning about other sheets of a workbook.
fn items(args: &ImportArgs) -> ProjectResult<(ListedItems, Option<String>)> {
    if let Some(source) = args.block.source(args.unit) {
        return Ok((ListedItems::Blocks(source), None));
    }
    match (&args.file, &args.meshes, &args.prints) {
        (Some(file), ..) => ListedItems::of(file, args.sheet.as_deref()),
        (None, Some(meshes), Some(prints)) => {
            let folders = PairSource::Folders {
                meshes: meshes.clone(),
                prints: prints.clone(),
                unit: args.unit,
            };
            Ok((ListedItems::Pairs(folders), None))
        }
        (None, ..) => {
            let text = "give a list, or --meshes and --prints, or --block and --page";
            Err(Refusal::Usage(text.to_owned()).into())
        }
    }
}

/// Refuses options of pairs in an import of blocks.
fn refuse_options_of_pairs(args: &ImportArgs) -> ProjectResult<()> {
    let text = if args.truth.is_some() {
        "--truth holds true alignments of pairs, but blocks are imported"
    } else if args.replace {
        "--replace retires pairs that a list of pairs does not have, but blocks are imported"
    } else {
        return Ok(());
    };
    Err(Refusal::Usage(text.to_owned()).into())
}

/// Prints what an import changed, after its warnings.
pub(crate) fn print_outcome(outcome: &ImportOutcome, context: &Context) {
    const MAX_WARNINGS: usize = 20;
    const MAX_CHANGES: usize = 10;
    for line in outcome.missing.lines.iter().take(MAX_WARNINGS) {
        context.warn(line);
    }
    if let Some(more) = outcome.missing.count.checked_sub(MAX_WARNINGS + 1) {
        context.warn(&format!("{} more files do not exist", more + 1));
    }
    for line in &outcome.warnings {
        context.warn(line);
    }
    if let Some(renamed) = &outcome.renamed {
        context.info(renamed);
    }
    let summary = &outcome.summary;
    let truths = match outcome.truths {
        0 => String::new(),
        truths => format!("; {} stored", count(truths, "true alignment")),
    };
    context.info(&format!(
        "{} added, {} changed, {} unchanged{truths}",
        count(summary.added, "pair"),
        summary.changed.len(),
        summary.unchanged
    ));
    if summary.other_files > 0 {
        let pairs = count(summary.other_files, "pair");
        context.info(&format!(
            "{pairs} with another mesh or print; the next run looks at them"
        ));
    }
    for (number, text) in [
        (
            summary.retired,
            "retired, not in the list; results and verdicts are kept",
        ),
        (summary.restored, "back in every count"),
        (
            summary.still_retired,
            "of the list retired earlier; they stay out of every count until `retire --undo`",
        ),
    ] {
        if number > 0 {
            context.info(&format!("{} {text}", count(number, "pair")));
        }
    }
    for change in summary.changed.iter().take(MAX_CHANGES) {
        let fields = change.fields.join(", ");
        context.info(&format!("  {}: {fields} changed", change.name));
    }
    if let Some(more) = summary.changed.len().checked_sub(MAX_CHANGES + 1) {
        context.info(&format!("  and {} more", more + 1));
    }
}

fn as_json(outcome: &ImportOutcome) -> Value {
    let summary = &outcome.summary;
    let changed = summary.changed.iter();
    let changed = changed.map(|change| json!({"id": change.name, "fields": change.fields}));
    json!({
        "schema": 1,
        "added": summary.added,
        "changed": changed.collect::<Value>(),
        "other_files": summary.other_files,
        "unchanged": summary.unchanged,
        "retired": summary.retired,
        "restored": summary.restored,
        "still_retired": summary.still_retired,
        "truths": outcome.truths,
        "missing_files": outcome.missing.lines,
        "more_missing_files": outcome.missing.count - outcome.missing.lines.len(),
        "warnings": outcome.warnings,
        "renamed_columns": outcome.renamed,
    })
}
