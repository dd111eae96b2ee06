//! The run: workers that lease pairs, run the stages that are left, and checkpoint after each.

mod events;
mod options;
mod stop;

pub use events::{RunEvent, RunSummary};
pub use options::{Rerun, RunOptions};
pub use stop::{Stop, StopLevel};

use crate::catalog::{Catalog, CatalogError, Plan, Recipes};
use crate::domain::PairName;
use crate::stages::Settings;
use crate::store::{Project, StoreError};

/// Why a run could not go on. Pairs that fail are no error: they are in the summary.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Another process runs this project.
    #[error("the project is in use by pid {pid}", pid = .pid.map_or_else(|| "unknown".to_owned(), |pid| pid.to_string()))]
    InUse {
        /// Its process, where the lock file tells.
        pid: Option<u32>,
    },
    /// A pair was named that is not there.
    #[error("there is no pair {}", .0.iter().map(PairName::as_str).collect::<Vec<_>>().join(", "))]
    NoSuchPair(Vec<PairName>),
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// A file operation failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// The recipes of these settings.
pub fn recipes(settings: &Settings) -> Recipes {
    Recipes::new(|stage| settings.recipe_fields(stage))
}

/// What [`run`] would do, for `--dry-run`. Looks at the input files first.
///
/// # Errors
/// When a named pair is not there, or catalog or files refuse.
pub async fn plan(
    project: &Project,
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
) -> Result<Plan, RunError> {
    let _ = (project, catalog, settings, options);
    todo!()
}

/// Runs what is left to run. Events go to `on_event` as they happen, from the runner's own task.
///
/// # Errors
/// When the project is in use, a named pair is not there, or catalog or disk refuse for good.
pub async fn run(
    project: &Project,
    catalog: &Catalog,
    settings: &Settings,
    options: &RunOptions,
    stop: &Stop,
    on_event: impl FnMut(RunEvent) + Send,
) -> Result<RunSummary, RunError> {
    let _ = (project, catalog, settings, options, stop, on_event);
    todo!()
}
