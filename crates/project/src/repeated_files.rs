//! Finds pairs of a list with the same files under several ids.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use mocban_core::domain::{ContentHash, PairName};
use mocban_lists::manifest::ManifestRow;

/// Counts the rows whose mesh and print an earlier row has, too.
#[derive(Debug, Default)]
pub(crate) struct RepeatedFiles {
    /// The first line of each mesh with a print, by a hash of their paths: a list may have millions of rows.
    lines: BTreeMap<u64, usize>,
    count: u64,
    /// The first such pair, and the line with the same files.
    first: Option<(PairName, usize)>,
}

impl RepeatedFiles {
    /// Adds a row.
    pub(crate) fn add(&mut self, row: &ManifestRow) {
        let files = format!("{:?}", (plain(&row.mesh), plain(&row.print)));
        let hash = ContentHash::of(files.as_bytes());
        let key = hash.as_bytes().first_chunk().copied();
        let key = key.map_or(0, u64::from_le_bytes);
        if let Some(earlier) = self.lines.get(&key) {
            self.count += 1;
            self.first.get_or_insert((row.name.clone(), *earlier));
        } else {
            self.lines.insert(key, row.line);
        }
    }

    /// Returns a warning if there are such pairs.
    pub(crate) fn warning(self) -> Option<String> {
        let count = self.count;
        self.first.map(|(name, line)| {
            format!(
                "pairs with the same mesh and print as an earlier one: {count}, first {name}, as on line {line}"
            )
        })
    }
}

/// Returns a path without `.` components.
fn plain(path: &Path) -> PathBuf {
    let components = path.components();
    components
        .filter(|part| *part != Component::CurDir)
        .collect()
}
