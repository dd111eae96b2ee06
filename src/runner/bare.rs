//! Pairs taken through their stages with no catalog beside them: what the cost of a run is measured against.

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

/// Takes pairs through all their stages and files what they give, on as many threads as a run would, and notes nothing
/// anywhere. Says how many were taken to the end, and for how long stages were computed, all threads together.
pub async fn bare(
    project: &Project,
    settings: &Settings,
    options: &RunOptions,
    pairs: Vec<PairAttributes>,
) -> (usize, Duration) {
    let steps: Arc<dyn StageExecutor> = Arc::new(PipelineExecutor::new(project, settings, options));
    let (mut slots, mut endings) = (JoinSet::new(), JoinSet::new());
    for attributes in pairs {
        if slots.len() >= options.workers.max(1)
            && let Some(Ok(filings)) = slots.join_next().await
        {
            endings.spawn(all_filed(filings));
        }
        let (steps, project) = (Arc::clone(&steps), project.clone());
        slots.spawn(through(steps, project, options.stage_timeout, attributes));
    }
    for filings in slots.join_all().await {
        endings.spawn(all_filed(filings));
    }
    let (mut done, mut at_work) = (0, Duration::ZERO);
    for (whole, took) in endings.join_all().await {
        done += usize::from(whole);
        at_work += took;
    }
    (done, at_work)
}

/// Files on their way to disk, whether they are there, and how long their stages took.
type Filings = (JoinSet<bool>, Duration);

/// Takes a pair through its stages; `None` where one fails.
async fn through(
    steps: Arc<dyn StageExecutor>,
    project: Project,
    limit: Duration,
    attributes: PairAttributes,
) -> Option<Filings> {
    let (stop, name) = (Stop::new(), attributes.name.clone());
    let (mut filings, mut at_work) = (JoinSet::new(), Duration::ZERO);
    let pair = Box::new(PairContext::new(PairWork {
        attributes,
        attributes_json: String::new(),
        results: Vec::new(),
    }));
    let mut computing = ComputeThread::start(&steps, Stage::Fit, pair, Stage::next).ok()?;
    loop {
        let (finished, next) = match computing.next_event(limit, &stop).await {
            ComputeEvent::Started(..) => continue,
            ComputeEvent::Finished(finished, next) => (finished, next),
            _ => return None,
        };
        at_work += finished.elapsed;
        let (project, name, stop) = (project.clone(), name.clone(), stop.clone());
        filings.spawn(async move {
            let of = (&name, finished.stage);
            let filed = write_files(&project, of, finished.files, limit, &stop).await;
            matches!(filed, Ok(true))
        });
        if next.is_none() {
            break;
        }
    }
    Some((filings, at_work))
}

async fn all_filed(filings: Option<Filings>) -> (bool, Duration) {
    match filings {
        Some((filings, at_work)) => {
            let filed = filings.join_all().await;
            (filed.into_iter().all(|filed| filed), at_work)
        }
        None => (false, Duration::ZERO),
    }
}
