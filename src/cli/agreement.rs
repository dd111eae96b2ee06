//! `agreement`: how reliable the reviewers are.

use clap::Args;

use super::context::Context;
use super::exit::ExitCode;
use super::output;
use crate::report;

/// Arguments of `agreement`: only the global ones.
#[derive(Debug, Args)]
pub(super) struct AgreementArgs {}

pub(super) async fn agreement(_: AgreementArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (_project, catalog) = context.open_read_only().await?;
    let found = report::agreement(&catalog).await?;
    catalog.close().await;
    if context.global.json {
        output::print_json(&serde_json::to_value(&found)?)?;
    } else {
        output::print(&report::agreement_text(&found))?;
    }
    if found.conflicts > 0 {
        let next = "review --adjudicate --reviewer NAME";
        context.output.next(&context.command(next));
    }
    Ok(ExitCode::Done)
}
