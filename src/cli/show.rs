//! `show PAIR`: prints numbers, files, history, and why the pair will run again.

use clap::Args;
use serde_json::{Value, json};

use super::context::Context;
use super::exit::ExitCode;
use super::output;
use super::screen::{Palette, Tone};
use super::select;
use super::show_text::{Adjustment, ManualResult, PairPage, manual_text};
use super::time_text::utc;
use super::verdict;
use crate::catalog::{Catalog, CatalogError, PairDetail, PairResults, PlanEntry, StoredAlignment};
use crate::domain::{DepthOutcome, JobStatus, MetricOutcome, Stage, ThresholdMetric};
use crate::report::ManualCorrection;
use crate::runner;
use crate::store::Project;

/// Arguments of `show`.
#[derive(Debug, Args)]
pub(super) struct ShowArgs {
    /// The pair
    pub(super) pair: String,
}

pub(super) async fn show(args: ShowArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.open_read_only().await?;
    let name = select::pair(&catalog, &args.pair).await?;
    let fingerprints = runner::fingerprints(&context.settings()?.config.stages);
    let why = catalog.why(&name, &fingerprints).await?;
    let Some(detail) = catalog.pair(&name).await? else {
        anyhow::bail!("pair {name} was removed while it was read");
    };
    let manual = manual_results(&catalog, &detail.results).await?;
    catalog.close().await;
    if context.global.json {
        output::print_json(&as_json(&detail, &manual, why.as_ref(), &project)?)?;
        return Ok(ExitCode::Done);
    }
    let page = PairPage {
        detail: &detail,
        project: &project,
        palette: context.output.stdout,
    };
    output::print(&format!(
        "{}{}{}",
        page.text(),
        manual_text(&manual, context.output.stdout),
        tail(&detail, why.as_ref(), context.output.stdout)
    ))?;
    for command in next_steps(&detail, why.is_some()) {
        context.output.next(&context.command(&command));
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
        (Some(entry), _) => format!("  from {}: {}", entry.from, entry.why),
        (None, JobStatus::Quarantined) => "  nothing until `retry`".to_owned(),
        (None, JobStatus::Leased) => "  running now".to_owned(),
        (None, JobStatus::Done | JobStatus::Ready | JobStatus::Backoff) => {
            "  nothing left to do".to_owned()
        }
    });
    lines.extend(detail.run_at.map(|at| format!("  not before {}", utc(at))));
    lines.join("\n")
}

fn next_steps(detail: &PairDetail, has_work: bool) -> Vec<String> {
    let name = &detail.results.attributes.name;
    match detail.results.status {
        JobStatus::Quarantined => vec![format!("retry {name}")],
        JobStatus::Leased => vec!["status --watch".to_owned()],
        JobStatus::Ready | JobStatus::Backoff => vec![format!("run {name}")],
        JobStatus::Done if has_work => vec![format!("run {name}")],
        JobStatus::Done => Vec::new(),
    }
}

/// Returns the catalog's record with the paths of its files and what the next run would do.
fn as_json(
    detail: &PairDetail,
    manual: &[ManualResult],
    why: Option<&PlanEntry>,
    project: &Project,
) -> anyhow::Result<Value> {
    let mut value = serde_json::to_value(detail)?;
    if let Value::Object(fields) = &mut value {
        let mut paths = serde_json::Map::new();
        for record in &detail.results.stages {
            for (role, artifact) in &record.files {
                let path = project.artifact_path(artifact);
                paths.insert(role.clone(), json!(path.to_string_lossy()));
            }
        }
        fields.insert("files".to_owned(), Value::Object(paths));
        fields.insert(
            "manual_alignments".to_owned(),
            serde_json::to_value(manual)?,
        );
        fields.insert("next_run".to_owned(), serde_json::to_value(why)?);
        fields.insert("schema".to_owned(), json!(1));
    }
    Ok(value)
}

/// Reads the manual alignments of a pair that were not undone, oldest first.
async fn manual_results(
    catalog: &Catalog,
    results: &PairResults,
) -> Result<Vec<ManualResult>, CatalogError> {
    let all = catalog.manual_alignments().await?.into_iter();
    let of_pair = all
        .filter(|stored| stored.made.pair == results.attributes.name && stored.undone_at.is_none());
    Ok(of_pair
        .map(|stored| ManualResult {
            adjustment: adjustment(&stored, results),
            stored,
        })
        .collect())
}

fn adjustment(manual: &StoredAlignment, results: &PairResults) -> Option<Adjustment> {
    let automatic = automatic_result(results).filter(|_| manual.on_current_depth)?;
    let depth: DepthOutcome = results.stage(Stage::Depth)?.parse().ok()?;
    let size = [depth.width, depth.height];
    let by = ManualCorrection::between(
        &automatic.print_from_depth,
        &manual.made.print_from_depth,
        size,
    )?;
    Some(Adjustment {
        from: automatic.metric,
        by,
        from_iou: automatic.scores.iou,
    })
}

/// Returns the result that manual alignments are compared with: that of the ensemble, otherwise the first.
fn automatic_result(results: &PairResults) -> Option<&MetricOutcome> {
    let ensemble = results.metric(ThresholdMetric::Ensemble);
    ensemble
        .or(results.metrics.first())
        .map(|record| &record.outcome)
}
