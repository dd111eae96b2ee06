//! Keeps runs with other settings apart: by lock files in the project, or by the catalog if several machines share it.

use super::error::RunError;
use super::options::{RunOptions, RunPart};
use mocban_catalog::{Catalog, Fingerprints, SharedSettings, WorkerSettings};
use mocban_core::domain::UnixMillis;
use mocban_store::{Project, RunLock};

/// The right to run a project.
#[derive(Debug)]
pub(super) enum RunGuard {
    /// Lock files in the project.
    Lock(RunLock),
    /// A catalog that several machines share. Any number of runs may join.
    Shared,
}

impl RunGuard {
    /// Takes the run's lock.
    ///
    /// # Errors
    /// Returns an error if another process runs the project, and `options` do not allow to join it.
    pub(super) fn acquire(
        project: &Project,
        catalog: &Catalog,
        options: &RunOptions,
    ) -> Result<Self, RunError> {
        if catalog.is_shared() {
            return Ok(Self::Shared);
        }
        let join = options.join || options.part == RunPart::Work;
        Ok(Self::Lock(RunLock::acquire(project, join)?))
    }

    /// Refuses settings that differ from those of the run in progress. The first process defines the settings of a run.
    pub(super) async fn require_same_settings(
        &mut self,
        catalog: &Catalog,
        fingerprints: &Fingerprints,
        settings: &WorkerSettings,
        part: RunPart,
    ) -> Result<(), RunError> {
        let lock = match self {
            Self::Lock(lock) => lock,
            Self::Shared => {
                let compared = match part {
                    RunPart::All | RunPart::Plan => {
                        catalog.set_run_settings(settings.clone()).await?
                    }
                    RunPart::Work => catalog.compare_run_settings(settings).await?,
                };
                return match compared {
                    SharedSettings::Same => Ok(()),
                    SharedSettings::Other(changes) if part == RunPart::Work => {
                        Err(RunError::OtherPlan(changes))
                    }
                    SharedSettings::Other(changes) => Err(RunError::OtherSettings(changes)),
                };
            }
        };
        // The hashes of the settings of pairs, and in a second line the settings of blocks.
        let mine = format!("{}\n{}", fingerprints.hash_line(), settings.blocks.json());
        if lock.is_exclusive() {
            lock.set_settings(&mine)?;
            return Ok(());
        }
        let running = lock.settings()?;
        if running == mine {
            return Ok(());
        }
        let (pairs, blocks) = running.split_once('\n').unwrap_or((&running, ""));
        let mut changes = catalog.changes_from(pairs, fingerprints).await?;
        changes.extend(settings.blocks.changes_from(blocks));
        Err(RunError::OtherSettings(changes))
    }

    /// Returns the lock if no other process runs the project, so that all leases are of dead processes.
    pub(super) fn exclusive(&mut self) -> Option<&mut RunLock> {
        match self {
            Self::Lock(lock) if lock.is_exclusive() => Some(lock),
            Self::Lock(_) | Self::Shared => None,
        }
    }

    /// Takes the lock of planning. Returns `false` if another process plans.
    pub(super) async fn lock_planning(&self, catalog: &Catalog) -> Result<bool, RunError> {
        match self {
            Self::Lock(_) => Ok(true),
            Self::Shared => Ok(catalog.try_lock_planning().await?),
        }
    }

    /// Releases the lock of planning.
    pub(super) async fn unlock_planning(&self, catalog: &Catalog) -> Result<(), RunError> {
        match self {
            Self::Lock(_) => Ok(()),
            Self::Shared => Ok(catalog.unlock_planning().await?),
        }
    }
}

/// Returns whether a process works on the project.
pub async fn is_running(
    project: &Project,
    catalog: &Catalog,
    now: UnixMillis,
) -> Result<bool, RunError> {
    if catalog.is_shared() {
        Ok(catalog.active_workers(now).await? > 0)
    } else {
        Ok(RunLock::is_held(project))
    }
}
