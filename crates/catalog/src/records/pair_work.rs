//! Data of a leased pair that a worker needs, and the versions of input files.

use std::collections::BTreeMap;

use crate::db::query::{query, query_as};
use crate::db::row::{FromRow, Row, from_row};
use crate::db::rows::{input_version, json_array};
use crate::db::script::Script;
use crate::db::transaction::in_transaction;
use crate::queue::kind::StoredKind as _;
use crate::queue::lease::Lease;
use crate::queue::pair_job::{PairJob, UPDATE_INPUTS, input_item};
use crate::queue::provenance::InputVersions;
use crate::queue::selection::PairSelection;
use crate::records::model::{PairAttributes, StageRecord};
use crate::records::stage_results;
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{InputVersion, PairId, Stage};

/// A leased pair with its attributes and results.
#[derive(Debug, Clone, PartialEq)]
pub struct PairWork {
    /// Attributes as imported.
    pub attributes: PairAttributes,
    /// Manifest attributes that results depend on. They are stored with each result.
    pub attributes_json: String,
    /// Results of all completed stages, in order.
    pub results: Vec<StageRecord>,
}

from_row! { PairWork { attributes in row, attributes_json: "attributes", results = Vec::new() } }

/// Input files of a pair as last read, to detect changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KnownInputs {
    /// The pair.
    pub pair: PairId,
    /// Path of the mesh as stored.
    pub mesh_path: String,
    /// The mesh as last read.
    pub mesh: Option<InputVersion>,
    /// Path of the print as stored.
    pub print_path: String,
    /// The print as last read.
    pub print: Option<InputVersion>,
}

pub(crate) const LEASED: &str = "
SELECT p.id, p.name, p.mesh_path, p.print_path, p.unit, p.scanned_face_down, p.character, p.block, p.meta, p.prior,
    p.attributes
FROM json_each(?1) AS wanted CROSS JOIN pair AS p ON p.id = CAST(wanted.atom AS bigint)";

/// Selects pairs with their input files as last read, in pages by id.
pub(crate) const INPUTS: &str = "
SELECT id, mesh_path, mesh_hash, mesh_stat, print_path, print_hash, print_stat FROM pair
WHERE id > ?1 ORDER BY id LIMIT ?2";

const INPUTS_AMONG: &str = "
SELECT id, mesh_path, mesh_hash, mesh_stat, print_path, print_hash, print_stat
FROM pair WHERE id > ?1 AND id IN (SELECT CAST(atom AS bigint) FROM json_each(?3)) ORDER BY id LIMIT ?2";

/// Adds the versions of input files to the failures of pairs.
const FATAL_INPUTS: &str = "
UPDATE failure SET mesh_hash = coalesce(failure.mesh_hash, unhex(item.value ->> 'mesh_hash')),
    print_hash = coalesce(failure.print_hash, unhex(item.value ->> 'print_hash'))
FROM json_each(?) AS item WHERE failure.pair = CAST(item.value ->> 'pair' AS bigint)";

impl Catalog {
    /// Returns the leased pairs with their results, in the same order as the leases.
    pub async fn work(&self, leases: &[Lease]) -> Result<Vec<PairWork>> {
        let mut conn = self.read_conn().await?;
        let wanted = json_array(leases.iter().map(|lease| lease.unit.0));
        let leased = query(LEASED).bind(wanted).fetch_all(&mut conn).await?;
        let begun = leases.iter().filter(|lease| lease.cursor > Stage::Fit);
        let begun: Vec<_> = begun.map(|lease| lease.unit.0).collect();
        let mut results = BTreeMap::new();
        if !begun.is_empty() {
            results = stage_results::of_pairs(&mut conn, &begun).await?;
        }
        let mut works = BTreeMap::new();
        for row in &leased {
            works.insert(row.get::<PairId>("id")?, PairWork::from_row(row)?);
        }
        let each = leases.iter().map(
            |Lease {
                 unit: pair, cursor, ..
             }| {
                let gone = || CatalogError::Corrupt(format!("a job has no pair {}", pair.0));
                let mut work = works.remove(pair).ok_or_else(gone)?;
                work.results = results.remove(&pair.0).unwrap_or_default();
                work.results.retain(|record| record.stage < *cursor);
                Ok(work)
            },
        );
        each.collect()
    }

    /// Returns the input files of up to `limit` pairs with ids above `after`, sorted by id. If `selection` is given,
    /// returns only its pairs. Returns an empty list at the end.
    pub async fn known_inputs(
        &self,
        after: Option<PairId>,
        limit: usize,
        selection: Option<&PairSelection>,
    ) -> Result<Vec<KnownInputs>> {
        let mut conn = self.read_conn().await?;
        let after = after.map_or(0, |pair| pair.0);
        let query = match selection {
            None => query_as(INPUTS).bind(after).bind(limit as i64),
            Some(selection) => query_as(INPUTS_AMONG)
                .bind(after)
                .bind(limit as i64)
                .bind(&selection.json),
        };
        query.fetch_all(&mut conn).await
    }

    /// Stores versions of input files. Keeps the stored version of a file whose new version is `None`.
    pub async fn store_inputs(&self, seen: Vec<(PairId, InputVersions)>) -> Result<()> {
        in_transaction!(self, |conn| {
            let mut script = Script::default();
            let inputs = seen.iter().map(|(pair, inputs)| (*pair, inputs));
            PairJob::add_inputs(&mut script, inputs)?;
            script.run(conn).await?;
            Ok(())
        })
    }

    /// Stores the current versions of input files that no stage of a quarantined pair has read. A later run compares
    /// the stored hashes to detect replaced files.
    pub async fn record_poisoned_inputs(&self, seen: Vec<(PairId, InputVersions)>) -> Result<()> {
        in_transaction!(self, |conn| {
            let mut script = Script::default();
            let items = || {
                seen.iter()
                    .map(|(pair, inputs)| input_item((*pair, inputs)))
            };
            script.execute_over(UPDATE_INPUTS, items())?;
            script.execute_over(FATAL_INPUTS, items())?;
            script.run(conn).await?;
            Ok(())
        })
    }
}

/// Reads the input files from a row with the columns of [`INPUTS`].
impl FromRow for KnownInputs {
    fn from_row(row: &Row) -> Result<Self> {
        Ok(Self {
            pair: row.get("id")?,
            mesh_path: row.get("mesh_path")?,
            mesh: input_version(row, "mesh")?,
            print_path: row.get("print_path")?,
            print: input_version(row, "print")?,
        })
    }
}
