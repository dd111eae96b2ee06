//! The list of copies while a backup writes them: what is there already, and earlier copies that were not reached yet.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::input_list::{CopiedInput, INPUT_LIST, InputList};
use mocban_core::domain::ErrorCode;

/// Fewest changes after which the list is written.
const MIN_CHANGES: usize = 200;
/// The list of many inputs is written only after one in this number of them has changed.
const PART: usize = 50;
/// Length of new copies after which the list is written.
const MAX_NEW_BYTES: u64 = 4 << 30;

/// A list that is written now and then, so that a killed backup loses few of its copies.
#[derive(Debug)]
pub(crate) struct GrowingList {
    folder: PathBuf,
    listed: Vec<CopiedInput>,
    /// Copies of an earlier backup that were not reached yet, by stored path.
    earlier: HashMap<String, CopiedInput>,
    /// Number of changes after which the list is written.
    most_changes: usize,
    /// What has changed since the list was written.
    changes: usize,
    new_bytes: u64,
}

/// Returns the copies of an earlier backup in a folder, which need not exist.
///
/// # Errors
/// Refuses a list that cannot be used: it may name the only copies of files that are lost.
pub(crate) fn earlier_copies(folder: &Path) -> ProjectResult<Vec<CopiedInput>> {
    match InputList::read(folder) {
        Err(error) if error.code() == ErrorCode::Usage => {
            let (list, shown) = (folder.join(INPUT_LIST), folder.display());
            let text = format!(
                "{} is damaged or of another version, and may name the only copies of lost files; rename the folder {shown}, or name another file for the backup",
                list.display()
            );
            Err(Refusal::Usage(text).into())
        }
        list => Ok(list?.map_or_else(Vec::new, |list| list.files)),
    }
}

impl GrowingList {
    /// Begins with the copies of an earlier backup. `inputs` is the number of inputs that will be copied.
    pub(crate) fn new(folder: &Path, earlier: Vec<CopiedInput>, inputs: usize) -> Self {
        let earlier = earlier.into_iter().map(|copy| (copy.stored.clone(), copy));
        Self {
            folder: folder.to_owned(),
            listed: Vec::new(),
            earlier: earlier.collect(),
            most_changes: MIN_CHANGES.max(inputs / PART),
            changes: 0,
            new_bytes: 0,
        }
    }

    /// Returns whether there was no earlier copy.
    pub(crate) fn is_new(&self) -> bool {
        self.earlier.is_empty()
    }

    /// Returns the earlier copy of an input that was not reached yet.
    pub(crate) fn earlier(&self, stored: &str) -> Option<&CopiedInput> {
        self.earlier.get(stored)
    }

    /// Adds the copy of an input in place of an earlier one, or only forgets that one. Writes the list if much has changed.
    pub(crate) fn add(&mut self, stored: &str, copy: Option<CopiedInput>) -> ProjectResult<()> {
        let earlier = self.earlier.remove(stored);
        if copy != earlier {
            self.changes += 1;
            let bytes = copy.as_ref().map_or(0, |copy| copy.bytes);
            self.new_bytes = self.new_bytes.saturating_add(bytes);
        }
        self.listed.extend(copy);
        if self.changes >= self.most_changes || self.new_bytes >= MAX_NEW_BYTES {
            self.merged().write(&self.folder)?;
            (self.changes, self.new_bytes) = (0, 0);
        }
        Ok(())
    }

    /// Writes the list. `is_whole` says whether all inputs were reached: earlier copies of others are then left out.
    pub(crate) fn finish(self, is_whole: bool) -> ProjectResult<InputList> {
        let list = if is_whole {
            InputList::new(self.listed)
        } else {
            self.merged()
        };
        list.write(&self.folder)?;
        Ok(list)
    }

    /// Returns the list with the earlier copies that are still there.
    fn merged(&self) -> InputList {
        let mut files = self.listed.clone();
        files.extend(self.earlier.values().cloned());
        InputList::new(files)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{GrowingList, MAX_NEW_BYTES, MIN_CHANGES, earlier_copies};
    use crate::input_list::{CopiedInput, INPUT_LIST};
    use mocban_core::domain::ContentHash;

    fn copy(name: &str, bytes: u64) -> CopiedInput {
        CopiedInput {
            stored: format!("/disk/{name}"),
            name: name.to_owned(),
            bytes,
            hash: ContentHash::of(name.as_bytes()),
        }
    }

    /// Returns the number of copies in the list of a folder.
    fn listed(folder: &Path) -> usize {
        earlier_copies(folder).expect("a list").len()
    }

    #[test]
    fn the_list_is_written_after_many_changes_and_long_copies_with_earlier_ones() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let earlier = vec![copy("last", 7), copy("lost", 7)];
        let mut list = GrowingList::new(dir.path(), earlier, MIN_CHANGES + 3);
        let mut add = |copy: CopiedInput| {
            let stored = copy.stored.clone();
            list.add(&stored, Some(copy)).expect("the disk works");
            listed(dir.path())
        };
        for number in 1..MIN_CHANGES {
            assert_eq!(add(copy(&number.to_string(), 7)), 0);
        }
        assert_eq!(add(copy("long name", 7)), MIN_CHANGES + 2);
        assert_eq!(add(copy("last", 7)), MIN_CHANGES + 2, "nothing changed");
        assert_eq!(add(copy("long", MAX_NEW_BYTES)), MIN_CHANGES + 3);
        let whole = list.finish(true).expect("the disk works");
        assert_eq!(whole.files.len(), MIN_CHANGES + 2);
        assert_eq!(listed(dir.path()), MIN_CHANGES + 2);
    }

    #[test]
    fn an_input_that_was_not_reached_keeps_its_earlier_copy() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let earlier = vec![copy("1", 7), copy("2", 7)];
        let mut list = GrowingList::new(dir.path(), earlier, 2);
        assert!(!list.is_new() && list.earlier("/disk/1").is_some());
        list.add("/disk/1", None).expect("the disk works");
        assert_eq!(list.earlier("/disk/1"), None);
        let left = list.finish(false).expect("the disk works");
        assert_eq!(left.files, [copy("2", 7)]);
    }

    #[test]
    fn a_list_that_cannot_be_used_is_not_replaced() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        assert_eq!(listed(dir.path()), 0);
        std::fs::write(dir.path().join(INPUT_LIST), "{").expect("written");
        let refused = earlier_copies(dir.path()).expect_err("damaged");
        let text = refused.to_string();
        assert!(text.contains("rename the folder"), "{text}");
    }
}
