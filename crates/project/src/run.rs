//! Runs a project, or one part of a run.

use std::time::Duration;

use crate::blocking::{blocking, blocking_within};
use crate::closing::close;
use crate::error::ProjectResult;
use crate::events::{Listener, ProjectEvent, warn};
use crate::failures::Failures;
use crate::location::{Location, now};
use crate::missing_inputs::{self, MissingInputs};
use crate::selection;
use crate::status::{all_retired, are_results_missing};
use mocban_catalog::Catalog;
use mocban_config::Config;
use mocban_core::domain::ErrorCode;
use mocban_runner::{self as runner, RunOptions, RunPlan, RunSummary, Stop, fingerprints};
use mocban_store::{Project, ProjectStorage};

/// What a run with another method than before would do to the results.
pub const TWO_METHODS: &str = "the results of the other method would be replaced; to keep both, import the pairs into a second project, and compare the two with `report --compare`";

/// What a run with another method than before does to the results.
pub(crate) const REPLACES_METHOD: &str = "this run replaces the results of the other method; to keep both, stop it now, import the pairs into a second project, and compare the two with `report --compare`";

/// Longest time for looking at the roots of inputs before a run.
const ROOT_CHECK: Duration = Duration::from_secs(5);

/// Returns the options of a run of all pairs, from the settings alone.
pub fn options(config: &Config) -> RunOptions {
    let plain = RunOptions::default();
    RunOptions {
        workers: match config.run.workers {
            0 => plain.workers,
            workers => workers,
        },
        memory: match config.run.memory_mib {
            0 => runner::default_memory_limit(),
            mib => Some(mib << 20),
        },
        stage_timeout: Duration::from_secs(config.run.stage_timeout_s),
        limits: config.limits,
        ..plain
    }
}

/// A run that has not begun.
#[derive(Debug)]
pub struct PreparedRun {
    project: Project,
    catalog: Catalog,
    config: Box<Config>,
    options: RunOptions,
}

/// What a run would do.
#[derive(Debug)]
pub struct PlannedRun {
    /// What would run and why.
    pub plan: RunPlan,
    /// Whether another process works on the project.
    pub is_running: bool,
    /// Whether there are results, but none of their files.
    pub are_results_missing: bool,
    /// Input files that are no longer at their places.
    pub missing_inputs: Option<MissingInputs>,
}

/// How a run ended.
#[derive(Debug)]
pub struct RunOutcome {
    /// What it did.
    pub summary: RunSummary,
    /// What failed, in this run and earlier ones, among what the run was of.
    pub failures: Failures,
    /// Whether there are results, but none of their files.
    pub are_results_missing: bool,
    /// Input files that are no longer at their places.
    pub missing_inputs: Option<MissingInputs>,
}

impl PreparedRun {
    /// Opens a project for a run of the pairs and blocks with these ids, or of all. A project that cannot be written to is
    /// opened only for a plan.
    ///
    /// # Errors
    /// Returns an error if an object store does not answer or an id does not exist.
    pub async fn new(
        names: &[String],
        options: RunOptions,
        is_plan: bool,
        location: &Location,
        listener: &dyn Listener,
    ) -> ProjectResult<Self> {
        let config = Box::new(location.settings()?.config);
        let (project, catalog) = match open(location, listener).await {
            Err(error)
                if is_plan
                    && matches!(error.code(), ErrorCode::NotWritable | ErrorCode::DiskFull) =>
            {
                let text = "the project cannot be written to, so input files that changed since the last run are not noticed";
                warn(listener, text);
                location.open_read_only().await?
            }
            opened => opened?,
        };
        let only = match names {
            [] => None,
            typed => Some(selection::pairs_and_blocks(&catalog, typed).await?),
        };
        Ok(Self {
            project,
            catalog,
            config,
            options: RunOptions { only, ..options },
        })
    }

    /// Returns a clause if all pairs are retired, so that nothing would run.
    pub async fn all_retired(&self) -> ProjectResult<Option<String>> {
        all_retired(&self.catalog).await
    }

    /// Returns what would run and why, and which files are missing: a missing file counts as unchanged.
    pub async fn plan(self) -> ProjectResult<PlannedRun> {
        let (project, catalog) = (&self.project, &self.catalog);
        let plan = runner::plan(project, catalog, &self.config.stages, &self.options).await?;
        let is_running = runner::is_running(project, catalog, now()).await?;
        let status = catalog.status(&fingerprints(&self.config.stages)).await?;
        let pairs = status.pairs + status.retired;
        let missing_inputs = missing_inputs::missing(project, catalog, pairs).await?;
        self.catalog.close().await;
        Ok(PlannedRun {
            plan,
            is_running,
            are_results_missing: are_results_missing(project, &status.jobs),
            missing_inputs,
        })
    }

    /// Runs until nothing is left or `stop` is set. Before that, warns if the method differs from that of the results.
    ///
    /// # Errors
    /// Returns an error if another process runs the project, or if the catalog or the place of the artifacts fails.
    pub async fn run(self, stop: &Stop, listener: &dyn Listener) -> ProjectResult<RunOutcome> {
        let (project, catalog) = (&self.project, &self.catalog);
        // The run itself reports what cannot be read.
        let changes = runner::changes_method(catalog, &self.config.stages, &self.options).await;
        if changes.unwrap_or(false) {
            warn(listener, REPLACES_METHOD);
        }
        let ended = runner::run(
            project,
            catalog,
            &self.config.stages,
            &self.options,
            stop,
            |event| {
                listener.event(ProjectEvent::Run(&event));
            },
        )
        .await;
        listener.event(ProjectEvent::Ended);
        // After an error, the catalog may not reply any more.
        let failures = match &ended {
            Ok(_) => Failures::of(catalog, self.options.only.as_ref()).await,
            Err(_) => Ok(Failures::default()),
        };
        let missing_inputs = match &ended {
            Ok(summary) if !summary.stopped => {
                let pairs = summary.status.pairs + summary.status.retired;
                missing_inputs::missing_after_failures(project, catalog, pairs).await
            }
            _ => Ok(None),
        };
        close(self.catalog, stop).await;
        let (summary, failures) = (ended?, failures?);
        Ok(RunOutcome {
            missing_inputs: missing_inputs?,
            are_results_missing: are_results_missing(&self.project, &summary.status.jobs),
            summary,
            failures,
        })
    }
}

/// Opens a project for a run, and asks the object stores of the settings whether they answer. Warns about roots of inputs
/// that are not there.
async fn open(location: &Location, listener: &dyn Listener) -> ProjectResult<(Project, Catalog)> {
    let (project, catalog) = location.open().await?;
    if project.storage().is_none() {
        return Ok((project, catalog));
    }
    let checked = project.clone();
    let check = move || checked.storage().map_or(Ok(()), ProjectStorage::check);
    if let Err(error) = blocking(check).await? {
        catalog.close().await;
        return Err(error.into());
    }
    let checked = project.clone();
    let find = move || {
        checked
            .storage()
            .map_or_else(Vec::new, ProjectStorage::unusable_roots)
    };
    // The run needs a root only if one of its pairs does.
    let found = blocking_within(ROOT_CHECK, find).await;
    for root in found.into_iter().flatten() {
        warn(listener, root);
    }
    Ok((project, catalog))
}
