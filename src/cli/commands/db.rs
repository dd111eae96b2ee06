//! `db init`: creates a catalog in PostgreSQL, and the roles of its users.

use clap::{Args, Subcommand};
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::streams;
use mocban_catalog::{ROLES, initialize_database, roles_sql};
use mocban_project::{ExitCode, ProjectResult, Refusal};

/// Commands on the database of a catalog.
#[derive(Debug, Subcommand)]
pub(crate) enum DbCommand {
    /// Create the catalog in PostgreSQL if it is missing, and the roles of its users on request
    Init(DbInitArgs),
}

/// Arguments of `db init`.
#[derive(Debug, Args)]
pub(crate) struct DbInitArgs {
    /// Also create the roles `mocban_owner`, `mocban_worker`, `mocban_reviewer` and `mocban_viewer`, or give them the
    /// rights that this version needs; the user needs the right CREATEROLE
    #[arg(long)]
    pub(crate) roles: bool,
    /// Print the SQL of --roles for an administrator, without connecting
    #[arg(long, requires = "roles")]
    pub(crate) print_sql: bool,
}

pub(crate) async fn db(command: DbCommand, context: &Context) -> ProjectResult<ExitCode> {
    let DbCommand::Init(args) = command;
    if args.print_sql {
        let sql = roles_sql(context.location.catalog_url()?.as_deref())?;
        streams::print(sql.trim_end())?;
        return Ok(ExitCode::Done);
    }
    let Some(url) = context.location.catalog_url()? else {
        let text = "`db init` creates a catalog in PostgreSQL; give its address, such as --catalog postgres://me@db.example/lab";
        return Err(Refusal::Usage(text.to_owned()).into());
    };
    let is_new = initialize_database(&url, args.roles).await?;
    context.print_json(&json!({"schema": 1, "created": is_new, "roles": args.roles}))?;
    context.info(if is_new {
        "the catalog is created"
    } else {
        "the catalog was there already, and has the schema of this version"
    });
    if args.roles {
        context.info(&format!("the roles are ready: {}", ROLES.join(", ")));
        context.info("an administrator adds each user to one: GRANT mocban_reviewer TO lan");
    }
    if is_new {
        context.next("import pairs.csv");
    }
    Ok(ExitCode::Done)
}
