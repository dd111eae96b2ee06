//! Reads blocks: their results, their state for `status` and `show`, and their input files.

use serde::Serialize;
use serde_json::Value;

use crate::blocks::model::{BlockAttributes, BlockInputVersions};
use crate::db::checksummed_table::ChecksummedTable;
use crate::db::conn::Conn;
use crate::db::left_out::is_counted;
use crate::db::query::{query_as, query_scalar};
use crate::db::row::{FromRow, Row, from_row};
use crate::db::value::Json;
use crate::records::model::{AttemptRecord, StoredFailure, stored_failure};
use crate::{Catalog, Result};
use mocban_core::domain::{
    BlockId, BlockName, BlockStage, BlockStageRecord, ContentHash, ControlPoints, JobStatus,
    UnixMillis,
};

/// Selects a block with its input files as last read, without its metadata.
pub(crate) const BLOCK: &str = "
SELECT id, name, mesh_path, page_path, labels_path, unit, side, NULL AS meta, mesh_hash, mesh_stat, page_hash, page_stat,
    labels_hash, labels_stat, control_points FROM block WHERE id = ?1";

/// Selects all blocks like [`BLOCK`].
const BLOCKS: &str = "
SELECT id, name, mesh_path, page_path, labels_path, unit, side, NULL AS meta, mesh_hash, mesh_stat, page_hash, page_stat,
    labels_hash, labels_stat FROM block ORDER BY id";

const RESULTS: &str =
    "SELECT stage, outcome, files, result_hash FROM block_result WHERE block = ?1 ORDER BY stage";

/// Selects one block, or all without the blocks of `?3`. Only one block has its metadata, which may have a MiB.
const STATES: &str = concat!(
    "
SELECT b.id, b.name, b.mesh_path, b.page_path, b.labels_path, b.unit, b.side,
    CASE WHEN ?1 IS NOT NULL THEN b.meta END AS meta, b.control_points,
    j.stage, j.status, j.attempt, j.crashes,
    f.stage AS failed_stage, f.class, f.message, f.at AS failed_at,
    (SELECT count(*) FROM block_character AS c WHERE c.block = b.id AND c.state = 'cut' AND NOT EXISTS (
        SELECT 1 FROM retired_pair AS r WHERE r.pair = c.pair)) AS characters,
    (SELECT count(*) FROM block_character AS c WHERE c.block = b.id AND c.state = 'left') AS left_out,
    (SELECT count(*) FROM block_character AS c WHERE c.block = b.id AND (c.state = 'retired' OR c.state = 'cut' AND EXISTS (
        SELECT 1 FROM retired_pair AS r WHERE r.pair = c.pair))) AS retired,
    (SELECT count(*) FROM block_character AS c WHERE c.block = b.id AND c.state = 'cut' AND c.confidence < ?2 AND NOT EXISTS (
        SELECT 1 FROM retired_pair AS r WHERE r.pair = c.pair)) AS low_confidence,
    j.status = 3 AND coalesce(b.mesh_stat = '' OR b.page_stat = '' OR b.labels_path IS NOT NULL AND b.labels_stat = '', false)
        AS other_files
FROM block AS b JOIN block_job AS j ON j.block = b.id LEFT JOIN block_failure AS f ON f.block = b.id WHERE (?1 IS NULL OR b.name = ?1) AND ",
    is_counted!("b.id", "?3"),
    " ORDER BY b.name"
);

const STAGES: &str = "
SELECT r.stage, r.outcome, r.files, r.result_hash, r.made_with, r.ms, r.at
FROM block_result AS r JOIN block AS b ON b.id = r.block WHERE b.name = ?1 ORDER BY r.stage";

const ATTEMPTS: &str = "
SELECT a.stage, a.class, a.message, a.ms, a.at
FROM block_attempt AS a JOIN block AS b ON b.id = a.block WHERE b.name = ?1 ORDER BY a.id";

const AUDITED: &str = "SELECT b.id, b.name, j.stage FROM block AS b LEFT JOIN block_job AS j ON j.block = b.id ORDER BY b.id";

/// A block with the state of its job.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockState {
    /// Attributes as imported.
    #[serde(flatten)]
    pub attributes: BlockAttributes,
    /// Status of its job.
    pub status: JobStatus,
    /// Next stage. `None` if the block is done.
    pub next_stage: Option<BlockStage>,
    /// Failed attempts at the next stage.
    pub attempts: u32,
    /// Workers that died or hung over it.
    pub crashes: u32,
    /// The failure, if the block failed or backs off.
    pub failure: Option<StoredFailure<BlockStage>>,
    /// Places that a person chose on scan and page.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control_points: Option<ControlPoints>,
    /// Characters that were cut and are pairs.
    pub characters: u64,
    /// Characters with a box that were not cut.
    pub left_out: u64,
    /// Characters whose boxes are gone.
    pub retired: u64,
    /// Characters that were cut although their position is uncertain.
    pub low_confidence: u64,
    /// Whether the block is done, and an import changed the path of a file, which no run has read since.
    pub other_files: bool,
}

/// The result of one stage of a block.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockStageDetail {
    /// The stage.
    pub stage: BlockStage,
    /// The outcome.
    pub outcome: Value,
    /// Artifacts by role.
    pub files: Value,
    /// Hash over outcome and artifacts.
    pub result_hash: ContentHash,
    /// Settings, inputs and attributes that it was computed from.
    #[serde(rename = "made_with")]
    pub provenance: Value,
    /// Computing time in milliseconds.
    pub ms: u64,
    /// When it was stored.
    pub at: UnixMillis,
}

from_row! { BlockStageDetail { stage, outcome as Json, files as Json, result_hash, provenance: "made_with" as Json, ms, at } }

/// Everything about one block.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockDetail {
    /// Attributes and state.
    #[serde(flatten)]
    pub state: BlockState,
    /// Current results of its stages.
    pub stages: Vec<BlockStageDetail>,
    /// Attempts, oldest first.
    pub attempts: Vec<AttemptRecord<BlockStage>>,
}

/// A block with its results, for a check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AuditedBlock {
    /// The block.
    pub block: BlockId,
    /// The user's id.
    pub name: BlockName,
    /// Index of the next stage, 4 if the block is done. `None` if there is no job.
    pub cursor: Option<i64>,
    /// Every stored result, also of stages that are to run again.
    pub results: Vec<BlockStageRecord>,
}

from_row! { AuditedBlock { block: "id", name, cursor: "stage", results = Vec::new() } }

/// A block with its input files as last read.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownBlock {
    /// The block.
    pub block: BlockId,
    /// Attributes as imported.
    pub attributes: BlockAttributes,
    /// Input files as last read.
    pub inputs: BlockInputVersions,
}

from_row! { KnownBlock { block: "id", attributes in row, inputs in row } }
from_row! { BlockStageRecord { stage, outcome, files as Json, result_hash } }

impl FromRow for BlockState {
    fn from_row(row: &Row) -> Result<Self> {
        let cursor: i64 = row.get("stage")?;
        Ok(Self {
            attributes: BlockAttributes::from_row(row)?,
            status: row.get("status")?,
            next_stage: usize::try_from(cursor)
                .ok()
                .and_then(BlockStage::from_index),
            attempts: row.get("attempt")?,
            crashes: row.get("crashes")?,
            failure: stored_failure(row)?,
            control_points: control_points(row)?,
            characters: row.get("characters")?,
            left_out: row.get("left_out")?,
            retired: row.get("retired")?,
            low_confidence: row.get("low_confidence")?,
            other_files: row.get("other_files")?,
        })
    }
}

impl Catalog {
    /// Confidence of a character's position below which it is counted as uncertain.
    pub const LOW_CHARACTER_CONFIDENCE: f64 = 0.5;

    /// Returns all blocks with the states of their jobs, sorted by name, without metadata.
    pub async fn block_states(&self) -> Result<Vec<BlockState>> {
        let mut conn = self.read_conn().await?;
        let states = query_as(STATES).bind(None::<&str>);
        let states = states.bind(Self::LOW_CHARACTER_CONFIDENCE);
        let states = states.bind(self.left_out.of(ChecksummedTable::Block));
        states.fetch_all(&mut conn).await
    }

    /// Returns everything about a block, or `None` if it does not exist.
    pub async fn block(&self, name: &BlockName) -> Result<Option<BlockDetail>> {
        let mut conn = self.snapshot().await?;
        let state = query_as(STATES).bind(name.as_str());
        let state = state.bind(Self::LOW_CHARACTER_CONFIDENCE);
        let state = state.bind(self.left_out.of(ChecksummedTable::Block));
        let Some(state) = state.fetch_optional(&mut conn).await? else {
            return Ok(None);
        };
        let stages = query_as(STAGES).bind(name.as_str());
        let attempts = query_as(ATTEMPTS).bind(name.as_str());
        Ok(Some(BlockDetail {
            state,
            stages: stages.fetch_all(&mut conn).await?,
            attempts: attempts.fetch_all(&mut conn).await?,
        }))
    }

    /// Returns all blocks with their input files as last read, sorted by id, without metadata.
    pub async fn known_blocks(&self) -> Result<Vec<KnownBlock>> {
        let mut conn = self.read_conn().await?;
        query_as(BLOCKS).fetch_all(&mut conn).await
    }

    /// Returns the number of blocks.
    pub async fn count_blocks(&self) -> Result<u64> {
        let mut conn = self.read_conn().await?;
        let query = query_scalar("SELECT count(*) FROM block");
        query.fetch_one(&mut conn).await
    }

    /// Returns every block with the results of its stages, for a check.
    ///
    /// # Errors
    /// Returns an error if a value is invalid or a database operation fails.
    pub async fn audited_blocks(&self) -> Result<Vec<AuditedBlock>> {
        let mut conn = self.snapshot().await?;
        let mut blocks: Vec<AuditedBlock> = query_as(AUDITED).fetch_all(&mut conn).await?;
        for block in &mut blocks {
            block.results = stage_records(&mut conn, block.block).await?;
        }
        Ok(blocks)
    }
}

/// Reads the results of a block, in the order of the stages.
pub(crate) async fn stage_records(
    conn: &mut Conn,
    block: BlockId,
) -> Result<Vec<BlockStageRecord>> {
    query_as(RESULTS).bind(block.0).fetch_all(conn).await
}

/// Reads the control points from a row with the columns of [`BLOCK`].
pub(crate) fn control_points(row: &Row) -> Result<Option<ControlPoints>> {
    let stored: Option<Json<ControlPoints>> = row.get("control_points")?;
    Ok(stored.map(|Json(points)| points))
}
