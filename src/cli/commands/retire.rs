//! `retire`: takes pairs out of every count and brings them back.

use clap::Args;
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use mocban_project::retire::{self, RetireChoice, RetireOutcome};
use mocban_project::shell::shell_quoted;
use mocban_project::{ExitCode, ProjectResult};

/// Arguments of `retire`.
#[derive(Debug, Args)]
pub(crate) struct RetireArgs {
    /// The pairs, or the blocks of which all pairs are meant
    #[arg(value_name = "PAIR|BLOCK", required_unless_present = "last_import")]
    pub(crate) pairs: Vec<String>,
    /// The pairs that the newest import of a list or of folders added
    #[arg(long, conflicts_with = "pairs")]
    pub(crate) last_import: bool,
    /// Bring the pairs back, with their results and verdicts
    #[arg(long)]
    pub(crate) undo: bool,
}

pub(crate) async fn retire(args: RetireArgs, context: &Context) -> ProjectResult<ExitCode> {
    let choice = if args.last_import {
        RetireChoice::LastImport(None)
    } else {
        RetireChoice::Ids(args.pairs.clone())
    };
    let RetireOutcome {
        names,
        changed,
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
    context.print_json(&json!({"schema": 1, key: changed, "unchanged": others}))?;
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
    } else if args.last_import && others == 0 {
        context.next("retire --undo --last-import");
    } else if let ([typed], 0) = (args.pairs.as_slice(), others) {
        context.next(&format!("retire --undo {}", shell_quoted(typed)));
    }
    Ok(ExitCode::Done)
}
