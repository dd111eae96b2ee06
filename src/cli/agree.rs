//! `agree`: how far readers can be trusted.

use clap::Args;

use super::context::Context;
use super::exit::ExitCode;
use super::talk;
use crate::report;

/// Arguments of `agree`: none but those of every command.
#[derive(Debug, Args)]
pub(super) struct AgreeArgs {}

pub(super) async fn agree(_: AgreeArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (_project, catalog) = context.reader().await?;
    let found = report::agree(&catalog).await?;
    catalog.close().await;
    if context.global.json {
        talk::print_json(&serde_json::to_value(&found)?)?;
    } else {
        talk::print(&report::agree_text(&found))?;
    }
    if found.conflicts > 0 {
        let next = "review --adjudicate --reader NAME";
        context.talk.next(&context.command(next));
    }
    Ok(ExitCode::Done)
}
