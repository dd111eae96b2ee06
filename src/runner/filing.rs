//! Writing what stages gave to disk, on threads of their own: a core must not wait for a disk.

use std::io;
use std::time::Duration;

use crate::breakpoint::{self, Point};
use crate::domain::{PairName, Stage};
use crate::store::{ArtifactError, NewArtifact, Project};

/// Has a stage's files on disk for good when it returns.
///
/// # Errors
/// When the disk refuses, or has not answered within the limit.
pub(super) async fn file(
    project: &Project,
    (pair, stage): (&PairName, Stage),
    files: Vec<NewArtifact>,
    limit: Duration,
) -> Result<(), ArtifactError> {
    let (to, name) = (project.clone(), pair.clone());
    let writing = tokio::task::spawn_blocking(move || {
        let written = || breakpoint::reach(stage, Point::Written, Some(&name));
        to.write_artifacts_telling(&files, &written)?;
        breakpoint::reach(stage, Point::Filed, Some(&name));
        Ok(())
    });
    match tokio::time::timeout(limit, writing).await {
        Ok(Ok(written)) => written,
        Ok(Err(panic)) => std::panic::resume_unwind(panic.into_panic()),
        Err(_) => {
            let text = format!("the disk took longer than {} s", limit.as_secs_f64());
            Err(ArtifactError::Io {
                path: project.artifacts_dir(),
                source: io::Error::new(io::ErrorKind::TimedOut, text),
            })
        }
    }
}
