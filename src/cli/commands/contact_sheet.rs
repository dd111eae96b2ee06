//! `contact-sheet`: draws many pairs, or a whole block, on one PNG.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use crate::cli::output::terminal::Terminal;
use mocban_core::domain::ThresholdMetric;
use mocban_export::{ContactSheetOptions, ContactSheetOrder};
use mocban_project::sheets::{self, block_sheet};
use mocban_project::verdict_words;
use mocban_project::{ExitCode, ProjectResult};

/// Arguments of `contact-sheet`.
#[derive(Debug, Args)]
pub(crate) struct ContactSheetArgs {
    /// Only these pairs, or the pairs of these blocks [default: all]
    pub(crate) pairs: Vec<String>,
    /// Draw the page of this block with the boxes of its characters instead
    #[arg(long, value_name = "NAME", conflicts_with_all = ["pairs", "order", "limit", "columns"])]
    pub(crate) block: Option<String>,
    /// With `--block`: draw relief and ink over each other, to see where the registration is off
    #[arg(long, requires = "block", conflicts_with = "metric")]
    pub(crate) overlay: bool,
    /// The PNG to write [default: in the project, sheet.png, or for a block, page-NAME-boxes.png or page-NAME-overlay.png]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Metric whose results are drawn: `nl_ssim`, density, ensemble or relief [default: ensemble]
    #[arg(long, value_parser = verdict_words::metric)]
    pub(crate) metric: Option<ThresholdMetric>,
    /// Order of the pairs: worst, score, margin, confidence (least confident first) or name
    #[arg(long, default_value = "worst")]
    pub(crate) order: ContactSheetOrder,
    /// Maximum number of pairs
    #[arg(long, value_name = "N", default_value = "60", value_parser = clap::value_parser!(u16).range(1..=600))]
    pub(crate) limit: u16,
    /// Pairs per row
    #[arg(long, value_name = "N", default_value = "5", value_parser = clap::value_parser!(u16).range(1..=12))]
    pub(crate) columns: u16,
    /// Replace an earlier file even if the new one lacks images
    #[arg(long)]
    pub(crate) allow_missing: bool,
}

pub(crate) async fn contact_sheet(
    args: ContactSheetArgs,
    context: &Context,
) -> ProjectResult<ExitCode> {
    let (location, terminal) = (&context.location, Terminal::new(context));
    let output = args.output.as_deref();
    if let Some(block) = &args.block {
        let drawn = block_sheet(
            block,
            args.overlay,
            args.metric,
            output,
            location,
            &terminal,
        );
        let (path, characters) = drawn.await?;
        context.print_json(&json!({"schema": 1, "file": path, "characters": characters}))?;
        let number = count(characters as u64, "character");
        context.info(&format!("{number} on {}", path.display()));
        return Ok(ExitCode::Done);
    }
    let options = ContactSheetOptions {
        metric: args.metric.unwrap_or(ThresholdMetric::DEFAULT),
        order: args.order,
        limit: usize::from(args.limit),
        columns: usize::from(args.columns),
        ..ContactSheetOptions::default()
    };
    let missing = args.allow_missing;
    let drawn = sheets::contact_sheet(&args.pairs, options, output, missing, location, &terminal);
    let (path, sheet) = drawn.await?;
    context
        .print_json(&json!({"schema": 1, "file": path, "shown": sheet.shown, "of": sheet.of}))?;
    context.info(&format!(
        "{} of {} on {}",
        count(sheet.shown as u64, "pair"),
        sheet.of,
        path.display()
    ));
    Ok(if sheet.problems.is_empty() {
        ExitCode::Done
    } else {
        ExitCode::SomeFailed
    })
}
