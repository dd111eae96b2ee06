//! Checks after a failure that the folders of the project and of its inputs are there.

use std::path::PathBuf;
use std::time::Duration;

use super::blocking::run_blocking;
use super::error::RunError;
use super::input_reads::{ReadItem, ReadLimits, read_each};
use super::run_context::RunContext;
use super::stop::StopLevel;
use mocban_store::{Project, StorageError};

/// Longest time for looking at the folder of a root.
const MAX_TIME: Duration = Duration::from_secs(30);

/// Checks that the project's directory was not renamed, that the folder of artifacts can be read, and that the roots of inputs with these stored paths can be read
/// and are not empty. A disk that is not mounted ends the run, because otherwise it would fail every pair. A folder that
/// does not answer in time is not an error here.
///
/// # Errors
/// Returns an error if the project's directory or a root is missing, or a root is empty or cannot be read.
pub(super) async fn check_folders<const N: usize>(
    context: &RunContext,
    inputs: [String; N],
) -> Result<(), RunError> {
    let project = context.project.clone();
    run_blocking(move || {
        project.check_in_place()?;
        project.check_artifacts_folder()
    })
    .await?;
    if context.project.storage().is_none() {
        return Ok(());
    }
    let limits = ReadLimits {
        timeout: context.stage_timeout.min(MAX_TIME),
        stop: context.stop.clone(),
        until: StopLevel::Now,
    };
    let items = inputs.map(|stored| RootCheck {
        project: context.project.clone(),
        stored,
    });
    for outcome in read_each(items.into(), &limits).await.into_iter().flatten() {
        outcome?;
    }
    Ok(())
}

/// The root of an input with a stored path.
struct RootCheck {
    project: Project,
    stored: String,
}

impl ReadItem for RootCheck {
    type Output = Result<(), StorageError>;

    fn read(&self) -> Self::Output {
        let storage = self.project.storage();
        storage.map_or(Ok(()), |storage| storage.check_root_of(&self.stored))
    }

    fn path(&self) -> PathBuf {
        self.project.input(&self.stored).path().to_owned()
    }
}
