//! Plants the faults of a queue, each once. If files of a result cannot be read, another result takes its place.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use super::check_items::{FaultCandidates, plant_fault};
use super::item::{ItemView, ReviewItem};
use crate::local_server::{WorkFailed, WorkThread};
use mocban_catalog::{Catalog, CatalogError};
use mocban_core::domain::{AttentionCheck, ContentHash, SeededRandom, Stage};
use mocban_core::locked;
use mocban_results::pair_artifacts::{PairArtifacts, PairArtifactsError};
use mocban_store::Project;

/// Maximum number of results that are tried besides those in which faults are wanted.
const MAX_SPARE: usize = 50;

/// Why the queue cannot be built.
#[derive(Debug, thiserror::Error)]
pub(super) enum QueueError {
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    #[error(transparent)]
    Stopped(#[from] WorkFailed),
}

/// Fewer faults than wanted, because files of results cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultShortage {
    /// Number of faults that should be in the queue.
    pub wanted: usize,
    /// Number of faults that are in the queue.
    pub planted: usize,
    /// A pair whose files cannot be read, and why.
    pub example: String,
}

/// The faults of a queue.
#[derive(Debug, Default)]
pub(super) struct Faults {
    pub(super) items: Vec<ReviewItem>,
    /// Set if there are fewer than wanted.
    pub(super) shortage: Option<FaultShortage>,
}

/// Plants faults and keeps those of the latest queue, because a page reads its queue often and a fault depends only on
/// the view of its result.
#[derive(Debug)]
pub(super) struct FaultPlanter {
    catalog: Catalog,
    project: Project,
    work: Arc<WorkThread>,
    planted: Mutex<BTreeMap<ContentHash, (AttentionCheck, ItemView)>>,
}

/// Why no fault can be planted in a result.
#[derive(Debug, thiserror::Error)]
enum UnusableResult {
    #[error(transparent)]
    Unreadable(#[from] PairArtifactsError),
    #[error("the pair has a new result")]
    Replaced,
}

impl FaultPlanter {
    pub(super) const fn new(catalog: Catalog, project: Project, work: Arc<WorkThread>) -> Self {
        Self {
            catalog,
            project,
            work,
            planted: Mutex::new(BTreeMap::new()),
        }
    }

    /// Plants the wanted number of faults, or fewer if not enough candidates can be read.
    pub(super) async fn plant(
        &self,
        candidates: FaultCandidates<'_>,
        random: &SeededRandom,
    ) -> Result<Faults, QueueError> {
        let (wanted, mut planted) = (candidates.wanted, BTreeMap::new());
        let (mut items, mut failure) = (Vec::with_capacity(wanted), None);
        for item in candidates.items.into_iter().take(wanted + MAX_SPARE) {
            if items.len() == wanted {
                break;
            }
            match self.fault(item, random).await? {
                Ok(fault) => {
                    planted.insert(item.view.hash(), fault.clone());
                    let (check, view) = fault;
                    items.push(ReviewItem {
                        check: Some(check),
                        view,
                        ..item.clone()
                    });
                }
                Err(error) => drop(failure.get_or_insert((&item.pair, error))),
            }
        }
        *locked(&self.planted) = planted;
        let shortage = failure.filter(|_| items.len() < wanted);
        Ok(Faults {
            shortage: shortage.map(|(pair, error)| FaultShortage {
                wanted,
                planted: items.len(),
                example: format!("{pair}: {error}"),
            }),
            items,
        })
    }

    /// Returns the fault of a result, planted before or now.
    async fn fault(
        &self,
        item: &ReviewItem,
        random: &SeededRandom,
    ) -> Result<Result<(AttentionCheck, ItemView), UnusableResult>, QueueError> {
        let known = self.known(&item.view.hash());
        if let Some(known) = known {
            return Ok(Ok(known));
        }
        let Some(detail) = self.catalog.pair(&item.pair).await? else {
            return Ok(Err(UnusableResult::Replaced));
        };
        let (project, item, random) = (self.project.clone(), item.clone(), random.clone());
        let fault = self.work.call(move || {
            let artifacts = PairArtifacts::new(&project, &detail.results);
            if artifacts.stage(Stage::Depth)?.result_hash != item.view.depth_hash {
                return Err(UnusableResult::Replaced);
            }
            Ok(plant_fault(&item, &artifacts.depth()?, &random))
        });
        Ok(fault.await?)
    }

    fn known(&self, view: &ContentHash) -> Option<(AttentionCheck, ItemView)> {
        locked(&self.planted).get(view).cloned()
    }
}
