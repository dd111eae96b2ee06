//! The ids of a list, held small: a list may have millions.

use std::collections::BTreeMap;

use crate::domain::{ContentHash, PairName};

/// Bytes of a hash that are kept: two ids of a list share them once in 10^24 lists of ten million rows.
const KEPT: usize = 16;

/// Which ids a list gives, and in which line first.
#[derive(Debug, Default)]
pub struct Ids(BTreeMap<[u8; KEPT], u32>);

impl Ids {
    /// Notes an id; gives the line it was given in before.
    pub(super) fn insert(&mut self, name: &PairName, line: usize) -> Option<u32> {
        match self.0.entry(key(name)) {
            std::collections::btree_map::Entry::Occupied(first) => Some(*first.get()),
            std::collections::btree_map::Entry::Vacant(free) => {
                free.insert(u32::try_from(line).unwrap_or(u32::MAX));
                None
            }
        }
    }

    /// Whether the list gives the id.
    pub fn contains(&self, name: &PairName) -> bool {
        self.0.contains_key(&key(name))
    }

    /// Whether it gives none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<'n> FromIterator<&'n PairName> for Ids {
    fn from_iter<T: IntoIterator<Item = &'n PairName>>(names: T) -> Self {
        let mut ids = Self::default();
        for (line, name) in (1..).zip(names) {
            ids.insert(name, line);
        }
        ids
    }
}

fn key(name: &PairName) -> [u8; KEPT] {
    let hash = ContentHash::of(name.as_str().as_bytes());
    std::array::from_fn(|at| hash.as_bytes()[at])
}
