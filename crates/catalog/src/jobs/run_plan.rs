//! Plans of runs: which pairs a run would process, from which stage, and why.

use std::collections::BTreeMap;

use crate::db::conn::Conn;
use crate::jobs::fingerprint::{
    FingerprintChains, Fingerprints, current_json, differences, fields_of,
};
use crate::jobs::plan::{Plan, PlanEntry, StaleReason};
use crate::jobs::staleness::{RerunPolicy, StaleJob, count_stale, decide, inspect, inspect_all};
use crate::queue::selection::{PairSelection, select};
use crate::{Catalog, CatalogError, Result};
use mocban_core::domain::{PairName, Stage};

impl Catalog {
    /// Plans a run with these settings for the selected pairs, or for all.
    pub async fn plan(
        &self,
        fingerprints: &Fingerprints,
        selection: Option<&PairSelection>,
        policy: RerunPolicy,
    ) -> Result<Plan> {
        let mut conn = self.snapshot().await?;
        plan(&mut conn, fingerprints, selection, policy).await
    }

    /// Counts the pairs that have a result with outdated settings or inputs.
    pub async fn count_stale(&self, fingerprints: &Fingerprints) -> Result<u64> {
        let mut conn = self.snapshot().await?;
        let current = current_json(&mut conn, fingerprints).await?;
        count_stale(&mut conn, &current).await
    }

    /// Returns from which stage a run would process a pair, and why. Returns `None` if the run would skip the pair.
    ///
    /// # Errors
    /// Returns an error if there is no such pair, or if a database operation fails.
    pub async fn why(
        &self,
        pair: &PairName,
        fingerprints: &Fingerprints,
    ) -> Result<Option<PlanEntry>> {
        let mut conn = self.snapshot().await?;
        let selection = select(&mut conn, std::slice::from_ref(pair)).await?;
        if selection.is_empty() {
            return Err(CatalogError::UnknownPair(pair.clone()));
        }
        let plan = plan(
            &mut conn,
            fingerprints,
            Some(&selection),
            RerunPolicy::Changed,
        )
        .await?;
        Ok(plan.entries.into_iter().next())
    }
}

async fn plan(
    conn: &mut Conn,
    fingerprints: &Fingerprints,
    selection: Option<&PairSelection>,
    policy: RerunPolicy,
) -> Result<Plan> {
    let current = current_json(conn, fingerprints).await?;
    let mut plan = Plan::default();
    let mut entries: BTreeMap<(Stage, StaleReason), u64> = BTreeMap::new();
    let mut add = |job: &StaleJob, pairs: u64| match decide(job, policy) {
        Some(key) => *entries.entry(key).or_default() += pairs,
        None => plan.add_unchanged(job.key.status, pairs),
    };
    if let Some(selection) = selection {
        let mut after = Some(0);
        while let Some(from) = after {
            let page = inspect(conn, &current, from, selection).await?;
            after = page.last().map(|(pair, _)| *pair);
            for (_, job) in &page {
                add(job, 1);
            }
        }
    } else {
        let chains = FingerprintChains::load(conn, fingerprints).await?;
        inspect_all(conn, &current, &chains, &mut add).await?;
    }
    for ((from, why), pairs) in entries {
        let changes = match why {
            StaleReason::Settings { stage, old } => {
                let old = fields_of(conn, old).await?;
                Some(differences(
                    stage.name(),
                    &old,
                    &fingerprints.of(stage).fields,
                ))
            }
            _ => None,
        };
        plan.entries.push(PlanEntry {
            from,
            why,
            changes,
            pairs,
        });
    }
    Ok(plan)
}
