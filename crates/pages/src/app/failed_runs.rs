//! Why the last run of each project failed, as far as this app started it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::sentence::Sentence;
use mocban_core::domain::UnixMillis;
use mocban_core::locked;
use mocban_project::location::now;

/// The failures by the folder of the project.
#[derive(Debug, Clone, Default)]
pub(super) struct FailedRuns(Arc<Mutex<BTreeMap<PathBuf, (UnixMillis, Sentence)>>>);

impl FailedRuns {
    /// Returns when the last run of a project failed and why, if it did.
    pub(super) fn last(&self, dir: &Path) -> Option<(UnixMillis, Sentence)> {
        locked(&self.0).get(dir).cloned()
    }

    /// Stores why the last run of a project failed, or that it did not.
    pub(super) fn set(&self, dir: &Path, why: Option<Sentence>) {
        let mut failed = locked(&self.0);
        match why {
            Some(why) => failed.insert(dir.to_owned(), (now(), why)),
            None => failed.remove(dir),
        };
    }
}
