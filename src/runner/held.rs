//! A pair's lease in a worker's hand. The thread that computes does not wait for the disk: one checkpoint may be on its
//! way while the next stage is computed, and the lease comes back when it is stored.

use std::sync::Arc;

use tokio::task::JoinHandle;

use super::RunError;
use super::events::RunEvent;
use super::worker::{PairEnd, PairReport, Shared};
use crate::breakpoint::{self, Point};
use crate::catalog::{CatalogError, Kept, Lease, StageDone};
use crate::domain::{PairName, Stage};

/// The right to a pair, and what has been stored under it.
pub(super) struct Held {
    shared: Arc<Shared>,
    name: PairName,
    right: Right,
    stored: u64,
}

/// Where the lease is.
enum Right {
    /// In hand.
    Lease(Lease),
    /// Gone with a checkpoint that is not stored yet.
    Storing(JoinHandle<Result<Kept, CatalogError>>),
    /// Spent: the pair is done, or the lease was given away.
    Spent,
    /// Lost to somebody else.
    Lost,
}

impl Held {
    /// A leased pair of which nothing is on its way.
    pub(super) const fn new(shared: Arc<Shared>, name: PairName, lease: Lease) -> Self {
        Self {
            shared,
            name,
            right: Right::Lease(lease),
            stored: 0,
        }
    }

    /// Takes out the lease as soon as nothing is on its way any more; `None` when it is lost or spent.
    pub(super) async fn lease(&mut self) -> Result<Option<Lease>, RunError> {
        self.settle().await?;
        match std::mem::replace(&mut self.right, Right::Spent) {
            Right::Lease(lease) => Ok(Some(lease)),
            right => {
                self.right = right;
                Ok(None)
            }
        }
    }

    /// Sends a checkpoint on its way, and tells of it when it is stored. It needs the lease, so there is never more
    /// than one on its way and they are stored in their order.
    pub(super) fn store(&mut self, lease: Lease, done: StageDone) {
        let stored = store(Arc::clone(&self.shared), self.name.clone(), lease, done);
        self.right = Right::Storing(tokio::spawn(stored));
    }

    /// Whether a checkpoint is on its way.
    pub(super) const fn is_storing(&self) -> bool {
        matches!(self.right, Right::Storing(_))
    }

    /// How the pair leaves its worker, when all is stored and a lease that is left has been given back.
    pub(super) async fn report(mut self, end: Result<PairEnd, RunError>) -> PairReport {
        let given_back = self.give_back().await;
        let lost = matches!(self.right, Right::Lost);
        let (end, fatal) = match (end, given_back) {
            (Err(error), _) | (Ok(_), Err(error)) => (PairEnd::GivenBack, Some(error)),
            (Ok(_), Ok(())) if lost => (PairEnd::Lost, None),
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

    /// Waits for the checkpoint that is on its way.
    async fn settle(&mut self) -> Result<(), RunError> {
        let Right::Storing(stored) = &mut self.right else {
            return Ok(());
        };
        if !stored.is_finished() {
            self.shared.catalog.hurry().await?;
        }
        let kept = match stored.await {
            Ok(kept) => kept,
            Err(panic) => std::panic::resume_unwind(panic.into_panic()),
        };
        self.right = Right::Spent;
        self.right = match kept? {
            Kept::Lost => Right::Lost,
            Kept::Done => Right::Spent,
            Kept::Lease(lease) => Right::Lease(lease),
        };
        self.stored += u64::from(!matches!(self.right, Right::Lost));
        Ok(())
    }
}

async fn store(
    shared: Arc<Shared>,
    name: PairName,
    lease: Lease,
    done: StageDone,
) -> Result<Kept, CatalogError> {
    let (stage, ms) = (done.stage, done.ms);
    let kept = shared.catalog.checkpoint_in_time(lease, done).await?;
    if !matches!(kept, Kept::Lost) {
        finished(&shared, name, stage, ms);
    }
    Ok(kept)
}

fn finished(shared: &Shared, pair: PairName, stage: Stage, ms: u64) {
    breakpoint::reach(stage, Point::Stored, Some(&pair));
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
