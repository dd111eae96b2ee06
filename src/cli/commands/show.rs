//! `show PAIR`: prints numbers, files, history, and why the pair will run again.

use clap::Args;
use serde_json::{Value, json};

use super::show_block::show_block;
use super::verdict;
use crate::cli::output::context::Context;
use crate::cli::output::pair_table::pair_table as table_text;
use crate::cli::output::screen::{Palette, Tone};
use crate::cli::output::show_text::{PairPage, manual_text};
use crate::cli::output::streams;
use mocban_catalog::{Catalog, PairDetail};
use mocban_core::domain::shell::quoted_id;
use mocban_core::domain::{JobStatus, MetricOutcome, PairName, ThresholdMetric};
use mocban_project::details::{self, Details, PairOverview};
use mocban_project::failures::may_succeed_unchanged;
use mocban_project::input_warnings;
use mocban_project::pair_table::{self, PairChoice};
use mocban_project::{ExitCode, ProjectResult};
use mocban_store::Project;
use mocban_system::time_text::local;

/// Arguments of `show`.
#[derive(Debug, Args)]
pub(crate) struct ShowArgs {
    /// The pair or block; without it, the names of all pairs and blocks are listed
    pub(crate) name: Option<String>,
    /// A table of the pairs of low confidence, the least confident first
    #[arg(long, conflicts_with = "name")]
    pub(crate) low: bool,
}

pub(crate) async fn show(args: ShowArgs, context: &Context) -> ProjectResult<ExitCode> {
    let (project, catalog) = context.location.open_read_only().await?;
    if args.low {
        return show_low(&catalog, context).await;
    }
    let Some(id) = args.name else {
        return list_names(&catalog, context).await;
    };
    let details = details::read(&id, &catalog, &context.location).await?;
    catalog.close().await;
    let pair = match details {
        Details::Pair(pair) => pair,
        Details::Block(block, characters) => {
            let missing = details::missing_block_files(&project, &block.state.attributes).await;
            show_block(&block, &characters, &missing, &project, context)?;
            return Ok(ExitCode::Done);
        }
        Details::ListedBlock(rows) => {
            let json = json!({"schema": 1, "block": id, "pairs": rows});
            context.print(&json, || table_text(&rows, context.stdout))?;
            context.next(&format!("contact-sheet {}", quoted_id(&id)));
            return Ok(ExitCode::Done);
        }
    };
    let (detail, palette) = (&pair.detail, context.stdout);
    let page = PairPage {
        detail,
        project: &project,
        palette,
    };
    context.print(&as_json(&pair, &project)?, || {
        let tail = tail(&pair, palette);
        [page.text(), manual_text(&pair.manual, palette), tail].concat()
    })?;
    for command in next_steps(
        detail,
        pair.next_run.is_some() || !pair.changed_inputs.is_empty(),
    ) {
        context.next(&command);
    }
    Ok(ExitCode::Done)
}

/// Names that are written to stdout at once.
const NAMES_AT_ONCE: usize = 1000;

/// Prints the names of all blocks and pairs, one per line. Retired pairs are left out.
async fn list_names(catalog: &Catalog, context: &Context) -> ProjectResult<ExitCode> {
    let (blocks, pairs) = details::names(catalog).await?;
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

/// Prints a table of the pairs of low confidence.
async fn show_low(catalog: &Catalog, context: &Context) -> ProjectResult<ExitCode> {
    let rows = pair_table::read(catalog, PairChoice::LowConfidence).await?;
    let (limit, metric) = (MetricOutcome::LOW_CONFIDENCE, ThresholdMetric::DEFAULT);
    if context.global.json {
        streams::print_json(
            &json!({"schema": 1, "below": limit, "metric": metric, "pairs": rows}),
        )?;
    } else if rows.is_empty() {
        context.info(&format!(
            "no pair has a confidence below {limit} ({metric})"
        ));
    } else {
        streams::print(&table_text(&rows, context.stdout))?;
        context.next("contact-sheet --order confidence");
    }
    Ok(ExitCode::Done)
}

/// Formats the verdicts and what the next run would do.
fn tail(pair: &PairOverview, palette: Palette) -> String {
    let PairOverview {
        detail,
        next_run,
        changed_inputs,
        ..
    } = pair;
    let mut lines = Vec::new();
    if !detail.verdict_log.is_empty() {
        lines.push(palette.paint(Tone::Strong, "verdicts"));
        let log = verdict::log_text(&detail.verdict_log, palette);
        lines.extend(log.lines().map(|line| format!("  {line}")));
    }
    lines.push(palette.paint(Tone::Strong, "next run"));
    lines.push(match (next_run, detail.results.status) {
        (Some(entry), _) => format!("  from {}: {entry}", entry.from),
        (None, JobStatus::Quarantined | JobStatus::Done) if !changed_inputs.is_empty() => {
            let changed = changed_inputs.join(" and ");
            format!("  {changed} changed since the last run; `run` computes the pair again")
        }
        (None, JobStatus::Quarantined) if !may_retry(detail) => {
            let import = if detail.results.attributes.is_listed() {
                "or the list and import it again"
            } else {
                "or import another file"
            };
            format!("  nothing; correct the file or a setting, {import}, and `run` computes the pair again")
        }
        (None, JobStatus::Quarantined) => {
            "  nothing until `retry`, or until a missing file is there".to_owned()
        }
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
    let name = quoted_id(detail.results.attributes.name.as_str());
    match detail.results.status {
        JobStatus::Quarantined | JobStatus::Done if has_work => vec![format!("run {name}")],
        JobStatus::Quarantined if !may_retry(detail) => Vec::new(),
        JobStatus::Quarantined => vec![format!("retry {name}")],
        JobStatus::Leased => vec!["status --watch".to_owned()],
        JobStatus::Ready | JobStatus::Backoff => vec![format!("run {name}")],
        JobStatus::Done => Vec::new(),
    }
}

/// Returns the pair's record as JSON. Adds the artifact paths, manual alignments and what the next run would do.
fn as_json(pair: &PairOverview, project: &Project) -> ProjectResult<Value> {
    let mut value = serde_json::to_value(&pair.detail)?;
    let files = pair
        .detail
        .results
        .stages
        .iter()
        .flat_map(|record| &record.files);
    let paths = files.map(|(role, artifact)| {
        let path = project.artifact_path(artifact);
        (role.clone(), json!(path.to_string_lossy()))
    });
    value["files"] = paths.collect::<serde_json::Map<_, _>>().into();
    value["manual_alignments"] = serde_json::to_value(&pair.manual)?;
    value["next_run"] = serde_json::to_value(&pair.next_run)?;
    value["changed_inputs"] = json!(pair.changed_inputs);
    value["warnings"] = json!(input_warnings::of_pair(&pair.detail.results));
    value["schema"] = json!(1);
    Ok(value)
}
