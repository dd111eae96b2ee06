//! Checks after a failure that the folders of the project and of its inputs are there.

use super::compute_thread::run_blocking;
use super::error::RunError;
use super::run_context::RunContext;

/// Checks that the project's directory was not renamed, and that the roots of inputs with these stored paths are not
/// empty. A disk that is not mounted ends the run, because otherwise it would fail every pair.
///
/// # Errors
/// Returns an error if a folder is missing or a root is empty.
pub(super) async fn check_folders<const N: usize>(
    context: &RunContext,
    inputs: [String; N],
) -> Result<(), RunError> {
    let project = context.project.clone();
    run_blocking(move || {
        project.check_in_place()?;
        let Some(storage) = project.storage() else {
            return Ok(());
        };
        let mut inputs = inputs.iter();
        Ok(inputs.try_for_each(|input| storage.check_root_of(input))?)
    })
    .await
}
