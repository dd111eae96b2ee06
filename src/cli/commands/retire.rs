//! `retire`: takes pairs out of every count and brings them back.

use std::collections::BTreeSet;

use clap::Args;
use serde_json::json;

use crate::cli::input::select;
use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use mocban_catalog::Catalog;
use mocban_core::domain::PairName;
use mocban_project::exit::{ExitCode, Refusal};
use mocban_project::location::now;
use mocban_project::shell::shell_quoted;

/// Arguments of `retire`.
#[derive(Debug, Args)]
pub(crate) struct RetireArgs {
    /// The pairs
    #[arg(value_name = "PAIR", required = true)]
    pub(crate) pairs: Vec<String>,
    /// Bring the pairs back, with their results and verdicts
    #[arg(long)]
    pub(crate) undo: bool,
}

pub(crate) async fn retire(args: RetireArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (_project, catalog) = context.open().await?;
    let names = select::known_pairs(&catalog, &args.pairs).await?;
    let names: BTreeSet<PairName> = names.into_iter().collect();
    let names: Vec<PairName> = names.into_iter().collect();
    let changed = if args.undo {
        catalog.restore_pairs(&names).await?
    } else {
        catalog.retire_pairs(&names, now()).await?
    };
    let still_retired = still_retired(&catalog, &names).await?;
    catalog.close().await;
    if args.undo
        && changed == 0
        && let Some(pair) = still_retired.first()
    {
        return Err(Refusal::NothingSelected(box_is_gone(pair)).into());
    }
    let others = names.len() as u64 - changed;
    let (key, done) = if args.undo {
        (
            "restored",
            format!("{} back in every count", count(changed, "pair")),
        )
    } else {
        let text = "out of every count; results and verdicts are kept";
        ("retired", format!("{} {text}", count(changed, "pair")))
    };
    context.print_json(&json!({"schema": 1, key: changed, "unchanged": others}))?;
    context.info(&done);
    if others > 0 && !args.undo {
        context.info(&format!("{} retired already", count(others, "pair")));
    }
    if args.undo {
        for pair in &still_retired {
            context.warn(&box_is_gone(pair));
        }
        context.next("run");
    } else if let [pair] = names.as_slice() {
        context.next(&format!("retire --undo {}", shell_quoted(pair.as_str())));
    }
    Ok(ExitCode::Done)
}

/// Returns the pairs among `names` that are retired.
async fn still_retired(catalog: &Catalog, names: &[PairName]) -> anyhow::Result<Vec<PairName>> {
    let retired = catalog.retired_pairs().await?.into_iter();
    let names: BTreeSet<&PairName> = names.iter().collect();
    Ok(retired
        .map(|pair| pair.name)
        .filter(|name| names.contains(name))
        .collect())
}

fn box_is_gone(pair: &PairName) -> String {
    format!(
        "pair {pair} has no box any more in the labels of its block; it comes back with its box, when the block runs again"
    )
}
