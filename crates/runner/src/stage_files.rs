//! Writes the files of computed stages durably, before their rows are stored: each file in the project's folder, or all
//! files of a pair in one pack in an object store.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::time::{Instant, timeout_at};

use super::blocking::run_blocking;
use super::error::RunError;
use super::pair_stage::ComputedStage;
use super::run_context::RunContext;
use super::stop::StopLevel;
use mocban_catalog::StageCheckpoint;
use mocban_core::domain::{PairName, Stage};
use mocban_store::{ArtifactError, NewArtifact};
use mocban_system::failpoint::{self, Point};
use mocban_system::platform::sleep_active;

/// A pack waits this long for the next stages of its pair, so that a pair is usually one object.
const PACK_WAIT: Duration = Duration::from_secs(2);

/// Pause before an unavailable object store is tried again.
const STORE_PAUSE: Duration = Duration::from_secs(1);

/// An unavailable object store is waited for at least this long, also after a stage that took almost as long as it may.
/// Much shorter than the time after a deadline when another process recovers the lease.
const SHORTEST_STORE_WAIT: Duration = Duration::from_secs(10);

/// After a stop request, a write to an object store is given up once it has lasted this long.
const LONGEST_WRITE_AFTER_STOP: Duration = Duration::from_secs(5);

/// After a stop request, a write is given at least this long.
const SHORTEST_WRITE_AFTER_STOP: Duration = Duration::from_secs(1);

/// Why the files of a stage were not written, although the run goes on.
pub(super) enum Unwritten {
    /// A stop request, or an unavailable object store.
    Interrupted,
    /// Something else has the name of a file of this stage.
    Blocked(Box<StageCheckpoint>, ArtifactError),
}

/// Writes the files of `first` and of the stages that have arrived meanwhile. Returns the rows of the written stages,
/// and why a stage is unwritten, if one is.
pub(super) async fn write_batch(
    context: &RunContext,
    pair: &PairName,
    first: ComputedStage,
    stages: &mut mpsc::UnboundedReceiver<ComputedStage>,
) -> Result<(Vec<StageCheckpoint>, Option<Unwritten>), RunError> {
    if context.project.has_packs() {
        return write_pack(context, pair, first, stages).await;
    }
    let (mut batch, mut next) = (Vec::new(), Some(first));
    while let Some((mut stage, files)) = next {
        stage.write_began = std::time::Instant::now();
        match write_files(context, pair, stage.stage, files).await {
            Ok(true) => {}
            Ok(false) => return Ok((batch, Some(Unwritten::Interrupted))),
            Err(error @ ArtifactError::Blocked { .. }) => {
                let blocked = Unwritten::Blocked(Box::new(stage), error);
                return Ok((batch, Some(blocked)));
            }
            Err(error) => return Err(error.into()),
        }
        batch.push(with_times(context, stage));
        next = stages.try_recv().ok();
    }
    Ok((batch, None))
}

/// Sets the times of a row. Must be called after the slow write, because the lease must still be valid at this point.
fn with_times(context: &RunContext, stage: StageCheckpoint) -> StageCheckpoint {
    StageCheckpoint {
        at: context.clock.now(),
        next_deadline: context.deadline(),
        alive_since: context.alive_since(),
        ..stage
    }
}

/// Writes a stage's files, each under its own name.
///
/// # Errors
/// Returns an error if the disk fails, or does not finish within the time limit.
async fn write_files(
    context: &RunContext,
    pair: &PairName,
    stage: Stage,
    files: Vec<NewArtifact>,
) -> Result<bool, ArtifactError> {
    let (project, name) = (context.project.clone(), pair.clone());
    let writing = move || {
        let on_written = || failpoint::hit(stage, Point::Written, Some(&name));
        project.write_artifacts(&files, &on_written)?;
        failpoint::hit(stage, Point::Synced, Some(&name));
        Ok(())
    };
    Ok(finished(context, writing).await?.is_some())
}

/// Writes the files of `first`, and of the stages that arrive within [`PACK_WAIT`] or until the pair's last stage, as
/// one object.
async fn write_pack(
    context: &RunContext,
    pair: &PairName,
    first: ComputedStage,
    stages: &mut mpsc::UnboundedReceiver<ComputedStage>,
) -> Result<(Vec<StageCheckpoint>, Option<Unwritten>), RunError> {
    let deadline = Instant::now() + PACK_WAIT * failpoint::time_scale("MOCBAN_STORE_FACTOR");
    let (mut batch, mut files) = (vec![first.0], first.1);
    let mut counts = vec![files.len()];
    while let Ok(Some((stage, more))) = timeout_at(deadline, stages.recv()).await {
        batch.push(stage);
        counts.push(more.len());
        files.extend(more);
    }
    for stage in &mut batch {
        stage.write_began = std::time::Instant::now();
    }
    let (project, name) = (context.project.clone(), pair.clone());
    let last = batch[batch.len() - 1].stage;
    let files = Arc::new(files);
    let writing = {
        let files = Arc::clone(&files);
        move || {
            failpoint::hit(last, Point::Written, Some(&name));
            let locations = project.write_pack(&files)?;
            failpoint::hit(last, Point::Synced, Some(&name));
            Ok(locations)
        }
    };
    let computed = Duration::from_millis(batch.iter().map(|stage| stage.ms).sum());
    let longest = context.stage_timeout.saturating_sub(computed);
    let longest = longest.max(SHORTEST_STORE_WAIT);
    let Some(locations) = stored_in_bucket(context, writing, longest).await? else {
        return Ok((Vec::new(), Some(Unwritten::Interrupted)));
    };
    let mut located = files.iter().zip(locations);
    for (stage, count) in batch.iter_mut().zip(counts) {
        for (file, location) in located.by_ref().take(count) {
            if let Some(artifact) = stage.files.get_mut(file.role()) {
                artifact.pack = Some(location);
            }
        }
    }
    let batch = batch.into_iter().map(|stage| with_times(context, stage));
    Ok((batch.collect(), None))
}

/// Runs `writing` on a thread for blocking calls, again and again while the object store is unavailable. Returns `None`
/// if nothing is stored within `longest`, before another process considers the lease overdue and blames the pair. After a
/// stop request, it also returns `None` if the write lasts too long, or at once if the stop is immediate.
///
/// # Errors
/// Returns the error of `writing` unless the store is unavailable.
async fn stored_in_bucket<T: Send + 'static>(
    context: &RunContext,
    writing: impl Fn() -> Result<T, ArtifactError> + Clone + Send + 'static,
    longest: Duration,
) -> Result<Option<T>, ArtifactError> {
    let begun = Instant::now();
    let storing = async {
        let mut warned = false;
        loop {
            match run_blocking(writing.clone()).await {
                Err(error) if error.is_unavailable() => {
                    if !warned {
                        tracing::warn!("{error}; waiting for it to store results");
                    }
                    warned = true;
                    tokio::time::sleep(STORE_PAUSE).await;
                }
                outcome => return outcome.map(Some),
            }
        }
    };
    let gave_up = async {
        context.stop.reached(StopLevel::Drain).await;
        let first = Instant::now() + SHORTEST_WRITE_AFTER_STOP;
        tokio::time::sleep_until(first.max(begun + LONGEST_WRITE_AFTER_STOP)).await;
    };
    tokio::select! {
        biased;
        outcome = storing => outcome,
        () = context.stop.reached(StopLevel::Now) => Ok(None),
        () = gave_up => Ok(None),
        () = sleep_active(longest) => {
            let seconds = longest.as_secs();
            tracing::warn!(
                "the results of a pair were not stored within {seconds} s; the pair is released and computed again. \
                 If the object store works but the network is slow, increase run.stage_timeout_s"
            );
            Ok(None)
        }
    }
}

/// Runs `writing` on a thread for blocking calls. Returns `None`, without waiting for the disk, if an immediate stop is
/// requested.
///
/// # Errors
/// Returns the error of `writing`, or an error if it takes longer than a stage may.
async fn finished<T: Send + 'static>(
    context: &RunContext,
    writing: impl FnOnce() -> Result<T, ArtifactError> + Send + 'static,
) -> Result<Option<T>, ArtifactError> {
    let timeout = context.stage_timeout;
    tokio::select! {
        biased;
        written = run_blocking(writing) => written.map(Some),
        () = context.stop.reached(StopLevel::Now) => Ok(None),
        () = sleep_active(timeout) => {
            let text = format!("writing took longer than {} s", timeout.as_secs_f64());
            Err(ArtifactError::Io {
                path: context.project.artifacts_place(),
                source: io::Error::new(io::ErrorKind::TimedOut, text),
            })
        }
    }
}
