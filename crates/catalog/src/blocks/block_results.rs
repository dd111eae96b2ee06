//! Results of the pairs that were cut from a block.

use std::collections::BTreeSet;

use crate::records::model::PairResults;
use crate::{Catalog, Result};
use mocban_core::domain::BlockName;

/// Pairs that are read at a time.
const PAGE: usize = 256;

impl Catalog {
    /// Returns the results of the pairs that were cut from a block and are not retired, sorted by name.
    pub async fn pairs_of_block(&self, block: &BlockName) -> Result<Vec<PairResults>> {
        let characters = self.block_characters(block).await?.into_iter();
        let cut: BTreeSet<String> = characters.filter_map(|one| one.pair).collect();
        let mut pairs = Vec::new();
        // The names of all pairs of the block have the same beginning, so they are neighbours in the order of names.
        let Ok(before) = block.pair("") else {
            return Ok(pairs);
        };
        let mut after = before.clone();
        loop {
            let page = self.results_page(Some(&after), PAGE).await?;
            let Some(last) = page.last() else { break };
            after = last.attributes.name.clone();
            let of_block = |pair: &PairResults| cut.contains(pair.attributes.name.as_str());
            pairs.extend(page.into_iter().filter(of_block));
            if !after.as_str().starts_with(before.as_str()) {
                break;
            }
        }
        Ok(pairs)
    }
}
