//! `show PAIR`: prints numbers, files, history, and why the pair will run again.

use std::collections::BTreeSet;

use clap::Args;
use serde_json::{Value, json};

use super::show_block::show_block;
use super::verdict;
use crate::cli::input::select;
use crate::cli::output::context::Context;
use crate::cli::output::failures::may_succeed_unchanged;
use crate::cli::output::screen::{Palette, Tone};
use crate::cli::output::show_text::{Adjustment, ManualResult, PairPage, manual_text};
use crate::cli::output::streams;
use mocban_catalog::{Catalog, CatalogError, PairDetail, PairResults, PlanEntry, StoredAlignment};
use mocban_core::domain::{
    DepthOutcome, JobStatus, MetricOutcome, PairName, Stage, ThresholdMetric,
};
use mocban_project::exit::ExitCode;
use mocban_project::shell::shell_quoted;
use mocban_project::time_text::local;
use mocban_report::ManualCorrection;
use mocban_runner::{self as runner, NamedWork};
use mocban_store::Project;

/// Arguments of `show`.
#[derive(Debug, Args)]
pub(crate) struct ShowArgs {
    /// The pair or block; without it, the names of all pairs and blocks are listed
    pub(crate) name: Option<String>,
}

pub(crate) async fn show(args: ShowArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.open_read_only().await?;
    let Some(typed) = args.name else {
        return list_names(&catalog, context).await;
    };
    let typed = std::slice::from_ref(&typed);
    let NamedWork { pairs, blocks } = select::pairs_and_blocks(&catalog, typed).await?;
    let (pair, block) = (pairs.into_iter().next(), blocks.into_iter().next());
    let name = match (pair, block) {
        (_, Some(block)) => return show_block(&block, &project, catalog, context).await,
        (Some(pair), None) => pair,
        (None, None) => anyhow::bail!("{} was not looked up", typed[0]),
    };
    let fingerprints = runner::fingerprints(&context.settings()?.config.stages);
    let why = catalog.why(&name, &fingerprints).await?;
    let Some(detail) = catalog.pair(&name).await? else {
        anyhow::bail!("pair {name} was removed while it was read");
    };
    let manual = manual_results(&catalog, &detail.results).await?;
    catalog.close().await;
    let (detail, palette) = (&detail, context.stdout);
    let page = PairPage {
        detail,
        project: &project,
        palette,
    };
    context.print(&as_json(detail, &manual, why.as_ref(), &project)?, || {
        let tail = tail(detail, why.as_ref(), palette);
        [page.text(), manual_text(&manual, palette), tail].concat()
    })?;
    for command in next_steps(detail, why.is_some()) {
        context.next(&command);
    }
    Ok(ExitCode::Done)
}

/// Names that are written to stdout at once.
const NAMES_AT_ONCE: usize = 1000;

/// Prints the names of all blocks and pairs, one per line. Retired pairs are left out.
async fn list_names(catalog: &Catalog, context: &Context) -> anyhow::Result<ExitCode> {
    let (blocks, mut pairs) = (catalog.block_names().await?, catalog.pair_names().await?);
    let retired = catalog.retired_pairs().await?.into_iter();
    let retired: BTreeSet<PairName> = retired.map(|pair| pair.name).collect();
    pairs.retain(|pair| !retired.contains(pair));
    if context.global.json {
        streams::print_json(&json!({"schema": 1, "blocks": blocks, "pairs": pairs}))?;
        return Ok(ExitCode::Done);
    }
    for block in blocks {
        streams::print(&format!("{block} (block)"))?;
    }
    for chunk in pairs.chunks(NAMES_AT_ONCE) {
        let names: Vec<&str> = chunk.iter().map(PairName::as_str).collect();
        streams::print(&names.join("\n"))?;
    }
    Ok(ExitCode::Done)
}

/// Formats the verdicts and what the next run would do.
fn tail(detail: &PairDetail, why: Option<&PlanEntry>, palette: Palette) -> String {
    let mut lines = Vec::new();
    if !detail.verdict_log.is_empty() {
        lines.push(palette.paint(Tone::Strong, "verdicts"));
        let log = verdict::log_text(&detail.verdict_log, palette);
        lines.extend(log.lines().map(|line| format!("  {line}")));
    }
    lines.push(palette.paint(Tone::Strong, "next run"));
    lines.push(match (why, detail.results.status) {
        (Some(entry), _) => format!("  from {}: {entry}", entry.from),
        (None, JobStatus::Quarantined) if !may_retry(detail) => {
            "  nothing; correct the file, its row in the list or a setting, and `run` computes the pair again".to_owned()
        }
        (None, JobStatus::Quarantined) => "  nothing until `retry`".to_owned(),
        (None, JobStatus::Leased) => "  running now".to_owned(),
        (None, JobStatus::Done | JobStatus::Ready | JobStatus::Backoff) => {
            "  nothing left to do".to_owned()
        }
    });
    lines.extend(
        detail
            .run_at
            .map(|at| format!("  not before {}", local(at))),
    );
    lines.join("\n")
}

/// Returns whether a failed pair may succeed with the same files and settings.
fn may_retry(detail: &PairDetail) -> bool {
    let failure = detail.results.failure.as_ref();
    failure.is_none_or(|stored| may_succeed_unchanged(stored.failure.class))
}

fn next_steps(detail: &PairDetail, has_work: bool) -> Vec<String> {
    let name = shell_quoted(detail.results.attributes.name.as_str());
    match detail.results.status {
        JobStatus::Quarantined if !may_retry(detail) => Vec::new(),
        JobStatus::Quarantined => vec![format!("retry {name}")],
        JobStatus::Leased => vec!["status --watch".to_owned()],
        JobStatus::Ready | JobStatus::Backoff => vec![format!("run {name}")],
        JobStatus::Done if has_work => vec![format!("run {name}")],
        JobStatus::Done => Vec::new(),
    }
}

/// Returns the pair's record as JSON. Adds the artifact paths, manual alignments and what the next run would do.
fn as_json(
    detail: &PairDetail,
    manual: &[ManualResult],
    why: Option<&PlanEntry>,
    project: &Project,
) -> anyhow::Result<Value> {
    let mut value = serde_json::to_value(detail)?;
    let files = detail
        .results
        .stages
        .iter()
        .flat_map(|record| &record.files);
    let paths = files.map(|(role, artifact)| {
        let path = project.artifact_path(artifact);
        (role.clone(), json!(path.to_string_lossy()))
    });
    value["files"] = paths.collect::<serde_json::Map<_, _>>().into();
    value["manual_alignments"] = serde_json::to_value(manual)?;
    value["next_run"] = serde_json::to_value(why)?;
    value["schema"] = json!(1);
    Ok(value)
}

/// Reads a pair's manual alignments, oldest first. Skips alignments that were undone.
async fn manual_results(
    catalog: &Catalog,
    results: &PairResults,
) -> Result<Vec<ManualResult>, CatalogError> {
    let all = catalog.manual_alignments().await?.into_iter();
    let name = &results.attributes.name;
    let of_pair = all.filter(|stored| stored.made.pair == *name && stored.undone_at.is_none());
    let with_adjustment = of_pair.map(|stored| ManualResult {
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
