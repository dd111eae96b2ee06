//! `copy`: copies a catalog between a project folder and PostgreSQL.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::table::{columns, count};
use crate::cli::output::terminal::Terminal;
use mocban_catalog::{CatalogCopy, CopiedTable};
use mocban_core::domain::is_address;
use mocban_project::copy::copy as copy_catalog;
use mocban_project::{ExitCode, ProjectResult};

/// Arguments of `copy`.
#[derive(Debug, Args)]
pub(crate) struct CopyArgs {
    /// The catalog to copy: a project folder, or an address such as <postgres://me@db.example/lab>
    pub(crate) from: String,
    /// Where to copy it: a project folder without a catalog, or an address of PostgreSQL without one. The copy appears
    /// there when it is complete; of an interrupted copy, nothing is left
    pub(crate) to: String,
}

pub(crate) async fn copy(args: CopyArgs, context: &Context) -> ProjectResult<ExitCode> {
    let CopyArgs { from, to } = args;
    let copied = copy_catalog(&from, &to, &Terminal::new(context)).await?;
    let CatalogCopy { tables, existed } = copied;
    let document = json!({"schema": 1, "tables": tables, "existed": existed});
    context.print(&document, || text(&tables))?;
    context.info(&if existed {
        format!(
            "{to} is a finished copy of {from} already, and all rows are equal; nothing was written"
        )
    } else {
        "all rows were compared; artifacts and input files were not copied".to_owned()
    });
    suggest_status(&from, &to, context);
    Ok(ExitCode::Done)
}

/// Suggests to look at the copy. A copy on a server belongs to the folder with the artifacts.
fn suggest_status(from: &str, to: &str, context: &Context) {
    let mut copied = context.clone();
    let folder = [to, from].into_iter().find(|place| !is_address(place));
    copied.global.directory = folder.map(PathBuf::from);
    copied.global.catalog = is_address(to).then(|| to.to_owned());
    copied.next("status");
}

fn text(tables: &[CopiedTable]) -> String {
    let rows = tables.iter().filter(|table| table.rows > 0);
    let rows = rows.map(|table| {
        let hash = table.hash.to_hex();
        vec![
            table.name.to_owned(),
            count(table.rows, "row"),
            hash[..12].to_owned(),
        ]
    });
    columns(rows, "<><")
}
