//! Import of blocks: names, paths and attributes.

use std::sync::Arc;

use serde_json::{Map, Value};

use crate::blocks::block_job::BlockJob;
use crate::blocks::model::BlockAttributes;
use crate::blocks::queue::uncounted;
use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::left_out::is_counted;
use crate::db::query::{query, query_scalar};
use crate::db::row::FromRow as _;
use crate::db::transaction::in_transaction;
use crate::db::value::Json;
use crate::jobs::requeue::{self, RetrySelection};
use crate::records::checksums;
use crate::records::import::is_same_file;
use crate::records::lost_values::LostValues;
use crate::records::same_files::{self, SameFiles};
use crate::records::similar_names;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{BlockName, BlockSide, LengthUnit, UnixMillis};

/// Counts of an import of blocks.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BlockImportSummary {
    /// Number of new blocks.
    pub added: u64,
    /// Existing blocks with other values, and the columns that differ.
    pub changed: Vec<(BlockName, Vec<&'static str>)>,
    /// Number of changed blocks that get another scan, page or labels.
    pub other_files: u64,
    /// Number of existing blocks with the same values.
    pub unchanged: u64,
    /// New blocks with the scan and page of earlier ones.
    pub same_files: Option<SameFiles>,
    /// Values of existing blocks that the import empties.
    pub lost: LostValues,
}

const LAST: &str = "SELECT coalesce(max(id), 0) FROM block";

const SELECT: &str =
    "SELECT name, mesh_path, page_path, labels_path, unit, side, meta FROM block WHERE name = ?1";

/// Adds a block or updates it. If a path changed, clears the `stat` of that file, so that the next run reads the file. True
/// boxes belong to the page of one path; they are not compared with its content.
const UPSERT: &str = "
INSERT INTO block (name, mesh_path, page_path, labels_path, unit, side, meta, attributes, imported)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)
ON CONFLICT (name) DO UPDATE SET
    mesh_stat = CASE WHEN block.mesh_path = excluded.mesh_path THEN block.mesh_stat ELSE '' END, mesh_path = excluded.mesh_path,
    page_stat = CASE WHEN block.page_path = excluded.page_path THEN block.page_stat ELSE '' END, page_path = excluded.page_path,
    labels_stat = CASE WHEN block.labels_path = excluded.labels_path THEN block.labels_stat ELSE '' END,
    true_boxes = CASE WHEN block.page_path = excluded.page_path THEN block.true_boxes END,
    labels_path = excluded.labels_path, unit = excluded.unit, side = excluded.side, meta = excluded.meta,
    attributes = excluded.attributes
RETURNING id";

const NEW_JOB: &str =
    "INSERT INTO block_job (block, stage, status) VALUES (?1, 0, 0) ON CONFLICT (block) DO NOTHING";

const NAMES: &str = concat!(
    "SELECT name FROM block WHERE ",
    is_counted!("id", "?1"),
    " ORDER BY name"
);

impl Catalog {
    /// Imports blocks in one transaction. Adds new blocks and updates existing ones. The next run finds out which
    /// stages of a changed block are stale. A known block keeps its metadata if none is given. With `changed_files`, most
    /// known blocks may get another scan and another page.
    ///
    /// # Errors
    /// Returns an error if the names of two blocks differ only in case, if most known blocks would get other files, or if
    /// a database operation fails. In that case nothing is imported.
    pub async fn import_blocks(
        &self,
        rows: impl Into<Arc<[BlockAttributes]>>,
        changed_files: bool,
        now: UnixMillis,
    ) -> Result<BlockImportSummary> {
        let rows = rows.into();
        in_transaction!(self, |conn| {
            let mut summary = BlockImportSummary::default();
            let last = query_scalar(LAST).fetch_one(&mut *conn).await?;
            for row in &*rows {
                import_block(conn, row, now, &mut summary).await?;
            }
            // What failed with another file is tried again, also if the earlier file was never read.
            let is_file = |field: &&str| matches!(*field, "mesh" | "page" | "labels");
            let changed = summary.changed.iter();
            let moved = changed.filter(|(_, fields)| fields.iter().any(is_file));
            let moved: Vec<BlockName> = moved.map(|(name, _)| name.clone()).collect();
            summary.other_files = moved.len() as u64;
            let moved = RetrySelection::<BlockJob>::Names(moved);
            requeue::retry(conn, &moved, &mut uncounted()).await?;
            if summary.added > 0 {
                similar_names::refuse_blocks(conn).await?;
                summary.same_files = same_files::blocks(conn, last).await?;
            }
            if !changed_files {
                refuse_changed_files(&summary)?;
            }
            Ok(summary)
        })
    }

    /// Changes a block by a statement with its name as `?1` and a value as `?2`, which returns its id, and stores the
    /// checksum of the row. Returns `false` if the block does not exist.
    pub(crate) async fn update_block(
        &self,
        statement: &'static str,
        block: &BlockName,
        value: Option<String>,
    ) -> Result<bool> {
        let name = block.to_string();
        in_transaction!(self, |conn| {
            let update = query_scalar(statement).bind(&name).bind(&value);
            let id: Option<i64> = update.fetch_optional(&mut *conn).await?;
            let Some(id) = id else { return Ok(false) };
            checksums::store(conn, ChecksummedTable::Block, &[id]).await?;
            Ok(true)
        })
    }

    /// Returns the names of all blocks, sorted.
    pub async fn block_names(&self) -> Result<Vec<BlockName>> {
        let mut conn = self.read_conn().await?;
        let names = query_scalar(NAMES).bind(self.left_out.of(ChecksummedTable::Block));
        names.fetch_all(&mut conn).await
    }
}

/// Refuses an import that gives most of the known blocks another scan and another page. Unless the name of a block is
/// given, it is that of the file of its scan, which other folders may have too.
fn refuse_changed_files(summary: &BlockImportSummary) -> Result<()> {
    let has_other_files = |(_, fields): &&(BlockName, Vec<&str>)| {
        ["mesh", "page"].iter().all(|file| fields.contains(file))
    };
    let mut others = summary.changed.iter().filter(has_other_files);
    let changed = others.clone().count() as u64;
    let known = summary.unchanged + summary.changed.len() as u64;
    match others.next() {
        Some((example, _)) if 2 * changed > known => Err(CatalogError::ChangedFiles {
            changed,
            known,
            kind: "blocks",
            files: "scan and another page",
            example: example.to_string(),
        }),
        _ => Ok(()),
    }
}

async fn import_block(
    conn: &mut Conn,
    row: &BlockAttributes,
    now: UnixMillis,
    summary: &mut BlockImportSummary,
) -> Result<()> {
    let stored = query(SELECT).bind(row.name.as_str());
    let stored = stored.fetch_optional(&mut *conn).await?;
    let kept = stored.as_ref().and_then(|row| row.get("meta").ok());
    let kept: Option<Map<String, Value>> = kept.map(|Json(meta)| meta);
    let meta = row.meta.as_ref().or(kept.as_ref());
    let meta = meta.map_or_else(|| Ok("{}".to_owned()), serde_json::to_string)?;
    // A row with an invalid value is replaced.
    let stored = stored.map(|row| BlockAttributes::from_row(&row).ok());
    match stored {
        None => summary.added += 1,
        Some(old) => {
            if let Some(old) = &old {
                let name = row.name.as_str();
                summary.lost.add(name, &lost_columns(old, row));
                if let (Some(old), Some(new)) = (&old.meta, &row.meta) {
                    summary.lost.add_metadata(name, old, new);
                }
            }
            let changed = old
                .as_ref()
                .map_or_else(|| vec!["a damaged value"], |old| differing(old, row));
            if changed.is_empty() {
                summary.unchanged += 1;
                // Another spelling of the same paths would drop what is known of the files.
                if old.is_some_and(|old| !has_same_paths(&old, row)) {
                    return Ok(());
                }
            } else {
                summary.changed.push((row.name.clone(), changed));
            }
        }
    }
    let id: i64 = query_scalar(UPSERT)
        .bind(row.name.as_str())
        .bind(&row.mesh_path)
        .bind(&row.page_path)
        .bind(&row.labels_path)
        .bind(row.unit.map(LengthUnit::name))
        .bind(row.side.map(BlockSide::name))
        .bind(meta)
        .bind(row.of_results().to_string())
        .bind(now)
        .fetch_one(&mut *conn)
        .await?;
    checksums::store(conn, ChecksummedTable::Block, &[id]).await?;
    query(NEW_JOB).bind(id).execute(conn).await
}

/// Returns columns other than metadata, each with whether the known block has a value and the new row has none.
fn lost_columns(old: &BlockAttributes, new: &BlockAttributes) -> [(&'static str, bool); 3] {
    [
        (
            "labels",
            old.labels_path.is_some() && new.labels_path.is_none(),
        ),
        ("unit", old.unit.is_some() && new.unit.is_none()),
        ("side", old.side.is_some() && new.side.is_none()),
    ]
}

/// Returns whether the paths of a block are written in the same way.
fn has_same_paths(old: &BlockAttributes, new: &BlockAttributes) -> bool {
    old.mesh_path == new.mesh_path
        && old.page_path == new.page_path
        && old.labels_path == new.labels_path
}

fn differing(old: &BlockAttributes, new: &BlockAttributes) -> Vec<&'static str> {
    let are_same_labels = match (&old.labels_path, &new.labels_path) {
        (Some(old), Some(new)) => is_same_file(old, new),
        (old, new) => old == new,
    };
    [
        ("mesh", !is_same_file(&old.mesh_path, &new.mesh_path)),
        ("page", !is_same_file(&old.page_path, &new.page_path)),
        ("labels", !are_same_labels),
        ("unit", old.unit != new.unit),
        ("side", old.side != new.side),
        ("metadata", new.meta.is_some() && old.meta != new.meta),
    ]
    .into_iter()
    .filter_map(|(name, differs)| differs.then_some(name))
    .collect()
}
