//! The inputs that a catalog names, each once, with what the catalog knows of their content.

use std::collections::{HashMap, HashSet};

use crate::error::ProjectResult;
use mocban_catalog::{Catalog, InputVersion, PairSelection};
use mocban_core::domain::{ArtifactRef, ContentHash, PairId};
use mocban_store::{Input, stat_input};

/// Number of pairs that are read at a time.
const PAGE: usize = 2_000;

/// An input of pairs or blocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WantedInput {
    /// Its path as stored.
    pub(crate) stored: String,
    /// What was read at this path. Empty if no run has read it yet.
    known: Vec<InputVersion>,
}

impl WantedInput {
    /// Returns whether results were computed from this content. Returns `true` for an input that no run has read yet.
    pub(crate) fn may_be(&self, hash: ContentHash) -> bool {
        self.known.is_empty() || self.was(hash)
    }

    /// Returns whether a run has read this content.
    pub(crate) fn was(&self, hash: ContentHash) -> bool {
        self.known.iter().any(|known| known.hash == hash)
    }

    /// Makes an input that no run has read yet.
    #[cfg(test)]
    pub(crate) fn unread(stored: &str) -> Self {
        Self {
            stored: stored.to_owned(),
            known: Vec::new(),
        }
    }

    /// Returns whether no run has read it yet.
    pub(crate) const fn is_unread(&self) -> bool {
        self.known.is_empty()
    }

    /// Returns whether size and time of the file are as when this content was read.
    pub(crate) fn is_still(&self, hash: ContentHash, input: &Input) -> bool {
        stat_input(input).is_ok_and(|stat| {
            let mut known = self.known.iter();
            known.any(|known| known.hash == hash && known.stat == stat)
        })
    }
}

/// Returns the meshes, prints, pages and labels of all pairs and blocks, also of retired ones, in the order of the catalog.
/// The meshes and prints of pairs that were cut from a block are artifacts.
pub(crate) async fn wanted_inputs(catalog: &Catalog) -> ProjectResult<Vec<WantedInput>> {
    let (inputs, _) = first_wanted_inputs(catalog, usize::MAX).await?;
    Ok(inputs)
}

/// Returns the inputs of about as many pairs as `most_pairs`, and of all blocks. Also returns whether there may be more.
pub(crate) async fn first_wanted_inputs(
    catalog: &Catalog,
    most_pairs: usize,
) -> ProjectResult<(Vec<WantedInput>, bool)> {
    first_inputs(catalog, most_pairs, true).await
}

/// Returns the inputs like [`first_wanted_inputs`], without those of retired pairs.
pub(crate) async fn first_counted_inputs(
    catalog: &Catalog,
    most_pairs: usize,
) -> ProjectResult<(Vec<WantedInput>, bool)> {
    first_inputs(catalog, most_pairs, false).await
}

async fn first_inputs(
    catalog: &Catalog,
    most_pairs: usize,
    with_retired: bool,
) -> ProjectResult<(Vec<WantedInput>, bool)> {
    let mut wanted = WantedInputs::default();
    let (mut after, mut pairs, mut is_cut) = (None, 0, false);
    loop {
        let page = catalog.known_inputs(after, PAGE, None).await?;
        let Some(last) = page.last() else {
            break;
        };
        after = Some(last.pair);
        pairs += page.len();
        let retired = if with_retired {
            HashSet::new()
        } else {
            let ids: Vec<PairId> = page.iter().map(|known| known.pair).collect();
            catalog.retired_among(&PairSelection::of(&ids)).await?
        };
        for pair in page {
            if retired.contains(&pair.pair) {
                continue;
            }
            wanted.add(pair.mesh_path, pair.mesh);
            wanted.add(pair.print_path, pair.print);
        }
        if pairs >= most_pairs {
            is_cut = true;
            break;
        }
    }
    for block in catalog.known_blocks().await? {
        let (paths, read) = (block.attributes, block.inputs);
        wanted.add(paths.mesh_path, read.mesh);
        wanted.add(paths.page_path, read.page);
        if let Some(labels) = paths.labels_path {
            wanted.add(labels, read.labels);
        }
    }
    Ok((wanted.inputs, is_cut))
}

#[derive(Default)]
struct WantedInputs {
    inputs: Vec<WantedInput>,
    /// Positions by stored path.
    positions: HashMap<String, usize>,
}

impl WantedInputs {
    fn add(&mut self, stored: String, read: Option<InputVersion>) {
        if ArtifactRef::at_path(&stored).is_some() {
            return;
        }
        let next = self.inputs.len();
        let position = *self.positions.entry(stored.clone()).or_insert(next);
        if position == next {
            let known = Vec::new();
            self.inputs.push(WantedInput { stored, known });
        }
        // An import has changed the path of a file without a stat, so another file was read.
        let read = read.filter(|read| !read.is_gone() && !read.stat.is_empty());
        let known = &mut self.inputs[position].known;
        let new = read.filter(|read| !known.contains(read));
        known.extend(new);
    }
}

#[cfg(test)]
mod tests {
    use super::WantedInputs;
    use mocban_core::domain::{ContentHash, InputVersion};

    #[test]
    fn a_shared_file_is_wanted_once_with_all_that_was_read() {
        let mut wanted = WantedInputs::default();
        let version = |text: &str, stat: &str| InputVersion {
            hash: ContentHash::of(text.as_bytes()),
            stat: stat.to_owned(),
        };
        for read in [
            None,
            Some(version("a", "1:2:3")),
            Some(version("a", "1:2:3")),
            Some(version("b", "1:9:3")),
            Some(version("c", "")),
            Some(InputVersion::gone()),
        ] {
            wanted.add("1.png".to_owned(), read);
        }
        wanted.add("2.png".to_owned(), None);
        let [shared, unread] = &wanted.inputs[..] else {
            unreachable!("two files");
        };
        assert_eq!(shared.known.len(), 2);
        let [a, c] = ["a", "c"].map(|text| ContentHash::of(text.as_bytes()));
        assert!(shared.may_be(a) && !shared.may_be(c) && !shared.is_unread());
        assert!(unread.may_be(c) && !unread.was(c) && unread.is_unread());
    }
}
