//! Everything about one pair or block, and the ids of all.

use std::collections::BTreeSet;
use std::time::Duration;

use serde::Serialize;

use crate::blocking::blocking_within;
use crate::error::{ProjectError, ProjectResult};
use crate::location::Location;
use crate::pair_table::{self, PairRow};
use crate::selection;
use mocban_catalog::{
    BlockAttributes, BlockDetail, Catalog, CatalogError, PairDetail, PairResults, PlanEntry,
    StoredAlignment, StoredCharacter,
};
use mocban_core::domain::{
    BlockName, DepthOutcome, InputVersion, MetricOutcome, PairName, Stage, ThresholdMetric,
};
use mocban_results::ManualCorrection;
use mocban_runner::{NamedWork, fingerprints};
use mocban_store::{Project, hash_input, stat_input};

/// Longest time for looking at the files of a pair or block. A disk may hang.
const MAX_LOOK: Duration = Duration::from_secs(10);

/// A pair or a block.
#[derive(Debug)]
pub enum Details {
    /// A pair.
    Pair(Box<PairOverview>),
    /// A block, and its characters.
    Block(Box<BlockDetail>, Vec<StoredCharacter>),
    /// The pairs of a block that only lists of pairs have.
    ListedBlock(Vec<PairRow>),
}

/// A pair with what people and the next run do.
#[derive(Debug)]
pub struct PairOverview {
    /// The pair.
    pub detail: PairDetail,
    /// Its manual alignments, oldest first, without the undone ones.
    pub manual: Vec<ManualResult>,
    /// What the next run would do, as far as the catalog knows.
    pub next_run: Option<PlanEntry>,
    /// Which files were replaced since they were read: `mesh`, `print`. The next run finds out, and computes the pair again.
    pub changed_inputs: Vec<&'static str>,
}

/// A manual alignment beside the automatic result.
#[derive(Debug, Serialize)]
pub struct ManualResult {
    /// The alignment.
    #[serde(flatten)]
    pub stored: StoredAlignment,
    /// Difference from the automatic result. `None` if there is no automatic result, or if the depth map has changed.
    pub adjustment: Option<Adjustment>,
}

/// How a manual alignment differs from the result of a metric.
#[derive(Debug, Serialize)]
pub struct Adjustment {
    /// The metric.
    pub from: ThresholdMetric,
    /// The difference.
    #[serde(flatten)]
    pub by: ManualCorrection,
    /// Intersection over union of the automatic result.
    pub from_iou: f64,
}

/// Reads a pair or block by its id.
///
/// # Errors
/// Returns an error if the pair is retired.
pub async fn read(id: &str, catalog: &Catalog, location: &Location) -> ProjectResult<Details> {
    let ids = [id.to_owned()];
    let NamedWork { pairs, blocks } = selection::pairs_and_blocks(catalog, &ids).await?;
    if let Some(block) = blocks.first() {
        let Some(detail) = catalog.block(block).await? else {
            let text = format!("block {block} was removed while it was read");
            return Err(ProjectError::unexpected(text));
        };
        let characters = catalog.block_characters(block).await?;
        return Ok(Details::Block(Box::new(detail), characters));
    }
    let Some(name) = pairs.first() else {
        return Err(ProjectError::unexpected(format!("{id} was not looked up")));
    };
    if !id.parse().is_ok_and(|typed: PairName| typed == *name) {
        let rows = pair_table::of_listed_block(catalog, id).await?;
        return Ok(Details::ListedBlock(rows));
    }
    let fingerprints = fingerprints(&location.settings()?.config.stages);
    let next_run = catalog.why(name, &fingerprints).await?;
    let Some(detail) = catalog.pair(name).await? else {
        let text = format!("pair {name} was removed while it was read");
        return Err(ProjectError::unexpected(text));
    };
    let manual = manual_results(catalog, &detail.results).await?;
    Ok(Details::Pair(Box::new(PairOverview {
        detail,
        manual,
        next_run,
        changed_inputs: changed_inputs(name, catalog, location).await?,
    })))
}

/// Looks at the files of a pair, and reads those whose size, time or inode changed. Returns the changed ones; none if the
/// disk does not answer in time.
async fn changed_inputs(
    name: &PairName,
    catalog: &Catalog,
    location: &Location,
) -> ProjectResult<Vec<&'static str>> {
    let (storage, _) = location.data_locations()?;
    let project = Project::at(&location.dir).with_storage(storage);
    let pair = catalog.select(std::slice::from_ref(name)).await?;
    let known = catalog.known_inputs(None, 1, Some(&pair)).await?;
    let look = move || {
        let files = known.into_iter().flat_map(|known| {
            [
                ("mesh", known.mesh_path, known.mesh),
                ("print", known.print_path, known.print),
            ]
        });
        let is_changed = |path: &str, read: &InputVersion| {
            let input = project.input(path);
            stat_input(&input).is_ok_and(|stat| stat != read.stat)
                && hash_input(&input).is_ok_and(|found| found.hash != read.hash)
        };
        let changed = files
            .filter(|(_, path, read)| read.as_ref().is_some_and(|read| is_changed(path, read)));
        changed.map(|(kind, ..)| kind).collect()
    };
    let looked = blocking_within(MAX_LOOK, look).await;
    Ok(looked.unwrap_or_default())
}

/// Returns which files of a block are not at their places: `mesh`, `page` or `labels`; none if the disk does not answer in time.
pub async fn missing_block_files(
    project: &Project,
    attributes: &BlockAttributes,
) -> Vec<&'static str> {
    let labels = attributes.labels_path.as_ref();
    let files = [
        ("mesh", Some(attributes.mesh_path.clone())),
        ("page", Some(attributes.page_path.clone())),
        ("labels", labels.cloned()),
    ];
    let project = project.clone();
    let look = move || {
        let missing = files.into_iter().filter(|(_, path)| {
            let path = path.as_ref();
            path.is_some_and(|path| !project.input(path).exists())
        });
        missing.map(|(kind, _)| kind).collect()
    };
    let looked = blocking_within(MAX_LOOK, look).await;
    looked.unwrap_or_default()
}

/// Returns the names of all blocks and of all pairs that are not retired.
pub async fn names(catalog: &Catalog) -> ProjectResult<(Vec<BlockName>, Vec<PairName>)> {
    let (blocks, mut pairs) = (catalog.block_names().await?, catalog.pair_names().await?);
    let retired = catalog.retired_pairs().await?.into_iter();
    let retired: BTreeSet<PairName> = retired.map(|pair| pair.name).collect();
    pairs.retain(|pair| !retired.contains(pair));
    Ok((blocks, pairs))
}

/// Returns the first ids of blocks, and of pairs unless `only_blocks` is set, that begin with a text.
pub async fn names_with_prefix(
    location: &Location,
    prefix: &str,
    only_blocks: bool,
    limit: usize,
) -> ProjectResult<Vec<String>> {
    let (_, catalog) = location.open_read_only().await?;
    let blocks = catalog.block_names().await?.into_iter();
    let blocks = blocks.map(|name| name.to_string());
    let mut names: Vec<String> = blocks.filter(|name| name.starts_with(prefix)).collect();
    if !only_blocks {
        let pairs = catalog.pair_names_with_prefix(prefix, limit).await?;
        names.extend(pairs.iter().map(PairName::to_string));
    }
    catalog.close().await;
    names.truncate(limit);
    Ok(names)
}

async fn manual_results(
    catalog: &Catalog,
    results: &PairResults,
) -> Result<Vec<ManualResult>, CatalogError> {
    let all = catalog
        .manual_alignments_of(&results.attributes.name)
        .await?;
    let valid = all.into_iter().filter(|stored| stored.undone_at.is_none());
    let with_adjustment = valid.map(|stored| ManualResult {
        adjustment: adjustment(&stored, results),
        stored,
    });
    Ok(with_adjustment.collect())
}

fn adjustment(manual: &StoredAlignment, results: &PairResults) -> Option<Adjustment> {
    let automatic = automatic_result(results).filter(|_| manual.on_current_depth)?;
    let depth: DepthOutcome = results.stage(Stage::Depth)?.parse().ok()?;
    let (from, to) = (&automatic.print_from_depth, &manual.made.print_from_depth);
    Some(Adjustment {
        from: automatic.metric,
        by: ManualCorrection::between(from, to, [depth.width, depth.height])?,
        from_iou: automatic.scores.iou,
    })
}

/// Returns the automatic result that manual alignments are compared with: the ensemble's, or else the first metric's.
fn automatic_result(results: &PairResults) -> Option<&MetricOutcome> {
    let ensemble = results.metric(ThresholdMetric::Ensemble);
    ensemble
        .or(results.metrics.first())
        .map(|record| &record.outcome)
}
