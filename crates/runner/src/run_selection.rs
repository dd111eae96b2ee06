//! The pairs and blocks that a run works on, if it does not work on all.

use super::error::RunError;
use super::options::NamedWork;
use super::retry::retried;
use mocban_catalog::{BlockSelection, Catalog, PairSelection};

/// Some pairs and blocks.
#[derive(Debug, Clone)]
pub(super) struct RunSelection {
    /// The pairs that were named.
    named: PairSelection,
    /// The blocks that were named.
    pub(super) blocks: BlockSelection,
    /// The named pairs, and the pairs that have been cut from the blocks so far.
    pub(super) pairs: PairSelection,
}

impl RunSelection {
    /// Looks up what a user named. Returns `None`, which means everything, for `None`.
    ///
    /// # Errors
    /// Returns an error if a pair or a block does not exist, or a database operation fails.
    pub(super) async fn of(
        catalog: &Catalog,
        only: Option<&NamedWork>,
    ) -> Result<Option<Self>, RunError> {
        let Some(NamedWork { pairs, blocks }) = only else {
            return Ok(None);
        };
        let unknown = catalog.unknown_names(pairs).await?;
        if !unknown.is_empty() {
            return Err(RunError::NoSuchPair(unknown));
        }
        let all = catalog.block_names().await?;
        if let Some(unknown) = blocks.iter().find(|name| !all.contains(name)) {
            return Err(RunError::NoSuchBlock(unknown.clone()));
        }
        let named = catalog.select(pairs).await?;
        let mut selection = Self {
            pairs: named.clone(),
            named,
            blocks: catalog.select_blocks(blocks).await?,
        };
        selection.refresh(catalog).await?;
        Ok(Some(selection))
    }

    /// Adds the pairs that were cut from the blocks since the last call, and removes retired ones.
    pub(super) async fn refresh(&mut self, catalog: &Catalog) -> Result<(), RunError> {
        if !self.blocks.is_empty() {
            let (named, blocks) = (&self.named, &self.blocks);
            self.pairs = retried!(catalog.with_cut_pairs(named, blocks))?;
        }
        Ok(())
    }
}
