//! What a stage that computes nothing stores.

use mocban::catalog::{Catalog, ClaimRequest, WorkerInfo};
use mocban::catalog::{
    CheckpointOutcome, FingerprintIds, Fingerprints, InputVersion, InputVersions, Lease,
    MetricResult, StageCheckpoint,
};
use mocban::domain::{
    Affine2, ArtifactSet, ContentHash, MetricOutcome, RegisterOutcome, Scores, Stage,
    ThresholdMetric, WorkerId,
};
use mocban::runner::result_hash;
use mocban::store::{Project, hash_input};
use serde_json::json;

/// What the manifest of the bench says that results depend on, as the catalog writes it.
pub(super) const FACTS: &str = r#"{"scanned_face_down":null,"unit":null}"#;

/// Faked stages with the fingerprints and inputs of a project.
#[derive(Debug, Clone)]
pub(super) struct Fake {
    pub(super) worker: WorkerId,
    fingerprints: FingerprintIds,
    mesh: InputVersion,
    print: InputVersion,
}

impl Fake {
    /// Enters a worker.
    pub(super) async fn enter(
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
        Ok(Self {
            worker: catalog.register_worker(info, fingerprints, 1).await?,
            fingerprints,
            mesh: seen(project, "mesh.stl")?,
            print: seen(project, "print.png")?,
        })
    }

    /// Asks for so many pairs.
    pub(super) fn request(&self, slots: usize) -> ClaimRequest {
        ClaimRequest::new(self.worker, slots, 1_000)
    }

    /// Takes a pair through the stages it has before it.
    pub(super) async fn through(&self, catalog: &Catalog, lease: Lease) -> anyhow::Result<()> {
        let mut lease = lease;
        loop {
            let done = self.done(lease.cursor());
            lease = match catalog.checkpoint(lease, done).await? {
                CheckpointOutcome::Lease(next) => next,
                CheckpointOutcome::Done => return Ok(()),
                CheckpointOutcome::LeaseLost => anyhow::bail!("a lease was lost"),
            };
        }
    }

    /// A stage's checkpoint.
    pub(super) fn done(&self, stage: Stage) -> StageCheckpoint {
        let files = ArtifactSet::new();
        let last = stage == Stage::Register;
        let metrics = if last { metrics() } else { Vec::new() };
        let outcome = if last {
            json!(RegisterOutcome {
                ink: 0,
                metrics: metrics.iter().map(|metric| metric.outcome).collect(),
                features: None,
            })
        } else {
            json!({ "stage": stage })
        };
        let outcome = outcome.to_string();
        let sees_print = stage >= Stage::Normalize;
        StageCheckpoint {
            stage,
            fingerprint: self.fingerprints.of(stage),
            mesh_hash: self.mesh.hash,
            print_hash: sees_print.then_some(self.print.hash),
            attributes: FACTS.to_owned(),
            result_hash: result_hash(&outcome, &files),
            outcome,
            files,
            metrics,
            inputs: self.seen(stage),
            ms: 1,
            at: 1,
            next_deadline: 2_000,
            alive_since: 0,
        }
    }

    /// Input files as a run tells of them: with the stage that reads them first.
    fn seen(&self, stage: Stage) -> InputVersions {
        if stage > Stage::Fit {
            return InputVersions::default();
        }
        InputVersions {
            mesh: Some(self.mesh.clone()),
            print: Some(self.print.clone()),
        }
    }
}

fn seen(project: &Project, name: &str) -> anyhow::Result<InputVersion> {
    Ok(hash_input(&project.dir().join(name))?.into())
}

/// A row for each metric, all sure of themselves.
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
        margin: 0.5,
        confidence: Some(0.75),
        at_bound: false,
    };
    ThresholdMetric::ALL
        .map(|metric| MetricResult {
            outcome: outcome(metric),
            result_hash: ContentHash::of(metric.name().as_bytes()),
        })
        .to_vec()
}
