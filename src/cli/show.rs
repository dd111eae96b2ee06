//! `show PAIR`: numbers, files, history, and why it runs again.

use clap::Args;
use serde_json::{Value, json};

use super::context::Context;
use super::exit::ExitCode;
use super::output::{self, Palette, Tone};
use super::show_hand::Laid;
use super::show_text::Page;
use super::time_text::utc;
use super::{select, show_hand, verdict};
use crate::catalog::{PairDetail, PlanEntry};
use crate::domain::JobStatus;
use crate::runner;
use crate::store::Project;

/// Arguments of `show`.
#[derive(Debug, Args)]
pub(super) struct ShowArgs {
    /// The pair
    pub(super) pair: String,
}

pub(super) async fn show(args: ShowArgs, context: &Context) -> anyhow::Result<ExitCode> {
    let (project, catalog) = context.reader().await?;
    let name = select::pair(&catalog, &args.pair).await?;
    let recipes = runner::recipes(&context.settings()?.config.stages);
    let why = catalog.why(&name, &recipes).await?;
    let Some(detail) = catalog.pair(&name).await? else {
        anyhow::bail!("pair {name} went away while it was looked up");
    };
    let laid = show_hand::of(&catalog, &detail.results).await?;
    catalog.close().await;
    if context.global.json {
        output::print_json(&as_json(&detail, &laid, why.as_ref(), &project)?)?;
        return Ok(ExitCode::Done);
    }
    let page = Page {
        detail: &detail,
        project: &project,
        palette: context.output.out,
    };
    output::print(&format!(
        "{}{}{}",
        page.text(),
        show_hand::text(&laid, context.output.out),
        tail(&detail, why.as_ref(), context.output.out)
    ))?;
    for command in next_steps(&detail, why.is_some()) {
        context.output.next(&context.command(&command));
    }
    Ok(ExitCode::Done)
}

/// Verdicts and what comes next.
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
        (None, JobStatus::Quarantined) => "  stays failed until it is retried".to_owned(),
        (None, JobStatus::Held) => "  set aside until it is retried".to_owned(),
        (None, JobStatus::Leased) => "  in the hands of a run".to_owned(),
        (None, JobStatus::Done | JobStatus::Ready | JobStatus::Backoff) => {
            "  nothing left to do".to_owned()
        }
    });
    lines.extend(detail.run_at.map(|at| format!("  not before {}", utc(at))));
    lines.join("\n")
}

fn next_steps(detail: &PairDetail, has_work: bool) -> Vec<String> {
    let name = &detail.results.facts.name;
    match detail.results.status {
        JobStatus::Quarantined | JobStatus::Held => vec![format!("retry {name}")],
        JobStatus::Leased => vec!["status --watch".to_owned()],
        JobStatus::Ready | JobStatus::Backoff => vec![format!("run {name}")],
        JobStatus::Done if has_work => vec![format!("run {name}")],
        JobStatus::Done => Vec::new(),
    }
}

/// The catalog's record with the paths of its files and what a run would do.
fn as_json(
    detail: &PairDetail,
    laid: &[Laid],
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
        fields.insert("by_hand".to_owned(), serde_json::to_value(laid)?);
        fields.insert("next_run".to_owned(), serde_json::to_value(why)?);
        fields.insert("schema".to_owned(), json!(1));
    }
    Ok(value)
}
