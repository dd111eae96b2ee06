//! The failed pairs of a project by class, and its blocks.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::block_status::BlockStatus;
use crate::error::ProjectResult;
use mocban_catalog::{Catalog, FailedPair, StoredFailure};
use mocban_core::domain::{FailureClass, PairName};
use mocban_runner::NamedWork;

/// Maximum number of failed pairs that are read, unless all are requested.
const READ_LIMIT: usize = 200;
const NO_LIMIT: usize = i64::MAX as usize;

/// Returns whether a failure of a class may not occur again with the same files and settings.
pub const fn may_succeed_unchanged(class: FailureClass) -> bool {
    match class {
        FailureClass::Io | FailureClass::Resource | FailureClass::Bug => true,
        FailureClass::BadInput | FailureClass::NoSolution => false,
    }
}

/// The failed pairs of a project.
#[derive(Debug, Clone, Default)]
pub struct Failures {
    /// Numbers of failed pairs, the most frequent class first.
    pub counts: Vec<(FailureClass, u64)>,
    /// All failed pairs, or the first ones.
    pub pairs: Vec<FailedPair>,
    /// The blocks of the project.
    pub blocks: BlockStatus,
}

impl Failures {
    /// Reads all failures, or enough to name a few of each class.
    pub(crate) async fn read(catalog: &Catalog, all: bool) -> ProjectResult<Self> {
        let mut counts = catalog.failure_counts().await?;
        counts.sort_by_key(|(class, number)| (std::cmp::Reverse(*number), *class));
        let limit = if all { NO_LIMIT } else { READ_LIMIT };
        let pairs = match counts.as_slice() {
            [] => Vec::new(),
            _ => catalog.failures(limit).await?,
        };
        Ok(Self {
            counts,
            pairs,
            blocks: BlockStatus(catalog.block_states().await?),
        })
    }

    /// Reads the failures of some pairs and blocks, and of the pairs of these blocks. `None` stands for all, as in
    /// [`Failures::read`].
    pub(crate) async fn of(catalog: &Catalog, only: Option<&NamedWork>) -> ProjectResult<Self> {
        let mut failures = Self::read(catalog, only.is_some()).await?;
        let Some(NamedWork { pairs, blocks }) = only else {
            return Ok(failures);
        };
        let mut named: BTreeSet<PairName> = pairs.iter().cloned().collect();
        for block in blocks {
            named.extend(catalog.pairs_of_block_with_retired(block.as_str()).await?);
        }
        failures.pairs.retain(|pair| named.contains(&pair.name));
        let states = &mut failures.blocks.0;
        states.retain(|state| blocks.contains(&state.attributes.name));
        for (class, number) in &mut failures.counts {
            let pairs = failures.pairs.iter();
            let of_class = pairs.filter(|pair| pair.failure.failure.class == *class);
            *number = of_class.count() as u64;
        }
        failures.counts.retain(|(_, number)| *number > 0);
        Ok(failures)
    }

    /// Returns whether a failed pair may succeed with the same files and settings. A run finds changed ones itself.
    pub fn may_succeed_unchanged(&self) -> bool {
        let mut classes = self.counts.iter().map(|(class, _)| *class);
        classes.any(may_succeed_unchanged)
    }

    /// Returns the failed pairs with stage, class and message.
    pub fn json(&self) -> Value {
        let pairs = self.pairs.iter().map(|pair| {
            let StoredFailure { stage, failure, .. } = &pair.failure;
            json!({"id": pair.name, "stage": stage, "class": failure.class, "error": failure.message})
        });
        pairs.collect()
    }
}
