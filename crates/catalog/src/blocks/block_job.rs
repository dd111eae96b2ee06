//! The jobs of blocks.

use std::borrow::Cow;

use serde::Serialize;
use serde_json::{Value, json};

use crate::Result;
use crate::blocks::model::{BlockAttributes, BlockInputVersions, BlockProvenance};
use crate::blocks::records::{BLOCK, control_points};
use crate::blocks::selection::BlockSelection;
use crate::db::conn::Conn;
use crate::db::query::query;
use crate::db::row::FromRow as _;
use crate::db::script::Script;
use crate::queue::kind::{JobKind, StoredKind};
use crate::queue::lease::Lease;
use crate::queue::provenance::FingerprintId;
use mocban_core::domain::{BlockId, BlockName, BlockStage, WorkerId};

/// Stores the versions of input files. A file that was not read keeps its version.
const UPDATE_INPUTS: &str = "
UPDATE block SET mesh_hash = coalesce(?, mesh_hash), mesh_stat = coalesce(?, mesh_stat),
    page_hash = coalesce(?, page_hash), page_stat = coalesce(?, page_stat),
    labels_hash = coalesce(?, labels_hash), labels_stat = coalesce(?, labels_stat) WHERE id = ?";

/// The kind of the jobs of blocks, with the stages `face`, `align`, `boxes` and `cut`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockJob;

impl JobKind for BlockJob {
    type Unit = BlockId;
    type Name = BlockName;
    type Selection = BlockSelection;
    type Stage = BlockStage;
    type Provenance = BlockProvenance;
    type Inputs = BlockInputVersions;

    const STAGES: usize = BlockStage::COUNT;

    fn unit(id: i64) -> BlockId {
        BlockId(id)
    }

    fn id(unit: BlockId) -> i64 {
        unit.0
    }

    fn text(name: &BlockName) -> &str {
        name.as_str()
    }

    fn ids(selection: &BlockSelection) -> Cow<'_, str> {
        Cow::Owned(selection.json())
    }

    fn stage(index: usize) -> Option<BlockStage> {
        BlockStage::from_index(index)
    }

    fn index(stage: BlockStage) -> usize {
        stage.index()
    }

    fn fingerprint(_: &BlockProvenance) -> Option<FingerprintId> {
        None
    }
}

impl StoredKind for BlockJob {
    const NUMBER: usize = 1;
    const IS_COUNTED: bool = false;
    const PROVENANCE: &'static [(&'static str, &'static str)] =
        &[("made_with", "item.value ->> 'made_with'")];

    fn provenance(provenance: &BlockProvenance) -> Result<impl Serialize + use<'_>> {
        Ok(json!({ "made_with": serde_json::to_string(provenance)? }))
    }

    /// The settings of the worker are unknown, so only changed inputs make this failure outdated.
    async fn crashed(
        conn: &mut Conn,
        block: BlockId,
        stage: BlockStage,
        _: Option<WorkerId>,
    ) -> Result<Value> {
        let row = query(BLOCK).bind(block.0).fetch_one(conn).await?;
        let (attributes, inputs) = (
            BlockAttributes::from_row(&row)?,
            BlockInputVersions::from_row(&row)?,
        );
        let points = control_points(&row)?;
        let provenance =
            BlockProvenance::new(stage, &Value::Null, &attributes, &inputs, points.as_ref());
        Ok(serde_json::to_value(Self::provenance(&provenance)?)?)
    }

    fn are_known(_: &BlockInputVersions) -> bool {
        true
    }

    fn add_inputs<'i>(
        script: &mut Script,
        inputs: impl Iterator<Item = (BlockId, &'i BlockInputVersions)>,
    ) -> Result<()> {
        for (block, inputs) in inputs {
            script.execute(UPDATE_INPUTS);
            for version in [&inputs.mesh, &inputs.page, &inputs.labels] {
                let version = version.as_ref();
                script.bind(version.map(|version| &version.hash.as_bytes()[..]));
                script.bind(version.map(|version| version.stat.clone()));
            }
            script.bind(block.0);
        }
        Ok(())
    }
}

impl Lease<BlockJob> {
    /// Returns the block.
    pub const fn block(&self) -> BlockId {
        self.unit
    }
}

/// A write under the lease of a block is sent again while a server is unavailable.
impl Clone for Lease<BlockJob> {
    fn clone(&self) -> Self {
        Self { ..*self }
    }
}
