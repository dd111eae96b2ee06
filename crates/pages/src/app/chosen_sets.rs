//! Pairs that were chosen for a review, by a key that an address can have.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use mocban_core::domain::{ContentHash, PairName, one_line};

/// Name of the key in addresses.
pub(super) const CHOSEN: &str = "chosen";
/// Most sets that are kept. The oldest is forgotten.
const LIMIT: usize = 64;

/// Sets of pairs. They end with the app.
#[derive(Debug, Default)]
pub(super) struct ChosenSets(Mutex<Vec<ChosenSet>>);

#[derive(Debug)]
struct ChosenSet {
    key: String,
    /// The key of the project.
    project: String,
    pairs: BTreeSet<PairName>,
}

impl ChosenSets {
    /// Keeps a set of pairs of a project. Returns its key, which is the same for the same pairs.
    pub(super) fn keep(&self, project: &str, names: &[PairName]) -> String {
        let pairs: BTreeSet<PairName> = names.iter().cloned().collect();
        let names = pairs.iter().map(PairName::as_str);
        let text: Vec<&str> = std::iter::once(project).chain(names).collect();
        let key = ContentHash::of(text.join("\n").as_bytes()).short();
        // Each change leaves the list whole.
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|known| known.key != key);
        if kept.len() >= LIMIT {
            kept.remove(0);
        }
        kept.push(ChosenSet {
            key: key.clone(),
            project: project.to_owned(),
            pairs,
        });
        key
    }

    /// Returns the set that an address of a project names. `None` if it names none.
    ///
    /// # Errors
    /// Returns an error if the set is not kept any more, or is one of another project.
    pub(super) fn of(
        &self,
        project: &str,
        query: &PageQuery,
    ) -> AppResult<Option<BTreeSet<PairName>>> {
        let Some(key) = query.get(CHOSEN) else {
            return Ok(None);
        };
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(found) = kept.iter().find(|known| known.key == key) else {
            return Err(AppFailure::refused(Sentence::new(
                "the program no longer knows which pairs were chosen: choose the same pairs again on the page Pairs and press \"Judge these\"; the review then goes on where it stopped, and no answer is lost",
                "chương trình không còn giữ lựa chọn các cặp này: hãy chọn lại đúng các cặp đó ở trang Các cặp rồi bấm \"Đánh giá các cặp này\"; lần đánh giá sẽ tiếp tục ở chỗ đã dừng và không mất câu trả lời nào",
            )));
        };
        if found.project != project {
            let other = one_line(&found.project);
            return Err(AppFailure::refused(Sentence::new(
                format!(
                    "these pairs were chosen in the project {other}: choose pairs of this one on its page Pairs"
                ),
                format!(
                    "các cặp này được chọn trong dự án {other}: hãy chọn các cặp của dự án này ở trang Các cặp"
                ),
            )));
        }
        Ok(Some(found.pairs.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::{CHOSEN, ChosenSets, LIMIT};
    use crate::app::address::PageQuery;
    use crate::review::Language;
    use mocban_core::domain::PairName;

    #[test]
    fn a_set_has_one_key_and_the_oldest_is_forgotten() {
        let sets = ChosenSets::default();
        let name = |text: String| text.parse::<PairName>().expect("an id");
        let [a, b] = ["a", "b"].map(|text| name(text.to_owned()));
        let key = sets.keep("p", &[a.clone(), b.clone()]);
        assert_eq!(sets.keep("p", &[b.clone(), a.clone()]), key);
        assert_ne!(sets.keep("q", &[b, a.clone()]), key);
        let query = PageQuery::default().with(CHOSEN, &key);
        let found = sets.of("p", &query).expect("kept").expect("a set");
        assert_eq!(found.len(), 2);
        let none = sets.of("p", &PageQuery::default());
        assert!(none.expect("all").is_none());
        let why = sets.of("q", &query).expect_err("of another project");
        let why = why.text(Language::English);
        assert!(why.contains("chosen in the project p"), "{why}");
        for number in 0..LIMIT {
            sets.keep("p", &[a.clone(), name(number.to_string())]);
        }
        sets.of("p", &query).expect_err("it is forgotten");
    }
}
