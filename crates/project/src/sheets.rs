//! Draws many pairs, or a whole block, on one PNG.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::blocking::blocking;
use crate::error::ProjectResult;
use crate::events::{Listener, LongWork, warn, warn_about_set_apart};
use crate::exit::Refusal;
use crate::files::{self, HEAD_BYTES};
use crate::location::Location;
use crate::own_files::{changed_output, refuse_foreign_file, refuse_used_file};
use crate::selection;
use crate::status::all_retired;
use mocban_catalog::Catalog;
use mocban_core::domain::{ContentHash, ThresholdMetric};
use mocban_core::raster::{Grid, png_rgb8_of, split_png_text, with_png_text};
use mocban_export::block_view::BlockView;
use mocban_export::{ContactSheet, ContactSheetOptions, draw_contact_sheet};
use mocban_store::{Project, open_regular};

/// What the pictures name as their program, and what an earlier one is recognized by.
const SOFTWARE: &str = "mocban contact-sheet";

/// The text chunk with the hash of all other bytes.
const CHECKSUM: &str = "Checksum";

/// Encodes a picture of this module.
fn sheet_png(picture: &Grid<[u8; 3]>) -> Vec<u8> {
    let png = png_rgb8_of(picture, SOFTWARE);
    with_png_text(&png, CHECKSUM, &ContentHash::of(&png).to_hex())
}

/// Refuses to write over a file that is no picture of this module, or that somebody changed. Pictures of earlier versions have
/// no checksum and are replaced.
fn refuse_other_file(path: &Path) -> Result<(), Refusal> {
    refuse_foreign_file(path, "a contact sheet of this program", is_sheet)?;
    if is_changed(path) == Some(true) {
        return Err(changed_output(path, "a contact sheet"));
    }
    Ok(())
}

/// Returns whether a picture has other bytes than were written. `None` if it has no checksum.
fn is_changed(path: &Path) -> Option<bool> {
    let (mut file, _) = open_regular(path).ok()?;
    let mut head = Vec::new();
    let limited = file.by_ref().take(HEAD_BYTES as u64).read_to_end(&mut head);
    limited.ok()?;
    let (without, stored) = split_png_text(&head, CHECKSUM)?;
    let is_usual = with_png_text(&without, CHECKSUM, &stored) == head;
    let hash = ContentHash::of_source(without.as_slice().chain(file));
    Some(!is_usual || !hash.is_ok_and(|hash| hash.to_hex() == stored))
}

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
    refuse_other_file(&path)?;
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
    let written = files::write_output(&path, &sheet_png(&sheet.picture), is_complete);
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
    refuse_other_file(&path)?;
    let work = LongWork::begin(listener, "drawing the page");
    let view = block_view(block, metric, &project, &catalog, location).await?;
    let draw = move || {
        let picture = if is_overlay {
            view.draw_overlay()
        } else {
            view.draw_boxes()
        };
        (sheet_png(&picture), view.block.characters.len())
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
    use super::{SOFTWARE, is_changed, is_sheet, refuse_other_file, sheet_png};
    use mocban_core::raster::{Grid, png_rgb8, png_rgb8_of};

    #[test]
    fn a_sheet_is_recognized_and_a_page_is_not() {
        let grid = Grid::new(3, 2, [250, 240, 9]);
        assert!(is_sheet(&sheet_png(&grid)));
        assert!(is_sheet(&png_rgb8_of(&grid, SOFTWARE)));
        assert!(!is_sheet(&png_rgb8(&grid)));
        assert!(!is_sheet(SOFTWARE.as_bytes()));
    }

    #[test]
    fn a_change_at_any_byte_of_a_sheet_is_found() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("sheet.png");
        let grid = Grid::from_fn(90, 60, |x, y| [(x * y % 251) as u8, (x ^ y) as u8, 9]);
        let png = sheet_png(&grid);
        assert_eq!(png, sheet_png(&grid));
        std::fs::write(&path, &png).expect("written");
        assert_eq!(is_changed(&path), Some(false));
        refuse_other_file(&path).expect("as it was written");
        for at in (0..png.len()).step_by(png.len() / 50) {
            let mut edited = png.clone();
            edited[at] ^= 1;
            std::fs::write(&path, &edited).expect("written");
            assert_ne!(is_changed(&path), Some(false), "byte {at}");
        }
        std::fs::write(&path, [&png[..], b"more"].concat()).expect("written");
        let refused = refuse_other_file(&path).expect_err("longer").to_string();
        let said = "sheet.png is a contact sheet that somebody changed after it was written";
        assert!(refused.contains(said), "{refused}");
        std::fs::write(&path, png_rgb8_of(&grid, SOFTWARE)).expect("written");
        assert_eq!(is_changed(&path), None);
        refuse_other_file(&path).expect("a sheet of an earlier version");
    }
}
