//! `report`: prints the table of all results.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::compare::side_by_side;
use crate::cli::output::busy::Busy;
use crate::cli::output::context::Context;
use crate::cli::output::streams;
use mocban_catalog::Catalog;
use mocban_config::{self as config, Sources};
use mocban_export::{GallerySelection, draw_gallery};
use mocban_project::files;
use mocban_project::location::now;
use mocban_project::{ExitCode, ProjectResult, Refusal};
use mocban_report::{
    Cover, Report, ReportFormat, build, build_with, page, quality_gate, render, summary,
};
use mocban_results::IntervalMethod;
use mocban_store::Project;
use mocban_system::time_text::day;

/// Seed of the random choice of images; the HTML page states it.
const IMAGE_SEED: u64 = 1;

/// Arguments of `report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// Format of the report: text, json, csv, markdown, latex, or html (one page with images of failures) [default: that
    /// of the output file's extension, or text]
    #[arg(long, short)]
    pub(crate) format: Option<ReportFormat>,
    /// Write the report to this file instead of stdout
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Confidence intervals of Acc: wilson, or exact (Clopper-Pearson)
    #[arg(long, value_name = "METHOD", default_value = "wilson")]
    pub(crate) ci: IntervalMethod,
    /// Include computing times by stage and the time of the last result, as html always does; the output then differs
    /// from run to run
    #[arg(long)]
    pub(crate) with_times: bool,
    /// Also print the table of another project; only with the formats text and json
    #[arg(long, value_name = "DIR")]
    pub(crate) compare: Option<PathBuf>,
    /// Exit with code 20 unless every judged row has at least this Acc, such as 0.98
    #[arg(long, value_name = "ACC", value_parser = share)]
    pub(crate) fail_under: Option<f64>,
    /// Exit with code 21 unless every pair is done and every result is judged pass or fail
    #[arg(long)]
    pub(crate) require_complete: bool,
    /// Replace an earlier file even if the new one lacks images or true alignments
    #[arg(long)]
    pub(crate) allow_missing: bool,
}

/// Parses a number from 0 to 1.
fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        Ok(_) | Err(_) => Err("a share is a number from 0 to 1, such as 0.98".to_owned()),
    }
}

pub(crate) async fn report(args: ReportArgs, context: &Context) -> ProjectResult<ExitCode> {
    let (project, catalog) = context.open_read_only().await?;
    if let Some(path) = &args.output {
        files::refuse_used_file(path, &project, &catalog).await?;
    }
    context.warn_about_stale(&catalog).await?;
    let format = match args.format {
        Some(format) => format,
        None => args
            .output
            .as_deref()
            .map_or(Ok(ReportFormat::Text), format_of_file)?,
    };
    let format = chosen_format(format, context);
    if args.compare.is_some() && !matches!(format, ReportFormat::Text | ReportFormat::Json) {
        let text = format!("--compare needs the format text or json, not {format}");
        return Err(Refusal::Usage(text).into());
    }
    let busy = Busy::start(context, "reading the results");
    let mut pictures = GallerySelection::new(IMAGE_SEED);
    let report = if format == ReportFormat::Html {
        build_with(&catalog, &project, |pair, truth| pictures.add(pair, truth)).await?
    } else {
        build(&catalog, &project).await?
    };
    let mut report = with_defaults(report)?.with_interval(args.ci);
    if !args.with_times && format != ReportFormat::Html {
        report = report.without_times();
    }
    if let Some(problem) = &report.unusable_truth {
        context.warn(&format!("the report lacks the true alignment of {problem}"));
    }
    context.warn_about_set_apart(&report.set_apart);
    let mut is_complete = report.unusable_truth.is_none();
    let text = if let Some(other) = &args.compare {
        compared(&report, other, format, context).await?
    } else if format == ReportFormat::Html {
        let (page, has_all) = pictured(&report, pictures, (&project, &catalog), context).await?;
        is_complete &= has_all;
        page
    } else {
        render(&report, format)
    };
    catalog.close().await;
    drop(busy);
    match &args.output {
        Some(path) => {
            files::write_output(path, text.as_bytes(), args.allow_missing || is_complete)?;
            context.info(&format!("the report is in {}", path.display()));
        }
        None if format == ReportFormat::Json => streams::print_json_text(&text)?,
        None => streams::print(&text)?,
    }
    Ok(match check_requirements(&report, &args, context) {
        ExitCode::Done if !is_complete => ExitCode::SomeFailed,
        code => code,
    })
}

/// Returns the format that belongs to the extension of a file, or text for an unknown extension.
///
/// # Errors
/// Returns an error if the extension is that of a format which is not written.
fn format_of_file(path: &Path) -> Result<ReportFormat, Refusal> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    Ok(match &*extension.to_ascii_lowercase() {
        "json" => ReportFormat::Json,
        "csv" => ReportFormat::Csv,
        "md" | "markdown" => ReportFormat::Markdown,
        "tex" => ReportFormat::Latex,
        "html" | "htm" => ReportFormat::Html,
        "pdf" | "doc" | "docx" | "odt" | "xls" | "xlsx" | "ods" => {
            let text = format!(
                "a report cannot be written as {extension}; html can be printed to PDF by a browser, and spreadsheet \
                 programs open csv"
            );
            return Err(Refusal::Usage(text));
        }
        _ => ReportFormat::Text,
    })
}

/// Renders the report as a page with images. Warns about each missing image. Returns `true` if no image is missing.
async fn pictured(
    report: &Report,
    pictures: GallerySelection,
    (project, catalog): (&Project, &Catalog),
    context: &Context,
) -> ProjectResult<(String, bool)> {
    let limits = context.settings()?.config.limits.image;
    let gallery = draw_gallery(pictures, catalog, project, limits).await?;
    let name = std::path::absolute(project.dir()).unwrap_or_else(|_| project.dir().to_owned());
    let name = name.file_name().map(|name| name.to_string_lossy());
    let cover = Cover {
        project: name.map(Into::into),
        date: Some(day(now())),
    };
    let problems = (gallery.groups.iter())
        .flat_map(|group| &group.items)
        .filter_map(|item| Some(format!("{}: {}", item.pair, item.problem.as_ref()?)))
        .collect::<std::collections::BTreeSet<_>>();
    for problem in &problems {
        context.warn(&format!("the report lacks images of {problem}"));
    }
    Ok((page(report, &gallery, &cover), problems.is_empty()))
}

/// Renders this project's report with another one, as text or JSON.
async fn compared(
    here: &Report,
    other: &Path,
    format: ReportFormat,
    context: &Context,
) -> ProjectResult<String> {
    let there = read(&context.at(other)).await?.with_interval(here.interval);
    let names = [context.dir(), other.to_owned()].map(|dir| dir.display().to_string());
    if format == ReportFormat::Json {
        let mut value = serde_json::to_value(here)?;
        value["compared_with"] = json!({"project": names[1], "report": there});
        return Ok(serde_json::to_string_pretty(&value)?);
    }
    let tables = side_by_side(here, &there, [&names[0], &names[1]]);
    Ok(format!("{}\n{tables}", render(here, format)))
}

/// Prints the beginning of the report to stdout, or with `--json` the whole report.
pub(crate) async fn print_summary(context: &Context) -> ProjectResult<()> {
    let report = read(context).await?;
    if context.global.json {
        streams::print_json_text(&render(&report, ReportFormat::Json))?;
    } else {
        streams::print(&summary(&report))?;
    }
    Ok(())
}

/// Returns the format; `--json` overrides `--format`.
const fn chosen_format(format: ReportFormat, context: &Context) -> ReportFormat {
    if context.global.json {
        ReportFormat::Json
    } else {
        format
    }
}

async fn read(context: &Context) -> ProjectResult<Report> {
    let (project, catalog) = context.open_read_only().await?;
    let report = build(&catalog, &project).await?.without_times();
    catalog.close().await;
    with_defaults(report)
}

/// Names the settings of the results that are not the default ones.
fn with_defaults(mut report: Report) -> ProjectResult<Report> {
    let defaults = config::load(&Sources::default())?.config.stages;
    let fields = |stage| defaults.fingerprint_fields(stage);
    report.provenance.compare_with(fields);
    Ok(report)
}

/// Warns about the unmet requirements of `--require-complete` and `--fail-under`. Returns the exit code. If both are
/// unmet, returns `Incomplete`.
fn check_requirements(report: &Report, args: &ReportArgs, context: &Context) -> ExitCode {
    let missing = args.require_complete.then(|| quality_gate::missing(report));
    let below = args
        .fail_under
        .map(|least| quality_gate::below(report, least));
    let (missing, below) = (missing.unwrap_or_default(), below.unwrap_or_default());
    for reason in missing.iter().chain(&below) {
        context.warn(reason);
    }
    if !missing.is_empty() {
        ExitCode::Incomplete
    } else if !below.is_empty() {
        ExitCode::BelowFailUnder
    } else {
        ExitCode::Done
    }
}
