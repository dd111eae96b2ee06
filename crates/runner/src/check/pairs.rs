//! Checks one pair: its rows against each other and against its files.

use std::collections::BTreeMap;

use super::finding::{Finding, Kind};
use crate::{metric_results, result_hash};
use mocban_catalog::{AuditedPair, AuditedResult, InputVersion};
use mocban_core::domain::{
    ArtifactRef, ArtifactSet, ContentHash, JobStatus, PairId, RegisterOutcome, Stage,
    ThresholdMetric,
};
use mocban_store::{ArtifactError, InputError, Project, hash_input, stat_input};

/// Result of the check of one pair.
#[derive(Debug)]
pub(super) struct PairCheck {
    pub(super) pair: PairId,
    pub(super) damage: Vec<Finding>,
    /// Hashes of all artifacts that the pair's rows reference, including rows of stages that will run again.
    pub(super) named: Vec<ArtifactRef>,
    /// Number of files checked.
    pub(super) files: u64,
    /// Whether `named` is complete. If not, a result is so damaged that its files are unknown.
    pub(super) names_all: bool,
    pub(super) inputs_missing: Vec<String>,
    pub(super) inputs_changed: Vec<String>,
    pub(super) inputs_unreadable: Vec<String>,
}

impl PairCheck {
    /// Returns the first stage with damage that a run repairs, from which the pair must run again.
    fn damaged_from(&self) -> Option<Stage> {
        let damage = self.damage.iter();
        let damage = damage.filter(|finding| finding.kind.is_repairable());
        damage.filter_map(|finding| finding.stage).min()
    }

    /// Returns the stage from which a repair queues the pair again. Returns `None` if the pair is not damaged, or if an
    /// input is missing or unreadable: a run could then not recompute the results that the repair removes.
    pub(super) fn back_to(&self) -> Option<Stage> {
        let can_run = self.inputs_missing.is_empty() && self.inputs_unreadable.is_empty();
        self.damaged_from().filter(|_| can_run)
    }

    /// Returns whether the pair is damaged, and a repair cannot queue it again because of an input.
    pub(super) fn lacks_inputs(&self) -> bool {
        self.damaged_from().is_some() && self.back_to().is_none()
    }
}

/// Checks the rows and files of a pair. With `quick`, checks only the length of each file. Results of stages that will
/// run again (from the job's cursor on) are not checked, but their files count as referenced.
///
/// # Errors
/// Returns an error if no artifact can be read, for example because the object store refuses the request.
pub(super) fn check_pair(
    project: &Project,
    pair: &AuditedPair,
    quick: bool,
) -> Result<PairCheck, ArtifactError> {
    let mut check = PairCheck {
        pair: pair.inputs.pair,
        damage: state(pair),
        named: Vec::new(),
        files: 0,
        names_all: true,
        inputs_missing: Vec::new(),
        inputs_changed: Vec::new(),
        inputs_unreadable: Vec::new(),
    };
    // The files of a pair that was cut from a block are artifacts of the block.
    let cut = [&pair.inputs.mesh_path, &pair.inputs.print_path]
        .into_iter()
        .filter_map(|path| ArtifactRef::at_path(path));
    check.named.extend(cut);
    for (stage, result) in &pair.results {
        let files: Option<ArtifactSet> = serde_json::from_str(&result.files).ok();
        check.names_all &= files.is_some();
        let files = files.unwrap_or_default();
        check.named.extend(files.values().cloned());
        if !is_before_cursor(pair, *stage) {
            continue;
        }
        check.files += files.len() as u64;
        for artifact in files.values() {
            if let Err(error) = project.check_artifact(artifact, quick) {
                let text = error.to_string();
                check
                    .damage
                    .push(damage(pair, kind_of(error)?, *stage, text));
            }
        }
    }
    inputs(project, pair, &mut check);
    Ok(check)
}

/// Returns the kind of damage of an artifact.
///
/// # Errors
/// Returns the error if it does not concern this artifact alone.
pub(super) fn kind_of(error: ArtifactError) -> Result<Kind, ArtifactError> {
    match error {
        ArtifactError::Missing(_) => Ok(Kind::FileMissing),
        ArtifactError::Changed(_) => Ok(Kind::FileChanged),
        error if error.concerns_one_file() => Ok(Kind::FileUnreadable),
        error => Err(error),
    }
}

fn is_before_cursor(pair: &AuditedPair, stage: Stage) -> bool {
    pair.job
        .is_some_and(|(_, cursor)| (stage.index() as i64) < cursor)
}

/// Describes damage of a pair that a run from `stage` on repairs.
fn damage(pair: &AuditedPair, kind: Kind, stage: Stage, what: impl Into<String>) -> Finding {
    Finding {
        kind,
        pair: Some(pair.name.clone()),
        stage: Some(stage),
        what: what.into(),
    }
}

/// Checks that the rows of the pair agree with the state of its job.
fn state(pair: &AuditedPair) -> Vec<Finding> {
    let Some((status, cursor)) = pair.job else {
        if pair.is_retired {
            return Vec::new();
        }
        return vec![damage(pair, Kind::JobMissing, Stage::Fit, "it has no job")];
    };
    let mut found = Vec::new();
    let mut add = |kind, stage, what| found.push(damage(pair, kind, stage, what));
    for stage in Stage::ALL {
        match pair.results.get(&stage) {
            _ if !is_before_cursor(pair, stage) => {}
            None => add(Kind::ResultMissing, stage, "the result is missing"),
            Some(result) if !has_its_hash(result) => {
                add(
                    Kind::ResultChanged,
                    stage,
                    "the result differs from its hash",
                );
            }
            Some(_) => {}
        }
    }
    let last = pair.results.get(&Stage::Register);
    // If the depth row is missing, a repair reruns the depth stage and replaces the metrics, so they need no check.
    if let (JobStatus::Done, Some(last)) = (status, last)
        && pair.results.contains_key(&Stage::Depth)
        && metrics_of(pair, last).is_none_or(|metrics| metrics != pair.metrics)
    {
        add(
            Kind::Metrics,
            Stage::Register,
            "its metrics differ from its result",
        );
    }
    let failed = matches!(status, JobStatus::Backoff | JobStatus::Quarantined);
    let next = usize::try_from(cursor).ok().and_then(Stage::from_index);
    if let (true, false, Some(next)) = (failed, pair.has_failure, next) {
        add(
            Kind::ReasonMissing,
            next,
            "it failed, but the reason is missing",
        );
    }
    found
}

/// Returns whether the outcome and files of a result match the stored result hash.
fn has_its_hash(result: &AuditedResult) -> bool {
    serde_json::from_str(&result.files)
        .is_ok_and(|files| result_hash(&result.outcome, &files) == result.result_hash)
}

/// Returns the hash of each metric's result, derived from the results of the register and depth stages.
fn metrics_of(
    pair: &AuditedPair,
    register: &AuditedResult,
) -> Option<BTreeMap<ThresholdMetric, ContentHash>> {
    let outcome: RegisterOutcome = serde_json::from_str(&register.outcome).ok()?;
    let files = serde_json::from_str(&register.files).ok()?;
    let depth = pair.results.get(&Stage::Depth);
    let depth: Option<ArtifactSet> =
        depth.and_then(|depth| serde_json::from_str(&depth.files).ok());
    let results = metric_results(&outcome.metrics, &files, depth.as_ref()).into_iter();
    let hashes = results.map(|result| (result.outcome.metric, result.result_hash));
    Some(hashes.collect())
}

/// Lists input files that are missing, unreadable or changed since they were read. They are not damage, because a run
/// handles them.
fn inputs(project: &Project, pair: &AuditedPair, check: &mut PairCheck) {
    let known = &pair.inputs;
    for (stored, seen) in [
        (&known.mesh_path, known.mesh.as_ref()),
        (&known.print_path, known.print.as_ref()),
    ] {
        let input = project.input(stored);
        let unreadable = |error: &InputError| format!("{error} ({})", pair.name);
        let note = || format!("{} of {}", input.path().display(), pair.name);
        match stat_input(&input) {
            // A run of its block writes the file again: the check of the block reports it.
            Err(InputError::NotThere(_)) if ArtifactRef::at_path(stored).is_some() => {}
            Err(InputError::NotThere(_)) => check.inputs_missing.push(note()),
            Err(error) => check.inputs_unreadable.push(unreadable(&error)),
            Ok(stat) => {
                // A file that was not there was not read. With a new path, it keeps the hash of nothing.
                let unread = InputVersion::gone().hash;
                let is_other = |seen: &&InputVersion| seen.hash != unread && seen.stat != stat;
                let Some(seen) = seen.filter(is_other) else {
                    continue;
                };
                match hash_input(&input) {
                    Ok(found) if found.hash == seen.hash => {}
                    Ok(_) => check.inputs_changed.push(note()),
                    Err(error) => check.inputs_unreadable.push(unreadable(&error)),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Kind, result_hash, state};
    use mocban_catalog::{AuditedPair, AuditedResult, KnownInputs};
    use mocban_core::domain::{
        ArtifactSet, ContentHash, JobStatus, PairId, Stage, ThresholdMetric,
    };

    fn pair(status: JobStatus, cursor: i64) -> AuditedPair {
        let outcome = r#"{"ink":0,"metrics":[]}"#.to_owned();
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
            is_retired: false,
            results: Stage::ALL.map(|stage| (stage, result.clone())).into(),
            metrics: BTreeMap::new(),
        }
    }

    fn found(pair: &AuditedPair) -> Vec<(Kind, Stage)> {
        let found = state(pair).into_iter();
        let found = found.map(|finding| (finding.kind, finding.stage.expect("a stage")));
        found.collect()
    }

    #[test]
    fn a_complete_pair_is_sound_at_every_stage() {
        for cursor in 0..4 {
            assert_eq!(found(&pair(JobStatus::Ready, cursor)), []);
        }
        assert_eq!(found(&pair(JobStatus::Done, 4)), []);
        let mut new = pair(JobStatus::Ready, 0);
        new.results = BTreeMap::new();
        assert_eq!(found(&new), []);
    }

    #[test]
    fn only_results_before_the_cursor_are_required() {
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
    fn a_missing_job_reason_or_metric_is_reported() {
        let mut lost = pair(JobStatus::Ready, 0);
        lost.job = None;
        assert_eq!(found(&lost), [(Kind::JobMissing, Stage::Fit)]);
        let mut failed = pair(JobStatus::Quarantined, 1);
        assert_eq!(found(&failed), [(Kind::ReasonMissing, Stage::Depth)]);
        failed.has_failure = true;
        assert_eq!(found(&failed), []);
        let mut done = pair(JobStatus::Done, 4);
        done.metrics
            .insert(ThresholdMetric::Ensemble, ContentHash::of(b""));
        assert_eq!(found(&done), [(Kind::Metrics, Stage::Register)]);
    }
}
