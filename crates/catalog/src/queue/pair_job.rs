//! The jobs of pairs.

use std::borrow::Cow;

use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::Result;
use crate::db::conn::Conn;
use crate::db::dialect::Sql;
use crate::db::query::query;
use crate::db::script::Script;
use crate::queue::kind::{JobKind, StoredKind};
use crate::queue::provenance::{FingerprintId, InputVersions, PairProvenance};
use crate::queue::selection::PairSelection;
use mocban_core::domain::{ContentHash, PairId, PairName, Stage, WorkerId};

/// Updates the input files of pairs. Items: see [`input_item`].
pub(crate) const UPDATE_INPUTS: Sql = Sql::pair(
    "
UPDATE pair SET mesh_hash = coalesce(new.mesh_hash, pair.mesh_hash), mesh_stat = coalesce(new.mesh_stat, pair.mesh_stat),
    print_hash = coalesce(new.print_hash, pair.print_hash), print_stat = coalesce(new.print_stat, pair.print_stat)
FROM (
    SELECT value ->> 'pair' AS id, unhex(value ->> 'mesh_hash') AS mesh_hash, value ->> 'mesh_stat' AS mesh_stat,
        unhex(value ->> 'print_hash') AS print_hash, value ->> 'print_stat' AS print_stat FROM jsonb_each(?)) AS new
WHERE pair.id = new.id AND (pair.mesh_hash IS NOT new.mesh_hash OR pair.mesh_stat IS NOT new.mesh_stat
    OR pair.print_hash IS NOT new.print_hash OR pair.print_stat IS NOT new.print_stat)",
    "
UPDATE pair SET mesh_hash = coalesce(new.mesh_hash, pair.mesh_hash), mesh_stat = coalesce(new.mesh_stat, pair.mesh_stat),
    print_hash = coalesce(new.print_hash, pair.print_hash), print_stat = coalesce(new.print_stat, pair.print_stat)
FROM (
    SELECT pair AS id, decode(mesh_hash, 'hex') AS mesh_hash, mesh_stat, decode(print_hash, 'hex') AS print_hash,
        print_stat
    FROM json_to_recordset(CAST(? AS json)) AS item (pair bigint, mesh_hash text, mesh_stat text, print_hash text,
        print_stat text)) AS new
WHERE pair.id = new.id AND (pair.mesh_hash IS DISTINCT FROM new.mesh_hash OR pair.mesh_stat IS DISTINCT FROM new.mesh_stat
    OR pair.print_hash IS DISTINCT FROM new.print_hash OR pair.print_stat IS DISTINCT FROM new.print_stat)",
);

/// Selects what is known of a pair and of the settings of a worker.
const CRASHED: &str = "
SELECT p.mesh_hash, p.print_hash, p.attributes, CAST(w.fingerprints ->> CAST(?2 AS bigint) AS bigint) AS fingerprint
FROM pair AS p LEFT JOIN worker AS w ON w.id = ?3 WHERE p.id = ?1";

/// The kind of the jobs of pairs. Besides what all jobs have, these have a priority, may have to run exclusively, and are
/// counted by the fingerprint of their last result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairJob;

impl JobKind for PairJob {
    type Unit = PairId;
    type Name = PairName;
    type Selection = PairSelection;
    type Stage = Stage;
    type Provenance = PairProvenance;
    type Inputs = InputVersions;

    const STAGES: usize = Stage::COUNT;

    fn unit(id: i64) -> PairId {
        PairId(id)
    }

    fn id(unit: PairId) -> i64 {
        unit.0
    }

    fn text(name: &PairName) -> &str {
        name.as_str()
    }

    fn ids(selection: &PairSelection) -> Cow<'_, str> {
        Cow::Borrowed(&selection.json)
    }

    fn stage(index: usize) -> Option<Stage> {
        Stage::from_index(index)
    }

    fn index(stage: Stage) -> usize {
        stage.index()
    }

    fn fingerprint(provenance: &PairProvenance) -> Option<FingerprintId> {
        Some(provenance.fingerprint)
    }
}

impl StoredKind for PairJob {
    const NUMBER: usize = 0;
    const IS_COUNTED: bool = true;
    const PROVENANCE: &'static [(&'static str, &'static str)] = &[
        ("fingerprint", "[fingerprint]"),
        ("mesh_hash", "unhex(item.value ->> 'mesh_hash')"),
        ("print_hash", "unhex(item.value ->> 'print_hash')"),
        ("attributes", "item.value ->> 'attributes'"),
    ];

    fn provenance(provenance: &PairProvenance) -> Result<impl Serialize + use<'_>> {
        Ok(provenance)
    }

    /// Returns the settings of the worker and the inputs as last read.
    async fn crashed(
        conn: &mut Conn,
        pair: PairId,
        stage: Stage,
        worker: Option<WorkerId>,
    ) -> Result<Value> {
        let crashed = query(CRASHED).bind(pair.0).bind(stage.index() as i64);
        let crashed = crashed.bind(worker.map(|worker| worker.0));
        let row = crashed.fetch_optional(conn).await?;
        let Some(row) = row else {
            return Ok(Value::Object(Map::new()));
        };
        let hash = |column: &str| row.get::<Option<ContentHash>>(column);
        Ok(json!({
            "fingerprint": row.get::<Option<i64>>("fingerprint")?,
            "mesh_hash": hash("mesh_hash")?, "print_hash": hash("print_hash")?,
            "attributes": row.get::<Option<String>>("attributes")?,
        }))
    }

    fn are_known(inputs: &InputVersions) -> bool {
        !inputs.is_empty()
    }

    fn add_inputs<'i>(
        script: &mut Script,
        inputs: impl Iterator<Item = (PairId, &'i InputVersions)>,
    ) -> Result<()> {
        let known = inputs.filter(|(_, inputs)| !inputs.is_empty());
        script.execute_over(UPDATE_INPUTS, known.map(input_item))
    }
}

/// Builds an item of [`UPDATE_INPUTS`].
pub(crate) fn input_item((pair, inputs): (PairId, &InputVersions)) -> Value {
    let (mesh, print) = (inputs.mesh.as_ref(), inputs.print.as_ref());
    json!({
        "pair": pair, "mesh_hash": mesh.map(|seen| seen.hash), "mesh_stat": mesh.map(|seen| &seen.stat),
        "print_hash": print.map(|seen| seen.hash), "print_stat": print.map(|seen| &seen.stat),
    })
}
