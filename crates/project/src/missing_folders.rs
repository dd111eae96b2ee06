//! Folders that are missing with the files in them, as after they were moved.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The folders of missing files, each with the uppermost missing one above it.
#[derive(Debug, Default)]
pub(crate) struct MissingFolders(BTreeMap<PathBuf, Option<PathBuf>>);

impl MissingFolders {
    /// Adds the folder of a missing file. Returns whether it is missing.
    pub(crate) fn add(&mut self, file: &Path) -> bool {
        let Some(folder) = file.parent() else {
            return false;
        };
        if let Some(known) = self.0.get(folder) {
            return known.is_some();
        }
        let above = folder.ancestors();
        // The path of the current folder is empty.
        let missing = above.take_while(|above| !above.as_os_str().is_empty() && !above.exists());
        let uppermost = missing.last().map(Path::to_owned);
        let is_missing = uppermost.is_some();
        self.0.insert(folder.to_owned(), uppermost);
        is_missing
    }

    /// Returns the uppermost ones.
    pub(crate) fn names(&self) -> Vec<String> {
        let found: BTreeSet<&PathBuf> = self.0.values().flatten().collect();
        let names = found.into_iter().map(|folder| folder.display().to_string());
        names.collect()
    }
}
