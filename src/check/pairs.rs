//! One pair held against its rows and files.

use std::collections::BTreeSet;

use super::finding::{Finding, Kind};
use crate::catalog::{AuditedPair, AuditedResult, InputVersion};
use crate::domain::{
    ArtifactSet, ContentHash, JobStatus, PairId, RegisterOutcome, Stage, ThresholdMetric,
};
use crate::runner::result_hash;
use crate::store::{ArtifactError, InputError, Project, hash_input, stat_input};

/// What a look at a pair gave.
#[derive(Debug)]
pub(super) struct Look {
    pub(super) pair: PairId,
    pub(super) damage: Vec<Finding>,
    /// Hashes of all artifacts its rows name, those of stages to be done again too.
    pub(super) named: Vec<ContentHash>,
    /// Files that were looked at.
    pub(super) files: u64,
    pub(super) inputs_missing: Vec<String>,
    pub(super) inputs_changed: Vec<String>,
}

impl Look {
    /// The first stage to be done again.
    pub(super) fn back_to(&self) -> Option<Stage> {
        self.damage.iter().filter_map(|finding| finding.stage).min()
    }
}

/// Looks at a pair. Results of stages that are still before it are what an earlier turn left: they name files that
/// stay, and no more is asked of them.
pub(super) fn look(project: &Project, pair: &AuditedPair, quick: bool) -> Look {
    let state = state(pair);
    let mut look = Look {
        pair: pair.inputs.pair,
        damage: state.into_iter().map(|fault| fault.of(pair)).collect(),
        named: Vec::new(),
        files: 0,
        inputs_missing: Vec::new(),
        inputs_changed: Vec::new(),
    };
    for (stage, result) in &pair.results {
        let files: Option<ArtifactSet> = serde_json::from_str(&result.files).ok();
        let files = files.unwrap_or_default();
        look.named
            .extend(files.values().map(|artifact| artifact.hash));
        if !is_behind(pair, *stage) {
            continue;
        }
        look.files += files.len() as u64;
        for artifact in files.values() {
            if let Err(error) = project.check_artifact(artifact, quick) {
                look.damage.push(file(*stage, &error).of(pair));
            }
        }
    }
    inputs(project, pair, &mut look);
    look
}

/// Damage before the pair's name is put to it.
#[derive(Debug, PartialEq, Eq)]
struct Fault {
    kind: Kind,
    stage: Stage,
    what: String,
}

impl Fault {
    fn new(kind: Kind, stage: Stage, what: impl Into<String>) -> Self {
        let what = what.into();
        Self { kind, stage, what }
    }

    fn of(self, pair: &AuditedPair) -> Finding {
        Finding {
            kind: self.kind,
            pair: Some(pair.name.clone()),
            stage: Some(self.stage),
            what: self.what,
        }
    }
}

fn is_behind(pair: &AuditedPair, stage: Stage) -> bool {
    pair.job
        .is_some_and(|(_, cursor)| (stage.index() as i64) < cursor)
}

/// The pair's state against its rows.
fn state(pair: &AuditedPair) -> Vec<Fault> {
    let Some((status, cursor)) = pair.job else {
        return vec![Fault::new(Kind::JobMissing, Stage::Fit, "it has no job")];
    };
    let mut faults = Vec::new();
    for stage in Stage::ALL {
        if !is_behind(pair, stage) {
            continue;
        }
        match pair.results.get(&stage) {
            None => faults.push(Fault::new(
                Kind::ResultMissing,
                stage,
                "the result is missing",
            )),
            Some(result) if !has_its_hash(result) => faults.push(Fault::new(
                Kind::ResultChanged,
                stage,
                "the result is not what it was",
            )),
            Some(_) => {}
        }
    }
    let last = pair.results.get(&Stage::Register);
    if let (JobStatus::Done, Some(last)) = (status, last)
        && metrics_of(last).is_none_or(|metrics| metrics != pair.metrics)
    {
        let what = "its metrics are not those of its result";
        faults.push(Fault::new(Kind::Metrics, Stage::Register, what));
    }
    let failed = matches!(status, JobStatus::Backoff | JobStatus::Quarantined);
    let next = usize::try_from(cursor).ok().and_then(Stage::from_index);
    if let (true, false, Some(next)) = (failed, pair.has_failure, next) {
        let what = "it failed, and nothing says why";
        faults.push(Fault::new(Kind::ReasonMissing, next, what));
    }
    faults
}

/// Whether numbers and files of a result are those it was stored with.
fn has_its_hash(result: &AuditedResult) -> bool {
    serde_json::from_str(&result.files)
        .is_ok_and(|files| result_hash(&result.outcome, &files) == result.result_hash)
}

fn metrics_of(result: &AuditedResult) -> Option<BTreeSet<ThresholdMetric>> {
    let outcome: RegisterOutcome = serde_json::from_str(&result.outcome).ok()?;
    Some(outcome.metrics.iter().map(|metric| metric.metric).collect())
}

fn file(stage: Stage, error: &ArtifactError) -> Fault {
    let kind = match error {
        ArtifactError::Missing(_) => Kind::FileMissing,
        ArtifactError::Changed(_) => Kind::FileChanged,
        ArtifactError::Io { .. } => Kind::FileUnreadable,
    };
    Fault::new(kind, stage, error.to_string())
}

/// Input files that are gone or no longer what was read: no damage, a run takes care of them.
fn inputs(project: &Project, pair: &AuditedPair, look: &mut Look) {
    let known = &pair.inputs;
    for (stored, seen) in [
        (&known.mesh_path, known.mesh.as_ref()),
        (&known.print_path, known.print.as_ref()),
    ] {
        let path = project.input_path(stored);
        let said = || format!("{} of {}", path.display(), pair.name);
        match stat_input(&path) {
            Err(InputError::NotThere(_)) => look.inputs_missing.push(said()),
            Err(_) => look.inputs_changed.push(said()),
            Ok(stat) => {
                let moved = |seen: &&InputVersion| seen.stat != stat.as_str();
                let changed = seen.filter(moved).is_some_and(|seen| {
                    hash_input(&path).map_or(true, |found| found.hash != seen.hash)
                });
                if changed {
                    look.inputs_changed.push(said());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::{Kind, result_hash, state};
    use crate::catalog::{AuditedPair, AuditedResult, KnownInputs};
    use crate::domain::{ArtifactSet, JobStatus, PairId, Stage};

    fn pair(status: JobStatus, cursor: i64) -> AuditedPair {
        let outcome = r#"{"metrics":[]}"#.to_owned();
        let result = AuditedResult {
            result_hash: result_hash(&outcome, &ArtifactSet::new()),
            outcome,
            files: "{}".to_owned(),
        };
        AuditedPair {
            name: "a".parse().expect("valid id"),
            inputs: KnownInputs {
                pair: PairId(1),
                mesh_path: "a.stl".to_owned(),
                mesh: None,
                print_path: "a.png".to_owned(),
                print: None,
            },
            job: Some((status, cursor)),
            has_failure: false,
            results: Stage::ALL.map(|stage| (stage, result.clone())).into(),
            metrics: BTreeSet::new(),
        }
    }

    fn found(pair: &AuditedPair) -> Vec<(Kind, Stage)> {
        state(pair)
            .iter()
            .map(|fault| (fault.kind, fault.stage))
            .collect()
    }

    #[test]
    fn a_pair_that_has_what_it_should_is_sound_at_every_stage() {
        for cursor in 0..4 {
            assert_eq!(found(&pair(JobStatus::Ready, cursor)), []);
        }
        assert_eq!(found(&pair(JobStatus::Done, 4)), []);
        let mut new = pair(JobStatus::Ready, 0);
        new.results = BTreeMap::new();
        assert_eq!(found(&new), []);
    }

    #[test]
    fn only_results_behind_a_pair_are_asked_for() {
        let mut broken = pair(JobStatus::Ready, 2);
        broken.results.remove(&Stage::Depth);
        broken.results.remove(&Stage::Normalize);
        assert_eq!(found(&broken), [(Kind::ResultMissing, Stage::Depth)]);
        let mut changed = pair(JobStatus::Done, 4);
        let fit = changed.results.get_mut(&Stage::Fit).expect("a result");
        fit.outcome.push(' ');
        assert_eq!(found(&changed), [(Kind::ResultChanged, Stage::Fit)]);
    }

    #[test]
    fn a_pair_without_job_reason_or_metrics_is_told() {
        let mut lost = pair(JobStatus::Ready, 0);
        lost.job = None;
        assert_eq!(found(&lost), [(Kind::JobMissing, Stage::Fit)]);
        let mut failed = pair(JobStatus::Quarantined, 1);
        assert_eq!(found(&failed), [(Kind::ReasonMissing, Stage::Depth)]);
        failed.has_failure = true;
        assert_eq!(found(&failed), []);
        let mut done = pair(JobStatus::Done, 4);
        done.metrics
            .insert(crate::domain::ThresholdMetric::Ensemble);
        assert_eq!(found(&done), [(Kind::Metrics, Stage::Register)]);
    }
}
