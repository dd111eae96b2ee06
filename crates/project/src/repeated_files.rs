//! Finds pairs or blocks of a list with the same files under several ids.

use std::collections::BTreeMap;
use std::path::Path;

use mocban_core::domain::{ContentHash, plain_path};

/// Counts the rows whose mesh and image an earlier row has, too.
#[derive(Debug, Default)]
pub(crate) struct RepeatedFiles {
    /// The first line of each mesh with an image, by a hash of their paths: a list may have millions of rows.
    lines: BTreeMap<u64, usize>,
    count: u64,
    /// The first such id, and the line with the same files.
    first: Option<(String, usize)>,
}

impl RepeatedFiles {
    /// Adds a row.
    pub(crate) fn add(&mut self, line: usize, id: &str, mesh: &Path, image: &Path) {
        let files = format!("{:?}", (plain_path(mesh), plain_path(image)));
        let hash = ContentHash::of(files.as_bytes());
        let key = hash.as_bytes().first_chunk().copied();
        let key = key.map_or(0, u64::from_le_bytes);
        if let Some(earlier) = self.lines.get(&key) {
            self.count += 1;
            self.first.get_or_insert((id.to_owned(), *earlier));
        } else {
            self.lines.insert(key, line);
        }
    }

    /// Returns a warning if there are such rows. `what` names rows and their files: `pairs with the same mesh and print`.
    pub(crate) fn warning(self, what: &str) -> Option<String> {
        let count = self.count;
        self.first.map(|(id, line)| {
            format!("{what} as an earlier one: {count}, first {id}, as on line {line}")
        })
    }
}
