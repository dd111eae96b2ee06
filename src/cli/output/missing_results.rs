//! Text about results whose files are missing, as in a project that was made of a backup.

/// Explains what is missing and what to do, for `status` and `run`.
pub(crate) const TEXT: &str = "the depth maps and masks of the results are not here; if their disk is not mounted, mount it; once the scans and prints are in place, `check --repair --accept-missing` lets the next run compute them again; if they are in another folder, restore the backup into a new folder with `--inputs DIR`";

/// The command that helps.
pub(crate) const NEXT: &str = "check --repair --accept-missing";
