//! `report`: prints the table of all results.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::compare::side_by_side;
use crate::cli::output::context::Context;
use crate::cli::output::streams;
use crate::cli::output::terminal::Terminal;
use mocban_core::domain::any_case;
use mocban_pages::report_page;
use mocban_pages::review::Language;
use mocban_project::files;
use mocban_project::report::{self, RenderedReport, ReportOptions};
use mocban_project::{ExitCode, ProjectResult, Refusal};
use mocban_report::{Report, ReportFormat, quality_gate, render, summary, with_checksum};
use mocban_results::IntervalMethod;

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
    /// Language of the HTML page, en or vi [default: en]
    #[arg(long)]
    pub(crate) lang: Option<Language>,
    /// Confidence intervals of Acc: wilson, or exact (Clopper-Pearson)
    #[arg(long, value_name = "METHOD", default_value = "wilson", value_parser = any_case::<IntervalMethod>)]
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
    /// Exit with code 21 unless every block and pair is done and every result is judged pass or fail
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
    let output = args.output.as_deref();
    let format = match args.format {
        Some(format) => format,
        None => output.map_or(Ok(ReportFormat::Text), format_of_file)?,
    };
    let format = if context.global.json {
        ReportFormat::Json
    } else {
        format
    };
    if args.compare.is_some() && !matches!(format, ReportFormat::Text | ReportFormat::Json) {
        let text = format!("--compare needs the format text or json, not {format}");
        return Err(Refusal::Usage(text).into());
    }
    let language = args.lang.unwrap_or(Language::English);
    if language != Language::English && format != ReportFormat::Html {
        let text = format!(
            "--lang {} needs the format html, not {format}",
            language.name()
        );
        return Err(Refusal::Usage(text).into());
    }
    let options = ReportOptions {
        format,
        interval: args.ci,
        with_times: args.with_times,
    };
    let (location, terminal) = (&context.location, Terminal::new(context));
    let RenderedReport {
        report,
        mut text,
        is_complete,
    } = report::report(options, output, location, &terminal).await?;
    text = report_page(text, language);
    if let Some(other) = &args.compare {
        text = compared(&report, (&text, format), other, context).await?;
    }
    match output {
        Some(path) => {
            let file = with_checksum(&text);
            files::write_output(path, file.as_bytes(), args.allow_missing || is_complete)?;
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

/// Returns the format that belongs to the extension of a file, or text for an unknown extension. Refuses formats that are
/// not written.
fn format_of_file(path: &Path) -> Result<ReportFormat, Refusal> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    Ok(match &*extension.to_ascii_lowercase() {
        "json" => ReportFormat::Json,
        "csv" => ReportFormat::Csv,
        "md" | "markdown" => ReportFormat::Markdown,
        "tex" => ReportFormat::Latex,
        "html" | "htm" => ReportFormat::Html,
        "pdf" | "doc" | "docx" | "odt" | "xls" | "xlsx" | "ods" | "png" | "jpg" | "jpeg"
        | "tif" | "tiff" => {
            let text = format!(
                "a report cannot be written as {extension}; html can be printed to PDF by a browser, and spreadsheet \
                 programs open csv"
            );
            return Err(Refusal::Usage(text));
        }
        _ => ReportFormat::Text,
    })
}

/// Returns this project's report with another one, as text or JSON.
async fn compared(
    here: &Report,
    (text, format): (&str, ReportFormat),
    other: &Path,
    context: &Context,
) -> ProjectResult<String> {
    let there = report::read(&context.location.at(other)).await?;
    let there = there.with_interval(here.interval);
    let names = [&*context.location.dir, other].map(|dir| dir.display().to_string());
    if format == ReportFormat::Json {
        let mut value = serde_json::to_value(here)?;
        value["compared_with"] = json!({"project": names[1], "report": there});
        return Ok(serde_json::to_string_pretty(&value)?);
    }
    let tables = side_by_side(here, &there, [&names[0], &names[1]]);
    Ok(format!("{text}\n{tables}"))
}

/// Prints the beginning of the report to stdout, or with `--json` the whole report.
pub(crate) async fn print_summary(context: &Context) -> ProjectResult<()> {
    let report = report::read(&context.location).await?;
    if context.global.json {
        streams::print_json_text(&render(&report, ReportFormat::Json))?;
    } else {
        streams::print(&summary(&report))?;
    }
    Ok(())
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
