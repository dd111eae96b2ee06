//! A pair's lease in a worker's hand. The thread that computes does not wait for the disk: files are written and stages
//! stored while those after them are computed, several at once where they are short, and the lease comes back when all
//! are.

use std::sync::Arc;

use tokio::sync::mpsc;
use tokio::task::JoinHandle;

use super::RunError;
use super::compute_thread::ComputedStage;
use super::events::RunEvent;
use super::filing::file;
use super::pair_task::{PairEnd, PairReport, RunContext};
use crate::catalog::{CheckpointOutcome, Lease, StageCheckpoint};
use crate::domain::{PairName, Stage};
use crate::failpoint::{self, Point};

/// The right to a pair, and what has been stored under it.
pub(super) struct Checkpointer {
    shared: Arc<RunContext>,
    name: PairName,
    right: LeaseState,
    stored: u64,
    /// Whether all that was sent on its way is stored or will be.
    is_whole: bool,
}

/// Where the lease is.
enum LeaseState {
    /// In hand.
    Lease(Lease),
    /// With a task that stores the stages it is sent.
    Storing(
        mpsc::UnboundedSender<ComputedStage>,
        JoinHandle<Result<StoreOutcome, RunError>>,
    ),
    /// Spent: the pair is done, or the lease was given away.
    Spent,
    /// Lost to somebody else.
    Lost,
}

/// What became of the lease, and how many stages were stored under it.
struct StoreOutcome {
    kept: CheckpointOutcome,
    stages: u64,
    is_whole: bool,
}

impl Checkpointer {
    /// A leased pair of which nothing is on its way.
    pub(super) const fn new(shared: Arc<RunContext>, name: PairName, lease: Lease) -> Self {
        Self {
            shared,
            name,
            right: LeaseState::Lease(lease),
            stored: 0,
            is_whole: true,
        }
    }

    /// Has what is on its way stored at once and takes out the lease; `None` when it is lost or spent.
    pub(super) async fn lease(&mut self) -> Result<Option<Lease>, RunError> {
        if self.is_storing() {
            let catalog = self.shared.catalog.clone();
            let _waiting = catalog.waiting().await?;
            self.settle().await?;
        }
        match std::mem::replace(&mut self.right, LeaseState::Spent) {
            LeaseState::Lease(lease) => Ok(Some(lease)),
            right => {
                self.right = right;
                Ok(None)
            }
        }
    }

    /// Sends a finished stage on its way, and tells of it when it is stored; `false` when the lease is known to be gone.
    /// Stages are stored in their order.
    pub(super) async fn store(&mut self, finished: ComputedStage) -> Result<bool, RunError> {
        self.begin();
        if let LeaseState::Storing(sender, _) = &self.right
            && sender.send(finished).is_ok()
        {
            return Ok(true);
        }
        // It takes no more where the lease was lost, or the disk or the catalog refused.
        self.settle().await?;
        Ok(false)
    }

    /// Gives the lease, if it is in hand, to a task that stores.
    fn begin(&mut self) {
        self.right = match std::mem::replace(&mut self.right, LeaseState::Spent) {
            LeaseState::Lease(lease) => {
                let (sender, stages) = mpsc::unbounded_channel();
                let task = store(Arc::clone(&self.shared), self.name.clone(), lease, stages);
                LeaseState::Storing(sender, tokio::spawn(task))
            }
            right => right,
        };
    }

    /// Whether a stage may be on its way.
    pub(super) const fn is_storing(&self) -> bool {
        matches!(self.right, LeaseState::Storing(..))
    }

    /// How a pair that is done leaves its worker, when all is stored. Nobody waits for it.
    pub(super) async fn done(mut self) -> PairReport {
        let settled = self.settle().await;
        self.report(settled.map(|()| PairEnd::Done)).await
    }

    /// How the pair leaves its worker, when all is stored and a lease that is left has been given back.
    pub(super) async fn report(mut self, end: Result<PairEnd, RunError>) -> PairReport {
        let given_back = self.give_back().await;
        let lost = matches!(self.right, LeaseState::Lost);
        let (end, fatal) = match (end, given_back) {
            (Err(error), _) | (Ok(_), Err(error)) => (PairEnd::GivenBack, Some(error)),
            (Ok(_), Ok(())) if lost => (PairEnd::Lost, None),
            (Ok(_), Ok(())) if !self.is_whole => (PairEnd::GivenBack, None),
            (Ok(end), Ok(())) => (end, None),
        };
        PairReport {
            end,
            stages: self.stored,
            fatal,
        }
    }

    async fn give_back(&mut self) -> Result<(), RunError> {
        if let Some(lease) = self.lease().await? {
            self.shared.catalog.release(lease).await?;
        }
        Ok(())
    }

    /// Waits until the stages that are on their way are stored.
    async fn settle(&mut self) -> Result<(), RunError> {
        let right = std::mem::replace(&mut self.right, LeaseState::Spent);
        let LeaseState::Storing(sender, task) = right else {
            self.right = right;
            return Ok(());
        };
        drop(sender);
        let StoreOutcome {
            kept,
            stages,
            is_whole,
        } = match task.await {
            Ok(stored) => stored?,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        };
        self.stored += stages;
        self.is_whole &= is_whole;
        self.right = match kept {
            CheckpointOutcome::LeaseLost => LeaseState::Lost,
            CheckpointOutcome::Done => LeaseState::Spent,
            CheckpointOutcome::Lease(lease) => LeaseState::Lease(lease),
        };
        Ok(())
    }
}

/// Stores stages as they come, those together that have come while others were on their way, until no more come or the
/// lease is gone.
async fn store(
    shared: Arc<RunContext>,
    name: PairName,
    mut lease: Lease,
    mut stages: mpsc::UnboundedReceiver<ComputedStage>,
) -> Result<StoreOutcome, RunError> {
    let mut stored = 0;
    while let Some(first) = stages.recv().await {
        let Some(first) = filed(&shared, &name, first).await? else {
            return Ok(StoreOutcome {
                kept: CheckpointOutcome::Lease(lease),
                stages: stored,
                is_whole: false,
            });
        };
        let (mut done, mut is_whole) = (vec![first], true);
        while is_whole && let Ok(next) = stages.try_recv() {
            let next = filed(&shared, &name, next).await?;
            is_whole = next.is_some();
            done.extend(next);
        }
        let told: Vec<_> = done.iter().map(|done| (done.stage, done.ms)).collect();
        let kept = shared.catalog.checkpoint_in_time(lease, done).await?;
        if !matches!(kept, CheckpointOutcome::LeaseLost) {
            stored += told.len() as u64;
            for (stage, ms) in told {
                finished(&shared, name.clone(), stage, ms);
            }
        }
        match kept {
            // What comes after a stage that is not on disk must not be stored without it.
            CheckpointOutcome::Lease(next) if is_whole => lease = next,
            kept => {
                return Ok(StoreOutcome {
                    kept,
                    stages: stored,
                    is_whole,
                });
            }
        }
    }
    Ok(StoreOutcome {
        kept: CheckpointOutcome::Lease(lease),
        stages: stored,
        is_whole: true,
    })
}

/// Has a stage's files written; then a row may name them. `None` when the run is to stop now.
async fn filed(
    shared: &RunContext,
    pair: &PairName,
    stage: ComputedStage,
) -> Result<Option<StageCheckpoint>, RunError> {
    let (of, limit) = ((pair, stage.stage), shared.stage_limit);
    if !file(&shared.project, of, stage.files, limit, &shared.stop).await? {
        return Ok(None);
    }
    // The disk may have taken long: whether the lease still stands is asked as of now.
    Ok(Some(StageCheckpoint {
        stage: stage.stage,
        fingerprint: shared.fingerprints.of(stage.stage),
        mesh_hash: stage.mesh_hash,
        print_hash: stage.print_hash,
        attributes: stage.attributes,
        outcome: stage.outcome,
        files: stage.named,
        result_hash: stage.result_hash,
        metrics: stage.metrics,
        inputs: stage.inputs,
        ms: stage.took.as_millis() as u64,
        at: shared.clock.now(),
        next_deadline: shared.deadline(),
        alive_since: shared.alive_since(),
    }))
}

fn finished(shared: &RunContext, pair: PairName, stage: Stage, ms: u64) {
    failpoint::hit(stage, Point::Stored, Some(&pair));
    let last = stage == shared.until.min(Stage::Register);
    shared.tell(RunEvent::StageFinished {
        pair: pair.clone(),
        stage,
        ms,
    });
    if last {
        shared.tell(RunEvent::PairDone { pair });
    }
}
