//! `contact-sheet --block`: draws the page of a block with boxes, or relief and ink over each other.

use std::path::Path;

use serde_json::json;

use crate::cli::output::busy::Busy;
use crate::cli::output::context::Context;
use crate::cli::output::table::count;
use mocban_catalog::Catalog;
use mocban_core::domain::ThresholdMetric;
use mocban_core::raster::png_rgb8;
use mocban_export::block_view::{BlockView, BlockViewError};
use mocban_project::error::TaskStopped;
use mocban_project::files::{self, input_file_limits};
use mocban_project::selection;
use mocban_project::{ExitCode, ProjectResult, Refusal};
use mocban_store::Project;

/// What to draw of a block, and where to.
#[derive(Debug)]
pub(crate) struct BlockSheetOptions<'a> {
    /// The block as the user typed it.
    pub(crate) block: &'a str,
    /// Whether to draw relief and ink over each other.
    pub(crate) is_overlay: bool,
    /// The metric whose results are shown, if one was asked for.
    pub(crate) metric: Option<ThresholdMetric>,
    /// The file to write.
    pub(crate) output: Option<&'a Path>,
}

/// Draws a picture of a block and writes it.
///
/// # Errors
/// Returns an error if the block does not exist or is not aligned, or if the catalog or the disk fails.
pub(crate) async fn write(
    options: &BlockSheetOptions<'_>,
    context: &Context,
) -> ProjectResult<ExitCode> {
    let (project, catalog) = context.open_read_only().await?;
    let default = ["page.png", "overlay.png"][usize::from(options.is_overlay)];
    let given = options.output.map(Path::to_owned);
    let path = given.unwrap_or_else(|| project.dir().join(default));
    files::refuse_used_file(&path, &project, &catalog).await?;
    let busy = Busy::start(context, "drawing the page");
    let drawn = draw(options, &project, &catalog, context).await;
    drop(busy);
    let (png, characters) = drawn?;
    catalog.close().await;
    files::or_elsewhere(files::write_output(&path, &png, true), options.output)?;
    report(&path, characters, context)?;
    Ok(ExitCode::Done)
}

/// Reads and draws a block. Returns the PNG and the number of characters.
async fn draw(
    options: &BlockSheetOptions<'_>,
    project: &Project,
    catalog: &Catalog,
    context: &Context,
) -> ProjectResult<(Vec<u8>, usize)> {
    let view = read(options.block, options.metric, project, catalog, context).await?;
    let is_overlay = options.is_overlay;
    let draw = move || {
        let picture = if is_overlay {
            view.draw_overlay()
        } else {
            view.draw_boxes()
        };
        (png_rgb8(&picture), view.characters.len())
    };
    Ok(tokio::task::spawn_blocking(draw)
        .await
        .map_err(TaskStopped)?)
}

/// Reads a block by the id that the user typed.
///
/// # Errors
/// Returns an error if the block does not exist, is not aligned or has no result of the metric that was asked for, or if a
/// file or the catalog cannot be read.
pub(crate) async fn read(
    typed: &str,
    metric: Option<ThresholdMetric>,
    project: &Project,
    catalog: &Catalog,
    context: &Context,
) -> ProjectResult<BlockView> {
    let name = selection::existing_block(catalog, typed).await?;
    let limits = input_file_limits(&context.settings()?.config);
    match BlockView::read(catalog, project, &name, metric, limits).await {
        Ok(view) => Ok(view),
        Err(error @ (BlockViewError::NotAligned { .. } | BlockViewError::NoResult { .. })) => {
            Err(Refusal::NothingSelected(error.to_string()).into())
        }
        Err(error) => Err(error.into()),
    }
}

fn report(path: &Path, characters: usize, context: &Context) -> ProjectResult<()> {
    context.print_json(&json!({"schema": 1, "file": path, "characters": characters}))?;
    let number = count(characters as u64, "character");
    context.info(&format!("{number} on {}", path.display()));
    Ok(())
}
