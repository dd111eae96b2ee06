//! Writes the data of a demo while watching for signals.

use std::path::Path;

use crate::cli::input::signals;
use crate::cli::output::context::Context;
use mocban_demo::DatasetError;
use mocban_project::ProjectResult;
use mocban_project::demo_folder;
use mocban_runner::Stop;

/// Replaces the data of a demo. Returns `None` if a signal stopped the writing.
pub(crate) async fn replace_data<T: Send + 'static>(
    data: &Path,
    context: &Context,
    write: impl FnOnce(&Path, &Stop) -> Result<T, DatasetError> + Send + 'static,
) -> ProjectResult<Option<T>> {
    let stop = Stop::default();
    let signals = signals::watch(&stop)?;
    let replaced = demo_folder::replace_data(data, &stop, write).await;
    signals.abort();
    let Some((written, warning)) = replaced? else {
        return Ok(None);
    };
    if let Some(warning) = warning {
        context.warn(&warning);
    }
    Ok(Some(written))
}
