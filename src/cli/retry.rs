//! `retry`: lets failed pairs run again.

use clap::Args;
use serde_json::json;

use super::context::Context;
use super::exit::{ExitCode, Refusal};
use super::select;
use super::table::count;
use crate::catalog::{Catalog, RetrySelection};
use crate::domain::FailureClass;

/// Arguments of `retry`.
#[derive(Debug, Args)]
pub(super) struct RetryArgs {
    /// The pairs to retry [default: all failed pairs]
    #[arg(conflicts_with = "class")]
    pub(super) pairs: Vec<String>,
    /// Retry the pairs that failed with this class: `bad_input`, `no_solution`, io, resource or bug
    #[arg(long)]
    pub(super) class: Option<FailureClass>,
}

pub(super) async fn retry(args: RetryArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (_project, catalog) = context.open().await?;
    let selection = selection(&args, &catalog).await?;
    let retried = catalog.retry(&selection).await?;
    catalog.close().await;
    if retried == 0 {
        return Err(Refusal::NothingSelected(no_match(&selection)).into());
    }
    context.print_json(&json!({"schema": 1, "retried": retried}))?;
    context.info(&format!("{} will run again", count(retried, "pair")));
    context.next("run");
    Ok(ExitCode::Done)
}

async fn selection(args: &RetryArgs, catalog: &Catalog) -> anyhow::Result<RetrySelection> {
    if let Some(class) = args.class {
        return Ok(RetrySelection::Class(class));
    }
    let names = select::some_or_all(catalog, &args.pairs).await?;
    Ok(names.map_or(RetrySelection::All, RetrySelection::Names))
}

fn no_match(selection: &RetrySelection) -> String {
    match selection {
        RetrySelection::All => "no pair has failed".to_owned(),
        RetrySelection::Class(class) => format!("no pair has failed with class {class}"),
        RetrySelection::Names(_) => "none of these pairs has failed".to_owned(),
    }
}
