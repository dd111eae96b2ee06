//! Catalogs of older versions of the program open with everything they hold.

use std::path::{Path, PathBuf};

use serde_json::json;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions as _, Connection as _, SqliteConnection};

use super::{metric, name, row};
use crate::catalog::db::open;
use crate::catalog::{Catalog, Look, NewVerdict};
use crate::domain::{MetricOutcome, ThresholdMetric, Verdict};

/// What version 1 of the schema could hold of metrics.
const OLD: [ThresholdMetric; 3] = [
    ThresholdMetric::NlSsim,
    ThresholdMetric::Density,
    ThresholdMetric::Ensemble,
];

/// A finished pair with three metrics and two verdicts, one of them taken back, as version 1 wrote them.
const ROWS: &str = "
INSERT INTO worker (id, host, pid, started, beat) VALUES (1, 'here', 1, 1, 1);
INSERT INTO recipe (id, stage, hash, fields) VALUES (1, 3, zeroblob(32), '{}');
INSERT INTO pair (id, name, mesh_path, print_path, meta, facts, imported)
    VALUES (1, 'p0', 'p0.stl', 'p0.png', '{}', '{}', 1);
INSERT INTO job (pair, stage, status) VALUES (1, 4, 3);
UPDATE counter SET n = 1 WHERE stage = 4 AND status = 3;
INSERT INTO metric_result
    SELECT 1, value, 700, 0.3, '[[1,0,0],[0,1,0]]', 5.7, 1.5, 0.25, -0.5, 0.8, 0.81, 0.7, 0.9, 0.82, 0.3, 0.31,
        0.2, 1, randomblob(32) FROM json_each('[\"nl_ssim\",\"density\",\"ensemble\"]');
INSERT INTO verdict (id, act, pair, metric, result_hash, verdict, reader, reason, note, at)
    SELECT 7, 7, 1, metric, result_hash, 'fail', 'ana', 'angle', 'upside down', 5
    FROM metric_result WHERE metric = 'density';
INSERT INTO verdict (id, act, pair, metric, result_hash, verdict, reader, at)
    VALUES (9, 9, 1, 'ensemble', zeroblob(32), 'pass', 'bo', 6);
INSERT INTO verdict_undo (act, at) VALUES (9, 8);";

async fn connection(path: &Path) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(path);
    let options = options.create_if_missing(true).foreign_keys(true);
    options.connect().await.expect("a connection")
}

/// A catalog of version 1 with rows.
async fn old_catalog(dir: &Path) -> PathBuf {
    let path = dir.join("catalog.sqlite");
    let mut conn = connection(&path).await;
    let made = open::MIGRATOR.run_to(1, &mut conn).await;
    made.expect("the first schema");
    sqlx::raw_sql(ROWS).execute(&mut conn).await.expect("rows");
    let metrics = OLD.map(|kind| {
        let mut numbers = json!(metric(kind));
        let fields = numbers.as_object_mut().expect("an object");
        fields.remove("confidence");
        numbers
    });
    let stored = sqlx::query(
        "INSERT INTO stage_result (pair, stage, recipe, mesh_hash, print_hash, facts, outcome, files, result_hash,
            ms, worker, at)
        VALUES (1, 3, 1, zeroblob(32), zeroblob(32), '{}', ?1, '{}', zeroblob(32), 5, 1, 1)",
    )
    .bind(json!({ "metrics": metrics }).to_string())
    .execute(&mut conn)
    .await;
    stored.expect("a result");
    conn.close().await.expect("closed");
    path
}

/// Every row of the two tables that are made anew, as text.
async fn rows(path: &Path) -> Vec<String> {
    let mut conn = connection(path).await;
    let found = sqlx::query_scalar(
        "SELECT 'm' || pair || metric || threshold_level || threshold_depth || print_from_depth || angle_deg || scale
            || shift_x_px || shift_y_px || ssim || nl_ssim || iou || iou_box || dice || density_print || density_depth
            || margin || at_bound || hex(result_hash) FROM metric_result
        UNION ALL SELECT 'v' || id || act || pair || metric || hex(result_hash) || verdict || reader
            || coalesce(reason, '-') || coalesce(note, '-') || at FROM verdict ORDER BY 1",
    )
    .fetch_all(&mut conn)
    .await;
    found.expect("rows")
}

#[tokio::test]
async fn results_and_verdicts_of_the_first_schema_survive() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = old_catalog(dir.path()).await;
    let before = rows(&path).await;
    assert_eq!(before.len(), 5);
    let catalog = Catalog::open_read_only(&path).await.expect("it opens");
    assert_eq!(rows(&path).await, before);
    let detail = catalog.pair(&name("p0")).await.expect("a read");
    let detail = detail.expect("the pair");
    let found: Vec<_> = detail.results.metrics.iter().map(|m| m.outcome).collect();
    let wanted = OLD.map(|kind| MetricOutcome {
        confidence: None,
        ..metric(kind)
    });
    assert_eq!(found, wanted);
    let density = detail.results.metric(ThresholdMetric::Density);
    let read = &density.expect("the metric").verdicts;
    assert_eq!((read.len(), read[0].verdict), (1, Verdict::Fail));
    let log: Vec<_> = detail.verdict_log.iter().map(|e| (e.id, e.act)).collect();
    assert_eq!(log, [(7, 7), (9, 9)]);
    assert_eq!(detail.verdict_log[1].undone_at, Some(8));
    catalog.close().await;
}

#[tokio::test]
async fn a_migrated_catalog_goes_on_like_a_new_one() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = old_catalog(dir.path()).await;
    let catalog = Catalog::open(&path).await.expect("it opens");
    let more = catalog.import(vec![row("p1")], 2).await.expect("imported");
    assert_eq!(more.added, 1);
    let verdict = NewVerdict {
        pair: name("p0"),
        metric: Some(ThresholdMetric::Ensemble),
        verdict: Verdict::Pass,
        reviewer: "ana".to_owned(),
        reason: None,
        note: None,
        look: Look::default(),
        at: None,
    };
    catalog.verdict_set(vec![verdict], 9).await.expect("stored");
    let log = catalog.verdict_log(None).await.expect("a log");
    assert_eq!(log.last().map(|event| event.id), Some(10));
    catalog.close().await;
    let mut conn = connection(&path).await;
    for sql in ["UPDATE verdict SET reader = 'bo'", "DELETE FROM verdict"] {
        assert!(sqlx::query(sql).execute(&mut conn).await.is_err(), "{sql}");
    }
    let broken: Vec<String> = sqlx::query_scalar("SELECT * FROM pragma_integrity_check")
        .fetch_all(&mut conn)
        .await
        .expect("a check");
    assert_eq!(broken, ["ok"]);
}
