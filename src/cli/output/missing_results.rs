//! Results whose files are missing, as in a project that was made of a backup.

use std::collections::BTreeMap;

use mocban_core::domain::JobStatus;
use mocban_store::Project;

/// Explains what is missing and what to do, for `status` and `run`.
pub(crate) const TEXT: &str = "the depth maps and masks of the results are not here; if their disk is not mounted, mount it; once the scans and prints are in place, `check --repair --accept-missing` lets the next run compute them again; if they are in another folder, restore the backup into a new folder with `--inputs DIR`";

/// The command that helps.
pub(crate) const NEXT: &str = "check --repair --accept-missing";

/// Returns whether a project has results, but none of their files. Files that are only partly missing are found by
/// `check`.
pub(crate) fn are_missing(project: &Project, jobs: &BTreeMap<JobStatus, u64>) -> bool {
    jobs.get(&JobStatus::Done).is_some_and(|done| *done > 0) && project.has_no_artifacts()
}
