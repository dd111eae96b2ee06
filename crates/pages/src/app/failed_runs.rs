//! Why the last run of each project did not end well: what this app saw of the runs that it started, and what the catalog knows
//! of others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::projects::OpenProject;
use super::sentence::Sentence;
use mocban_catalog::WorkerRecord;
use mocban_core::domain::UnixMillis;
use mocban_core::locked;
use mocban_project::ProjectResult;
use mocban_project::location::now;
use mocban_runner::is_running;

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

    /// Returns why the last run of a project did not end well. `None` if it did, or while one is in progress.
    pub(super) async fn of(&self, open: &OpenProject) -> ProjectResult<Option<Sentence>> {
        let (project, catalog) = (&open.project, &open.catalog);
        if is_running(project, catalog, now()).await? {
            return Ok(None);
        }
        let seen = self.last(&open.dir);
        let last = catalog.last_worker().await?;
        let why = failure(seen, last.as_ref());
        // A run may have begun after the first check: its worker has not ended, but it was not killed.
        if why.is_some() && last.is_some_and(|worker| worker.ended.is_none()) {
            if is_running(project, catalog, now()).await? {
                return Ok(None);
            }
            let last = catalog.last_worker().await?;
            return Ok(failure(self.last(&open.dir), last.as_ref()));
        }
        Ok(why)
    }
}

/// Returns why the last run failed: `seen` is the last failure that this app saw and its time, `last` the worker that registered
/// last, which has stopped. A failure before the start or the end of that worker does not count.
fn failure(seen: Option<(UnixMillis, Sentence)>, last: Option<&WorkerRecord>) -> Option<Sentence> {
    let is_later = |at| {
        last.is_some_and(|worker| worker.started > at || worker.ended.is_some_and(|end| end > at))
    };
    match (seen, last) {
        (Some((at, why)), _) if !is_later(at) => Some(why),
        (_, Some(worker)) if worker.ended.is_none() => Some(Sentence::new(
            "The last run ended before its work was done: it was killed, or the computer stopped. Press Align to go on.",
            "Lần chạy trước kết thúc trước khi làm xong: tiến trình bị buộc dừng hoặc máy bị tắt. Hãy bấm Căn chỉnh để chạy tiếp.",
        )),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::failure;
    use crate::app::sentence::Sentence;
    use crate::review::Language;
    use mocban_catalog::WorkerRecord;
    use mocban_core::domain::{UnixMillis, WorkerId};

    fn worker(started: UnixMillis, ended: Option<UnixMillis>) -> WorkerRecord {
        WorkerRecord {
            id: WorkerId(1),
            host: "here".to_owned(),
            pid: 7,
            started,
            heartbeat: started,
            ended,
            died: false,
            leased: 0,
            metrics: None,
        }
    }

    #[test]
    fn a_failure_is_said_until_a_later_run_ended_well() {
        const KILLED: &str = "it was killed, or the computer stopped";
        let full = || Some((50, Sentence::new("the disk is full", "đĩa đã đầy")));
        for (seen, last, expected) in [
            (None, None, None),
            (None, Some(worker(10, Some(20))), None),
            (None, Some(worker(10, None)), Some(KILLED)),
            // It could not begin.
            (full(), None, Some("full")),
            // It ended with an error, or this app saw that it was killed.
            (full(), Some(worker(10, Some(49))), Some("full")),
            (full(), Some(worker(10, None)), Some("full")),
            // Another run had begun before, or began since.
            (full(), Some(worker(10, Some(60))), None),
            (full(), Some(worker(55, Some(60))), None),
            (full(), Some(worker(55, None)), Some(KILLED)),
        ] {
            let why = failure(seen, last.as_ref());
            let text = why.as_ref().map(|why| why.text(Language::English));
            match expected {
                Some(part) => assert!(text.is_some_and(|text| text.contains(part)), "{text:?}"),
                None => assert_eq!(text, None, "{last:?}"),
            }
        }
    }
}
