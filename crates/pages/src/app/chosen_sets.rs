//! Pairs that were chosen for a review, by a key that an address can have.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use mocban_core::domain::{ContentHash, PairName};

/// Name of the key in addresses.
pub(super) const CHOSEN: &str = "chosen";
/// Most sets that are kept. The oldest is forgotten.
const LIMIT: usize = 64;

/// Sets of pairs. They end with the app.
#[derive(Debug, Default)]
pub(super) struct ChosenSets(Mutex<Vec<(String, BTreeSet<PairName>)>>);

impl ChosenSets {
    /// Keeps a set of pairs. Returns its key, which is the same for the same pairs.
    pub(super) fn keep(&self, names: &[PairName]) -> String {
        let names: BTreeSet<PairName> = names.iter().cloned().collect();
        let text: Vec<&str> = names.iter().map(PairName::as_str).collect();
        let key = ContentHash::of(text.join("\n").as_bytes()).short();
        // Each change leaves the list whole.
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(known, _)| *known != key);
        if kept.len() >= LIMIT {
            kept.remove(0);
        }
        kept.push((key.clone(), names));
        key
    }

    /// Returns the set that an address names. `None` if it names none.
    ///
    /// # Errors
    /// Returns an error if the set is not kept any more.
    pub(super) fn of(&self, query: &PageQuery) -> AppResult<Option<BTreeSet<PairName>>> {
        let Some(key) = query.get(CHOSEN) else {
            return Ok(None);
        };
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept.iter().find(|(known, _)| known == key);
        let gone = || {
            AppFailure::refused(Sentence::new(
                "the program does not keep any more which pairs were chosen: choose them again on the page Pairs",
                "chương trình không còn giữ lựa chọn các cặp này: hãy chọn lại ở trang Các cặp",
            ))
        };
        found.map(|(_, names)| Some(names.clone())).ok_or_else(gone)
    }
}

#[cfg(test)]
mod tests {
    use super::{CHOSEN, ChosenSets, LIMIT};
    use crate::app::address::PageQuery;
    use mocban_core::domain::PairName;

    #[test]
    fn a_set_has_one_key_and_the_oldest_is_forgotten() {
        let sets = ChosenSets::default();
        let name = |text: String| text.parse::<PairName>().expect("an id");
        let [a, b] = ["a", "b"].map(|text| name(text.to_owned()));
        let key = sets.keep(&[a.clone(), b.clone()]);
        assert_eq!(sets.keep(&[b, a.clone()]), key);
        let query = PageQuery::default().with(CHOSEN, &key);
        let found = sets.of(&query).expect("kept").expect("a set");
        assert_eq!(found.len(), 2);
        assert!(sets.of(&PageQuery::default()).expect("all").is_none());
        for number in 0..LIMIT {
            sets.keep(&[a.clone(), name(number.to_string())]);
        }
        sets.of(&query).expect_err("it is forgotten");
    }
}
