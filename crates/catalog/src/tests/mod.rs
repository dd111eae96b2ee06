//! Tests of the catalog on real databases: files in the module `tests`, PostgreSQL in `tests_on_postgres`.

mod answers;
mod block_labels;
mod block_leases;
mod block_metadata;
mod block_pairs;
mod block_settings;
mod blocks;
mod claim_order;
mod control_points;
mod guards;
mod histories;
mod identity;
mod ignored_profiles;
mod import;
mod model;
mod pair_list;
mod place;
mod protocol;
mod recovery;
mod retired;
mod scan_corrections;
mod schema;
mod server_plans;
mod set_apart;
mod silence;
mod staleness;
mod state_machine;
mod together;
mod verdict_lists;
mod verdicts;
mod workers;

use std::time::{Duration, Instant};

use serde_json::{Map, json};

pub(crate) use self::place::CatalogPlace;
use super::db::query::query_scalar;
use super::{
    Catalog, CheckpointOutcome, ClaimRequest, DeadWorker, FailureAction, FingerprintIds,
    Fingerprints, ImportRow, InputVersion, InputVersions, Lease, LeaseHolder, MetricResult,
    PairProvenance, RerunPolicy, Result, RetrySelection, StageCheckpoint, StageFailure, WorkerInfo,
    WorkerSettings,
};
use mocban_core::domain::{
    Affine2, ArtifactSet, ContentHash, Disagreement, Failure, FailureClass, MetricOutcome,
    PairName, RegisterOutcome, Scores, Stage, ThresholdMetric, UnixMillis, WorkerId,
};

/// A catalog with a worker.
pub(crate) struct World {
    catalog: Catalog,
    fingerprints: FingerprintIds,
    worker: WorkerId,
    pub(crate) place: CatalogPlace,
}

fn name(text: &str) -> PairName {
    PairName::new(text).expect("a pair's name")
}

fn row(text: &str) -> ImportRow {
    ImportRow {
        name: name(text),
        mesh_path: format!("{text}.stl"),
        print_path: format!("{text}.png"),
        unit: None,
        scanned_face_down: None,
        character: None,
        block: None,
        meta: Map::new(),
        prior: None,
    }
}

fn fingerprints(revision: [u32; 4]) -> Fingerprints {
    Fingerprints::new(
        |stage| json!({ "revision": revision[stage.index()], "settings": { "seed": 0 } }),
    )
}

impl World {
    async fn new(pairs: usize) -> Self {
        Self::at(CatalogPlace::new(), pairs).await
    }

    pub(crate) async fn at(place: CatalogPlace, pairs: usize) -> Self {
        let catalog = place.create().await.expect("a catalog");
        let rows = (0..pairs).map(|n| row(&format!("p{n}"))).collect();
        catalog.import(rows, 1).await.expect("imported");
        let fingerprints = catalog
            .register_fingerprints(&fingerprints([1; 4]))
            .await
            .expect("fingerprints");
        let worker = register(&catalog).await;
        Self {
            catalog,
            fingerprints,
            worker,
            place,
        }
    }

    async fn claim(&self, slots: usize) -> Vec<Lease> {
        self.claim_as(self.worker, slots).await
    }

    async fn claim_as(&self, worker: WorkerId, slots: usize) -> Vec<Lease> {
        let request = ClaimRequest::new(worker, slots, 1_000);
        self.catalog.claim(request).await.expect("a claim")
    }

    /// Claims one pair that must run exclusively.
    async fn claim_exclusive(&self, worker: WorkerId) -> Vec<Lease> {
        let request = ClaimRequest {
            exclusive: true,
            ..ClaimRequest::new(worker, 1, 1_000)
        };
        self.catalog.claim(request).await.expect("a claim")
    }

    /// Registers a worker that recovers the leases of all other workers. Asserts the number of pairs made ready.
    async fn recovered_by_another(&self, pairs: u64) -> WorkerId {
        let other = register(&self.catalog).await;
        let recovered = self.catalog.recover(DeadWorker::AllExcept(other), 60).await;
        assert_eq!(recovered.expect("a recovery").ready, pairs);
        other
    }

    async fn crashes(&self, pair: &str) -> u32 {
        let detail = self.catalog.pair(&name(pair)).await.expect("a read");
        detail.expect("the pair").crashes
    }

    fn done(&self, stage: Stage) -> StageCheckpoint {
        done(self.fingerprints, stage)
    }

    /// Takes the next pair through all stages.
    async fn finish_one(&self) {
        self.finish_with(|_| ()).await;
    }

    /// Takes the next pair through all stages, with results that a function changes.
    async fn finish_with(&self, change: impl Fn(&mut StageCheckpoint)) {
        let mut lease = self.claim(1).await.pop().expect("a ready pair");
        loop {
            let mut done = self.done(lease.cursor());
            change(&mut done);
            match self.catalog.checkpoint_now(lease, done).await {
                Ok(CheckpointOutcome::Lease(next)) => lease = next,
                Ok(CheckpointOutcome::Done) => return,
                other => panic!("the checkpoint was not stored: {other:?}"),
            }
        }
    }

    async fn assert_counters(&self) {
        let kept = self.catalog.counters().await.expect("counters");
        assert_eq!(kept, self.catalog.recount().await.expect("a recount"));
        self.assert_plans_agree().await;
    }
}

impl World {
    /// Lets failed pairs run again, and no blocks. Returns the number of pairs.
    async fn retry(&self, pairs: &RetrySelection) -> Result<u64> {
        let blocks = RetrySelection::Names(Vec::new());
        let retried = self.catalog.retry_pairs_and_blocks(pairs, &blocks).await;
        retried.map(|[pairs, _]| pairs)
    }

    /// Retires a pair that is not retired yet.
    async fn retire(&self, pair: &str, at: UnixMillis) {
        let retired = self.catalog.retire_pairs(&[name(pair)], at).await;
        assert_eq!(retired.expect("retired"), 1);
    }

    /// Asserts that a plan for all pairs, made from counters, equals a plan that inspects each named pair. Asserts the
    /// same of the number of stale pairs.
    async fn assert_plans_agree(&self) {
        let names = self.catalog.pair_names().await.expect("names");
        for revision in [[1; 4], [1, 1, 2, 1]] {
            let fingerprints = fingerprints(revision);
            let selected = self.catalog.select(&names).await.expect("a read");
            let plan = |selection| {
                self.catalog
                    .plan(&fingerprints, selection, RerunPolicy::Changed)
            };
            let all = plan(None).await.expect("a plan");
            let each = plan(Some(&selected)).await.expect("a plan");
            assert_eq!(all, each, "{revision:?}");
            let stale = self
                .catalog
                .count_stale(&fingerprints)
                .await
                .expect("a read");
            let counted = self.count_stale(&fingerprints).await;
            assert_eq!(stale, counted, "{revision:?}");
        }
    }

    /// Counts stale pairs by inspecting every result.
    async fn count_stale(&self, fingerprints: &Fingerprints) -> u64 {
        let mut conn = self.catalog.read_conn().await.expect("a reader");
        let current = super::jobs::fingerprint::current_json(&mut conn, fingerprints).await;
        let n: i64 = query_scalar(
            "SELECT count(*) FROM job AS j JOIN pair AS p ON p.id = j.pair WHERE EXISTS (
                SELECT 1 FROM stage_result AS r WHERE r.pair = j.pair AND r.stage < j.stage AND (
                    r.fingerprint <> CAST(?1 ->> r.stage AS bigint) OR r.attributes <> p.attributes
                    OR r.mesh_hash <> p.mesh_hash AND NOT (j.status = 4 AND coalesce(p.mesh_stat, '') = 'gone')
                    OR r.print_hash <> p.print_hash
                        AND NOT (j.status = 4 AND coalesce(p.print_stat, '') = 'gone')))",
        )
        .bind(current.expect("fingerprints"))
        .fetch_one(&mut conn)
        .await
        .expect("a count");
        n.unsigned_abs()
    }
}

async fn register(catalog: &Catalog) -> WorkerId {
    let fingerprints = catalog.register_fingerprints(&fingerprints([1; 4])).await;
    enter(catalog, fingerprints.expect("fingerprints"), 1).await
}

/// Registers a worker at a time of its clock.
async fn enter(catalog: &Catalog, fingerprints: FingerprintIds, clock: UnixMillis) -> WorkerId {
    let info = WorkerInfo {
        host: "here".to_owned(),
        pid: 1,
        boot_id: None,
    };
    let settings = WorkerSettings {
        fingerprints,
        blocks: blocks::settings([1; 4]),
    };
    let entered = catalog.register_worker(info, settings, clock);
    entered.await.expect("a worker")
}

fn done(fingerprints: FingerprintIds, stage: Stage) -> StageCheckpoint {
    let register = RegisterOutcome {
        ink: 0,
        metrics: ThresholdMetric::ALL.map(metric).to_vec(),
        features: None,
        levelling: None,
        displaced: None,
    };
    let last = stage == Stage::Register;
    let metrics = register.metrics.iter().map(|outcome| MetricResult {
        outcome: *outcome,
        result_hash: ContentHash::of(outcome.metric.name().as_bytes()),
    });
    StageCheckpoint {
        stage,
        provenance: PairProvenance::new(
            fingerprints.of(stage),
            &inputs(stage),
            json!({ "scanned_face_down": null, "unit": null }).to_string(),
        ),
        outcome: if last {
            json!(register).to_string()
        } else {
            "{}".to_owned()
        },
        files: ArtifactSet::new(),
        result_hash: ContentHash::of(stage.name().as_bytes()),
        metrics: if last { metrics.collect() } else { Vec::new() },
        inputs: inputs(stage),
        ms: 5,
        at: 100,
        next_deadline: 2_000,
        alive_since: 0,
        write_began: Instant::now(),
    }
}

/// Returns a failure of a stage that read its inputs.
fn failed(
    fingerprints: FingerprintIds,
    stage: Stage,
    failure: Failure,
    action: FailureAction,
) -> StageFailure {
    let StageCheckpoint {
        provenance, inputs, ..
    } = done(fingerprints, stage);
    StageFailure {
        stage,
        failure,
        action,
        provenance,
        inputs,
        ms: Some(3),
        at: 50,
        alive_since: 0,
    }
}

/// Returns a failure of the first stage at its files.
fn slow_disk(fingerprints: FingerprintIds, action: FailureAction) -> StageFailure {
    let failure = Failure::new(FailureClass::Io, "the disk is slow");
    failed(fingerprints, Stage::Fit, failure, action)
}

fn inputs(stage: Stage) -> InputVersions {
    let seen = |text: &str| InputVersion {
        hash: ContentHash::of(text.as_bytes()),
        stat: format!("{text} stat"),
    };
    InputVersions {
        mesh: Some(seen("mesh")),
        print: (stage >= Stage::Normalize).then(|| seen("print")),
    }
}

fn metric(metric: ThresholdMetric) -> MetricOutcome {
    MetricOutcome {
        metric,
        threshold_level: 700,
        threshold_depth: 0.1 + 0.2,
        print_from_depth: Affine2::similarity(1.5, 0.1, [1.0, 2.0]),
        angle_deg: 0.1_f64.to_degrees(),
        scale: 1.5,
        shift_px: [0.25, -0.5],
        scores: Scores {
            ssim: 0.8,
            nl_ssim: 0.81,
            iou: 0.7,
            iou_box: 0.9,
            dice: 0.82,
            density_print: 0.3,
            density_depth: 0.31,
        },
        disagreement: Disagreement {
            pieces: 2,
            missing_ink: 0.1 + 0.2,
            missing_wood: 0.01,
        },
        margin: 0.2,
        confidence: Some(0.1 + 0.2),
        at_bound: false,
    }
}

/// Returns workers that were observed just now and may be dead.
fn observed(workers: Vec<LeaseHolder>) -> DeadWorker {
    let valid_until = Instant::now() + Duration::from_hours(1);
    DeadWorker::Observed {
        workers,
        valid_until,
    }
}
