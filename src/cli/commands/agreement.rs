//! `agreement`: how reliable the reviewers are.

use crate::cli::output::context::Context;
use mocban_project::{ExitCode, ProjectResult};
use mocban_report::agreement_text;
use mocban_results as results;

pub(crate) async fn agreement(context: &Context) -> ProjectResult<ExitCode> {
    let (_project, catalog) = context.location.open_read_only().await?;
    let found = results::agreement(&catalog).await?;
    catalog.close().await;
    context.warn_about_set_apart(&found.set_apart);
    context.print(&found, || agreement_text(&found))?;
    if found.conflicts > 0 {
        let command = context.command("review --adjudicate --reviewer NAME");
        context.info(&format!(
            "a person who did not judge these results settles them (put that person's name for NAME): {command}"
        ));
    }
    Ok(ExitCode::Done)
}
