//! Import of pairs: names, paths and attributes.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use serde_json::{Value, json};
use tokio::sync::mpsc;

use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::{query, query_scalar};
use crate::db::row::FromRow as _;
use crate::db::rows::json_array;
use crate::db::transaction::in_transaction;
use crate::jobs::requeue::{self, RetrySelection};
use crate::jobs::retired;
use crate::queue::counters::{CounterKey, Deltas};
use crate::queue::pair_job::PairJob;
use crate::queue::selection::{PairSelection, select, unknown_names};
use crate::records::checksums;
use crate::records::ground_truth;
use crate::records::lost_values::LostValues;
use crate::records::model::PairAttributes;
use crate::records::same_files::{self, SameFiles};
use crate::records::similar_names;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{PairName, UnixMillis, plain_path};

/// A row to import.
pub type ImportRow = PairAttributes;

/// Number of rows in one statement.
const CHUNK: usize = 2_000;

/// A message of a streamed import.
#[derive(Debug)]
pub enum ImportChunk {
    /// The next rows.
    Rows(Vec<ImportRow>),
    /// The end of the rows.
    End,
}

/// What an import may do besides adding pairs and changing their columns.
#[derive(Debug, Clone, Default)]
pub struct ImportTerms {
    /// True alignments to store.
    pub truths: Vec<(PairName, Value)>,
    /// Whether most of the known pairs may get another mesh and another print.
    pub changed_files: bool,
    /// Whether pairs that the list does not have are retired, except for pairs of blocks.
    pub replace: bool,
    /// Whether known pairs keep the columns that folders do not have: character, block if they have one, scanned side and
    /// metadata.
    pub keep_columns: bool,
}

/// Counts of an import.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImportSummary {
    /// Number of new pairs.
    pub added: u64,
    /// Existing pairs with other values, and the columns that differ.
    pub changed: Vec<PairChange>,
    /// Number of changed pairs that get another mesh or print.
    pub other_files: u64,
    /// Number of existing pairs with the same values.
    pub unchanged: u64,
    /// Number of pairs that the list does not have and that were retired.
    pub retired: u64,
    /// Number of retired pairs that came back. They are also counted as changed or unchanged.
    pub restored: u64,
    /// Number of listed pairs that a person has retired, so that they stay out of every count.
    pub still_retired: u64,
    /// New pairs with the mesh and print of earlier ones, which are counted twice.
    pub same_files: Option<SameFiles>,
    /// Values of existing pairs that the import empties.
    pub lost: LostValues,
}

/// A pair whose values an import changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairChange {
    /// The pair.
    pub name: PairName,
    /// Names of the columns that differ.
    pub fields: Vec<&'static str>,
}

/// Selects the attributes of pairs by their names. The planner of PostgreSQL, which does not know how many names there
/// are, would join the names with the whole table.
pub(crate) const SELECT: Sql = Sql::pair(
    "
SELECT name, mesh_path, print_path, unit, scanned_face_down, character, block, meta, prior
FROM pair WHERE name IN (SELECT atom FROM json_each(?1))",
    "
SELECT name, mesh_path, print_path, unit, scanned_face_down, character, block, meta, prior
FROM pair WHERE name = ANY (ARRAY(SELECT atom FROM json_each(?1)))",
);

/// Builds the text that adds new pairs and updates existing ones, from its items. If a path changed, clears the `stat` of
/// that file, so that the next run reads the file again. Returns the columns that a checksum needs.
macro_rules! upsert {
    ($items:literal) => {
        concat!(
            "
INSERT INTO pair (name, mesh_path, print_path, unit, scanned_face_down, character, block, meta, prior, attributes, imported)
",
            $items,
            "
ON CONFLICT (name) DO UPDATE SET
    mesh_stat = CASE WHEN pair.mesh_path = excluded.mesh_path THEN pair.mesh_stat ELSE '' END, mesh_path = excluded.mesh_path,
    print_stat = CASE WHEN pair.print_path = excluded.print_path THEN pair.print_stat ELSE '' END, print_path = excluded.print_path,
    unit = excluded.unit, scanned_face_down = excluded.scanned_face_down, character = excluded.character,
    block = excluded.block, meta = excluded.meta, prior = excluded.prior, attributes = excluded.attributes
RETURNING id, NULL, NULL, NULL, name, mesh_path, print_path, unit, scanned_face_down, character, block, meta, prior,
    attributes, imported"
        )
    };
}

/// Adds and updates pairs. PostgreSQL would parse an item once for each `->>`.
const UPSERT: Sql = Sql::pair(
    upsert!(
        "SELECT value ->> 'name', value ->> 'mesh', value ->> 'print', value ->> 'unit', value ->> 'face_down',
    value ->> 'character', value ->> 'block', value ->> 'meta', value ->> 'prior', value ->> 'attributes', ?2
FROM json_each(?1) WHERE true"
    ),
    upsert!(
        "SELECT name, mesh, print, unit, face_down, character, block, meta, prior, attributes, ?2
FROM json_to_recordset(CAST(?1 AS json)) AS item (name text, mesh text, print text, unit text, face_down bigint,
    character text, block text, meta text, prior text, attributes text)"
    ),
);

/// Updates the statistics of PostgreSQL's planner.
const ANALYZE: &str = "ANALYZE pair, job";

/// Adds jobs for those of some pairs that have none and are not retired.
const NEW_JOBS: &str = "
INSERT INTO job (pair, stage, status)
SELECT CAST(atom AS bigint), 0, 0 FROM json_each(?1)
WHERE NOT EXISTS (SELECT 1 FROM retired_pair AS r WHERE r.pair = CAST(atom AS bigint))
ON CONFLICT (pair) DO NOTHING";

/// Pairs with a job whose names are between two texts, so that an index finds them.
const WITH_PREFIX: &str = "
SELECT p.name FROM pair AS p JOIN job AS j ON j.pair = p.id
WHERE p.name >= ?1 AND p.name < ?2 ORDER BY p.name LIMIT ?3";

/// Marks completed pairs of these names, whose results may disagree with their new files, so that `status` counts them.
const MARK: &str = "
UPDATE job SET dirty = 1 WHERE dirty = 0 AND status = 3
    AND pair IN (SELECT id FROM pair WHERE name IN (SELECT atom FROM json_each(?1)))";

const OF_LISTED_BLOCK: &str = "SELECT p.name FROM pair AS p JOIN job AS j ON j.pair = p.id WHERE p.block = ?1 ORDER BY p.name";

const OF_BLOCK: &str = "SELECT name FROM pair WHERE block = ?1 ORDER BY name";

impl Catalog {
    /// Imports streamed rows, and true alignments, in one transaction. Adds new pairs and updates existing ones. If a
    /// name occurs twice, the later row is used. Returns the summary and the number of true alignments.
    ///
    /// # Errors
    /// Returns an error if the channel closes before `ImportChunk::End`, if a new pair is similar to a known one, if most
    /// known pairs would get other files, if a true alignment names an unknown pair, or if a database operation fails. In
    /// that case nothing is imported.
    pub async fn import_all(
        &self,
        mut chunks: mpsc::Receiver<ImportChunk>,
        terms: ImportTerms,
        now: UnixMillis,
    ) -> Result<(ImportSummary, u64)> {
        in_transaction!(self, |conn| {
            let mut summary = ImportSummary::default();
            let mut deltas = Deltas::default();
            let last = similar_names::last_pair(conn).await?;
            let mut listed = HashSet::new();
            loop {
                match chunks.recv().await {
                    Some(ImportChunk::Rows(mut rows)) => {
                        for chunk in rows.chunks_mut(CHUNK) {
                            let keeps = terms.keep_columns;
                            let counts = (&mut summary, &mut deltas);
                            let ids = import_chunk(conn, chunk, keeps, now, counts).await?;
                            if terms.replace {
                                listed.extend(ids);
                            }
                        }
                    }
                    Some(ImportChunk::End) => break,
                    None => return Err(CatalogError::CutShort),
                }
            }
            similar_names::refuse_pairs(conn, last).await?;
            if !terms.changed_files {
                refuse_changed_files(&summary)?;
            }
            if terms.replace {
                let retired = retired::retire_unlisted(conn, &listed, now, &mut deltas);
                summary.retired = retired.await?;
            }
            if summary.added > 0 && last > 0 {
                summary.same_files = same_files::pairs(conn, last).await?;
            }
            deltas.apply(conn).await?;
            summary.changed.sort_by(|a, b| a.name.cmp(&b.name));
            let stored = ground_truth::set(conn, &terms.truths).await?;
            if let Conn::Postgres(_) = conn {
                query(ANALYZE).execute(conn).await?;
            }
            Ok((summary, stored))
        })
    }

    /// Returns the names of all pairs, sorted.
    pub async fn pair_names(&self) -> Result<Vec<PairName>> {
        let mut conn = self.read_conn().await?;
        let names = query_scalar("SELECT name FROM pair ORDER BY name");
        names.fetch_all(&mut conn).await
    }

    /// Returns the first names that begin with a text, sorted, without those of retired pairs.
    pub async fn pair_names_with_prefix(
        &self,
        prefix: &str,
        limit: usize,
    ) -> Result<Vec<PairName>> {
        let mut conn = self.read_conn().await?;
        let names = query_scalar(WITH_PREFIX).bind(prefix);
        let names = names.bind(format!("{prefix}{}", char::MAX));
        names.bind(limit as i64).fetch_all(&mut conn).await
    }

    /// Returns the names of the pairs that a list assigns to a block with this id, sorted, without retired pairs.
    pub async fn pairs_of_listed_block(&self, block: &str) -> Result<Vec<PairName>> {
        let mut conn = self.read_conn().await?;
        let names = query_scalar(OF_LISTED_BLOCK).bind(block);
        names.fetch_all(&mut conn).await
    }

    /// Returns the names of the pairs of a list's or a whole block, sorted, with retired pairs.
    pub async fn pairs_of_block_with_retired(&self, block: &str) -> Result<Vec<PairName>> {
        let mut conn = self.read_conn().await?;
        query_scalar(OF_BLOCK)
            .bind(block)
            .fetch_all(&mut conn)
            .await
    }

    /// Returns the unknown names among `names`, in the given order.
    pub async fn unknown_names(&self, names: &[PairName]) -> Result<Vec<PairName>> {
        let mut conn = self.read_conn().await?;
        unknown_names(&mut conn, names).await
    }

    /// Returns the pairs with the given names. Unknown names are left out.
    pub async fn select(&self, names: &[PairName]) -> Result<PairSelection> {
        let mut conn = self.read_conn().await?;
        select(&mut conn, names).await
    }
}

/// Refuses an import that gives most of the known pairs another mesh and another print. Their ids are then likely those of
/// other characters, such as the numbers of another block.
fn refuse_changed_files(summary: &ImportSummary) -> Result<()> {
    const FEWEST: u64 = 2;
    let has_other_files = |change: &&PairChange| {
        ["mesh", "print"]
            .iter()
            .all(|file| change.fields.contains(file))
    };
    let mut others = summary.changed.iter().filter(has_other_files);
    let changed = others.clone().count() as u64;
    let known = summary.unchanged + summary.changed.len() as u64;
    match others.next() {
        Some(example) if changed >= FEWEST && 2 * changed > known => {
            Err(CatalogError::ChangedFiles {
                changed,
                known,
                files: "mesh and another print",
                kind: "pairs",
                example: example.name.to_string(),
            })
        }
        _ => Ok(()),
    }
}

/// Adds and updates pairs. Pairs that no person retired get their jobs back. If `keeps_columns`, the rows of known pairs get
/// the columns that folders do not have. Returns the ids of the rows.
pub(crate) async fn import_chunk(
    conn: &mut Conn,
    chunk: &mut [ImportRow],
    keeps_columns: bool,
    now: UnixMillis,
    (summary, deltas): (&mut ImportSummary, &mut Deltas),
) -> Result<Vec<i64>> {
    let names = json_array(chunk.iter().map(|row| row.name.as_str()));
    summary.restored += retired::restore(conn, &names, false, deltas).await?;
    let known = query(SELECT).bind(&names);
    let mut stored: BTreeMap<PairName, Option<PairAttributes>> = BTreeMap::new();
    for row in &known.fetch_all(&mut *conn).await? {
        // A row with an invalid value is replaced.
        stored.insert(row.get("name")?, PairAttributes::from_row(row).ok());
    }
    if keeps_columns {
        for row in chunk.iter_mut() {
            if let Some(Some(known)) = stored.get(&row.name) {
                row.scanned_face_down = known.scanned_face_down;
                row.character.clone_from(&known.character);
                if known.block.is_some() {
                    row.block.clone_from(&known.block);
                }
                row.meta.clone_from(&known.meta);
            }
        }
    }
    let chunk = &*chunk;
    let moved = count_changes(chunk, stored, summary, deltas);
    // Of rows with the same name, only the last: PostgreSQL changes a row only once in a statement.
    let last: BTreeMap<_, _> = chunk
        .iter()
        .enumerate()
        .map(|(at, row)| (&row.name, at))
        .collect();
    let rows = chunk
        .iter()
        .enumerate()
        .filter(|(at, row)| last[&row.name] == *at);
    let items = json_array(rows.map(|(_, row)| item(row)));
    let upsert = query(UPSERT).bind(items).bind(now);
    let rows = upsert.fetch_all(&mut *conn).await?;
    checksums::store_of_rows(conn, ChecksummedTable::Pair, &rows).await?;
    let ids: Vec<i64> = rows.iter().map(|row| row.get(0)).collect::<Result<_>>()?;
    if !moved.is_empty() {
        let names = json_array(moved.iter().map(PairName::as_str));
        query(MARK).bind(names).execute(&mut *conn).await?;
    }
    requeue::retry::<PairJob>(conn, &RetrySelection::Names(moved), deltas).await?;
    query(NEW_JOBS)
        .bind(json_array(ids.iter().copied()))
        .execute(&mut *conn)
        .await?;
    summary.still_retired += retired::count_retired(conn, &ids).await?;
    Ok(ids)
}

/// Counts new, changed and unchanged rows against the stored ones. Returns the pairs with another mesh or print: what failed
/// of them is tried again, also if the earlier file was never read.
fn count_changes(
    chunk: &[ImportRow],
    mut stored: BTreeMap<PairName, Option<PairAttributes>>,
    summary: &mut ImportSummary,
    deltas: &mut Deltas,
) -> Vec<PairName> {
    let mut moved = Vec::new();
    for row in chunk {
        let fields = match stored.insert(row.name.clone(), Some(row.clone())) {
            None => {
                summary.added += 1;
                deltas.add(CounterKey::NEW, 1);
                continue;
            }
            Some(Some(old)) => {
                let name = row.name.as_str();
                summary.lost.add(name, &lost_columns(&old, row));
                summary.lost.add_metadata(name, &old.meta, &row.meta);
                differing(&old, row)
            }
            Some(None) => vec!["a damaged value"],
        };
        if fields.is_empty() {
            summary.unchanged += 1;
            continue;
        }
        if fields
            .iter()
            .any(|field| matches!(*field, "mesh" | "print"))
        {
            summary.other_files += 1;
            moved.push(row.name.clone());
        }
        summary.changed.push(PairChange {
            name: row.name.clone(),
            fields,
        });
    }
    moved
}

fn item(row: &ImportRow) -> Value {
    json!({
        "name": row.name, "mesh": row.mesh_path, "print": row.print_path, "unit": row.unit,
        "face_down": row.scanned_face_down.map(i64::from), "character": row.character, "block": row.block,
        "meta": json!(row.meta).to_string(), "prior": row.prior, "attributes": result_attributes(row),
    })
}

/// Returns the manifest attributes that results depend on, as JSON. If this text changes, the results are stale.
fn result_attributes(row: &ImportRow) -> String {
    let mut attributes = json!({ "scanned_face_down": row.scanned_face_down, "unit": row.unit });
    if let Some(prior) = &row.prior {
        attributes["prior"] = Value::from(prior.as_str());
    }
    attributes.to_string()
}

fn differing(old: &ImportRow, new: &ImportRow) -> Vec<&'static str> {
    [
        ("mesh", !is_same_file(&old.mesh_path, &new.mesh_path)),
        ("print", !is_same_file(&old.print_path, &new.print_path)),
        ("character", old.character != new.character),
        ("block", old.block != new.block),
        ("unit", old.unit != new.unit),
        (
            "scanned_face_down",
            old.scanned_face_down != new.scanned_face_down,
        ),
        ("metadata", old.meta != new.meta),
        ("prior", old.prior != new.prior),
    ]
    .into_iter()
    .filter_map(|(name, differs)| differs.then_some(name))
    .collect()
}

/// Returns columns other than metadata, each with whether the known pair has a value and the new row has none.
fn lost_columns(old: &ImportRow, new: &ImportRow) -> [(&'static str, bool); 4] {
    [
        (
            "character",
            old.character.is_some() && new.character.is_none(),
        ),
        ("block", old.block.is_some() && new.block.is_none()),
        ("unit", old.unit.is_some() && new.unit.is_none()),
        (
            "scanned_face_down",
            old.scanned_face_down.is_some() && new.scanned_face_down.is_none(),
        ),
    ]
}

/// Returns whether two stored paths are those of one file. If a folder before `..` is a link, they may not be; a run finds
/// out, because it reads a file whose path is written differently.
pub(crate) fn is_same_file(old: &str, new: &str) -> bool {
    old == new || plain_path(Path::new(old)) == plain_path(Path::new(new))
}
