//! `retry`: lets failed pairs and blocks run again.

use clap::Args;
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::table::pairs_and_blocks;
use mocban_catalog::{BlockJob, Catalog, RetrySelection};
use mocban_core::domain::FailureClass;
use mocban_project::selection;
use mocban_project::{ExitCode, ProjectResult, Refusal};
use mocban_runner::NamedWork;

/// Arguments of `retry`.
#[derive(Debug, Args)]
pub(crate) struct RetryArgs {
    /// The pairs or blocks to retry [default: all that failed]
    #[arg(value_name = "NAME", conflicts_with = "class")]
    pub(crate) names: Vec<String>,
    /// Retry the pairs and blocks that failed with this class: `bad_input`, `no_solution`, io, resource or bug
    #[arg(long)]
    pub(crate) class: Option<FailureClass>,
}

pub(crate) async fn retry(args: RetryArgs, context: &Context) -> ProjectResult<ExitCode> {
    let (_project, catalog) = context.open().await?;
    let (selection, block_selection) = selection(&args, &catalog).await?;
    let [retried, blocks] = catalog
        .retry_pairs_and_blocks(&selection, &block_selection)
        .await?;
    catalog.close().await;
    if retried + blocks == 0 {
        return Err(Refusal::NothingSelected(no_match(&selection)).into());
    }
    let mut json = json!({"schema": 1, "retried": retried});
    if blocks > 0 {
        json["blocks"] = blocks.into();
    }
    context.print_json(&json)?;
    let numbers = pairs_and_blocks(retried, blocks);
    context.info(&format!("{numbers} will run again"));
    context.next("run");
    Ok(ExitCode::Done)
}

/// Returns the pairs and the blocks to retry.
async fn selection(
    args: &RetryArgs,
    catalog: &Catalog,
) -> ProjectResult<(RetrySelection, RetrySelection<BlockJob>)> {
    if let Some(class) = args.class {
        return Ok((RetrySelection::Class(class), RetrySelection::Class(class)));
    }
    if args.names.is_empty() {
        return Ok((RetrySelection::All, RetrySelection::All));
    }
    let NamedWork { pairs, blocks } = selection::pairs_and_blocks(catalog, &args.names).await?;
    Ok((RetrySelection::Names(pairs), RetrySelection::Names(blocks)))
}

fn no_match(selection: &RetrySelection) -> String {
    match selection {
        RetrySelection::All => "no pair or block has failed".to_owned(),
        RetrySelection::Class(class) => format!("no pair or block has failed with class {class}"),
        RetrySelection::Names(_) => "none of these has failed".to_owned(),
    }
}
