//! Pairs taken through their stages with no catalog beside them: what the cost of a run is measured against.

use std::sync::Arc;

use tokio::task::JoinSet;

use super::execute::{Computed, Ended, compute};
use super::hand::PairInHand;
use super::options::RunOptions;
use super::pipeline::Pipeline;
use super::steps::Steps;
use super::stop::Stop;
use crate::catalog::{PairFacts, PairWork};
use crate::domain::Stage;
use crate::stages::Settings;
use crate::store::Project;

/// Takes pairs through all their stages and files what they give, on as many threads as a run would, and notes nothing
/// anywhere. Says how many were taken to the end.
pub async fn bare(
    project: &Project,
    settings: &Settings,
    options: &RunOptions,
    pairs: Vec<PairFacts>,
) -> usize {
    let steps: Arc<dyn Steps> = Arc::new(Pipeline::new(project, settings, options));
    let mut slots = JoinSet::new();
    let mut whole = 0;
    for facts in pairs {
        if slots.len() >= options.workers.max(1)
            && let Some(Ok(true)) = slots.join_next().await
        {
            whole += 1;
        }
        let limit = options.stage_limit;
        let (steps, project) = (Arc::clone(&steps), project.clone());
        slots.spawn(async move {
            let stop = Stop::new();
            let mut pair = Box::new(PairInHand::new(PairWork {
                facts,
                facts_text: String::new(),
                results: Vec::new(),
            }));
            for stage in Stage::ALL {
                pair = match compute(&steps, &project, stage, pair, limit, &stop).await {
                    Computed::Ended(pair, Ended::Filed(_), _) => pair,
                    _ => return false,
                };
            }
            true
        });
    }
    let rest = slots.join_all().await;
    whole + rest.into_iter().filter(|done| *done).count()
}
