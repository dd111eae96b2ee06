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
        context.next("review --adjudicate --reviewer NAME");
    }
    Ok(ExitCode::Done)
}
