//! Runs pairs without a catalog: the baseline with which `benches/queue` measures what the catalog costs.

use std::sync::Arc;
use std::time::Duration;

use tokio::task::JoinSet;

use super::checkpointer::write_files;
use super::compute_thread::{ComputeEvent, ComputeThread};
use super::options::RunOptions;
use super::pair_context::PairContext;
use super::stage_executor::{PipelineExecutor, StageExecutor};
use super::stop::Stop;
use crate::catalog::{PairAttributes, PairWork};
use crate::domain::Stage;
use crate::stages::Settings;
use crate::store::Project;

/// Computes all stages of the pairs and writes their files, on as many threads as a run. Returns how many pairs were
/// completed, and the time that stages were computed, all threads together.
pub async fn run_without_catalog(
    project: &Project,
    settings: &Settings,
    options: &RunOptions,
    pairs: Vec<PairAttributes>,
) -> (usize, Duration) {
    let executor: Arc<dyn StageExecutor> =
        Arc::new(PipelineExecutor::new(project, settings, options));
    let (mut computing, mut writing) = (JoinSet::new(), JoinSet::new());
    for attributes in pairs {
        if computing.len() >= options.workers.max(1)
            && let Some(Ok(computed)) = computing.join_next().await
        {
            writing.spawn(all_written(computed));
        }
        let (executor, project) = (Arc::clone(&executor), project.clone());
        computing.spawn(compute(
            executor,
            project,
            options.stage_timeout,
            attributes,
        ));
    }
    for computed in computing.join_all().await {
        writing.spawn(all_written(computed));
    }
    let (mut done, mut compute_time) = (0, Duration::ZERO);
    for (is_complete, elapsed) in writing.join_all().await {
        done += usize::from(is_complete);
        compute_time += elapsed;
    }
    (done, compute_time)
}

/// The tasks that write a pair's files, and the time that its stages were computed.
type ComputedPair = (JoinSet<bool>, Duration);

/// Computes the stages of a pair; returns `None` when one fails.
async fn compute(
    executor: Arc<dyn StageExecutor>,
    project: Project,
    timeout: Duration,
    attributes: PairAttributes,
) -> Option<ComputedPair> {
    let (stop, name) = (Stop::new(), attributes.name.clone());
    let (mut writing, mut compute_time) = (JoinSet::new(), Duration::ZERO);
    let pair = Box::new(PairContext::new(PairWork {
        attributes,
        attributes_json: String::new(),
        results: Vec::new(),
    }));
    let mut thread = ComputeThread::start(&executor, Stage::Fit, pair, Stage::next).ok()?;
    loop {
        let (computed, next) = match thread.next_event(timeout, &stop).await {
            ComputeEvent::Started(..) => continue,
            ComputeEvent::Finished(computed, next) => (computed, next),
            _ => return None,
        };
        compute_time += computed.elapsed;
        let (project, name, stop) = (project.clone(), name.clone(), stop.clone());
        writing.spawn(async move {
            let id = (&name, computed.stage);
            let written = write_files(&project, id, computed.files, timeout, &stop).await;
            matches!(written, Ok(true))
        });
        if next.is_none() {
            return Some((writing, compute_time));
        }
    }
}

/// Waits until a pair's files are written; returns whether all are, and the time that its stages were computed.
async fn all_written(computed: Option<ComputedPair>) -> (bool, Duration) {
    match computed {
        Some((writing, compute_time)) => {
            let written = writing.join_all().await;
            (written.into_iter().all(|written| written), compute_time)
        }
        None => (false, Duration::ZERO),
    }
}
