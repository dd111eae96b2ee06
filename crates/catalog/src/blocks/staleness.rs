//! Finds the blocks that must run again because their settings or inputs changed, and requeues them.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use crate::blocks::block_job::BlockJob;
use crate::blocks::model::{BlockAttributes, BlockInputVersions, BlockProvenance};
use crate::blocks::queue::uncounted;
use crate::blocks::records::control_points;
use crate::blocks::selection::BlockSelection;
use crate::db::conn::Conn;
use crate::db::query::{query, query_as};
use crate::db::row::{FromRow, Row};
use crate::db::transaction::in_transaction;
use crate::db::value::Json;
use crate::jobs::block_settings::BlockSettings;
use crate::jobs::requeue::{requeue, send_back};
use crate::jobs::staleness::RerunPolicy;
use crate::queue::counters::{CounterKey, KeyedJob};
use crate::queue::lease::position;
use crate::{Catalog, InputVersion, Result};
use mocban_core::domain::{BlockId, BlockName, BlockStage, ControlPoints, JobStatus, Stage};

const JOBS: &str = "
SELECT b.id, b.name, b.mesh_path, b.page_path, b.labels_path, b.unit, b.side, NULL AS meta, b.mesh_hash, b.mesh_stat,
    b.page_hash, b.page_stat, b.labels_hash, b.labels_stat, b.control_points, j.stage, j.status, f.stage AS failed_stage,
    f.made_with AS failed_with
FROM block AS b JOIN block_job AS j ON j.block = b.id LEFT JOIN block_failure AS f ON f.block = b.id ORDER BY b.id";

const RESULTS: &str = "SELECT block, stage, made_with FROM block_result ORDER BY block, stage";

/// Why a block runs, or runs again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BlockReason {
    /// It is new.
    New,
    /// It was interrupted or waits for its next attempt.
    Unfinished,
    /// Its mesh changed.
    Mesh,
    /// Its page changed.
    Page,
    /// Its labels changed.
    Labels,
    /// Its unit or its side changed.
    Attributes,
    /// A person chose control points or removed them.
    ControlPoints,
    /// Settings changed.
    Settings,
    /// It failed with other settings, inputs or control points.
    FailedBefore,
    /// A user requests it.
    Requested,
}

impl std::fmt::Display for BlockReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::New => "new",
            Self::Unfinished => "unfinished",
            Self::Mesh => "the mesh changed",
            Self::Page => "the page changed",
            Self::Labels => "the labels changed",
            Self::Attributes => "unit or side changed",
            Self::ControlPoints => "the control points changed",
            Self::Settings => "settings changed",
            Self::FailedBefore => "it failed with other settings, files or control points",
            Self::Requested => "requested",
        })
    }
}

/// A block that a run would work on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BlockPlanEntry {
    /// The block.
    pub block: BlockName,
    /// First stage to run.
    pub from: BlockStage,
    /// Why.
    pub why: BlockReason,
}

/// A block's job with what its failure was made with.
struct PlannedBlock {
    block: BlockId,
    attributes: BlockAttributes,
    inputs: BlockInputVersions,
    control_points: Option<ControlPoints>,
    cursor: i64,
    status: JobStatus,
    failure: Option<(BlockStage, BlockProvenance)>,
}

impl FromRow for PlannedBlock {
    fn from_row(row: &Row) -> Result<Self> {
        let failed_with: Option<Json<BlockProvenance>> = row.get("failed_with")?;
        let failed_stage: Option<BlockStage> = row.get("failed_stage")?;
        Ok(Self {
            block: row.get("id")?,
            attributes: BlockAttributes::from_row(row)?,
            inputs: BlockInputVersions::from_row(row)?,
            control_points: control_points(row)?,
            cursor: row.get("stage")?,
            status: row.get("status")?,
            failure: failed_stage.zip(failed_with.map(|Json(with)| with)),
        })
    }
}

impl PlannedBlock {
    /// Returns the job with its key.
    fn keyed(&self) -> KeyedJob {
        let key = CounterKey::new(self.cursor, self.status, None);
        KeyedJob {
            unit: self.block.0,
            key,
        }
    }

    fn next(&self) -> Option<BlockStage> {
        let index = usize::try_from(self.cursor).ok()?;
        BlockStage::from_index(index)
    }

    /// Returns what changed since a result or a failure of a stage, if anything. A missing file that the next stage reads is
    /// not compared: the results are those of the file that was there.
    fn change(
        &self,
        stage: BlockStage,
        made: &BlockProvenance,
        settings: &BlockSettings,
    ) -> Option<BlockReason> {
        let points = self.control_points.as_ref();
        let (attributes, inputs) = (&self.attributes, &self.inputs);
        let now = BlockProvenance::new(stage, settings.of(stage), attributes, inputs, points);
        let is_awaited = |version: &Option<InputVersion>, reads: fn(BlockStage) -> bool| {
            let is_gone = version.as_ref().is_some_and(InputVersion::is_gone);
            is_gone && self.next().is_some_and(reads)
        };
        let mesh = is_awaited(&inputs.mesh, |_| true);
        let page = is_awaited(&inputs.page, BlockStage::reads_page);
        let labels = is_awaited(&inputs.labels, BlockStage::depends_on_labels);
        [
            (made.mesh != now.mesh && !mesh, BlockReason::Mesh),
            (made.page != now.page && !page, BlockReason::Page),
            (made.labels != now.labels && !labels, BlockReason::Labels),
            (made.attributes != now.attributes, BlockReason::Attributes),
            (
                // Points are of one scan and page.
                made.control_points != now.control_points && !mesh && !page,
                BlockReason::ControlPoints,
            ),
            (
                // The settings of a worker that died are not known.
                made.settings != now.settings && made.settings != Value::Null,
                BlockReason::Settings,
            ),
        ]
        .into_iter()
        .find_map(|(differs, reason)| differs.then_some(reason))
    }

    /// Returns the first stage to run and why, or `None` if the block need not run or is leased.
    fn decide(
        &self,
        results: &BTreeMap<BlockStage, BlockProvenance>,
        settings: &BlockSettings,
        policy: RerunPolicy,
    ) -> Option<(BlockStage, BlockReason)> {
        if self.status == JobStatus::Leased {
            return None;
        }
        if policy == RerunPolicy::All(Stage::Fit) {
            return Some((BlockStage::Face, BlockReason::Requested));
        }
        let before = BlockStage::ALL.into_iter();
        let changed = before
            .filter(|stage| (stage.index() as i64) < self.cursor)
            .find_map(|stage| {
                let why = match results.get(&stage) {
                    Some(made) => self.change(stage, made, settings)?,
                    None => BlockReason::Unfinished,
                };
                Some((stage, why))
            });
        if changed.is_some() {
            return changed;
        }
        let next = self.next()?;
        let failed_before = self
            .failure
            .as_ref()
            .and_then(|(stage, made)| self.change(*stage, made, settings));
        match self.status {
            JobStatus::Quarantined if policy == RerunPolicy::Failed => {
                Some((next, BlockReason::Requested))
            }
            JobStatus::Quarantined => failed_before.map(|_| (next, BlockReason::FailedBefore)),
            JobStatus::Ready if self.cursor == 0 => Some((next, BlockReason::New)),
            JobStatus::Ready | JobStatus::Backoff => Some((next, BlockReason::Unfinished)),
            JobStatus::Done | JobStatus::Leased => None,
        }
    }
}

impl Catalog {
    /// Returns the blocks that a run with these settings would work on, and why. If `selection` is given, considers only
    /// its blocks.
    pub async fn plan_blocks(
        &self,
        settings: &BlockSettings,
        policy: RerunPolicy,
        selection: Option<&BlockSelection>,
    ) -> Result<Vec<BlockPlanEntry>> {
        let mut conn = self.snapshot().await?;
        let planned = decisions(&mut conn, settings, policy, selection).await?;
        let entries = planned.into_iter().map(|(job, from, why)| BlockPlanEntry {
            block: job.attributes.name,
            from,
            why,
        });
        Ok(entries.collect())
    }

    /// Requeues blocks whose settings or inputs changed, and blocks that `policy` selects. If `selection` is given,
    /// considers only its blocks. Returns their number.
    pub async fn requeue_stale_blocks(
        &self,
        settings: &BlockSettings,
        policy: RerunPolicy,
        selection: Option<&BlockSelection>,
    ) -> Result<u64> {
        let (settings, selection) = (settings.clone(), selection.cloned());
        in_transaction!(self, |conn| {
            let decided = decisions(conn, &settings, policy, selection.as_ref()).await?;
            let stale = decided.iter().filter(|(job, from, why)| {
                let waits = matches!(why, BlockReason::New | BlockReason::Unfinished);
                !waits || job.next() != Some(*from)
            });
            let stale = stale.map(|(job, from, _)| (job.keyed(), position::<BlockJob>(*from)));
            let stale: Vec<_> = stale.collect();
            requeue::<BlockJob>(conn, &stale, &mut uncounted()).await
        })
    }

    /// Sends blocks back to a stage, never forward, and ends their leases. Adds missing jobs. For repairs, when files
    /// of their results are missing or damaged.
    pub async fn reset_blocks(&self, blocks: Vec<(BlockId, BlockStage)>) -> Result<()> {
        in_transaction!(self, |conn| {
            send_back::<BlockJob>(conn, blocks.into_iter(), &mut uncounted()).await
        })
    }
}

/// Reads all jobs and decides which blocks run, each with its first stage.
async fn decisions(
    conn: &mut Conn,
    settings: &BlockSettings,
    policy: RerunPolicy,
    selection: Option<&BlockSelection>,
) -> Result<Vec<(PlannedBlock, BlockStage, BlockReason)>> {
    let jobs: Vec<PlannedBlock> = query_as(JOBS).fetch_all(&mut *conn).await?;
    let mut results: BTreeMap<BlockId, BTreeMap<BlockStage, BlockProvenance>> = BTreeMap::new();
    for row in &query(RESULTS).fetch_all(conn).await? {
        let Json(made) = row.get("made_with")?;
        let of_block = results.entry(row.get("block")?).or_default();
        of_block.insert(row.get("stage")?, made);
    }
    let none = BTreeMap::new();
    let wanted = jobs.into_iter();
    let wanted =
        wanted.filter(|job| selection.is_none_or(|selection| selection.contains(job.block)));
    let decided = wanted.filter_map(|job| {
        let results = results.get(&job.block).unwrap_or(&none);
        let (from, why) = job.decide(results, settings, policy)?;
        Some((job, from, why))
    });
    Ok(decided.collect())
}
