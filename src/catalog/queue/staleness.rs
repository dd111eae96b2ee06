//! Which pairs must run again because their settings or inputs changed, and why.

use std::collections::BTreeMap;

use serde_json::{Map, Value};
use sqlx::sqlite::SqliteRow;
use sqlx::{Row as _, SqliteConnection};

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::alike;
use crate::catalog::queue::claim::PairSelection;
use crate::catalog::queue::fingerprint::{Fingerprints, current_json};
use crate::catalog::queue::plan::{FieldChange, Plan, PlanEntry, StaleReason};
use crate::catalog::records::import;
use crate::domain::{JobStatus, PairName, Stage};

/// Pairs looked at in one statement.
pub(crate) const PAGE: usize = 10_000;

/// What to run again besides what changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RerunPolicy {
    /// Nothing.
    Changed,
    /// Pairs that failed.
    Failed,
    /// Every pair, from a stage on.
    All(Stage),
}

/// Each job with its first result that was made otherwise than it would be now.
pub(crate) const LOOK: &str = "
WITH seen AS (
    SELECT j.pair, j.stage, j.status, p.mesh_hash, p.print_hash, p.attributes, (
        SELECT min(r.stage) FROM stage_result AS r WHERE r.pair = j.pair AND r.stage < j.stage AND (
            r.fingerprint <> (?1 ->> r.stage) OR r.mesh_hash <> p.mesh_hash OR r.print_hash <> p.print_hash
            OR r.attributes <> p.attributes)) AS first
    FROM (SELECT value FROM json_each(?4)) AS wanted CROSS JOIN job AS j ON j.pair = wanted.value
        JOIN pair AS p ON p.id = j.pair WHERE j.pair > ?2 ORDER BY j.pair LIMIT ?3)
SELECT seen.pair, seen.stage, seen.status, seen.first, r.fingerprint,
    coalesce(r.mesh_hash <> seen.mesh_hash, 0) AS mesh, coalesce(r.print_hash <> seen.print_hash, 0) AS print,
    coalesce(r.attributes <> seen.attributes, 0) AS attributes,
    coalesce(f.fingerprint <> (?1 ->> f.stage), 0) OR coalesce(f.mesh_hash <> seen.mesh_hash, 0)
        OR coalesce(f.print_hash <> seen.print_hash, 0) OR coalesce(f.attributes <> seen.attributes, 0) AS otherwise
FROM seen LEFT JOIN stage_result AS r ON r.pair = seen.pair AND r.stage = seen.first
    LEFT JOIN failure AS f ON f.pair = seen.pair ORDER BY seen.pair";

/// A job as the look found it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) pair: i64,
    pub(crate) cursor: i64,
    pub(crate) status: JobStatus,
    /// First stage whose result would be made otherwise now, and what changed.
    change: Option<(Stage, Cause)>,
    /// Whether its failure was of other settings or inputs than the current ones.
    otherwise: bool,
}

/// A reason before its field changes are looked up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Cause {
    New,
    Unfinished,
    BackingOff,
    FailedBefore,
    Settings(Stage, i64),
    Mesh,
    Print,
    Manifest,
    Asked,
}

/// Where a job would start and why; `None` when it stays as it is.
pub(crate) fn decide(seen: &Seen, again: RerunPolicy) -> Option<(Stage, Cause)> {
    let next = usize::try_from(seen.cursor)
        .ok()
        .and_then(Stage::from_index);
    if seen.status == JobStatus::Leased {
        return None;
    }
    let asked = match again {
        RerunPolicy::All(from) => Some((next.map_or(from, |next| next.min(from)), Cause::Asked)),
        RerunPolicy::Failed if seen.status == JobStatus::Quarantined => {
            next.map(|at| (at, Cause::Asked))
        }
        RerunPolicy::Failed | RerunPolicy::Changed => None,
    };
    // The earlier start wins; between equals the change says more than the asking.
    match (seen.change, asked) {
        (Some(changed), Some(asked)) if asked.0 < changed.0 => return Some(asked),
        (Some(changed), _) => return Some(changed),
        (None, Some(asked)) => return Some(asked),
        (None, None) => {}
    }
    let cause = match seen.status {
        JobStatus::Ready if seen.cursor == 0 => Cause::New,
        JobStatus::Ready => Cause::Unfinished,
        JobStatus::Backoff => Cause::BackingOff,
        JobStatus::Quarantined if seen.otherwise => Cause::FailedBefore,
        JobStatus::Quarantined | JobStatus::Done | JobStatus::Leased => return None,
    };
    next.map(|at| (at, cause))
}

/// Looks at the next of some jobs after a pair.
pub(crate) async fn look(
    conn: &mut SqliteConnection,
    current: &str,
    after: i64,
    among: &PairSelection,
) -> Result<Vec<Seen>> {
    let query = sqlx::query(LOOK).bind(current).bind(after);
    let query = query.bind(PAGE as i64).bind(&among.json);
    query.fetch_all(conn).await?.iter().map(seen).collect()
}

fn seen(row: &SqliteRow) -> Result<Seen> {
    let first: Option<i64> = row.try_get("first")?;
    let change = match first.map(rows::stage).transpose()? {
        Some(stage) => Some((stage, changed(row, stage)?)),
        None => None,
    };
    Ok(Seen {
        pair: row.try_get("pair")?,
        cursor: row.try_get("stage")?,
        status: rows::status(row.try_get("status")?)?,
        change,
        otherwise: row.try_get("otherwise")?,
    })
}

/// What the first result that would be made otherwise differs in. Inputs go before settings: they say more.
fn changed(row: &SqliteRow, stage: Stage) -> Result<Cause> {
    Ok(if row.try_get("mesh")? {
        Cause::Mesh
    } else if row.try_get("print")? {
        Cause::Print
    } else if row.try_get("attributes")? {
        Cause::Manifest
    } else {
        Cause::Settings(stage, row.try_get("fingerprint")?)
    })
}

impl Catalog {
    /// What a run with these settings would do with the pairs named, or with all.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn plan(
        &self,
        fingerprints: &Fingerprints,
        names: Option<&[PairName]>,
        again: RerunPolicy,
    ) -> Result<Plan> {
        let mut conn = self.snapshot().await?;
        let among = match names {
            Some(names) => Some(import::select(&mut conn, names).await?),
            None => None,
        };
        plan(&mut conn, fingerprints, among.as_ref(), again).await
    }

    /// Pairs with results that were made with other settings or inputs than those of now.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn stale(&self, fingerprints: &Fingerprints) -> Result<u64> {
        let mut conn = self.read_conn().await?;
        alike::stale(&mut conn, fingerprints).await
    }

    /// Why a pair would run, and from which stage; `None` when nothing is left to do.
    ///
    /// # Errors
    /// When there is no such pair.
    pub async fn why(
        &self,
        pair: &PairName,
        fingerprints: &Fingerprints,
    ) -> Result<Option<PlanEntry>> {
        let mut conn = self.snapshot().await?;
        let among = import::select(&mut conn, std::slice::from_ref(pair)).await?;
        if among.is_empty() {
            return Err(CatalogError::UnknownPair(pair.clone()));
        }
        let plan = plan(&mut conn, fingerprints, Some(&among), RerunPolicy::Changed).await?;
        Ok(plan.entries.into_iter().next())
    }
}

async fn plan(
    conn: &mut SqliteConnection,
    fingerprints: &Fingerprints,
    among: Option<&PairSelection>,
    again: RerunPolicy,
) -> Result<Plan> {
    let current = current_json(conn, fingerprints).await?;
    let mut plan = Plan::default();
    let mut entries: BTreeMap<(Stage, Cause), u64> = BTreeMap::new();
    let mut take = |seen: &Seen, pairs: u64| match decide(seen, again) {
        Some(key) => *entries.entry(key).or_default() += pairs,
        None => plan.stays(seen.status, pairs),
    };
    match among {
        Some(among) => look_at(conn, &current, among, &mut take).await?,
        None => alike::look_at_all(conn, &current, &mut take).await?,
    }
    for ((from, cause), pairs) in entries {
        let why = reason(conn, fingerprints, cause).await?;
        plan.entries.push(PlanEntry { from, why, pairs });
    }
    Ok(plan)
}

/// Gives the state of each of some pairs to `each`.
async fn look_at(
    conn: &mut SqliteConnection,
    current: &str,
    among: &PairSelection,
    mut each: impl FnMut(&Seen, u64),
) -> Result<()> {
    let mut after = 0;
    loop {
        let page = look(conn, current, after, among).await?;
        let Some(last) = page.last() else {
            return Ok(());
        };
        after = last.pair;
        for seen in &page {
            each(seen, 1);
        }
    }
}

async fn reason(
    conn: &mut SqliteConnection,
    fingerprints: &Fingerprints,
    cause: Cause,
) -> Result<StaleReason> {
    Ok(match cause {
        Cause::New => StaleReason::New,
        Cause::Unfinished => StaleReason::Unfinished,
        Cause::BackingOff => StaleReason::BackingOff,
        Cause::FailedBefore => StaleReason::FailedBefore,
        Cause::Mesh => StaleReason::Mesh,
        Cause::Print => StaleReason::Print,
        Cause::Manifest => StaleReason::Manifest,
        Cause::Asked => StaleReason::Asked,
        Cause::Settings(stage, fingerprint) => {
            let fields: String = sqlx::query_scalar("SELECT fields FROM fingerprint WHERE id = ?1")
                .bind(fingerprint)
                .fetch_one(conn)
                .await?;
            let old: Value = serde_json::from_str(&fields)?;
            let changes = differences(stage, &old, &fingerprints.of(stage).fields);
            StaleReason::Settings { stage, changes }
        }
    })
}

/// Leaves that differ between two fingerprints' fields, by name: `register.max_scale`.
pub(crate) fn differences(stage: Stage, old: &Value, new: &Value) -> Vec<FieldChange> {
    let (old, new) = (leaves(stage, old), leaves(stage, new));
    let names = old.keys().chain(new.keys());
    let names: std::collections::BTreeSet<_> = names.collect();
    names
        .into_iter()
        .filter(|name| old.get(*name) != new.get(*name))
        .map(|name| FieldChange {
            field: name.clone(),
            old: old.get(name).cloned(),
            new: new.get(name).cloned(),
        })
        .collect()
}

/// Every value that is no object, by its path without the word "settings".
fn leaves(stage: Stage, fields: &Value) -> Map<String, Value> {
    let mut found = Map::new();
    let mut open = vec![(stage.name().to_owned(), fields)];
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Object(inner) => {
                for (key, value) in inner {
                    let path = if key == "settings" {
                        path.clone()
                    } else {
                        format!("{path}.{key}")
                    };
                    open.push((path, value));
                }
            }
            Value::Null
            | Value::Bool(_)
            | Value::Number(_)
            | Value::String(_)
            | Value::Array(_) => {
                found.insert(path, value.clone());
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{Cause, RerunPolicy, Seen, decide, differences};
    use crate::domain::{JobStatus, Stage};

    fn seen(cursor: i64, status: JobStatus) -> Seen {
        Seen {
            pair: 1,
            cursor,
            status,
            change: None,
            otherwise: false,
        }
    }

    #[test]
    fn a_changed_setting_is_named_with_old_and_new() {
        let old = json!({ "revision": 1, "settings": { "max_scale": 1.2, "seed": 0 } });
        let new = json!({ "revision": 1, "settings": { "max_scale": 1.3, "seed": 0 } });
        let changes = differences(Stage::Register, &old, &new);
        let text: Vec<_> = changes.iter().map(ToString::to_string).collect();
        assert_eq!(text, ["register.max_scale: 1.2 -> 1.3"]);
    }

    #[test]
    fn a_pair_that_is_done_and_unchanged_stays() {
        let done = seen(4, JobStatus::Done);
        assert_eq!(decide(&done, RerunPolicy::Changed), None);
        assert_eq!(decide(&done, RerunPolicy::Failed), None);
        let all = decide(&done, RerunPolicy::All(Stage::Depth));
        assert_eq!(all, Some((Stage::Depth, Cause::Asked)));
    }

    #[test]
    fn the_first_changed_stage_is_where_it_starts() {
        let mut print_changed = seen(4, JobStatus::Done);
        print_changed.change = Some((Stage::Normalize, Cause::Print));
        let found = decide(&print_changed, RerunPolicy::All(Stage::Register));
        assert_eq!(found, Some((Stage::Normalize, Cause::Print)));
    }

    #[test]
    fn a_failure_of_other_settings_is_no_failure_of_these() {
        let mut failed = seen(1, JobStatus::Quarantined);
        assert_eq!(decide(&failed, RerunPolicy::Changed), None);
        failed.otherwise = true;
        let found = decide(&failed, RerunPolicy::Changed);
        assert_eq!(found, Some((Stage::Depth, Cause::FailedBefore)));
    }
}
