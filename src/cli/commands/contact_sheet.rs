//! `contact-sheet`: draws many pairs, or a whole block, on one PNG.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::block_sheet::{self, BlockSheetOptions};
use crate::cli::output::busy::Busy;
use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use mocban_core::domain::ThresholdMetric;
use mocban_core::raster::png_rgb8;
use mocban_export::{ContactSheet, ContactSheetOptions, ContactSheetOrder, draw_contact_sheet};
use mocban_project::files;
use mocban_project::selection;
use mocban_project::{ExitCode, ProjectResult, Refusal};

/// Arguments of `contact-sheet`.
#[derive(Debug, Args)]
pub(crate) struct ContactSheetArgs {
    /// Only these pairs [default: all]
    pub(crate) pairs: Vec<String>,
    /// Draw the page of this block with the boxes of its characters instead
    #[arg(long, value_name = "NAME", conflicts_with_all = ["pairs", "order", "limit", "columns"])]
    pub(crate) block: Option<String>,
    /// With `--block`: draw relief and ink over each other, to see where the registration is off
    #[arg(long, requires = "block", conflicts_with = "metric")]
    pub(crate) overlay: bool,
    /// The PNG to write [default: in the project, sheet.png, or for a block, page.png or overlay.png]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Metric whose results are drawn: `nl_ssim`, density, ensemble or relief [default: ensemble]
    #[arg(long)]
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

impl Default for ContactSheetArgs {
    fn default() -> Self {
        Self {
            pairs: Vec::new(),
            block: None,
            overlay: false,
            output: None,
            metric: None,
            order: ContactSheetOrder::Worst,
            limit: 60,
            columns: 5,
            allow_missing: false,
        }
    }
}

pub(crate) async fn contact_sheet(
    args: ContactSheetArgs,
    context: &Context,
) -> ProjectResult<ExitCode> {
    if let Some(block) = &args.block {
        let options = BlockSheetOptions {
            block,
            is_overlay: args.overlay,
            metric: args.metric,
            output: args.output.as_deref(),
        };
        return block_sheet::write(&options, context).await;
    }
    let (path, sheet) = write(&args, context).await?;
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

/// Maximum number of incomplete pairs that are named.
const MAX_WARNINGS: usize = 5;

/// Draws the sheet, writes it and returns its path.
///
/// # Errors
/// Returns an error if no pair to draw has a result of the metric, or if the catalog or the disk fails.
pub(crate) async fn write(
    args: &ContactSheetArgs,
    context: &Context,
) -> ProjectResult<(PathBuf, ContactSheet)> {
    let (project, catalog) = context.open_read_only().await?;
    let path = match &args.output {
        Some(path) => path.clone(),
        None => project.dir().join("sheet.png"),
    };
    files::refuse_used_file(&path, &project, &catalog).await?;
    let metric = args.metric.unwrap_or(ThresholdMetric::DEFAULT);
    let options = ContactSheetOptions {
        metric,
        pairs: selection::some_or_all(&catalog, &args.pairs).await?,
        order: args.order,
        limit: usize::from(args.limit),
        columns: usize::from(args.columns),
        limits: context.settings()?.config.limits.image,
    };
    let busy = Busy::start(context, "drawing the contact sheet");
    let sheet = draw_contact_sheet(&catalog, &project, options).await;
    drop(busy);
    let sheet = sheet?;
    context.warn_about_set_apart(&sheet.set_apart);
    catalog.close().await;
    if sheet.shown == 0 {
        let text = format!("no pair has a result of {metric} yet, so there is nothing to draw");
        return Err(Refusal::NothingSelected(text).into());
    }
    for (pair, why) in sheet.problems.iter().take(MAX_WARNINGS) {
        context.warn(&format!("{pair} is not drawn completely: {why}"));
    }
    let more = sheet.problems.len().saturating_sub(MAX_WARNINGS);
    if more > 0 {
        context.warn(&format!(
            "{more} more are not drawn completely; `check` lists all missing files"
        ));
    }
    let is_complete = args.allow_missing || sheet.problems.is_empty();
    let written = files::write_output(&path, &png_rgb8(&sheet.picture), is_complete);
    files::or_elsewhere(written, args.output.as_deref())?;
    Ok((path, sheet))
}
