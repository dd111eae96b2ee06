//! The state of a project: its pairs and blocks, what failed, and whether a process works on it.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::error::ProjectResult;
use crate::events::{Listener, warn};
use crate::failures::Failures;
use crate::location::{Location, now};
use crate::missing_inputs::{self, ChangedInputs, InputInspection, MissingInputs};
use mocban_catalog::{Catalog, IgnoredProfiles, SameContents, StatusCounts};
use mocban_core::domain::JobStatus;
use mocban_runner::{fingerprints, is_running};
use mocban_store::Project;

/// Most pairs that are compared to find those with the contents of others. `check` compares all.
const MAX_COMPARED: u64 = 20_000;

/// Most pairs whose results are searched for colour profiles that could not be applied.
const MAX_SEARCHED: u64 = 5_000;

/// The state of a project.
#[derive(Debug)]
pub struct ProjectStatus {
    /// Counts of pairs.
    pub counts: StatusCounts,
    /// Whether a process works on the project. If not, leased pairs count as interrupted, not as running.
    pub running: bool,
    /// What failed.
    pub failures: Failures,
    /// Whether there are results, but none of their files.
    pub are_results_missing: bool,
    /// Input files that are no longer at their places. They are not inspected during a run.
    pub missing_inputs: Option<MissingInputs>,
    /// Input files that were changed since they were read. They are not inspected during a run.
    pub changed_inputs: Option<ChangedInputs>,
    /// Pairs and blocks with the contents of others. They are not compared during a run, nor in a very large project.
    pub same_contents: SameContents,
    /// Images whose colour profile could not be applied. They are not counted during a run, nor in a very large project.
    pub ignored_profiles: IgnoredProfiles,
}

/// What takes longer to find out than the counts.
#[derive(Default)]
struct InspectedInputs {
    inspection: InputInspection,
    same_contents: SameContents,
    ignored_profiles: IgnoredProfiles,
}

impl ProjectStatus {
    /// Reads the state, with all failed pairs or the first ones. Inputs are inspected and compared only if none are `known`
    /// from an earlier state that was read while nothing ran, because that takes longer than the rest.
    pub async fn read(
        project: &Project,
        catalog: &Catalog,
        all_failures: bool,
        location: &Location,
        known: Option<&Self>,
    ) -> ProjectResult<Self> {
        let fingerprints = fingerprints(&location.settings()?.config.stages);
        // Read before the counts: a run that ends in between leaves no leases.
        let running = is_running(project, catalog, now()).await?;
        let failures = Failures::read(catalog, all_failures).await?;
        let counts = catalog.status(&fingerprints).await?;
        let inputs = match known.filter(|known| !known.running) {
            _ if running => InspectedInputs::default(),
            Some(known) => known.inputs(),
            None => {
                let pairs = counts.pairs + counts.retired;
                let mut inputs = InspectedInputs {
                    inspection: missing_inputs::inspect(project, catalog, pairs).await?,
                    ..InspectedInputs::default()
                };
                if counts.pairs <= MAX_COMPARED {
                    inputs.same_contents = catalog.same_contents().await?;
                }
                if counts.pairs <= MAX_SEARCHED {
                    inputs.ignored_profiles = catalog.ignored_profiles().await?;
                }
                inputs
            }
        };
        Ok(Self {
            same_contents: inputs.same_contents,
            ignored_profiles: inputs.ignored_profiles,
            missing_inputs: inputs.inspection.missing,
            changed_inputs: inputs.inspection.changed,
            are_results_missing: are_results_missing(project, &counts.jobs),
            counts,
            running,
            failures,
        })
    }

    /// Returns what was found out about the inputs.
    fn inputs(&self) -> InspectedInputs {
        InspectedInputs {
            inspection: InputInspection {
                missing: self.missing_inputs.clone(),
                changed: self.changed_inputs.clone(),
                ..InputInspection::default()
            },
            same_contents: self.same_contents.clone(),
            ignored_profiles: self.ignored_profiles.clone(),
        }
    }

    /// Returns the number of pairs with a status.
    pub fn jobs(&self, status: JobStatus) -> u64 {
        self.counts.jobs.get(&status).copied().unwrap_or(0)
    }

    /// Returns the number of pairs that a run would work on.
    pub fn waiting(&self) -> u64 {
        self.jobs(JobStatus::Ready) + self.jobs(JobStatus::Backoff)
    }

    /// Returns the number of pairs that a process is working on.
    pub fn in_process(&self) -> u64 {
        self.jobs(JobStatus::Leased) - self.interrupted()
    }

    /// Returns the number of leased pairs whose run died or ended with an error. The next run continues these pairs.
    pub fn interrupted(&self) -> u64 {
        u64::from(!self.running) * self.jobs(JobStatus::Leased)
    }

    /// Returns the number of failed pairs.
    pub fn failed(&self) -> u64 {
        self.jobs(JobStatus::Quarantined)
    }

    /// Returns the state as JSON, with the failed pairs on request.
    pub fn json(&self, with_failures: bool) -> ProjectResult<Value> {
        let mut json = serde_json::to_value(&self.counts)?;
        json["running"] = Value::from(self.running);
        if let Some(missing) = &self.missing_inputs {
            json["missing_inputs"] = serde_json::to_value(missing)?;
        }
        if let Some(changed) = &self.changed_inputs {
            json["changed_inputs"] = serde_json::to_value(changed)?;
        }
        if !self.same_contents.is_empty() {
            json["same_contents"] = serde_json::to_value(&self.same_contents)?;
        }
        if !self.ignored_profiles.is_empty() {
            json["ignored_profiles"] = serde_json::to_value(&self.ignored_profiles)?;
        }
        if !self.failures.blocks.is_empty() {
            json["blocks"] = self.failures.blocks.json();
        }
        if with_failures {
            json["failures"] = self.failures.json();
        }
        Ok(json)
    }
}

/// Returns whether a project has results, but none of their files, as one that was made of a backup. Files that are only
/// partly missing are found by `check`.
pub(crate) fn are_results_missing(project: &Project, jobs: &BTreeMap<JobStatus, u64>) -> bool {
    jobs.get(&JobStatus::Done).is_some_and(|done| *done > 0) && project.has_no_artifacts()
}

/// Returns a clause if all pairs of a project are retired, such as `all 2 pairs of the project are retired; ..`.
pub async fn all_retired(catalog: &Catalog) -> ProjectResult<Option<String>> {
    let pairs: u64 = catalog.counters().await?.values().sum();
    let clause = mocban_catalog::all_retired(pairs, catalog.retired_count().await?);
    Ok(clause.map(|clause| format!("{clause}; `status --retired` says why")))
}

/// Warns about results that were computed with other settings or files than the current ones. Does nothing if the settings
/// are invalid.
pub(crate) async fn warn_about_stale(
    catalog: &Catalog,
    location: &Location,
    listener: &dyn Listener,
) -> ProjectResult<()> {
    let Ok(settings) = location.settings() else {
        return Ok(());
    };
    let stale = catalog
        .count_stale(&fingerprints(&settings.config.stages))
        .await?;
    let pairs = match stale {
        0 => return Ok(()),
        1 => "1 pair is".to_owned(),
        pairs => format!("{pairs} pairs are"),
    };
    let text =
        "stale: computed with other settings or files than the current ones; `run` updates them";
    warn(listener, format!("{pairs} {text}"));
    Ok(())
}
