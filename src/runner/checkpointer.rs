//! Stores the stages of one pair under its lease, in order. A separate task does this, so that the compute thread does
//! not wait for the disk. The files of a stage are on the disk before the stage's row is stored. Stages that arrive
//! during a transaction share the next transaction. At its end, the task returns the lease.

use std::io;
use std::sync::Arc;

use tokio::sync::mpsc;
use tokio::task::JoinHandle;

use super::compute_thread::{ComputedStage, run_blocking, task_result};
use super::error::RunError;
use super::events::RunEvent;
use super::run_context::{PairEnd, PairReport, RunContext};
use super::stop::StopLevel;
use crate::catalog::{CheckpointOutcome, Lease, StageCheckpoint};
use crate::domain::{PairName, Stage};
use crate::failpoint::{self, Point};
use crate::store::{ArtifactError, NewArtifact};

/// The task that holds a pair's lease and stores its stages.
pub(super) struct Checkpointer {
    context: Arc<RunContext>,
    stages: mpsc::UnboundedSender<ComputedStage>,
    task: JoinHandle<Result<StoredStages, RunError>>,
}

/// Result of a checkpointer: the number of stored stages, and the lease if this process still holds it.
pub(super) struct StoredStages {
    lease: CheckpointOutcome,
    /// Number of stages stored.
    pub(super) stages: u64,
    /// `false` if an immediate stop left a stage unstored. A lost lease does not change this flag.
    is_complete: bool,
}

impl StoredStages {
    /// Returns the lease if this process still holds it and no stage was left unstored.
    ///
    /// # Errors
    /// Returns `self` if the lease is lost or ended with the pair's last stage, or if a stage was left unstored.
    pub(super) fn into_lease(self) -> Result<Lease, Self> {
        match self.lease {
            CheckpointOutcome::Lease(lease) if self.is_complete => Ok(lease),
            lease => Err(Self { lease, ..self }),
        }
    }

    /// Releases the lease if it is still held. Returns how the pair ended: `end`, unless the lease was lost or an
    /// immediate stop left a stage unstored.
    pub(super) async fn finish(self, context: &RunContext, end: PairEnd) -> PairReport {
        let end = match &self.lease {
            CheckpointOutcome::LeaseLost => PairEnd::LeaseLost,
            _ if self.is_complete => end,
            _ => PairEnd::Released,
        };
        let mut end = Ok(end);
        if let CheckpointOutcome::Lease(lease) = self.lease
            && let Err(error) = context.catalog.release(lease).await
        {
            end = Err(error.into());
        }
        let stages = self.stages;
        PairReport { end, stages }
    }
}

impl Checkpointer {
    /// Starts the task for a leased pair.
    pub(super) fn start(context: Arc<RunContext>, pair: PairName, lease: Lease) -> Self {
        let (sender, stages) = mpsc::unbounded_channel();
        let task = tokio::spawn(store_stages(Arc::clone(&context), pair, lease, stages));
        Self {
            context,
            stages: sender,
            task,
        }
    }

    /// Sends a computed stage to be stored. Returns `false` if the task has ended: the lease is lost, the disk or the
    /// catalog returned an error, or an immediate stop was requested.
    pub(super) fn store(&self, stage: ComputedStage) -> bool {
        self.stages.send(stage).is_ok()
    }

    /// Waits until the task has stored the sent stages. Meanwhile the catalog does not delay commits.
    pub(super) async fn settle(self) -> Result<StoredStages, RunError> {
        let _flush = self.context.catalog.waiting().await?;
        drop(self.stages);
        task_result(self.task.await)
    }

    /// Waits until the task has stored the sent stages, and releases the lease if it is still held. Returns how the
    /// pair ended.
    pub(super) async fn finish(self, end: PairEnd) -> PairReport {
        let context = Arc::clone(&self.context);
        let settled = if end == PairEnd::Done {
            // Nothing waits for the last stages of this pair, so their commit may be delayed.
            drop(self.stages);
            task_result(self.task.await)
        } else {
            self.settle().await
        };
        match settled {
            Ok(settled) => settled.finish(&context, end).await,
            Err(error) => PairReport::failed(error),
        }
    }
}

/// Stores stages as they arrive, until no more come or the lease is gone.
async fn store_stages(
    context: Arc<RunContext>,
    pair: PairName,
    lease: Lease,
    mut stages: mpsc::UnboundedReceiver<ComputedStage>,
) -> Result<StoredStages, RunError> {
    let (mut count, mut is_complete) = (0, true);
    let mut outcome = CheckpointOutcome::Lease(lease);
    // After a stage that was not stored, no later stage may be stored.
    while is_complete
        && matches!(outcome, CheckpointOutcome::Lease(_))
        && let Some(first) = stages.recv().await
    {
        let CheckpointOutcome::Lease(lease) = outcome else {
            break;
        };
        let batch;
        (batch, is_complete) = write_batch(&context, &pair, first, &mut stages).await?;
        let times: Vec<_> = batch.iter().map(|done| (done.stage, done.ms)).collect();
        outcome = context.catalog.checkpoint(lease, batch).await?;
        if !matches!(outcome, CheckpointOutcome::LeaseLost) {
            count += times.len() as u64;
            for (stage, ms) in times {
                report_stored(&context, pair.clone(), stage, ms);
            }
        }
    }
    Ok(StoredStages {
        lease: outcome,
        stages: count,
        is_complete,
    })
}

/// Writes the files of `first` and of the stages that have arrived meanwhile. Returns the rows of the written stages,
/// and `false` if an immediate stop left a stage unwritten.
async fn write_batch(
    context: &RunContext,
    pair: &PairName,
    first: ComputedStage,
    stages: &mut mpsc::UnboundedReceiver<ComputedStage>,
) -> Result<(Vec<StageCheckpoint>, bool), RunError> {
    let (mut batch, mut next) = (Vec::new(), Some(first));
    while let Some(stage) = next {
        match write_stage(context, pair, stage).await? {
            Some(done) => batch.push(done),
            None => return Ok((batch, false)),
        }
        next = stages.try_recv().ok();
    }
    Ok((batch, true))
}

/// Writes the files of a stage, and returns the row that names them. Returns `None` if the run must stop at once.
async fn write_stage(
    context: &RunContext,
    pair: &PairName,
    (stage, files): ComputedStage,
) -> Result<Option<StageCheckpoint>, RunError> {
    if !write_files(context, pair, stage.stage, files).await? {
        return Ok(None);
    }
    // Take the times after the slow write, because the lease must still be valid at this point.
    Ok(Some(StageCheckpoint {
        at: context.clock.now(),
        next_deadline: context.deadline(),
        alive_since: context.alive_since(),
        ..stage
    }))
}

/// Writes a stage's files durably, on a thread for blocking calls. If an immediate stop is requested, returns `false`
/// without waiting for the disk.
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
    let timeout = context.stage_timeout;
    let writing = run_blocking(move || {
        let on_written = || failpoint::hit(stage, Point::Written, Some(&name));
        project.write_artifacts(&files, &on_written)?;
        failpoint::hit(stage, Point::Synced, Some(&name));
        Ok(true)
    });
    tokio::select! {
        biased;
        written = writing => written,
        () = context.stop.reached(StopLevel::Now) => Ok(false),
        () = tokio::time::sleep(timeout) => {
            let text = format!("the disk took longer than {} s", timeout.as_secs_f64());
            Err(ArtifactError::Io {
                path: context.project.artifacts_dir(),
                source: io::Error::new(io::ErrorKind::TimedOut, text),
            })
        }
    }
}

fn report_stored(context: &RunContext, pair: PairName, stage: Stage, ms: u64) {
    failpoint::hit(stage, Point::Committed, Some(&pair));
    context.emit(RunEvent::StageFinished {
        pair: pair.clone(),
        stage,
        ms,
    });
    if stage == context.until {
        context.emit(RunEvent::PairDone { pair });
    }
}
