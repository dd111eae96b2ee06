//! Stores the stages of one pair under its lease, in order, and its failure. A separate task stores stages, so that the compute
//! thread does not wait for the disk. The files of a stage are on the disk before the stage's row is stored. Stages that
//! arrive during a transaction share the next transaction. At its end, the task returns the lease.

use std::sync::Arc;

use tokio::sync::mpsc;
use tokio::task::JoinHandle;

use super::blocking::task_result;
use super::error::RunError;
use super::events::RunEvent;
use super::pair_stage::ComputedStage;
use super::policy::{self, FailedAttempt};
use super::run_context::{JobEnd, PairReport, RunContext};
use super::stage_files::{Unwritten, write_batch};
use mocban_catalog::{
    CheckpointOutcome, FailureAction, InputVersions, Lease, PairProvenance, StageFailure,
};
use mocban_core::domain::{Failure, FailureClass, PairName, Stage, WorkerId};
use mocban_system::failpoint::{self, Point};

/// The task that holds a pair's lease and stores its stages.
pub(super) struct Checkpointer {
    context: Arc<RunContext>,
    /// The worker that holds the lease.
    worker: WorkerId,
    stages: mpsc::UnboundedSender<ComputedStage>,
    task: JoinHandle<Result<StoredStages, RunError>>,
}

/// Result of a checkpointer: the number of stored stages, and the lease if this process still holds it.
pub(super) struct StoredStages {
    lease: CheckpointOutcome,
    /// Number of stages stored.
    pub(super) stages: u64,
    /// Why a stage is unstored. A lost lease does not change this.
    unwritten: Option<Unwritten>,
    pair: PairName,
}

impl StoredStages {
    /// Returns the lease if this process still holds it and no stage was left unstored.
    ///
    /// # Errors
    /// Returns `self` if the lease is lost or ended with the pair's last stage, or if a stage was left unstored.
    pub(super) fn into_lease(self) -> Result<Lease, Box<Self>> {
        match self.lease {
            CheckpointOutcome::Lease(lease) if self.unwritten.is_none() => Ok(lease),
            lease => Err(Box::new(Self { lease, ..self })),
        }
    }

    /// Ends the lease if it is still held. If something else has the name of a file, stores that as the failure of the
    /// stage; otherwise releases the pair. Returns `end`, but `LeaseLost` if the lease was lost, and `Released` if a stage
    /// could not be stored.
    pub(super) async fn finish(self, context: &RunContext, end: JobEnd) -> PairReport {
        let stages = self.stages;
        let end = match (self.lease, self.unwritten) {
            (CheckpointOutcome::Refused, _) => {
                tracing::info!(pair = %self.pair, "no result of the pair is stored: its lease is lost, or its files were written too long ago");
                Ok(JobEnd::LeaseLost)
            }
            (CheckpointOutcome::Lease(lease), Some(Unwritten::Blocked(stage, error))) => {
                let failed = PairFailure {
                    name: self.pair,
                    attributes: stage.provenance.attributes,
                    stage: stage.stage,
                    failure: Failure::new(FailureClass::Io, error.to_string()),
                    is_transient: false,
                    inputs: stage.inputs,
                    ms: Some(stage.ms),
                };
                failed.store(context, lease).await
            }
            (CheckpointOutcome::Lease(lease), unwritten) => {
                let end = unwritten.map_or(end, |_| JobEnd::Released);
                match context.catalog.release(lease).await {
                    Ok(true) => Ok(end),
                    Ok(false) => Ok(JobEnd::LeaseLost),
                    Err(error) => Err(error.into()),
                }
            }
            (CheckpointOutcome::Done, _) => Ok(end),
        };
        PairReport { end, stages }
    }
}

impl Checkpointer {
    /// Starts the task for a leased pair.
    pub(super) fn start(context: Arc<RunContext>, pair: PairName, lease: Lease) -> Self {
        let (sender, stages) = mpsc::unbounded_channel();
        let worker = lease.worker();
        let task = tokio::spawn(store_stages(Arc::clone(&context), pair, lease, stages));
        Self {
            context,
            worker,
            stages: sender,
            task,
        }
    }

    /// Sends a computed stage to be stored. Returns `false` if the task has ended: the lease is lost, the disk or the
    /// catalog returned an error, or a stage was not stored because of a stop request or an unavailable object store.
    pub(super) fn store(&self, stage: ComputedStage) -> bool {
        self.stages.send(stage).is_ok()
    }

    /// Waits until no later stage can be stored, for a reason of [`Self::store`] or because the lease has expired.
    pub(super) async fn closed(&self) {
        tokio::select! {
            () = self.stages.closed() => {}
            () = self.context.expired(self.worker) => {}
        }
    }

    /// Waits until the task has stored the sent stages. Meanwhile the catalog does not delay commits.
    pub(super) async fn settle(self) -> Result<StoredStages, RunError> {
        let _flush = self.context.catalog.waiting().await?;
        drop(self.stages);
        task_result(self.task.await)
    }

    /// Waits until the task has stored the sent stages, and releases the lease if it is still held. Returns how the
    /// pair ended.
    pub(super) async fn finish(self, end: JobEnd) -> PairReport {
        let context = Arc::clone(&self.context);
        let settled = if end == JobEnd::Done {
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
    let (mut count, mut unwritten) = (0, None);
    let mut outcome = CheckpointOutcome::Lease(lease);
    // After a stage that was not stored, no later stage may be stored.
    while unwritten.is_none()
        && matches!(outcome, CheckpointOutcome::Lease(_))
        && let Some(first) = stages.recv().await
    {
        let CheckpointOutcome::Lease(lease) = outcome else {
            break;
        };
        let batch;
        (batch, unwritten) = write_batch(&context, &pair, first, &mut stages).await?;
        let times: Vec<_> = batch.iter().map(|done| (done.stage, done.ms)).collect();
        context.metrics.begin_commit();
        let stored = context.catalog.checkpoint(lease, batch).await;
        context.metrics.end_commit();
        outcome = stored?;
        if !matches!(outcome, CheckpointOutcome::Refused) {
            count += times.len() as u64;
            for (stage, ms) in times {
                report_stored(&context, pair.clone(), stage, ms);
            }
        }
    }
    Ok(StoredStages {
        lease: outcome,
        stages: count,
        unwritten,
        pair,
    })
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

/// A stage of a pair that failed.
pub(super) struct PairFailure {
    pub(super) name: PairName,
    /// The manifest attributes as JSON.
    pub(super) attributes: String,
    pub(super) stage: Stage,
    pub(super) failure: Failure,
    /// Whether a retry may succeed.
    pub(super) is_transient: bool,
    /// The input files as read.
    pub(super) inputs: InputVersions,
    pub(super) ms: Option<u64>,
}

impl PairFailure {
    /// Stores the failure under the lease. Returns how the pair ended.
    pub(super) async fn store(
        self,
        context: &RunContext,
        lease: Lease,
    ) -> Result<JobEnd, RunError> {
        let Self { stage, failure, .. } = self;
        let now = context.clock.now();
        let attempt = FailedAttempt {
            id: lease.id(),
            class: failure.class,
            is_transient: self.is_transient,
            attempt: lease.attempt(),
            ran_alone: lease.exclusive(),
        };
        let action = policy::failure_action(attempt, now);
        let record = StageFailure {
            stage,
            failure: failure.clone(),
            action,
            provenance: PairProvenance::new(
                context.fingerprints.of(stage),
                &self.inputs,
                self.attributes,
            ),
            inputs: self.inputs,
            ms: self.ms,
            at: now,
            alive_since: context.alive_since(),
        };
        if !context.catalog.fail(lease, record).await? {
            tracing::info!(pair = %self.name, "the lease is lost, so its failure is not stored");
            return Ok(JobEnd::LeaseLost);
        }
        let pair = self.name;
        if action == FailureAction::Quarantine {
            let skipped = (context.until.index() + 1).saturating_sub(stage.index()) as u64;
            context.emit(RunEvent::PairFailed {
                pair,
                stage,
                failure,
                skipped,
            });
            return Ok(JobEnd::Failed);
        }
        context.emit(RunEvent::PairBackingOff {
            pair,
            stage,
            failure,
            wait_ms: action.wait_ms(now),
        });
        Ok(JobEnd::Retry)
    }
}
