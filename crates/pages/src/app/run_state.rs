//! The state of a project that its first page shows: counts, the run in progress, and what the next run would do.

use super::child_run;
use super::failed_groups::FailedGroup;
use super::failed_runs::FailedRuns;
use super::latest_results::LatestResults;
use super::moved_blocks::changed_blocks;
use super::projects::OpenProject;
use super::run_blocks::outdated_blocks;
use super::sentence::Sentence;
use mocban_catalog::{Plan, StatusCounts, WorkerRecord, WorkerState};
use mocban_core::domain::JobStatus;
use mocban_project::ProjectResult;
use mocban_project::block_status::BlockStatus;
use mocban_project::location::now;
use mocban_runner::{fingerprints, is_running};

/// Most pairs that failed or have other files with which the page asks what the next run would do: each is inspected.
const MAX_INSPECTED: u64 = 1000;

/// What the page shows of a project.
pub(super) struct RunState {
    pub(super) counts: StatusCounts,
    pub(super) is_running: bool,
    pub(super) workers: Vec<WorkerRecord>,
    pub(super) latest: LatestResults,
    pub(super) failures: Vec<FailedGroup>,
    pub(super) blocks: BlockStatus,
    /// Number of finished or failed blocks that the next run would align again. 0 during a run.
    pub(super) outdated_blocks: u64,
    /// Number of finished blocks whose moved files are known to have other content. 0 during a run.
    pub(super) changed_blocks: u64,
    /// Why the last run did not end well, if it did not. `None` during a run.
    pub(super) failed_run: Option<Sentence>,
    /// Number of pairs at the same time, as the settings give it.
    pub(super) jobs: usize,
    /// What the next run would do. `None` during a run, and if it would take long to find out.
    pub(super) plan: Option<Plan>,
}

impl RunState {
    pub(super) async fn read(open: &OpenProject, failed_runs: &FailedRuns) -> ProjectResult<Self> {
        let (catalog, location) = (&open.catalog, open.location());
        let settings = location.settings()?;
        // Read before the counts: a run that ends in between leaves no leases.
        let running = is_running(&open.project, catalog, now()).await?;
        let workers = child_run::workers(catalog).await;
        let current = fingerprints(&settings.config.stages);
        let counts = catalog.status(&current).await?;
        let failed = counts.jobs.get(&JobStatus::Quarantined).copied();
        let inspected = failed.unwrap_or(0) + counts.other_files;
        let options = mocban_project::run::options(&settings.config);
        let plan = if running || inspected > MAX_INSPECTED {
            None
        } else {
            Some(catalog.plan(&current, None, options.rerun).await?)
        };
        let blocks = BlockStatus(catalog.block_states().await?);
        let [outdated_blocks, changed_blocks] = if running {
            [0; 2]
        } else {
            let files = &open.moved_files;
            [
                outdated_blocks(catalog, &options, &blocks).await?,
                changed_blocks(catalog, &open.project, files, &blocks).await?,
            ]
        };
        Ok(Self {
            counts,
            is_running: running,
            workers: workers.unwrap_or_default(),
            latest: LatestResults::read(catalog, now()).await?,
            failures: FailedGroup::read_all(catalog).await?,
            blocks,
            outdated_blocks,
            changed_blocks,
            failed_run: failed_runs.of(open).await?,
            jobs: options.workers,
            plan,
        })
    }

    pub(super) fn jobs(&self, status: JobStatus) -> u64 {
        self.counts.jobs.get(&status).copied().unwrap_or(0)
    }

    /// Returns the number of pairs that a run would work on or works on.
    pub(super) fn outstanding(&self) -> u64 {
        [JobStatus::Ready, JobStatus::Backoff, JobStatus::Leased]
            .map(|status| self.jobs(status))
            .iter()
            .sum()
    }

    /// Returns the number of pairs that the next run would align, each counted once although it may be both interrupted and
    /// outdated.
    pub(super) fn to_align(&self) -> u64 {
        match &self.plan {
            Some(plan) => plan.pairs() + plan.leased,
            None => (self.outstanding() + self.counts.stale).min(self.counts.pairs),
        }
    }

    /// Returns how many of these pairs an earlier run has computed or refused, with other settings or files.
    pub(super) fn outdated(&self) -> u64 {
        (self.plan.as_ref()).map_or(self.counts.stale, Plan::again)
    }

    /// Returns the number of blocks that a run would work on or works on, whose pairs are not yet all known.
    pub(super) fn open_blocks(&self) -> u64 {
        self.blocks.waiting() + self.blocks.leased() + self.outdated_blocks
    }

    /// Returns the number of pairs that are computed now, and of pairs that wait. Workers also lease the next pairs, which
    /// they read ahead.
    pub(super) fn computed_and_waiting(&self) -> [u64; 2] {
        let leased = self.jobs(JobStatus::Leased);
        let waiting = self.jobs(JobStatus::Ready) + self.jobs(JobStatus::Backoff);
        let jobs = |worker: &WorkerRecord| worker.metrics.as_ref().map(|metrics| metrics.jobs);
        let at_a_time: Option<u64> = self.workers.iter().map(jobs).sum();
        let computed = match at_a_time {
            Some(most) if self.is_running && most > 0 => leased.min(most),
            _ => leased,
        };
        [computed, waiting + leased - computed]
    }

    /// Returns the pairs that the present workers settle in a second, since they started.
    pub(super) fn rate(&self) -> Option<f64> {
        let rates = self.workers.iter().filter_map(|worker| {
            let metrics = worker.metrics.as_ref()?;
            let seconds = metrics.elapsed_ms as f64 / 1000.0;
            (seconds > 0.0).then(|| (metrics.done + metrics.failed) as f64 / seconds)
        });
        let rate: f64 = rates.sum();
        (rate > 0.0).then_some(rate)
    }

    pub(super) fn is_stopping(&self) -> bool {
        let now = now();
        let mut workers = self.workers.iter();
        self.is_running && workers.any(|worker| worker.state(now) == WorkerState::Stopping)
    }
}
