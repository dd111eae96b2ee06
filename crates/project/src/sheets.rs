//! Draws many pairs, or a whole block, on one PNG.

use std::path::{Path, PathBuf};

use crate::blocking::blocking;
use crate::error::ProjectResult;
use crate::events::{Listener, LongWork, warn, warn_about_set_apart};
use crate::exit::Refusal;
use crate::files;
use crate::location::Location;
use crate::own_files::{refuse_foreign_file, refuse_used_file};
use crate::selection;
use crate::status::all_retired;
use mocban_catalog::Catalog;
use mocban_core::domain::ThresholdMetric;
use mocban_core::raster::png_rgb8_of;
use mocban_export::block_view::BlockView;
use mocban_export::{ContactSheet, ContactSheetOptions, draw_contact_sheet};
use mocban_store::Project;

/// What the pictures name as their program, and what an earlier one is recognized by.
const SOFTWARE: &str = "mocban contact-sheet";

/// Returns whether the first bytes of a file are those of a picture of this module.
fn is_sheet(bytes: &[u8]) -> bool {
    let mut parts = bytes.windows(SOFTWARE.len());
    bytes.starts_with(b"\x89PNG") && parts.any(|part| part == SOFTWARE.as_bytes())
}

/// Draws the pairs with these ids, or all, and writes the sheet. By default, it is `sheet.png` in the project. Returns its
/// path too. A sheet that lacks images replaces an earlier one only if `allow_missing` is set.
///
/// # Errors
/// Returns an error if no pair to draw has a result of the metric, or if the catalog or the disk fails.
pub async fn contact_sheet(
    pairs: &[String],
    options: ContactSheetOptions,
    output: Option<&Path>,
    allow_missing: bool,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<(PathBuf, ContactSheet)> {
    let (project, catalog) = location.open_read_only().await?;
    let path = output.map_or_else(|| project.dir().join("sheet.png"), Path::to_owned);
    refuse_used_file(&path, &project, &catalog).await?;
    files::require_png(output)?;
    refuse_foreign_file(&path, "a contact sheet of this program", is_sheet)?;
    let metric = options.metric;
    let options = ContactSheetOptions {
        pairs: selection::some_or_all(&catalog, pairs).await?,
        limits: location.settings()?.config.limits.image,
        ..options
    };
    let work = LongWork::begin(listener, "drawing the contact sheet");
    let sheet = draw_contact_sheet(&catalog, &project, options).await;
    drop(work);
    let sheet = sheet?;
    warn_about_set_apart(listener, &sheet.set_apart);
    let retired = all_retired(&catalog).await?;
    catalog.close().await;
    if sheet.shown == 0 {
        let text = match retired {
            Some(retired) => format!("there is nothing to draw: {retired}"),
            None => format!("no pair has a result of {metric} yet, so there is nothing to draw"),
        };
        return Err(Refusal::NothingSelected(text).into());
    }
    for (pair, why) in &sheet.problems {
        let text = format!("{pair} is not drawn completely: {why}");
        warn(listener, text);
    }
    let is_complete = allow_missing || sheet.problems.is_empty();
    let written = files::write_output(&path, &png_rgb8_of(&sheet.picture, SOFTWARE), is_complete);
    files::or_elsewhere(written, output)?;
    Ok((path, sheet))
}

/// Draws the page of a block with the boxes of its characters, or relief and ink over each other, and writes the picture. By
/// default, the file is `page-NAME-boxes.png` or `page-NAME-overlay.png` in the project. Returns its path and the number of
/// characters.
///
/// # Errors
/// Returns an error if the block does not exist or is not aligned, or if the catalog or the disk fails.
pub async fn block_sheet(
    block: &str,
    is_overlay: bool,
    metric: Option<ThresholdMetric>,
    output: Option<&Path>,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<(PathBuf, usize)> {
    let (project, catalog) = location.open_read_only().await?;
    let name = selection::existing_block(&catalog, block).await?;
    let kind = ["boxes", "overlay"][usize::from(is_overlay)];
    // A scan of the page may be `page-NAME.png`.
    let default = || format!("page-{}-{kind}.png", name.as_pair().file_name());
    let path = output.map_or_else(|| project.dir().join(default()), Path::to_owned);
    refuse_used_file(&path, &project, &catalog).await?;
    files::require_png(output)?;
    refuse_foreign_file(&path, "a contact sheet of this program", is_sheet)?;
    let work = LongWork::begin(listener, "drawing the page");
    let view = block_view(block, metric, &project, &catalog, location).await?;
    let draw = move || {
        let picture = if is_overlay {
            view.draw_overlay()
        } else {
            view.draw_boxes()
        };
        (png_rgb8_of(&picture, SOFTWARE), view.characters.len())
    };
    let drawn = blocking(draw).await;
    drop(work);
    let (png, characters) = drawn?;
    catalog.close().await;
    files::or_elsewhere(files::write_output(&path, &png, true), output)?;
    Ok((path, characters))
}

/// Reads a block by its id.
pub async fn block_view(
    block: &str,
    metric: Option<ThresholdMetric>,
    project: &Project,
    catalog: &Catalog,
    location: &Location,
) -> ProjectResult<BlockView> {
    let name = selection::existing_block(catalog, block).await?;
    let limits = location.settings()?.config.limits;
    Ok(BlockView::read(catalog, project, &name, metric, limits).await?)
}

#[cfg(test)]
mod tests {
    use super::{SOFTWARE, is_sheet};
    use mocban_core::raster::{Grid, png_rgb8, png_rgb8_of};

    #[test]
    fn a_sheet_is_recognized_and_a_page_is_not() {
        let grid = Grid::new(3, 2, [250, 240, 9]);
        assert!(is_sheet(&png_rgb8_of(&grid, SOFTWARE)));
        assert!(!is_sheet(&png_rgb8(&grid)));
        assert!(!is_sheet(SOFTWARE.as_bytes()));
    }
}
