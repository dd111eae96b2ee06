//! Writing what stages gave to disk, on threads of their own: a core must not wait for a disk.

use std::io;
use std::time::Duration;

use super::stop::{Stop, StopLevel};
use crate::domain::{PairName, Stage};
use crate::failpoint::{self, Point};
use crate::store::{ArtifactError, NewArtifact, Project};

/// Has a stage's files on disk for good when it returns; `false` when the run is to stop now, which waits for no disk.
///
/// # Errors
/// When the disk refuses, or has not answered within the limit.
pub(super) async fn file(
    project: &Project,
    (pair, stage): (&PairName, Stage),
    files: Vec<NewArtifact>,
    limit: Duration,
    stop: &Stop,
) -> Result<bool, ArtifactError> {
    let (to, name) = (project.clone(), pair.clone());
    let writing = tokio::task::spawn_blocking(move || {
        let written = || failpoint::hit(stage, Point::Written, Some(&name));
        to.write_artifacts_with(&files, &written)?;
        failpoint::hit(stage, Point::Filed, Some(&name));
        Ok(true)
    });
    tokio::select! {
        biased;
        written = writing => match written {
            Ok(written) => written,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        },
        () = stop.reached(StopLevel::Now) => Ok(false),
        () = tokio::time::sleep(limit) => {
            let text = format!("the disk took longer than {} s", limit.as_secs_f64());
            Err(ArtifactError::Io {
                path: project.artifacts_dir(),
                source: io::Error::new(io::ErrorKind::TimedOut, text),
            })
        }
    }
}
