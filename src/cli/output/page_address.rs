//! Announces the address of a page, and opens the page in a browser.

use serde_json::json;

use super::context::Context;
use super::streams;
use crate::cli::input::browser::open;
use mocban_project::ProjectResult;

/// Prints the address of a page on stdout.
pub(crate) fn print_address(url: &str, context: &Context) -> ProjectResult<()> {
    if context.global.json {
        streams::print_json_text(&json!({"schema": 1, "url": url}).to_string())?;
    } else {
        streams::print(url)?;
    }
    Ok(())
}

/// Opens a page in a browser, unless `no_open` or a script asks for the address alone. Returns a temporary file that
/// redirects to the page. The file must exist until the browser has read it.
pub(crate) fn open_page(
    url: &str,
    no_open: bool,
    context: &Context,
) -> Option<tempfile::NamedTempFile> {
    let is_for_script = no_open || context.global.json || context.global.quiet;
    if is_for_script { None } else { open(url) }
}
