//! `copy`: copies a catalog between a project folder and PostgreSQL.

use std::path::Path;

use anyhow::Context as _;
use clap::Args;
use serde_json::json;

use super::busy::Busy;
use super::context::{Context, refuse_password};
use super::exit::ExitCode;
use super::table::{columns, count};
use crate::catalog::{Catalog, CopiedTable};
use crate::store::Project;

/// Arguments of `copy`.
#[derive(Debug, Args)]
pub(super) struct CopyArgs {
    /// The catalog to copy: a project folder, or an address such as <postgres://me@db.example/lab>
    pub(super) from: String,
    /// Where to copy it: a project folder without a catalog, or an address of PostgreSQL without one; the same
    /// command continues an interrupted copy
    pub(super) to: String,
}

pub(super) async fn copy(args: CopyArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let source = open(&args.from)
        .await
        .with_context(|| format!("cannot copy {}", args.from))?;
    let failed = || format!("cannot copy to {}", args.to);
    let target = create(&args.to).await.with_context(failed)?;
    let busy = Busy::start(context, "copying the catalog");
    let copied = source.copy_to(&target, |table, rows| {
        tracing::info!(table, rows, "copied");
    });
    let copied = copied.await;
    drop(busy);
    source.close().await;
    target.close().await;
    let tables = copied.with_context(failed)?;
    context.print(&json!({"schema": 1, "tables": tables}), || text(&tables))?;
    context.info("all rows were compared; artifacts and input files were not copied");
    Ok(ExitCode::Done)
}

/// Opens the catalog of a project folder or an address for reading.
async fn open(place: &str) -> anyhow::Result<Catalog> {
    if is_address(place) {
        refuse_password(place)?;
        return Ok(Catalog::connect_read_only(place).await?);
    }
    let project = Project::open(Path::new(place))?;
    Ok(Catalog::open_read_only(&project.catalog_path()).await?)
}

/// Opens the catalog to copy to, and creates it if it is missing.
async fn create(place: &str) -> anyhow::Result<Catalog> {
    if is_address(place) {
        refuse_password(place)?;
        return Ok(Catalog::connect(place, true).await?);
    }
    let project = Project::create(Path::new(place))?;
    Ok(Catalog::create(&project.catalog_path()).await?)
}

fn is_address(place: &str) -> bool {
    place.contains("://")
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
