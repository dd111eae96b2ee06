//! `retire`: takes pairs out of every count and brings them back.

use clap::Args;
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use mocban_core::domain::shell::quoted_id;
use mocban_project::retire::{self, RetireChoice, RetireOutcome};
use mocban_project::{ExitCode, ProjectResult};
use mocban_system::time_text::local;

/// Arguments of `retire`.
#[derive(Debug, Args)]
pub(crate) struct RetireArgs {
    /// Pairs, or blocks for all their pairs; a block without pairs is removed
    #[arg(value_name = "PAIR|BLOCK", required_unless_present_any = ["last_import", "import"])]
    pub(crate) pairs: Vec<String>,
    /// The pairs that the newest import added
    #[arg(long, conflicts_with = "pairs")]
    pub(crate) last_import: bool,
    /// The pairs of one import: 1 is the newest that added any, 2 the one before it
    #[arg(long, value_name = "N", conflicts_with_all = ["pairs", "last_import"],
          value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) import: Option<u32>,
    /// Bring the pairs back, with their results and verdicts
    #[arg(long)]
    pub(crate) undo: bool,
}

pub(crate) async fn retire(args: RetireArgs, context: &Context) -> ProjectResult<ExitCode> {
    let choice = match args.import {
        Some(number) => RetireChoice::NthImport(number),
        None if args.last_import => RetireChoice::LastImport(None),
        None => RetireChoice::Ids(args.pairs.clone()),
    };
    let RetireOutcome {
        names,
        changed,
        removed_blocks,
        imported,
        warnings,
        at: _,
    } = if args.undo {
        retire::undo(&choice, &context.location).await?
    } else {
        retire::retire(&choice, &context.location).await?
    };
    let others = names.len() as u64 - changed;
    let (key, text) = if args.undo {
        ("restored", "back in every count")
    } else {
        let text = "out of every count; results and verdicts are kept";
        ("retired", text)
    };
    let mut printed = json!({"schema": 1, key: changed, "unchanged": others});
    if !removed_blocks.is_empty() {
        printed["removed_blocks"] = json!(removed_blocks);
    }
    context.print_json(&printed)?;
    if let Some(imported) = imported {
        let date = local(imported);
        context.info(&format!("the import that added these pairs was on {date}"));
    }
    for block in &removed_blocks {
        context.info(&format!(
            "block {block} is removed, because it has no pairs; an import brings it back"
        ));
    }
    if changed > 0 {
        context.info(&format!("{} {text}", count(changed, "pair")));
    }
    if others > 0 && !args.undo {
        context.info(&format!("{} retired already", count(others, "pair")));
    }
    for warning in &warnings {
        context.warn(warning);
    }
    if args.undo {
        context.next("run");
    } else if let (Some(number), 0) = (args.import, others) {
        context.next(&format!("retire --undo --import {number}"));
    } else if args.last_import && others == 0 {
        context.next("retire --undo --last-import");
    } else if let ([typed], 0, true) = (args.pairs.as_slice(), others, changed > 0) {
        context.next(&format!("retire --undo {}", quoted_id(typed)));
    }
    Ok(ExitCode::Done)
}
