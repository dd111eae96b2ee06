//! Folders that several tests use. Each is made once in a process and copied for every test.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};

/// The folders by name. Each has a lock of its own, so that two can be made at the same time.
static MADE: Mutex<BTreeMap<String, Arc<OnceLock<tempfile::TempDir>>>> =
    Mutex::new(BTreeMap::new());

/// Copies the folder of this name to `to`. The first call makes it.
pub(crate) fn copy_of(name: &str, to: &Path, make: impl FnOnce(&Path)) {
    let mut all = MADE.lock().expect("no panic");
    let made = Arc::clone(all.entry(name.to_owned()).or_default());
    drop(all);
    let made = made.get_or_init(|| {
        let dir = tempfile::tempdir().expect("a temporary directory");
        make(dir.path());
        dir
    });
    copy_folder(made.path(), to);
}

/// Copies a folder with everything below it.
pub(crate) fn copy_folder(from: &Path, to: &Path) {
    let mut folders = vec![(from.to_owned(), to.to_owned())];
    while let Some((from, to)) = folders.pop() {
        std::fs::create_dir_all(&to).expect("a folder");
        for entry in std::fs::read_dir(from).expect("a folder") {
            let from = entry.expect("an entry").path();
            let to = to.join(from.file_name().expect("a name"));
            if from.is_dir() {
                folders.push((from, to));
            } else {
                std::fs::copy(from, to).expect("copied");
            }
        }
    }
}
