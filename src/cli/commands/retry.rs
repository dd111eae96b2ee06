//! `retry`: lets failed pairs and blocks run again.

use clap::Args;
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::table::pairs_and_blocks;
use mocban_core::domain::FailureClass;
use mocban_project::retry::{self, Retried, RetryRequest};
use mocban_project::{ExitCode, ProjectResult};

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
    let request = match args.class {
        Some(class) => RetryRequest::Class(class),
        None if args.names.is_empty() => RetryRequest::All,
        None => RetryRequest::Names(args.names),
    };
    let Retried { pairs, blocks } = retry::retry(&request, &context.location).await?;
    let mut json = json!({"schema": 1, "retried": pairs});
    if blocks > 0 {
        json["blocks"] = blocks.into();
    }
    context.print_json(&json)?;
    let numbers = pairs_and_blocks(pairs, blocks);
    context.info(&format!("{numbers} will run again"));
    context.next("run");
    Ok(ExitCode::Done)
}
