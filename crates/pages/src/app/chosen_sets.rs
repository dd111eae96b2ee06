//! Pairs that were chosen for a review, by a key that an address can have. A file of the project keeps each set, so that the
//! address works after a restart.

use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use std::sync::Mutex;
use std::time::SystemTime;

use tokio::task::spawn_blocking;

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use mocban_core::domain::{ContentHash, PairName, one_line};
use mocban_core::locked;
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
            let mut kept = locked(&self.0);
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
        let (folder, project, file) = (dir.join(FOLDER), project.to_owned(), key.clone());
        let stored = spawn_blocking(move || store(&folder, &project, &file, &text)).await;
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
            let kept = locked(&self.0);
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
fn store(folder: &Path, project: &str, key: &str, lines: &str) -> io::Result<()> {
    create_folders(folder)?;
    write_atomic(&folder.join(key), lines.as_bytes())?;
    if let Err(error) = remove_oldest(folder, project, key) {
        let folder = folder.display();
        tracing::warn!("cannot remove the oldest chosen pairs in {folder}: {error}");
    }
    Ok(())
}

/// Removes the oldest sets of a project if there are too many, but never that of `newest`. Keeps files that are no sets: a
/// person may have a folder of this name.
fn remove_oldest(folder: &Path, project: &str, newest: &str) -> io::Result<()> {
    let mut sets: Vec<(SystemTime, String)> = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        let is_set = || read(folder, &name).is_some_and(|text| key_of(project, &text) == name);
        if name != newest && is_set() {
            let modified = entry.metadata().and_then(|meta| meta.modified());
            sets.extend(unless_gone(modified)?.map(|modified| (modified, name)));
        }
    }
    sets.sort_unstable();
    let surplus = (sets.len() + 1).saturating_sub(LIMIT);
    for (_, name) in sets.iter().take(surplus) {
        unless_gone(std::fs::remove_file(folder.join(name)))?;
    }
    Ok(())
}

/// Returns `None` for a file that is gone, because another app has removed it.
fn unless_gone<T>(found: io::Result<T>) -> io::Result<Option<T>> {
    match found {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        found => found.map(Some),
    }
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
    let is_digit = |byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
    text.len() == KEY_LENGTH && text.bytes().all(is_digit)
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
    use std::fs::File;
    use std::path::Path;
    use std::time::{Duration, SystemTime};

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
        // A person's own files, one with a name that a set could have.
        let own = ["0117", "20261129ab01"].map(|name| dir.join(FOLDER).join(name));
        for own in &own {
            std::fs::write(own, "a").expect("written");
        }
        std::fs::create_dir(&file).expect("a folder");
        assert_eq!(found_later(dir, &key).await, None, "it is no file");
        for number in 0..=LIMIT {
            sets.keep("p", dir, &[name(&number.to_string())]).await;
        }
        let files = || {
            let entries = std::fs::read_dir(dir.join(FOLDER)).expect("a folder");
            let paths = entries.map(|entry| entry.expect("an entry").path());
            paths.filter(|path| path.is_file()).collect::<Vec<_>>()
        };
        assert_eq!(files().len(), LIMIT + own.len());
        // The clock was set back.
        let later = SystemTime::now() + Duration::from_hours(1);
        for path in files() {
            let file = File::options().write(true).open(path).expect("a file");
            file.set_modified(later).expect("a time");
        }
        let newest = sets.keep("p", dir, &pairs[..1]).await;
        assert_eq!(found_later(dir, &newest).await, Some(1));
        assert_eq!(files().len(), LIMIT + own.len());
        assert!(own.iter().all(|own| own.exists()));
    }
}
