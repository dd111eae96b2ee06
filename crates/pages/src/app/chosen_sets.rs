//! Pairs that were chosen for a review, by a key that an address can have. A file of the project keeps each set, so that the
//! address works after a restart.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use tokio::task::spawn_blocking;

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use mocban_core::domain::{ContentHash, PairName, one_line};
use mocban_store::{create_folders, open_regular, read_up_to, write_atomic};

/// Name of the key in addresses.
pub(super) const CHOSEN: &str = "chosen";
/// Folder of the sets in a project.
const FOLDER: &str = "chosen";
/// Most sets that are kept in memory, and in a project. The oldest is forgotten.
const LIMIT: usize = 64;
/// Length of a key, in hexadecimal digits.
const KEY_LENGTH: usize = 12;
/// Most bytes of a set, which has one id a line. More pairs than can be chosen fit.
const MAX_BYTES: u64 = 1 << 20;

/// Sets of pairs. Those of a project that cannot be written end with the app.
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
    /// Keeps a set of pairs of a project, whose folder is `dir`. Returns its key, which is the same for the same pairs.
    pub(super) async fn keep(&self, project: &str, dir: &Path, names: &[PairName]) -> String {
        let pairs: BTreeSet<PairName> = names.iter().cloned().collect();
        let text = lines(&pairs);
        let key = key_of(project, &text);
        {
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
        }
        let (folder, file) = (dir.join(FOLDER), key.clone());
        let stored = spawn_blocking(move || store(&folder, &file, &text)).await;
        if let Ok(Err(error)) = stored {
            tracing::warn!("the chosen pairs are kept only until the app ends: {error}");
        }
        key
    }

    /// Returns the set that an address of a project names. `None` if it names none.
    ///
    /// # Errors
    /// Returns an error if the set is not kept any more, or is one of another project.
    pub(super) async fn of(
        &self,
        project: &str,
        dir: &Path,
        query: &PageQuery,
    ) -> AppResult<Option<BTreeSet<PairName>>> {
        let Some(key) = query.get(CHOSEN) else {
            return Ok(None);
        };
        {
            let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(found) = kept.iter().find(|known| known.key == key) {
                if found.project != project {
                    return Err(AppFailure::refused(of_another(&found.project)));
                }
                return Ok(Some(found.pairs.clone()));
            }
        }
        let (folder, file) = (dir.join(FOLDER), key.to_owned());
        let read = spawn_blocking(move || read(&folder, &file)).await;
        let read = read.ok().flatten();
        // A file that was cut or edited is no longer the set of its key.
        match read.filter(|text| key_of(project, text) == key) {
            Some(text) => Ok(Some(
                text.lines().filter_map(|id| id.parse().ok()).collect(),
            )),
            None => Err(AppFailure::refused(forgotten())),
        }
    }
}

/// Returns one id a line.
fn lines(pairs: &BTreeSet<PairName>) -> String {
    let names: Vec<&str> = pairs.iter().map(PairName::as_str).collect();
    names.join("\n")
}

fn key_of(project: &str, lines: &str) -> String {
    ContentHash::of(format!("{project}\n{lines}").as_bytes()).short()
}

/// Writes the set of a key, and removes the oldest sets if there are too many.
fn store(folder: &Path, key: &str, lines: &str) -> io::Result<()> {
    create_folders(folder)?;
    write_atomic(&folder.join(key), lines.as_bytes())?;
    let mut sets: Vec<(SystemTime, PathBuf)> = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let (path, meta) = entry.and_then(|entry| Ok((entry.path(), entry.metadata()?)))?;
        let name = path.file_name().unwrap_or_default();
        if meta.is_file() && name.to_str().is_some_and(is_key) {
            sets.push((meta.modified()?, path));
        }
    }
    sets.sort_unstable();
    let surplus = sets.len().saturating_sub(LIMIT);
    for (_, path) in sets.iter().take(surplus) {
        std::fs::remove_file(path)?;
    }
    Ok(())
}

/// Reads the set of a key. `None` if it is not kept, or the key is not one.
fn read(folder: &Path, key: &str) -> Option<String> {
    if !is_key(key) {
        return None;
    }
    let (file, _) = open_regular(&folder.join(key)).ok()?;
    String::from_utf8(read_up_to(file, MAX_BYTES).ok()?).ok()
}

/// Returns whether a text can be a key, which names a file of the folder. Other files of a folder of this name are not ours.
fn is_key(text: &str) -> bool {
    text.len() == KEY_LENGTH && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

fn of_another(project: &str) -> Sentence {
    let other = one_line(project);
    Sentence::new(
        format!(
            "these pairs were chosen in the project {other}: choose pairs of this one on its page Pairs"
        ),
        format!(
            "các cặp này được chọn trong dự án {other}: hãy chọn các cặp của dự án này ở trang Các cặp"
        ),
    )
}

fn forgotten() -> Sentence {
    Sentence::new(
        "the program no longer knows which pairs were chosen: choose the same pairs again on the page Pairs and press \"Judge these\"; the review then goes on where it stopped, and no answer is lost",
        "chương trình không còn giữ lựa chọn các cặp này: hãy chọn lại đúng các cặp đó ở trang Các cặp rồi bấm \"Đánh giá các cặp này\"; lần đánh giá sẽ tiếp tục ở chỗ đã dừng và không mất câu trả lời nào",
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{CHOSEN, ChosenSets, FOLDER, LIMIT};
    use crate::app::address::PageQuery;
    use crate::review::Language;
    use mocban_core::domain::PairName;

    fn name(text: &str) -> PairName {
        text.parse().expect("an id")
    }

    fn address(key: &str) -> PageQuery {
        PageQuery::default().with(CHOSEN, key)
    }

    /// Returns how many pairs a new app finds by a key of the project `p`.
    async fn found_later(dir: &Path, key: &str) -> Option<usize> {
        let found = ChosenSets::default().of("p", dir, &address(key)).await;
        found.ok().flatten().map(|pairs| pairs.len())
    }

    #[tokio::test]
    async fn a_set_has_one_key_and_the_oldest_is_forgotten() {
        // No set is stored where a file is in the way.
        let (sets, dir) = (ChosenSets::default(), tempfile::NamedTempFile::new());
        let dir = dir.expect("a temporary file");
        let dir = dir.path();
        let [a, b] = ["a", "b"].map(name);
        let key = sets.keep("p", dir, &[a.clone(), b.clone()]).await;
        assert_eq!(sets.keep("p", dir, &[b.clone(), a.clone()]).await, key);
        assert_ne!(sets.keep("q", dir, &[b, a.clone()]).await, key);
        let query = address(&key);
        let found = sets.of("p", dir, &query).await.expect("kept");
        assert_eq!(found.expect("a set").len(), 2);
        let none = sets.of("p", dir, &PageQuery::default()).await;
        assert!(none.expect("all").is_none());
        let why = sets.of("q", dir, &query).await;
        let why = why.expect_err("of another project");
        let why = why.text(Language::English);
        assert!(why.contains("chosen in the project p"), "{why}");
        for number in 0..LIMIT {
            let other = name(&number.to_string());
            sets.keep("p", dir, &[a.clone(), other]).await;
        }
        let forgotten = sets.of("p", dir, &query).await;
        forgotten.expect_err("it is forgotten");
        assert_eq!(found_later(dir, &key).await, None);
    }

    #[tokio::test]
    async fn a_set_outlives_the_app_until_its_file_is_changed() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (dir, sets) = (dir.path(), ChosenSets::default());
        let pairs = ["a 1", "chữ"].map(name);
        let key = sets.keep("p", dir, &pairs).await;
        assert_eq!(found_later(dir, &key).await, Some(2));
        let other = ChosenSets::default().of("q", dir, &address(&key)).await;
        other.expect_err("of another project");
        let file = dir.join(FOLDER).join(&key);
        for bad in ["../mocban.toml", "", &format!("../{FOLDER}/{key}")] {
            assert_eq!(found_later(dir, bad).await, None, "{bad}");
        }
        std::fs::write(&file, "a 1").expect("written");
        assert_eq!(found_later(dir, &key).await, None, "it was cut");
        std::fs::remove_file(&file).expect("removed");
        // A person's own file.
        let own = dir.join(FOLDER).join("0117");
        std::fs::write(&own, "").expect("written");
        std::fs::create_dir(&file).expect("a folder");
        assert_eq!(found_later(dir, &key).await, None, "it is no file");
        for number in 0..=LIMIT {
            sets.keep("p", dir, &[name(&number.to_string())]).await;
        }
        let files = std::fs::read_dir(dir.join(FOLDER)).expect("a folder");
        let files = files.filter(|entry| entry.as_ref().is_ok_and(|entry| entry.path().is_file()));
        assert_eq!(files.count(), LIMIT + 1);
        assert!(own.exists());
    }
}
