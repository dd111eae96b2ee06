//! Values of tags that decide how a page is read.

use crate::domain::FileKind;
use crate::raster::decode::error::{DecodeError, broken, damaged};
use crate::raster::decode::tags::{TagDirectory, TagValues};

/// Refuses a file for a reason.
pub(super) fn refuse<T>(reason: &str) -> Result<T, DecodeError> {
    Err(broken(FileKind::Tiff, reason))
}

/// Returns the values of a tag.
///
/// # Errors
/// Returns an error if the page has the tag, but its values are not in the file.
pub(super) fn values<'b>(
    page: &TagDirectory<'b>,
    tag: u64,
) -> Result<Option<TagValues<'b>>, DecodeError> {
    match page.values(tag) {
        None if page.has(tag) => {
            let found = format!("unreadable values of its tag {tag}");
            Err(damaged(FileKind::Tiff, &found))
        }
        values => Ok(values),
    }
}

/// Returns the first value of a tag, or `default` if the page does not have it.
pub(super) fn number(page: &TagDirectory<'_>, tag: u64, default: u64) -> Result<u64, DecodeError> {
    let value = values(page, tag)?.and_then(|values| values.get(0));
    match value {
        None if page.has(tag) => refuse(&format!("its tag {tag} is not a whole number")),
        value => Ok(value.unwrap_or(default)),
    }
}

/// Returns the value that all samples have in a tag, or `default` if the page does not have it.
pub(super) fn common(
    page: &TagDirectory<'_>,
    tag: u64,
    what: &str,
    default: u64,
) -> Result<u64, DecodeError> {
    let first = number(page, tag, default)?;
    let all = values(page, tag)?;
    if let Some(values) = all.filter(|values| values.iter().any(|other| other != Some(first))) {
        let listed = values
            .iter()
            .take(8)
            .flatten()
            .map(|value| value.to_string());
        let listed = listed.collect::<Vec<_>>().join(", ");
        return refuse(&format!(
            "its samples have different {what} ({listed}); save it with 8 or 16 bits per sample"
        ));
    }
    Ok(first)
}
