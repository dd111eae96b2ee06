//! Checkpoints of faked stages, which compute nothing.

use std::time::Instant;

use mocban::catalog::{BlockSettings, Catalog, ClaimRequest, WorkerInfo, WorkerSettings};
use mocban::catalog::{
    CheckpointOutcome, FingerprintIds, Fingerprints, InputVersion, InputVersions, Lease,
    MetricResult, PairProvenance, StageCheckpoint,
};
use mocban::domain::{
    Affine2, ArtifactSet, ContentHash, Disagreement, MetricOutcome, RegisterOutcome, Scores, Stage,
    ThresholdMetric, WorkerId,
};
use mocban::runner::{metric_results, result_hash};
use mocban::store::{Project, hash_input};
use serde_json::json;

/// Manifest attributes that results depend on, in the catalog's form.
pub(super) const ATTRIBUTES: &str = r#"{"scanned_face_down":null,"unit":null}"#;

/// Faked stages with the fingerprints and inputs of a project.
#[derive(Debug, Clone)]
pub(super) struct Fake {
    pub(super) worker: WorkerId,
    fingerprints: FingerprintIds,
    /// A checkpoint of each stage, the same for all pairs.
    checkpoints: Vec<StageCheckpoint>,
}

/// Returns the settings of a worker that works on no blocks.
fn settings(fingerprints: FingerprintIds) -> WorkerSettings {
    WorkerSettings {
        fingerprints,
        blocks: BlockSettings::new(|_| json!({})),
    }
}

impl Fake {
    /// Registers a worker.
    pub(super) async fn register(
        project: &Project,
        catalog: &Catalog,
        fingerprints: &Fingerprints,
    ) -> anyhow::Result<Self> {
        let fingerprints = catalog.register_fingerprints(fingerprints).await?;
        let info = WorkerInfo {
            host: "bench".to_owned(),
            pid: std::process::id(),
            boot_id: None,
        };
        let inputs = [input(project, "mesh.stl")?, input(project, "print.png")?];
        Ok(Self {
            worker: catalog
                .register_worker(info, settings(fingerprints), 1)
                .await?,
            fingerprints,
            checkpoints: checkpoints(fingerprints, &inputs),
        })
    }

    /// Registers a worker without a project's files.
    pub(super) async fn without_files(
        catalog: &Catalog,
        fingerprints: &Fingerprints,
    ) -> anyhow::Result<Self> {
        let fingerprints = catalog.register_fingerprints(fingerprints).await?;
        let version = |name: &str| InputVersion {
            hash: ContentHash::of(name.as_bytes()),
            stat: "1 2 3".to_owned(),
        };
        let inputs = [version("mesh.stl"), version("print.png")];
        let fake = Self {
            worker: WorkerId(0),
            fingerprints,
            checkpoints: checkpoints(fingerprints, &inputs),
        };
        fake.another_worker(catalog).await
    }

    /// Registers another worker.
    pub(super) async fn another_worker(&self, catalog: &Catalog) -> anyhow::Result<Self> {
        let info = WorkerInfo {
            host: "bench".to_owned(),
            pid: std::process::id(),
            boot_id: None,
        };
        let worker = catalog.register_worker(info, settings(self.fingerprints), 1);
        Ok(Self {
            worker: worker.await?,
            ..self.clone()
        })
    }

    /// Stores all stages of a pair in one commit.
    pub(super) async fn finish_at_once(
        &self,
        catalog: &Catalog,
        lease: Lease,
    ) -> anyhow::Result<()> {
        let stages = Stage::ALL.map(|stage| self.done(stage)).to_vec();
        match catalog.checkpoint(lease, stages).await? {
            CheckpointOutcome::Done => Ok(()),
            other => anyhow::bail!("the pair is not done: {other:?}"),
        }
    }

    /// Requests up to `slots` pairs.
    pub(super) fn request(&self, slots: usize) -> ClaimRequest {
        ClaimRequest::new(self.worker, slots, 1_000)
    }

    /// Stores the remaining stages of a pair, each in a commit.
    pub(super) async fn finish(&self, catalog: &Catalog, lease: Lease) -> anyhow::Result<()> {
        let mut lease = lease;
        loop {
            let done = self.done(lease.cursor());
            lease = match catalog.checkpoint(lease, vec![done]).await? {
                CheckpointOutcome::Lease(next) => next,
                CheckpointOutcome::Done => return Ok(()),
                CheckpointOutcome::Refused => anyhow::bail!("a lease was lost"),
            };
        }
    }

    /// Returns the checkpoint of a stage.
    pub(super) fn done(&self, stage: Stage) -> StageCheckpoint {
        self.checkpoints[stage.index()].clone()
    }
}

/// Returns a checkpoint of each stage, from the versions of mesh and print.
fn checkpoints(
    fingerprints: FingerprintIds,
    [mesh, print]: &[InputVersion; 2],
) -> Vec<StageCheckpoint> {
    let files = ArtifactSet::new();
    let checkpoint = |stage: Stage| {
        let last = stage == Stage::Register;
        let metrics = if last { metrics() } else { Vec::new() };
        let outcome = if last {
            json!(RegisterOutcome {
                ink: 0,
                metrics: metrics.iter().map(|metric| metric.outcome).collect(),
                features: None,
                levelling: None,
                displaced: None,
            })
        } else {
            json!({ "stage": stage })
        };
        let outcome = outcome.to_string();
        let reads_print = stage >= Stage::Normalize;
        // A run stores the versions of both files with the first stage.
        let inputs = if stage == Stage::Fit {
            InputVersions {
                mesh: Some(mesh.clone()),
                print: Some(print.clone()),
            }
        } else {
            InputVersions::default()
        };
        StageCheckpoint {
            stage,
            provenance: PairProvenance {
                fingerprint: fingerprints.of(stage),
                mesh_hash: Some(mesh.hash),
                print_hash: reads_print.then_some(print.hash),
                attributes: ATTRIBUTES.to_owned(),
            },
            result_hash: result_hash(&outcome, &files),
            outcome,
            files: files.clone(),
            metrics,
            inputs,
            ms: 1,
            at: 1,
            next_deadline: 2_000,
            alive_since: 0,
            write_began: Instant::now(),
        }
    };
    Stage::ALL.map(checkpoint).to_vec()
}

fn input(project: &Project, name: &str) -> anyhow::Result<InputVersion> {
    Ok(hash_input(&project.input(name))?)
}

/// Returns a result of each metric, all with a high confidence.
fn metrics() -> Vec<MetricResult> {
    let outcome = |metric| MetricOutcome {
        metric,
        threshold_level: 100,
        threshold_depth: 0.3,
        print_from_depth: Affine2::IDENTITY,
        angle_deg: 0.5,
        scale: 1.5,
        shift_px: [0.5; 2],
        scores: Scores {
            ssim: 0.5,
            nl_ssim: 0.5,
            iou: 0.5,
            iou_box: 0.5,
            dice: 0.5,
            density_print: 0.5,
            density_depth: 0.5,
        },
        disagreement: Disagreement::default(),
        margin: 0.5,
        confidence: Some(0.75),
        at_bound: false,
    };
    let outcomes = ThresholdMetric::ALL.map(outcome);
    let files = ArtifactSet::new();
    // With the hashes that `check` compares.
    metric_results(&outcomes, &files, Some(&files))
}
